"""Knockoffs (doi 10.1214/15-AOS1337, 10.1111/rssb.12265) by knockpy: Gaussian model-X knockoffs of the terms, lasso statistics.

With one true term among fifteen, knockoff+ at a false discovery rate q selects nothing as long as it would select fewer than 1/q terms.
So the largest statistic is the name, where it exceeds the largest one of a knockoff by a factor; the factor is the setting.
"""

from importlib.metadata import version

import numpy as np
from knockpy.knockoff_filter import KnockoffFilter

from .recordings import NAMES

LABEL = f"knockoffs (knockpy {version('knockpy')})"
SETTINGS = (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
# Knockoffs are random: the statistics are averaged over this many draws.
DRAWS = 5


def evidence(columns):
    """The strongest term, and its statistic as a multiple of the strongest one of a knockoff."""
    y, x = columns.blocks()
    usable = np.flatnonzero(np.std(x, axis=0) > 1e-12)
    x = (x[:, usable] - x[:, usable].mean(axis=0)) / x[:, usable].std(axis=0)
    y = (y - y.mean()) / (y.std() or 1.0)
    mean = np.zeros(len(usable))
    for draw in range(DRAWS):
        np.random.seed(draw)
        f = KnockoffFilter(ksampler="gaussian", fstat="lasso", knockoff_kwargs={"method": "equicorrelated"})
        f.forward(X=x, y=y, fdr=0.2, shrinkage="ledoitwolf")
        mean += np.asarray(f.W) / DRAWS
    best = int(np.argmax(mean))
    against = max(float(-mean.min()), 1e-3 * float(np.abs(mean).max()), 1e-12)
    return NAMES[usable[best]], float(mean[best]) / against


def name(found, setting):
    return found[0] if found[1] > setting else ""
