"""A Gaussian process over (pressure, contraction, direction, speed) as discrepancy of a plain table: it predicts and names nothing."""

import subprocess
from pathlib import Path

import numpy as np
import sklearn
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

LABEL = f"scikit-learn {sklearn.__version__}"


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


def coordinates(t, rest_length):
    v = np.gradient(t[:, 2] * 1e-3, t[:, 0]) / rest_length
    return np.column_stack([t[:, 1] / 300.0, t[:, 2] * 10e-3 / rest_length, np.sign(v), np.log10(np.abs(v) + 1e-6)])


def held_out_error(host, work, campaign, held_out, rest_length):
    """Error on held-out recordings of a plain table with a Gaussian process on top, N."""
    table = work / "plain.pam"
    if not table.exists() or not held_out:
        return None
    parts = predict(host, table, [*campaign, *held_out], work / "predicted.csv")
    seen, unseen = parts[: len(campaign)], parts[len(campaign):]
    seen = [t for t in seen if len(t) > 10 and np.max(t[:, 1]) > 20.0]
    x = np.vstack([coordinates(t, rest_length) for t in seen])
    y = np.concatenate([t[:, 3] - t[:, 4] for t in seen])
    pick = np.linspace(0, len(y) - 1, min(len(y), 350)).astype(int)
    scale = np.std(y[pick]) or 1.0
    kernel = ConstantKernel(1.0) * RBF([1.0] * 4, (0.05, 50.0)) + WhiteKernel(0.1)
    process = GaussianProcessRegressor(kernel, n_restarts_optimizer=0, random_state=0).fit(x[pick], y[pick] / scale)
    errors = [(t[:, 3] - t[:, 4] - scale * process.predict(coordinates(t, rest_length)))[::3] for t in unseen]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
