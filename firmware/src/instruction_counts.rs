//! Counts instructions on the emulated Cortex-M4F: `qemu-system-arm -M mps2-an386 -icount shift=0`.
//!
//! With `-icount shift=0` an instruction takes a nanosecond of virtual time, and SysTick counts the 25 MHz clock, so one tick
//! is 40 instructions on every run. Each point is evaluated many times in a row, so that the resolution is better than one
//! instruction; the cost of the empty loop is subtracted. Lines `name mean worst points` go to the debugger's console, and
//! `tests/emulator` reads them.

#![no_std]
#![no_main]

#[path = "boards/memory.rs"]
mod memory;
#[path = "boards/mps2_an386/semihosting.rs"]
#[allow(dead_code, reason = "this image needs no files")]
mod semihosting;

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use firmware::board::{Inputs, Readings};
use firmware::control::Controller;
use firmware::health::Health;
use firmware::modes::Model;
use model_core::effects::{EffectName, FittedEffect, MAX_PARAMETERS};
use model_core::image;
use model_core::link::messages::{HealthSums, Mode, Reference, ReferenceOrder, Session, Side};
use model_core::link::settings::Settings;
use model_core::motion::Motion;
use model_core::muscle::Muscle;
use model_core::single_precision;
use model_core::table::{self, MuscleTable};
use model_core::units::{Length, Pressure};
use static_cell::StaticCell;

/// This image serves no interrupts.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
#[used]
pub static __INTERRUPTS: [usize; 1] = [0];

const INSTRUCTIONS_PER_TICK: f32 = 40.0;
const WRAP: u32 = 0x00FF_FFFF;

/// Ticks that something takes; less than the 0.67 s of virtual time after which SysTick wraps.
fn ticks(mut run: impl FnMut()) -> u32 {
    let before = SYST::get_current();
    run();
    before.wrapping_sub(SYST::get_current()) & WRAP
}

/// Instructions of one of `repeats` equal calls, without the loop and what hands the arguments over.
fn instructions<A: Copy, R>(repeats: u32, arguments: A, mut call: impl FnMut(A) -> R) -> f32 {
    let all = ticks(|| {
        for _ in 0..repeats {
            black_box(call(black_box(arguments)));
        }
    });
    let bare = ticks(|| {
        for _ in 0..repeats {
            black_box(arguments);
        }
    });
    (all as f32 - bare as f32) * INSTRUCTIONS_PER_TICK / repeats as f32
}

/// Mean and worst of a sweep.
#[derive(Default)]
struct Sweep {
    sum: f32,
    worst: f32,
    points: u32,
}

impl Sweep {
    fn add(&mut self, instructions: f32) {
        self.sum += instructions;
        self.worst = self.worst.max(instructions);
        self.points += 1;
    }

    fn print(&self, name: &str) {
        hprintln!("{} {:.1} {:.1} {}", name, self.sum / self.points.max(1) as f32, self.worst, self.points);
    }
}

/// The formulas as the thesis prints them, with libm's `powf` and `sqrtf`: what the run-time form is compared with.
struct Direct {
    rest_length: f32,
    fibre: f32,
    turns: f32,
    volume: f32,
    rest_radius: f32,
    deadband: f32,
}

impl Direct {
    fn of(table: &MuscleTable) -> Option<Self> {
        let braid = table.geometry.cast::<f32>().build().ok()?;
        Some(Self {
            rest_length: braid.rest_length(),
            fibre: braid.fibre_length(),
            turns: braid.turns(),
            volume: braid.bladder_volume(),
            rest_radius: braid.rest_radius(),
            deadband: table.deadband.pascals(),
        })
    }

