//! What a trial is: stratum, protocol, muscle, effects, noise; drawn from a prior that is public, with a seed that is not.

use crate::inject::Injection;
use crate::names::{OUTSIDE, SINGLES, class};
use serde::{Deserialize, Serialize};
use virtual_bench::bench::BenchSpec;
use virtual_bench::material::Hyperelastic;
use virtual_bench::pneumatics::Pneumatics;
use virtual_bench::presets;
use virtual_bench::rng::Rng;

/// What a trial is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stratum {
    /// Nothing is left out.
    NullClean,
    /// Nothing is left out, but the data are bad.
    NullNasty,
    /// One effect.
    Single,
    /// Two effects.
    Pair,
    /// Three effects.
    Triple,
    /// One effect in the shape of another.
    Decoy,
    /// Something that no name describes.
    Outside,
}

/// How large an effect is requested to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// Peak of its force, in parts of the blocked force.
    Peak(f64),
    /// Strength of its injection.
    Strength(f64),
}

/// The protocols of the sets.
pub const PROTOCOLS: [&str; 3] = ["A", "D", "C"];

/// One trial, drawn.
#[derive(Debug, Clone)]
pub struct Spec {
    /// Its number in the set.
    pub id: usize,
    /// What it is for.
    pub stratum: Stratum,
    /// One of [`PROTOCOLS`].
    pub protocol: &'static str,
    /// What is hidden: the effect and its requested size.
    pub effects: Vec<(Injection, Size)>,
    /// For a decoy, what it looks like.
    pub looks_like: Option<&'static str>,
    /// The bench without the effects.
    pub bench: BenchSpec,
    /// Seed of everything else in this trial.
    pub seed: u64,
    /// Part of the rows that is lost, for uneven sampling.
    pub lost_rows: f64,
    /// Extra noise per file, parts of the force's noise: every level is as loud as it likes.
    pub uneven_noise: f64,
    /// Whether the coloured part of the force's noise is resampled from residuals of real recordings, where these are.
    pub real_noise: bool,
    /// What the person at the bench does wrong.
    pub operator: Operator,
}

/// Mistakes of the person at the bench.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Operator {
    /// The recorder is started late, by up to this many seconds, in a third of the files.
    pub late_s: f64,
    /// It is stopped early by up to as many seconds, in a third of the files.
    pub early_s: f64,
    /// Two neighbouring levels are done in the wrong order, the first of them this one.
    pub swapped: Option<usize>,
    /// One tare is forgotten.
    pub forgot_tare: bool,
    /// The recorder fails within one file and is started again: two files.
    pub restarted: bool,
    /// The recorder's clock runs fast by this part.
    pub clock_skew: f64,
    /// The cell's zero is set before each file and runs away by up to this within it, parts of the blocked force.
    pub tared_drift: f64,
}

impl Operator {
    /// A careful user, the most frequent kind: small delays, and a clock that is off by some parts in a hundred thousand.
    fn careful(r: &mut Rng) -> Self {
        let late = if r.chance(0.25) { r.range(0.5, 6.0) } else { 0.0 };
        let swapped = r.chance(0.1).then(|| r.index(5));
        Self { late_s: late, swapped, clock_skew: r.range(-5e-5, 5e-5), ..Self::default() }
    }

    /// A careless user.
    fn careless(r: &mut Rng) -> Self {
        Self {
            late_s: if r.chance(0.7) { r.range(1.0, 25.0) } else { 0.0 },
            early_s: if r.chance(0.5) { r.range(1.0, 25.0) } else { 0.0 },
            swapped: r.chance(0.4).then(|| r.index(5)),
            forgot_tare: r.chance(0.3),
            restarted: r.chance(0.3),
            clock_skew: r.range(-5e-4, 5e-4),
            tared_drift: if r.chance(0.5) { r.range(0.0, 8e-4) } else { 0.0 },
        }
    }
}

/// Numbers of trials per stratum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Composition {
    /// Clean nulls.
    pub clean: usize,
    /// Nasty nulls.
    pub nasty: usize,
    /// Single effects.
    pub single: usize,
    /// Pairs.
    pub pair: usize,
    /// Triples.
    pub triple: usize,
    /// Decoys.
    pub decoy: usize,
    /// Outside the library.
    pub outside: usize,
}

