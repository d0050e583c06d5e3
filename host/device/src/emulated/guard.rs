//! A program that does not outlive this one, however this one ends.
//!
//! A destructor ends a child of a program that ends in order. One that is stopped by `SIGKILL`, or by a machine without memory, runs
//! none, and a child that waits for no one would continue without end. So the child is started by a shell that holds the reading end of a
//! pipe, whose other end only this process has: when that closes, for any reason, the shell ends the child.

use std::process::{Command, Stdio};

/// Starts its arguments without input, ends them when its own input ends, and gives their status.
const GUARD: &str = r#"
exec 3<&0
"$@" </dev/null 3<&- &
child=$!
{ cat >/dev/null; kill -KILL "$child"; } <&3 3<&- 2>/dev/null &
guard=$!
exec 3<&- </dev/null
wait "$child"
status=$?
kill "$guard" 2>/dev/null
exit "$status"
"#;

/// A command for a program that ends with this process, to be given its arguments. Its [`Child`](std::process::Child) ends it when it
/// is waited for or dropped; where there is no such shell, as on Windows, it must be stopped too, and then only this process can do it.
///
/// Whether the program is there is queried first: the error of a shell would be another.
///
/// # Errors
/// The program cannot be started.
pub(crate) fn guarded(program: &str) -> std::io::Result<Command> {
    Command::new(program)
        .arg("--version")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()?;
    if !cfg!(unix) {
        return Ok(Command::new(program));
    }
    let mut command = Command::new("sh");
    command.args(["-c", GUARD, "guard", program]).stdin(Stdio::piped());
    Ok(command)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Read;
    use std::time::{Duration, Instant};

    #[test]
    fn the_end_of_the_pipe_is_the_end_of_the_program_and_its_own_end_gives_its_status() {
        let began = Instant::now();
        // `sleep` holds this output open as long as it lives.
        let mut child = guarded("sleep").unwrap().arg("600").stdout(Stdio::piped()).spawn().unwrap();
        let mut output = child.stdout.take().unwrap();
        assert!(child.try_wait().unwrap().is_none(), "it runs");
        drop(child.stdin.take());
        output.read_to_end(&mut Vec::new()).unwrap();
        child.wait().unwrap();
        assert!(began.elapsed() < Duration::from_secs(300), "it was waited for instead");
        let mut child = guarded("sh").unwrap().args(["-c", "exit 7"]).spawn().unwrap();
        // Waiting would close the pipe first.
        let pipe = child.stdin.take();
        assert_eq!(child.wait().unwrap().code(), Some(7));
        drop(pipe);
        assert!(guarded("no-such-program").is_err_and(|e| e.kind() == std::io::ErrorKind::NotFound));
    }
}
