//! One damaged bit anywhere costs at most the chunk or the line in which it lies, and the original is kept.

use serde_json::json;

use super::super::mcap::Encoder;
use super::super::part::part_of;
use super::*;

const CHUNKS: u64 = 12;
const IN_CHUNK: u64 = 4;
const ALL: u64 = CHUNKS * IN_CHUNK;

/// An MCAP of some chunks, as far as it was written, and its end.
fn recording() -> (Vec<u8>, Vec<u8>) {
    let mut encoder = Encoder::new(&json!({"host": "1", "device": {"board": "b"}}), 5).unwrap();
    let mut bytes = encoder.take().unwrap();
    for i in 0..ALL {
        encoder.sample(1000 * i, &format!("{{\"time_s\":{i}.5}}")).unwrap();
        if i % IN_CHUNK == IN_CHUNK - 1 {
            bytes.extend(encoder.take().unwrap());
        }
    }
    (bytes, encoder.end(&json!({"ended_by": "time"})).unwrap())
}

fn copied(bytes: &[u8]) -> (Vec<u8>, Tally) {
    let mut out = Vec::new();
    let tally = mcap::copy(&mut Window::new(bytes), &mut out).unwrap();
    (out, tally)
}

/// Samples that another program's reader finds.
fn samples(bytes: &[u8]) -> u64 {
    ::mcap::MessageStream::new(bytes)
        .unwrap()
        .map(|m| m.unwrap())
        .filter(|m| m.channel.topic == "/telemetry" && !m.data.is_empty())
        .count() as u64
}

#[test]
fn a_whole_file_is_sent_whole() {
    let (data, end) = recording();
    for bytes in [data.clone(), [data, end].concat()] {
        let (out, tally) = copied(&bytes);
        assert_eq!(tally, Tally { samples: ALL, ..Tally::default() });
        assert_eq!(samples(&out), ALL);
    }
}

#[test]
fn a_file_that_ends_anywhere_keeps_every_chunk_before() {
    let (data, _) = recording();
    let mut before = 0;
    for length in 0..data.len() {
        let (out, tally) = copied(&data[..length]);
        assert_eq!(samples(&out), tally.samples);
        assert!(tally.samples >= before && tally.samples % IN_CHUNK == 0, "{length}: {tally:?}");
        before = tally.samples;
    }
    // The last chunk is whole before its index is.
    assert_eq!(before, ALL);
}

#[test]
fn one_flipped_bit_costs_at_most_its_chunk_and_is_counted() {
    let (data, end) = recording();
    let whole = [data.clone(), end].concat();
    for at in 0..data.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        let (out, tally) = copied(&bytes);
        assert_eq!(samples(&out), tally.samples, "byte {at}");
        assert!(tally.samples >= ALL - IN_CHUNK, "byte {at}: {tally:?}");
        if tally.samples < ALL {
            assert!(tally.bytes_lost > 0 && tally.gaps >= 1, "byte {at}: {tally:?}");
        }
        // Behind the last chunk no number returns what is missing, only its own lengths do.
        let inside = tally.samples + tally.samples_lost;
        assert!(inside <= ALL && (inside == ALL || at > data.len() / 2), "byte {at}: {tally:?}");
    }
}

#[test]
fn a_hole_of_zeros_is_stepped_over() {
    let (data, _) = recording();
    let mut bytes = data.clone();
    bytes[data.len() / 3..data.len() / 2].fill(0);
    let (out, tally) = copied(&bytes);
    assert_eq!(samples(&out), tally.samples);
    assert_eq!(tally.samples + tally.samples_lost, ALL);
    assert!(tally.samples > ALL / 2 && tally.samples_lost >= IN_CHUNK, "{tally:?}");
}

#[test]
fn a_damaged_file_is_kept_and_the_loss_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (mut data, _) = recording();
    let middle = data.len() / 2;
    data[middle] ^= 4;
    std::fs::write(part_of(&path), &data).unwrap();
    let found = recover(&part_of(&path)).unwrap();
    let original = found.original.clone().unwrap();
    assert_eq!(std::fs::read(&original).unwrap(), data);
    assert_eq!(found.recording, Some(path.clone()));
    assert_eq!(samples(&std::fs::read(&path).unwrap()), found.tally.samples);
    assert!(found.loss().unwrap().contains(&original.display().to_string()));
    assert!(found.tally.samples >= ALL - IN_CHUNK && found.tally.bytes_lost > 0);
    // A damaged file that already has its name stays where it is.
    std::fs::write(&path, &data).unwrap();
    let again = recover(&path).unwrap();
    assert_eq!(again.original, Some(path.clone()));
    assert_eq!(again.recording.unwrap().file_name().unwrap(), "run.rescued-1.mcap");
    assert_eq!(std::fs::read(&path).unwrap(), data);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
}

#[test]
fn files_that_are_complete_or_not_recordings_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (data, end) = recording();
    std::fs::write(&path, [data, end].concat()).unwrap();
    assert_eq!(recover(&path).unwrap_err().exit_status(), 2);
    for name in ["noise.mcap.part", "noise.csv.part"] {
        let noise = folder.path().join(name);
        std::fs::write(&noise, vec![0x06; 100_000]).unwrap();
        assert_eq!(recover(&noise).unwrap_err().exit_status(), 1, "{name}");
        assert_eq!(std::fs::read(&noise).unwrap(), vec![0x06; 100_000]);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
}

fn lines(text: &[u8]) -> (String, Tally) {
    let mut out = Vec::new();
    let tally = csv::copy(&mut Window::new(text), &mut out).unwrap();
    (String::from_utf8(out).unwrap(), tally)
}

fn rows() -> String {
    let mut text = super::super::columns::plain_header();
    for i in 0..40 {
        text += &format!("{i}.000500,{}.25,0.001,1.5,0,0,NaN,1,running,force,{i}\n", 1000 * i);
    }
    text
}

#[test]
fn one_flipped_bit_of_a_csv_costs_at_most_its_line() {
    let text = rows();
    let (whole, tally) = lines(text.as_bytes());
    assert_eq!((whole.as_str(), tally.samples, tally.bytes_lost), (text.as_str(), 40, 0));
    for at in 0..text.len() {
        for bit in [0, 3, 7] {
            let mut bytes = text.clone().into_bytes();
            bytes[at] ^= 1 << bit;
            let (out, tally) = lines(&bytes);
            assert!(tally.samples >= 38, "byte {at}: {tally:?}");
            assert_eq!(out.lines().count() as u64, tally.samples + 1);
            assert_eq!(out.lines().next(), text.lines().next(), "byte {at}");
            let times: Vec<f64> =
                out.lines().skip(1).map(|l| l.split(',').next().unwrap().parse().unwrap()).collect();
            assert!(times.windows(2).all(|w| w[0] < w[1]), "byte {at}");
        }
    }
}

#[test]
fn a_csv_with_a_hole_and_a_cut_line_keeps_the_rest() {
    let text = rows();
    let mut bytes = text.clone().into_bytes();
    let (from, to) = (text.len() / 3, text.len() / 2);
    bytes[from..to].fill(0);
    bytes.truncate(text.len() - 5);
    let (out, tally) = lines(&bytes);
    let kept: Vec<&str> = out.lines().collect();
    assert!(text.lines().filter(|l| kept.contains(l)).count() == kept.len());
    assert_eq!((tally.gaps, tally.samples), (2, kept.len() as u64 - 1));
    assert!(tally.samples >= 30, "{tally:?}");
    assert_eq!(tally.bytes_lost, (bytes.len() - out.len()) as u64);
}
