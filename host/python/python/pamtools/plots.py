"""Pictures with matplotlib: what the methods ``plot`` draw."""

import warnings

import numpy as np


def _axes(axes, rows=1):
    if axes is not None:
        return axes
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("plot() needs matplotlib: pip install matplotlib") from error
    _, axes = plt.subplots(rows, sharex=True, layout="constrained")
    return axes


def recording(recording, axes=None):
    """Pressure, stroke, and force over time."""
    columns = [(recording.pressure / 1e3, "pressure, kPa"), (recording.stroke * 1e3, "stroke, mm"), (recording.force, "force, N")]
    columns = [(values, label) for values, label in columns if values is not None]
    axes = np.atleast_1d(_axes(axes, len(columns)))
    for ax, (values, label) in zip(axes, columns):
        ax.plot(recording.time, values, linewidth=0.8)
        ax.set_ylabel(label)
    axes[0].set_title(recording.name)
    axes[-1].set_xlabel("time, s")
    return axes


def campaign(campaign, axes=None):
    """Force against stroke of each recording; against pressure where the length is held."""
    axes = _axes(axes)
    recordings = [r for r in campaign if r.force is not None]
    held = all(np.ptp(r.stroke) < 1e-4 for r in recordings)
    for r in recordings:
        axes.plot(r.pressure / 1e3 if held else r.stroke * 1e3, r.force, linewidth=0.8, label=r.name)
    axes.set_xlabel("pressure, kPa" if held else "stroke, mm")
    axes.set_ylabel("force, N")
    if len(recordings) <= 12:
        axes.legend(fontsize="small")
    return axes


def table(table, axes=None, stroke=None):
    """Force against stroke at each node: the mid-line, and shortening and lengthening as a band."""
    axes = _axes(axes)
    low, high = table.tested_stroke
    stroke = np.linspace(low, high, 200) if stroke is None else np.asarray(stroke)
    for pressure in table.nodes:
        with warnings.catch_warnings():
            # The outermost nodes lie at the edge of the tested pressures, some of them beyond it.
            warnings.simplefilter("ignore")
            middle, shortening, lengthening = (table.force(pressure, stroke, direction) for direction in (0, 1, -1))
        (line,) = axes.plot(stroke * 1e3, middle, linewidth=1, label=f"{pressure / 1e3:.0f} kPa")
        axes.fill_between(stroke * 1e3, shortening, lengthening, color=line.get_color(), alpha=0.2, linewidth=0)
    axes.set_xlabel("stroke, mm")
    axes.set_ylabel("force, N")
    axes.legend(fontsize="small")
    return axes


def fit(fit, axes=None):
    """The recordings of a fit, and the table's prediction for them."""
    axes = campaign(fit.campaign, axes)
    recordings = [r for r in fit.campaign if r.force is not None]
    held = all(np.ptp(r.stroke) < 1e-4 for r in recordings)
    for r, force in zip(fit.campaign, fit.table.predict(fit.campaign)):
        axes.plot(r.pressure / 1e3 if held else r.stroke * 1e3, force, color="black", linewidth=0.6)
    return axes


def prediction(prediction, axes=None):
    """The predicted force by row, and its 95 % band."""
    axes = _axes(axes)
    rows = np.arange(len(prediction))
    axes.plot(rows, prediction.force, linewidth=0.8)
    if prediction.band is not None:
        axes.fill_between(rows, prediction.force - prediction.band, prediction.force + prediction.band, alpha=0.3, linewidth=0)
    axes.set_xlabel("row")
    axes.set_ylabel("predicted force, N")
    return axes
