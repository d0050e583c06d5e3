"""The fit as an estimator with the habits of scikit-learn: ``fit``, ``predict``, ``score``, ``get_params``, ``set_params``.

scikit-learn is not needed; where it is installed, the class is one of its regressors, for ``cross_val_score``, ``GridSearchCV``, and
pipelines.
"""

import numpy as np

from . import _native
from ._native import Campaign, Recording

try:
    from sklearn.base import BaseEstimator, RegressorMixin
    from sklearn.exceptions import NotFittedError
except ImportError:

    class NotFittedError(ValueError, AttributeError):
        """The estimator was asked before it was fitted."""

    class RegressorMixin:
        """The score of a regressor."""

        def score(self, X, y, sample_weight=None):
            """The coefficient of determination R²."""
            y = np.asarray(y, dtype=float)
            w = np.ones_like(y) if sample_weight is None else np.asarray(sample_weight, dtype=float)
            residual = np.sum(w * (y - self.predict(X)) ** 2)
            return 1.0 - residual / np.sum(w * (y - np.average(y, weights=w)) ** 2)

    class BaseEstimator:
        """Parameters by the names of the constructor."""

        def get_params(self, deep=True):
            """The parameters as a dict."""
            return {name: getattr(self, name) for name in _PARAMETERS}

        def set_params(self, **parameters):
            """Sets parameters by name."""
            for name, value in parameters.items():
                if name not in _PARAMETERS:
                    raise ValueError(f"`{name}` is not a parameter of {type(self).__name__}; they are {', '.join(_PARAMETERS)}")
                setattr(self, name, value)
            return self

        def __repr__(self):
            given = ", ".join(f"{name}={getattr(self, name)!r}" for name in _PARAMETERS)
            return f"{type(self).__name__}({given})"


_PARAMETERS = ["muscle", "order", "tip_correction", "smoothing", "physical"]

_COLUMNS = ["time", "pressure", "stroke"]


class MuscleRegressor(RegressorMixin, BaseEstimator):
    """Force of a muscle from time, pressure, and stroke.

    ``X`` has three columns: time (s), pressure (Pa), stroke (m); or it is a data frame whose columns are named as in a file
    (``time_s, pressure_kPa, displacement_mm``). ``y`` is the force (N). Rows are in time order; where time does not increase, another
    recording begins. The muscle remembers, so split by recordings or by time (``GroupKFold``, ``TimeSeriesSplit``), never at random.

    After ``fit``, ``fit_`` is the :class:`Fit`, and ``table_`` its :class:`Table`.
    """

    def __init__(self, muscle=None, order=4, tip_correction=False, smoothing=None, physical=False):
        self.muscle = muscle
        self.order = order
        self.tip_correction = tip_correction
        self.smoothing = smoothing
        self.physical = physical

    def fit(self, X, y):
        """Fits the table."""
        if self.muscle is None:
            raise ValueError("MuscleRegressor needs the muscle's description: MuscleRegressor(muscle=pam.Muscle.read(...))")
        names = getattr(X, "columns", None)
        campaign = self._campaign(X, y)
        self.fit_ = _native.fit(
            campaign,
            self.muscle,
            order=self.order,
            tip_correction=self.tip_correction,
            smoothing=self.smoothing,
            physical=self.physical,
        )
        self.table_ = self.fit_.table
        self.n_features_in_ = 3 if names is None else len(names)
        if names is not None and all(isinstance(name, str) for name in names):
            self.feature_names_in_ = np.asarray(list(names), dtype=object)
        elif hasattr(self, "feature_names_in_"):
            del self.feature_names_in_
        return self

    def predict(self, X):
        """The force that the load cell would read, N, with the memory of the muscle."""
        if not hasattr(self, "table_"):
            raise NotFittedError(f"this {type(self).__name__} is not fitted yet: call fit first")
        return np.concatenate(self.table_.predict(self._campaign(X)))

    def _campaign(self, X, y=None):
        """Rows as recordings: another one begins where time does not increase."""
        X = _columns(X, self.muscle)
        if y is not None:
            y = np.asarray(y)
            if y.ndim != 1 or len(y) != len(X):
                raise ValueError(f"y has the shape {y.shape}; it needs one force for each of the {len(X)} rows of X")
        starts = np.flatnonzero(np.diff(X[:, 0]) <= 0) + 1
        _check_order(len(starts), len(X))
        recordings = []
        for number, part in enumerate(np.split(np.arange(len(X)), starts), 1):
            time, pressure, stroke = X[part].T
            recordings.append(Recording(f"recording {number}", time, pressure, stroke, None if y is None else y[part]))
        return Campaign(recordings)

    def __getstate__(self):
        # A fit holds its recordings; what predicts is its table.
        return {name: value for name, value in self.__dict__.items() if name != "fit_"}


def _columns(X, muscle):
    """Time, pressure, and stroke in SI units as an array of three columns."""
    if hasattr(X, "columns"):
        columns = {str(name): np.asarray(X[name]) for name in X.columns}
        times = [values for name, values in columns.items() if name.startswith("time_")]
        if len(times) != 1:
            raise ValueError("the data frame needs one column of time, such as time_s")
        # A recording of a file has increasing time; in a table of several, another begins where it does not.
        number = np.concatenate([[0], np.cumsum(np.diff(times[0]) <= 0)])
        _check_order(number[-1], len(number))
        campaign = _native.from_frame({**columns, "recording_number": number}, "X", muscle, split_by="recording_number")
        return np.concatenate([np.column_stack([r.time, r.pressure, r.stroke]) for r in campaign])
    X = np.asarray(X, dtype=float)
    if X.ndim != 2 or X.shape[1] != len(_COLUMNS):
        raise ValueError(f"X has the shape {X.shape}; it needs the three columns {', '.join(_COLUMNS)}, in s, Pa, and m")
    if not np.isfinite(X).all():
        raise ValueError("X contains NaN or infinity; leave such rows out")
    return X


def _check_order(starts, rows):
    if starts > rows // 10:
        raise ValueError("time does not increase over ten rows: give the rows in time order, and split by recordings, not at random")
