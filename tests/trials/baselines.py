#!/usr/bin/env python3
"""Other people's methods on the same recordings: PySINDy's sparse regression, and a Gaussian process as discrepancy.

    python3 -m venv .venv && .venv/bin/pip install pysindy scikit-learn
    .venv/bin/python tests/trials/baselines.py DIR [--host target/release/host] [--most 60]

DIR is an answered and scored set (its tables lie in work/). Writes DIR/guesses.json, which `trials score DIR` puts into the report:

  pysindy  name of the term with the largest coefficient that pysindy.STLSQ keeps; columns are the catalogue's compact
           equations at fixed shapes, freed of a base (polynomial and friction factor per file), each scaled to unit norm
  gp       a Gaussian process over (pressure, contraction, direction, speed) fitted to what a plain table leaves of the campaign;
           its error on the held-out recordings, N: it fits and names nothing
"""

import argparse
import json
import math
import os
import subprocess
import warnings
from pathlib import Path

# Small problems: threads only wait for each other.
for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")

import numpy as np
import pysindy
import sklearn
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

NAMES = [
    "coulomb-friction", "pressure-friction", "viscous-damping", "stribeck-friction", "rate-power", "stress-relaxation",
    "log-creep", "cyclic-softening", "thermal-softening", "force-drift", "sensor-delay", "inertia", "mullins-softening",
    "presliding-hysteresis", "breakaway-friction",
]


def read(path):
    """Time (s), pressure (Pa), stroke (m), force (N)."""
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)[:, :4]
    return rows * [1.0, 1e3, 1e-3, 1.0]


