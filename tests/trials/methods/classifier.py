"""A classifier trained on the simulated bench: scikit-learn's gradient boosting on features of the recordings.

It knows every effect that the bench can add, not the library's fifteen terms only. Training sets have single effects, decoys and trials
without an effect, made like the sealed ones with other seeds. The idea is simulation-based inference with a classifier
(doi 10.1073/pnas.1912789117); `sbi` itself infers continuous parameters, here the answer is one of the names.
"""

import numpy as np
import sklearn
from sklearn.ensemble import ExtraTreesClassifier, HistGradientBoostingClassifier

LABEL = f"classifier trained on the bench (scikit-learn {sklearn.__version__})"
SETTINGS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)


def bins(columns, keys, edges):
    """Mean residual in units of its rms by bins of several coordinates."""
    index = np.zeros(len(columns.residual), dtype=int)
    total = 1
    for key, edge in zip(keys, edges):
        index = index * (len(edge) + 1) + np.searchsorted(edge, key)
        total *= len(edge) + 1
    rms = float(np.sqrt(np.mean(columns.residual**2))) or 1.0
    sums = np.bincount(index, columns.residual / rms, total)
    counts = np.bincount(index, minlength=total)
    return np.where(counts > 5, sums / np.maximum(counts, 1), np.nan)


def loops(files, rest_length, top):
    """Rises, widths and slopes of the force by file: what the base takes away, and what is compared between files."""
    out = []
    for rows in files:
        if len(rows) < 60 or np.max(rows[:, 1]) < 20e3:
            continue
        u, f, p = rows[:, 2] / rest_length, rows[:, 3] / top, rows[:, 1] / 5e5
        up = np.gradient(u) > 0
        middle = (u > np.quantile(u, 0.3)) & (u < np.quantile(u, 0.7))
        mean = lambda m: float(np.mean(f[m])) if m.any() else np.nan
        out.append([np.mean(p), mean(middle & up) - mean(middle & ~up), mean(u <= np.quantile(u, 0.05)), mean(u >= np.quantile(u, 0.95)),
                    np.max(np.abs(np.gradient(u, rows[:, 0]))), np.std(p), rows[-1, 0] - rows[0, 0]])
    out = np.array(out)
    if len(out) == 0:
        return np.full(7 * 8 + 4, np.nan)
    order = np.argsort(out[:, 0])
    picked = order[np.linspace(0, len(order) - 1, 8).astype(int)]
    # Trends against the pressure: straight line through the width and both ends.
    trends = [np.polyfit(out[:, 0], np.nan_to_num(out[:, k]), 1)[0] if len(out) > 2 and np.ptp(out[:, 0]) > 0.01 else np.nan for k in (1, 2, 3)]
    return np.concatenate([out[picked].ravel(), trends, [len(out)]])


def features(files, columns, rest_length):
    t, since, p, u, s, v, number = columns.context.T
    third = lambda q: np.quantile(q, [1 / 3, 2 / 3])
    y = columns.residual
    rms = float(np.sqrt(np.mean(y**2))) or 1.0
    lag = [float(np.mean(y[k:] * y[:-k])) / rms**2 for k in (1, 4, 16, 64)]
    rest = [float(np.min(f[:, 3])) / columns.top for f in files if np.max(f[:, 1]) < 20e3]
    cos = columns.normalized().T @ y / (np.linalg.norm(y) or 1.0)
    return np.concatenate([
        [rms / columns.top, np.mean(np.abs(y) ** 3) ** (1 / 3) / rms, len(files), float(np.mean(rest)) if rest else np.nan], lag, cos,
        bins(columns, (s, u, p), ([0.0], np.quantile(u, [0.1, 0.35, 0.65, 0.9]), third(p))),
        bins(columns, (s, v, p), ([0.0], third(v), third(p))),
        bins(columns, (since,), (np.quantile(since, np.linspace(0.1, 0.9, 9)),)),
        bins(columns, (t,), (np.quantile(t, np.linspace(0.1, 0.9, 9)),)),
        loops(files, rest_length, columns.top),
    ])


class Classifier:
    """Trained on (features, name) of other trials, "" for none."""

    def __init__(self, x, names):
        self.models = [
            HistGradientBoostingClassifier(max_iter=60, learning_rate=0.1, max_leaf_nodes=8, l2_regularization=1.0, random_state=0),
            ExtraTreesClassifier(600, min_samples_leaf=2, random_state=0, n_jobs=2),
        ]
        for m in self.models:
            m.fit(np.nan_to_num(x, nan=-9.0), names)

    def evidence(self, x):
        """Probability of each name, the mean of both models."""
        chances = np.mean([m.predict_proba(np.nan_to_num(x, nan=-9.0)) for m in self.models], axis=0)
        return [dict(zip(self.models[0].classes_, row)) for row in chances]


def name(found, setting):
    """The most likely name where the probability of no effect leaves room for it."""
    best = max((n for n in found if n), key=lambda n: found[n])
    return best if 1.0 - found.get("", 0.0) > setting else ""
