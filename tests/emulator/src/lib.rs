//! The controller's image in QEMU: built by `firmware/build`, started with its link and its benches on TCP, ended with the
//! value that holds it.
//!
//! Nothing is skipped in silence: without a compiler for the target or without QEMU every test fails with the sentence
//! that says what to run, unless `PAM_SKIP_EMULATOR=1` is set.

pub mod bandwidth;
#[cfg(unix)]
pub mod campaign_rig;
pub mod closed_loop;
pub mod debugger;
pub mod diagnosed;
pub mod faulty_line;
pub mod figures;
pub mod fitting;
pub mod follower;
pub mod joint;
pub mod line;
pub mod machine;
pub mod misjudged;
pub mod pair;
pub mod patience;
pub mod program;
pub mod pulses;
pub mod shared_line;
pub mod stations;
pub mod sweep;
pub mod tracking;

pub use machine::{Machine, Options, Skipped};
pub use stations::Watched;

use model_core::image;
use model_core::link::endpoints::{GetInfo, RollBackTable};
use model_core::link::messages::{RollBack, Side};
use model_core::table::MuscleTable;
use pam_device::Client;

/// The bytes of a table.
///
/// # Panics
/// For a table that cannot be used: a mistake in a test.
pub fn image_of(table: &MuscleTable) -> Vec<u8> {
    let mut buffer = [0; image::MAX_LEN];
    image::write(table, &mut buffer).expect("a valid table").to_vec()
}

/// Sends a table as `host flash` does: in pieces, committed, read back, compared.
///
/// # Panics
/// When the device refuses it.
pub fn upload(client: &mut Client, side: Side, table: &MuscleTable) {
    pam_device::tables::write(client, side, &image_of(table), |_| ()).expect("the table is taken");
}

/// Goes back to the table before, as `host device rollback` does.
///
/// # Panics
/// When the device refuses it.
pub fn roll_back(client: &mut Client, side: Side) {
    let table = client.call::<GetInfo>(&()).expect("its tables").tables[side.index()].expect("a table");
    let request = RollBack { side, generation: table.generation };
    client.call::<RollBackTable>(&request).expect("there is one before");
}
