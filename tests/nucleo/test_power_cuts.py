"""Power that fails while the Nucleo programs its flash: after the restart the old table or the new one is there, whole.

    bash tests/nucleo/run.sh test_power_cuts

`PAM_LONG=1` lets it fail in every word of the commit; otherwise in every ninth.
"""

import os
import struct
import unittest
import zlib

from board import TABLE, Board
from link import TABLE_READ, Reader, varint

STORE, STORE_SIZE = 0x08004000, 0xC000
STEP = 1 if os.environ.get("PAM_LONG") else 9


def with_deadband(image, pascals):
    """The same table with another deadband, which lies behind the header, a byte and four numbers."""
    content = image[:0x19] + struct.pack("<f", pascals) + image[0x1D:-4]
    return content + struct.pack("<I", zlib.crc32(content))


def table_of(board):
    """The kept table, piece by piece."""
    found = b""
    while True:
        piece = board.link.ask(TABLE_READ, b"\0" + varint(len(found)))
        reader = Reader(piece)
        reader.varint()
        length = reader.varint()
        rest = piece[reader.at : reader.at + length]
        if not rest:
            return found
        found += rest


class PowerCuts(unittest.TestCase):
    def test_a_commit_that_loses_power_in_any_word_leaves_a_whole_table(self):
        old = TABLE.read_bytes()
        new = with_deadband(old, 70e3)
        first = Board()
        first.link.upload(old)
        self.assertEqual(table_of(first), old)
        kept = bytes(first.chip.uc.mem_read(STORE, STORE_SIZE))
        before = first.chip.words_written
        first.link.upload(new)
        self.assertEqual(table_of(first), new)
        words = first.chip.words_written - before
        self.assertGreater(words, 50, "an image of 211 bytes and its selection")
        found = {"old": 0, "new": 0}
        for left in sorted({*range(0, words, STEP), words - 1}):
            board = Board(prepare=lambda chip: chip.uc.mem_write(STORE, kept))
            # The count of starts is written by now.
            board.chip.words_left = left
            board.link.upload(new)
            self.assertEqual(board.restarted(within=2.0)[0], "power", f"{left} words")
            self.assertTrue(board.chip.valve_open)
            status = board.link.status()
            self.assertEqual((status["state"], status["fault"]), ("disarmed", None), f"{left} words")
            table = table_of(board)
            self.assertIn(table, (old, new), f"torn after {left} words")
            found["old" if table == old else "new"] += 1
            # And the store takes the next table.
            if left % (8 * STEP) == 0:
                board.link.upload(old)
                self.assertEqual(table_of(board), old)
        print(f"\npower cut in {sum(found.values())} of {words} words: {found['old']} times the old table, {found['new']} times the new")
        self.assertGreater(found["old"], 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
