//! Recordings that begin with a friction of the other direction: the muscle was filled, or came the other way.

use super::*;

/// Loops at six pressures of a short recording each, whose first sample has the friction of the other direction.
fn begun_the_other_way(seed: u64) -> Campaign {
    let mut campaign = recorded(loops(&[1.0]), seed, |random, _| 0.03 * random.normal(), |_, _, _| 0.0);
    for r in &mut campaign.recordings {
        let Recording { force: Some(force), .. } = r else { continue };
        // 8 % of friction against shortening becomes 8 % with it.
        force[0] *= 1.08 / 0.92;
    }
    campaign
}

#[test]
fn the_first_sample_of_a_recording_is_no_missing_effect() {
    for seed in 1..4 {
        let d = ask(&begun_the_other_way(seed));
        assert_eq!(d.verdict(), Verdict::Consistent, "{:?}, {:?}", names(&d), d.unexplained);
    }
}
