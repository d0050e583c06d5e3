use super::*;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};
use pam_fit::stock::MountingCause;

const LENGTHS: [f64; 5] = [90.0, 130.0, 180.0, 260.0, 400.0];

/// Staircases of five muscles at four lengths, by a law that is not the model's. Each error is by muscle and mounting.
#[derive(Clone, Copy)]
struct Bench {
    /// Shorter than read, mm.
    length: fn(usize, usize) -> f64,
    /// Zero of the load cell, N.
    zero: fn(usize, usize) -> f64,
    /// Scale of the load cell.
    scale: fn(usize, usize) -> f64,
    /// Share by which the pressure at which a muscle begins to pull grows faster with its contraction.
    onset: fn(usize) -> f64,
}

const EXACT: Bench = Bench { length: |_, _| 0.0, zero: |_, _| 0.0, scale: |_, _| 1.0, onset: |_| 0.0 };

/// Between −1 and 1, without a trend over muscles or mountings.
fn scattered(muscle: usize, mounting: usize) -> f64 {
    (((11 * muscle + 5 * mounting + 3 * muscle * mounting) % 7) as f64 - 3.0) / 3.0
}

fn muscle(length: f64) -> MuscleDescription {
    MuscleDescription::parse(&format!(
        "name='m{length}'\nkind='contractile'\nrest_length_mm={length}\nbraid_angle_deg=61.4\n\
         bladder_outer_diameter_mm=10.0\nbladder_wall_mm=1.8\n"
    ))
    .expect("a valid description")
}

fn campaign(bench: &Bench, m: usize) -> Campaign {
    let recordings = (0..4).map(|k| {
        let stroke = 0.04 * k as f64 * LENGTHS[m];
        let contraction = (stroke + (bench.length)(m, k)) / LENGTHS[m];
        let force = |(i, pressure): (usize, &f64)| {
            let onset = 60e3 + 4.0e6 * (1.0 + (bench.onset)(m)) * contraction;
            let above = (pressure - onset) / 20e3;
            let soft = 20e3 * (if above > 30.0 { above } else { above.exp().ln_1p() });
            let direction = if i <= 24 { 1.0 } else { -1.0 };
            let noise = 0.2 * scattered(i, 3 * m + k);
            (bench.scale)(m, k) * 7.5e-4 * (1.0 - 2.0 * contraction) * soft * (1.0 - 0.02 * direction)
                + (bench.zero)(m, k)
                + noise
        };
        let levels: Vec<f64> = (0..=24).chain((0..24).rev()).map(|k| 27e3 * f64::from(k)).collect();
        Recording {
            name: format!("{}-{k}", LENGTHS[m]),
            time: (0..levels.len()).map(|i| i as f64 + 100.0 * k as f64).collect(),
            force: Some(levels.iter().enumerate().map(force).collect()),
            stroke: vec![stroke * 1e-3; levels.len()],
            pressure: levels,
            ..Recording::default()
        }
    });
    Campaign::new(recordings.collect())
}

fn lengths(bench: &Bench) -> MountedLengths {
    let muscles: Vec<MuscleDescription> = LENGTHS.iter().map(|l| muscle(*l)).collect();
    let campaigns: Vec<Campaign> = (0..LENGTHS.len()).map(|m| campaign(bench, m)).collect();
    let members: Vec<Member<'_>> =
        muscles.iter().zip(&campaigns).map(|(muscle, campaign)| Member { muscle, campaign }).collect();
    let found = diagnose_stock(&members).expect("a stock");
    found.mounted_lengths.expect("held mountings")
}

#[test]
fn wrong_lengths_are_named_with_their_size() {
    let found = lengths(&Bench { length: |m, k| 0.9 * scattered(m, k), ..EXACT });
    assert!(found.named(), "{found:#?}");
    assert!(found.confusable_with.is_empty(), "{found:#?}");
    // The rms of the lengths is 0.6 mm. Against a mean of three others it is larger by a third.
    assert!((0.4e-3..1.2e-3).contains(&found.size.value), "{:?}", found.size);
    for own in found.muscles.iter().flatten() {
        assert!(own.with_length < 0.5 * own.before, "{own:?}");
    }
}

#[test]
fn other_causes_are_not_called_lengths() {
    let refusal = |bench: &Bench| lengths(bench).why_not;
    let zero = Bench { zero: |m, k| 9.0 * scattered(m, k), ..EXACT };
    let scale = Bench { scale: |m, k| 1.0 + 0.06 * scattered(m, k), ..EXACT };
    let braid = Bench { onset: |m| 0.15 * scattered(m, 0), ..EXACT };
    assert!(matches!(refusal(&EXACT), Some(LengthsRefusal::SmallErrors { .. })));
    assert_eq!(refusal(&zero), Some(LengthsRefusal::OtherCause(MountingCause::ForceZero)));
    assert_eq!(refusal(&scale), Some(LengthsRefusal::OtherCause(MountingCause::ForceScale)));
    assert_eq!(refusal(&braid), Some(LengthsRefusal::FollowContraction));
}
