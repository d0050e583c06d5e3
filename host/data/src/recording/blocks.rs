//! A text file in blocks of whole lines, parsed on all cores, put together in order.
//!
//! One worker at a time reads; all parse; the worker with the next block in order appends it to the columns. So a block
//! is parsed while it is still in the cache, memory holds the columns and a few blocks only, and a compressed stream goes
//! the same way as a plain file. The first error in the order of the file is the one reported.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::bounds::Budget;
use crate::error::Error;

use super::cells::{Dialect, LineError, LineMap, Parsed, Wanted, parse};
use super::text_column::TextColumn;

/// Small enough for a block and its columns to stay in the second-level cache.
const BLOCK: usize = 512 << 10;
/// No table has longer lines; without a bound, a file without line ends would be read into memory whole.
const LONGEST_LINE: usize = 4 << 20;

/// Cuts a stream into blocks that end with a line.
pub(super) struct Blocks {
    reader: Box<dyn Read + Send>,
    carry: Vec<u8>,
    ended: bool,
}

/// Why no block came.
#[derive(Debug)]
pub(super) enum BlockError {
    Io(io::Error),
    LongLine,
}

impl Blocks {
    pub(super) fn new(reader: Box<dyn Read + Send>) -> Self {
        Self { reader, carry: Vec::new(), ended: false }
    }

    /// Puts bytes back in front of what is still to come.
    pub(super) fn put_back(&mut self, bytes: &[u8]) {
        self.carry.splice(0..0, bytes.iter().copied());
    }

    /// Appends this number of bytes, fewer at the end of the stream: in calls as large as the reader allows, where `read_to_end` begins
    /// each block with small ones.
    fn fill(&mut self, block: &mut Vec<u8>, want: usize) -> io::Result<usize> {
        let begin = block.len();
        block.resize(begin + want, 0);
        let mut got = 0;
        while got < want {
            match self.reader.read(&mut block[begin + got..]) {
                Ok(0) => break,
                Ok(count) => got += count,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => {
                    block.truncate(begin + got);
                    return Err(e);
                }
            }
        }
        block.truncate(begin + got);
        Ok(got)
    }

    /// Fills `block` with the next lines; `false` at the end. The last line may lack its line end.
    pub(super) fn next(&mut self, block: &mut Vec<u8>) -> Result<bool, BlockError> {
        block.clear();
        block.append(&mut self.carry);
        let mut searched = 0;
        while !self.ended {
            let want = BLOCK.saturating_sub(block.len()).max(BLOCK / 4);
            let got = self.fill(block, want).map_err(BlockError::Io)?;
            self.ended = got < want;
            if self.ended {
                break;
            }
            if let Some(end) = memchr::memrchr(b'\n', &block[searched..]) {
                self.carry.extend_from_slice(&block[searched + end + 1..]);
                block.truncate(searched + end + 1);
                break;
            }
            searched = block.len();
            if searched > LONGEST_LINE {
                return Err(BlockError::LongLine);
            }
        }
        Ok(!block.is_empty())
    }
}

/// All rows of a file.
#[derive(Debug, Default)]
pub(super) struct Rows {
    pub numbers: Vec<Vec<f64>>,
    pub texts: Vec<TextColumn>,
    pub rows: usize,
    /// Lines count from the first line of the first block, from 0.
    pub map: LineMap,
    /// For every row that was left out, how many were kept before it.
    pub skipped: Vec<usize>,
    lines: u64,
}

impl Rows {
    /// Notes the rows that were left out of all those of a file, and which line each of the others came from.
    pub(super) fn leave_out(&mut self, keep: &[bool]) {
        self.rows = 0;
        for (line, kept) in keep.iter().enumerate() {
            if *kept {
                self.map.note(self.rows, line as u64);
                self.rows += 1;
            } else {
                self.skipped.push(self.rows);
            }
        }
    }

    /// Number of a row among all rows of the file, those included that were left out; counted from 0.
    pub(super) fn ordinal(&self, row: usize) -> usize {
        row + self.skipped.partition_point(|kept| *kept <= row)
    }

