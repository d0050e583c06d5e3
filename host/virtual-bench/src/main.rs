//! `virtual-bench`: make recordings of a virtual muscle, or be the plant of a controller.

use clap::{Parser, Subcommand};
use std::error::Error;
use std::io::Write as _;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use virtual_bench::bench::{Bench, BenchSpec};
use virtual_bench::muscle::Muscle;
use virtual_bench::plant::{Motion, PlantStation, Scripts};
use virtual_bench::protocol::Protocol;
use virtual_bench::recording::Columns;
use virtual_bench::{campaigns, checks, lockstep, presets};

/// A virtual test bench for pneumatic artificial muscles.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Carry out a protocol and write its recordings, the muscle description and the truth.
    Record {
        /// mini, contractile, push or random:SEED.
        #[arg(long)]
        muscle: String,
        /// thesis, A, B, C, D, staircase or a protocol file.
        #[arg(long)]
        protocol: String,
        /// Directory for the files.
        #[arg(short, long)]
        output: PathBuf,
        /// Seed of noise and order of levels.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Pressure levels in kPa; default the thesis's for its muscles, six levels for others.
        #[arg(long, value_delimiter = ',')]
        levels: Vec<f64>,
        /// Samples per second, instead of the protocol's.
        #[arg(long)]
        sample_hz: Option<f64>,
        /// csv, or thesis for tab-separated raw files in inches and load-cell units.
        #[arg(long, default_value = "csv")]
        format: String,
        /// Perfect instruments.
        #[arg(long)]
        ideal: bool,
        /// By which part the load cell reads too much.
        #[arg(long, default_value_t = 0.0)]
        cell_gain: f64,
        /// Also write pressure_command_kPa, temperature_C and cycle.
        #[arg(long)]
        all_columns: bool,
    },
    /// Check the bench without its muscle: dead weights, a rigid bar, a reference gauge.
    Check {
        /// The muscle whose forces and pressures the checks go up to: mini, contractile, push or random:SEED.
        #[arg(long)]
        muscle: String,
        /// Directory for the files.
        #[arg(short, long)]
        output: PathBuf,
        /// Seed of the noise.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// By which part the load cell reads too much.
        #[arg(long, default_value_t = 0.0)]
        cell_gain: f64,
    },
    /// Be the plant of a controller, one exchange per control tick (see the documentation of `lockstep`).
    Plant {
        /// Address to listen on; port 0 takes a free one, which is printed.
        #[arg(long, default_value = "127.0.0.1:0")]
        listen: String,
        /// mini, contractile, push or random:SEED.
        #[arg(long, default_value = "mini")]
        muscle: String,
        /// Motion scripts, a TOML file of [[script]] tables; default held at rest length.
        #[arg(long)]
        scripts: Option<PathBuf>,
        /// Control periods per second.
        #[arg(long, default_value_t = 1000.0)]
        rate_hz: f64,
        /// Seed of noise.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Connections to serve before ending; 0 for ever.
        #[arg(long, default_value_t = 1)]
        connections: u64,
        /// Write what was commanded and what was true to this CSV file at the end.
        #[arg(long)]
        log: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("virtual-bench: {e}");
            ExitCode::FAILURE
        }
    }
}

fn muscle(name: &str) -> Result<virtual_bench::muscle::MuscleSpec, Box<dyn Error>> {
    presets::by_name(name)
        .ok_or_else(|| format!("no muscle \"{name}\": take mini, contractile, push or random:SEED").into())
}

fn write(dir: &Path, name: &str, text: &str) -> Result<(), Box<dyn Error>> {
    let path = dir.join(name);
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()).into())
}