    fn force(&self, table: &MuscleTable, pressure: f32, stroke: f32, direction: f32) -> f32 {
        use core::f32::consts::PI;
        let length = self.rest_length - stroke;
        let radius =
            libm::sqrtf(libm::powf(self.fibre, 2.0) - libm::powf(length, 2.0)) / (2.0 * PI * self.turns);
        let wall = radius - libm::sqrtf(libm::powf(radius, 2.0) - self.volume / (PI * length));
        let radial = radius / self.rest_radius - 1.0;
        let axial = length / self.rest_length - 1.0;
        let gaylord = (pressure - self.deadband)
            * (3.0 * libm::powf(length, 2.0) - libm::powf(self.fibre, 2.0))
            / (4.0 * PI * libm::powf(self.turns, 2.0));
        // Linear interpolation between the nodes instead of splines: the cheapest form of a direct port.
        let last = table.nodes.len() - 1;
        let after = table.nodes.iter().position(|node| *node > pressure).unwrap_or(last).clamp(1, last);
        let (from, to) = (table.nodes[after - 1], table.nodes[after]);
        let share = ((pressure - from) / (to - from)).clamp(0.0, 1.0);
        let between = |values: &[f32]| values[after - 1] + (values[after] - values[after - 1]) * share;
        let mut elastic = 0.0;
        for (k, curve) in table.elastic.iter().enumerate() {
            let power = (k + 1) as f32;
            elastic += between(curve)
                * (self.volume / length * libm::powf(axial, power)
                    - wall * libm::powf(length, 2.0) * libm::powf(radial, power)
                        / (2.0 * PI * libm::powf(self.turns, 2.0) * radius));
        }
        (gaylord + elastic) * (1.0 - between(&table.friction) * direction)
    }
}

/// Pressures and strokes of the sweep: the table's range and somewhat beyond.
fn sweep(mut at: impl FnMut(f32, f32, f32)) {
    for p in 0..12 {
        for x in 0..6 {
            for direction in [-1.0, 1.0] {
                at(90e3 + 43e3 * p as f32, 0.5e-3 * x as f32, direction);
            }
        }
    }
}

#[inline(never)]
fn direct_force_of(port: &Direct, table: &MuscleTable, p: f32, x: f32, s: f32) -> f32 {
    port.force(table, p, x, s)
}

fn functions(table: &MuscleTable, muscle: &Muscle<f32>) {
    let mut force = Sweep::default();
    let mut inverse = Sweep::default();
    let mut direct = Sweep::default();
    let port = Direct::of(table);
    let search = muscle.search();
    sweep(|p, x, s| {
        let (pressure, stroke) = (Pressure::from_pascals(p), Length::from_metres(x));
        force.add(instructions(64, (pressure, stroke, s), |(pressure, stroke, s)| {
            single_precision::force(muscle, pressure, stroke, s)
        }));
        let wanted = single_precision::force(muscle, pressure, stroke, s);
        let guess = Pressure::from_pascals(p + 5e3);
        inverse.add(instructions(64, (wanted, stroke, s, guess), |(wanted, stroke, s, guess)| {
            single_precision::pressure_at(muscle, stroke, s, wanted, guess, &search)
        }));
        if let Some(port) = &port {
            direct.add(instructions(16, (p, x, s), |(p, x, s)| direct_force_of(port, table, p, x, s)));
        }
    });
    force.print("force");
    inverse.print("inverse");
    direct.print("direct-port");
}

/// The whole 1 kHz step in force control: muscle moving, wave of force, telemetry at every tenth tick. The load cell is compared with
/// the table, or, as in a stroke that the table was not tested in, it is not.
fn whole_step(controller: &mut Controller, table: &MuscleTable, compared: bool) -> Option<Sweep> {
    let mut table = table.clone();
    if !compared {
        // Only the comparison looks at what was tested.
        table.tested.pressure_low = Pressure::from_pascals(0.0);
        table.tested.pressure_high = Pressure::from_pascals(1e3);
    }
    controller.use_table(Side::Agonist, &table).ok()?;
    let inputs = |pressure_pa, stroke_m, force_n| Inputs {
        sides: [Some(Readings { pressure_pa, stroke_m, force_n }.into()), None],
        ..Inputs::default()
    };
    // Empty, as it must be to be armed.
    for tick in 0..100_u32 {
        controller.step(&inputs((tick % 2) as f32, 0.9e-3, 0.0));
    }
    let wave = Reference::Sine { mean: 45.0, amplitude: 20.0, frequency_hz: 2.0 };
    let owner = Session::default();
    let began = controller.arm(owner).is_ok()
        && controller.start(Mode::Force, owner).is_ok()
        && controller.reference(ReferenceOrder { reference: wave, session: owner }).is_ok();
    controller.set_telemetry(10);
    let mut sweep = Sweep::default();
    let mut pressure = 100e3;
    for tick in 0..4000_u32 {
        let phase = (tick % 1000) as f32 / 1000.0;
        let triangle = if phase < 0.5 { phase } else { 1.0 - phase };
        let readings = inputs(pressure, 0.3e-3 + 2.4e-3 * triangle, 45.0 + phase);
        let mut wanted = 0.0;
        // It is the owner, so this is not refused.
        let _ = controller.keep_alive(owner);
        let spent = ticks(|| {
            wanted = black_box(controller.step(black_box(&readings))).sides[0].pressure_pa;
            // As the board's loop does: what is not there is not copied.
            if let Some(event) = controller.take_event() {
                black_box(&event);
            }
            if let Some(sample) = controller.take_sample() {
                black_box(&sample);
            }
        });
        pressure += (wanted - pressure) * 0.03 + if tick % 2 == 0 { 3.0 } else { -3.0 };
        sweep.add(spent as f32 * INSTRUCTIONS_PER_TICK);
    }
    let mut sums = HealthSums::default();
    controller.health(Side::Agonist).describe(&mut sums);
    if began && controller.mode() == Mode::Force && (sums.blocks > 0) == compared {
        // Allowed in every state.
        let _ = controller.disarm();
        Some(sweep)
    } else {
        hprintln!("the step did not run: {:?}", controller.faults().latched);
        None
    }
}