impl Composition {
    /// The set of proof: 345 trials.
    pub const FINAL: Self =
        Self { clean: 30, nasty: 30, single: 180, pair: 45, triple: 15, decoy: 15, outside: 30 };
    /// Of `n` trials of a set.
    pub fn of(set: &str, n: usize) -> Self {
        let none = Self { clean: 0, nasty: 0, single: 0, pair: 0, triple: 0, decoy: 0, outside: 0 };
        match set {
            // No effects at all: what false alarms are counted on.
            "nulls" => Self { clean: n.div_ceil(2), nasty: n / 2, ..none },
            "plays" => Self { single: n.div_ceil(2), pair: n / 2, ..none },
            _ if n == Self::FINAL.total() => Self::FINAL,
            _ => Self::scaled(n),
        }
    }

    /// How many trials that is.
    pub const fn total(&self) -> usize {
        self.clean + self.nasty + self.single + self.pair + self.triple + self.decoy + self.outside
    }

    /// The same mixture in `n` trials, every stratum at least once.
    pub fn scaled(n: usize) -> Self {
        let f = Self::FINAL;
        let part = |of: usize| ((of * n) as f64 / f.total() as f64).round().max(1.0) as usize;
        let mut c = Self {
            clean: part(f.clean),
            nasty: part(f.nasty),
            single: 0,
            pair: part(f.pair),
            triple: part(f.triple),
            decoy: part(f.decoy),
            outside: part(f.outside),
        };
        c.single = n.saturating_sub(c.total());
        c
    }

    fn strata(&self) -> Vec<Stratum> {
        [
            (Stratum::NullClean, self.clean),
            (Stratum::NullNasty, self.nasty),
            (Stratum::Single, self.single),
            (Stratum::Pair, self.pair),
            (Stratum::Triple, self.triple),
            (Stratum::Decoy, self.decoy),
            (Stratum::Outside, self.outside),
        ]
        .iter()
        .flat_map(|&(s, n)| std::iter::repeat_n(s, n))
        .collect()
    }
}

/// Effects that are made to look like others: (truth, looks like).
const DECOYS: [(&str, &str); 5] = [
    ("pressure-lag", "viscous-damping"),
    ("sensor-delay", "viscous-damping"),
    ("force-drift", "thermal-softening"),
    ("backlash", "presliding-hysteresis"),
    ("rig-compliance", "braid-elasticity"),
];

/// Draw a set of trials. `family` sets its random numbers apart: no seed of the development set makes a trial of the final one.
///
/// Strata are mixed, so that the first trials of a set are a stratified share of it, and a number carries no information.
pub fn draw(seed: u64, family: &str, composition: Composition) -> Vec<Spec> {
    if family == "plays" {
        let lists = [vec!["backlash"], vec!["backlash", "thermal-softening"]];
        return draw_of(seed, family, composition.total(), &lists);
    }
    let mut r = Rng::stream(seed, &format!("{family} set"));
    let mut singles: Vec<usize> = (0..SINGLES.len()).collect();
    let mut strata = mixed(composition.strata(), &mut r);
    // Singles go round the catalogue in shuffled order, so that every name comes as often as any other.
    r.shuffle(&mut singles);
    let mut single = 0;
    let mut specs: Vec<Spec> = Vec::new();
    let mut per_stratum = std::collections::HashMap::new();
    for (id, stratum) in strata.drain(..).enumerate() {
        let n: &mut usize = per_stratum.entry(stratum).or_insert(0);
        // Three protocols equally within each stratum; for singles shifted on every round of the catalogue.
        let protocol = PROTOCOLS[(*n + *n / SINGLES.len()) % 3];
        let mut mine = Rng::stream(seed, &format!("{family} trial {id}"));
        let names: Vec<&'static str> = match stratum {
            Stratum::NullClean | Stratum::NullNasty => Vec::new(),
            Stratum::Single => {
                single += 1;
                vec![SINGLES[singles[(single - 1) % singles.len()]].0]
            }
            Stratum::Pair => pair(&mut mine, n.is_multiple_of(2)),
            Stratum::Triple => triple(&mut mine),
            Stratum::Decoy => vec![DECOYS[*n % DECOYS.len()].0],
            Stratum::Outside => vec![OUTSIDE[*n % OUTSIDE.len()]],
        };
        let looks_like = (stratum == Stratum::Decoy).then(|| DECOYS[*n % DECOYS.len()].1);
        *n += 1;
        specs.push(one(id, stratum, protocol, &names, looks_like, &mut mine));
    }
    specs
}

