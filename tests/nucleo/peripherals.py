"""Peripherals of the STM32F446RE, as far as the controller's image uses them.

Register offsets, bits and behaviour are those of the reference manual RM0390. Each class has `read(offset)` and `write(offset, value)`
for whole words; `chip` gives the time, delayed calls, memory and interrupts.
"""

BYTE_BITS = 10


class Registers:
    """Registers that keep what is written."""

    def __init__(self, chip):
        self.chip = chip
        self.words = {}

    def get(self, offset):
        return self.words.get(offset, 0)

    def read(self, offset):
        return self.get(offset)

    def write(self, offset, value):
        self.words[offset] = value


class Rcc(Registers):
    """Reset and clocks (chapter 6): oscillators become ready some time after they are switched on, the crystal only if it is there."""

    def __init__(self, chip):
        super().__init__(chip)
        self.words[0x00] = 0x83
        self.security_failed = False

    def read(self, offset):
        value = self.get(offset)
        if offset == 0x00:
            for on, ready in ((0, 1), (16, 17), (24, 25), (26, 27), (28, 29)):
                works = value >> on & 1 and not (on == 16 and self.chip.crystal_dead)
                value = value | 1 << ready if works else value & ~(1 << ready)
        elif offset == 0x08:
            value = value & ~0xC | (value & 3) << 2
        elif offset == 0x0C:
            value |= int(self.security_failed) << 7
        elif offset == 0x74:
            value = value & ~2 | (value & 1) << 1 | self.chip.reset_flags
        return value

    def write(self, offset, value):
        if offset == 0x0C and value >> 23 & 1:
            self.security_failed = False
            return
        if offset == 0x74 and value >> 24 & 1:
            self.chip.reset_flags = 0
            value &= ~(1 << 24)
        if offset == 0x00:
            old = self.get(0x00)
            bypass_moves = (old ^ value) >> 18 & 1
            assert not (bypass_moves and (old | value) >> 16 & 1), "HSEBYP is only written while HSEON is off"
        self.words[offset] = value

    def hclk(self):
        """Processor's clock, Hz."""
        if self.get(0x08) & 3 == 2:
            config = self.get(0x04)
            source = 8e6 if config >> 22 & 1 else 16e6
            return source / (config & 63) * (config >> 6 & 511) / (2 * (config >> 16 & 3) + 2)
        return 16e6

    def apb1(self):
        divider = self.get(0x08) >> 10 & 7
        return self.hclk() / (1 if divider < 4 else 2 << divider - 4)

    def apb2(self):
        divider = self.get(0x08) >> 13 & 7
        return self.hclk() / (1 if divider < 4 else 2 << divider - 4)

    def timer1(self):
        """Clock of the timers of APB1: twice the bus where that is divided."""
        return self.apb1() * (1 if self.get(0x08) >> 10 & 7 < 4 else 2)

    def lose_crystal(self):
        """The crystal stops. With the clock security on (CSSON) the processor continues with its own oscillator and takes an NMI."""
        self.chip.crystal_dead = True
        control = self.get(0x00)
        if control >> 19 & 1:
            self.words[0x08] = self.get(0x08) & ~3
            self.words[0x00] = control & ~(1 << 16 | 1 << 24 | 1 << 19)
            self.security_failed = True
            self.chip.pend(-14)


class Power(Registers):
    """Supply (chapter 5): its detector, and the over-drive that 180 MHz ask for."""

    def __init__(self, chip):
        super().__init__(chip)
        self.low = False

    def read(self, offset):
        if offset == 0x04:
            control = self.get(0x00)
            return 1 << 14 | (control >> 16 & 1) << 16 | (control >> 17 & 1) << 17 | int(self.low) << 2
        return self.get(offset)

    def sag(self, low):
        """The supply falls below its detector's level, or rises above it."""
        exti = self.chip.exti
        rises = low and not self.low
        self.low = low
        if self.get(0x00) >> 4 & 1 and rises and exti.get(0x08) & exti.get(0x00) >> 0 & 1 << 16:
            exti.words[0x14] = exti.get(0x14) | 1 << 16
            self.chip.pend(1)


