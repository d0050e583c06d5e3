"""Firmware for the other slot: packed and signed as `host update` does it, and sent over the link."""

import hashlib
import struct
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from elftools.elf.elffile import ELFFile

from link import Reader, varint

ROOT = Path(__file__).resolve().parents[2]
# Of `--test-key` in firmware/build.
KEY = Ed25519PrivateKey.from_private_bytes(bytes([7] * 32))
OTHER_KEY = Ed25519PrivateKey.from_private_bytes(bytes([8] * 32))
NUCLEO = 2
SLOTS = (0x08010000, 0x08040000)
PROGRAM = 0x200
UPDATE, BEGIN, PIECE, COMMIT, CONFIRM, REVERT = 31, 32, 33, 34, 35, 36


def program_of(image, slot):
    """The bytes of an ELF file from the program's place in its slot on."""
    start, found = SLOTS[slot] + PROGRAM, bytearray()
    with open(image, "rb") as file:
        for segment in ELFFile(file).iter_segments():
            place = segment["p_paddr"] - start
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"] and place >= 0:
                found.extend(b"\xff" * (place + segment["p_filesz"] - len(found)))
                found[place : place + segment["p_filesz"]] = segment.data()
    return bytes(found)


def header(program, slot, release=(9, 8, 7), board=NUCLEO, key=KEY):
    signed = struct.pack(
        "<4sHBBIHHHHI", b"PAMF", 1, board, slot, len(program), *release, 0, SLOTS[slot] + PROGRAM
    ) + hashlib.sha512(program).digest()
    return signed + key.sign(signed)


def begin(link, head):
    return link.ask(BEGIN, varint(len(head)) + head, wait=2.0)


def install(board, program, head):
    """Sends a program; gives what the last answer says. An answer that does not come is that of a chip without power."""
    link = board.link
    answer = begin(link, head)
    for at in range(0, len(program), 256):
        if answer is None:
            return None
        piece = program[at : at + 256]
        answer = link.ask(PIECE, varint(at) + varint(len(piece)) + piece, wait=5.0)
    return None if answer is None else link.ask(COMMIT, wait=2.0)


def status(board):
    """The slot that runs and what is in both: release, whether it is confirmed."""
    reader = Reader(board.link.ask(UPDATE))
    running = reader.byte()
    reader.varint(), reader.varint(), reader.varint()
    slots = []
    for _ in range(2):
        if not reader.byte():
            slots.append(None)
            continue
        release = tuple(reader.varint() for _ in range(3))
        reader.varint(), reader.varint(), reader.varint()
        slots.append((release, bool(reader.byte())))
    return running, slots