    fn append(&mut self, block: &Parsed, expected_rows: usize) {
        if self.numbers.is_empty() {
            self.numbers = block.numbers.iter().map(|_| Vec::new()).collect();
            self.texts = vec![TextColumn::default(); block.texts.len()];
        }
        for (column, part) in self.numbers.iter_mut().zip(&block.numbers) {
            if column.capacity() < column.len() + part.len() {
                // Untouched capacity costs no memory, moving a column costs time.
                column.reserve(expected_rows.saturating_sub(column.len()).max(part.len()));
            }
            column.extend_from_slice(part);
        }
        for (column, part) in self.texts.iter_mut().zip(&block.texts) {
            column.append(part);
        }
        self.map.append(&block.map, self.rows, self.lines);
        self.skipped.extend(block.skipped.iter().map(|kept| self.rows + kept));
        self.rows += block.rows;
        self.lines += block.lines;
    }
}

/// Why the rows could not be read.
#[derive(Debug)]
pub(super) enum RowsError {
    Block(BlockError),
    /// Lines count as in [`Rows`].
    Line(Box<LineError>),
    /// More values than fit into memory.
    TooMany(Error),
}

struct Queue {
    blocks: Blocks,
    /// Number of the next block.
    ticket: usize,
    stopped: bool,
}

struct Joined {
    rows: Rows,
    budget: Budget,
    next: usize,
    pending: BTreeMap<usize, Result<Parsed, Box<LineError>>>,
    failure: Option<RowsError>,
}

