use super::*;

fn record(out: &mut Vec<u8>, kind: u8, body: &[u8]) {
    out.push(kind);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
}

fn file(messages: &[&str]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    let topic = [&[1, 0, 0, 0][..], &10_u32.to_le_bytes(), TOPIC.as_bytes(), &[0; 8]].concat();
    record(&mut out, kind::CHANNEL, &topic);
    for message in messages {
        let body = [&[1, 0][..], &[0; 20], message.as_bytes()].concat();
        record(&mut out, kind::MESSAGE, &body);
    }
    record(&mut out, kind::DATA_END, &[0; 4]);
    out
}

#[test]
fn many_columns_and_many_short_messages_take_no_more_than_the_budget() {
    let wide = (0..100).map(|i| format!("\"c{i}\":1")).collect::<Vec<_>>().join(",");
    let wide = format!("{{{wide}}}");
    let mut messages = vec![wide.as_str()];
    messages.extend(["{}"; 99]);
    let bytes = file(&messages);
    let (table, _) = columns(bytes.as_slice(), Budget::new(10_000), Needed::default()).expect("fits");
    assert_eq!(table.len(), 100);
    let error = columns(bytes.as_slice(), Budget::new(9_999), Needed::default()).expect_err("does not fit");
    assert_eq!(error.code(), DataCode::FileUnreadable);
}

#[test]
fn lengths_that_lead_out_of_the_file_are_refused() {
    let mut bytes = MAGIC.to_vec();
    record(&mut bytes, kind::CHANNEL, &[1, 0, 0, 0, 0xff, 0xff, 0xff, 0x7f]);
    assert!(columns(bytes.as_slice(), Budget::default(), Needed::default()).is_err());
    let mut bytes = MAGIC.to_vec();
    bytes.push(kind::CHUNK);
    bytes.extend(2_700_000_000_u64.to_le_bytes());
    let error = columns(bytes.as_slice(), Budget::default(), Needed::default()).expect_err("too long");
    assert!(error.cause().contains("2700000000"), "{error}");
}
