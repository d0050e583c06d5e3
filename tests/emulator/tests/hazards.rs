//! Each row of the hazard table in the book names a test that exists.

use std::path::Path;

#[test]
fn every_hazard_names_a_test_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = std::fs::read_to_string(root.join("docs/src/hazards.md")).expect("the page");
    let rows: Vec<&str> =
        page.lines().filter(|line| line.starts_with("| ") && line.contains("`: `")).collect();
    let others = page.lines().filter(|line| line.starts_with('|')).count() - rows.len();
    assert_eq!(others, 2, "beside the head of the table, every row names a test");
    assert!(rows.len() >= 20, "{} rows", rows.len());
    for row in rows {
        let test = row.trim_end_matches([' ', '|']).rsplit("| ").next().expect("a last column");
        let (file, name) = test.split_once(": ").expect("a file and a test");
        let (file, name) = (file.trim_matches('`'), name.trim_matches('`'));
        let text = std::fs::read_to_string(root.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
        let written =
            if file.ends_with(".py") { format!("def {name}(self)") } else { format!("#[test]\nfn {name}()") };
        let indented = written.replace('\n', "\n    ");
        // A property test has arguments.
        let property = format!("    #[test]\n    fn {name}(\n");
        let found = [written, indented, property].iter().any(|w| text.contains(w));
        assert!(found, "{file} has no test `{name}`");
    }
}
