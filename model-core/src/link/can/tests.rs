//! Frames over a bus that loses, repeats, swaps and invents messages.

use super::*;
use crate::link::frame::{Accumulator, Header, Kind, MAX_BODY, MAX_WIRE, encode_bytes};
use proptest::prelude::*;

type Message = Vec<u8>;

/// The messages of frames with bodies of these lengths, and how many each frame has.
fn messages(sender: &mut Sender, lengths: &[usize]) -> Vec<Vec<Message>> {
    let frame = |(at, length): (usize, &usize)| {
        let header = Header { kind: Kind::Response, id: 3, sequence: at as u16 };
        let body: Vec<u8> = (0..*length).map(|byte| (byte * 7 + at) as u8).collect();
        let mut wire = [0; MAX_WIRE];
        let count = encode_bytes(header, &body, &mut wire).unwrap();
        let mut cut = Vec::new();
        sender.send(&wire[..count], |payload| cut.push(payload.to_vec()));
        cut
    };
    lengths.iter().enumerate().map(frame).collect()
}

/// Sequence numbers and lengths of the frames that arrive.
fn arrived<'a>(
    format: Format,
    messages: impl IntoIterator<Item = &'a Message>,
) -> (Vec<(u16, usize)>, Counts) {
    let (mut receiver, mut accumulator, mut frames) = (Receiver::new(format), Accumulator::new(), Vec::new());
    for message in messages {
        for byte in receiver.take(message) {
            if let Some(Ok(frame)) = accumulator.push(byte) {
                let at = frame.header.sequence as usize;
                let right =
                    frame.body.iter().enumerate().all(|(byte, value)| *value == (byte * 7 + at) as u8);
                assert!(right, "another body than was sent");
                frames.push((frame.header.sequence, frame.body.len()));
            }
        }
    }
    (frames, receiver.counts())
}

const FORMATS: [Format; 2] = [Format::Fd, Format::Classic];

const LENGTHS_SENT: [usize; 6] = [0, 300, 5, MAX_BODY, 1, 60];

fn expected(without: Option<usize>) -> Vec<(u16, usize)> {
    let all = LENGTHS_SENT.iter().enumerate().map(|(at, length)| (at as u16, *length));
    all.filter(|(at, _)| Some(usize::from(*at)) != without).collect()
}

#[test]
fn identifiers_are_those_of_their_routes_and_vents_go_first() {
    let routes = Address::all().flat_map(|a| [Route::To(a), Route::From(a)]).chain([Route::ToAll]);
    for route in routes {
        assert_eq!(Route::of(route.identifier()), Some(route));
        assert!(route == Route::ToAll || route.identifier() > Route::ToAll.identifier());
    }
    let known = (0..0x800).filter(|identifier| Route::of(*identifier).is_some()).count();
    assert_eq!(known, 2 * usize::from(DEVICES) + 1);
    assert_eq!((Address::new(0), Address::new(DEVICES + 1)), (None, None));
}

#[test]
fn frames_of_every_length_arrive_in_messages_that_the_bus_has() {
    let lengths: Vec<usize> = (0..=MAX_BODY).collect();
    for format in FORMATS {
        let sent = messages(&mut Sender::new(format), &lengths);
        for message in sent.iter().flatten() {
            let fits = message.len() <= 8 || (format == Format::Fd && LENGTHS.contains(&message.len()));
            assert!(fits, "{format:?}: {}", message.len());
        }
        let (frames, counts) = arrived(format, sent.iter().flatten());
        assert_eq!(frames.len(), lengths.len());
        assert!(frames.iter().all(|(sequence, length)| usize::from(*sequence) == *length));
        assert_eq!(counts, Counts::default());
    }
}

#[test]
fn a_lost_message_costs_its_frame_and_no_other() {
    FORMATS.into_iter().for_each(each_is_lost);
}

fn each_is_lost(format: Format) {
    let sent = messages(&mut Sender::new(format), &LENGTHS_SENT);
    let total = sent.iter().flatten().count();
    for lost in 1..total {
        let rest =
            sent.iter().flatten().enumerate().filter(|(at, _)| *at != lost).map(|(_, message)| message);
        let mut before = 0;
        let its = sent.iter().position(|frame| {
            before += frame.len();
            lost < before
        });
        let (frames, counts) = arrived(format, rest);
        // The zero behind a gap is as good as a closing zero that was alone in its message.
        let whole =
            sent.iter().flatten().nth(lost).is_some_and(|message| message[format.header_length()..] == [0]);
        assert_eq!(frames, expected(its.filter(|_| !whole)), "message {lost}");
        // The last one of all is not missed.
        assert_eq!(counts.lost, u32::from(lost + 1 < total));
    }
}

