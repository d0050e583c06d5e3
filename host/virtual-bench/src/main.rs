//! `virtual-bench`: record a virtual muscle, or simulate the plant of a controller.

use clap::{Args, Parser, Subcommand};
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
    /// Run a protocol and write its recordings, the muscle description and the true parameters.
    Record(Record),
    /// Check the bench without its muscle: dead weights, a rigid bar, a reference gauge.
    Check(Check),
    /// Simulate the plant of a controller, one exchange per control tick (see the documentation of `lockstep`).
    Plant(Plant),
}

#[derive(Args)]
struct Record {
    /// mini, contractile, push or random:SEED.
    #[arg(long)]
    muscle: String,
    /// thesis, A, B, C, D, staircase or a protocol file.
    #[arg(long)]
    protocol: String,
    /// Directory for the files.
    #[arg(short, long)]
    output: PathBuf,
    /// Seed of the noise and of the order of levels.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Pressure levels in kPa; default: those of the thesis for its muscles, six levels for others.
    #[arg(long, value_delimiter = ',')]
    levels: Vec<f64>,
    /// Samples per second, instead of the protocol's.
    #[arg(long)]
    sample_hz: Option<f64>,
    /// csv, or thesis for tab-separated raw files in inches and load-cell units.
    #[arg(long, default_value = "csv")]
    format: String,
    /// Ideal instruments: no noise, no error.
    #[arg(long)]
    ideal: bool,
    /// Relative gain error of the load cell.
    #[arg(long, default_value_t = 0.0)]
    cell_gain: f64,
    /// Also write pressure_command_kPa, temperature_C and cycle.
    #[arg(long)]
    all_columns: bool,
}

#[derive(Args)]
struct Check {
    /// The muscle whose largest force and pressure the checks reach: mini, contractile, push or random:SEED.
    #[arg(long)]
    muscle: String,
    /// Directory for the files.
    #[arg(short, long)]
    output: PathBuf,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Relative gain error of the load cell.
    #[arg(long, default_value_t = 0.0)]
    cell_gain: f64,
}

#[derive(Args)]
struct Plant {
    /// Address to listen on; port 0 selects a free one, which is printed.
    #[arg(long, default_value = "127.0.0.1:0")]
    listen: String,
    /// mini, contractile, push or random:SEED.
    #[arg(long, default_value = "mini")]
    muscle: String,
    /// Motion scripts, a TOML file of [[script]] tables; default: held at rest length.
    #[arg(long)]
    scripts: Option<PathBuf>,
    /// Control periods per second.
    #[arg(long, default_value_t = 1000.0)]
    rate_hz: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Connections to serve before exit; 0 for no limit.
    #[arg(long, default_value_t = 1)]
    connections: u64,
    /// Write commands and true values to this CSV file on exit.
    #[arg(long)]
    log: Option<PathBuf>,
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
    presets::by_name(name).ok_or_else(|| {
        format!("unknown muscle \"{name}\": choose mini, contractile, push or random:SEED").into()
    })
}

fn write(dir: &Path, name: &str, text: &str) -> Result<(), Box<dyn Error>> {
    let path = dir.join(name);
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()).into())
}

fn create_dir(path: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(path).map_err(|e| format!("{}: {e}", path.display()).into())
}

impl Command {
    fn run(self) -> Result<(), Box<dyn Error>> {
        match self {
            Self::Record(options) => options.run(),
            Self::Check(options) => options.run(),
            Self::Plant(options) => options.run(),
        }
    }
}

