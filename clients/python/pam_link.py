"""The link to a controller, in Python alone: frames, messages, requests. The protocol is in docs/src/link.md.

    from pam_link import Controller

    with Controller("/dev/ttyACM0") as controller:      # or tcp:HOST:PORT
        print(controller.call("status"))
        controller.arm()
        controller.start("Pressure")
        controller.set_point({"Pressure": 100e3})
        for _ in range(100):
            controller.keep_alive()
            print(controller.call("status")["state"])
            time.sleep(0.05)

A message is a dictionary with the names of the fields; a variant without content is its name, one with content a dictionary of its name
and content; an absent value is None. `link.json` beside this folder holds all messages, as the controller is compiled from them. A serial
device needs the package pyserial; TCP needs nothing. Leaving the `with` block vents the muscle.
"""

import json
import random
import socket
import struct
import time
import zlib
from pathlib import Path

LINK = json.loads((Path(__file__).resolve().parent.parent / "link.json").read_text(encoding="utf-8"))
ENDPOINTS = {row["name"]: row for row in LINK["endpoints"]}
TOPICS = {row["number"]: row for row in LINK["topics"]}
REQUEST, RESPONSE, REFUSAL, TOPIC = range(4)
HELLO = 0
LONGEST_BODY = 512


class LinkError(Exception):
    """The line is broken, or what comes is not an answer of this protocol."""


class Refused(Exception):
    """The device says no; `reason` is the refusal as a message."""

    def __init__(self, request, reason):
        super().__init__(f"the device refuses {request}: {reason}")
        self.request, self.reason = request, reason


# Bodies.


def _varint(number):
    if not 0 <= number < 1 << 64:
        raise ValueError(f"{number} is not a whole number from 0 on")
    out = bytearray()
    while number > 127:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes(out + bytes([number]))


LIMITS = {"U8": 8, "U16": 16, "U32": 32, "U64": 64}


def encode(schema, value):
    """The bytes of a value."""
    kind = schema["ty"]
    name, content = (kind, None) if isinstance(kind, str) else next(iter(kind.items()))
    if name in LIMITS and not 0 <= int(value) < 1 << LIMITS[name]:
        raise ValueError(f"{value} does not fit {name}")
    if name == "Bool":
        return bytes([bool(value)])
    if name == "U8":
        return bytes([int(value)])
    if name in LIMITS:
        return _varint(int(value))
    if name in ("I8",):
        return struct.pack("<b", value)
    if name in ("I16", "I32", "I64"):
        return _varint((int(value) << 1) ^ (int(value) >> 63))
    if name == "F32":
        return struct.pack("<f", value)
    if name in ("Unit", "UnitStruct"):
        return b""
    if name == "Option":
        return b"\0" if value is None else b"\1" + encode(content, value)
    if name == "NewtypeStruct":
        return encode(content, value)
    if name == "Seq":
        return _varint(len(value)) + b"".join(encode(content, one) for one in value)
    if name in ("Tuple", "TupleStruct"):
        if len(value) != len(content):
            raise ValueError(f"{schema['name']} has {len(content)} values")
        return b"".join(encode(one, given) for one, given in zip(content, value))
    if name == "Struct":
        unknown = set(value) - {field["name"] for field in content}
        if unknown:
            raise ValueError(f"{schema['name']} has no {', '.join(sorted(unknown))}")
        return b"".join(encode(field["ty"], value[field["name"]]) for field in content)
    if name == "Enum":
        return _encode_variant(schema, content, value)
    raise ValueError(f"{name} is not used on this link")


def _encode_variant(schema, variants, value):
    chosen, inner = (value, None) if isinstance(value, str) else next(iter(value.items()))
    for number, variant in enumerate(variants):
        if variant["name"] != chosen:
            continue
        kind = variant["ty"]
        if kind == "UnitVariant":
            return _varint(number)
        form, content = next(iter(kind.items()))
        if form == "NewtypeVariant":
            return _varint(number) + encode(content, inner)
        if form == "TupleVariant":
            return _varint(number) + b"".join(encode(one, given) for one, given in zip(content, inner))
        return _varint(number) + b"".join(encode(field["ty"], inner[field["name"]]) for field in content)
    raise ValueError(f"{schema['name']} has no {chosen}")


