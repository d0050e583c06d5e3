//! Firmware to a device in this process, over its link: sent, tried, confirmed, given up, gone back from.

#![allow(clippy::unwrap_used)] // what fails here fails the test
#![cfg(feature = "emulated")]

use firmware::board::{Inputs, Readings};
use firmware::native::{Device, Options};
use model_core::link::endpoints::{ConfirmUpdate, GetUpdate, Restart, RevertUpdate};
use model_core::link::hello::Board;
use pam_device::update::{Image, key_of, public_of, send, signed};
use pam_device::{Address, Client};

const SLOTS: [u32; 2] = [0x0001_0000, 0x0002_0000];

fn device(key: Option<[u8; 32]>) -> Device {
    let plant = |_: &firmware::board::Outputs| Inputs {
        sides: [Some(Readings::default().into()), None],
        ..Inputs::default()
    };
    Device::start("127.0.0.1:0", Options { speed: 20.0, update_key: key, ..Options::default() }, plant)
        .unwrap()
}

fn images(release: u16, key: u8) -> Vec<Image> {
    let program: Vec<u8> = (0..40_001_u32).map(|n| ((n * u32::from(release)) >> 3) as u8).collect();
    let key = key_of(&[key; 32]);
    [0, 1]
        .map(|slot| signed(Board::Native, slot, SLOTS[usize::from(slot)], (release, 0, 0), &program, &key))
        .to_vec()
}

fn client(device: &Device) -> Client {
    let address: Address = format!("tcp:{}", device.address()).parse().unwrap();
    Client::open(&address).unwrap()
}

fn restarted(device: &Device) -> Client {
    client(device).call_once::<Restart>(&()).unwrap();
    client(device)
}

#[test]
fn firmware_is_sent_tried_confirmed_and_gone_back_from() {
    let device = device(Some(public_of(&key_of(&[7; 32]))));
    let mut sent = 0;
    let status = send(&mut client(&device), &images(2, 7), |there| sent = there).unwrap();
    assert_eq!((status.running, sent), (0, 40_001));
    assert_eq!(status.slots[1].unwrap().release, [2, 0, 0]);
    let status = restarted(&device).call_once::<ConfirmUpdate>(&()).unwrap();
    assert_eq!((status.running, status.slots[1].unwrap().confirmed), (1, true));
    // The next one goes to the other slot, and no one confirms it.
    send(&mut client(&device), &images(3, 7), |_| ()).unwrap();
    let running: Vec<u8> =
        (0..5).map(|_| restarted(&device).call::<GetUpdate>(&()).unwrap().running).collect();
    assert_eq!(running, [0, 0, 0, 1, 1], "three starts, then the one before");
    send(&mut client(&device), &images(4, 7), |_| ()).unwrap();
    assert_eq!(restarted(&device).call_once::<ConfirmUpdate>(&()).unwrap().running, 0);
    client(&device).call_once::<RevertUpdate>(&()).unwrap();
    assert_eq!(restarted(&device).call::<GetUpdate>(&()).unwrap().running, 1);
}

#[test]
fn firmware_of_another_key_board_or_build_is_refused_with_the_reason() {
    let device = device(Some(public_of(&key_of(&[7; 32]))));
    let refused = |images: &[Image]| send(&mut client(&device), images, |_| ()).unwrap_err().to_string();
    assert!(refused(&images(2, 8)).contains("signature"), "{}", refused(&images(2, 8)));
    assert!(refused(&images(2, 7)[..1]).contains("no image for slot 1"), "{}", refused(&images(2, 7)[..1]));
    let mut torn = images(2, 7);
    torn[1].program[20_000] ^= 1;
    assert!(refused(&torn).contains("not what was signed"), "{}", refused(&torn));
    let without = self::device(None);
    let said = send(&mut client(&without), &images(2, 7), |_| ()).unwrap_err().to_string();
    assert!(said.contains("cannot do that"), "{said}");
}
