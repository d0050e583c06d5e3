"""How fast recordings are read, beside polars and pandas on the same file: writes the table in read.md next to it.

    cargo build --release -p host --example read_recordings
    python3 tests/benchmarks/read.py [ROWS]

Every reader runs in a process of its own, so that time and memory include all of it; the best of three runs counts, since
whatever else the machine does only adds. Processor time is what the reader used on all cores.
"""

import os
import platform
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).resolve().parent
READER = HERE.parent.parent / "target" / "release" / "examples" / "read_recordings"


def make(path: Path, rows: int) -> None:
    import numpy as np
    import polars as pl

    rng = np.random.default_rng(1)
    t = np.arange(rows) * 1e-3
    stroke = 5 * (0.5 - 0.5 * np.cos(t * 0.5)) + rng.normal(0, 0.005, rows)
    pl.DataFrame(
        {
            "time_s": np.round(t, 3),
            "pressure_kPa": np.round(400 + rng.normal(0, 0.5, rows), 4),
            "displacement_mm": np.round(stroke, 6),
            "force_N": np.round(100 - 10 * stroke + rng.normal(0, 0.2, rows), 5),
        }
    ).write_csv(path)


def run(command: list[str]) -> tuple[float, float, float]:
    """Wall seconds, processor seconds, largest memory in MB."""
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status != 0:
        raise SystemExit(f"{command[0]} failed")
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def best(command: list[str]) -> tuple[float, float, float]:
    runs = [run(command) for _ in range(3)]
    return tuple(min(r[i] for r in runs) for i in range(3))


def main() -> None:
    if sys.argv[1:2] == ["--make"]:
        make(Path(sys.argv[2]), int(sys.argv[3]))
        return
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    lines = [
        "| rows | file | reader | wall | processor | memory |",
        "| ---: | ---: | --- | ---: | ---: | ---: |",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for rows in sorted({most // 100, most // 10, most}):
            path = Path(folder) / f"{rows}.csv"
            # In a process of its own: a child's largest memory counts that of its parent when it was started.
            subprocess.run([sys.executable, __file__, "--make", str(path), str(rows)], check=True)
            size = path.stat().st_size / 1e6
            python = lambda module, read: [sys.executable, "-c", f"import {module} as m; m.{read}({str(path)!r})"]
            readers = {
                "host": [str(READER), str(path)],
                "host, with the motion": [str(READER), "--motion", str(path)],
                "polars": python("polars", "read_csv"),
                "pandas": python("pandas", "read_csv"),
            }
            for name, command in readers.items():
                wall, processor, memory = best(command)
                lines.append(
                    f"| {rows:,} | {size:.0f} MB | {name} | {wall:.2f} s | {processor:.2f} s | {memory:.0f} MB |"
                )
                print(lines[-1], flush=True)
            path.unlink()
    note = (
        f"Python's readers include starting Python and importing the package (about 0.3 to 0.5 s). "
        f"{os.cpu_count()} cores, {platform.machine()}, polars {version('polars')}, pandas {version('pandas')}. "
        "Written by tests/benchmarks/read.py."
    )
    (HERE / "read.md").write_text("# Reading recordings\n\n" + "\n".join(lines) + f"\n\n{note}\n")


if __name__ == "__main__":
    main()
