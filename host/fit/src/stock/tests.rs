use super::*;
use pam_data::muscle_description::MuscleDescription;
use pam_data::recording::{Campaign, Recording};

/// Staircases at four lengths, by a law whose parameters are known. `own`: error of the mounted length in mm by muscle and mounting.
struct Bench {
    ends_mm: f64,
    compliance_mm_per_n: f64,
    own_mm: fn(usize, usize) -> f64,
    zero: fn(usize, usize) -> f64,
}

const LENGTHS: [f64; 5] = [90.0, 130.0, 180.0, 260.0, 400.0];

/// Force of a muscle without ends, N.
fn infinite(pressure: f64, contraction: f64, direction: f64) -> f64 {
    let onset = 60e3 + 2.2e6 * contraction;
    let above = (pressure - onset) / 30e3;
    let soft = 30e3 * (if above > 30.0 { above } else { above.exp().ln_1p() });
    7.5e-4 * (1.0 - 3.0 * contraction) * soft * (1.0 - 0.03 * direction)
}

fn muscle(length: f64) -> MuscleDescription {
    MuscleDescription::parse(&format!(
        "name='m{length}'\nkind='contractile'\nrest_length_mm={length}\nbraid_angle_deg=61.4\n\
         bladder_outer_diameter_mm=10.0\nbladder_wall_mm=1.8\n"
    ))
    .expect("a valid description")
}

fn campaign(bench: &Bench, index: usize) -> Campaign {
    let length = LENGTHS[index];
    let recordings = (0..4).map(|mounting| {
        let stroke = 0.04 * mounting as f64 * length;
        let levels: Vec<f64> = (0..=24).chain((0..24).rev()).map(|k| 27e3 * f64::from(k)).collect();
        let force = |(k, p): (usize, &f64)| {
            let direction = if k <= 24 { 1.0 } else { -1.0 };
            let mut force = 0.0;
            for _ in 0..60 {
                let x = stroke + (bench.own_mm)(index, mounting) + bench.compliance_mm_per_n * force;
                let pull = (1.0 - bench.ends_mm / length) * infinite(*p, x / length, direction);
                force = 0.5 * (force + pull);
            }
            force + (bench.zero)(index, mounting)
        };
        Recording {
            name: format!("{length}-{mounting}"),
            time: (0..levels.len()).map(|i| i as f64 + 100.0 * mounting as f64).collect(),
            force: Some(levels.iter().enumerate().map(force).collect()),
            stroke: vec![stroke * 1e-3; levels.len()],
            pressure: levels,
            ..Recording::default()
        }
    });
    Campaign::new(recordings.collect())
}

fn fitted(bench: &Bench) -> Stock {
    let muscles: Vec<MuscleDescription> = LENGTHS.iter().map(|l| muscle(*l)).collect();
    let campaigns: Vec<Campaign> = (0..LENGTHS.len()).map(|i| campaign(bench, i)).collect();
    let members: Vec<Member<'_>> =
        muscles.iter().zip(&campaigns).map(|(muscle, campaign)| Member { muscle, campaign }).collect();
    stock(&members).expect("a stock")
}

/// Errors as from a tape measure: fixed, without trend over the lengths.
fn tape(muscle: usize, mounting: usize) -> f64 {
    0.4 * (((7 * muscle + 3 * mounting) % 5) as f64 - 2.0) / 2.0
}

#[test]
fn ends_that_do_not_pull_come_out_with_their_length() {
    let found = fitted(&Bench {
        ends_mm: 18.0,
        compliance_mm_per_n: 0.0,
        own_mm: tape,
        zero: |m, k| (m + k) as f64 % 3.0 - 1.0,
    });
    assert_eq!(found.laws, [Law::Ends], "{:?}", found.tried);
    let ends = found.fit.shared[0];
    assert!((ends.value * 1e3 - 18.0).abs() < 2.5 * 1e3 * ends.std.max(1e-3), "{ends:?}");
    assert!(ends.value > 4.0 * ends.std, "{ends:?}");
    let tried = &found.tried;
    assert!(tried[1].error < 0.6 * tried[0].error, "{tried:?}");
}

#[test]
fn a_stock_without_ends_has_none() {
    let found = fitted(&Bench { ends_mm: 0.0, compliance_mm_per_n: 0.0, own_mm: tape, zero: |_, _| 0.0 });
    let ends = found.tried[1].values[0];
    assert!(ends.value.abs() < 2.5 * ends.std, "{ends:?}");
}

#[test]
fn a_frame_that_gives_way_is_not_called_ends() {
    let found =
        fitted(&Bench { ends_mm: 0.0, compliance_mm_per_n: 4e-3, own_mm: |_, _| 0.0, zero: |_, _| 0.0 });
    assert_eq!(found.laws, [Law::Compliance], "{:?}", found.tried);
    let compliance = found.fit.shared[2].value * 1e3;
    assert!((compliance - 4e-3).abs() < 1e-3, "{compliance} mm/N");
}

#[test]
fn a_wrong_length_and_a_wrong_zero_are_found_where_they_are() {
    let own = |muscle: usize, mounting: usize| if (muscle, mounting) == (2, 1) { 1.0 } else { 0.0 };
    let zero = |muscle: usize, mounting: usize| if (muscle, mounting) == (3, 2) { 6.0 } else { 0.0 };
    let found = fitted(&Bench { ends_mm: 18.0, compliance_mm_per_n: 0.0, own_mm: own, zero });
    let all = |of: fn(&Own) -> &Vec<Value>| {
        found
            .fit
            .own
            .iter()
            .enumerate()
            .flat_map(move |(m, o)| of(o).iter().enumerate().map(move |(k, v)| ((m, k), v.value.abs())))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("mountings")
    };
    assert_eq!(all(|o| &o.mounted).0, (2, 1));
    assert_eq!(all(|o| &o.zero).0, (3, 2));
    assert!((found.fit.own[3].zero[2].value - 6.0).abs() < 1.5, "{:?}", found.fit.own[3]);
}

#[test]
fn two_muscles_are_no_stock() {
    let one = muscle(100.0);
    let campaign =
        campaign(&Bench { ends_mm: 0.0, compliance_mm_per_n: 0.0, own_mm: |_, _| 0.0, zero: |_, _| 0.0 }, 0);
    let member = Member { muscle: &one, campaign: &campaign };
    assert!(stock(&[member, member]).is_err());
}
