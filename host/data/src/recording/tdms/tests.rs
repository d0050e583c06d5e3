use proptest::prelude::*;

use super::*;
use crate::error::DataCode;

fn text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

/// A segment with one channel `p` of single bytes, `count` in a chunk.
fn segment(count: u64, interleaved: bool, raw: &[u8]) -> Vec<u8> {
    let mut list = 1_u32.to_le_bytes().to_vec();
    text(&mut list, "/'g'/'it''s p'");
    list.extend(20_u32.to_le_bytes());
    list.extend(5_u32.to_le_bytes());
    list.extend(1_u32.to_le_bytes());
    list.extend(count.to_le_bytes());
    list.extend(0_u32.to_le_bytes());
    lead_in(0b1110 | u32::from(interleaved) << 5, &list, raw)
}

fn lead_in(has: u32, list: &[u8], raw: &[u8]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    out.extend(has.to_le_bytes());
    out.extend(4713_u32.to_le_bytes());
    out.extend(((list.len() + raw.len()) as u64).to_le_bytes());
    out.extend((list.len() as u64).to_le_bytes());
    out.extend(list);
    out.extend(raw);
    out
}

fn numbers(bytes: &[u8], budget: Budget) -> Vec<f64> {
    let (table, _) = columns(bytes, budget).unwrap();
    assert_eq!(table[0].0, "it's p");
    match &table[0].1 {
        Column::Numbers(values) => values.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn chunks_repeat_and_a_list_stays_in_force() {
    let mut file = segment(2, false, &[1, 2, 3, 4]);
    file.extend(lead_in(0b1000, &[], &[5, 6, 7]));
    assert_eq!(numbers(&file, Budget::whole()), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!(numbers(&segment(2, true, &[1, 2, 3]), Budget::whole()), [1.0, 2.0, 3.0]);
    // A program that was interrupted has not written where the next segment begins.
    let mut open = segment(2, false, &[1, 2]);
    open[12..20].copy_from_slice(&u64::MAX.to_le_bytes());
    assert_eq!(numbers(&open, Budget::whole()), [1.0, 2.0]);
}

#[test]
fn a_file_that_is_cut_off_is_refused() {
    let mut file = segment(2, false, &[1, 2, 3, 4]);
    file.extend(lead_in(0b1000, &[], &[5, 6, 7]));
    file.truncate(file.len() - 2);
    let error = columns(&file, Budget::whole()).unwrap_err();
    assert!(error.cause().contains("2 bytes before"), "{error}");
}

#[test]
fn announced_values_take_no_memory_and_those_there_are_counted() {
    assert_eq!(numbers(&segment(u64::MAX, false, &[9; 100]), Budget::whole()).len(), 100);
    // The name takes as much as 53 values, and a file's values what they are.
    assert!(columns(&segment(100, false, &[9; 100]), Budget::new(153)).is_ok());
    let error = columns(&segment(100, false, &[9; 100]), Budget::new(152)).unwrap_err();
    assert_eq!(error.code(), DataCode::FileUnreadable);
}

#[test]
fn raw_data_of_daqmx_are_refused_with_a_remedy() {
    let mut file = segment(1, false, &[1]);
    file[4] |= 0x80;
    let error = columns(&file, Budget::whole()).unwrap_err();
    assert!(error.cause().contains("DAQmx") && error.advised(), "{error}");
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(has: u8, list: Vec<u8>, raw: Vec<u8>) {
        let _ = columns(&lead_in(u32::from(has), &list, &raw), Budget::whole());
        let mut file = segment(3, has & 1 == 1, &raw);
        file.extend(lead_in(u32::from(has), &list, &raw));
        let _ = columns(&file, Budget::whole());
    }
}
