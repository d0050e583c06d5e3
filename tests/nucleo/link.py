"""The host's end of the link: frames as docs/src/link.md has them, and the few messages that the tests need."""

import struct
import zlib

HELLO, INFO, STATUS, ARM, START, STOP, DISARM, SET_POINT = 0, 1, 2, 3, 4, 5, 6, 7
FAULTS, CLEAR_FAULT, SETTINGS, SET_SETTINGS = 11, 13, 14, 15
TABLE_BEGIN, TABLE_PIECE, TABLE_COMMIT, TABLE_READ, RESTART, KEEP_ALIVE = 16, 17, 18, 19, 26, 27
SIGNALS = 29
REQUEST, RESPONSE, REFUSAL = 0, 1, 2
STATES = ("disarmed", "armed", "running", "fault")
PRESSURE_MODE, FORCE_MODE = 1, 2
# The session of these tests, and the time between its keep-alive requests.
SESSION, HEARTBEAT_S = 300, 0.1
FAULT_NAMES = (
    "sensor-range sensor-stuck sensor-noisy sensors-disagree sensors-silent pressure-not-rising pressure-not-falling over-pressure "
    "over-stroke over-speed over-force set-point-silence loop-overrun table-missing table-invalid brown-out watchdog not-a-number "
    "host-silence settings-invalid not-vented hold-ended clock-failed valve-test pressure-sensors-disagree supply-pressure-low enable-open"
).split()


def stuffed(data):
    """COBS: no zero byte inside."""
    out, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out += bytes([len(block) + 1]) + block
            block = bytearray()
    return bytes(out + bytes([len(block) + 1]) + block)


def unstuffed(data):
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        if code == 0 or at + code > len(data):
            return None
        out += data[at + 1 : at + code]
        at += code
        if code < 255 and at < len(data):
            out.append(0)
    return bytes(out)


def frame(kind, number, sequence, body=b""):
    raw = struct.pack("<BBH", kind, number, sequence & 0xFFFF) + body
    return stuffed(raw + struct.pack("<I", zlib.crc32(raw))) + b"\0"


# Places of settings from the end of the message; a varint before them has one byte.
CAN = 3
VALVES = 29 + CAN
SETTING = {
    "command.low": -8 - VALVES, "command.full_pa": -4 - VALVES,
    "scales.pressure.at_zero": -68 - VALVES, "scales.pressure.per_unit": -64 - VALVES, "scales.pressure.filter_s": -60 - VALVES,
    "scales.second_pressure.at_zero": -32 - VALVES, "scales.second_pressure.per_unit": -28 - VALVES,
    "watch.second_pressure_pa": -86 - VALVES, "watch.supply_low_pa": -82 - VALVES,
    "valves.supply_pa": -28 - CAN, "valves.fill_pa_per_s": -24 - CAN, "valves.vent_pa_per_s": -20 - CAN, "valves.dead_s": -16 - CAN,
    "valves.least_s": -12 - CAN, "valves.apart_s": -8 - CAN, "valves.band_pa": -4 - CAN,
}
# Those of one byte.
BYTES = {"enable_input": -78 - VALVES, "valves__period_ticks": -VALVES, "can__address": -CAN}


def varint(number):
    out = bytearray()
    while number > 127:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes(out + bytes([number]))


class Reader:
    """Reads postcard's bytes."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def float(self):
        self.at += 4
        return struct.unpack("<f", self.data[self.at - 4 : self.at])[0]

    def varint(self):
        number, shift = 0, 0
        while True:
            byte = self.byte()
            number |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return number


class Refused(Exception):
    """The device says no."""


class SerialLine:
    """The chip's serial line; it is new after each restart."""

    def __init__(self, chip):
        self.chip = chip

    @property
    def sent(self):
        return self.chip.uart2.sent

    def send(self, data):
        self.chip.uart2.send(data)