impl Command {
    fn run(self) -> Result<(), Box<dyn Error>> {
        match self {
            Self::Record {
                muscle: name,
                protocol,
                output,
                seed,
                levels,
                sample_hz,
                format,
                ideal,
                cell_gain,
                all_columns,
            } => {
                let mut spec = BenchSpec::laboratory(muscle(&name)?, seed);
                if ideal {
                    spec.instruments = virtual_bench::sensors::Instruments::ideal();
                }
                spec.instruments.force.gain += cell_gain;
                let built = Muscle::new(spec.muscle.clone());
                let levels: Vec<f64> = match name.as_str() {
                    _ if !levels.is_empty() => levels.iter().map(|l| l * 1e3).collect(),
                    "mini" => presets::miniature_pressures(),
                    "contractile" | "push" => presets::large_pressures(),
                    _ => campaigns::levels(&built),
                };
                let mut protocol = match campaigns::by_name(&protocol, &built, &levels, seed) {
                    Some(p) => p,
                    None => {
                        let text = std::fs::read_to_string(&protocol).map_err(|e| {
                            format!("{protocol}: {e}; ready-made are thesis, A, B, C, D, staircase")
                        })?;
                        Protocol::from_toml(&text).map_err(|e| format!("{protocol}: {e}"))?
                    }
                };
                protocol.sample_hz = sample_hz.unwrap_or(protocol.sample_hz);
                let files = Bench::new(&spec).run(&protocol)?;
                std::fs::create_dir_all(&output).map_err(|e| format!("{}: {e}", output.display()))?;
                let columns = Columns { command: all_columns, temperature: all_columns, cycle: all_columns };
                for (i, f) in files.iter().enumerate() {
                    match format.as_str() {
                        "csv" => write(&output, &format!("{}.csv", f.name), &f.csv(columns))?,
                        "thesis" => {
                            let level = levels.get(i).copied().unwrap_or(f64::NAN);
                            let zero = 1.0 + 0.01 * (seed % 97) as f64;
                            write(
                                &output,
                                &format!("{}.txt", f.name),
                                &f.thesis(&spec.muscle.name, level, zero),
                            )?;
                        }
                        other => return Err(format!("no format \"{other}\": take csv or thesis").into()),
                    }
                }
                write(&output, "muscle.toml", &spec.muscle.description())?;
                write(&output, "protocol.toml", &protocol.to_toml()?)?;
                write(&output, "truth.json", &serde_json::to_string_pretty(&built.truth(&levels))?)?;
                let rows: usize = files.iter().map(|f| f.rows.len()).sum();
                let file = if files.len() == 1 { "file" } else { "files" };
                println!("{} {file}, {rows} rows in {}", files.len(), output.display());
                Ok(())
            }
            Self::Check { muscle: name, output, seed, cell_gain } => {
                let mut spec = BenchSpec::laboratory(muscle(&name)?, seed);
                spec.instruments.force.gain = cell_gain;
                let built = Muscle::new(spec.muscle.clone());
                let pressure = spec.muscle.max_pressure;
                let checks = checks::all(&spec, built.quasi_static(pressure, 0.0), pressure, 0.0);
                std::fs::create_dir_all(&output).map_err(|e| format!("{}: {e}", output.display()))?;
                for check in &checks {
                    write(&output, &format!("{}.csv", check.name), &check.csv)?;
                }
                println!("{} checks in {}", checks.len(), output.display());
                Ok(())
            }
            Self::Plant { listen, muscle: name, scripts, rate_hz, seed, connections, log } => {
                if !(rate_hz.is_finite() && rate_hz > 0.0) {
                    return Err("--rate-hz must be above zero".into());
                }
                let scripts: Vec<Motion> = match scripts {
                    Some(path) => {
                        let text =
                            std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
                        Scripts::from_toml(&text).map_err(|e| format!("{}: {e}", path.display()))?.script
                    }
                    None => Vec::new(),
                };
                let spec = BenchSpec::laboratory(muscle(&name)?, seed);
                let mut station = PlantStation::new(spec, scripts, 1.0 / rate_hz);
                let listener = TcpListener::bind(&listen).map_err(|e| format!("{listen}: {e}"))?;
                println!("listening on {}", listener.local_addr()?);
                std::io::stdout().flush()?;
                let mut served = 0;
                while connections == 0 || served < connections {
                    let (mut stream, _) = listener.accept()?;
                    stream.set_nodelay(true)?;
                    let periods = lockstep::serve(&mut stream, &mut station)?;
                    println!("{periods} periods");
                    served += 1;
                }
                if let Some(path) = log {
                    let mut text = String::from(
                        "time_s,script,pressure_command_kPa,setpoint_N,pressure_kPa,displacement_mm,force_N,temperature_C\n",
                    );
                    for r in station.log() {
                        text.push_str(&format!(
                            "{:.4},{},{:.3},{:.4},{:.3},{:.5},{:.4},{:.2}\n",
                            r.time,
                            r.script,
                            r.command * 1e-3,
                            r.setpoint,
                            r.truth.pressure * 1e-3,
                            r.truth.stroke * 1e3,
                            r.truth.force,
                            r.truth.temperature,
                        ));
                    }
                    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
                }
                Ok(())
            }
        }
    }
}
