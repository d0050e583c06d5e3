//! The committed pages of the book. A set of trials takes hours: the test that a page has the present wording of its writer shows when
//! one was changed without the other.

use std::path::Path;

/// Fails unless the page contains each text.
pub fn contains(page: &str, texts: &[&str]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src").join(page);
    let written = std::fs::read_to_string(&path).expect("a page of the book");
    for text in texts {
        assert!(written.contains(text), "docs/src/{page} lacks this text of its writer:\n{text}");
    }
}
