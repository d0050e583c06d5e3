//! `host device faults`: the latched fault, counts, and past faults, with the remedy.

use model_core::link::endpoints::{ClearFault, GetFaults, GetPastFault};
use model_core::link::messages::{FAULT_LOG, Fault, FaultReport, PastFault};

use crate::commands::port::PortOption;
use crate::console::Console;
use crate::documents::{device as document, text};
use pam_data::error::Result;
use pam_device::messages;

pub(super) fn run(port: &PortOption, clear: bool, json: bool, console: &Console) -> Result<()> {
    let mut client = port.connect(console)?;
    let faults = client.call::<GetFaults>(&())?;
    let mut past = Vec::new();
    for back in 0..FAULT_LOG as u8 {
        match client.call::<GetPastFault>(&PastFault { back })? {
            Some(report) => past.push(report),
            None => break,
        }
    }
    if json {
        let one = |r: &FaultReport| {
            let w = messages::fault(r.fault);
            document::Fault {
                fault: w.name,
                cause: w.cause,
                remedy: w.remedy,
                time_s: r.time_us as f64 * 1e-6,
                value: r.value,
                limit: r.limit,
                muscle: messages::side(r.side),
                mode: messages::mode(r.mode),
                last: document::Last {
                    pressure_Pa: r.last.pressure_pa,
                    stroke_m: r.last.stroke_m,
                    force_N: r.last.force_n,
                },
            }
        };
        let counts = Fault::ALL
            .iter()
            .zip(faults.counts)
            .filter(|(_, n)| *n > 0)
            .map(|(f, n)| (messages::fault(*f).name.to_owned(), n.into()))
            .collect();
        console.result(text(&document::Faults {
            schema: "pam-faults/1",
            latched: faults.latched.as_ref().map(one),
            counts,
            past: past.iter().map(one).collect(),
        })?);
    } else {
        match &faults.latched {
            Some(report) => {
                console.result(format!("latched: {}", messages::report(report)));
                console.result(format!("what to do: {}", messages::fault(report.fault).remedy));
            }
            None => console.result("no fault is latched"),
        }
        for (fault, count) in Fault::ALL.iter().zip(faults.counts).filter(|(_, n)| *n > 0) {
            console.result(format!("since the start: {} × {}", count, messages::fault(*fault).cause));
        }
        for report in &past {
            console.result(format!("past: {}", messages::report(report)));
        }
    }
    if clear {
        let status = client.call_once::<ClearFault>(&())?;
        console.note(format!("cleared; the device is {}", messages::state(status.state)));
    }
    Ok(())
}