class _Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        if self.at + count > len(self.data):
            raise LinkError("the message is too short")
        self.at += count
        return self.data[self.at - count : self.at]

    def varint(self):
        number = 0
        for shift in range(0, 70, 7):
            byte = self.take(1)[0]
            number |= (byte & 127) << shift
            if byte < 128:
                return number
        raise LinkError("a number in the message has no end")


def decode(schema, data):
    """The value of some bytes, all of which must belong to it."""
    reader = _Reader(data)
    value = _decode(schema, reader)
    if reader.at != len(data):
        raise LinkError("the message is too long")
    return value


def _decode(schema, reader):
    kind = schema["ty"]
    name, content = (kind, None) if isinstance(kind, str) else next(iter(kind.items()))
    if name == "Bool":
        return reader.take(1) != b"\0"
    if name == "U8":
        return reader.take(1)[0]
    if name in LIMITS:
        return reader.varint()
    if name == "I8":
        return struct.unpack("<b", reader.take(1))[0]
    if name in ("I16", "I32", "I64"):
        number = reader.varint()
        return number >> 1 ^ -(number & 1)
    if name == "F32":
        return struct.unpack("<f", reader.take(4))[0]
    if name in ("Unit", "UnitStruct"):
        return None
    if name == "Option":
        return _decode(content, reader) if reader.take(1) != b"\0" else None
    if name == "NewtypeStruct":
        return _decode(content, reader)
    if name == "Seq":
        return [_decode(content, reader) for _ in range(reader.varint())]
    if name in ("Tuple", "TupleStruct"):
        return [_decode(one, reader) for one in content]
    if name == "Struct":
        return {field["name"]: _decode(field["ty"], reader) for field in content}
    if name == "Enum":
        return _decode_variant(schema, content, reader)
    raise LinkError(f"{name} is not used on this link")


def _decode_variant(schema, variants, reader):
    number = reader.varint()
    if number >= len(variants):
        raise LinkError(f"{schema['name']} has no variant {number}")
    variant = variants[number]
    if variant["ty"] == "UnitVariant":
        return variant["name"]
    form, content = next(iter(variant["ty"].items()))
    if form == "NewtypeVariant":
        return {variant["name"]: _decode(content, reader)}
    if form == "TupleVariant":
        return {variant["name"]: [_decode(one, reader) for one in content]}
    return {variant["name"]: {field["name"]: _decode(field["ty"], reader) for field in content}}


# Frames.


def stuff(data):
    """COBS: no zero byte inside."""
    out, block = bytearray(), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out += bytes([len(block) + 1]) + block
            block = bytearray()
    return bytes(out + bytes([len(block) + 1]) + block)


def unstuff(data):
    """The bytes of a COBS block, or None where it is none."""
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
    """The bytes of a frame on the line."""
    raw = struct.pack("<BBH", kind, number, sequence & 0xFFFF) + body
    return stuff(raw + struct.pack("<I", zlib.crc32(raw))) + b"\0"


def unframe(data):
    """Kind, number, sequence and body of a frame without its zero; None where its checksum is wrong."""
    raw = unstuff(data)
    if raw is None or len(raw) < 8 or zlib.crc32(raw[:-4]) != struct.unpack("<I", raw[-4:])[0]:
        return None
    kind, number, sequence = struct.unpack("<BBH", raw[:4])
    return kind, number, sequence, raw[4:-4]


# Lines.


class _Tcp:
    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port), timeout=5)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, seconds):
        self.socket.settimeout(max(seconds, 1e-3))
        try:
            data = self.socket.recv(4096)
        except (socket.timeout, TimeoutError):
            return b""
        if not data:
            raise LinkError("the device has closed the connection")
        return data

    def write(self, data):
        self.socket.sendall(data)

    def close(self):
        self.socket.close()


class _Serial:
    def __init__(self, name):
        try:
            import serial
        except ImportError as error:
            raise LinkError("a serial device needs pyserial: pip install pyserial") from error
        self.port = serial.Serial(name, 1_000_000, timeout=0, write_timeout=2)

    def read(self, seconds):
        self.port.timeout = seconds
        return self.port.read(max(1, self.port.in_waiting))

    def write(self, data):
        self.port.write(data)

    def close(self):
        self.port.close()


