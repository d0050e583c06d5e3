"""A CAN bus of classic messages: its bits and arbitration, the STM32's controller (bxCAN), and the host's end.

Bits of a message: ISO 11898-1. Registers and behaviour of the controller: RM0390, chapter 30.
"""

from peripherals import Registers

TO_ALL, TO_DEVICE, FROM_DEVICE = 0x010, 0x100, 0x200
VENT = b"VENT all"
# Bits after a message until the next may begin, those of an error frame, and those of a bus at rest for a controller that joins it.
BETWEEN, ERROR_FRAME, REST = 3, 20, 11


def bits(identifier, code, data):
    """Bits of a message with those that are stuffed between, without the pause behind it."""
    # Start of frame, identifier, three bits of a standard data message, length code, data, check sum.
    stream = f"0{identifier:011b}000{code:04b}" + "".join(f"{byte:08b}" for byte in data)
    check = 0
    for bit in stream:
        check = (check << 1 ^ (0x4599 if (check >> 14 & 1) != int(bit) else 0)) & 0x7FFF
    stuffed, last, run = 0, "", 0
    for bit in stream + f"{check:015b}":
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed, last, run = stuffed + 1, "1" if bit == "0" else "0", 1
    # The end: delimiter, acknowledgement with its delimiter, end of frame.
    return len(stream) + 15 + stuffed + 10


class Bus:
    """One bus. Its time is that of the first chip; others are drawn along."""

    STEP_S = 50e-6

    def __init__(self, chip, kbit_per_s=500):
        self.chip, self.rate = chip, kbit_per_s * 1e3
        self.chips, self.hosts = [], []
        self.busy, self.free = False, 0.0
        # Called with the identifier and the data of each message: whether it reaches no one, or is destroyed by an error.
        self.is_lost = self.is_destroyed = lambda identifier, data: False
        self.log = []
        self.add(chip)

    def add(self, chip):
        self.chips.append(chip)
        chip.bus = self
        if chip is not self.chip:
            self.draw_along()

    def draw_along(self):
        """The other chips live until now."""
        for chip in self.chips[1:]:
            if chip.now < self.chip.now:
                chip.run(self.chip.now - chip.now)
        self.chip.at(self.chip.now + self.STEP_S, self.draw_along)

    def restarted(self, chip):
        """What a chip had planned is forgotten."""
        if chip is self.chip:
            self.busy, self.free = False, chip.now
            if len(self.chips) > 1:
                self.draw_along()
            self.request()

    def nodes(self):
        return [chip.can for chip in self.chips if chip.can.takes_part()] + self.hosts

    def request(self):
        """Someone has a message to send."""
        if not self.busy:
            self.busy = True
            self.chip.at(max(self.chip.now, self.free), self.arbitrate)

    def arbitrate(self):
        waiting = [(node.next()[0], number, node) for number, node in enumerate(self.nodes()) if node.next()]
        if not waiting:
            self.busy = False
            return
        node = min(waiting, key=lambda one: one[:2])[2]
        identifier, code, data = node.next()
        node.begun()
        end = self.chip.now + bits(identifier, code, data) / self.rate
        self.chip.at(end, lambda: self.end(node, identifier, code, data))

    def end(self, node, identifier, code, data):
        others = [one for one in self.nodes() if one is not node]
        pause = BETWEEN
        if node not in self.nodes():
            pass
        elif not others:
            node.failed(acknowledged=False)
            pause += ERROR_FRAME
        elif self.is_destroyed(identifier, data) or not all(one.follows(self.rate) for one in (node, *others)):
            node.failed(acknowledged=True)
            pause += ERROR_FRAME
        else:
            self.log.append((self.chip.now, identifier, bytes(data)))
            node.went()
            if not self.is_lost(identifier, data):
                for one in others:
                    one.receive(identifier, code, bytes(data))
        self.free = self.chip.now + pause / self.rate
        self.chip.at(self.free, self.arbitrate)


