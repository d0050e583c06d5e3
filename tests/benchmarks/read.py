#!/usr/bin/env python3
"""Compares the speed of reading a recording with polars and pandas on the same file, and writes read.md.

    python3 tests/benchmarks/read.py [ROWS]       10 million by default

Builds what it needs. Every reader runs in a process of its own, in turn, several times; the least counts. Of the peers only the
reading itself is timed, of `host` the whole process.
"""

import sys

import environment

environment.enter()

from measure import Bound, finish, linear, peer, table  # noqa: E402


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    reader = environment.built("--example", "read_recordings") / "examples" / "read_recordings"

    def programs(path):
        return {
            "host": ([reader, path], False),
            "host, with the motion": ([reader, "--motion", path], False),
            "polars": peer("polars", path),
            "pandas": peer("pandas", path),
        }

    costs = {}
    lines = list(table(programs, most, costs))
    host, polars = costs[most]["host"], costs[most]["polars"]
    bounds = [
        Bound("time, in times of polars's reading", host.wall / polars.wall, 1),
        Bound("the same in processor time", host.processor / polars.processor, 1),
        *linear(costs, "host"),
    ]
    finish(__file__, "Reading recordings", lines, bounds)


if __name__ == "__main__":
    main()
