"""The timer whose outputs switch a pair of on/off valves."""

from peripherals import Registers

FILL_CHANNEL, VENT_CHANNEL = 3, 4


class ValveTimer(Registers):
    """TIM4 (chapter 17) in one-pulse mode, counting up: channels 3 and 4 as outputs without preload."""

    CONTROL, EVENTS, MODES, ENABLES, PRESCALER, RELOAD = 0x00, 0x14, 0x1C, 0x20, 0x28, 0x2C
    COMPARE = {FILL_CHANNEL: 0x3C, VENT_CHANNEL: 0x40}
    ONE_PULSE = 1 << 3

    def __init__(self, chip):
        super().__init__(chip)
        self.words[self.RELOAD] = 0xFFFF
        self.divider, self.since, self.turn = 1, chip.now, 0

    def counts(self):
        return self.get(self.CONTROL) & 1

    def rate(self):
        return self.chip.rcc.timer1() / self.divider

    def count(self):
        count = int((self.chip.now - self.since) * self.rate() + 1e-6) if self.counts() else 0
        # Behind the period it is zero, also before its end has been handled here.
        return count if count <= self.get(self.RELOAD) else 0

    def read(self, offset):
        return self.count() if offset == 0x24 else self.get(offset)

    def write(self, offset, value):
        assert self.chip.rcc.get(0x40) >> 2 & 1, "the timer has no clock"
        if offset == self.EVENTS:
            if value & 1:
                self.divider, self.since = self.get(self.PRESCALER) + 1, self.chip.now
        else:
            starts = offset == self.CONTROL and value & 1 and not self.counts()
            self.words[offset] = value
            if starts:
                assert value & self.ONE_PULSE, "it stops at the end of a period"
                self.since = self.chip.now
        self.plan()
        self.chip.note_outputs()

    def plan(self):
        """Notes the outputs at each compare, and stops at the end of the period."""
        self.turn += 1
        if not self.counts():
            return
        turn, end = self.turn, self.get(self.RELOAD) + 1
        for count in {self.get(place) for place in self.COMPARE.values()} | {end}:
            at = self.since + count / self.rate()
            if count <= end and at >= self.chip.now:
                self.chip.at(at, lambda count=count: self.met(turn, count == end))

    def met(self, turn, is_end):
        if turn == self.turn:
            if is_end:
                self.words[self.CONTROL] = self.get(self.CONTROL) & ~1
            self.chip.note_outputs()

    def is_high(self, channel):
        """Level of an output; one that is off leaves the pin to its resistor."""
        enables = self.get(self.ENABLES) >> 4 * (channel - 1)
        half = self.get(self.MODES) >> (0 if channel == FILL_CHANNEL else 8)
        mode = half >> 4 & 7
        assert not half & 0b1011, "an output, without preload"
        if mode == 7:
            active = self.count() >= self.get(self.COMPARE[channel])
        else:
            # Forced, or frozen as a reset leaves it.
            assert mode in (0, 4, 5), f"mode {mode} of channel {channel}"
            active = mode == 5
        return bool(enables & 1 and active != bool(enables >> 1 & 1))
