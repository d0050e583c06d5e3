"""Recordings of a trial, and a library of terms, both freed of a flexible base."""

import math

import numpy as np

# The library's terms: the catalogue's compact equations at fixed shapes.
NAMES = [
    "coulomb-friction", "pressure-friction", "viscous-damping", "stribeck-friction", "rate-power", "stress-relaxation",
    "log-creep", "cyclic-softening", "thermal-softening", "force-drift", "sensor-delay", "inertia", "mullins-softening",
    "presliding-hysteresis", "breakaway-friction",
]


def read(path):
    """Time (s), pressure (Pa), stroke (m), force (N)."""
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)[:, :4]
    return rows[np.isfinite(rows).all(axis=1)] * [1.0, 1e3, 1e-3, 1.0]


class Columns:
    """All files of a trial: the force and the library's terms, freed of the base file by file, rows thinned to about 500 a file.

    `context` has a row for each: time (s), time since the file began (s), pressure (Pa), contraction, direction, speed (1/s), file.
    """

    def __init__(self, files, rest_length):
        residuals, libraries, contexts = [], [], []
        largest = turns = relaxed = last_u = 0.0
        way, travel = 1.0, 0.0
        self.top = top = max(np.max(r[:, 3]) for r in files)
        for number, rows in enumerate(files):
            if len(rows) < 60 or np.max(rows[:, 1]) < 20e3:
                continue
            keep = max(len(rows) // 500, 1)
            rows = rows.tolist()
            base, library, force, context = [], [], [], []
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
                    -s * f * (abs(v) / rest_length) ** 0.3, relaxed, f * np.log1p(max(r[0] - rows[0][0], 0.0)), f * np.log1p(turns),
                    f * (1 - np.exp(-r[0] / 600.0)), r[0] / 1000.0, (b[3] - a[3]) / dt / top, acceleration / rest_length,
                    u if new else 0.0, s * f * np.exp(-travel / (0.01 * rest_length)),
                    s * np.exp(-travel / (0.003 * rest_length)),
                ])
                force.append(r[3])
                context.append([r[0], r[0] - rows[0][0], r[1], u, s, abs(v) / rest_length, number])
            if len(force) < 20:
                continue
            q, _ = np.linalg.qr(np.array(base))
            free = lambda m: m - q @ (q.T @ m)
            residuals.append(free(np.array(force)))
            libraries.append(free(np.array(library)))
            contexts.append(np.array(context))
        self.residual = np.concatenate(residuals)
        self.library = np.vstack(libraries)
        self.context = np.vstack(contexts)

    def normalized(self):
        """The library with columns of length one; a term that the recordings do not excite is zero."""
        norms = np.linalg.norm(self.library, axis=0)
        norms[norms < 1e-9] = np.inf
        return self.library / norms

    def blocks(self, count=24):
        """Means over blocks of neighbouring rows, files apart: less correlated than the rows. Residual and normalised library."""
        y, x = [], []
        library = self.normalized()
        for number in np.unique(self.context[:, -1]):
            for part in np.array_split(np.flatnonzero(self.context[:, -1] == number), count):
                if len(part):
                    y.append(np.mean(self.residual[part]))
                    x.append(np.mean(library[part], axis=0))
        return np.array(y), np.array(x)