class Exti(Registers):
    """External interrupts (chapter 10): a pending bit is cleared by writing it."""

    def write(self, offset, value):
        self.words[offset] = self.get(offset) & ~value if offset == 0x14 else value


class Flash(Registers):
    """Flash (chapter 3): one bank, so that the processor does not move while it programs or erases. Bits are only ever cleared."""

    STARTS = [0, 0x4000, 0x8000, 0xC000, 0x10000, 0x20000, 0x40000, 0x60000]
    SIZES = [0x4000] * 4 + [0x10000] + [0x20000] * 3
    KEYS = (0x45670123, 0xCDEF89AB)
    WORD_S = 16e-6

    def __init__(self, chip):
        super().__init__(chip)
        self.words[0x10] = 1 << 31
        self.keys = []
        self.pending = []
        self.errors = 0
        self.stale = False
        self.cut = False

    def read(self, offset):
        if self.pending:
            # The processor has stood still for a word: an interrupt that came meanwhile is taken before the next one.
            self.settle()
            self.chip.end_slice()
        return self.errors if offset == 0x0C else self.get(offset)

    def write(self, offset, value):
        self.settle()
        if offset == 0x00:
            # DCRST works only while the cache is off.
            if value >> 12 & 1 and not value >> 10 & 1:
                self.stale = False
        if offset == 0x04:
            self.keys = (self.keys + [value])[-2:]
            if tuple(self.keys) == self.KEYS:
                self.words[0x10] = self.get(0x10) & ~(1 << 31)
            return
        if offset == 0x0C:
            self.errors &= ~value
            return
        if offset == 0x10:
            if self.get(0x10) >> 31:
                return
            self.words[0x10] = value & ~(1 << 16)
            if value >> 16 & 1 and value >> 1 & 1:
                self.erase(value >> 3 & 15)
            return
        self.words[offset] = value

    def erase(self, sector):
        chip = self.chip
        if self.cut:
            return
        chip.erased.append((sector, chip.now))
        chip.stall(chip.erase_s)
        chip.uc.mem_write(0x08000000 + self.STARTS[sector], b"\xff" * self.SIZES[sector])
        self.stale = True

    def store(self, address, size, value):
        """The processor writes to the flash; the emulated memory takes the raw value first."""
        old = int.from_bytes(self.chip.uc.mem_read(address, size), "little")
        programs = self.get(0x10) & 1 and size == 4 and address % 4 == 0
        self.pending.append((address, size, old & value if programs else old, old))
        if not programs:
            self.errors |= 1 << 7

    def settle(self):
        for address, size, value, old in self.pending:
            if self.cut:
                # The emulated memory took the raw value; without power nothing is written.
                self.chip.uc.mem_write(address, old.to_bytes(size, "little"))
                continue
            if self.chip.words_left == 0:
                # Power fails while this word is programmed: half of its bits are cleared.
                self.cut, value = True, value | old & 0xFFFF0000
                self.chip.words_left = None
                self.chip.restart("power", 1 << 27 | 1 << 26)
            elif self.chip.words_left is not None:
                self.chip.words_left -= 1
            self.chip.words_written += 1
            self.chip.uc.mem_write(address, value.to_bytes(size, "little"))
            self.chip.stall(self.WORD_S)
            self.stale = True
        self.pending.clear()


