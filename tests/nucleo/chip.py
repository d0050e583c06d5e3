"""The STM32F446RE: processor (Unicorn, QEMU's kernel of a CPU), memory, interrupts, time.

Time goes by so many cycles for each instruction, in slices of some instructions: an interrupt comes at most a slice late. Where none
waits for a critical section to end, slices are longer. The processor's own peripherals are those of the programming manual PM0214.
"""

import heapq
import itertools
import struct

from elftools.elf.elffile import ELFFile
from unicorn import (
    UC_ARCH_ARM, UC_HOOK_CODE, UC_HOOK_MEM_UNMAPPED, UC_HOOK_MEM_WRITE, UC_MEM_FETCH_UNMAPPED, UC_MODE_MCLASS,
    UC_MODE_THUMB, Uc, UcError,
)
from unicorn.arm_const import (
    UC_ARM_REG_BASEPRI, UC_ARM_REG_LR, UC_ARM_REG_PC, UC_ARM_REG_PRIMASK, UC_ARM_REG_SP, UC_CPU_ARM_CORTEX_M4,
)

import can_bus
import peripherals
import valve_timer

FLASH, FLASH_SIZE = 0x08000000, 0x80000
RAM, RAM_SIZE = 0x20000000, 0x20000
SYSTEM, SYSTEM_SIZE = 0x1FFF0000, 0x10000
SLEEPS = (b"\x20\xbf", b"\x30\xbf")
RETURN = 0xFFFFFFF9
# Instructions of a slice.
SHORT, LONG = 32, 256
NMI, HARD_FAULT = -14, -13