/// Parses everything that is left of `blocks`, as [`parse`] does. `size` is an estimate of the bytes to come.
pub(super) fn read_rows(
    blocks: Blocks,
    dialect: Dialect,
    wanted: &[Wanted],
    width: usize,
    lines_above: &[Vec<u8>],
    size: Option<u64>,
    budget: Budget,
) -> Result<Rows, RowsError> {
    let workers = match size {
        Some(size) if size < 4 * BLOCK as u64 => 1,
        _ => std::thread::available_parallelism().map_or(1, usize::from).min(16),
    };
    let queue = Mutex::new(Queue { blocks, ticket: 0, stopped: false });
    let joined = Mutex::new(Joined {
        rows: Rows::default(),
        budget,
        next: 0,
        pending: BTreeMap::new(),
        failure: None,
    });
    let advanced = Condvar::new();
    let work = || worker(&queue, &joined, &advanced, workers, dialect, wanted, width, lines_above, size);
    if workers == 1 {
        work();
    } else {
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(work);
            }
        });
    }
    let joined = joined.into_inner().unwrap_or_else(PoisonError::into_inner);
    match joined.failure {
        Some(failure) => Err(failure),
        None => Ok(joined.rows),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[allow(clippy::too_many_arguments)] // The arguments of `read_rows` and what its workers share.
fn worker(
    queue: &Mutex<Queue>,
    joined: &Mutex<Joined>,
    advanced: &Condvar,
    workers: usize,
    dialect: Dialect,
    wanted: &[Wanted],
    width: usize,
    lines_above: &[Vec<u8>],
    size: Option<u64>,
) {
    let mut block = Vec::with_capacity(BLOCK + BLOCK / 2);
    loop {
        let ticket = {
            let mut queue = lock(queue);
            if queue.stopped {
                return;
            }
            match queue.blocks.next(&mut block) {
                Ok(true) => {
                    queue.ticket += 1;
                    queue.ticket - 1
                }
                Ok(false) => {
                    queue.stopped = true;
                    return;
                }
                Err(failure) => {
                    queue.stopped = true;
                    // An error in an earlier line, still being parsed, comes first.
                    lock(joined).failure.get_or_insert(RowsError::Block(failure));
                    return;
                }
            }
        };
        let parsed = parse(&block, dialect, wanted, width, lines_above);
        if parsed.is_err() {
            lock(queue).stopped = true;
        }
        let bytes = block.len() as u64;
        let mut joined = lock(joined);
        // A worker far ahead of a slow one waits, so that memory stays bounded.
        while ticket > joined.next + 4 * workers {
            joined = advanced.wait(joined).unwrap_or_else(PoisonError::into_inner);
        }
        joined.pending.insert(ticket, parsed);
        loop {
            let next = joined.next;
            let Some(parsed) = joined.pending.remove(&next) else { break };
            joined.next += 1;
            match parsed {
                Ok(parsed) => {
                    if let Err(error) = joined.budget.take(parsed.values()) {
                        joined.failure.get_or_insert(RowsError::TooMany(error));
                        drop(joined);
                        lock(queue).stopped = true;
                        advanced.notify_all();
                        return;
                    }
                    let rows = parsed.rows as u64;
                    // Two per cent more than the file's size suggests, for lines that get shorter.
                    let expected = size.map_or(0, |s| s.saturating_mul(rows) / bytes.max(1) / 50 * 51);
                    joined.rows.append(&parsed, expected as usize);
                }
                Err(mut line) => {
                    line.line += joined.rows.lines;
                    if !matches!(joined.failure, Some(RowsError::Line(_))) {
                        joined.failure = Some(RowsError::Line(line));
                    }
                }
            }
        }
        advanced.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::cells::{Fault, Want};
    use super::*;

    const DIALECT: Dialect = Dialect {
        delimiter: b',',
        comment: Some(b'#'),
        decimal_comma: false,
        thousands: None,
        skip_missing: false,
    };

    const VALUES: usize = 1 << 20;

    fn read(text: Vec<u8>, size: Option<u64>) -> Result<Rows, RowsError> {
        let number = Want::Number { scale: 1.0, offset: 0.0 };
        let wanted = [Wanted { index: 0, want: number }, Wanted { index: 2, want: number }];
        read_rows(
            Blocks::new(Box::new(io::Cursor::new(text))),
            DIALECT,
            &wanted,
            3,
            &[],
            size,
            Budget::new(VALUES),
        )
    }

    #[test]
    fn many_blocks_keep_their_order_and_their_lines() {
        let mut text = String::new();
        for i in 0..200_000 {
            text += &format!("{i},x,{}\n", i as f64 * 0.25);
            if i % 1000 == 0 {
                text += "# a note\n\n";
            }
        }
        let rows = read(text.into_bytes(), None).unwrap();
        assert_eq!(rows.rows, 200_000);
        assert!(rows.numbers[0].iter().enumerate().all(|(i, v)| *v == i as f64));
        assert!(rows.numbers[1].iter().enumerate().all(|(i, v)| *v == i as f64 * 0.25));
        assert_eq!(rows.map.line(0), 0);
        assert_eq!(rows.map.line(1), 3);
        assert_eq!(rows.map.line(1001), 1005);
        assert_eq!(rows.map.line(199_999), 199_999 + 400);
    }

    #[test]
    fn a_text_that_never_ends_is_given_up_at_the_budget() {
        /// Compresses to almost nothing, as such files do.
        struct Endless(usize);
        impl Read for Endless {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                assert!(self.0 < 256 << 20, "reads on without bound");
                for byte in buffer.iter_mut() {
                    *byte = b"1,2,3\n"[self.0 % 6];
                    self.0 += 1;
                }
                Ok(buffer.len())
            }
        }
        let number = Want::Number { scale: 1.0, offset: 0.0 };
        let wanted = [Wanted { index: 0, want: number }];
        for size in [None, Some(10)] {
            let blocks = Blocks::new(Box::new(Endless(0)));
            let found = read_rows(blocks, DIALECT, &wanted, 3, &[], size, Budget::new(VALUES));
            assert!(matches!(found, Err(RowsError::TooMany(_))));
        }
    }

    #[test]
    fn the_first_error_of_the_file_is_reported() {
        let mut text = String::new();
        for i in 0..300_000 {
            text += if i % 60_000 == 59_999 { "1,2,bad\n" } else { "1,2,3\n" };
        }
        for _ in 0..5 {
            let Err(RowsError::Line(error)) = read(text.clone().into_bytes(), None) else {
                panic!("no error")
            };
            assert_eq!((error.line, error.cell, &error.fault), (59_999, Some(2), &Fault::NotANumber));
        }
    }

    #[test]
    fn a_file_without_line_ends_is_given_up_early() {
        struct Endless(u64);
        impl Read for Endless {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                self.0 += buffer.len() as u64;
                assert!(self.0 < 16 << 20, "reads on without bound");
                buffer.fill(b'7');
                Ok(buffer.len())
            }
        }
        let mut blocks = Blocks::new(Box::new(Endless(0)));
        assert!(matches!(blocks.next(&mut Vec::new()), Err(BlockError::LongLine)));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>) {
            let _ = read(bytes, Some(10));
        }

        #[test]
        fn no_text_of_table_like_lines_makes_it_panic(text in "([0-9.,eE\"# +-]{0,12}[\n\r]{1,2}){0,20}") {
            if let Ok(rows) = read(text.into_bytes(), None) {
                prop_assert!(rows.numbers.iter().all(|c| c.len() == rows.rows));
            }
        }
    }
}
