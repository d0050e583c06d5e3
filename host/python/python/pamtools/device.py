"""A client for the controllers: connect, flash, run, record; samples as an iterator, also an asynchronous one.

The muscle is vented at the end of every run: when its time is over, when the loop over its samples is left, on an error, when the program
ends, and when it takes no samples for two seconds.
"""

import asyncio
import json
from typing import NamedTuple

import numpy as np

from . import _native
from ._native import PamError, Recording


class Sample(NamedTuple):
    """One sample of a controller, in SI units."""

    time: float
    """Time of the device, s."""
    pressure: float
    """Measured gauge pressure, Pa."""
    stroke: float
    """Measured stroke, m."""
    force: float
    """Measured force, N."""
    command: float
    """Command to the pressure regulator, Pa."""
    setpoint: float
    """Setpoint in the SI unit of the mode."""
    model: float
    """Force by the table at the measured pressure and stroke, N."""
    state: str
    """disarmed, armed, running, or fault."""
    mode: str
    """What is controlled."""


def connect(port):
    """Connects to a controller at a serial port, or at ``tcp:HOST:PORT`` as ``host emulate`` prints it; returns a :class:`Device`."""
    return Device(port)


class Device:
    """A connected controller. A context manager: at its end the muscle is vented and the port closed.

    ::

        with pam.connect("/dev/ttyACM0") as device:
            device.flash(table)
            for sample in device.follow(force="sine mean=60 amplitude=20 frequency=0.5", seconds=10):
                print(sample.time, sample.force - sample.setpoint)

    Setpoint profiles are numbers or texts as for ``host run``: force in N, pressure in kPa, stroke in mm, angle in degrees.
    """

    def __init__(self, port):
        self._link = _native.Link(str(port))

    @staticmethod
    def ports():
        """The serial ports of this computer."""
        return _native.Link.ports()

    @property
    def port(self):
        """The address of the port."""
        return self._link.port

    def info(self):
        """Identity, versions, tables, settings, state, latched fault, and losses, as a dict."""
        return self._link.info()

    def settings(self):
        """The settings as nested dicts."""
        return self._link.settings()

    def change_settings(self, changes):
        """Writes settings by their dotted names, such as ``{"limits.pressure_pa": 500e3}``, reads them back, and returns all of them."""
        settings = self._link.settings()
        for key, value in changes.items():
            place = settings
            *groups, name = key.split(".")
            for group in groups:
                place = place.get(group) if isinstance(place, dict) else None
            if not isinstance(place, dict) or name not in place or isinstance(place[name], dict):
                raise ValueError(f"`{key}` names no setting; settings() lists them")
            place[name] = value
        self._link.write_settings(json.dumps(settings))
        return self._link.settings()

    def flash(self, table):
        """Sends a :class:`Table`, reads it back, and compares every byte; returns its check sum."""
        return self._link.flash(table)

    def arm(self):
        """Arms the controller. :meth:`follow` and :meth:`run` do so themselves."""
        self._link.arm()

    def vent(self):
        """Vents and disarms immediately, also from another thread during a run."""
        self._link.vent()

    def clear(self):
        """Forgets the latched fault."""
        self._link.clear()

    def follow(self, *, force=None, pressure=None, stroke=None, angle=None, stiffness=None, seconds=None, rate=None, beyond=False):
        """Follows a setpoint profile of one quantity and iterates over its :class:`Sample` values.

        ``seconds`` is the length in time of the device (default: until the loop is left), ``rate`` the number of samples per second. A
        setpoint that the muscle cannot reach by its table is refused unless ``beyond`` is true. The first samples may have been taken
        before the setpoint reached the controller: they have the setpoint that it held until then.
        """
        self._begin(force, pressure, stroke, angle, stiffness, seconds, rate, beyond)
        return self._samples()

    def watch(self, *, seconds=None, rate=None):
        """Iterates over samples without changing what the controller does."""
        self._link.watch(seconds, rate)
        return self._samples()

    def run(self, name="run", *, force=None, pressure=None, stroke=None, angle=None, stiffness=None, seconds, rate=None, beyond=False):
        """Follows a setpoint profile for some seconds and returns the :class:`Recording`."""
        self._begin(force, pressure, stroke, angle, stiffness, seconds, rate, beyond)
        return _recording(name, self._samples())

    def record(self, name="recording", *, seconds, rate=None):
        """Records for some seconds what the controller measures, without changing what it does; returns the :class:`Recording`."""
        return _recording(name, self.watch(seconds=seconds, rate=rate))

    def follow_async(self, **options):
        """As :meth:`follow`, for ``async for``."""
        return self._async(lambda: self.follow(**options))

    def watch_async(self, **options):
        """As :meth:`watch`, for ``async for``."""
        return self._async(lambda: self.watch(**options))

    async def run_async(self, name="run", **options):
        """As :meth:`run`, to be awaited. Cancelling it vents."""
        return _recording(name, [sample async for sample in self.follow_async(**options)])

    def close(self):
        """Ends a run or recording in progress, vents if this connection armed the controller, and closes the port."""
        self._link.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return f"Device({self.port!r})"

    def _begin(self, force, pressure, stroke, angle, stiffness, seconds, rate, beyond):
        given = {"force": force, "pressure": pressure, "stroke": stroke, "angle": angle}
        given = {name: value for name, value in given.items() if value is not None}
        if len(given) != 1:
            raise ValueError("give one of force, pressure, stroke, and angle")
        ((quantity, profile),) = given.items()
        self._link.follow(quantity, str(profile), seconds, rate, stiffness, beyond)

    def _samples(self):
        return _Samples(self._link)

    async def _async(self, begin):
        samples = await asyncio.to_thread(begin)
        try:
            while (rows := await asyncio.to_thread(samples.rows)) is not None:
                for row in rows:
                    yield Sample._make(row)
        finally:
            # The pending call of a cancelled loop ends within 0.1 s; the vent does not wait for it.
            samples.close()


class _Samples:
    """The samples of a run or a recording. Leaving the loop ends it: the iterator is closed with the last reference to it."""

    def __init__(self, link):
        self._link = link
        self._waiting = iter(())
        self._open = True

    def rows(self):
        """The rows that came, at least one; None at the end."""
        while self._open:
            try:
                rows = self._link.next_rows()
            except BaseException:
                self.close()
                raise
            if rows is None:
                self._open = False
            elif rows:
                return rows
        return None

    def __iter__(self):
        return self

    def __next__(self):
        for row in self._waiting:
            return Sample._make(row)
        rows = self.rows()
        if rows is None:
            raise StopIteration
        self._waiting = iter(rows)
        return Sample._make(next(self._waiting))

    def close(self):
        """Ends the run or recording, if it still goes on."""
        if self._open:
            self._open = False
            self._link.stop()

    def __del__(self):
        try:
            self.close()
        except PamError:
            # No caller is left that could take the error.
            pass


def _recording(name, samples):
    """Samples as a recording. Readings that are not numbers are left out, as in a file of ``host run``."""
    rows = np.array([sample[:4] for sample in samples], dtype=float).reshape(-1, 4)
    rows = rows[np.isfinite(rows).all(axis=1)]
    time, pressure, stroke, force = rows.T
    return Recording(name, time, pressure, stroke, force)
