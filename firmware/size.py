"""Prints how much flash and static RAM an ELF image takes, from its section headers."""

import struct
import sys

with open(sys.argv[1], "rb") as file:
    elf = file.read()
if elf[:6] != b"\x7fELF\x01\x01":
    sys.exit(f"{sys.argv[1]}: not a 32-bit little-endian ELF file")
table, = struct.unpack_from("<I", elf, 0x20)
size, count = struct.unpack_from("<HH", elf, 0x2E)
flash = ram = 0
for n in range(count):
    _, kind, flags, _, _, length = struct.unpack_from("<6I", elf, table + n * size)
    allocated, written, bare = flags & 2, flags & 1, kind == 8
    if allocated and not bare:
        flash += length
    if allocated and written:
        ram += length
print(f"{sys.argv[1]}: flash {flash} bytes ({flash / 1024:.1f} KiB), RAM {ram} bytes ({ram / 1024:.1f} KiB, without the stack)")