class Can(Registers):
    """bxCAN 1 of a chip. A mailbox that is not empty and a filter that is in force are not to be written."""

    TX, RX0, RX1, SCE = 19, 20, 21, 22

    def __init__(self, chip):
        super().__init__(chip)
        self.words.update({0x00: 0x00010002, 0x1C: 0x01230000, 0x200: 0x2A1C0E01})
        self.initialised, self.asleep, self.joins = False, True, 0
        self.errors, self.bus_off, self.code = 0, False, 0
        self.error_reported = False
        self.fifos, self.overrun = ([], []), [False, False]
        # Mailboxes with a request, in its order; those that are done; that which is on the bus; those to be given up.
        self.order, self.done, self.sending, self.unwanted = [], {}, None, set()
        self.reports = 0

    # The bus.

    def takes_part(self):
        return not (self.initialised or self.asleep or self.bus_off) and self.is_wired()

    def is_wired(self):
        """Whether PA11 and PA12 are the controller's (alternate function 9)."""
        port = self.chip.porta
        return port.get(0x00) >> 22 & 0b1111 == 0b1010 and port.get(0x24) >> 12 & 0xFF == 0x99

    def bit_rate(self):
        timing = self.get(0x1C)
        parts = 3 + (timing >> 16 & 15) + (timing >> 20 & 7)
        return self.chip.rcc.apb1() / ((timing & 0x3FF) + 1) / parts

    def sample_point(self):
        timing = self.get(0x1C)
        return (2 + (timing >> 16 & 15)) / (3 + (timing >> 16 & 15) + (timing >> 20 & 7))

    def follows(self, rate):
        return abs(self.bit_rate() / rate - 1) < 0.005

    def next(self):
        """The message of the mailbox that is sent first: in the order of the requests (TXFP)."""
        if not self.order:
            return None
        base = 0x180 + 0x10 * self.order[0]
        identifier, length = self.get(base), self.get(base + 4) & 15
        assert self.get(0x00) >> 2 & 1 and not identifier & 0b110, "messages of one identifier in the order of their requests"
        data = self.get(base + 8).to_bytes(4, "little") + self.get(base + 12).to_bytes(4, "little")
        return identifier >> 21, length, data[: min(8, length)]

    def begun(self):
        self.sending = self.order[0]

    def went(self):
        self.finish(self.order[0], ok=True)
        self.errors = max(0, self.errors - 1)
        self.sending = None

    def failed(self, acknowledged):
        """An error: counted, but for a missing acknowledgement of a controller that is error-passive."""
        if acknowledged or self.errors < 128:
            self.errors += 8
        self.code = 1 if acknowledged else 3
        number, self.sending = self.sending, None
        if number in self.unwanted:
            self.finish(number, ok=False)
        if self.errors > 255:
            self.bus_off = True
            self.tell(1 << 10)
            if self.get(0x00) >> 6 & 1:
                rate = self.chip.bus.rate
                self.chip.at(self.chip.now + 128 * REST / rate, self.recover)

    def recover(self):
        self.errors, self.bus_off = 0, False
        self.chip.bus.request()

    def tell(self, enable):
        if self.get(0x14) & enable:
            self.error_reported = True

    def finish(self, number, ok):
        self.order.remove(number)
        self.unwanted.discard(number)
        self.done[number] = ok

    def receive(self, identifier, code, data):
        word = identifier << 21
        active = self.get(0x21C)
        if self.get(0x200) & 1:
            return
        for bank in range(28):
            if not active >> bank & 1:
                continue
            assert self.get(0x20C) >> bank & 1 and not self.get(0x204) >> bank & 1, "a mask of 32 bits"
            value, mask = self.get(0x240 + 8 * bank), self.get(0x244 + 8 * bank)
            if (word ^ value) & mask & ~1:
                continue
            fifo = self.get(0x214) >> bank & 1
            if len(self.fifos[fifo]) < 3:
                self.fifos[fifo].append((word, code, bytes(data)))
            else:
                self.overrun[fifo] = True
                if not self.get(0x00) >> 3 & 1:
                    self.fifos[fifo][2] = (word, code, bytes(data))
            return

    # Registers.

    def read(self, offset):
        if offset == 0x04:
            return int(self.initialised) | int(self.asleep) << 1 | int(self.error_reported) << 2 | 0xC00
        if offset == 0x08:
            free = [number for number in range(3) if number not in self.order]
            value = sum((1 | int(ok) << 1) << 8 * number for number, ok in self.done.items())
            return value | (free[0] if free else 0) << 24 | sum(1 << 26 + number for number in free)
        if offset in (0x0C, 0x10):
            fifo = offset // 4 - 3
            count = len(self.fifos[fifo])
            return count | int(count == 3) << 3 | int(self.overrun[fifo]) << 4
        if offset == 0x18:
            errors = min(255, self.errors)
            flags = int(errors >= 96) | int(errors > 127) << 1 | int(self.bus_off) << 2
            return flags | self.code << 4 | errors << 16
        if 0x1B0 <= offset < 0x1D0:
            fifo, register = divmod(offset - 0x1B0, 0x10)
            word, code, data = self.fifos[fifo][0] if self.fifos[fifo] else (0, 0, b"")
            data = data.ljust(8, b"\xa5")
            return (word, code, int.from_bytes(data[:4], "little"), int.from_bytes(data[4:], "little"))[register // 4]
        return self.get(offset)

    def write(self, offset, value):
        assert self.chip.rcc.get(0x40) >> 25 & 1, "the controller's clock is on"
        if offset == 0x00:
            self.control(value)
        elif offset == 0x04:
            self.error_reported &= not value >> 2 & 1
        elif offset == 0x08:
            for number in range(3):
                if value >> 8 * number & 1:
                    self.done.pop(number, None)
                if value >> 8 * number & 0x80 and number in self.order:
                    self.give_up(number)
        elif offset in (0x0C, 0x10):
            fifo = offset // 4 - 3
            self.overrun[fifo] &= not value >> 4 & 1
            if value >> 5 & 1 and self.fifos[fifo]:
                self.fifos[fifo].pop(0)
        elif 0x180 <= offset < 0x1B0:
            self.mailbox(offset, value)
        else:
            self.check(offset, value)
            self.words[offset] = value

    def check(self, offset, value):
        """What is only to be written in its own mode."""
        if offset == 0x1C:
            assert self.initialised, "the bit timing is written while the controller is initialised"
        if offset in (0x204, 0x20C, 0x214):
            assert self.get(0x200) & 1, "filters are set up while FINIT is set"
        if offset >= 0x240:
            assert self.get(0x200) & 1 or not self.get(0x21C) >> (offset - 0x240) // 8 & 1, "a filter in force is not written"

    def control(self, value):
        assert not value >> 15 & 1
        self.words[0x00] = value
        self.joins += 1
        if value & 1:
            self.initialised, self.asleep = True, False
        elif value & 2:
            self.asleep = True
        elif self.initialised or self.asleep:
            turn = self.joins
            self.chip.at(self.chip.now + REST / self.bit_rate(), lambda: self.join(turn))

    def join(self, turn):
        if turn == self.joins:
            self.initialised = self.asleep = False
            if self.chip.bus:
                self.chip.bus.request()

    def mailbox(self, offset, value):
        number, register = divmod(offset - 0x180, 0x10)
        assert number not in self.order, "the mailbox is empty"
        self.words[offset] = value & ~1 if register == 0 else value
        if register == 0 and value & 1:
            self.done.pop(number, None)
            self.order.append(number)
            if self.chip.bus:
                self.chip.bus.request()

    def give_up(self, number):
        """At once, or after the attempt that is on the bus."""
        if number == self.sending:
            self.unwanted.add(number)
        else:
            self.finish(number, ok=False)

    def waiting(self):
        """Interrupts that are asked for: as long as their cause is there."""
        enabled = self.get(0x14)
        if enabled & 1 and self.done:
            yield self.TX
        for fifo, line in ((0, self.RX0), (1, self.RX1)):
            if enabled >> 1 + 3 * fifo & 1 and self.fifos[fifo]:
                yield line
        if enabled >> 15 & 1 and self.error_reported:
            yield self.SCE


class Host:
    """The host's end of a bus: its controller, and a line to each device."""

    def __init__(self, bus):
        self.bus, self.queue, self.heard = bus, [], {}
        bus.hosts.append(self)

    def follows(self, rate):
        return rate == self.bus.rate

    def next(self):
        return self.queue[0] if self.queue else None

    def begun(self):
        self.current = self.queue[0]

    def went(self):
        self.queue.remove(self.current)

    def failed(self, acknowledged):
        pass

    def send(self, identifier, data, code=None):
        """Sends a message; one to all goes first."""
        message = (identifier, len(data) if code is None else code, bytes(data))
        self.queue.insert(0 if identifier == TO_ALL else len(self.queue), message)
        self.bus.request()

    def receive(self, identifier, _code, data):
        address = identifier - FROM_DEVICE
        if address in self.heard:
            self.heard[address].take(data)

    def line(self, address):
        self.heard[address] = HostLine(self, address)
        return self.heard[address]


class HostLine:
    """The bytes of the link to and from one device; byte 0 of a message is its number."""

    def __init__(self, host, address):
        self.host, self.address = host, address
        self.sent, self.number, self.expected, self.gaps = bytearray(), 0, None, 0

    def send(self, data):
        for at in range(0, len(data), 7):
            self.host.send(TO_DEVICE + self.address, bytes([self.number]) + data[at : at + 7])
            self.number = (self.number + 1) % 256

    def take(self, message):
        number = message[0]
        if self.expected is not None and number != self.expected:
            self.gaps += 1
            self.sent.append(0)
        self.expected = (number + 1) % 256
        self.sent += message[1:]
