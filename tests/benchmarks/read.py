#!/usr/bin/env python3
"""How fast recordings are read, beside polars and pandas on the same file: writes read.md next to it.

    python3 tests/benchmarks/read.py [ROWS]       10 million unless told otherwise

Builds what it needs. Every reader runs in a process of its own, in turn, several times; the least counts. Of the peers only the
reading itself is timed, of `host` the whole process.
"""

import sys
import tempfile
from pathlib import Path

import environment

environment.enter()

from measure import HERE, machine, make, peer, rounds, verdict  # noqa: E402


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    reader = environment.built("--example", "read_recordings") / "examples" / "read_recordings"
    lines = [
        "# Reading recordings",
        "",
        "| rows | file | reader | wall | processor | memory |",
        "| ---: | ---: | --- | ---: | ---: | ---: |",
    ]
    costs = {}
    with tempfile.TemporaryDirectory() as folder:
        for rows in (most // 100, most // 10, most):
            path = Path(folder) / "loops.csv"
            size = make(path, rows)
            programs = {
                "host": ([reader, path], False),
                "host, with the motion": ([reader, "--motion", path], False),
                "polars": peer("polars", path),
                "pandas": peer("pandas", path),
            }
            costs[rows] = rounds(programs, 5)
            for name, c in costs[rows].items():
                lines.append(
                    f"| {rows:,} | {size:.0f} MB | {name} | {c.wall:.3f} s | {c.processor:.2f} s | {c.memory:.0f} MB |"
                )
                print(lines[-1], flush=True)
            path.unlink()
    full, tenth = costs[most], costs[most // 10]
    bounds = [
        verdict("time of polars's reading", full["host"].wall / full["polars"].wall, 1, False),
        verdict("the same in processor time", full["host"].processor / full["polars"].processor, 1, False),
        verdict(
            "processor time per row, against a tenth of the rows",
            full["host"].processor / tenth["host"].processor / 10,
            1.2,
            False,
        ),
        verdict(
            "memory per row, against a tenth of the rows",
            full["host"].memory / tenth["host"].memory / 10,
            1.2,
            False,
        ),
    ]
    lines += ["", "| of `host`, in multiples | bound | measured | met |", "| --- | --- | ---: | --- |"]
    lines += [line for line, _ in bounds]
    lines += ["", f"{machine()} Written by tests/benchmarks/read.py."]
    (HERE / "read.md").write_text("\n".join(lines) + "\n")
    print("\n".join(line for line, _ in bounds))
    sys.exit(0 if all(met for _, met in bounds) else 1)


if __name__ == "__main__":
    main()
