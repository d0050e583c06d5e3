//! Prints the page of criteria as Markdown: `cargo run -p pam-diagnose --example criteria`.

fn main() {
    print!("{}", pam_diagnose::criteria::markdown());
}
