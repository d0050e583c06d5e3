"""Fit, predict, and diagnose pneumatic artificial muscles, and talk to their controllers.

All arrays are in SI units: s, Pa (gauge), m, N, K. All errors are of the type PamError.

>>> import pamtools as pam
>>> muscle = pam.Muscle("mini-1", rest_length_mm=39.16, braid_angle_deg=77.4, bladder_outer_diameter_mm=3.0, bladder_wall_mm=0.5)
>>> muscle
Muscle("mini-1", rest_length_mm=39.16)
"""

from ._native import (
    Campaign,
    Fit,
    Muscle,
    PamError,
    Prediction,
    Recording,
    Table,
    __version__,
    evaluate,
    fit,
    from_frame,
    read,
)
from .device import Device, Sample, connect
from .diagnosis import Diagnosis, diagnose
from .regression import MuscleRegressor

__all__ = [
    "Campaign",
    "Device",
    "Diagnosis",
    "Fit",
    "Muscle",
    "MuscleRegressor",
    "PamError",
    "Prediction",
    "Recording",
    "Sample",
    "Table",
    "connect",
    "diagnose",
    "evaluate",
    "fit",
    "from_frame",
    "read",
]
