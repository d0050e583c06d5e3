"""The Nucleo's own image with a pair of on/off valves: pressure follows, and both valves are safe whatever fails.

    bash tests/nucleo/run.sh test_valves
"""

import unittest

from board import TABLE, Board
from link import BYTES, CLEAR_FAULT, FORCE_MODE, PRESSURE_MODE, RESTART, SETTINGS, STOP, Refused
from pair_board import PairBoard

PERIOD_S = 0.010
# The most instructions of a control tick with a pair, all of its interrupts together, in force control with a table: 2,635 measured, of
# 180,000 cycles between two ticks.
MOST_INSTRUCTIONS = 2800
SAFE = (False, True)


def pair(settle=0.3):
    board = PairBoard(settle=settle)
    board.link.change(valves__period_ticks=10)
    return board


def running(pascals=300e3, seconds=0.5):
    board = pair()
    board.start(PRESSURE_MODE)
    board.link.set_point(0, pascals)
    board.run(seconds)
    return board


def signals(board):
    return board.chip.valves[-1][1:]


class Outputs(unittest.TestCase):
    def test_from_power_up_on_the_fill_valve_is_closed_and_the_vent_valve_open(self):
        for board in (Board(), pair()):
            self.assertEqual([change[1:] for change in board.chip.valves], [SAFE])
            self.assertEqual(board.chip.valves[0][0], 0.0)
        pins = board.chip.portb.get(0x00)
        self.assertEqual((pins >> 16 & 3, pins >> 18 & 3), (2, 2), "the timer drives both")

    def test_without_a_pair_the_outputs_do_not_move(self):
        board = Board()
        board.start(PRESSURE_MODE)
        board.link.set_point(0, 300e3)
        board.run(0.2)
        self.assertGreater(board.pressure_pa, 250e3)
        self.assertEqual([change[1:] for change in board.chip.valves], [SAFE])

    def test_both_switch_and_are_never_open_at_once(self):
        board = running()
        for pascals in (100e3, 400e3, 60e3, 350e3):
            board.link.set_point(0, pascals)
            board.run(0.15)
        self.assertEqual(board.link.status()["fault"], None)
        begun = board.chip.valves
        self.assertGreater(sum(fill for _, fill, _ in begun), 20)
        self.assertGreater(sum(vent for _, _, vent in begun), 20)
        self.assertFalse(any(fill and vent for _, fill, vent in begun), "signals")
        self.assertEqual(board.both_open_s, 0.0, "the valves themselves")
        self.assertTrue(all(volts == 0.0 for _, _, volts in board.chip.outputs), "the regulator's output stays at 0 V")
        # A pulse is no shorter than the least and the dead time together, and no longer than a period.
        pulses = [after - at for (at, fill, _), (after, _, _) in zip(begun, begun[1:]) if fill]
        self.assertGreater(min(pulses), 1.2e-3)

    def test_a_pulse_after_venting_waits_for_the_vent_valve_and_lasts_to_the_end_of_its_period(self):
        board = running()
        board.link.set_point(0, 0.0)
        self.assertTrue(board.run(0.05, lambda: signals(board) == SAFE), "it does not vent")
        before = len(board.chip.valves)
        board.link.set_point(0, 600e3)
        board.run(0.05)
        changes = board.chip.valves[before:]
        number = next(at for at, change in enumerate(changes) if change[1])
        closed, filled, ended = (changes[number + step][0] for step in (-1, 0, 1))
        # The setpoint needs more than the valve gives: 2 ms for the vent valve to close, then all of the period. A write takes its time.
        self.assertAlmostEqual(filled - closed, 2e-3, delta=50e-6)
        self.assertEqual(changes[number - 1][1:], (False, False))
        self.assertGreater(ended - filled, 7.9e-3)

    def test_settings_that_no_pair_can_have_are_refused_and_others_outlive_a_restart(self):
        board = PairBoard()
        for change in (
            {"valves__period_ticks": 3}, {"valves__period_ticks": 51}, {"valves__period_ticks": 20},
            {"valves__period_ticks": 10, "valves__dead_s": 7.1e-3}, {"valves__period_ticks": 10, "valves__supply_pa": 600e3},
            {"valves__fill_pa_per_s": float("nan")}, {"valves__least_s": -1e-3},
        ):
            with self.assertRaises(Refused, msg=str(change)):
                board.link.change(**change)
        board.link.change(valves__period_ticks=8, valves__band_pa=2e3)
        kept = board.link.ask(SETTINGS)
        board.link.ask(RESTART)
        board.restarted()
        self.assertEqual(board.link.ask(SETTINGS), kept)
        self.assertEqual(kept[BYTES["valves__period_ticks"]], 8)


