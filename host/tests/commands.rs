//! The command line as a whole: help with examples, manual pages, and where an option's value comes from.

#![allow(clippy::unwrap_used)] // what fails here fails the test

use std::path::Path;
use std::process::Command;

use clap::CommandFactory;
use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

fn host(folder: &Path, arguments: &[&str], port: Option<&str>) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host"));
    // Settings of anyone who runs the tests do not count.
    command.args(arguments).current_dir(folder).env("XDG_CONFIG_HOME", folder).env_remove("PAM_SETTINGS");
    match port {
        Some(port) => command.env("PAM_PORT", port),
        None => command.env_remove("PAM_PORT"),
    };
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr) + String::from_utf8_lossy(&output.stdout);
    (output.status.code().unwrap(), said.into_owned())
}

#[test]
fn every_command_has_help_with_an_example() {
    fn visit(command: &clap::Command, path: &str, poor: &mut Vec<String>) {
        let subs: Vec<_> = command.get_subcommands().collect();
        if subs.is_empty() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            if !help.contains("Example") || !help.contains(path) || command.get_about().is_none() {
                poor.push(path.to_owned());
            }
        }
        for sub in subs {
            visit(sub, &format!("{path} {}", sub.get_name()), poor);
        }
    }
    let mut poor = Vec::new();
    visit(&host::cli::Cli::command(), "host", &mut poor);
    assert!(poor.is_empty(), "without an example of their own: {poor:?}");
}

#[test]
fn help_fits_the_terminal_and_its_examples_can_be_copied() {
    fn visit(command: &clap::Command, path: &[&str], wrong: &mut Vec<String>) {
        // A wrapped example is two commands; a long one is continued on purpose.
        let below = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        wrong.extend(
            below.lines().filter(|l| l.starts_with(' ') && l.chars().count() > 80).map(str::to_owned),
        );
        for (columns, most) in [("60", 60), ("80", 80), ("240", 100)] {
            let output = Command::new(env!("CARGO_BIN_EXE_host"))
                .args(path)
                .arg("--help")
                .env("COLUMNS", columns)
                .env_remove("PAM_PORT")
                .output()
                .unwrap();
            let text = String::from_utf8(output.stdout).unwrap();
            let named =
                |l: &str| l.starts_with("Usage:") || l.contains('<') && l.trim_start().starts_with('-');
            wrong.extend(
                text.lines()
                    .filter(|l| l.chars().count() > most && !named(l))
                    .map(|l| format!("{path:?} at {columns}: {l}")),
            );
        }
        for sub in command.get_subcommands() {
            visit(sub, &[path, &[sub.get_name()]].concat(), wrong);
        }
    }
    let mut wrong = Vec::new();
    visit(&host::cli::Cli::command(), &[], &mut wrong);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_command_with_a_result_gives_it_as_json_too() {
    fn visit(command: &clap::Command, path: &str, poor: &mut Vec<String>) {
        let subs: Vec<_> = command.get_subcommands().collect();
        if subs.is_empty() && command.get_arguments().all(|a| a.get_id() != "json") {
            poor.push(path.to_owned());
        }
        for sub in subs {
            visit(sub, &format!("{path} {}", sub.get_name()), poor);
        }
    }
    let mut poor = Vec::new();
    visit(&host::cli::Cli::command(), "host", &mut poor);
    // A conversation, a shell's script and pages for `man` are none.
    assert_eq!(poor, ["host new", "host completions", "host man"]);
}

#[test]
fn every_json_names_its_schema() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let rows: String = (0..12).map(|i| format!("{i},300,{0},{1}\n", 0.1 * f64::from(i), 50 - i)).collect();
    write("a.csv", &format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}"));
    let table =
        pam_fit::table_file::TableFile { table: model_core::table::example(), about: Default::default() };
    table.write(folder.path().join("t.pam")).unwrap();
    for (call, schema) in [
        ("effects --json", "pam-effects/1"),
        ("effects backlash --json", "pam-effect/1"),
        ("settings --json", "pam-settings/1"),
        ("table show t.pam --json", "pam-table/1"),
        ("table check t.pam --json", "pam-check/1"),
        ("table export t.pam -o t.h --json", "pam-export/1"),
        ("predict --quiet --table t.pam a.csv --json -", "pam-predict/1"),
        ("compare a.csv a.csv --json", "pam-compare/1"),
        ("device list --json", "pam-ports/1"),
        ("emulate --quiet --on native --seconds 0.01 --json", "pam-emulate/1"),
    ] {
        let (status, said) = host(folder.path(), &call.split(' ').collect::<Vec<_>>(), None);
        let value = published_schemas::valid(&said);
        assert_eq!((status, value["schema"].as_str()), (0, Some(schema)), "{call}: {said}");
    }
}

