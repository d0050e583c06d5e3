"""The board with a muscle: sensors on the chip's pins, a regulator and a dump valve on its outputs."""

import random
from pathlib import Path

from chip import Chip
from link import HEARTBEAT_S, Link

ROOT = Path(__file__).resolve().parents[2]
IMAGE = ROOT / "target/firmware/nucleo-f446re-test.elf"
TABLE = Path(__file__).resolve().parent / "example-table.bin"

LAG_S = 0.03
TICK_S = 0.001


class Board:
    """A muscle at a stroke of 1.5 mm, whose pressure follows the regulator within 30 ms."""

    def __init__(self, cycles=1.0, prepare=None, settle=0.3):
        self.chip = Chip(IMAGE, cycles)
        self.random = random.Random(1)
        self.pressure_pa, self.cable = 0.0, True
        # Volts of the pressure sensor, that of the second one, and that of the supply air; whether the enable input is closed.
        self.to_volts = lambda pascals: (pascals + 125e3) / 375e3
        self.second_error_pa, self.supply_pa, self.enabled = 0.0, 800e3, True
        # Regulator's pressure at a voltage of the command.
        self.regulator = lambda volts: volts / 3.3 * 1e6
        if prepare:
            prepare(self.chip)
        self.chip.at(0.0, self.step)
        self.restarts = 0
        self.chip.run(settle)
        self.link = Link(self.chip)

    def pressure_later(self):
        """Pressure at the end of a millisecond."""
        chip = self.chip
        volts = 0.0 if chip.valve_open else chip.command_volts
        wanted_pa = 0.0 if chip.valve_open else self.regulator(volts)
        return self.pressure_pa + (wanted_pa - self.pressure_pa) * TICK_S / LAG_S

    def step(self):
        """A millisecond of the muscle; survives restarts of the chip."""
        chip = self.chip
        self.pressure_pa = self.pressure_later()
        noise = self.random.uniform
        force_n = max(0.0, (self.pressure_pa - 76.5e3) * 1.5e-4)
        volt = {
            0: self.to_volts(self.pressure_pa + noise(-300, 300)) if self.cable else 0.0,
            1: (0.0015 + noise(-2e-5, 2e-5) + 0.0028) / (0.050 / 3.3 * 1.112),
            8: (force_n + noise(-0.5, 0.5) + 1100.0) / (1000.0 / 1.5),
            10: self.to_volts(self.pressure_pa + self.second_error_pa + noise(-300, 300)),
            11: (self.supply_pa + 125e3) / 375e3,
        }
        chip.portc.inputs = 1 << 7 if self.enabled else 0
        chip.adc.codes = {channel: round(value / 3.3 * 4095) for channel, value in volt.items()}
        chip.at(chip.now + TICK_S, self.step)

    def run(self, seconds, until=None):
        """Lets time pass; a host that has armed the board keeps it going meanwhile."""
        end = self.chip.now + seconds
        while end - self.chip.now > HEARTBEAT_S:
            self.link.keep_alive()
            if self.chip.run(HEARTBEAT_S, until):
                return True
        return self.chip.run(end - self.chip.now, until)

    def restarted(self, within=0.5, settle=0.5):
        """Waits for a restart and for the board to be up again."""
        restarts = self.chip.restarts
        self.chip.run(within, lambda: len(restarts) > self.restarts)
        assert len(restarts) > self.restarts, "it does not restart"
        self.restarts = len(restarts)
        self.chip.at(self.chip.now, self.step)
        self.chip.run(settle)
        return self.chip.restarts[-1]

    def arm(self):
        """Arms, which takes the test of the dump valve."""
        self.link.arm()
        for _ in range(40):
            self.run(0.05)
            status = self.link.status()
            if status["state"] != "disarmed":
                return status
        return status

    def start(self, mode):
        status = self.arm()
        assert status["state"] == "armed", status
        return self.link.start(mode)
