#!/usr/bin/env python3
"""Times `host fit` on ten differently made files beside polars reading them, and writes files.md.

    python3 tests/benchmarks/files.py [ROWS]      10 million by default

Two of the files are real recordings, repeated to the end, if ../shared/data is next to the project. The bounds hold for each file: 2.5
times the processor time of polars's reading, and 1 GB of memory. Builds what it needs. Programs run in turn, several times; the least counts.
"""

import csv
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import environment

environment.enter()

import numpy as np  # noqa: E402
import polars as pl  # noqa: E402

import muscle  # noqa: E402
from measure import COSTS, Bound, finish, peer, rounds  # noqa: E402

DATA = environment.ROOT.parent / "shared" / "data"
MUSCLES = environment.ROOT / "examples" / "muscles"
ROUNDS = 3


@dataclass
class Made:
    """A file's columns, how it is written and read, and the muscle."""

    columns: dict
    write: dict = field(default_factory=dict)
    read: str = ""
    muscle: Path | None = None


def loops(rng, rows):
    """One long loop at each pressure."""
    p = np.repeat(muscle.LEVELS, -(-rows // 6))[:rows]
    parts = [muscle.loop(level, -(-rows // 6)) for level in muscle.LEVELS]
    x, force = (np.concatenate(c)[:rows] for c in zip(*parts))
    return Made(muscle.columns(rng, 1e-3 * np.arange(rows), p, x, force))


def repeated(rng, rows):
    """Six short loops that repeat; the pressure jumps where a loop begins, and one reading in a thousand is an outlier."""
    return Made(muscle.repeated(rng, rows))


def held(rng, rows, levels):
    """Pressures, filling and emptying, at five held lengths that repeat; `levels` makes the course of one filling and emptying."""
    size = 40_000
    p = np.tile(levels(size), -(-rows // size))[:rows]
    way = np.tile(np.repeat([1.0, -1.0], size // 2), -(-rows // size))[:rows]
    place = (np.arange(rows) // size) % 5
    x = 0.25 * place * muscle.stroke(muscle.LEVELS[2])
    force = np.maximum(muscle.quasi(p, x), 0) * (1 - 0.05 * way)
    return Made(muscle.columns(rng, 1e-3 * np.arange(rows), p, x, force))


def staircases(rng, rows):
    """Staircases of the pressure at held lengths: a step each half second."""

    def levels(size):
        up = np.floor(np.arange(size // 2) / 500) / (size / 1000)
        return 60e3 + 500e3 * np.concatenate([up, up[::-1]])

    return held(rng, rows, levels)


def ramps(rng, rows):
    """Ramps of the pressure at held lengths."""

    def levels(size):
        up = np.linspace(0, 1, size // 2)
        return 60e3 + 500e3 * np.concatenate([up, up[::-1]])

    return held(rng, rows, levels)


def wandering(rng, rows):
    """Stroke and pressure wander without a plan."""
    t = 1e-3 * np.arange(rows)
    swing = lambda periods: sum(np.sin(2 * np.pi * t / q + k) for k, q in enumerate(periods)) / len(periods)
    p = 380e3 + 150e3 * swing([61.0, 37.3, 17.9])
    x = np.clip(0.5 + 0.5 * swing([3.1, 7.7, 1.9]), 0, 1) * muscle.stroke(p)
    way = np.sign(np.gradient(x))
    return Made(muscle.columns(rng, t, p, x, muscle.quasi(p, x) * (1 - 0.1 * way)))


def commas(rng, rows):
    """Semicolons between columns and commas in numbers."""
    made = loops(rng, rows)
    return Made(made.columns, {"separator": ";", "decimal_comma": True}, "separator=';', decimal_comma=True")


def wide(rng, rows):
    """Sixteen columns that no fit needs."""
    made = loops(rng, rows)
    other = {f"channel_{k}": np.round(rng.standard_normal(rows), 3) for k in range(16)}
    return Made({**made.columns, **other})


def digits(rng, rows):
    """All digits of a double in each number."""
    made = loops(rng, rows)
    return Made({name: v + 1e-9 * rng.standard_normal(rows) if name != "time_s" else v for name, v in made.columns.items()})


def tiled(rows, columns, description):
    """Recordings one after another, again and again: time goes on."""
    size = len(columns["force_N"])
    times = -(-rows // size)
    whole = {name: np.tile(np.asarray(c), times)[:rows] for name, c in columns.items()}
    whole["time_s"] = np.round(0.01 * np.arange(rows), 3)
    return Made(whole, muscle=MUSCLES / description)


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def festo_2022(rng, rows):
    """Real staircases of valve pulses, 106 Hz, one muscle at four held lengths."""
    folder = DATA / "aarl-festo-10mm-2022"
    runs = {
        (r["nominal_relative_contraction_percent"], r["run"]): r
        for r in table(folder / "runs.csv")
        if r["file"] == "festo10_cut200mm.csv"
    }
    read = table(folder / "festo10_cut200mm.csv")
    of = [runs[(r["relative_contraction_percent"], r["run"])] for r in read]
    shortened = [float(r["rest_length_mm"]) - float(r["mounted_length_mm"]) for r in of]
    columns = {
        "pressure_kPa": [float(r["pressure_kPa"]) for r in read],
        "displacement_mm": shortened,
        "force_N": [float(r["force_N"]) for r in read],
    }
    return tiled(rows, columns, "festo10-2022-182mm.toml")


def festo_2021(rng, rows):
    """Real staircases of valve pulses, 12 Hz, one muscle at four held lengths."""
    folder = DATA / "aarl-festo-10mm-2021"
    runs = {(r["condition"], r["run"]): r for r in table(folder / "runs.csv") if r["file"] == "festo10_rest257mm_27cm.csv"}
    read = table(folder / "festo10_rest257mm_27cm.csv")
    columns = {
        "pressure_kPa": [float(r["pressure_kPa"]) for r in read],
        "displacement_mm": [float(runs[(r["condition"], r["run"])]["shortening_mm"]) for r in read],
        "force_N": [float(r["force_N"]) for r in read],
    }
    return tiled(rows, columns, "festo10-2021-27cm.toml")


KINDS = [loops, repeated, staircases, ramps, wandering, commas, wide, digits, festo_2022, festo_2021]


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    host = environment.built("--bin", "host") / "host"
    lines, bounds = ["", COSTS[0].replace("| rows |", "| contents |"), COSTS[1].replace("| ---: |", "| --- |", 1)], []
    for kind in KINDS:
        if kind in (festo_2021, festo_2022) and not DATA.exists():
            print(f"skipped: {kind.__name__}: {DATA} does not exist")
            continue
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            path, described = folder / "recording.csv", folder / "muscle.toml"
            described.write_text(muscle.DESCRIPTION)
            made = kind(np.random.default_rng(5), most)
            pl.DataFrame(made.columns).write_csv(path, **made.write)
            described, read = made.muscle or described, made.read
            del made
            # A table that is of no use is reported and not written; it must not take long either.
            fit = [host, "fit", "--quiet", "--force", "--muscle", described, path, "-o", folder / "table.pam"]
            programs = {
                "host fit": (fit, False),
                "polars, reading only": peer("polars", path, read),
            }
            costs = rounds(programs, ROUNDS)
            size = path.stat().st_size / 1e6
        words = kind.__doc__.rstrip(".").split(";")[0].split(":")[0]
        for program, c in costs.items():
            lines.append(f"| {words} | {size:.0f} MB | {program} | {c.wall:.2f} s | {c.processor:.2f} s | {c.memory:.0f} MB |")
            print(lines[-1], flush=True)
        mine, polars = costs["host fit"], costs["polars, reading only"]
        bounds.append(Bound(f"{words}: processor time, times polars's reading", mine.processor / polars.processor, 2.5))
        bounds.append(Bound(f"{words}: memory, MB", mine.memory, 1000))
    lines.insert(0, f"{most:,} rows in each file.")
    finish(__file__, "Ten differently made files", lines, bounds)


if __name__ == "__main__":
    main()
