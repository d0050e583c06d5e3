//! What runs side by side: the control loop, the link, telemetry. A board wraps each in a task of its executor.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex as Gate;
use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;
use model_core::link::frame::{Accumulator, MAX_TOPIC};

use crate::board::{Outputs, Plant};
use crate::server::{Line, Server};
use crate::shared::Shared;

/// The control loop, without end, in the plant's time.
pub async fn control(plant: &mut impl Plant, shared: &Shared) -> ! {
    let mut outputs = Outputs::VENT;
    loop {
        let inputs = plant.exchange(&outputs).await;
        outputs = shared.step(&inputs);
    }
}

/// A server that the lines of a device share; one request is answered at a time.
pub type SharedServer<F> = Gate<CriticalSectionRawMutex, Server<F>>;

/// The link over one line: reads requests, writes answers; returns when the host has requested a restart and has been answered, or
/// when the port is gone. The server is left before the answer goes out, so that a line that takes nothing does not hold up another.
pub async fn link<R: Read, W: Write, F: NorFlash>(
    line: Line,
    receiver: &mut R,
    sender: &Gate<CriticalSectionRawMutex, W>,
    server: &SharedServer<F>,
    shared: &Shared,
) {
    let mut accumulator = Accumulator::new();
    let mut bytes = [0; 32];
    while let Ok(count) = receiver.read(&mut bytes).await {
        for &byte in &bytes[..count] {
            let counts = accumulator.counts();
            let Some(Ok(request)) = accumulator.push_to_answer(byte) else { continue };
            let (answer, restart) = {
                let mut server = server.lock().await;
                server.note_counts(line, counts);
                (server.handle(request, shared), server.wants_restart())
            };
            if sender.lock().await.write_all(answer).await.is_err() || restart {
                return;
            }
        }
    }
}

/// Keeps what must not be lost, whenever the state has changed.
pub async fn keep<F: NorFlash>(server: &SharedServer<F>, shared: &Shared) -> ! {
    loop {
        shared.change().await;
        server.lock().await.keep(shared);
    }
}

/// Telemetry and events, without end; returns when the port is gone. Another line is offered each frame first, and takes it only if it
/// has room: a slow one does not hold up this one.
pub async fn telemetry<W: Write>(
    sender: &Gate<CriticalSectionRawMutex, W>,
    shared: &Shared,
    mut other: impl FnMut(&[u8]),
) {
    let mut out = [0; MAX_TOPIC];
    loop {
        let length = shared.next(&mut out).await;
        other(&out[..length]);
        if sender.lock().await.write_all(&out[..length]).await.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests;
