//! Installations on a flash that loses power, and what a boot loader then starts.

use ed25519_dalek::{Signer, SigningKey};
use model_core::firmware_image::{Choice, ERASED, TRIES, choose, try_at};
use std::vec;
use std::vec::Vec;

use super::*;

const BOARD: u8 = 9;
const SECTORS: [u32; 4] = [0, 1024, 2048, 4096];
const SIZE: u32 = 8192;

/// Two slots in memory. Power fails after some operations; a word or a sector that it hits is left half done.
#[derive(Clone)]
struct Mock {
    bytes: [Vec<u8>; 2],
    running: u8,
    left: usize,
    done: usize,
}

impl Mock {
    fn spend(&mut self) -> Result<bool, Failed> {
        if self.left == usize::MAX {
            self.done += 1;
            return Ok(true);
        }
        if self.left == 0 {
            return Err(Failed);
        }
        self.left -= 1;
        Ok(self.left > 0)
    }
}

impl SlotFlash for Mock {
    fn running(&self) -> u8 {
        self.running
    }

    fn address(&self, slot: u8) -> u32 {
        0x1000_0000 * (1 + u32::from(slot))
    }

    fn capacity(&self) -> u32 {
        SIZE
    }

    fn board(&self) -> u8 {
        BOARD
    }

    fn bytes(&self, slot: u8) -> &[u8] {
        &self.bytes[usize::from(slot)]
    }

