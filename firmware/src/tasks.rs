//! What runs side by side: the control loop, the link, telemetry. A board wraps each in a task of its executor.

use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex as Gate;
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;
use model_core::link::frame::{Accumulator, MAX_TOPIC};

use crate::board::{Outputs, Plant};
use crate::server::Server;
use crate::shared::Shared;

/// The control loop, without end, in the plant's time.
pub async fn control(plant: &mut impl Plant, shared: &Shared) -> ! {
    let mut outputs = Outputs::VENT;
    loop {
        let inputs = plant.exchange(&outputs).await;
        outputs = shared.step(&inputs);
    }
}

/// The link: reads requests, writes answers; returns when the host has requested a restart and has been answered, or
/// when the port is gone.
pub async fn link<R: Read, W: Write, F: NorFlash>(
    receiver: &mut R,
    sender: &Gate<CriticalSectionRawMutex, W>,
    server: &mut Server<F>,
    shared: &Shared,
) {
    let mut accumulator = Accumulator::new();
    let mut bytes = [0; 32];
    loop {
        let count = match select(receiver.read(&mut bytes), shared.change()).await {
            Either::First(Ok(count)) => count,
            Either::First(Err(_)) => return,
            Either::Second(()) => {
                server.keep(shared);
                continue;
            }
        };
        for &byte in &bytes[..count] {
            server.note_counts(accumulator.counts());
            let Some(Ok(request)) = accumulator.push_to_answer(byte) else { continue };
            let answer = server.handle(request, shared);
            if sender.lock().await.write_all(answer).await.is_err() || server.wants_restart() {
                return;
            }
        }
    }
}

/// Telemetry and events, without end; returns when the port is gone.
pub async fn telemetry<W: Write>(sender: &Gate<CriticalSectionRawMutex, W>, shared: &Shared) {
    let mut out = [0; MAX_TOPIC];
    loop {
        let length = shared.next(&mut out).await;
        if sender.lock().await.write_all(&out[..length]).await.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests;