class Timer(Registers):
    """General-purpose timer (chapter 17), counting up. The prescaler is taken over by an update event."""

    def __init__(self, chip, irq, bits, trigger=None):
        super().__init__(chip)
        self.irq, self.mask, self.trigger = irq, (1 << bits) - 1, trigger
        self.words[0x2C] = self.mask
        self.prescaler = 0
        self.since, self.base, self.turn = chip.now, 0, 0

    def rate(self):
        return self.chip.rcc.timer1() / (self.prescaler + 1)

    def count(self):
        if not self.get(0) & 1:
            return self.base
        return int((self.chip.now - self.since) * self.rate() + 1e-6) + self.base

    def read(self, offset):
        if offset == 0x24:
            return self.count() % (self.get(0x2C) + 1)
        return self.get(offset)

    def write(self, offset, value):
        if offset == 0x10:
            self.words[0x10] = self.get(0x10) & value
            return
        if offset == 0x14:
            if value & 1:
                self.prescaler = self.get(0x28)
                self.since, self.base = self.chip.now, 0
                self.update()
            return
        if offset == 0x24:
            self.since, self.base = self.chip.now, value
        self.words[offset] = value & (self.mask if offset in (0x2C, 0x34) else 0xFFFFFFFF)
        if offset in (0x00, 0x0C, 0x24, 0x2C, 0x34):
            if offset == 0x00 and value & 1:
                self.since = self.chip.now
            self.plan()

    def update(self):
        self.flag(1)
        if self.trigger and self.get(0x04) >> 4 & 7 == 2:
            self.trigger()

    def flag(self, bit):
        self.words[0x10] = self.get(0x10) | bit

    def plan(self):
        """Calls for the next update and the next compare."""
        self.turn += 1
        if not self.get(0) & 1:
            return
        period = self.get(0x2C) + 1
        for target, act in ((0, self.update), (self.get(0x34), lambda: self.flag(2))):
            ahead = (target - self.count()) % period or period
            at = self.since + (self.count() + ahead - self.base) / self.rate()
            self.chip.at(at, self.fire(self.turn, act, at, period))

    def fire(self, turn, act, at, period):
        def fired():
            if turn != self.turn:
                return
            act()
            after = at + period / self.rate()
            self.chip.at(after, self.fire(turn, act, after, period))

        return fired

    def waits(self):
        return bool(self.get(0x10) & self.get(0x0C) & 0x1F)


