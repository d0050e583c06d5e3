"""The board with a pair of on/off valves in place of the regulator, and the air that goes through them."""

from board import TICK_S, Board


class PairBoard(Board):
    """A muscle between a supply of 7 bar and the air around. The valves are not quite what the settings say they are.

    Flow through an orifice by its critical ratio, as in ISO 6358, for a volume that does not change; a valve opens some time after its
    signal, and closes some time after the signal's end.
    """

    SUPPLY_PA, AIR_PA, CRITICAL = 700e3, 101_325.0, 0.4
    # Rates at rest of an open valve, Pa/s: 12 % less and 10 % more than the settings.
    FILL, VENT = 3.5e6, 4.4e6
    OPENS_S, CLOSES_S, STEP_S = 1.2e-3, 1e-3, 5e-5

    def __init__(self, **options):
        self.is_open, self.since = {"fill": False, "vent": True}, {"fill": 0.0, "vent": 0.0}
        self.both_open_s, self.leak_per_s = 0.0, 0.0
        super().__init__(**options)

    def flow(self, before, behind):
        past = max(0.0, (behind / before - self.CRITICAL) / (1 - self.CRITICAL))
        return (1 - min(1.0, past) ** 2) ** 0.5

    def opened(self, name, signal):
        """Whether a valve is open, a step later."""
        self.since[name] = self.since[name] + self.STEP_S if signal != self.is_open[name] else 0.0
        if self.since[name] > (self.OPENS_S if signal else self.CLOSES_S):
            self.is_open[name], self.since[name] = signal, 0.0
        return self.is_open[name]

    def pressure_later(self):
        chip, pressure = self.chip, self.pressure_pa
        for number in range(int(TICK_S / self.STEP_S + 0.5)):
            fill_signal, vent_signal = chip.valves_at(chip.now - TICK_S + (number + 0.5) * self.STEP_S)
            fill, vent = self.opened("fill", fill_signal), self.opened("vent", vent_signal)
            inside, supply = pressure + self.AIR_PA, self.SUPPLY_PA + self.AIR_PA
            rate = -self.leak_per_s * pressure
            if fill:
                rate += self.FILL * self.flow(supply, min(inside, supply))
            if vent:
                rate -= self.VENT * inside / supply * self.flow(inside, self.AIR_PA)
            if chip.valve_open:
                rate -= pressure / 0.03
            elif fill and vent:
                self.both_open_s += self.STEP_S
            pressure = max(0.0, pressure + rate * self.STEP_S)
        return pressure