class Link:
    """One request at a time over a line of a chip."""

    def __init__(self, chip, line=None):
        self.chip, self.sequence, self.read = chip, 0, 0
        self.line, self.sent = line or SerialLine(chip), None
        self.controls, self.kept_alive = False, 0.0

    def frames(self):
        if self.sent is not self.line.sent:
            self.sent, self.read = self.line.sent, 0
        *whole, rest = bytes(self.sent[self.read :]).split(b"\0")
        self.read = len(self.sent) - len(rest)
        for data in whole:
            raw = unstuffed(data)
            if raw and len(raw) >= 8 and zlib.crc32(raw[:-4]) == struct.unpack("<I", raw[-4:])[0]:
                yield raw[0], raw[1], struct.unpack("<H", raw[2:4])[0], raw[4:-4]

    def ask(self, number, body=b"", wait=0.05):
        """The answer's body, or none."""
        self.keep_alive()
        self.sequence += 1
        found = []

        def answered():
            found.extend(one for one in self.frames() if one[1:3] == (number, self.sequence & 0xFFFF))
            return bool(found)

        self.line.send(frame(REQUEST, number, self.sequence, body))
        end, restarts = self.chip.now + wait, len(self.chip.restarts)
        # A chip that restarts does not answer.
        while self.chip.now < end and not answered() and len(self.chip.restarts) == restarts:
            self.chip.run(0.0005)
        if not found:
            return None
        if found[0][0] == REFUSAL:
            raise Refused(found[0][3])
        return found[0][3]

    def keep_alive(self):
        """Keeps a run going, without waiting for the answer."""
        if self.controls and self.chip.now - self.kept_alive > HEARTBEAT_S:
            self.kept_alive = self.chip.now
            self.sequence += 1
            self.line.send(frame(REQUEST, KEEP_ALIVE, self.sequence, varint(SESSION)))

    def arm(self):
        self.ask(ARM, varint(SESSION))
        self.controls = True

    def start(self, mode):
        return self.ask(START, bytes([mode]) + varint(SESSION))

    def status(self):
        reader = Reader(self.ask(STATUS))
        state, mode = STATES[reader.byte()], reader.byte()
        fault = FAULT_NAMES[reader.byte()] if reader.byte() else None
        names = "time_us ticks overruns frames_good frames_bad dropped saturated line_errors bus_offs".split()
        return {"state": state, "mode": mode, "fault": fault} | {name: reader.varint() for name in names}

    def change(self, **values):
        """Sends the settings with others of these values; names have `__` for each dot."""
        settings = bytearray(self.ask(SETTINGS))
        for name, value in values.items():
            if name in BYTES:
                settings[BYTES[name]] = int(value)
            else:
                at = len(settings) + SETTING[name.replace("__", ".")]
                settings[at : at + 4] = struct.pack("<f", value)
        self.ask(SET_SETTINGS, bytes(settings), wait=5.0)

    def signals(self):
        """Means of the signals of the first muscle: ticks, volts, and whether the enable input is closed."""
        reader = Reader(self.ask(SIGNALS, b"\0"))
        ticks = reader.varint()
        volts = [reader.float() for _ in range(3)]
        volts += [reader.float() if reader.byte() else None for _ in range(2)]
        return ticks, volts, bool(reader.byte())

    def hello(self):
        return self.ask(HELLO)

    def upload(self, image):
        """Sends a table's image; its sum is taken over its end and then the rest."""
        check = zlib.crc32(image[-4:] + image[:-4])
        self.ask(TABLE_BEGIN, b"\0" + varint(len(image)) + varint(check))
        for at in range(0, len(image), 64):
            piece = image[at : at + 64]
            self.ask(TABLE_PIECE, varint(at) + varint(len(piece)) + piece)
        return self.ask(TABLE_COMMIT, wait=5.0)

    def set_point(self, kind, value):
        return self.ask(SET_POINT, bytes([kind]) + struct.pack("<f", value) + varint(SESSION))