#[test]
fn two_results_do_not_share_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    for call in [
        "fit --muscle m.toml a.csv --json - -o -",
        "fit --muscle m.toml a.csv --json - --report -",
        "diagnose --muscle m.toml a.csv -o - --next -",
        "diagnose --muscle m.toml a.csv --json - --report -",
        "predict --table t.pam a.csv --json - -o -",
        "compare a.csv b.csv --json --report -",
        "effects backlash --json --report -",
        "table export t.pam -o - --json",
        "flash t.pam --port tcp:127.0.0.1:1 --backup - --json",
    ] {
        let (status, said) = host(folder.path(), &call.split(' ').collect::<Vec<_>>(), None);
        assert!(status == 2 && said.contains("would all go to standard output"), "{call}: {status} {said}");
    }
    // One may, and then words for people are not part of it.
    let output = Command::new(env!("CARGO_BIN_EXE_host"))
        .args(["effects", "backlash", "--report", "-"])
        .current_dir(folder.path())
        .env_remove("PAM_SETTINGS")
        .env("XDG_CONFIG_HOME", folder.path())
        .output()
        .unwrap();
    let page = String::from_utf8(output.stdout).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.trim_end().ends_with("</html>"), "{page:.200}");
}

#[test]
fn there_is_a_manual_page_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let (status, said) = host(folder.path(), &["man", "-o", "man1"], None);
    assert_eq!(status, 0, "{said}");
    for (page, word) in [
        ("host.1", "diagnose"),
        ("host-fit.1", "tip\\-correction"),
        ("host-record.1", "mcap"),
        ("host-device-log.1", "seconds"),
    ] {
        let text = std::fs::read_to_string(folder.path().join("man1").join(page)).unwrap();
        assert!(text.contains(".TH") && text.contains(word), "{page}: {text}");
    }
    // Examples are lines to be copied: none is joined with the next or hyphenated.
    let fit = std::fs::read_to_string(folder.path().join("man1/host-fit.1")).unwrap();
    assert!(fit.contains(".SH EXAMPLES\n.nf\n  host fit \\-\\-muscle mini.toml"), "{fit}");
    // Pages of `help fit` would say what `man host-fit` says.
    assert!(!folder.path().join("man1/host-help.1").exists());
}

#[test]
fn the_command_line_has_priority_over_the_environment_and_that_over_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let deep = folder.path().join("a/b");
    std::fs::create_dir_all(&deep).unwrap();
    std::fs::write(folder.path().join("pam.toml"), "port = \"tcp:127.0.0.1:1\"\nmuscle = \"mini.toml\"\n")
        .unwrap();
    let tried = |arguments: &[&str], port| {
        let (status, said) = host(&deep, arguments, port);
        assert_eq!(status, 1, "nothing listens there: {said}");
        said
    };
    assert!(tried(&["device", "info"], None).contains("tcp:127.0.0.1:1`"));
    assert!(tried(&["device", "info"], Some("tcp:127.0.0.1:2")).contains("tcp:127.0.0.1:2`"));
    let named = tried(&["device", "info", "--port", "tcp:127.0.0.1:3"], Some("tcp:127.0.0.1:2"));
    assert!(named.contains("tcp:127.0.0.1:3`"), "{named}");
    // A nearer file goes before one above it, and a path is one from its file's folder.
    std::fs::write(deep.join("pam.toml"), "port = \"tcp:127.0.0.1:4\"\n").unwrap();
    assert!(tried(&["device", "info"], None).contains("tcp:127.0.0.1:4`"));
    std::fs::remove_file(deep.join("pam.toml")).unwrap();
    let said = tried(&["fit", "x.csv"], None);
    assert!(said.contains("mini.toml") && !said.contains("a/b"), "{said}");
}

#[test]
fn a_wrong_settings_file_stops_everything_but_to_vent() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pam.toml"), "\n\nporr = \"x\"\n").unwrap();
    let (status, said) = host(folder.path(), &["effects"], None);
    assert!(
        status == 1 && said.contains("error[settings::invalid]") && said.contains("pam.toml:3"),
        "{said}"
    );
    assert!(said.contains("did you mean port"), "{said}");
    let (status, said) = host(folder.path(), &["vent", "--port", "tcp:127.0.0.1:1"], None);
    assert!(status == 1 && said.contains("error[device::port]"), "{said}");
}

/// A line of a shell as words: quotes hold words together, a comment ends it.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '\'' => quoted = !quoted,
            '#' if !quoted && words.last().is_some_and(String::is_empty) => break,
            c if c.is_whitespace() && !quoted => words.push(String::new()),
            c => words.last_mut().unwrap().push(c),
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

