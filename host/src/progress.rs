//! How far a piece of work has come, and how long it still takes: one line on the terminal, nothing where the output is not a terminal.

use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pam_data::progress::Progress;

use crate::console::Console;

/// Time between two pictures of the line.
const REDRAW: Duration = Duration::from_millis(100);
/// Work that is done sooner shows no line at all: it would vanish before it could be read.
const PATIENCE: Duration = Duration::from_millis(400);
/// Width of the bar where the terminal has room for it, characters.
const BAR: usize = 24;
/// A bar narrower than this shows nothing.
const LEAST_BAR: usize = 6;
/// Width of a terminal that does not say its own.
const COLUMNS: usize = 80;

/// What is being done now, and since when.
#[derive(Debug)]
struct Stage {
    what: String,
    begun: Instant,
}

/// The line of one piece of work. Steps may be counted from several threads; the line goes when this is dropped.
///
/// ```
/// use pam_data::progress::Progress;
/// use host::progress::ProgressLine;
/// let progress = ProgressLine::silent();
/// progress.total(200);
/// (0..200).for_each(|_| progress.step());
/// assert_eq!(progress.done(), 200);
/// ```
#[derive(Debug)]
pub struct ProgressLine {
    stage: Mutex<Stage>,
    live: bool,
    begun: Instant,
    done: AtomicU64,
    total: AtomicU64,
    /// Milliseconds after `begun` when the line was last drawn; 0: never.
    drawn: AtomicU64,
}

impl ProgressLine {
    /// A line that begins with `what` is done, on a terminal and without `--quiet` only.
    #[must_use]
    pub fn new(console: &Console, what: impl Into<String>) -> Self {
        Self::begin(what.into(), console.live())
    }

    /// One that prints nothing, for libraries and tests.
    #[must_use]
    pub fn silent() -> Self {
        Self::begin(String::new(), false)
    }

    fn begin(what: String, live: bool) -> Self {
        let begun = Instant::now();
        Self {
            stage: Mutex::new(Stage { what, begun }),
            live,
            begun,
            done: AtomicU64::new(0),
            total: AtomicU64::new(0),
            drawn: AtomicU64::new(0),
        }
    }

    fn draw(&self, done: u64) {
        if !self.live {
            return;
        }
        let elapsed = self.begun.elapsed();
        let now = elapsed.as_millis() as u64;
        let last = self.drawn.load(Ordering::Relaxed);
        let due = now >= PATIENCE.as_millis() as u64 && now.saturating_sub(last) >= REDRAW.as_millis() as u64;
        // Of several threads that find the line due, one draws it.
        if due && self.drawn.compare_exchange(last, now, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
            let columns =
                terminal_size::terminal_size_of(std::io::stderr()).map_or(COLUMNS, |(w, _)| w.0.into());
            let total = self.total.load(Ordering::Relaxed);
            let text = line(&stage.what, done, total, stage.begun.elapsed(), columns);
            // One write that clears behind itself: an empty line between two pictures is a flicker.
            let _ = std::io::stderr().lock().write_all(format!("\r{text}\u{1b}[K").as_bytes());
        }
    }

    /// Steps done so far.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }
}

impl Progress for ProgressLine {
    fn total(&self, steps: u64) {
        self.total.store(steps, Ordering::Relaxed);
    }

    fn stage(&self, name: &str, steps: u64) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) =
            Stage { what: name.to_owned(), begun: Instant::now() };
        self.done.store(0, Ordering::Relaxed);
        self.total.store(steps, Ordering::Relaxed);
        // A part that cannot be counted must at least be named, however soon it comes after the last picture.
        self.drawn.fetch_min(
            self.drawn.load(Ordering::Relaxed).saturating_sub(REDRAW.as_millis() as u64),
            Ordering::Relaxed,
        );
        self.draw(0);
    }

    fn add(&self, steps: u64) {
        let before = self.done.fetch_add(steps, Ordering::Relaxed);
        self.draw(before.saturating_add(steps));
    }

    fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
        self.draw(done);
    }
}

impl Default for ProgressLine {
    fn default() -> Self {
        Self::silent()
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        if self.drawn.load(Ordering::Relaxed) > 0 {
            let _ = std::io::stderr().lock().write_all(b"\r\x1b[K");
        }
    }
}

/// The line: what, a bar, the share, and the time that is left if the rest goes as fast as what is done. It stays within the columns of the
/// terminal: one that continues in a second line could not be drawn over.
fn line(what: &str, done: u64, total: u64, elapsed: Duration, columns: usize) -> String {
    let room = columns.saturating_sub(1);
    let text = match (done, total) {
        (0, 0) => format!("{what} …"),
        (_, 0) => format!("{what}  {done}  {}", span(elapsed)),
        _ => {
            let done = done.min(total);
            let left = match done {
                0 => String::new(),
                _ => format!("  {} left", span(elapsed.mul_f64((total - done) as f64 / done as f64))),
            };
            let share = format!("{:3} %{left}", 100 * done / total);
            let wide = room.saturating_sub(what.chars().count() + 3 + share.chars().count()).min(BAR);
            let full = (wide as f64 * done as f64 / total as f64) as usize;
            let bar: String = (0..wide).map(|i| if i < full { '█' } else { '░' }).collect();
            if wide < LEAST_BAR { format!("{what} {share}") } else { format!("{what}  {bar} {share}") }
        }
    };
    text.chars().take(room).collect()
}

/// A time in a readable unit.
fn span(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_shows_share_and_remaining_time() {
        let quarter = line("fit", 25, 100, Duration::from_secs(20), 80);
        assert_eq!(quarter, "fit  ██████░░░░░░░░░░░░░░░░░░  25 %  1 min 00 s left");
        assert!(line("fit", 0, 100, Duration::from_secs(9), 80).ends_with("  0 %"));
        // More steps than were said is a wrong total, not a share above one.
        assert!(line("fit", 300, 100, Duration::from_secs(9), 80).ends_with("100 %  0 s left"));
        assert_eq!(line("record", 1234, 0, Duration::from_secs(5), 80), "record  1234  5 s");
        assert_eq!(line("weighing", 0, 0, Duration::from_secs(5), 80), "weighing …");
        assert_eq!(span(Duration::from_secs(7_260)), "2 h 01 min");
    }

    #[test]
    fn the_line_stays_within_the_terminal() {
        let what = "predicting each pressure from the others";
        for columns in 0..120 {
            for (done, total) in [(0, 0), (123_456, 0), (0, 10), (1, 2_000_000), (10, 10)] {
                let text = line(what, done, total, Duration::from_secs(5), columns);
                assert!(text.chars().count() < columns.max(1), "{columns}: {text}");
            }
        }
        let narrow = line(what, 1, 2, Duration::from_secs(70), 74);
        assert_eq!(narrow, "predicting each pressure from the others  ████░░░░  50 %  1 min 10 s left");
        assert_eq!(line(what, 1, 2, Duration::from_secs(70), 64), format!("{what}  50 %  1 min 10 s left"));
    }

    #[test]
    fn a_new_stage_restarts_the_count() {
        let progress = ProgressLine::silent();
        progress.stage("first", 3);
        progress.add(3);
        progress.stage("second", 5);
        progress.step();
        assert_eq!((progress.done(), progress.total.load(Ordering::Relaxed)), (1, 5));
        assert_eq!(progress.stage.lock().unwrap_or_else(PoisonError::into_inner).what, "second");
    }

    #[test]
    fn steps_are_counted_from_several_threads() {
        let progress = ProgressLine::silent();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..1000).for_each(|_| progress.step()));
            }
        });
        assert_eq!(progress.done(), 4000);
    }
}
