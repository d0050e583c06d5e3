"""P0, E_k, and k_F of all pressures together, with SciPy: the reference for host/tests/fit_references.rs.

    python3 tests/references/joint_fit.py       writes joint_fit_points.csv and joint_fit.csv next to it

Minimises the plain sum of squares of F - (1 - s k_F(P)) [(P - P0) g(L) + sum_k E_k(P) c_k(L)] over P0 (one), E_1 ... E_4 and k_F (one
of each at each of six pressures) by scipy.optimize.least_squares (trust region reflective, numeric Jacobian): 31 unknowns, both
branches, noise of 20 mN. Nothing is smoothed. The muscle's columns are computed from the formulas, not taken from the project. P0's
standard deviation is that of the numeric Jacobian, for noise that is independent, as it is here.
Made with numpy 2.4.6, SciPy 1.17.1.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

HERE = Path(__file__).resolve().parent
L0, ALPHA, D0, T0 = 39.16e-3, np.radians(77.4), 3.0e-3, 0.5e-3
B = L0 / np.sin(ALPHA)
N = B * np.cos(ALPHA) / (np.pi * D0)
VB = np.pi / 4 * L0 * (D0**2 - (D0 - 2 * T0) ** 2)
P0 = 76.5e3
LEVELS = 207e3 + 69e3 * np.arange(6)


def parts(x):
    length = L0 - x
    radius = np.sqrt(B**2 - length**2) / (2 * np.pi * N)
    wall = radius - np.sqrt(radius**2 - VB / (np.pi * length))
    ex, ez = radius / (D0 / 2) - 1, length / L0 - 1
    columns = [VB / length * ez**k - wall * length**2 * ex**k / (2 * np.pi * N**2 * radius) for k in range(1, 5)]
    return (3 * length**2 - B**2) / (4 * np.pi * N**2), np.stack(columns, axis=-1)


def main():
    rng = np.random.default_rng(7)
    rows = []
    for j, p in enumerate(LEVELS):
        reach = 2.9e-3 * (p - P0) / (LEVELS[-1] - P0)
        for s in (1.0, -1.0):
            for x in np.linspace(0, reach, 40):
                g, c = parts(x)
                e = np.array([2.1e6, -1.5e6, 1.1e6, -0.2e6]) * (1 + 0.06 * j)
                f = (1 - s * (0.14 - 0.018 * j)) * ((p - P0) * g + c @ e)
                rows.append((j, x, s, round(f + 0.02 * rng.standard_normal(), 6)))
    j = np.array([r[0] for r in rows])
    x, s, f = (np.array([r[i] for r in rows]) for i in (1, 2, 3))
    x = np.round(x, 9)
    g, c = parts(x)
    p = LEVELS[j]

    def model(theta):
        moduli, friction = 1e6 * theta[1:25].reshape(6, 4), theta[25:]
        return (1 - s * friction[j]) * ((p - 1e3 * theta[0]) * g + np.sum(moduli[j] * c, axis=1))

    start = np.concatenate([[50.0], np.tile([1.0, 0, 0, 0], 6), np.full(6, 0.05)])
    found = least_squares(lambda t: model(t) - f, start, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=2000)
    noise = np.sum(found.fun**2) / (len(f) - len(start))
    covariance = noise * np.linalg.inv(found.jac.T @ found.jac)
    print("P0", found.x[0], "kPa ±", np.sqrt(covariance[0, 0]), "cost", found.cost, found.message)
    with open(HERE / "joint_fit_points.csv", "w") as out:
        out.write("pressure_Pa,stroke_m,direction,force_N\n")
        out.writelines(f"{a:.1f},{b:.9f},{d:.0f},{e:.6f}\n" for a, b, d, e in zip(p, x, s, f))
    with open(HERE / "joint_fit.csv", "w") as out:
        out.write("pressure_Pa,P0_kPa,P0_std_kPa,k_F,E_1_MPa,E_2_MPa,E_3_MPa,E_4_MPa,sum_of_squares_N2\n")
        for i, level in enumerate(LEVELS):
            e = ",".join(f"{v:.9e}" for v in found.x[1 + 4 * i : 5 + 4 * i])
            out.write(
                f"{level:.1f},{found.x[0]:.9f},{np.sqrt(covariance[0, 0]):.9f},{found.x[25 + i]:.12f},{e},"
                f"{2 * found.cost:.12e}\n"
            )


if __name__ == "__main__":
    main()
