"""Another firmware over the link: the boot loader, both slots, and power that fails meanwhile.

    bash tests/nucleo/run.sh test_update
"""

import struct
import unittest

from board import Board
from link import PRESSURE_MODE, RESTART, Refused
from update import CONFIRM, OTHER_KEY, PROGRAM, REVERT, ROOT, SLOTS, begin, header, install, program_of, status

OTHER = ROOT / "target/firmware/nucleo-f446re-test-b.elf"
VTOR = 0xE000ED08


def hanging(slot):
    """A program that does nothing at all: its first instruction jumps to itself."""
    start = SLOTS[slot] + PROGRAM
    program = struct.pack("<II", 0x20001000, start + 0x401) + bytes(0x3F8) + b"\xfe\xe7" * 300
    return program


def slot_of(board):
    return int(board.chip.words.get(VTOR, 0) >= SLOTS[1])


class Update(unittest.TestCase):
    def test_the_probed_image_starts_from_slot_0_and_is_confirmed(self):
        board = Board()
        self.assertEqual(slot_of(board), 0)
        running, (first, second) = status(board)
        self.assertEqual((running, first[1], second), (0, True, None))

    def test_another_firmware_is_sent_tried_confirmed_and_kept(self):
        board = Board()
        board.link.change(scales__pressure__filter_s=0.003)
        program = program_of(OTHER, 1)
        self.assertIsNotNone(install(board, program, header(program, 1)))
        board.link.ask(RESTART)
        board.restarted(within=1.0)
        self.assertEqual(slot_of(board), 1)
        running, slots = status(board)
        self.assertEqual((running, slots[1]), (1, ((9, 8, 7), False)))
        board.link.ask(CONFIRM, wait=1.0)
        self.assertEqual(status(board)[1][1], ((9, 8, 7), True))
        # It controls as the one before, with its settings.
        board.start(PRESSURE_MODE)
        board.link.set_point(0, 300e3)
        board.run(0.3)
        self.assertEqual(board.link.status()["fault"], None)
        self.assertAlmostEqual(board.pressure_pa, 300e3, delta=3e3)
        with self.assertRaises(Refused):
            begin(board.link, header(program, 0))
        for _ in range(5):
            board.chip.restart("power", 1 << 27)
            board.restarted()
            self.assertEqual(slot_of(board), 1)

    def test_a_firmware_that_nobody_confirms_is_given_up_after_three_starts(self):
        board = Board()
        program = program_of(OTHER, 1)
        install(board, program, header(program, 1))
        started = []
        for _ in range(5):
            board.chip.restart("power", 1 << 27)
            board.restarted()
            started.append(slot_of(board))
        self.assertEqual(started, [1, 1, 1, 0, 0])

    def test_a_firmware_that_hangs_at_once_is_ended_by_the_watchdog_and_given_up(self):
        board = Board()
        program = hanging(1)
        install(board, program, header(program, 1))
        board.link.ask(RESTART)
        board.chip.run(0.2)
        self.assertEqual(slot_of(board), 1)
        restarts = len(board.chip.restarts)
        board.chip.run(40.0, lambda: len(board.chip.restarts) >= restarts + 3)
        self.assertEqual([why for why, _ in board.chip.restarts[restarts:]], ["watchdog"] * 3)
        board.chip.run(0.1)
        board.restarts = len(board.chip.restarts) - 1
        board.restarted()
        self.assertEqual((slot_of(board), board.link.status()["fault"]), (0, "watchdog"))
        self.assertTrue(board.chip.valve_open)

    def test_nothing_is_taken_that_the_key_has_not_signed_for_this_slot(self):
        board = Board()
        program = hanging(1)
        for wrong in (
            header(program, 1, key=OTHER_KEY), header(program, 1, board=1), header(program, 0), header(program, 1)[:-1],
            header(program, 1)[:-1] + b"\0",
        ):
            with self.assertRaises(Refused):
                begin(board.link, wrong)
        with self.assertRaises(Refused):
            # One byte is not the signed one.
            install(board, program[:-1] + b"\0", header(program, 1))
        board.chip.restart("power", 1 << 27)
        board.restarted()
        self.assertEqual(slot_of(board), 0)

    def test_nothing_is_written_while_a_mode_runs(self):
        board = Board()
        program = hanging(1)
        board.start(PRESSURE_MODE)
        with self.assertRaises(Refused):
            begin(board.link, header(program, 1))
        with self.assertRaises(Refused):
            board.link.ask(REVERT)

    def test_power_that_fails_in_any_word_leaves_a_firmware_that_starts(self):
        program = hanging(1)
        # Something valid is in the slot before: its first word makes that invalid.
        first = Board()
        install(first, program, header(program, 1))
        kept = bytes(first.chip.uc.mem_read(SLOTS[1], 0x1000))
        before = first.chip.words_written
        first.chip.run(0.01)
        self.assertIsNotNone(install(first, program, header(program, 1, release=(9, 9, 9))))
        words = first.chip.words_written - before
        self.assertGreater(words, 400)
        places = sorted({0, 1, 2, words // 2, *range(words - 42, words, 6), words - 3, words - 2, words - 1})
        for left in places:
            board = Board(prepare=lambda chip: chip.uc.mem_write(SLOTS[1], kept), settle=0.01)
            chip = board.chip
            # The program in slot 1 is not confirmed: the boot loader has started it.
            self.assertEqual(slot_of(board), 1)
            chip.uc.mem_write(SLOTS[1] + 0x10C, bytes(12))
            chip.restart("power", 1 << 27)
            board.restarted()
            self.assertEqual(slot_of(board), 0, "given up")
            chip.words_left = left
            install(board, program, header(program, 1, release=(9, 9, 9)))
            self.assertEqual(board.restarted(within=2.0)[0], "power", f"{left} of {words} words")
            self.assertTrue(chip.valve_open)
            self.assertEqual(slot_of(board), 0, f"{left} of {words} words")
            self.assertEqual(board.link.status()["state"], "disarmed")
        # And sent once more, it is there.
        install(board, program, header(program, 1, release=(9, 9, 9)))
        self.assertEqual(status(board)[1][1], ((9, 9, 9), False))
        print(f"\npower cut in {len(places)} of {words} words of an installation: the firmware before started each time")


if __name__ == "__main__":
    unittest.main(verbosity=2)