def _line(port):
    if port.startswith("tcp:"):
        host, _, number = port[4:].rpartition(":")
        return _Tcp(host, int(number))
    return _Serial(port)


class Controller:
    """A controller that has said hello and whose messages are those of `link.json`."""

    def __init__(self, port, answer_s=0.5, tries=3):
        self.line, self.answer_s, self.tries = _line(port), answer_s, tries
        self.rest, self.topics = b"", []
        self.session = {"id": random.randrange(1 << 32)}
        self.sequence = self.session["id"]
        self.controls = False
        body = self._ask(HELLO, b"", answer_s)
        if body[:4] != b"PAM!":
            raise LinkError("what answers is not a controller")
        self.release = struct.unpack("<3H", body[4:10])
        self.link_version = struct.unpack("<H", body[10:12])[0]
        found = struct.unpack("<Q", body[16:24])[0]
        if found != int(LINK["schema_hash"], 16):
            raise LinkError(f"the device has link version {self.link_version}, this client {LINK['link_version']}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            if self.controls:
                self.call("disarm")
        finally:
            self.line.close()

    def call(self, name, request=None, wait_s=None):
        """Sends a request and gives the answer's message. Some requests write flash: give them 10 s."""
        row = ENDPOINTS[name]
        body = self._ask(row["number"], encode(row["request"], request), wait_s or self.answer_s, name)
        return decode(row["response"], body)

    def arm(self):
        """Arms for this session, which has to keep the device alive from then on."""
        self.controls = True
        return self.call("arm", self.session)

    def start(self, mode):
        """Starts a mode: Vent, Pressure, Force, Stroke or Pair."""
        return self.call("start", {"mode": mode, "session": self.session})

    def set_point(self, set_point):
        """Sends a setpoint such as {"Force": 40.0}, in SI units."""
        return self.call("set_point", {"set_point": set_point, "session": self.session})

    def reference(self, reference):
        """Starts a wave of the device, such as {"Sine": {"mean": 40.0, "amplitude": 10.0, "frequency_hz": 1.0}}."""
        return self.call("reference", {"reference": reference, "session": self.session})

    def keep_alive(self):
        """Keeps a run of this session going; at least every second."""
        return self.call("keep_alive", self.session)

    def telemetry(self, seconds, every_ticks=10):
        """Telemetry for a time, sample by sample; keeps a run of this session alive."""
        self.call("telemetry", {"every_ticks": every_ticks})
        end, alive = time.monotonic() + seconds, 0.0
        try:
            while time.monotonic() < end:
                if self.controls and time.monotonic() - alive > 0.1:
                    self.keep_alive()
                    alive = time.monotonic()
                self._take(0.02)
                yield from self._topics("telemetry")
        finally:
            self.call("telemetry", {"every_ticks": 0})

    def events(self):
        """Events that have come so far: faults and changes of state."""
        return list(self._topics("event"))

    def _topics(self, name):
        kept, found = [], []
        for number, body in self.topics:
            row = TOPICS.get(number)
            if row and row["name"] == name:
                found.append(decode(row["body"], body))
            else:
                kept.append((number, body))
        self.topics = kept[-1000:]
        return found

    def _take(self, seconds):
        """Frames that come within a time; topics are kept."""
        self.rest += self.line.read(seconds)
        *whole, self.rest = self.rest.split(b"\0")
        self.rest = self.rest[-2 * LONGEST_BODY :]
        answers = []
        for found in filter(None, map(unframe, whole)):
            if found[0] == TOPIC:
                self.topics.append((found[1], found[3]))
            else:
                answers.append(found)
        return answers

    def _ask(self, number, body, wait_s, name="hello"):
        # A request that writes flash must not be sent twice; those have a long wait.
        for _ in range(1 if wait_s > 2 else self.tries):
            self.sequence = self.sequence + 1 & 0xFFFF
            self.line.write(b"\0" + frame(REQUEST, number, self.sequence, body))
            end = time.monotonic() + wait_s
            while time.monotonic() < end:
                for kind, answered, sequence, answer in self._take(end - time.monotonic()):
                    if (answered, sequence) != (number, self.sequence):
                        continue
                    if kind == REFUSAL:
                        raise Refused(name, decode(LINK["refusal"], answer))
                    return answer
        raise LinkError(f"the device does not answer {name}")