/// Single effects and pairs, in turn those of `lists`. Plays of the set of plays have a share of the stroke as their size.
pub fn draw_of(seed: u64, family: &str, n: usize, lists: &[Vec<&'static str>]) -> Vec<Spec> {
    (0..n)
        .map(|id| {
            let names = &lists[id % lists.len()];
            let protocol = PROTOCOLS[(id / lists.len()) % 3];
            let mut mine = Rng::stream(seed, &format!("{family} trial {id}"));
            let stratum = if names.len() > 1 { Stratum::Pair } else { Stratum::Single };
            let mut spec = one(id, stratum, protocol, names, None, &mut mine);
            if family == "plays" {
                for (injection, size) in spec.effects.iter_mut().filter(|e| e.0.name == "backlash") {
                    *size = Size::Strength(mine.log_range(2e-4, 2e-2) / injection.share_of_stroke());
                }
            }
            spec
        })
        .collect()
}

/// Effects by name, two joined by a plus.
pub fn effects_by_name(lists: &[String]) -> Result<Vec<Vec<&'static str>>, String> {
    let known = |name: &str| {
        let all = SINGLES.iter().map(|s| s.0).chain(OUTSIDE);
        all.into_iter().find(|k| *k == name).ok_or(format!("no effect \"{name}\""))
    };
    lists.iter().map(|l| l.split('+').map(known).collect()).collect()
}

/// Every stratum spread evenly over the set.
fn mixed(strata: Vec<Stratum>, r: &mut Rng) -> Vec<Stratum> {
    let count = |of: Stratum| strata.iter().filter(|s| **s == of).count() as f64;
    let mut so_far = std::collections::HashMap::new();
    let mut keyed: Vec<(f64, Stratum)> = strata
        .iter()
        .map(|&s| {
            let n = so_far.entry(s).or_insert(0.0);
            let key = (*n + r.unit()) / count(s);
            *n += 1.0;
            (key, s)
        })
        .collect();
    keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
    keyed.into_iter().map(|k| k.1).collect()
}

fn pair(r: &mut Rng, same_class: bool) -> Vec<&'static str> {
    for _ in 0..1000 {
        let (a, b) = (SINGLES[r.index(SINGLES.len())].0, SINGLES[r.index(SINGLES.len())].0);
        if a != b && (class(a) == class(b)) == same_class {
            return vec![a, b];
        }
    }
    vec!["viscous-damping", "sensor-delay"]
}

/// Three effects of three classes.
fn triple(r: &mut Rng) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    while names.len() < 3 {
        let name = SINGLES[r.index(SINGLES.len())].0;
        if names.iter().all(|n| class(n) != class(name)) {
            names.push(name);
        }
    }
    names
}