class Loop(unittest.TestCase):
    def course(self, board, seconds):
        """Pressure every millisecond."""
        pressures = []
        for _ in range(round(seconds * 1e3)):
            board.run(0.001)
            pressures.append(board.pressure_pa)
        return pressures

    def test_pressure_follows_a_step(self):
        board = running(100e3)
        for start, end in ((100e3, 300e3), (300e3, 150e3)):
            board.link.set_point(0, end)
            course = self.course(board, 0.4)
            gone = [(pressure - start) / (end - start) for pressure in course]
            risen = next(at for at, part in enumerate(gone) if part > 0.9)
            worst = max(abs(pressure - end) for pressure in course[200:])
            print(f"\nfrom {start / 1e3:.0f} to {end / 1e3:.0f} kPa: 90 % after {risen} ms, "
                  f"overshoot {(max(gone) - 1) * 100:.1f} %, error from 200 ms on {worst / 1e3:.2f} kPa")
            self.assertLess(risen, 120)
            self.assertLess(max(gone), 1.05)
            self.assertLess(worst, 4e3)
        self.assertEqual(board.link.status()["fault"], None)

    def test_pressure_follows_a_ramp(self):
        board = running(100e3)
        worst = 0.0
        for sign in (1, -1):
            for number in range(50):
                demand = 100e3 + 200e3 * (number + 1) / 50 if sign > 0 else 300e3 - 200e3 * (number + 1) / 50
                board.link.set_point(0, demand)
                board.run(0.018)
                if number >= 10:
                    worst = max(worst, abs(board.pressure_pa - demand))
        print(f"\nramp of about 200 kPa/s: largest error {worst / 1e3:.2f} kPa")
        self.assertLess(worst, 12e3)
        self.assertEqual(board.link.status()["fault"], None)

    def test_a_leak_is_made_up_for(self):
        board = running()
        # 30 kPa/s at 300 kPa.
        board.leak_per_s = 0.1
        course = self.course(board, 0.5)[200:]
        self.assertEqual(board.link.status()["fault"], None)
        self.assertLess(max(abs(pressure - 300e3) for pressure in course), 8e3)

    def test_at_rest_the_valves_rest(self):
        board = running()
        board.run(0.3)
        changes = len(board.chip.valves)
        board.run(0.5)
        self.assertLessEqual(len(board.chip.valves) - changes, 4)

    def test_force_follows_and_a_tick_takes_few_instructions(self):
        board = pair()
        board.link.upload(TABLE.read_bytes())
        board.start(FORCE_MODE)
        board.link.set_point(1, 40.0)
        board.run(0.3)
        self.assertGreater(board.pressure_pa, 150e3)
        board.link.set_point(1, 60.0)
        fed = board.chip.watchdog.fed
        counts = board.chip.count(0.02)
        ticks = board.chip.watchdog.fed - fed
        total = sum(count for (line, _), count in counts.items() if line)
        print(f"\ninstructions of a tick in force control with a pair of valves: {total / ticks:.0f}")
        self.assertEqual(board.link.status()["fault"], None)
        self.assertLessEqual(total / ticks, MOST_INSTRUCTIONS)


class Failures(unittest.TestCase):
    def filling(self):
        """A board at the moment at which its fill valve opens."""
        board = running(seconds=0.0)
        self.assertTrue(board.run(0.05, lambda: signals(board)[0]), "it does not fill")
        return board

    def assert_safe_within(self, board, seconds):
        safe = board.run(seconds, lambda: signals(board) == SAFE and board.chip.valve_open)
        self.assertTrue(safe, f"not safe within {seconds * 1e3:.3f} ms: {signals(board)}")

    def test_a_stop_vents_through_both_valves(self):
        board = running()
        board.link.ask(STOP)
        self.assert_safe_within(board, 0.002)
        board.run(0.3)
        self.assertLess(board.pressure_pa, 20e3)
        self.assertEqual(signals(board), SAFE)

    def test_the_vent_valve_empties_the_muscle_where_the_dump_valve_is_jammed(self):
        board = running()
        held = type(board.chip).valve_open
        try:
            type(board.chip).valve_open = property(lambda chip: False)
            board.link.ask(STOP)
            board.run(0.3)
            self.assertLess(board.pressure_pa, 20e3)
        finally:
            type(board.chip).valve_open = held

    def test_a_broken_wire_of_the_sensor_vents(self):
        board = self.filling()
        board.cable = False
        self.assert_safe_within(board, 0.005)
        board.run(0.01)
        self.assertEqual(board.link.status()["fault"], "sensor-range")
        board.cable = True
        board.run(0.3)
        self.assertEqual(signals(board), SAFE)
        board.link.ask(CLEAR_FAULT)
        self.assertEqual(signals(board), SAFE, "and stays so until something is started")

    def test_a_program_that_stops_fills_no_longer_than_its_period_and_the_watchdog_vents(self):
        board = self.filling()
        board.chip.tim3.write(0x00, 0)
        self.assertTrue(board.run(PERIOD_S, lambda: not signals(board)[0]), "the fill valve is still open")
        board.run(0.008)
        self.assertFalse(signals(board)[0])
        self.assertEqual(board.restarted(within=0.040)[0], "watchdog")
        self.assertEqual(signals(board), SAFE)
        self.assertTrue(all(change[1:] == SAFE for change in board.chip.valves if change[0] >= board.chip.restarts[-1][1]))

    def test_an_interrupt_that_nobody_expects_vents_at_once(self):
        board = self.filling()
        board.chip.enabled.add(28)
        board.chip.pend(28)
        self.assert_safe_within(board, 20e-6)

    def test_a_crystal_that_stops_vents_at_once_and_after_the_restart(self):
        board = self.filling()
        board.chip.rcc.lose_crystal()
        self.assert_safe_within(board, 50e-6)
        changes = len(board.chip.valves)
        board.restarted(within=0.040)
        self.assertEqual(len(board.chip.valves), changes, "safe all the time")
        self.assertEqual(board.link.status()["fault"], "clock-failed")

    def test_a_falling_supply_vents_within_microseconds(self):
        board = self.filling()
        board.chip.power.sag(True)
        self.assert_safe_within(board, 5e-6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
