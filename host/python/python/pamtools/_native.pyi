"""The compiled part of pamtools; import its names from `pamtools`."""

import os
from collections.abc import Iterator, Sequence
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = str | os.PathLike[str]
_Array = NDArray[np.float64]

__version__: str

class PamError(ValueError):
    """An error. The text states cause, place, and remedy; the attributes contain the parts."""
    code: str
    """The stable error code, such as "recording::time-order"."""
    cause: str
    file: str | None
    line: int | None
    column: str | None
    help: str

@final
class Muscle:
    """The geometry and limits of a muscle."""
    def __new__(
        cls,
        name: str,
        rest_length_mm: float,
        braid_angle_deg: float,
        bladder_outer_diameter_mm: float,
        bladder_wall_mm: float,
        kind: Literal["contractile", "push"] = "contractile",
        max_pressure_kpa: float | None = None,
        young_modulus_mpa: float | None = None,
    ) -> Muscle: ...
    @staticmethod
    def read(path: _Path) -> Muscle:
        """Reads a description (TOML)."""
    @property
    def name(self) -> str: ...
    @property
    def rest_length(self) -> float:
        """L0, m."""
    @property
    def kind(self) -> Literal["contractile", "push"]: ...
    @staticmethod
    def from_toml(text: str) -> Muscle:
        """A description from the text of its file (TOML)."""
    def to_toml(self) -> str:
        """The text of its file (TOML). Descriptions can be pickled, copied, and compared."""