impl Record {
    fn run(self) -> Result<(), Box<dyn Error>> {
        let mut spec = BenchSpec::laboratory(muscle(&self.muscle)?, self.seed);
        if self.ideal {
            spec.instruments = virtual_bench::sensors::Instruments::ideal();
        }
        spec.instruments.force.gain += self.cell_gain;
        let built = Muscle::new(spec.muscle.clone());
        let levels: Vec<f64> = match self.muscle.as_str() {
            _ if !self.levels.is_empty() => self.levels.iter().map(|l| l * 1e3).collect(),
            "mini" => presets::miniature_pressures(),
            "contractile" | "push" => presets::large_pressures(),
            _ => campaigns::levels(&built),
        };
        let mut protocol = match campaigns::by_name(&self.protocol, &built, &levels, self.seed) {
            Some(p) => p,
            None => {
                let text = std::fs::read_to_string(&self.protocol).map_err(|e| {
                    format!("{}: {e}; choose a file, or thesis, A, B, C, D or staircase", self.protocol)
                })?;
                Protocol::from_toml(&text).map_err(|e| format!("{}: {e}", self.protocol))?
            }
        };
        protocol.sample_hz = self.sample_hz.unwrap_or(protocol.sample_hz);
        let files = Bench::new(&spec).run(&protocol)?;
        create_dir(&self.output)?;
        let all = self.all_columns;
        let columns = Columns { command: all, temperature: all, cycle: all };
        for (i, f) in files.iter().enumerate() {
            match self.format.as_str() {
                "csv" => write(&self.output, &format!("{}.csv", f.name), &f.csv(columns))?,
                "thesis" => {
                    let level = levels.get(i).copied().unwrap_or(f64::NAN);
                    let zero = 1.0 + 0.01 * (self.seed % 97) as f64;
                    let text = f.thesis(&spec.muscle.name, level, zero);
                    write(&self.output, &format!("{}.txt", f.name), &text)?;
                }
                other => return Err(format!("unknown format \"{other}\": choose csv or thesis").into()),
            }
        }
        write(&self.output, "muscle.toml", &spec.muscle.description())?;
        write(&self.output, "protocol.toml", &protocol.to_toml()?)?;
        write(&self.output, "truth.json", &serde_json::to_string_pretty(&built.truth(&levels))?)?;
        let rows: usize = files.iter().map(|f| f.rows.len()).sum();
        let file = if files.len() == 1 { "file" } else { "files" };
        println!("{} {file}, {rows} rows in {}", files.len(), self.output.display());
        Ok(())
    }
}

impl Check {
    fn run(self) -> Result<(), Box<dyn Error>> {
        let mut spec = BenchSpec::laboratory(muscle(&self.muscle)?, self.seed);
        spec.instruments.force.gain = self.cell_gain;
        let built = Muscle::new(spec.muscle.clone());
        let pressure = spec.muscle.max_pressure;
        let checks = checks::all(&spec, built.quasi_static(pressure, 0.0), pressure, 0.0);
        create_dir(&self.output)?;
        for check in &checks {
            write(&self.output, &format!("{}.csv", check.name), &check.csv)?;
        }
        println!("{} checks in {}", checks.len(), self.output.display());
        Ok(())
    }
}

impl Plant {
    fn run(self) -> Result<(), Box<dyn Error>> {
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            return Err("--rate-hz must be above zero".into());
        }
        let scripts: Vec<Motion> = match &self.scripts {
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
                Scripts::from_toml(&text).map_err(|e| format!("{}: {e}", path.display()))?.script
            }
            None => Vec::new(),
        };
        let spec = BenchSpec::laboratory(muscle(&self.muscle)?, self.seed);
        let mut station = PlantStation::new(spec, scripts, 1.0 / self.rate_hz);
        let listener = TcpListener::bind(&self.listen).map_err(|e| format!("{}: {e}", self.listen))?;
        println!("listening on {}", listener.local_addr()?);
        std::io::stdout().flush()?;
        let mut served = 0;
        while self.connections == 0 || served < self.connections {
            let (mut stream, _) = listener.accept()?;
            stream.set_nodelay(true)?;
            let periods = lockstep::serve(&mut stream, &mut station)?;
            println!("{periods} periods");
            served += 1;
        }
        match &self.log {
            Some(path) => write_log(path, &station),
            None => Ok(()),
        }
    }
}

/// The log of a plant as CSV: commands, setpoints and true values.
fn write_log(path: &Path, station: &PlantStation) -> Result<(), Box<dyn Error>> {
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
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()).into())
}
