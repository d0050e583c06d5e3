"""Power that fails while the Nucleo programs its flash: after the restart what was kept before or what is new is there, whole.

    bash tests/nucleo/run.sh test_power_cuts

A table loses power in every fourth word of its commit, with `PAM_LONG=1` in every word; settings lose it in every word.
"""

import os
import struct
import unittest
import zlib

from board import TABLE, Board
from link import RESTART, SETTINGS, TABLE_READ, Reader, varint

STORE, STORE_SIZE = 0x08004000, 0xC000
STEP = 1 if os.environ.get("PAM_LONG") else 4
# Time after a start in which the device counts it and answers, s.
SETTLE_S = 0.05


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
    board = None

    def cut(self, kept, left, write):
        """A board with this store that loses power after a number of words of a write, and is up again."""
        # One board for all cuts: a restart takes a third of the time of a new one.
        board = self.board = self.board or Board(settle=SETTLE_S)
        board.link.ask(RESTART)
        board.chip.uc.mem_write(STORE, kept)
        board.restarted(settle=SETTLE_S)
        # The count of starts is written by now.
        board.chip.words_left = left
        write(board)
        self.assertEqual(board.restarted(within=2.0, settle=SETTLE_S)[0], "power", f"{left} words")
        self.assertTrue(board.chip.valve_open)
        status = board.link.status()
        self.assertEqual((status["state"], status["fault"]), ("disarmed", None), f"{left} words")
        return board

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
            board = self.cut(kept, left, lambda board: board.link.upload(new))
            table = table_of(board)
            self.assertIn(table, (old, new), f"torn after {left} words")
            found["old" if table == old else "new"] += 1
            # And the store takes the next table.
            if left % (8 * STEP) == 0:
                board.link.upload(old)
                self.assertEqual(table_of(board), old)
        cuts = sum(found.values())
        print(f"\npower cut in {cuts} of {words} words of a table: {found['old']} times the old one, {found['new']} times the new one")
        self.assertGreater(found["old"], 0)

    def test_settings_that_lose_power_in_any_word_are_the_old_or_the_new_and_no_fault(self):
        def change(board):
            # Two fields that are far apart, so that a mixture is seen.
            board.link.change(watch__supply_low_pa=300e3, scales__pressure__filter_s=0.002)

        first = Board()
        old = first.link.ask(SETTINGS)
        kept = bytes(first.chip.uc.mem_read(STORE, STORE_SIZE))
        before = first.chip.words_written
        change(first)
        new = first.link.ask(SETTINGS)
        self.assertNotEqual(new, old)
        words = first.chip.words_written - before
        self.assertGreater(words, 50, "settings of more than 200 bytes and their seal")
        found = {"old": 0, "new": 0}
        for left in range(words):
            board = self.cut(kept, left, change)
            settings = board.link.ask(SETTINGS)
            self.assertIn(settings, (old, new), f"mixed after {left} words")
            found["old" if settings == old else "new"] += 1
            # And the store takes the next ones.
            if left % 16 == 0:
                change(board)
                self.assertEqual(board.link.ask(SETTINGS), new)
        print(f"\npower cut in each of {words} words of settings: {found['old']} times the old ones, {found['new']} times the new ones")
        self.assertGreater(found["old"], 0)
        self.assertGreater(found["new"], 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
