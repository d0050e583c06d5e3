//! Memory of a fit beside its recordings: a constant number of bytes a row, also where noise and failed readings leave many points.
#![allow(clippy::expect_used)] // what fails here fails the test

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use model_core::braid::miniature;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_fit::{Options, columns, fit};

/// A row is 32 bytes as it is read. Of these loops, which leave a point for every two or three rows, a fit takes about 140 beside it: one list of points
/// and two linear problems. A second copy of the points for each problem exceeds the bound.
const BYTES_A_ROW: f64 = 200.0;

/// Bytes that are allocated, and the most that were.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the allocator of the system; the counters are beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller's promises are those of this call.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A number from 0 to 1, the same in every run.
fn draw(state: &mut u32) -> f64 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    f64::from(*state >> 8) / f64::from(1 << 24)
}

/// Loops at six pressures, one after another and again, with noise and one outlier of the force in a thousand rows; `drop_outs` of the
/// pressure are as frequent.
fn loops(rows: usize, drop_outs: bool) -> Recording {
    const LOOP: usize = 1000;
    let braid = miniature().build().expect("a braid");
    let mut state = 1;
    let mut noise = |size: f64| size * (draw(&mut state) + draw(&mut state) + draw(&mut state) - 1.5);
    let mut recording = Recording { name: "loops".into(), force: Some(Vec::new()), ..Recording::default() };
    for i in 0..rows {
        let level = 207e3 + 69e3 * ((i / LOOP) % 6) as f64;
        let phase = (i % LOOP) as f64 / LOOP as f64;
        let stroke = 2.4e-3 * level / 552e3 * (1.0 - (1.0 - 2.0 * phase).abs());
        let way = if phase < 0.5 { 1.0 } else { -1.0 };
        let c = columns(&braid, stroke);
        let force = ((level - 76.5e3) * c.area + 2e6 * c.elastic[0]) * (1.0 - 0.1 * way);
        let outlier = if i % 1000 == 617 { 15.0 } else { 0.0 };
        let dropped = drop_outs && i % 1000 == 211;
        recording.time.push(0.025 * i as f64);
        recording.pressure.push(if dropped { 0.0 } else { level + noise(300.0) });
        recording.stroke.push(stroke + noise(2e-6));
        recording.force.get_or_insert_default().push(force + outlier + noise(0.05));
    }
    recording
}

/// One test, since the counters are those of the process.
#[test]
fn a_fit_of_noisy_loops_takes_few_bytes_a_row_beside_the_recordings() {
    let muscle = MuscleDescription::parse(
        "name = \"mini\"\nkind = \"contractile\"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n\
         bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n",
    )
    .expect("a description");
    let rows = 120_000;
    for drop_outs in [false, true] {
        let campaign = Campaign::new(vec![loops(rows, drop_outs)]);
        let before = NOW.load(Ordering::Relaxed);
        MOST.store(before, Ordering::Relaxed);
        let fitted = fit(&campaign, &muscle, &Options::default()).expect("a fit");
        let used = (MOST.load(Ordering::Relaxed) - before) as f64 / rows as f64;
        let points = fitted.solution.problem.points.list.len();
        println!("{used:.0} bytes a row, {points} points, drop-outs: {drop_outs}");
        assert!((fitted.summary.deadband_kPa - 76.5).abs() < 1.0, "P0 {}", fitted.summary.deadband_kPa);
        assert!(used < BYTES_A_ROW, "{used:.0} bytes a row, {points} points, drop-outs: {drop_outs}");
    }
}
