#!/usr/bin/env python3
"""How fast the fit is, beside the programs that do parts of it: writes tests/benchmarks/fit.md.

1. The thesis's objective on six pressures x 100 points, M = 4: SciPy SLSQP and trust-constr, numpy lstsq (each pressure by
   itself), and the joint fit of this project on the same 600 points.
2. A CSV of ROWS rows (10 million unless told otherwise): polars and pandas only reading it, `host fit` reading and fitting.
3. Time and memory of `host fit` against rows.

Run: python3 tests/benchmarks/fit.py [--rows 10000000] [--keep]     (numpy, SciPy, polars, pandas; builds the release binary)
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy.optimize import minimize

ROOT = pathlib.Path(__file__).resolve().parents[2]
L0, ALPHA, D0, T0 = 39.16e-3, np.radians(77.4), 3.0e-3, 0.5e-3
B = L0 / np.sin(ALPHA)
N = B * np.cos(ALPHA) / (np.pi * D0)
VB = np.pi / 4 * L0 * (D0**2 - (D0 - 2 * T0) ** 2)
P0 = 76.5e3
LEVELS = np.array([207e3, 276e3, 345e3, 414e3, 483e3, 552e3])


def parts(x):
    length = L0 - x
    radius = np.sqrt(B**2 - length**2) / (2 * np.pi * N)
    wall = radius - np.sqrt(radius**2 - VB / (np.pi * length))
    ex, ez = radius / (D0 / 2) - 1, length / L0 - 1
    cols = [VB / length * ez**k - wall * length**2 * ex**k / (2 * np.pi * N**2 * radius) for k in range(1, 5)]
    return (3 * length**2 - B**2) / (4 * np.pi * N**2), np.stack(cols, axis=-1)


def quasi(p, x):
    g, c = parts(x)
    e = np.array([2.1e6, -1.5e6, 1.1e6, -0.2e6]) * (1 + 0.3 * (p - 207e3) / 345e3)
    return (p - P0) * g + c @ e


def best(f, repeats):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        out = f()
        times.append(time.perf_counter() - start)
    return min(times), out


def peers(folder):
    rng = np.random.default_rng(1)
    data = []
    for p in LEVELS:
        x = np.linspace(0, 0.075 * L0 * (p - P0) / (552e3 - P0), 100)
        f = quasi(p, x)
        data.append((p, x, f + 0.02 * rng.standard_normal(100)))
    with open(folder / "points.csv", "w") as file:
        file.write("pressure_Pa,stroke_m,force_N\n")
        for p, x, f in data:
            file.writelines(f"{p:.6e},{a:.9e},{b:.9e}\n" for a, b in zip(x, f))

    def run(method):
        total = []
        for p, x, f in data:
            g, c = parts(x)
            w = 1 / np.maximum(np.abs(f), 1.0)

            def objective(e):
                return np.sum((((p - P0) * g + c @ (e * 1e6) - f) * w) ** 2)

            total.append(minimize(objective, np.array([1.0, 0, 0, 0]), method=method, options={"maxiter": 300}).x)
        return total

    def lstsq():
        out = []
        for p, x, f in data:
            g, c = parts(x)
            w = 1 / np.maximum(np.abs(f), 1.0)
            out.append(np.linalg.lstsq(c * w[:, None], (f - (p - P0) * g) * w, rcond=None)[0])
        return out

    rows = [
        ("SciPy SLSQP, each pressure by itself", best(lambda: run("SLSQP"), 3)[0]),
        ("SciPy trust-constr, each pressure by itself", best(lambda: run("trust-constr"), 1)[0]),
        ("numpy lstsq, each pressure by itself", best(lstsq, 20)[0]),
    ]
    ours = subprocess.run(
        ["cargo", "run", "--release", "-q", "-p", "host", "--example", "fit_speed", str(folder / "points.csv")],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout
    rows.append(("this project, all pressures at once with P0", json.loads(ours)["joint_us"] * 1e-6))
    return rows


def campaign(folder, rows):
    """One CSV of triangular loops at six pressures, with friction and noise."""
    rng = np.random.default_rng(2)
    path = folder / f"loops_{rows}.csv"
    per = rows // 6
    with open(path, "w") as file:
        file.write("time_s,pressure_kPa,displacement_mm,force_N\n")
        t0 = 0.0
        for p in LEVELS:
            u = np.linspace(0, 3, per, endpoint=False) % 1.0
            x = (1 - np.abs(1 - 2 * u)) * 0.075 * L0 * (p - P0) / (552e3 - P0)
            s = np.where(u < 0.5, 1.0, -1.0)
            k = 0.14 - 0.093 * (p - 207e3) / 345e3
            f = quasi(p, x) * (1 - k * s) + 0.05 * rng.standard_normal(per)
            pressure = (p + 300 * rng.standard_normal(per)) / 1e3
            t = t0 + np.arange(per) * 1e-3
            t0 = t[-1] + 60
            block = np.stack([t, pressure, x * 1e3, f], axis=-1)
            for i in range(0, per, 500_000):
                part = block[i : i + 500_000]
                file.write("\n".join("%.3f,%.3f,%.5f,%.4f" % tuple(r) for r in part) + "\n")
    return path


def timed(command):
    out = subprocess.run(["/usr/bin/time", "-f", "%e %M", *command], capture_output=True, text=True)
    if out.returncode:
        sys.exit(out.stderr)
    seconds, kilobytes = out.stderr.strip().splitlines()[-1].split()
    return float(seconds), int(kilobytes) / 1024


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--rows", type=int, default=10_000_000)
    arguments = arguments.parse_args()
    subprocess.run(["cargo", "build", "--release", "-q", "-p", "host"], cwd=ROOT, check=True)
    host = str(ROOT / "target/release/host")
    lines = ["# Speed of the fit", "", "Written by tests/benchmarks/fit.py; not edited by hand.", ""]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "muscle.toml").write_text(
            'name = "mini"\nkind = "contractile"\nrest_length_mm = 39.16\nbraid_angle_deg = 77.4\n'
            "bladder_outer_diameter_mm = 3.0\nbladder_wall_mm = 0.5\n"
        )
        lines += ["## The thesis's objective, six pressures x 100 points, M = 4", "", "| program | ms | times SLSQP |", "| --- | --- | --- |"]
        rows = peers(folder)
        slsqp = rows[0][1]
        lines += [f"| {what} | {1e3 * t:.3f} | {slsqp / t:.1f} |" for what, t in rows]
        lines += ["", "## Rows", "", "| rows | program | s | MiB |", "| --- | --- | --- | --- |"]
        for n in (24_000, arguments.rows // 10, arguments.rows):
            path = campaign(folder, n)
            for what, code in (
                ("polars, reading only", "import polars as p, sys; p.read_csv(sys.argv[1])"),
                ("pandas, reading only", "import pandas as p, sys; p.read_csv(sys.argv[1])"),
            ):
                library = code.split()[1]
                t, m = timed([sys.executable, "-c", code, str(path)])
                empty, _ = timed([sys.executable, "-c", f"import {library}"])
                lines.append(f"| {n} | {what} (import taken off) | {t - empty:.2f} | {m:.0f} |")
            runs = [
                timed([host, "fit", "--muscle", str(folder / "muscle.toml"), str(path), "-o", str(folder / "t.pam"), "-q"])
                for _ in range(3 if n < 1e6 else 1)
            ]
            t, m = min(runs)
            lines.append(f"| {n} | host fit, whole | {t:.2f} | {m:.0f} |")
            path.unlink()
    text = "\n".join(lines) + "\n"
    (ROOT / "tests/benchmarks/fit.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
