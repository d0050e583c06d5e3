"""The thesis's miniature muscle in NumPy, and recordings of it.

    python3 muscle.py PATH ROWS             writes one CSV of triangular loops at six pressures, with friction and noise
    python3 muscle.py PATH ROWS repeated    the same, of short loops at 40 Hz that repeat to the end, with outliers
"""

import sys
from pathlib import Path

import numpy as np

L0, ALPHA, D0, T0 = 39.16e-3, np.radians(77.4), 3.0e-3, 0.5e-3
B = L0 / np.sin(ALPHA)
N = B * np.cos(ALPHA) / (np.pi * D0)
VB = np.pi / 4 * L0 * (D0**2 - (D0 - 2 * T0) ** 2)
P0 = 76.5e3
LEVELS = np.array([207e3, 276e3, 345e3, 414e3, 483e3, 552e3])
TOP = 0.075 * L0

DESCRIPTION = """name = "mini"
kind = "contractile"
rest_length_mm = 39.16
braid_angle_deg = 77.4
bladder_outer_diameter_mm = 3.0
bladder_wall_mm = 0.5
"""


def parts(x):
    """g, and c_1 … c_4, at strokes in metres."""
    length = L0 - x
    radius = np.sqrt(B**2 - length**2) / (2 * np.pi * N)
    wall = radius - np.sqrt(radius**2 - VB / (np.pi * length))
    ex, ez = radius / (D0 / 2) - 1, length / L0 - 1
    columns = [VB / length * ez**k - wall * length**2 * ex**k / (2 * np.pi * N**2 * radius) for k in range(1, 5)]
    return (3 * length**2 - B**2) / (4 * np.pi * N**2), np.stack(columns, axis=-1)


def quasi(p, x):
    """Force without friction, N."""
    g, c = parts(x)
    e = np.array([2.1e6, -1.5e6, 1.1e6, -0.2e6])
    return (p - P0) * g + (c @ e) * (1 + 0.3 * (p - 207e3) / 345e3)


def stroke(p):
    """Largest stroke at a pressure, m."""
    return TOP * (p - P0) / (LEVELS[-1] - P0)


def loop(p, n):
    """Stroke and force without noise of `n` rows: three strokes there and back at a pressure."""
    u = np.linspace(0, 3, n, endpoint=False) % 1.0
    x = (1 - np.abs(1 - 2 * u)) * stroke(p)
    way = np.where(u < 0.5, 1.0, -1.0)
    friction = 0.14 - 0.093 * (p - 207e3) / 345e3
    return x, quasi(p, x) * (1 - friction * way)


def columns(rng, time, p, x, force):
    """The columns of a recording, with the noise of its sensors."""
    n = len(time)
    return {
        "time_s": np.round(time, 3),
        "pressure_kPa": np.round((p + 300 * rng.standard_normal(n)) / 1e3, 5),
        "displacement_mm": np.round(1e3 * x + 2e-3 * rng.standard_normal(n), 7),
        "force_N": np.round(force + 0.05 * rng.standard_normal(n), 7),
    }


def write(path: Path, rows: int) -> None:
    import polars as pl

    rng = np.random.default_rng(2)
    sizes = np.full(6, rows // 6)
    sizes[: rows % 6] += 1
    blocks, start = [], 0.0
    for p, n in zip(LEVELS, sizes):
        time = start + np.arange(n) * 1e-3
        start = time[-1] + 60
        blocks.append(columns(rng, time, p, *loop(p, n)))
    pl.concat([pl.DataFrame(b) for b in blocks]).write_csv(path)


def repeated(rng, rows: int) -> dict:
    """Columns of six loops of 3000 rows each, one after another until the file is full: time goes on, and the pressure jumps where a loop
    begins. One reading of the force in a thousand is an outlier."""
    size = 3000
    loops = [loop(p, size) for p in LEVELS]
    times = -(-rows // (size * len(LEVELS)))
    x, force = (np.tile(np.concatenate(c), times)[:rows] for c in zip(*loops))
    p = np.tile(np.repeat(LEVELS, size), times)[:rows]
    force = force + np.where(rng.random(rows) < 1e-3, 20 * rng.standard_normal(rows), 0)
    return columns(rng, 0.025 * np.arange(rows), p, x, force)


def write_repeated(path: Path, rows: int) -> None:
    import polars as pl

    pl.DataFrame(repeated(np.random.default_rng(3), rows)).write_csv(path)


if __name__ == "__main__":
    (write_repeated if sys.argv[3:] == ["repeated"] else write)(Path(sys.argv[1]), int(sys.argv[2]))
