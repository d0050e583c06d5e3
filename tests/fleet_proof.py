#!/usr/bin/env python3
"""Interrupts batches, spoils muscles, fits beside a stock, and writes docs/src/proof-fleet.md.

    python3 tests/fleet_proof.py

Runs the long version of three tests of the suite and writes what they print. If one of them fails, the page stays as it is.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "src" / "proof-fleet.md"


def figures(target: str, test: str) -> list[dict]:
    """Runs one test in its long version: the figures it prints."""
    command = ["cargo", "test", "--workspace", "--quiet", "--test", target, "--", "--exact", test, "--nocapture"]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, "PAM_LONG": "1"}, stdout=subprocess.PIPE, text=True)
    found = [json.loads(line.split("figures: ", 1)[1]) for line in done.stdout.splitlines() if "figures: " in line]
    if done.returncode != 0 or not found:
        sys.exit(f"{target}, {test}: failed\n{done.stdout}")
    return found


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    return ["| " + " | ".join(cells) + " |" for cells in [head, ["---"] * len(head), *rows]] + [""]


def main():
    (kills,) = figures("batch", "a_killed_batch_continues_and_ends_with_the_same_bytes")
    (spoiled,) = figures("batch", "a_spoiled_muscle_is_a_failure_and_the_others_are_untouched")
    *muscles, stock = figures("stock", "unseen_pressures_are_predicted_better_than_alone_and_the_bands_hold")
    worst = max(m["with_N"] / m["alone_N"] for m in muscles)
    lines = [
        "# Trials of fleets",
        "",
        "Written by `python3 tests/fleet_proof.py`, which runs the long version of three tests; nothing here is typed by hand. The speed of a fleet "
        "of 10,000 muscles is measured by `python3 tests/benchmarks/fleet.py --whole`, which writes `tests/benchmarks/fleet.md`.",
        "",
        "## Interrupted batches",
        "",
        f"`host batch` with {kills['muscles']} muscles was ended by SIGKILL at random moments and called again. The test fails if a muscle that was "
        "complete is computed again, or if a folder of a muscle lacks a readable table. It also fails if the output of a completed batch differs "
        "in one byte from that of a batch without interruption.",
        "",
        *table(
            ["interruptions", "batches completed", "files compared with an uninterrupted batch", "complete muscles found after interruptions", "computed twice"],
            [[str(kills["kills"]), str(kills["batches"]), str(kills["files"]), str(kills["kept"]), "0"]],
        ),
        "## Spoiled muscles",
        "",
        f"Each of {len(spoiled['ways'])} muscles of a fleet is spoiled in a way of its own. Each has one row in `failures`, with the code below, its "
        f"place, cause, and remedy. The {spoiled['untouched_files']} files of the two other muscles do not change by a byte.",
        "",
        *table(["what is spoiled", "code"], [[what, f"`{code}`"] for what, code in spoiled["ways"]]),
        "## A muscle with few recordings",
        "",
        "`host stock` on muscles of the virtual bench with the tolerances of a workshop: twelve kin with all pressures, four new muscles with three "
        "pressures each. Root mean square error on the recordings at the other pressures; the bound is half of the error of fitting alone.",
        "",
        *table(
            ["recorded, kPa", "beside the stock, N", "alone, N", "ratio", "bands widened by"],
            [
                [", ".join(f"{p:.0f}" for p in m["seen_kPa"]), f"{m['with_N']:.3f}", f"{m['alone_N']:.3f}", f"{m['with_N'] / m['alone_N']:.2f}", f"{m['widened']:.2f}"]
                for m in muscles
            ],
        ),
        f"Largest ratio: {worst:.2f} (bound 0.5: {'met' if worst <= 0.5 else '**missed**'}). "
        f"{stock['inside_pct']:.1f} % of the readings lie in the 95 % band.",
    ]
    PAGE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
