"""The empirical model discrepancy (doi 10.5281/zenodo.13287993) by emdcmp: is the model with a term better than the one without?

Each term is fitted by least squares to every second block of the recordings; its risk is that of the other blocks. The term of least risk
is compared with no term: the probability Bemd that its risk is less, with noise of the blocks as the synthetic data.
"""

import warnings
from importlib.metadata import version

import numpy as np
from emdcmp import emd

from .recordings import NAMES

LABEL = f"emdcmp {version('emdcmp')}"
SETTINGS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999)


def evidence(columns):
    """The term of least held-out risk, and the probability that its risk is less than that of no term."""
    y, x = columns.blocks()
    one, two = np.arange(0, len(y), 2), np.arange(1, len(y), 2)
    best = None
    for k in range(len(NAMES)):
        length = float(x[one, k] @ x[one, k])
        if length <= 0.0:
            continue
        size = float(x[one, k] @ y[one]) / length
        left = y[two] - size * x[two, k]
        risk = float(np.mean(left**2))
        if best is None or risk < best[0]:
            best = (risk, k, left)
    _, k, left = best
    noise = np.random.default_rng(1).standard_normal(4 * len(two)) * np.std(left)
    return NAMES[k], less_risk(left, y[two], noise)


def less_risk(left, other, noise):
    """The probability that the model that leaves the first residual has less risk than the one that leaves the other."""
    risk = lambda residual: emd.make_empirical_risk_ppf(np.sort(residual**2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return float(emd.Bemd(risk(left), risk(other), risk(noise), risk(noise), c=1.0, res=4, M=32, max_M=32, progbarA=None, progbarB=None,
                              use_multiprocessing=False))


def name(found, setting):
    return found[0] if found[1] > setting else ""