#[test]
fn a_repeated_message_changes_nothing_and_swapped_ones_deliver_nothing_wrong() {
    FORMATS.into_iter().for_each(each_is_repeated_or_swapped);
}

fn each_is_repeated_or_swapped(format: Format) {
    let sent = messages(&mut Sender::new(format), &LENGTHS_SENT);
    let flat: Vec<&Message> = sent.iter().flatten().collect();
    for at in 0..flat.len() {
        let mut twice = flat.clone();
        twice.insert(at, flat[at]);
        let (frames, counts) = arrived(format, twice);
        assert_eq!((frames, counts.repeated, counts.lost), (expected(None), 1, 0));
        if at > 0 {
            let mut swapped = flat.clone();
            swapped.swap(at - 1, at);
            let (frames, _) = arrived(format, swapped);
            assert!(frames.iter().all(|frame| expected(None).contains(frame)));
        }
    }
}

proptest! {
    /// Whatever is on the bus: no panic, no frame that no one has sent, and the sender's next frames arrive.
    #[test]
    fn any_messages_are_survived(
        noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..80), 0..40),
        places in prop::collection::vec(0_usize..40, 0..40),
        format in prop::sample::select(FORMATS.to_vec()),
    ) {
        let mut sender = Sender::new(format);
        let sent = messages(&mut sender, &LENGTHS_SENT);
        let mut bus: Vec<Message> = sent.into_iter().flatten().collect();
        for (message, place) in noise.into_iter().zip(places) {
            bus.insert(place.min(bus.len()), message);
        }
        let (mut receiver, mut accumulator) = (Receiver::new(format), Accumulator::new());
        let mut take = |message: &Message, frames: &mut Vec<(u16, usize)>| {
            for byte in receiver.take(message) {
                if let Some(Ok(frame)) = accumulator.push(byte) {
                    frames.push((frame.header.sequence, frame.body.len()));
                }
            }
        };
        let mut frames = Vec::new();
        bus.iter().for_each(|message| take(message, &mut frames));
        prop_assert!(frames.iter().all(|frame| expected(None).contains(frame)));
        // What was invented may have ended with a number just before the next one; then one message is taken for a repeated one.
        let mut later = Vec::new();
        for message in messages(&mut sender, &[8, 9, 10]).iter().flatten() {
            take(message, &mut later);
        }
        prop_assert_eq!(later.last().copied(), Some((2, 10)));
    }
}

#[test]
fn a_message_announces_from_one_byte_to_its_longest_and_is_as_long_as_they_need() {
    let take = |payload: &[u8]| {
        let mut receiver = Receiver::default();
        let bytes: Vec<u8> = receiver.take(payload).collect();
        (bytes, receiver.counts().malformed)
    };
    let mut longest = [9; 64];
    longest[1] = 62;
    assert_eq!(take(&[5, 2, 7, 8]), (vec![7, 8], 0));
    assert_eq!(take(&longest), (vec![9; 62], 0));
    let none = (Vec::new(), 1);
    assert_eq!(take(&[5, 0]), none, "no byte");
    assert_eq!(take(&[5, 2, 7, 8, 0]), none, "a byte more than they need");
    assert_eq!(take(&[5, 3, 7, 8]), none, "a byte less");
    longest[1] = 63;
    assert_eq!(take(&longest), none, "more than a message carries");
}

#[test]
fn a_classic_message_carries_as_many_bytes_as_it_is_longer_than_its_number() {
    let take = |payload: &[u8]| {
        let mut receiver = Receiver::new(Format::Classic);
        let bytes: Vec<u8> = receiver.take(payload).collect();
        (bytes, receiver.counts().malformed)
    };
    for length in 1..=7 {
        assert_eq!(take(&vec![9; length + 1]), (vec![9; length], 0));
    }
    let none = (Vec::new(), 1);
    for length in [0, 1, 9, 64] {
        assert_eq!(take(&vec![9; length]), none, "{length}");
    }
}

/// Why there is a message of its own: the requests that vent do not fit one of 8 bytes. On CAN FD nothing takes it for a frame.
#[test]
fn the_message_that_vents_all_is_no_frame() {
    let mut wire = [0; MAX_WIRE];
    let header = Header { kind: Kind::Request, id: 5, sequence: 1 };
    let stop = encode_bytes(header, &[], &mut wire).unwrap();
    assert!(stop > Format::Classic.data() && 2 * stop <= Format::Fd.data());
    let mut receiver = Receiver::new(Format::Fd);
    assert_eq!((receiver.take(&VENT).count(), receiver.counts().malformed), (0, 1));
}

#[test]
fn an_address_is_a_number_from_one_to_eight() {
    for number in 0..=u8::MAX {
        let expected = (1..=8).contains(&number).then_some(number);
        assert_eq!(Address::new(number).map(Address::number), expected);
    }
}
