"""Wall time, processor time and memory of programs."""

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent

# A reader in a process of its own says what the reading alone took: starting Python and importing is not held against it.
PEER = """import {0} as m, sys, time
wall, processor = time.perf_counter(), time.process_time()
m.read_csv(sys.argv[1])
print(time.perf_counter() - wall, time.process_time() - processor)
"""


@dataclass
class Cost:
    wall: float
    processor: float
    memory: float
    """Largest, MB."""

    def least(self, other: "Cost") -> "Cost":
        """Whatever else the machine does only adds."""
        return Cost(
            min(self.wall, other.wall), min(self.processor, other.processor), min(self.memory, other.memory)
        )


def run(command: list[str], says_seconds: bool = False) -> Cost:
    """One run. Where the program prints wall and processor seconds of its own work, they count."""
    start = time.perf_counter()
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    out = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    if status != 0:
        raise SystemExit(f"{command[0]} failed")
    processor = usage.ru_utime + usage.ru_stime
    if says_seconds:
        wall, processor = map(float, out.split()[-2:])
    return Cost(wall, processor, usage.ru_maxrss / 1024)


def rounds(programs: dict[str, tuple[list[str], bool]], count: int) -> dict[str, Cost]:
    """The programs in turn, `count` times, so that a busy minute of the machine meets all of them; the least of each."""
    best: dict[str, Cost] = {}
    for _ in range(count):
        for name, (command, says_seconds) in programs.items():
            cost = run(command, says_seconds)
            best[name] = best[name].least(cost) if name in best else cost
    return best


def peer(module: str, path: Path) -> tuple[list[str], bool]:
    return ([sys.executable, "-c", PEER.format(module), str(path)], True)


def make(path: Path, rows: int) -> float:
    """A recording, made in a process of its own (a child's largest memory counts that of its parent); its size in MB."""
    subprocess.run([sys.executable, HERE / "muscle.py", path, str(rows)], check=True)
    return path.stat().st_size / 1e6


def machine() -> str:
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
    # Whoever else works on the machine shows in wall times first.
    load = f"load {os.getloadavg()[0]:.1f}"
    packages = ", ".join(f"{p} {version(p)}" for p in ("numpy", "scipy", "polars", "pandas"))
    return f"{os.cpu_count()} cores, {model}, {load}; Python {platform.python_version()}, {packages}."


def verdict(what: str, value: float, bound: float, at_least: bool) -> tuple[str, bool]:
    met = value >= bound if at_least else value <= bound
    sign = "at least" if at_least else "at most"
    return f"| {what} | {sign} {bound:g} | {value:.2f} | {'yes' if met else '**no**'} |", met