fn one(
    id: usize,
    stratum: Stratum,
    protocol: &'static str,
    names: &[&'static str],
    looks_like: Option<&'static str>,
    r: &mut Rng,
) -> Spec {
    let seed = r.bits();
    let mut muscle = presets::random(seed);
    muscle.name = format!("trial-{id:04}");
    // The contact's own give stays below what one sample sees, so that the plain law of friction is the truth of a null.
    let travel = muscle.geometry.rest_length * r.log_range(2e-5, 1e-4);
    muscle.friction.bristles = vec![(1.0, travel)];
    muscle.friction.slip = travel / r.range(400.0, 1200.0);
    let nasty = stratum == Stratum::NullNasty;
    if nasty && r.chance(0.5) {
        // A rubber that stiffens strongly: the elastic table is curved far more than a polynomial likes.
        let c10 = 0.3e6;
        let c30 = c10 * r.log_range(0.01, 0.03);
        muscle.material = Hyperelastic::Yeoh { c10, c20: -0.02 * c10, c30 };
        let top = 0.9 * muscle.max_pressure;
        let (deadband, contraction) = (muscle.max_pressure * r.range(0.06, 0.12), r.range(0.1, 0.2));
        muscle = muscle.with_deadband(deadband).with_free_contraction(top, contraction);
    }
    let mut bench = BenchSpec::laboratory(muscle, seed);
    bench.pneumatics = Pneumatics {
        lag: r.log_range(0.01, 0.1),
        rate: r.log_range(3e5, 5e6),
        deadband: r.range(0.0, 800.0),
        ripple: (r.log_range(50.0, 600.0), r.range(0.5, 6.0)),
        wander: (r.log_range(100.0, 800.0), r.log_range(2.0, 30.0)),
        line: r.log_range(5e-4, 4e-3),
        ..Pneumatics::default()
    };
    let i = &mut bench.instruments;
    let louder = if nasty { r.range(1.5, 4.0) } else { 1.0 };
    let range = i.force.coloured.0 / 3e-4;
    i.force.white = louder * range * r.log_range(1e-4, 4e-4);
    i.force.coloured = (louder * range * r.log_range(2e-4, 6e-4), r.log_range(1.0, 15.0));
    // Data-sheet errors of any good instrument; one filter before all converters, so that no channel lags another.
    i.force.bend = (r.range(-2e-4, 2e-4), range);
    i.force.creep = (r.range(-2e-4, 2e-4), r.log_range(20.0, 400.0));
    let filter = r.log_range(1e-3, 8e-3);
    [i.force.anti_alias, i.pressure.anti_alias, i.stroke.anti_alias] = [filter; 3];
    if nasty {
        i.force.bend.0 = r.range(-1e-3, 1e-3);
        i.force.creep.0 = r.range(-5e-4, 5e-4);
        i.force.stuck = if r.chance(0.4) { r.log_range(1e-3, 3e-2) } else { 0.0 };
        i.force.outliers = (r.log_range(2e-4, 3e-3), r.range(8.0, 40.0));
        i.pressure.outliers = (r.log_range(1e-4, 1e-3), r.range(5.0, 15.0));
        i.stroke.white *= r.range(1.0, 4.0);
    }
    let uneven_noise = if nasty { r.range(0.0, 3.0) } else { 0.0 };
    let lost_rows = if nasty && r.chance(0.6) { r.range(0.02, 0.3) } else { 0.0 };
    let effects = names
        .iter()
        .map(|&name| {
            let size = match stratum {
                Stratum::Outside => r.log_range(0.01, 0.06),
                Stratum::Decoy => r.log_range(0.01, 0.06),
                Stratum::Pair | Stratum::Triple => r.log_range(0.008, 0.06),
                _ => r.log_range(0.003, 0.08),
            };
            (Injection::new(name, r.bits()), Size::Peak(size))
        })
        .collect();
    let operator = if nasty { Operator::careless(r) } else { Operator::careful(r) };
    let real_noise = r.chance(0.5);
    Spec {
        id,
        stratum,
        protocol,
        effects,
        looks_like,
        bench,
        seed,
        lost_rows,
        uneven_noise,
        real_noise,
        operator,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_final_set_is_composed_as_registered() {
        let specs = draw(1, "final", Composition::FINAL);
        assert_eq!(specs.len(), 345);
        for protocol in ["A", "C", "D"] {
            let n = specs.iter().filter(|s| s.protocol == protocol).count();
            assert!((113..=117).contains(&n), "{protocol}: {n}");
        }
        for (name, _) in SINGLES {
            let n =
                specs.iter().filter(|s| s.stratum == Stratum::Single && s.effects[0].0.name == name).count();
            assert_eq!(n, 5, "{name}");
        }
        let same = specs.iter().filter(|s| {
            s.stratum == Stratum::Pair && class(s.effects[0].0.name) == class(s.effects[1].0.name)
        });
        assert_eq!(same.count(), 23);
        for triple in specs.iter().filter(|s| s.stratum == Stratum::Triple) {
            let mut classes: Vec<&str> = triple.effects.iter().map(|e| class(e.0.name)).collect();
            classes.sort_unstable();
            classes.dedup();
            assert_eq!(classes.len(), 3);
        }
    }

    #[test]
    fn the_first_trials_are_a_stratified_share_and_families_differ() {
        let specs = draw(1, "final", Composition::FINAL);
        let half = &specs[..172];
        let count = |s: Stratum| half.iter().filter(|t| t.stratum == s).count();
        for (stratum, whole) in [(Stratum::NullClean, 30), (Stratum::NullNasty, 30), (Stratum::Single, 180)] {
            assert!((whole / 2 - 3..=whole / 2 + 3).contains(&count(stratum)), "{stratum:?}");
        }
        let other = draw(1, "dev", Composition::FINAL);
        assert!(specs.iter().zip(&other).all(|(a, b)| a.bench.muscle.geometry != b.bench.muscle.geometry));
    }

    #[test]
    fn a_name_meets_more_than_one_protocol() {
        let specs = draw(2, "final", Composition::FINAL);
        for (name, _) in SINGLES {
            let mut met: Vec<&str> = specs
                .iter()
                .filter(|s| s.stratum == Stratum::Single && s.effects[0].0.name == name)
                .map(|s| s.protocol)
                .collect();
            met.sort_unstable();
            met.dedup();
            assert_eq!(met.len(), 3, "{name} {met:?}");
        }
    }
}
