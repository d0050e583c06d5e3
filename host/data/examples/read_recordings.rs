//! Reads recordings and says what was in them and how long it took: `read_recordings [--import F] [--muscle M]
//! [--motion] FILE…`. With `--motion` it also finds out how the muscle was moved.

use std::process::ExitCode;
use std::time::Instant;

use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::motion::Motion;
use pam_data::recording::{Import, Reader};

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let status = error.exit_status();
            eprintln!("{:?}", miette::Report::new(error));
            ExitCode::from(status)
        }
    }
}

fn run() -> pam_data::error::Result<()> {
    let (mut import, mut muscle, mut files, mut motion) = (None, None, Vec::new(), false);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--import" => import = Some(Import::read(arguments.next().unwrap_or_default())?),
            "--muscle" => muscle = Some(MuscleDescription::read(arguments.next().unwrap_or_default())?),
            "--motion" => motion = true,
            _ => files.push(argument),
        }
    }
    let reader = muscle.as_ref().map_or_else(Reader::new, Reader::of).import(import.as_ref());
    let start = Instant::now();
    let campaign = reader.campaign(&files)?;
    let elapsed = start.elapsed().as_secs_f64();
    for recording in campaign.recordings.iter().take(5) {
        println!("{}: {} rows, {:.3} s", recording.name, recording.len(), recording.duration());
    }
    println!(
        "{} recordings, {} rows, {:?} clock, read in {elapsed:.3} s",
        campaign.recordings.len(),
        campaign.samples(),
        campaign.clock
    );
    if motion {
        let start = Instant::now();
        let motions = Motion::of_campaign(&campaign);
        let reversals: usize = motions.iter().map(|m| m.reversals.len()).sum();
        let holds: usize = motions.iter().map(|m| m.holds.len()).sum();
        println!("{reversals} reversals and {holds} holds, found in {:.3} s", start.elapsed().as_secs_f64());
    }
    Ok(())
}