/// The step, and what it takes more where the load cell is compared with the table.
fn steps(table: &MuscleTable) {
    static CONTROLLER: StaticCell<Controller> = StaticCell::new();
    let controller = CONTROLLER.init_with(|| Controller::new(&Settings::default()));
    let Some(with) = whole_step(controller, table, true) else { return };
    let Some(without) = whole_step(controller, table, false) else { return };
    with.print("step");
    let mean = |sweep: &Sweep| sweep.sum / sweep.points.max(1) as f32;
    // The countdown to a sample runs in both.
    let mut idle = Health::default();
    let countdown = instructions(64, (), |()| idle.tick());
    let (more, worst) = (mean(&with) - mean(&without), with.worst - without.worst);
    hprintln!("health-of-step {:.1} {:.1} {}", more + countdown, worst + countdown, with.points);
}

/// Instructions of a tick of a model whose table carries these effects.
fn tick_with(table: &MuscleTable, effects: &[FittedEffect]) -> Option<f32> {
    let motion = Motion {
        dt: 1e-3,
        time: 1.0,
        stroke: 1e-3,
        speed: 2e-3,
        direction: 1.0,
        pressure_rate: 1e3,
        travel: 1e-3,
        since_reversal: 0.5,
        ..Motion::default()
    };
    let mut table = table.clone();
    table.effects.extend(effects.iter().cloned());
    let mut model = Model::build(&table).ok()?;
    let mut tick = 0_u32;
    Some(instructions(64, 300e3, |pressure_pa| {
        tick += 1;
        let moved = Motion { stroke: 1e-3 + 1e-6 * tick as f32, ..motion };
        model.tick(black_box(&moved), pressure_pa)
    }))
}

/// What the first effect of a table costs a tick more than another would, the context that all look at; and what each effect
/// adds on top, by its step and its force.
fn effects(table: &MuscleTable) {
    let Some(bare) = tick_with(table, &[]) else { return };
    hprintln!("tick-of-model {:.1} {:.1} 64", bare, bare);
    let mut context = Sweep::default();
    for effect in EffectName::ALL {
        let mut parameters = [0.0; MAX_PARAMETERS];
        let of = effect.info().parameters;
        for (to, parameter) in parameters.iter_mut().zip(of) {
            *to = 0.5 * (parameter.low + parameter.high);
        }
        let one = FittedEffect::new(*effect, &parameters[..of.len().min(MAX_PARAMETERS)]);
        let both = [one.clone(), one];
        let (Some(once), Some(twice)) = (tick_with(table, &both[..1]), tick_with(table, &both)) else {
            return;
        };
        context.add(once - (twice - once) - bare);
        hprintln!("effect:{} {:.1} {:.1} 64", effect.info().name, twice - once, twice - once);
    }
    context.print("context-of-effects");
}

#[entry]
fn main() -> ! {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(WRAP);
        core.SYST.clear_current();
        core.SYST.enable_counter();
    }
    let table = table::example();
    let mut buffer = [0; image::MAX_LEN];
    let length = image::write(&table, &mut buffer).map_or(0, <[u8]>::len);
    hprintln!("table-image {} {} 1", length, length);
    if let Ok(muscle) = Muscle::<f32>::build(&table) {
        functions(&table, &muscle);
    }
    steps(&table);
    effects(&table);
    hprintln!("end 0 0 0");
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    hprintln!("panic: {}", info);
    semihosting::fail();
}