def columns(files, rest_length):
    """Residual and library of all files, both freed of the base, rows thinned."""
    residuals, libraries = [], []
    largest = turns = relaxed = last_u = 0.0
    way, travel = 1.0, 0.0
    top = max(np.max(r[:, 3]) for r in files)
    for rows in files:
        if len(rows) < 60 or np.max(rows[:, 1]) < 20e3:
            continue
        keep = max(len(rows) // 500, 1)
        rows = rows.tolist()
        base, library, force = [], [], []
        for i in range(2, len(rows) - 2):
            a, b, r = rows[i - 2], rows[i + 2], rows[i]
            dt = max(b[0] - a[0], 1e-6)
            v = (b[2] - a[2]) / dt
            acceleration = (b[2] - 2 * r[2] + a[2]) / (0.25 * dt * dt)
            step = r[0] - rows[i - 1][0]
            if abs(v) > 1e-5 * rest_length and (v > 0) != (way > 0):
                way, travel, turns = math.copysign(1.0, v), 0.0, turns + 0.5
            travel += abs(v) * step
            u = r[2] / rest_length
            relaxed = (relaxed + u - last_u) * math.exp(-step / 30.0)
            last_u = u
            new = u > largest
            largest = max(largest, u)
            if i % keep:
                continue
            s, f, p = way, r[3] / top, r[1] / 5e5
            base.append([1, u, u**2, u**3, u**4, s * f])
            library.append([
                -s, -s * p, -v / rest_length, -s * np.exp(-abs(v) / (0.02 * rest_length)),
                -s * f * (abs(v) / rest_length) ** 0.3, relaxed, f * np.log1p(r[0] - rows[0][0]), f * np.log1p(turns),
                f * (1 - np.exp(-r[0] / 600.0)), r[0] / 1000.0, (b[3] - a[3]) / dt / top, acceleration / rest_length,
                u if new else 0.0, s * f * np.exp(-travel / (0.01 * rest_length)),
                s * np.exp(-travel / (0.003 * rest_length)),
            ])
            force.append(r[3])
        if len(force) < 20:
            continue
        q, _ = np.linalg.qr(np.array(base))
        free = lambda m: m - q @ (q.T @ m)
        residuals.append(free(np.array(force)))
        libraries.append(free(np.array(library)))
    return np.concatenate(residuals), np.vstack(libraries)


def sindy(files, rest_length):
    """The name that PySINDy gives."""
    y, a = columns(files, rest_length)
    norms = np.linalg.norm(a, axis=0)
    norms[norms < 1e-9] = np.inf
    optimizer = pysindy.STLSQ(threshold=0.1 * np.linalg.norm(y), alpha=1e-6, max_iter=20)
    optimizer.fit(a / norms, y.reshape(-1, 1))
    weights = np.abs(np.ravel(optimizer.coef_))
    return NAMES[int(np.argmax(weights))] if weights.max() > 0 else ""


def predict(host, table, files, out):
    """Rows with the table's force, file by file."""
    subprocess.run([host, "predict", "--quiet", "--table", table, *files, "-o", out], check=True, capture_output=True)
    lines = Path(out).read_text().splitlines()
    head = lines[0].split(",")
    at = {name: head.index(name) for name in ["time_s", "pressure_kPa", "displacement_mm", "force_N", "force_model_N"]}
    tables = {}
    for line in lines[1:]:
        cells = line.split(",")
        try:
            tables.setdefault(cells[0], []).append([float(cells[i]) for i in at.values()])
        except ValueError:
            continue
    return [np.array(t) for t in tables.values()]


def features(t, rest_length):
    v = np.gradient(t[:, 2] * 1e-3, t[:, 0]) / rest_length
    return np.column_stack([t[:, 1] / 300.0, t[:, 2] * 10e-3 / rest_length, np.sign(v), np.log10(np.abs(v) + 1e-6)])


def gaussian_process(host, work, campaign, held_out, rest_length):
    """Error on held-out recordings of a plain table with a Gaussian process on top, N."""
    table = work / "plain.pam"
    if not table.exists() or not held_out:
        return None
    parts = predict(host, table, [*campaign, *held_out], work / "predicted.csv")
    seen, unseen = parts[: len(campaign)], parts[len(campaign):]
    seen = [t for t in seen if len(t) > 10 and np.max(t[:, 1]) > 20.0]
    x = np.vstack([features(t, rest_length) for t in seen])
    y = np.concatenate([t[:, 3] - t[:, 4] for t in seen])
    pick = np.linspace(0, len(y) - 1, min(len(y), 350)).astype(int)
    scale = np.std(y[pick]) or 1.0
    kernel = ConstantKernel(1.0) * RBF([1.0] * 4, (0.05, 50.0)) + WhiteKernel(0.1)
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=0, random_state=0).fit(x[pick], y[pick] / scale)
    errors = [(t[:, 3] - t[:, 4] - scale * process.predict(features(t, rest_length)))[::3] for t in unseen]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("set", type=Path)
    arguments.add_argument("--host", default="target/release/host")
    arguments.add_argument("--most", type=int, default=60, help="most trials for the Gaussian process")
    a = arguments.parse_args()
    report = json.loads((a.set / "report.json").read_text())
    guesses = {"pysindy": {}, "gp_N": {}, "versions": f"PySINDy {pysindy.__version__}, scikit-learn {sklearn.__version__}"}
    for trial in report["trials"]:
        outcome, held = trial["outcome"], trial["held_out"]
        if outcome["stratum"] not in ("single", "decoy") or not outcome["visible"]:
            continue
        id = f"{outcome['id']:04}"
        truth = json.loads((a.set / "sealed" / id / "truth.json").read_text())
        rest_length = truth["bench"]["muscle"]["geometry"]["rest_length"]
        campaign = sorted((a.set / "trials" / id).glob("*.csv"))
        if outcome["amplitude_pct"] >= 2.0:
            guesses["pysindy"][id] = sindy([read(f) for f in campaign], rest_length)
        possible = held is not None and held["plain_N"] - held["twin_N"] > 0.5 * held["twin_N"]
        if possible and len(guesses["gp_N"]) < a.most:
            held_out = sorted((a.set / "sealed" / id / "held_out").glob("*.csv"))
            error = gaussian_process(a.host, a.set / "work" / id, campaign, held_out, rest_length)
            if error is not None:
                guesses["gp_N"][id] = error
    (a.set / "guesses.json").write_text(json.dumps(guesses, indent=1) + "\n")
    print(f"{len(guesses['pysindy'])} names by PySINDy, {len(guesses['gp_N'])} Gaussian processes: {a.set / 'guesses.json'}")


if __name__ == "__main__":
    warnings.filterwarnings("ignore")
    main()