class Dma(Registers):
    """DMA controller (chapter 9): streams between a peripheral and memory, in the widths that the image uses."""

    SHIFTS = (0, 6, 16, 22)

    def __init__(self, chip, irqs):
        super().__init__(chip)
        self.irqs = irqs
        self.left = {}

    def stream(self, number, register):
        return 0x10 + 0x18 * number + register

    def write(self, offset, value):
        if offset in (0x08, 0x0C):
            flags = offset - 8
            self.words[flags] = self.get(flags) & ~value
            return
        number, register = divmod(offset - 0x10, 0x18)
        started = register == 0 and value & 1 and not self.get(offset) & 1
        self.words[offset] = value
        if started:
            self.left[number] = self.get(self.stream(number, 4))
            self.chip.uart2.pull()

    def read(self, offset):
        if offset >= 0x10 and (offset - 0x10) % 0x18 == 4:
            number = (offset - 0x10) // 0x18
            if number in self.left and self.get(self.stream(number, 0)) & 1:
                return self.left[number]
        return self.get(offset)

    def is_on(self, number, channel):
        control = self.get(self.stream(number, 0))
        return control & 1 and control >> 25 & 7 == channel

    def place(self, number, size):
        total = self.get(self.stream(number, 4))
        return self.get(self.stream(number, 0x0C)) + (total - self.left[number]) * size

    def moved(self, number):
        """One item has been moved."""
        self.left[number] -= 1
        control = self.get(self.stream(number, 0))
        total = self.get(self.stream(number, 4))
        flags = 0
        if self.left[number] == total // 2:
            flags |= 1 << 4
        if self.left[number] == 0:
            flags |= 1 << 5
            if control >> 8 & 1:
                self.left[number] = total
            else:
                self.words[self.stream(number, 0)] = control & ~1
                self.words[self.stream(number, 4)] = 0
        register = 4 * (number // 4)
        self.words[register] = self.get(register) | flags << self.SHIFTS[number % 4]

    def waiting(self):
        """Interrupts that streams ask for."""
        for number, irq in self.irqs.items():
            flags = self.get(4 * (number // 4)) >> self.SHIFTS[number % 4]
            control = self.get(self.stream(number, 0))
            if flags >> 5 & control >> 4 & 1 or flags >> 4 & control >> 3 & 1:
                yield irq


class Adc(Registers):
    """Converter 1 (chapter 13): a scan of the regular sequence, started by TIM3's update, fetched by DMA2 stream 0."""

    SAMPLING = (3, 15, 28, 56, 84, 112, 144, 480)

    def __init__(self, chip):
        super().__init__(chip)
        self.codes = {}
        self.fails = False

    def write(self, offset, value):
        self.words[offset] = self.get(offset) & value if offset == 0x00 else value

    def sequence(self):
        count = (self.get(0x2C) >> 20 & 15) + 1
        return [self.get(0x34) >> 5 * n & 31 for n in range(count)]

    def sampling(self, channel):
        """SMPR2 holds channels 0 to 9, SMPR1 those from 10 on."""
        return self.get(0x10) >> 3 * channel & 7 if channel < 10 else self.get(0x0C) >> 3 * (channel - 10) & 7

    def trigger(self):
        control = self.get(0x08)
        on = control & 1 and control >> 28 & 3 == 1 and control >> 24 & 15 == 8
        if not on or self.fails or self.get(0x00) >> 5 & 1:
            return
        clock = self.chip.rcc.apb2() / (2 * ((self.get(0x304) >> 16 & 3) + 1))
        assert clock <= 36e6, f"the converter runs at {clock} Hz"
        cycles = sum(self.SAMPLING[self.sampling(n)] + 12 for n in self.sequence())
        self.chip.at(self.chip.now + cycles / clock, self.scanned)

    def scanned(self):
        dma = self.chip.dma2
        for channel in self.sequence():
            code = int(min(4095, max(0, self.codes.get(channel, 0))))
            self.words[0x4C] = code
            if not (self.get(0x08) >> 8 & 1 and dma.is_on(0, 0)):
                self.words[0x00] = self.get(0x00) | 1 << 5
                return
            self.chip.uc.mem_write(dma.place(0, 2), code.to_bytes(2, "little"))
            dma.moved(0)


class Dac(Registers):
    """Converter to analogue (chapter 14), channel 1: with its output buffer on it does not come below 0.2 V."""

    def volts(self):
        control = self.get(0x00)
        if not control & 1:
            return 0.0
        volts = (self.get(0x08) & 4095) / 4095 * 3.3
        return volts if control >> 1 & 1 else min(3.1, max(0.2, volts))

    def write(self, offset, value):
        self.words[offset] = value
        self.chip.note_outputs()


class Gpio(Registers):
    """Port (chapter 7): outputs that are set and reset bit by bit, inputs that are read as they are."""

    def __init__(self, chip):
        super().__init__(chip)
        self.inputs = 0

    def read(self, offset):
        return self.inputs if offset == 0x10 else self.get(offset)

    def write(self, offset, value):
        if offset == 0x18:
            self.words[0x14] = self.get(0x14) & ~(value >> 16) | value & 0xFFFF
        else:
            self.words[offset] = value
        self.chip.note_outputs()

    def drives_high(self, pin):
        """Whether a pin is an output that is high; else its resistor to ground decides."""
        return self.get(0x00) >> 2 * pin & 3 == 1 and self.get(0x14) >> pin & 1 == 1


class Uart(Registers):
    """USART2 (chapter 25): one byte each way and no queue; a byte that finds the last one not fetched is lost (ORE)."""

    IRQ = 38
    LINE_BAUD = 1e6

    def __init__(self, chip):
        super().__init__(chip)
        self.flags, self.data, self.seen = 0, 0, False
        self.incoming, self.sent = [], bytearray()
        self.lost, self.sending = 0, False

    def byte_s(self):
        return BYTE_BITS / self.LINE_BAUD

    def send(self, data):
        """The other end sends bytes, one right behind the other."""
        idle = not self.incoming
        self.incoming.extend(data)
        if idle:
            self.chip.at(self.chip.now + self.byte_s(), self.arrive)

    def arrive(self):
        byte = self.incoming.pop(0)
        divider = self.get(0x08)
        baud = self.chip.rcc.apb1() / divider if divider else 0
        if self.get(0x0C) & 0x2004 == 0x2004:
            if abs(baud / self.LINE_BAUD - 1) > 0.02:
                self.flags |= 1 << 1
            elif self.flags >> 5 & 1:
                self.flags |= 1 << 3
                self.lost += 1
            else:
                self.data, self.flags = byte, self.flags | 1 << 5
                dma = self.chip.dma1
                if self.get(0x14) >> 6 & 1 and dma.is_on(5, 4):
                    self.chip.uc.mem_write(dma.place(5, 1), bytes([self.read(0x04)]))
                    dma.moved(5)
        if self.incoming:
            self.chip.at(self.chip.now + self.byte_s(), self.arrive)
        else:
            self.chip.at(self.chip.now + self.byte_s(), self.rest)

    def rest(self):
        if not self.incoming:
            self.flags |= 1 << 4

    def read(self, offset):
        if offset == 0x00:
            self.seen = True
            return self.flags | (0 if self.sending else 1 << 7 | 1 << 6)
        if offset == 0x04:
            # A read of the status and then of the data clears what was seen.
            self.flags &= ~(1 << 5 | (0x1F if self.seen else 0))
            self.seen = False
            return self.data
        return self.get(offset)

    def write(self, offset, value):
        self.words[offset] = value
        if offset in (0x0C, 0x14):
            self.pull()

    def pull(self):
        """Takes the next byte to send from its stream."""
        dma = self.chip.dma1
        if self.sending or not (self.get(0x14) >> 7 & 1 and dma.is_on(6, 4)):
            return
        self.sending = True
        byte = self.chip.uc.mem_read(dma.place(6, 1), 1)[0]
        dma.moved(6)
        self.chip.at(self.chip.now + self.byte_s(), lambda: self.went(byte))

    def went(self, byte):
        self.sending = False
        self.sent.append(byte)
        self.pull()

    def waits(self):
        control, errors = self.get(0x0C), self.flags & 0xE and self.get(0x14) & 1
        return bool(self.flags >> 5 & control >> 5 & 1 or self.flags >> 4 & control >> 4 & 1 or errors)


class Watchdog(Registers):
    """Independent watchdog (chapter 20): another time is taken over five periods of its divided oscillator later, and none is while it is."""

    OSCILLATOR = 32e3
    PRESCALER, RELOAD = 0x04, 0x08

    def __init__(self, chip):
        super().__init__(chip)
        self.words[0x08] = 0xFFF
        self.reload, self.divider = 0xFFF, 4
        self.runs, self.open, self.turn = False, False, 0
        self.busy_until = {self.PRESCALER: 0.0, self.RELOAD: 0.0}
        self.fed = 0

    def busy(self, offset):
        return self.chip.now < self.busy_until[offset]

    def read(self, offset):
        if offset == 0x0C:
            return int(self.busy(self.PRESCALER)) | int(self.busy(self.RELOAD)) << 1
        return self.get(offset)

    def write(self, offset, value):
        if offset == 0x00:
            self.open = value == 0x5555
            if value == 0xCCCC:
                self.runs = True
                self.feed()
            if value == 0xAAAA:
                self.fed += 1
                self.feed()
        elif self.open and not self.busy(offset):
            self.words[offset] = value
            self.busy_until[offset] = self.chip.now + 5 * self.divides() / self.OSCILLATOR
            self.chip.at(self.busy_until[offset], self.take_over)

    def divides(self):
        return 4 << (self.get(self.PRESCALER) & 7)

    def take_over(self):
        if not self.busy(self.RELOAD):
            self.reload = self.get(self.RELOAD)
        if not self.busy(self.PRESCALER):
            self.divider = self.divides()

    def feed(self):
        self.turn += 1
        turn = self.turn
        if self.runs:
            self.chip.at(self.chip.now + (self.reload + 1) * self.divider / self.OSCILLATOR, lambda: self.end(turn))

    def end(self, turn):
        if turn == self.turn:
            self.chip.restart("watchdog", 1 << 29)
