//! The program `pam`: the same as `host`, under a name that no system tool has.

fn main() -> std::process::ExitCode {
    host::cli::main()
}
