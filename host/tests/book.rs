//! The book's commands are run, their output is compared, its tables are made from the source.
//!
//! In a ```` ```console ```` block a line that begins with `$ ` is run by `sh` in a folder of the page's own; the lines after it are
//! what it prints. `…` alone on a line represents any lines. Numbers may differ by 2 %, for they belong to a seed and a compiler, and times
//! by 40 %; words may not. ```` ```toml file=NAME ```` writes a file first. Between `<!-- begin NAME -->` and `<!-- end -->` stands a
//! table that the source makes. A line `<!-- picture FILE -->` before an image says which file of that folder the image is.
//!
//! Did this fail after a change that was meant? Run `BOOK=overwrite cargo test -p host --test book`, and read the difference. With
//! `BOOK_PAGE=diagnosis.md` only that page is checked.

#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use host::error::all_codes;
use model_core::link::endpoints;

fn book() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src")
}

fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    let mut folders = vec![book()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the book's folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// A folder with the two programs under their names.
fn programs(folder: &Path) -> PathBuf {
    let bin = folder.join(".bin");
    fs::create_dir_all(&bin).expect("a folder");
    let _ = std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_host"), bin.join("host"));
    // The bench is another package; its library is linked here already, so that this builds one small file.
    let script = format!(
        "#!/bin/sh\nexec \"{}\" run -q --manifest-path \"{}/../Cargo.toml\" -p virtual-bench -- \"$@\"\n",
        env!("CARGO"),
        env!("CARGO_MANIFEST_DIR")
    );
    let path = bin.join("virtual-bench");
    fs::write(&path, script).expect("a script");
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("an executable");
    bin
}

fn run(command: &str, folder: &Path, bin: &Path) -> (String, bool) {
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", &format!("exec 2>&1; {command}")])
        .current_dir(folder)
        .env("PATH", path)
        .env("NO_COLOR", "1")
        .env("COLUMNS", "100")
        // Settings of anyone who runs the tests do not count.
        .env("XDG_CONFIG_HOME", bin)
        .env_remove("PAM_SETTINGS")
        .env_remove("PAM_PORT")
        .env_remove("RUST_BACKTRACE")
        .output()
        .expect("a shell");
    let text = String::from_utf8_lossy(&output.stdout).replace(&folder.display().to_string(), ".");
    (text.trim_end().to_owned(), output.status.success())
}

/// How far a number may be from the book's: a share of it, and a unit of its last decimal.
/// Times belong to the machine.
fn near(expected: &str, actual: &str, unit: Option<&String>) -> bool {
    let (Ok(p), Ok(q)) = (expected.parse::<f64>(), actual.parse::<f64>()) else { return expected == actual };
    let time = unit
        .is_some_and(|u| ["s", "ms", "us", "µs", "min"].contains(&u.trim_end_matches([',', ';', ':', ')'])));
    let share = if time { 0.4 } else { 0.02 };
    let decimals = expected.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    // The word NaN is a number to `parse`, and no NaN is near another.
    expected == actual || (p - q).abs() <= share * p.abs().max(q.abs()) + 1.01 * 0.1_f64.powi(decimals as i32)
}

/// Words and numbers of a line; the amount of blanks between them does not matter.
fn alike(expected: &str, actual: &str) -> bool {
    let tokens = |line: &str| -> Vec<String> {
        let mut out = Vec::new();
        let mut token = String::new();
        for c in line.chars() {
            let numeric = |c: char| c.is_ascii_digit() || c == '.';
            let last = token.chars().last();
            if c.is_whitespace() || last.is_some_and(|l| numeric(l) != numeric(c)) {
                out.push(std::mem::take(&mut token));
            }
            if !c.is_whitespace() {
                token.push(c);
            }
        }
        out.push(token);
        out.retain(|t| !t.is_empty());
        out
    };
    let (a, b) = (tokens(expected), tokens(actual));
    a.len() == b.len() && a.iter().zip(&b).enumerate().all(|(i, (x, y))| near(x, y, a.get(i + 1)))
}

fn same(expected: &[String], actual: &[String]) -> bool {
    match expected.split_first() {
        None => actual.is_empty(),
        Some((first, rest)) if first.trim() == "…" => {
            (0..=actual.len()).any(|skipped| same(rest, &actual[skipped..]))
        }
        Some((first, rest)) => {
            actual.split_first().is_some_and(|(a, others)| alike(first, a) && same(rest, others))
        }
    }
}

/// Runs one page; returns its expected text, and the differences.
fn check(page: &Path, text: &str) -> (String, Vec<String>) {
    let name = page.strip_prefix(book()).unwrap_or(page).display().to_string();
    let folder =
        std::env::temp_dir().join(format!("pam-book-{}-{}", std::process::id(), name.replace('/', "-")));
    fs::create_dir_all(&folder).expect("a folder");
    let folder = folder.canonicalize().expect("a folder");
    let bin = programs(&folder);
    // Real recordings that the repository holds, for the pages that use them.
    let cylinder = Path::new(env!("CARGO_MANIFEST_DIR")).join("diagnose/tests/data/tudelft-printed-cylinder");
    let _ = std::os::unix::fs::symlink(cylinder, folder.join("cylinder"));
    let mut out: Vec<String> = Vec::new();
    let mut wrong = Vec::new();
    let lines: Vec<String> = text.lines().map(String::from).collect();
    let mut i = 0;
    while i < lines.len() {
        out.push(lines[i].clone());
        if let Some(made) = lines[i].strip_prefix("<!-- picture ").and_then(|l| l.strip_suffix(" -->")) {
            wrong.extend(picture(page, &folder.join(made), lines.get(i + 1).map_or("", String::as_str)));
        }
        let Some(info) = lines[i].strip_prefix("```").filter(|info| !info.is_empty()) else {
            i += 1;
            continue;
        };
        let end = (i + 1..lines.len()).find(|k| lines[*k] == "```").expect("a block that ends");
        let body = &lines[i + 1..end];
        if let Some(file) = info.split_whitespace().find_map(|word| word.strip_prefix("file=")) {
            fs::write(folder.join(file), body.join("\n") + "\n").expect("written");
        }
        if info.split_whitespace().next() == Some("console") {
            let mut k = 0;
            let mut success = true;
            while k < body.len() {
                let command = body[k].strip_prefix("$ ").expect("a command begins with `$ `");
                let next = (k + 1..body.len()).find(|n| body[*n].starts_with("$ ")).unwrap_or(body.len());
                let expected = &body[k + 1..next];
                let (printed, well) = run(command, &folder, &bin);
                success = well;
                let actual: Vec<String> = printed.lines().map(|l| l.trim_end().to_owned()).collect();
                out.push(body[k].clone());
                if same(expected, &actual) {
                    out.extend(expected.iter().cloned());
                } else {
                    wrong.push(format!(
                        "{name}: `{command}`\n--- the book\n{}\n--- the program\n{}",
                        expected.join("\n"),
                        actual.join("\n")
                    ));
                    out.extend(actual);
                }
                k = next;
            }
            if success == info.ends_with(" fails") {
                wrong.push(format!("{name}: the last command of a `{info}` block ends otherwise"));
            }
        } else {
            out.extend(body.iter().cloned());
        }
        out.push("```".into());
        i = end + 1;
    }
    let _ = fs::remove_dir_all(&folder);
    (out.join("\n") + "\n", wrong)
}

/// A picture that a command of the page has made, beside the one that the page shows in its next line: the same lettering, with
/// numbers as in a listing. `BOOK=overwrite` takes it over.
fn picture(page: &Path, made: &Path, shown: &str) -> Option<String> {
    let target =
        shown.rsplit_once("](").and_then(|(_, t)| t.strip_suffix(')')).expect("an image in the next line");
    let kept = page.parent().expect("a folder").join(target);
    let fresh = fs::read_to_string(made).unwrap_or_else(|e| panic!("{}: {e}", made.display()));
    if overwrite() {
        fs::create_dir_all(kept.parent().expect("a folder")).expect("a folder");
        fs::write(&kept, fresh).expect("written");
        return None;
    }
    let old = fs::read_to_string(&kept).unwrap_or_default();
    let (old, new) = (lettering(&old), lettering(&fresh));
    let same = old.len() == new.len() && old.iter().zip(&new).all(|(a, b)| alike(a, b));
    (!same).then(|| format!("{}: the picture {target} is not what the command draws", page.display()))
}

/// Everything that can be read in a picture: titles, axes, legends.
fn lettering(svg: &str) -> Vec<&str> {
    svg.split('<')
        .filter_map(|piece| piece.split_once('>'))
        .map(|(_, text)| text.trim())
        .filter(|t| !t.is_empty())
        .collect()
}

fn overwrite() -> bool {
    std::env::var("BOOK").is_ok_and(|v| v == "overwrite")
}

/// Tables that the source makes.
fn generated(name: &str) -> Option<String> {
    match name {
        "endpoints" => {
            let of = |name: &str| if name == "()" { "–".to_owned() } else { format!("`{name}`") };
            let rows = endpoints::TABLE.iter().map(|r| {
                let (request, answered) = (of(r.request), of(r.response));
                format!("| {} | `{}` | {request} | {answered} | {} |\n", r.id, r.name, r.what.trim())
            });
            Some(format!(
                "| number | endpoint | request | response | what it does |\n| ---: | --- | --- | --- | --- |\n{}",
                rows.collect::<String>()
            ))
        }
        "codes" => {
            let rows = all_codes().into_iter().map(|c| {
                let file = c.name().replace("::", "-");
                let title = fs::read_to_string(book().join(format!("trouble/{file}.md"))).unwrap_or_default();
                let says = title.lines().skip(2).find(|l| !l.is_empty()).unwrap_or_default();
                format!("| [`{}`]({file}.md) | {} | {says} |\n", c.name(), c.fault().exit_status())
            });
            Some(format!(
                "| code | exit status | in one sentence |\n| --- | --- | --- |\n{}",
                rows.collect::<String>()
            ))
        }
        "criteria" => Some(pam_diagnose::criteria::markdown()),
        _ => None,
    }
}

fn with_tables(text: &str) -> String {
    let mut out = String::new();
    let mut skipping = false;
    for line in text.lines() {
        if line == "<!-- end -->" {
            skipping = false;
        }
        if !skipping {
            out.push_str(line);
            out.push('\n');
        }
        if let Some(name) = line.strip_prefix("<!-- begin ").and_then(|l| l.strip_suffix(" -->")) {
            out.push_str(&generated(name).unwrap_or_else(|| panic!("no table is called {name}")));
            skipping = true;
        }
    }
    out
}

#[test]
fn every_command_of_the_book_prints_what_it_says() {
    let mut wrong = Vec::new();
    let only = std::env::var("BOOK_PAGE").unwrap_or_default();
    for page in pages().into_iter().filter(|p| only.is_empty() || p.ends_with(&only)) {
        let text = fs::read_to_string(&page).expect("a page");
        let (checked, differences) = check(&page, &text);
        let fresh = with_tables(&checked);
        if overwrite() {
            if fresh != text {
                fs::write(&page, fresh).expect("written");
            }
            continue;
        }
        if with_tables(&text) != text {
            wrong.push(format!("{}: a table is not what the source makes", page.display()));
        }
        wrong.extend(differences);
    }
    assert!(
        wrong.is_empty(),
        "{} differences; BOOK=overwrite takes them over:\n\n{}",
        wrong.len(),
        wrong.join("\n\n")
    );
}

#[test]
fn the_contents_list_every_page_and_no_other() {
    let contents = fs::read_to_string(book().join("SUMMARY.md")).expect("SUMMARY.md");
    for page in pages() {
        let path = page.strip_prefix(book()).expect("a page of the book").display().to_string();
        assert!(
            path == "SUMMARY.md" || contents.contains(&format!("({path})")),
            "{path} is not in SUMMARY.md"
        );
    }
    // The book calls a folder's page index.html; links that name the README must find it all the same.
    let settings = fs::read_to_string(book().join("../book.toml")).expect("book.toml");
    for page in pages().iter().filter(|p| p.ends_with("README.md")) {
        let folder = page.parent().and_then(|f| f.strip_prefix(book()).ok()).expect("a folder").display();
        assert!(
            settings.contains(&format!("\"/{folder}/README.html\" = ")),
            "book.toml redirects no {folder}/README.html"
        );
    }
    for link in contents.split("](").skip(1).filter_map(|l| l.split(')').next()) {
        assert!(book().join(link).is_file(), "SUMMARY.md names {link}, which is not there");
    }
}

#[test]
fn no_link_between_pages_is_dead() {
    for page in pages() {
        let text = fs::read_to_string(&page).expect("a page");
        let folder = page.parent().expect("a folder");
        for link in text.split("](").skip(1).filter_map(|l| l.split([')', '#', ' ']).next()) {
            let outside = link.is_empty() || link.contains("://");
            assert!(outside || folder.join(link).exists(), "{}: {link}", page.display());
        }
    }
}

#[test]
fn every_failure_has_its_page() {
    for code in all_codes() {
        let page = book().join(format!("trouble/{}.md", code.name().replace("::", "-")));
        let text = fs::read_to_string(&page).unwrap_or_default();
        assert!(
            text.starts_with(&format!("# {}\n", code.name())),
            "{} is missing or has another title",
            page.display()
        );
    }
}

#[test]
fn the_pins_in_the_book_are_those_of_the_board() {
    let book = fs::read_to_string(book().join("nucleo.md")).expect("nucleo.md");
    let board = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/src/boards/nucleo_f446re.rs");
    let source = fs::read_to_string(board).expect("the board's file");
    let rows: Vec<&str> = book.lines().filter(|l| l.starts_with("| P")).collect();
    assert!(rows.len() >= 4);
    for row in rows {
        let pins = row.split('|').nth(1).unwrap_or_default().trim();
        let line = source.lines().find(|l| l.contains(&format!("| {pins} |"))).unwrap_or_default();
        let arduino = row.split('|').nth(2).unwrap_or_default();
        assert!(line.contains(arduino.trim()), "{row}");
    }
}

#[test]
fn the_chapters_on_effects_are_those_of_this_program() {
    let fresh = std::env::temp_dir().join(format!("pam-effects-{}", std::process::id()));
    let status = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["effects", "--quiet", "--book"])
        .arg(&fresh)
        .status()
        .expect("host");
    assert!(status.success());
    for entry in fs::read_dir(&fresh).expect("chapters") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name");
        let committed = fs::read_to_string(book().join("effects").join(name)).unwrap_or_default();
        let (a, b) = (fs::read_to_string(&path).expect("a chapter"), committed);
        // Pictures differ in the last digit between processors, and so does the order of effects that are nearly the same.
        let ranked = |line: &str| line.starts_with("After a fit of the base model");
        let well = if name.to_string_lossy().ends_with(".md") {
            a.lines().count() == b.lines().count()
                && a.lines().zip(b.lines()).all(|(x, y)| alike(x, y) || ranked(x) && ranked(y))
        } else {
            !b.is_empty()
        };
        assert!(well, "run `host effects --book docs/src/effects`: {} differs", name.to_string_lossy());
    }
    let _ = fs::remove_dir_all(&fresh);
}