class Chip:
    """A board: its flash and RAM outlive restarts, everything else restarts with each."""

    def __init__(self, image, cycles=1.0):
        self.cycles = cycles
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        self.uc.mem_map(FLASH, FLASH_SIZE)
        self.uc.mem_write(FLASH, b"\xff" * FLASH_SIZE)
        self.uc.mem_map(RAM, RAM_SIZE)
        self.uc.mem_map(SYSTEM, SYSTEM_SIZE)
        self.uc.mem_write(0x1FFF7A10, bytes(range(12)))
        self.uc.mem_write(0x1FFF7A22, struct.pack("<H", 512))
        with open(image, "rb") as file:
            elf = ELFFile(file)
            for segment in elf.iter_segments():
                if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                    self.uc.mem_write(segment["p_paddr"], segment.data())
            symbols = list(elf.get_section_by_name(".symtab").iter_symbols())
        self.symbols = {symbol.name: symbol["st_value"] for symbol in symbols}
        self.functions = sorted(
            (symbol["st_value"] & ~1, symbol.name) for symbol in symbols if symbol["st_info"]["type"] == "STT_FUNC"
        )
        self.uc.mmio_map(0x40000000, 0x80000, self._read, 0x40000000, self._write, 0x40000000)
        self.uc.mmio_map(0xE0000000, 0x100000, self._read, 0xE0000000, self._write, 0xE0000000)
        self.uc.hook_add(UC_HOOK_MEM_UNMAPPED, self._unmapped)
        self.uc.hook_add(UC_HOOK_MEM_WRITE, self._flash_written, None, FLASH, FLASH + FLASH_SIZE - 1)
        # What stays through a restart.
        self.now, self.instructions = 0.0, 0
        self.crystal_dead, self.erase_s = False, 1.0
        self.restarts, self.erased = [], []
        # Words that the flash still programs before power fails; none for all.
        self.words_left, self.words_written = None, 0
        self.outputs = []
        # Fill and vent valve of a pair: since when, and whether each signal says open.
        self.valves = []
        self.reset_flags = 1 << 27 | 1 << 26
        # The CAN bus that the chip is connected to.
        self.bus = None
        self._begin()

    def _begin(self):
        self.events, self._order = [], itertools.count()
        self.pending, self.enabled, self.priorities = set(), set(), {}
        self.active, self.contexts = [], []
        self.event, self.locked, self._returns, self._restart = False, False, False, None
        self.words = {}
        self.rcc = peripherals.Rcc(self)
        self.power, self.exti = peripherals.Power(self), peripherals.Exti(self)
        self.flash = peripherals.Flash(self)
        self.uart2, self.adc = peripherals.Uart(self), peripherals.Adc(self)
        self.dac = peripherals.Dac(self)
        self.porta, self.portb, self.portc = (peripherals.Gpio(self) for _ in range(3))
        self.dma1, self.dma2 = peripherals.Dma(self, {6: 17}), peripherals.Dma(self, {})
        self.tim3 = peripherals.Timer(self, 29, 16, self.adc.trigger)
        self.tim5 = peripherals.Timer(self, 50, 32)
        self.tim4 = valve_timer.ValveTimer(self)
        self.watchdog = peripherals.Watchdog(self)
        self.can = can_bus.Can(self)
        self.blocks = {
            0x40000400: self.tim3, 0x40000800: self.tim4, 0x40000C00: self.tim5, 0x40003000: self.watchdog, 0x40004400: self.uart2,
            0x40006400: self.can, 0x40007000: self.power, 0x40007400: self.dac, 0x40012000: self.adc, 0x40013C00: self.exti,
            0x40020000: self.porta, 0x40020400: self.portb, 0x40020800: self.portc, 0x40023800: self.rcc, 0x40023C00: self.flash,
            0x40026000: self.dma1, 0x40026400: self.dma2,
        }
        self.hz = self.rcc.hclk()
        stack, reset = struct.unpack("<II", self.uc.mem_read(FLASH, 8))
        self.uc.reg_write(UC_ARM_REG_PRIMASK, 0)
        self.uc.reg_write(UC_ARM_REG_BASEPRI, 0)
        self.uc.reg_write(UC_ARM_REG_SP, stack)
        self.uc.reg_write(UC_ARM_REG_LR, 0xFFFFFFFF)
        self.uc.reg_write(UC_ARM_REG_PC, reset | 1)
        self.note_outputs()

    # Time.

    def at(self, when, act):
        """Calls `act` at a time."""
        heapq.heappush(self.events, (when, next(self._order), act))

    def stall(self, seconds):
        """The processor does not move; everything else continues."""
        end = self.now + seconds
        while self.events and self.events[0][0] <= end and not self._restart:
            when, _, act = heapq.heappop(self.events)
            self.now = max(self.now, when)
            act()
        self.now = max(self.now, end)

    def _due(self):
        while self.events and self.events[0][0] <= self.now and not self._restart:
            heapq.heappop(self.events)[2]()

    def restart(self, why, flags):
        """The chip is reset; it restarts before the next instruction."""
        self._restart = (why, flags)
        self.uc.emu_stop()

    # Outputs.

    def note_outputs(self):
        """Notes what acts on the muscle: the dump valve and the regulator's command."""
        if not hasattr(self, "dac") or not hasattr(self, "portb"):
            return
        if hasattr(self, "tim4"):
            signals = (self._is_high(8, valve_timer.FILL_CHANNEL), not self._is_high(9, valve_timer.VENT_CHANNEL))
            if not self.valves or self.valves[-1][1:] != signals:
                self.valves.append((self.now, *signals))
        now = (not self.portb.drives_high(5), self.dac.volts())
        if not self.outputs or self.outputs[-1][1:] != now:
            self.outputs.append((self.now, *now))

    def _is_high(self, pin, channel):
        """Whether a pin of port B is high that its timer may drive; one that nothing drives is low by its resistor."""
        if self.portb.get(0x00) >> 2 * pin & 3 == 2:
            assert self.portb.get(0x24) >> 4 * (pin - 8) & 15 == 2, "TIM4 is alternate function 2"
            return self.tim4.is_high(channel)
        return self.portb.drives_high(pin)

    def valves_at(self, when):
        """Signals to the fill and the vent valve at a time that has passed: whether each says open."""
        return next((change[1:] for change in reversed(self.valves) if change[0] <= when), (False, True))

    @property
    def valve_open(self):
        return self.outputs[-1][1]

    @property
    def command_volts(self):
        return self.outputs[-1][2]

    # Memory.

    def _read(self, _uc, offset, size, base):
        address = base + offset
        value = self._word(address & ~3)
        return value >> 8 * (address & 3) & (1 << 8 * size) - 1

    def _word(self, address):
        block = self.blocks.get(address & ~0x3FF)
        if block:
            return block.read(address & 0x3FF) & 0xFFFFFFFF
        if 0xE000E100 <= address < 0xE000E120:
            first = (address - 0xE000E100) * 8
            return sum(1 << n for n in range(32) if first + n in self.enabled)
        return 0x410FC241 if address == 0xE000ED00 else self.words.get(address, 0)

    def _write(self, _uc, offset, size, value, base):
        address = base + offset
        if 0xE000E400 <= address < 0xE000E500:
            for n in range(size):
                # Of eight bits this chip has the upper four.
                self.priorities[address - 0xE000E400 + n] = value >> 8 * n & 0xF0
            return
        block = self.blocks.get(address & ~0x3FF)
        if block:
            if size < 4:
                shift, mask = 8 * (address & 3), (1 << 8 * size) - 1
                value = block.read(address & 0x3FC) & ~(mask << shift) | value << shift
            block.write(address & 0x3FC, value)
            self.hz = self.rcc.hclk()
            return
        for start, group, add in (
            (0xE000E100, self.enabled, True), (0xE000E180, self.enabled, False),
            (0xE000E200, self.pending, True), (0xE000E280, self.pending, False),
        ):
            if start <= address < start + 0x20:
                lines = {(address - start) * 8 + n for n in range(32) if value >> n & 1}
                group.update(lines) if add else group.difference_update(lines)
                return
        if address == 0xE000EF00:
            self.pending.add(value & 511)
        elif address == 0xE000ED0C and value & 4:
            self.restart("request", 1 << 28)
        else:
            self.words[address] = value

    def _flash_written(self, _uc, _access, address, size, value, _data):
        self.flash.store(address, size, value & (1 << 8 * size) - 1)

    def _unmapped(self, _uc, access, address, _size, _value, _data):
        if access == UC_MEM_FETCH_UNMAPPED and address >= 0xFFFFFF00:
            self._returns = True
        return False

    # Interrupts.

    def pend(self, line):
        self.pending.add(line)

    def _lines(self):
        for timer in (self.tim3, self.tim5):
            if timer.waits():
                self.pending.add(timer.irq)
        if self.uart2.waits():
            self.pending.add(peripherals.Uart.IRQ)
        self.pending.update(self.dma1.waiting())
        # A handler is called again only if its cause is still there at its end.
        self.pending.update(line for line in self.can.waiting() if line not in self.active)

    def _urgency(self, line):
        return line + 12 if line < 0 else self.priorities.get(line, 0)

    def _next(self):
        """The interrupt that is taken now, if there is one."""
        self._lines()
        ready = [line for line in self.pending if line < 0 or line in self.enabled]
        if not ready:
            return None
        line = min(ready, key=lambda line: (self._urgency(line), line))
        urgency = self._urgency(line)
        if urgency >= 0:
            base = self.uc.reg_read(UC_ARM_REG_BASEPRI)
            if self.uc.reg_read(UC_ARM_REG_PRIMASK) & 1 or base and urgency >= base:
                return None
        if self.active and urgency >= self._urgency(self.active[-1]):
            return None
        return line

    def _enter(self, line):
        stack = self.uc.reg_read(UC_ARM_REG_SP) - 0x68 & ~7
        if not RAM <= stack < RAM + RAM_SIZE:
            self.locked = True
            return
        self.pending.discard(line)
        self.contexts.append(self.uc.context_save())
        self.active.append(line)
        self.uc.reg_write(UC_ARM_REG_SP, stack)
        self.uc.reg_write(UC_ARM_REG_LR, RETURN)
        # The vector table is where VTOR says: the boot loader has set it.
        table = self.words.get(0xE000ED08, 0) or FLASH
        handler = struct.unpack("<I", self.uc.mem_read(table + 4 * (16 + line), 4))[0]
        self.uc.reg_write(UC_ARM_REG_PC, handler | 1)
        self.now += 12 / self.hz

    def _leave(self):
        self.active.pop()
        self.uc.context_restore(self.contexts.pop())
        pc = self.uc.reg_read(UC_ARM_REG_PC)
        self.uc.reg_write(UC_ARM_REG_PC, pc | 1)
        self.event = True
        self.now += 12 / self.hz

    # Execution.

    def run(self, seconds, until=None):
        """Lets time pass, or until something is so."""
        end = self.now + seconds
        while self.now < end:
            self._due()
            if self._restart:
                why, flags = self._restart
                self.restarts.append((why, self.now))
                self.reset_flags |= flags
                self._begin()
                if self.bus:
                    self.bus.restarted(self)
                continue
            if until and until():
                return True
            if self.locked:
                self.stall(min(end, self.events[0][0] if self.events else end) - self.now)
                continue
            line = self._next()
            if line is not None:
                self._enter(line)
                continue
            self._slice(end)
        return False

    def _slice(self, end):
        uc = self.uc
        pc = uc.reg_read(UC_ARM_REG_PC) & ~1
        if bytes(uc.mem_read(pc, 2)) in SLEEPS:
            if not self.event:
                self.now = max(self.now + 1e-8, min(self.events[0][0] if self.events else end, end))
            self.event = False
            uc.reg_write(UC_ARM_REG_PC, pc + 2 | 1)
            return
        self._returns, self._short = False, False
        ahead = (self.events[0][0] - self.now if self.events else 1.0) * self.hz / self.cycles
        count = SHORT if self.pending & self.enabled else max(SHORT, min(LONG, int(ahead)))
        try:
            uc.emu_start(pc | 1, 0xFFFFFFFE, count=count)
        except UcError:
            self._stopped()
        self.flash.settle()
        count = SHORT if self._short else count
        self.now += count * self.cycles / self.hz
        self.instructions += count
        if self.active and uc.reg_read(UC_ARM_REG_PC) >= 0xFFFFFF00:
            self._leave()

    def end_slice(self):
        """Ends a slice within a read, which is then read again: an interrupt that waits is taken first."""
        self._short = True
        self.uc.emu_stop()

    def _stopped(self):
        """Unicorn stopped without a request: asleep, back from an interrupt, or somewhere without memory."""
        pc = self.uc.reg_read(UC_ARM_REG_PC) & ~1
        if self.active and (self._returns or pc >= 0xFFFFFF00):
            return
        if pc < 0xE0000000:
            try:
                if bytes(self.uc.mem_read(pc - 2, 2)) in SLEEPS:
                    self.uc.reg_write(UC_ARM_REG_PC, pc - 2 | 1)
                    return
            except UcError:
                pass
        if self.active and self.active[-1] in (NMI, HARD_FAULT):
            self.locked = True
        else:
            self._enter(HARD_FAULT)

    # Counting.

    def count(self, seconds):
        """Instructions of each interrupt and function over a time, by (interrupt, address); interrupt 0 is the main program."""
        counts = {}

        def step(_uc, address, _size, _data):
            key = (self.active[-1] if self.active else 0, address)
            counts[key] = counts.get(key, 0) + 1

        hook = self.uc.hook_add(UC_HOOK_CODE, step)
        self.uc.ctl_flush_tb()
        self.run(seconds)
        self.uc.hook_del(hook)
        self.uc.ctl_flush_tb()
        return counts
