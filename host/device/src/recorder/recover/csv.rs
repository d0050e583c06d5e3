//! Lines of a CSV that are whole rows go over. A CSV has no checksum: a digit that became another digit is not noticed, unless it
//! puts the row out of the order of time.

use std::io::{self, Read, Write};

use super::super::columns::{COLUMNS, Cell, SECOND, plain_header, second_header};
use super::Tally;
use super::window::Window;

/// No row of a recording is longer.
const LONGEST: usize = 1 << 16;

/// A row that waits for the next one, which returns whether its time is right.
struct Row {
    time: f64,
    line: Vec<u8>,
}

/// Copies what is whole.
pub(super) fn copy<R: Read>(source: &mut Window<R>, out: &mut impl Write) -> io::Result<Tally> {
    let mut tally = Tally::default();
    let mut header: Option<Vec<String>> = None;
    let (mut last, mut waiting): (f64, Option<Row>) = (f64::NEG_INFINITY, None);
    let mut lost = Lost { tally: &mut tally, before: None };
    let mut number = 0_u64;
    loop {
        let ahead = source.peek(LONGEST)?;
        if ahead.is_empty() {
            break;
        }
        number += 1;
        let end = ahead.iter().position(|b| *b == b'\n');
        let line = ahead[..end.map_or(ahead.len(), |e| e + 1)].to_vec();
        source.skip(line.len());
        let Some(names) = &header else {
            let (names, found) = read_header(&line, source)?;
            if !found {
                lost.add(number, line.len(), 0);
            }
            out.write_all((names.join(",") + "\n").as_bytes())?;
            header = Some(names);
            continue;
        };
        let Some(row) = end.and_then(|_| row(&line, names)) else {
            // An empty piece of a line is a row that had just begun.
            lost.add(number, line.len(), u64::from(line.iter().any(u8::is_ascii_graphic)));
            continue;
        };
        match waiting.take() {
            // The time of the one before is out of order: this one follows what was written, that one does not precede this one.
            Some(odd) if !(odd.time < row.time) && row.time > last => {
                lost.add(number - 1, odd.line.len(), 1);
                waiting = Some(row);
            }
            Some(good) if !(good.time < row.time) => {
                lost.add(number, row.line.len(), 1);
                waiting = Some(good);
            }
            Some(good) => {
                last = good.time;
                out.write_all(&good.line)?;
                lost.tally.samples += 1;
                waiting = Some(row);
            }
            None => waiting = Some(row),
        }
    }
    if let Some(good) = waiting {
        out.write_all(&good.line)?;
        tally.samples += 1;
    }
    Ok(tally)
}

struct Lost<'a> {
    tally: &'a mut Tally,
    before: Option<u64>,
}

impl Lost<'_> {
    fn add(&mut self, line: u64, bytes: usize, samples: u64) {
        self.tally.bytes_lost += bytes as u64;
        self.tally.samples_lost += samples;
        self.tally.gaps += u64::from(self.before.is_none_or(|before| before + 1 < line));
        self.before = Some(line);
    }
}

/// The names of the columns; where the first line holds none, those of a recording with as many columns as the next line.
fn read_header<R: Read>(line: &[u8], source: &mut Window<R>) -> io::Result<(Vec<String>, bool)> {
    let split = |text: &str| text.trim_end().split(',').map(str::to_owned).collect::<Vec<_>>();
    if let Ok(text) = std::str::from_utf8(line)
        && text.ends_with('\n')
        && text.starts_with("time_s,")
        && split(text)
            .iter()
            .all(|n| n.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && !n.is_empty())
    {
        let names = split(text);
        let own = [plain_header(), second_header()];
        // A name with a flipped letter is put right where the others are those of this program.
        let right = own.iter().map(|h| split(h)).find(|own| {
            own.len() == names.len() && own.iter().zip(&names).filter(|(a, b)| a != b).count() == 1
        });
        return Ok(right.map_or((names, true), |right| (right, false)));
    }
    let next = source.peek(LONGEST)?;
    let next = next.iter().position(|b| *b == b'\n').map_or(&next[..0], |end| &next[..end]);
    let width = next.iter().filter(|b| **b == b',').count() + 1;
    let second = split(&second_header());
    Ok((if width == second.len() { second } else { split(&plain_header()) }, false))
}

/// A line as a row: as many cells as names, numbers where numbers belong.
fn row(line: &[u8], names: &[String]) -> Option<Row> {
    let text = std::str::from_utf8(line).ok()?.trim_end_matches(['\r', '\n']);
    if text.chars().any(|c| c.is_control()) {
        return None;
    }
    let cells: Vec<&str> = text.split(',').collect();
    if cells.len() != names.len() {
        return None;
    }
    for (name, cell) in names.iter().zip(&cells) {
        let known = COLUMNS.iter().chain(SECOND).find(|c| c.name == name);
        let fits = match known.map(|c| c.sample_cell()) {
            Some(Cell::Word(_)) => cell.chars().all(|c| c.is_ascii_lowercase() || c == '-' || c == ' '),
            Some(Cell::Count(_)) => cell.parse::<u64>().is_ok(),
            Some(Cell::Time(_) | Cell::Number(_)) => cell.parse::<f64>().is_ok(),
            None => true,
        };
        if !fits {
            return None;
        }
    }
    let time = cells[0].parse().ok().filter(|t: &f64| t.is_finite())?;
    Some(Row { time, line: line.to_vec() })
}