    fn program(&mut self, slot: u8, place: u32, bytes: &[u8]) -> Result<(), Failed> {
        assert!(place.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        for (n, word) in bytes.chunks(4).enumerate() {
            let whole = self.spend()?;
            let there = &mut self.bytes[usize::from(slot)][place as usize + 4 * n..][..4];
            assert!(there.iter().zip(word).all(|(old, new)| old & new == *new), "a bit cannot be set");
            let part = if whole { 4 } else { 2 };
            there[..part].copy_from_slice(&word[..part]);
            if !whole {
                return Err(Failed);
            }
        }
        Ok(())
    }

    fn erase_at(&mut self, slot: u8, place: u32) -> Result<(), Failed> {
        let end = self.next_sector(slot, place);
        let whole = self.spend()?;
        // Half an erasure leaves the other half as it was.
        let end = if whole { end } else { u32::midpoint(place, end) };
        self.bytes[usize::from(slot)][place as usize..end as usize].fill(0xFF);
        if whole { Ok(()) } else { Err(Failed) }
    }

    fn next_sector(&self, _: u8, place: u32) -> u32 {
        SECTORS.into_iter().find(|start| *start > place).unwrap_or(SIZE)
    }
}

fn key() -> SigningKey {
    SigningKey::from_bytes(&[7; 32])
}

/// A program of which each byte depends on its release, with its header.
fn image(slot: u8, release: u16, length: usize) -> (Header, Vec<u8>) {
    let program: Vec<u8> = (0..length).map(|n| (n * 31 + usize::from(release) * 7) as u8).collect();
    let mut digest = [0; 64];
    digest.copy_from_slice(&Sha512::digest(&program));
    let mut header = Header {
        board: BOARD,
        slot,
        length: length as u32,
        release: (release, 0, 0),
        address: 0x1000_0000 * (1 + u32::from(slot)) + PROGRAM,
        digest,
        signature: [0; 64],
    };
    header.signature = key().sign(&header.signed()).to_bytes();
    (header, program)
}

fn updater(mock: Mock) -> Updater<Mock> {
    Updater::new(mock, key().verifying_key().to_bytes())
}

fn install(updater: &mut Updater<Mock>, (header, program): &(Header, Vec<u8>)) -> Result<(), Refusal> {
    updater.begin(&header.to_bytes())?;
    for (n, bytes) in program.chunks(256).enumerate() {
        let bytes = heapless::Vec::from_slice(bytes).expect("a piece");
        updater.piece(&UpdatePiece { offset: 256 * n as u32, bytes })?;
    }
    updater.commit()
}

/// What the boot loader does with the flash: the slot that it starts.
fn boot(mock: &mut Mock) -> Option<u8> {
    mock.left = usize::MAX;
    let slots = [0, 1].map(|slot| firmware_image::found(mock.bytes(slot), BOARD, slot, mock.address(slot)));
    let Choice::Start { slot, mark } = choose(&slots) else { return None };
    if let Some(mark) = mark {
        mock.program(slot as u8, try_at(mark), &[0; 4]).expect("powered");
    }
    mock.running = slot as u8;
    Some(slot as u8)
}

fn release(mock: &Mock) -> u16 {
    Header::from_bytes(mock.bytes(mock.running)).expect("a header").release.0
}

/// A device that runs release 1 in slot 0, confirmed, with something older in slot 1.
fn device() -> Mock {
    let erased = Mock {
        bytes: [vec![0xFF; SIZE as usize], vec![0xFF; SIZE as usize]],
        running: 1,
        left: usize::MAX,
        done: 0,
    };
    let mut one = updater(erased);
    one.slots().running = 0;
    assert_eq!(install(&mut one, &image(1, 0, 3000)), Ok(()));
    one.slots().running = 1;
    assert_eq!(install(&mut one, &image(0, 1, 5001)), Ok(()));
    assert_eq!(boot(one.slots()), Some(0));
    assert_eq!(one.confirm(), Ok(()));
    one.slots
}

#[test]
fn another_firmware_is_installed_tried_and_confirmed() {
    let mut now = updater(device());
    assert_eq!(install(&mut now, &image(1, 2, 6003)), Ok(()));
    assert_eq!(now.commit(), Ok(()), "a request that is repeated changes nothing");
    let mut status = UpdateStatus::default();
    assert_eq!(now.status(&mut status), Ok(()));
    let [first, second] = status.slots.map(|slot| slot.expect("both"));
    assert_eq!((status.running, first.confirmed, second.confirmed), (0, true, false));
    assert_eq!((second.release, second.length, second.order), ([2, 0, 0], 6003, first.order + 1));
    let mut mock = now.slots;
    assert_eq!((boot(&mut mock), release(&mock)), (Some(1), 2));
    let mut started = updater(mock);
    assert_eq!(started.confirm(), Ok(()));
    for _ in 0..2 * TRIES {
        assert_eq!(boot(started.slots()), Some(1), "it stays");
    }
}

#[test]
fn an_unconfirmed_firmware_is_replaced_by_the_one_before() {
    let mut now = updater(device());
    assert_eq!(install(&mut now, &image(1, 2, 6000)), Ok(()));
    let mut mock = now.slots;
    for _ in 0..TRIES {
        assert_eq!(boot(&mut mock), Some(1));
    }
    assert_eq!((boot(&mut mock), release(&mock)), (Some(0), 1));
    assert_eq!(boot(&mut mock), Some(0));
}

/// Power fails in every word and every erasure of an installation, and in the word of the first try.
#[test]
fn an_installation_that_loses_power_leaves_a_program_that_starts() {
    let before = device();
    let new = image(1, 2, 4099);
    let mut whole = updater(before.clone());
    whole.slots().done = 0;
    assert_eq!(install(&mut whole, &new), Ok(()));
    let operations = whole.slots.done;
    assert!(operations > 1000, "{operations}");
    let mut found = [0, 0];
    for left in 1..=operations {
        let mut cut = updater(Mock { left, ..before.clone() });
        assert!(install(&mut cut, &new).is_err(), "{left}");
        let mut mock = cut.slots;
        let slot = boot(&mut mock).expect("something starts");
        let release = release(&mock);
        assert!((slot, release) == (0, 1) || (slot, release) == (1, 2), "{left}: {slot} {release}");
        found[usize::from(slot)] += 1;
        // The host sends it again, to the slot that does not run.
        if left % 101 == 0 || left + 3 > operations {
            let again = image(1 - slot, 3, 4000);
            let mut again_to = updater(mock);
            assert_eq!(install(&mut again_to, &again), Ok(()), "{left}");
            let mut mock = again_to.slots;
            assert_eq!((boot(&mut mock), super::tests::release(&mock)), (Some(1 - slot), 3));
        }
    }
    assert_eq!(found[1], 0, "the last word makes it valid, and that one was cut");
    let mut mock = whole.slots;
    mock.left = 1;
    assert_eq!(mock.program(1, try_at(0), &[0; 4]), Err(Failed));
    assert_eq!(boot(&mut mock), Some(1), "half a mark counts as a try");
    let state = firmware_image::found(mock.bytes(1), BOARD, 1, mock.address(1)).state;
    assert_eq!(state.next_try(), Some(2));
}

#[test]
fn only_a_signed_header_for_this_board_and_slot_begins_anything() {
    let mut now = updater(device());
    let before = now.slots.clone();
    let (good, _) = image(1, 2, 4000);
    for at in 0..HEADER {
        let mut wrong = good.to_bytes();
        wrong[at] ^= 1;
        assert!(now.begin(&wrong).is_err(), "byte {at}");
    }
    let signed = |mut header: Header| {
        header.signature = key().sign(&header.signed()).to_bytes();
        header.to_bytes()
    };
    for (header, fault) in [
        (Header { board: BOARD + 1, ..good }, UpdateFault::Board),
        (image(0, 2, 4000).0, UpdateFault::Slot),
        (Header { address: good.address + 4, ..good }, UpdateFault::Slot),
        (Header { length: SIZE, ..good }, UpdateFault::TooLong),
        (Header { length: 0, ..good }, UpdateFault::TooLong),
    ] {
        assert_eq!(now.begin(&signed(header)), Err(Refusal::Update(fault)));
    }
    let foreign = SigningKey::from_bytes(&[8; 32]);
    let mut header = good;
    header.signature = foreign.sign(&good.signed()).to_bytes();
    assert_eq!(now.begin(&header.to_bytes()), Err(Refusal::Update(UpdateFault::Signature)));
    assert!(now.slots.bytes == before.bytes, "nothing has been written");
    assert_eq!(now.piece(&UpdatePiece::default()), Err(Refusal::Update(UpdateFault::NotBegun)));
    assert_eq!(now.commit(), Err(Refusal::Update(UpdateFault::NotBegun)));
}

#[test]
fn a_program_that_is_not_the_signed_one_is_never_valid() {
    for at in [0, 2000, 3998] {
        let mut now = updater(device());
        let (header, mut program) = image(1, 2, 3999);
        program[at] ^= 0x10;
        assert_eq!(install(&mut now, &(header, program)), Err(Refusal::Update(UpdateFault::Digest)));
        assert_eq!(boot(now.slots()), Some(0));
    }
    let mut short = updater(device());
    let (header, program) = image(1, 2, 3999);
    assert_eq!(
        install(&mut short, &(header, program[..3840].to_vec())),
        Err(Refusal::Update(UpdateFault::Gap(3840)))
    );
    // A bit that changes later.
    let mut now = updater(device());
    assert_eq!(install(&mut now, &image(1, 2, 3999)), Ok(()));
    now.slots().bytes[1][PROGRAM as usize + 1234] ^= 1;
    assert_eq!(boot(now.slots()), Some(0));
}

#[test]
fn pieces_with_lost_answers_are_repeated_and_gaps_are_named() {
    let mut now = updater(device());
    let (header, program) = image(1, 2, 3999);
    assert_eq!(now.begin(&header.to_bytes()), Ok(()));
    let piece = |offset: usize| UpdatePiece {
        offset: offset as u32,
        bytes: heapless::Vec::from_slice(&program[offset..offset + 256]).expect("a piece"),
    };
    assert_eq!(now.piece(&piece(0)), Ok(256));
    assert_eq!(now.piece(&piece(0)), Ok(256), "again");
    assert_eq!(now.piece(&piece(512)), Err(Refusal::Update(UpdateFault::Gap(256))));
    assert_eq!(now.piece(&piece(256)), Ok(512));
    let far = UpdatePiece { offset: u32::MAX, ..piece(0) };
    assert_eq!(now.piece(&far), Err(Refusal::Update(UpdateFault::TooLong)));
}

#[test]
fn the_program_before_is_started_on_request_if_it_is_whole() {
    let mut now = updater(device());
    assert_eq!(now.revert(), Ok(()));
    let mut mock = now.slots;
    assert_eq!((boot(&mut mock), release(&mock)), (Some(1), 0));
    let mut damaged = updater(device());
    damaged.slots().bytes[1][PROGRAM as usize + 1] ^= 1;
    assert_eq!(damaged.revert(), Err(Refusal::Update(UpdateFault::NoOther)), "nothing would start");
    assert_eq!(boot(damaged.slots()), Some(0));
    let state = State::from_bytes(&[0xFF; STATE_LENGTH]);
    assert_eq!((state.valid, state.next_try()), (ERASED, Some(0)));
}
