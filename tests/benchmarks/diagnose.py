#!/usr/bin/env python3
"""Measures the time of a diagnosis with all candidates, and writes diagnose.md.

    python3 tests/benchmarks/diagnose.py [ROWS]       a million by default

Builds what it needs. The campaign is that of the enriched protocol (loops at several speeds, dwells, nested loops, tares) on a muscle
whose load cell reads three per cent too much, sampled so often that it has so many rows; the bench is `virtual-bench`.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import environment

environment.enter()

from measure import COSTS, Bound, finish, run  # noqa: E402

# Rows of the campaign per hertz of sampling rate.
ROWS_PER_HERTZ = 1582.3


def made(bench: Path, folder: Path, rows: int) -> tuple[list[Path], int, float]:
    """A campaign of about this many rows: its files, its rows, and its size in MB."""
    hertz = f"{rows / ROWS_PER_HERTZ:.2f}"
    asked = ["record", "--muscle", "contractile", "--protocol", "D", "--cell-gain", "0.03", "--sample-hz", hertz]
    subprocess.run([bench, *asked, "-o", folder], check=True, capture_output=True)
    files = sorted(folder.glob("*.csv"))
    lines = sum(f.read_bytes().count(b"\n") - 1 for f in files)
    return files, lines, sum(f.stat().st_size for f in files) / 1e6


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    programs = environment.built()
    lines, costs, same = list(COSTS), {}, True
    with tempfile.TemporaryDirectory() as place:
        for rows in (30_000, most // 10, most):
            folder = Path(place) / str(rows)
            files, count, size = made(programs / "virtual-bench", folder, rows)
            answers = {}
            for threads in (2, 1):
                os.environ["RAYON_NUM_THREADS"] = str(threads)
                answer = folder / f"{threads}.json"
                asked = ["diagnose", "--quiet", "--muscle", folder / "muscle.toml", *files, "--json", answer]
                cost = run([programs / "host", *asked])
                answers[threads] = answer.read_bytes()
                if threads == 2:
                    costs[rows] = cost
                name = f"host diagnose, {threads} thread{'s' if threads > 1 else ''}"
                line = f"| {count:,} | {size:.0f} MB | {name} | {cost.wall:.1f} s | {cost.processor:.1f} s | {cost.memory:.0f} MB |"
                print(line, flush=True)
                lines.append(line)
            same &= answers[1] == answers[2]
    small, full, tenth = costs[30_000], costs[most], costs[most // 10]
    bounds = [
        Bound("30,000 rows, wall on two cores, s", small.wall, 8),
        Bound("30,000 rows, processor time spread over two cores, s", small.processor / 2, 8),
        Bound(f"{most:,} rows, wall on two cores, s", full.wall, 240),
        Bound(f"{most:,} rows, memory, MB", full.memory, 1000),
        Bound("processor time per row, against a tenth of the rows", full.processor / tenth.processor / 10, 1.2),
        Bound("answers that differ between one thread and two", float(not same), 0),
    ]
    finish(__file__, "Speed of the diagnosis", lines, bounds)


if __name__ == "__main__":
    main()
