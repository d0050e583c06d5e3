#!/usr/bin/env python3
"""Compares the speed of the fit with programs that do parts of it, and writes fit.md.

    python3 tests/benchmarks/fit.py [ROWS]        10 million by default

1. The thesis's objective (eq. 23) on six pressures x 100 points, M = 4, P0 given: SciPy's SLSQP and trust-constr, numpy's lstsq, and
   this project on the same points; the minimisers as they come, and to within a hundredth of the least objective. Then this
   project's joint fit of the same 600 points, which finds P0 too.
2. `host fit` of ROWS rows from file to table, beside polars reading the file; a tenth and a hundredth of the rows, too.
3. The same for short loops with outliers that repeat to the end of the file.

Builds what it needs. Programs run in turn, several times; the least counts.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import environment

environment.enter()

import numpy as np  # noqa: E402
from scipy.optimize import minimize  # noqa: E402

import muscle  # noqa: E402
from measure import Bound, finish, linear, peer, table  # noqa: E402


def points(path: Path):
    """Six mid-lines of 100 points with noise; per pressure (P, P' g, c, F, weights)."""
    rng = np.random.default_rng(1)
    data = []
    with open(path, "w") as file:
        file.write("pressure_Pa,stroke_m,force_N\n")
        for p in muscle.LEVELS:
            x = np.linspace(0, muscle.stroke(p), 100)
            f = muscle.quasi(p, x) + 0.02 * rng.standard_normal(100)
            file.writelines(f"{p:.6e},{a:.9e},{b:.9e}\n" for a, b in zip(x, f))
            data.append((p, x, f, 1 / np.maximum(np.abs(f), 1.0)))
    return data


def objective(p, x, f, w):
    """Eq. 23 of one pressure as a function of the E_k in MPa. Columns are computed once, which is the best case for the compared programs."""
    g, c = muscle.parts(x)
    c, rest = 1e6 * c * w[:, None], (f - (p - muscle.P0) * g) * w
    return lambda e: np.sum((c @ e - rest) ** 2)


def minimised(data, method, options):
    return [
        minimize(objective(*of), np.array([1.0, 0, 0, 0]), method=method, options=options).x for of in data
    ]


def solved(data):
    out = []
    for p, x, f, w in data:
        g, c = muscle.parts(x)
        out.append(np.linalg.lstsq(1e6 * c * w[:, None], (f - (p - muscle.P0) * g) * w, rcond=None)[0])
    return out


def excess(data, moduli) -> float:
    """Relative excess of the objective over the smallest one, at the worst pressure."""
    least = solved(data)
    return max(objective(*of)(e) / objective(*of)(b) - 1 for of, e, b in zip(data, moduli, least))


def best(call, count):
    """The smallest processor time of some calls: on a shared machine, the wall time of a long call includes other programs."""
    least, out = np.inf, None
    for _ in range(count):
        start = time.process_time()
        out = call()
        least = min(least, time.process_time() - start)
    return least, out


def small(folder: Path, program: Path) -> tuple[list[str], list[Bound]]:
    data = points(folder / "points.csv")
    rows = []

    def peer_row(name, call, count):
        seconds, moduli = best(call, count)
        rows.append((name, seconds, excess(data, moduli)))
        return seconds

    slsqp = peer_row("SciPy SLSQP, as it comes", lambda: minimised(data, "SLSQP", {"maxiter": 300}), 20)
    exact = peer_row(
        "SciPy SLSQP, to the least", lambda: minimised(data, "SLSQP", {"maxiter": 300, "ftol": 1e-12}), 20
    )
    peer_row("SciPy trust-constr, as it comes", lambda: minimised(data, "trust-constr", {}), 3)
    peer_row("numpy lstsq", lambda: solved(data), 50)
    runs = [
        json.loads(subprocess.run([program, folder / "points.csv"], check=True, capture_output=True).stdout)
        for _ in range(5)
    ]
    separate = min(r["separate_us"] for r in runs) * 1e-6
    joint = min(r["joint_us"] for r in runs) * 1e-6
    rows.append(("this project, the same problem", separate, excess(data, [np.array(e) for e in runs[0]["separate"]])))
    lines = [
        "## Six pressures x 100 points, M = 4, each pressure by itself",
        "",
        "| program | ms | times as fast as SLSQP as it comes | objective above the least |",
        "| --- | ---: | ---: | ---: |",
    ]
    lines += [f"| {n} | {1e3 * s:.4f} | {slsqp / s:.1f} | {100 * e:.2g} % |" for n, s, e in rows]
    lines += [
        f"| this project, all pressures at once with P0 | {1e3 * joint:.4f} | {slsqp / joint:.1f} | another objective |",
        "",
        f"The joint fit finds P0 = {runs[0]['deadband_Pa'] / 1e3:.2f} kPa (true: {muscle.P0 / 1e3:.2f} kPa).",
        "",
    ]
    bounds = [
        Bound("the same problem, times as fast as SLSQP as it comes", slsqp / separate, 100, True),
        Bound("joint fit, times as fast as SLSQP to the least", exact / joint, 100, True),
    ]
    return lines, bounds


def large(folder: Path, program: Path, most: int) -> tuple[list[str], list[Bound]]:
    (folder / "muscle.toml").write_text(muscle.DESCRIPTION)

    def programs(path):
        fit = [program, "fit", "--quiet", "--muscle", folder / "muscle.toml", path, "-o", folder / "mini.pam"]
        return {"host fit, whole": (fit, False), "polars, reading only": peer("polars", path)}

    costs = {}
    lines = ["## From file to table", "", *table(programs, most, costs)]
    fit, polars = costs[most]["host fit, whole"], costs[most]["polars, reading only"]
    bounds = [
        Bound("whole fit, times polars's reading", fit.wall / polars.wall, 2.5),
        Bound("the same in processor time", fit.processor / polars.processor, 2.5),
        Bound("memory of the whole fit, MB", fit.memory, 1000),
        *linear(costs, "host fit, whole"),
    ]
    repeated = {}
    lines += ["", "## Repeated loops with outliers", "", *table(programs, most, repeated, "repeated")]
    fit, polars = repeated[most]["host fit, whole"], repeated[most]["polars, reading only"]
    bounds += [
        Bound("repeated loops, processor time, times polars's reading", fit.processor / polars.processor, 2.5),
        Bound("repeated loops, memory, MB", fit.memory, 1000),
    ]
    return lines, bounds


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    release = environment.built("--bin", "host", "--example", "fit_speed")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        first, bounds = small(folder, release / "examples" / "fit_speed")
        print("\n".join(first), flush=True)
        second, more = large(folder, release / "host", most)
    finish(__file__, "Speed of the fit", [*first, *second], [*bounds, *more])


if __name__ == "__main__":
    main()
