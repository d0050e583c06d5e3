#!/usr/bin/env python3
"""A fleet as a laboratory would write it: a Dask job that reads the recordings of each muscle and fits them with SciPy.

    python3 tests/benchmarks/fleet_dask.py MANIFEST WORKERS     prints muscles, wall seconds and processor seconds of the work

Each muscle: the mid-line of its loops at each pressure (200 bins over the stroke, both directions), and the thesis's objective (eq. 23, M = 4)
minimised by SLSQP for each pressure. The deadband is given, which `host batch` has to find. No uncertainties, no checks of the recordings.
"""

import csv
import glob
import os
import sys
import time
from pathlib import Path

import numpy as np
import polars as pl
from dask.distributed import Client, LocalCluster
from scipy.optimize import minimize

sys.path.insert(0, os.fspath(Path(__file__).resolve().parent))

BINS = 200


def fit(pattern):
    """Coefficients of all pressures, and the processor seconds of the work."""
    import muscle

    start = time.process_time()
    moduli = []
    for path in sorted(glob.glob(pattern)):
        data = pl.read_csv(path).select("pressure_kPa", "displacement_mm", "force_N").to_numpy()
        p, x, f = 1e3 * data[:, 0].mean(), 1e-3 * data[:, 1], data[:, 2]
        at = np.minimum((BINS * (x - x.min()) / np.ptp(x)).astype(int), BINS - 1)
        count = np.bincount(at, minlength=BINS)
        full = count > 1
        x, f = (np.bincount(at, v, BINS)[full] / count[full] for v in (x, f))
        g, c = muscle.parts(x)
        w = 1 / np.maximum(np.abs(f), 1.0)
        columns, rest = 1e6 * c * w[:, None], (f - (p - muscle.P0) * g) * w
        moduli.append(minimize(lambda e: np.sum((columns @ e - rest) ** 2), np.array([1.0, 0, 0, 0]), method="SLSQP").x)
    return np.array(moduli), time.process_time() - start


def main(manifest, workers):
    folder = Path(manifest).parent
    with open(manifest, newline="") as file:
        patterns = [os.fspath(folder / row["files"]) for row in csv.DictReader(file)]
    with LocalCluster(n_workers=int(workers), threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        client.upload_file(os.fspath(Path(__file__).resolve().parent / "muscle.py"))
        client.gather(client.map(fit, patterns[:2], pure=False))
        start = time.perf_counter()
        done = client.gather(client.map(fit, patterns, pure=False))
        wall = time.perf_counter() - start
    assert all(m.shape == (6, 4) and np.isfinite(m).all() for m, _ in done)
    print(len(done), wall, sum(seconds for _, seconds in done))


if __name__ == "__main__":
    main(*sys.argv[1:])
