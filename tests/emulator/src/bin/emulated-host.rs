//! The program `host`, built with these tests so that they can run it as a user does.

fn main() -> std::process::ExitCode {
    host::cli::main()
}
