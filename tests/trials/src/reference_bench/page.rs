//! The page of the pairs of the virtual bench.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::{CLASS, FALSE, IN_SET, LEAST, Outcome};
use crate::names::class;
use crate::rate::Rate;
use crate::spec::Stratum;

fn rate(of: &[&Outcome], right: impl Fn(&Outcome) -> bool) -> Rate {
    Rate::new(of.iter().filter(|o| right(o)).count(), of.len())
}

/// All tables.
pub(super) fn page(all: &[Outcome], drawn: usize, hash: &str) -> String {
    let mut t = String::new();
    let missed = |ok: bool| if ok { "met" } else { "**missed**" };
    let _ = writeln!(t, "# Changes on the virtual bench\n");
    let _ = writeln!(
        t,
        "`host diagnose --muscle M.toml AFTER… --reference BEFORE…` is tested on simulated pairs: two campaigns of one muscle with noise of \
         their own, the later one with an effect that the earlier one did not have. Strata and protocols are those of the \
         [sealed trials](proof.md). Nothing on this page is typed by hand:\n\n\
         ```text\ncargo run --release -p trials -- reference-bench --set final -o DIR --page docs/src/proof-reference-bench.md\n```\n"
    );
    let _ = writeln!(
        t,
        "{} of {drawn} pairs are answered, each once. The set's seed is secret; its SHA-256, `{hash}`, was written before the first pair was made. Strata are \
         mixed evenly over the numbers, so that a part of them is nearly a stratified share. Counted are single effects of at least {LEAST} % of the \
         blocked force (99.5 % quantile); the first name counts. A bound that is missed is missed: no set is drawn for one engine twice. The \
         [first](proof-reference-bench-first.md) and the [second set](proof-reference-bench-second.md) were answered by earlier engines; this \
         one was drawn once the engine had changed.\n",
        all.len()
    );
    let _ = writeln!(t, "| | n | bound | measured | |\n| --- | --- | --- | --- | --- |");
    for protocol in ["A", "D", "C"] {
        let own: Vec<&Outcome> = all.iter().filter(|o| o.counts() && o.protocol == protocol).collect();
        let r = rate(&own, Outcome::class_right);
        let _ = writeln!(
            t,
            "| class right, protocol {protocol} | {} | ≥ {:.0} % | {r} | {} |",
            own.len(),
            100.0 * CLASS,
            missed(r.k as f64 >= CLASS * r.n as f64)
        );
    }
    let singles: Vec<&Outcome> = all.iter().filter(|o| o.counts()).collect();
    let r = rate(&singles, Outcome::in_set);
    let _ = writeln!(
        t,
        "| truth in the set | {} | ≥ {:.0} % | {r} | {} |",
        singles.len(),
        100.0 * IN_SET,
        missed(r.k as f64 >= IN_SET * r.n as f64)
    );
    let nulls: Vec<&Outcome> = all.iter().filter(|o| o.is_null()).collect();
    let r = rate(&nulls, |o| !o.named.is_empty());
    let _ = writeln!(
        t,
        "| unchanged pairs named | {} | ≤ {:.0} % | {r} | {} |",
        nulls.len(),
        100.0 * FALSE,
        missed(r.k as f64 <= FALSE * r.n as f64)
    );
    let r = rate(&singles, Outcome::exact);
    let _ = writeln!(t, "| exact name | {} | | {r} | |", singles.len());
    let small: Vec<&Outcome> = all.iter().filter(|o| o.stratum == Stratum::Single && !o.counts()).collect();
    let r = rate(&small, Outcome::class_right);
    let _ = writeln!(t, "| class right, smaller effects | {} | | {r} | |", small.len());
    let r = rate(&small, |o| !o.named.is_empty() && !o.class_right());
    let _ = writeln!(t, "| a false class, smaller effects | {} | | {r} | |", small.len());
    let outside: Vec<&Outcome> = all.iter().filter(|o| o.stratum == Stratum::Outside).collect();
    let r = rate(&outside, |o| !o.named.is_empty());
    let _ = writeln!(t, "| outside the catalogue, named | {} | | {r} | |", outside.len());
    let pairs: Vec<&Outcome> = all.iter().filter(|o| o.stratum == Stratum::Pair).collect();
    let r = rate(&pairs, |o| o.named.iter().any(|n| o.effects.iter().any(|e| class(&e.0) == class(&n.0))));
    let _ = writeln!(t, "| two effects: one class right | {} | | {r} | |", pairs.len());
    let refused = all.iter().filter(|o| o.refused.is_some()).count();
    let _ = writeln!(t, "| without an answer | {} | | {refused} | |", all.len());
    let _ = writeln!(t, "\n## Wrong answers, single effects that count\n");
    let _ = writeln!(
        t,
        "| pair | protocol | effect | size, % | named | most probable |\n| --- | --- | --- | --- | --- | --- |"
    );
    for o in singles.iter().filter(|o| !o.class_right()) {
        let list = |of: &[(String, f64)]| {
            of.iter().take(3).map(|(n, p)| format!("{n} {p:.2}")).collect::<Vec<_>>().join(", ")
        };
        let named = if o.named.is_empty() { "–".to_owned() } else { list(&o.named) };
        let _ = writeln!(
            t,
            "| {} | {} | {} | {:.1} | {named} | {} |",
            o.id,
            o.protocol,
            o.truth(),
            o.effects.first().map_or(0.0, |e| e.1),
            list(&o.probabilities)
        );
    }
    let mut by: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for o in &singles {
        let e = by.entry(class(o.truth())).or_default();
        *e = (e.0 + usize::from(o.class_right()), e.1 + 1);
    }
    let _ = writeln!(
        t,
        "\n## By class, single effects that count\n\n| class | right | of |\n| --- | --- | --- |"
    );
    for (name, (right, of)) in by {
        let _ = writeln!(t, "| {name} | {right} | {of} |");
    }
    t.push_str(&stated(all));
    t
}

/// Least stated probability of each row of the table.
const STATED: [f64; 6] = [0.0, 0.5, 0.7, 0.9, 0.99, 1.0 + f64::EPSILON];

/// How often the first name is right, by its stated probability.
fn stated(all: &[Outcome]) -> String {
    let mut t = String::from(
        "\n## Stated probabilities, all single effects\n\nThe first name of each answer that names something, by its stated probability.\n\n\
         | stated | answers | mean stated | right |\n| --- | --- | --- | --- |\n",
    );
    for ends in STATED.windows(2) {
        let of = |o: &&Outcome| {
            o.stratum == Stratum::Single && o.named.first().is_some_and(|n| n.1 >= ends[0] && n.1 < ends[1])
        };
        let own: Vec<&Outcome> = all.iter().filter(of).collect();
        let mean = own.iter().map(|o| o.named[0].1).sum::<f64>() / own.len().max(1) as f64;
        let mean = if own.is_empty() { "–".to_owned() } else { format!("{mean:.2}") };
        let r = rate(&own, Outcome::exact);
        let _ = writeln!(t, "| {:.2} to {:.2} | {} | {mean} | {r} |", ends[0], ends[1], own.len());
    }
    t
}