#[test]
fn commands_that_the_readme_and_the_help_show_are_understood() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let mut lines: Vec<String> =
        std::fs::read_to_string(readme).unwrap().lines().map(str::to_owned).collect();
    fn helps(command: &clap::Command, lines: &mut Vec<String>) {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        lines.extend(help.replace("\\\n", " ").lines().map(|l| l.trim().to_owned()));
        command.get_subcommands().for_each(|sub| helps(sub, lines));
    }
    helps(&host::cli::Cli::command(), &mut lines);
    // Lines with pipes, redirections or continuations are a shell's business.
    let plain = |l: &&String| {
        l.starts_with("host ")
            && !l.contains(['|', '>', '`', '&'])
            && !l.ends_with('\\')
            && !l.contains("--port or")
    };
    let mut seen = 0;
    for line in lines.iter().filter(plain) {
        let outcome = host::cli::Cli::command().try_get_matches_from(words(line));
        assert!(outcome.is_ok(), "`{line}`: {}", outcome.unwrap_err());
        seen += 1;
    }
    assert!(seen > 40, "only {seen} commands were found");
}

#[test]
fn the_second_name_is_the_same_program() {
    let said = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_pam")).args(arguments).env_remove("PAM_PORT").output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    let help = said(&["fit", "--help"]);
    assert!(help.contains("Usage: pam fit") && help.contains("  pam fit --muscle"), "{help}");
    assert!(!help.contains("host fit"), "{help}");
    assert!(said(&["--version"]).starts_with("pam "));
    assert!(said(&["completions", "bash"]).contains("complete -F _pam"));
    assert!(said(&["man"]).contains("pam"));
    // Remedies name the command that this system has.
    let missing =
        Command::new(env!("CARGO_BIN_EXE_pam")).args(["table", "check", "none.pam"]).output().unwrap();
    let text = String::from_utf8(missing.stderr).unwrap();
    assert!(text.contains("`pam fit`") && !text.contains("`host"), "{text}");
    // The advice on pages does, too.
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let muscle = Muscle::<f64>::build(&model_core::table::example()).unwrap();
    let mut rows = "time_s,pressure_kPa,displacement_mm,force_N\n".to_owned();
    for (i, kpa) in [200.0, 300.0, 400.0].into_iter().enumerate() {
        for j in 0..60 {
            let (mm, direction) = if j < 30 { (j, 1.0) } else { (60 - j, -1.0) };
            let mm = 0.08 * f64::from(mm);
            let force =
                muscle.force(Pressure::from_pascals(1e3 * kpa), Length::from_metres(1e-3 * mm), direction);
            rows += &format!("{},{kpa},{mm},{}\n", 60 * i as i32 + j, force.newtons());
        }
    }
    std::fs::write(at("a.csv"), rows).unwrap();
    std::fs::write(at("m.toml"), include_str!("../../examples/muscles/mini.toml")).unwrap();
    said(&["fit", "--muscle", &at("m.toml"), &at("a.csv"), "-o", &at("m.pam"), "--report", &at("r.html")]);
    let html = std::fs::read_to_string(at("r.html")).unwrap();
    assert!(html.contains("<code>pam predict") && !html.contains("<code>host"), "{html}");
}

/// A slow stroke of 40 rows in a folder, with a description of its muscle.
fn with_a_recording(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..40)
        .map(|i| f64::from(i) / 20.0 - 1.0)
        .enumerate()
        .map(|(i, x)| {
            format!("{},300,{},{}\n", 0.05 * i as f64, 4.0 * (1.0 - x.abs()), 90.0 - 20.0 * (1.0 - x.abs()))
        })
        .collect();
    std::fs::write(folder.path().join(name), format!("time_s,pressure_kPa,displacement_mm,force_N\n{rows}"))
        .unwrap();
    let muscle = "name = \"m\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
                  bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n";
    std::fs::write(folder.path().join("m.toml"), muscle).unwrap();
    folder
}

#[test]
fn two_outputs_in_one_file_are_refused_before_anything_is_written() {
    let folder = with_a_recording("a.csv");
    for outputs in [["-o", "x.pam", "--json", "./x.pam"], ["--json", "x.html", "--report", "x.html"]] {
        let call = [&["fit", "--muscle", "m.toml", "a.csv"][..], &outputs].concat();
        let (status, said) = host(folder.path(), &call, None);
        assert!(status == 2 && said.contains("name the same file"), "{said}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn the_command_behind_a_guess_can_be_copied() {
    let folder = with_a_recording("my run.csv");
    let (status, said) =
        host(folder.path(), &["import", "--guess", "my run.csv", "-o", "my bench.toml"], None);
    assert!(status == 0 && said.contains("--import 'my bench.toml' 'my run.csv'"), "{said}");
}

#[test]
fn a_filter_names_what_it_cannot_do() {
    let folder = with_a_recording("a.csv");
    let fit =
        |filter: &str| host(folder.path(), &["fit", "--muscle", "m.toml", "a.csv", "--where", filter], None);
    let (status, said) = fit("force_N>=1");
    assert!(status == 2 && said.contains("does not compare by `>=`"), "{said}");
    let (status, said) = fit("pressure_kPa!=99");
    assert!(
        status == 2 && said.contains("no row has this value") && said.contains("is one of 300"),
        "{said}"
    );
}
