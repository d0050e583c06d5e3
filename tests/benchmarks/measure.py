"""Wall time, processor time and memory of programs."""

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent

# A reader in a separate process reports the time of reading alone, without the start of Python and imports.
PEER = """import {0} as m, sys, time
wall, processor = time.perf_counter(), time.process_time()
m.read_csv(sys.argv[1]{1})
print(time.perf_counter() - wall, time.process_time() - processor)
"""

# Linux counts the memory of a process before `exec` as that of the new program, so that a small program started by a large one appears
# as large. This launcher is small; it starts the measured program and reports its usage.
LAUNCHER = """import os, sys, time
start = time.perf_counter()
child = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ)
_, status, usage = os.wait4(child, 0)
wall = time.perf_counter() - start
print(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)
sys.exit(os.waitstatus_to_exitcode(status) != 0)
"""


@dataclass
class Cost:
    wall: float
    processor: float
    memory: float
    """Largest, MB."""

    def least(self, other: "Cost") -> "Cost":
        """The smallest value, because other programs can only add to it."""
        return Cost(
            min(self.wall, other.wall), min(self.processor, other.processor), min(self.memory, other.memory)
        )


def run(command: list[str], says_seconds: bool = False) -> Cost:
    """One run, in a separate process. If the program prints wall and processor seconds of its own work, these are used."""
    launcher = [sys.executable, "-I", "-S", "-c", LAUNCHER, *map(str, command)]
    done = subprocess.run(launcher, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{command[0]} failed: {done.stderr.strip()}")
    *_, said = done.stdout.splitlines()
    wall, processor, memory = map(float, said.split())
    if says_seconds:
        wall, processor = map(float, done.stdout.split()[-5:-3])
    return Cost(wall, processor, memory)


def rounds(programs: dict[str, tuple[list[str], bool]], count: int) -> dict[str, Cost]:
    """Runs the programs in turn, `count` times, so that a busy period of the machine affects all of them; returns the smallest of each."""
    best: dict[str, Cost] = {}
    for _ in range(count):
        for name, (command, says_seconds) in programs.items():
            cost = run(command, says_seconds)
            best[name] = best[name].least(cost) if name in best else cost
    return best


def peer(module: str, path: Path, options: str = "") -> tuple[list[str], bool]:
    """Reading by a module; `options` are further arguments of its `read_csv`."""
    return ([sys.executable, "-c", PEER.format(module, f", {options}"), str(path)], True)


def make(path: Path, rows: int, *kind: str) -> float:
    """A recording; its size in MB."""
    subprocess.run([sys.executable, HERE / "muscle.py", path, str(rows), *kind], check=True)
    return path.stat().st_size / 1e6


def machine(packages: tuple[str, ...]) -> str:
    import platform
    from importlib.metadata import version

    model = platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                model = line.split(":")[1].strip()
                break
    except OSError:
        pass
    # Other programs on the machine affect wall times first.
    load = f"load {os.getloadavg()[0]:.1f}"
    versions = "".join(f", {p} {version(p)}" for p in packages)
    return f"{os.cpu_count()} cores, {model}, {load}; Python {platform.python_version()}{versions}."


@dataclass
class Bound:
    what: str
    value: float
    bound: float
    at_least: bool = False

    @property
    def met(self) -> bool:
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    def __str__(self) -> str:
        sign = "at least" if self.at_least else "at most"
        met = "yes" if self.met else "**no**"
        return f"| {self.what} | {sign} {self.bound:g} | {self.value:.2f} | {met} |"


COSTS = ["| rows | file | program | wall | processor | memory |", "| ---: | ---: | --- | ---: | ---: | ---: |"]


def table(programs, most: int, costs: dict[int, dict[str, Cost]], *kind: str):
    """Runs programs on recordings of 1 %, 10 %, and 100 % of `most` rows: a line of the page for each, and its cost in `costs`.

    `programs` makes them for a file, and `kind` is that of the recordings."""
    yield from COSTS
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "loops.csv"
        for rows in (most // 100, most // 10, most):
            size = make(path, rows, *kind)
            costs[rows] = rounds(programs(path), 5)
            for name, c in costs[rows].items():
                line = f"| {rows:,} | {size:.0f} MB | {name} | {c.wall:.3f} s | {c.processor:.2f} s | {c.memory:.0f} MB |"
                print(line, flush=True)
                yield line


def linear(costs: dict[int, dict[str, Cost]], name: str) -> list[Bound]:
    """Time and memory grow no faster than the number of rows."""
    most = max(costs)
    full, tenth = costs[most][name], costs[most // 10][name]
    return [
        Bound("processor time per row, against a tenth of the rows", full.processor / tenth.processor / 10, 1.2),
        Bound("memory per row, against a tenth of the rows", full.memory / tenth.memory / 10, 1.2),
    ]


PEERS = ("numpy", "scipy", "polars", "pandas")


def finish(script: str, title: str, lines: list[str], bounds: list[Bound], packages: tuple[str, ...] = PEERS) -> None:
    """Writes the page next to the script, with the versions of the packages, and exits with 1 if a bound is missed."""
    script = Path(script).name
    page = [f"# {title}", "", *lines, "", "## Bounds", "", "| | bound | measured | met |", "| --- | --- | ---: | --- |"]
    page += [*map(str, bounds), "", f"{machine(packages)} Written by tests/benchmarks/{script}."]
    (HERE / script).with_suffix(".md").write_text("\n".join(page) + "\n")
    print("\n".join(map(str, bounds)))
    sys.exit(0 if all(b.met for b in bounds) else 1)
