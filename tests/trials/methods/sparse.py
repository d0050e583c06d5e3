"""PySINDy's sequentially thresholded least squares (doi 10.21105/joss.03994)."""

import warnings

import numpy as np
import pysindy

from .recordings import NAMES

LABEL = f"PySINDy {pysindy.__version__}, STLSQ"
# Threshold as a share of the residual's norm, and ridge.
SETTINGS = [(threshold, ridge) for threshold in (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9) for ridge in (1e-6, 0.05, 1.0)]


def evidence(columns):
    """For each setting the term with the largest coefficient; none where no term is kept."""
    return {setting: strongest(columns.normalized(), columns.residual, *setting) for setting in SETTINGS}


def strongest(x, y, threshold, ridge):
    optimizer = pysindy.STLSQ(threshold=threshold * np.linalg.norm(y), alpha=ridge, max_iter=20)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            optimizer.fit(x, y.reshape(-1, 1))
    except ValueError:  # No term is kept.
        return ""
    weights = np.abs(np.ravel(optimizer.coef_))
    return NAMES[int(np.argmax(weights))] if weights.max() > 0 else ""


def name(found, setting):
    return found[setting]