@final
class Recording:
    """One recording, columns in SI units. Time must increase, and all columns must have the same length."""
    def __new__(
        cls,
        name: str,
        time: ArrayLike,
        pressure: ArrayLike,
        stroke: ArrayLike,
        force: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> Recording: ...
    @property
    def name(self) -> str: ...
    @property
    def time(self) -> _Array:
        """s."""
    @property
    def pressure(self) -> _Array:
        """Gauge pressure, Pa."""
    @property
    def stroke(self) -> _Array:
        """Contraction stroke, m; positive when the muscle shortens."""
    @property
    def force(self) -> _Array | None:
        """N, if it was measured."""
    @property
    def temperature(self) -> _Array | None:
        """K, if it was measured."""
    def __len__(self) -> int: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def to_pandas(self) -> Any:
        """A pandas data frame, columns named as in a file."""
    def to_polars(self) -> Any:
        """A polars data frame, columns named as in a file."""
    def plot(self, axes: Any = None) -> Any:
        """Draws pressure, stroke, and force over time. Needs matplotlib; returns the axes."""

@final
class Campaign:
    """Recordings of one muscle in chronological order; earlier recordings affect the model of later ones."""
    def __new__(cls, recordings: Sequence[Recording]) -> Campaign: ...
    @property
    def recordings(self) -> list[Recording]: ...
    @property
    def warnings(self) -> list[str]:
        """Warnings of the reader."""
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> Recording: ...
    def __iter__(self) -> Iterator[Recording]: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def to_pandas(self) -> Any:
        """A pandas data frame, columns named as in a file; the column `recording` has the names."""
    def to_polars(self) -> Any:
        """A polars data frame, columns named as in a file; the column `recording` has the names."""
    def plot(self, axes: Any = None) -> Any:
        """Draws force against stroke, or against pressure where the length is held. Needs matplotlib; returns the axes."""

@final
class Prediction:
    """The prediction of one recording."""
    @property
    def force(self) -> _Array:
        """N."""
    @property
    def band(self) -> _Array | None:
        """Half the width of the 95 % confidence band of the force, N; None if the table contains no uncertainty."""
    @property
    def rms(self) -> float | None:
        """Root mean square of measured minus predicted force, N; None without a force column."""
    @property
    def inside(self) -> float | None:
        """The share of readings within the 95 % prediction interval, 0 to 1."""
    def __len__(self) -> int: ...
    def plot(self, axes: Any = None) -> Any:
        """Draws the predicted force by row and its band. Needs matplotlib; returns the axes."""

@final
class Table:
    """A fitted model, as it is sent to a controller."""
    @staticmethod
    def read(path: _Path) -> Table:
        """Reads a .pam file."""
    def write(self, path: _Path) -> None:
        """Writes a .pam file."""
    @property
    def deadband(self) -> float:
        """P0, Pa."""
    @property
    def nodes(self) -> _Array:
        """Pressures of the nodes, Pa."""
    @property
    def elastic(self) -> list[_Array]:
        """The curves E_1, E_2, ... at the nodes, Pa."""
    @property
    def friction(self) -> _Array:
        """k_F at the nodes."""
    def force(self, pressure: ArrayLike, stroke: ArrayLike, direction: ArrayLike | None = None) -> Any:
        """Force (N) of the base model. The direction is 1 for shortening, -1 for lengthening, and 0 or None for the mid-line. Arrays
        are broadcast; numbers give a number. Raises PamError for an impossible length, and warns outside the fitted range."""
    def pressure(self, force: ArrayLike, stroke: ArrayLike, direction: ArrayLike | None = None) -> Any:
        """The pressure (Pa) at which the base model pulls with this force (N) at this stroke (m), as the controller computes it. NaN where
        no permitted pressure does."""
    def faults(self) -> list[str]:
        """What makes the table useless for control, one sentence each; empty for a usable table."""
    @staticmethod
    def from_bytes(bytes: bytes) -> Table:
        """A table from the bytes of a .pam file."""
    def to_bytes(self) -> bytes:
        """The bytes of the .pam file. Tables can be pickled and copied."""
    def force_band(self, pressure: ArrayLike, stroke: ArrayLike, direction: ArrayLike | None = None) -> Any:
        """Half the width of the 95 % confidence band of that force, N; None if the table contains no uncertainty."""
    def predict(self, campaign: Campaign) -> list[_Array]:
        """The predicted reading of the load cell, N: one array per recording, with effects and their memory."""
    def predict_with_bands(self, campaign: Campaign) -> list[Prediction]:
        """The same with confidence bands and errors, as in `host predict`."""
    @property
    def tested_stroke(self) -> tuple[float, float]:
        """Least and greatest stroke of the recordings that were fitted, m."""
    def plot(self, axes: Any = None) -> Any:
        """Draws force against stroke at each node, shortening and lengthening as a band. Needs matplotlib; returns the axes."""

@final
class Fit:
    """A finished fit."""
    @property
    def summary(self) -> dict[str, Any]:
        """The results of the fit, as in the JSON of `host fit` (schema pam-fit/1)."""
    @property
    def table(self) -> Table: ...
    @property
    def campaign(self) -> Campaign:
        """The recordings that were fitted."""
    def plot(self, axes: Any = None) -> Any:
        """Draws the recordings and the table's prediction for them. Needs matplotlib; returns the axes."""
    def report(self, path: _Path) -> None:
        """Writes the report, one HTML file."""

def read(
    paths: _Path | Sequence[_Path],
    muscle: Muscle | None = None,
    import_description: _Path | None = None,
    filters: dict[str, str] | None = None,
) -> Campaign:
    """Reads a file, or several in chronological order; import_description is a TOML file that describes another format."""

def fit(
    campaign: Campaign,
    muscle: Muscle,
    order: int = 4,
    tip_correction: bool = False,
    smoothing: float | None = None,
    fit_geometry: bool = False,
    fit_lengths: bool = False,
    physical: bool = False,
) -> Fit:
    """Fits a muscle's table to recordings."""

def evaluate(campaign: Campaign, muscle: Muscle, *, order: int = 4, leave_out: str = "runs") -> dict[str, Any]:
    """The error of a fit on recordings that it has not seen: each run (or each of the "contractions") is left out in turn. Percentages
    refer to the largest measured force."""

def from_frame(
    frame: Any,
    name: str = "frame",
    muscle: Muscle | None = None,
    *,
    split_by: str | Sequence[str] | None = None,
    filters: dict[str, str] | None = None,
    missing: Literal["error", "skip"] = "error",
) -> Campaign:
    """A data frame as a campaign: pandas, polars, a dict of columns, or anything with the Arrow PyCapsule interface. The column names end
    in the unit, as in a file; `split_by` names columns whose values tell the recordings apart."""

@final
class DiagnosisResult:
    """The answer of a diagnosis with what it was made from; `pamtools.Diagnosis` contains it."""
    def json(self) -> str: ...
    def corrected_table(self) -> Table: ...
    def report(self, path: _Path) -> None: ...

def diagnose(campaign: Campaign, muscle: Muscle) -> DiagnosisResult: ...

@final
class Link:
    """The connection of a `pamtools.Device`."""
    def __new__(cls, port: str) -> Link: ...
    @staticmethod
    def ports() -> list[str]: ...
    @property
    def port(self) -> str: ...
    def info(self) -> dict[str, Any]: ...
    def settings(self) -> dict[str, Any]: ...
    def write_settings(self, text: str) -> None: ...
    def flash(self, table: Table) -> str: ...
    def clear(self) -> None: ...
    def arm(self) -> None: ...
    def vent(self) -> None: ...
    def follow(
        self,
        quantity: str,
        profile: str,
        seconds: float | None = None,
        rate: float | None = None,
        stiffness: float | None = None,
        beyond: bool = False,
    ) -> None: ...
    def watch(self, seconds: float | None = None, rate: float | None = None) -> None: ...
    def next_rows(self) -> list[tuple[float, float, float, float, float, float, float, str, str]] | None: ...
    def stop(self) -> None: ...
    def close(self) -> None: ...
