#!/usr/bin/env python3
"""Reference numbers for the fit, with NumPy and SciPy: the thesis's M = 4 at each pressure separately.

Writes `separate_fits_points.csv` (mid-line points of a muscle whose wall is a hyperelastic tube, differentiated numerically)
and `separate_fits.csv` (E_1..E_4 in MPa by numpy.linalg.lstsq on scaled columns, and the largest residual in N).
`host/tests/fit_references.rs` compares. Nothing here is shared with the program: kinematics are written out again.

Run: python3 tests/references/separate_fits.py        (numpy, SciPy)
"""
import csv
import pathlib

import numpy as np
from scipy.integrate import quad

HERE = pathlib.Path(__file__).parent
L0, ALPHA, D0, T0 = 39.16e-3, np.radians(77.4), 3.0e-3, 0.5e-3
P0, C1, C2 = 76.5e3, 0.30e6, 0.015e6
PRESSURES = np.array([207e3, 276e3, 345e3, 414e3, 483e3, 552e3])

B = L0 / np.sin(ALPHA)
N = B * np.cos(ALPHA) / (np.pi * D0)
VB = np.pi / 4 * L0 * (D0**2 - (D0 - 2 * T0) ** 2)


def shape(x):
    length = L0 - x
    radius = np.sqrt(B**2 - length**2) / (2 * np.pi * N)
    wall = radius - np.sqrt(radius**2 - VB / (np.pi * length))
    return length, radius, wall


def area(x):
    length, _, _ = shape(x)
    return (3 * length**2 - B**2) / (4 * np.pi * N**2)


def columns(x):
    length, radius, wall = shape(x)
    ex, ez = radius / (D0 / 2) - 1, length / L0 - 1
    return np.stack(
        [VB / length * ez**k - wall * length**2 * ex**k / (2 * np.pi * N**2 * radius) for k in range(1, 5)], axis=-1
    )


def energy(x):
    """Stored energy of the wall: rings of conserved volume, integrated adaptively over the material."""
    length, radius, _ = shape(x)
    outer, inner = D0 / 2, D0 / 2 - T0
    lz = length / L0

    def density(rho):
        r2 = radius**2 - (outer**2 - rho**2) / lz
        lt2 = r2 / rho**2
        i1 = lz**2 + lt2 + 1 / (lz**2 * lt2) - 3
        return (C1 * i1 + C2 * i1**2) * 2 * np.pi * rho

    return quad(density, inner, outer, epsabs=0, epsrel=1e-12)[0] * L0


def force(p, x):
    h = 1e-7
    return (p - P0) * area(x) - (energy(x + h) - energy(x - h)) / (2 * h)


def main():
    points, moduli = [], []
    for p in PRESSURES:
        # Chunk middles, 500 per unit of contraction, up to where the force vanishes.
        xs, fs = [], []
        for i in range(60):
            x = (i + 0.5) / 500 * L0
            f = force(p, x)
            if f <= 0:
                break
            xs.append(x)
            fs.append(f)
        xs, fs = np.array(xs), np.array(fs)
        a = columns(xs)
        scale = np.linalg.norm(a, axis=0)
        e, *_ = np.linalg.lstsq(a / scale, fs - (p - P0) * area(xs), rcond=None)
        e /= scale
        worst = np.max(np.abs(a @ e + (p - P0) * area(xs) - fs))
        moduli.append([p, *(e / 1e6), worst])
        points += [[p, x, f] for x, f in zip(xs, fs)]
    with open(HERE / "separate_fits_points.csv", "w", newline="") as file:
        w = csv.writer(file, lineterminator="\n")
        w.writerow(["pressure_Pa", "stroke_m", "force_N"])
        w.writerows([[f"{v:.12e}" for v in row] for row in points])
    with open(HERE / "separate_fits.csv", "w", newline="") as file:
        w = csv.writer(file, lineterminator="\n")
        w.writerow(["pressure_Pa", "E_1_MPa", "E_2_MPa", "E_3_MPa", "E_4_MPa", "largest_residual_N"])
        w.writerows([[f"{v:.9e}" for v in row] for row in moduli])


if __name__ == "__main__":
    main()
