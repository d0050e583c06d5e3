#!/usr/bin/env python3
"""Measures `host batch` and writes fleet.md.

    python3 tests/benchmarks/fleet.py [--whole] [MUSCLES] [ROWS] [PROGRAMS]        400 muscles of 20,000 rows by default

The page names the number of muscles that were run. With --whole, a fleet of 10,000 is fitted too; without it, its time is extrapolated. A Dask job that calls SciPy (fleet_dask.py) fits some of
the muscles for comparison.

The recordings are those of the virtual bench, one seed each. Only 24 are made; a manifest of more muscles names them in turn, which costs a
fit the same and does not fill the disk. PROGRAMS is the folder of `host` and `virtual-bench`; without it they are built.

Processor time is measured beside wall time: on a machine that does other work, wall time says little about the program.
"""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

WHOLE = "--whole" in sys.argv
ARGUMENTS = [argument for argument in sys.argv[1:] if argument != "--whole"]
MUSCLES = int(ARGUMENTS[0]) if ARGUMENTS else 400
ROWS = int(ARGUMENTS[1]) if len(ARGUMENTS) > 1 else 20_000
import environment

environment.enter()

HERE = Path(__file__).resolve().parent
RECORDED = 24
# Rows of the virtual bench's protocol per muscle and hertz of sampling.
ROWS_PER_HZ = 596
FLEET = 10_000


def programs():
    if len(ARGUMENTS) > 2:
        return Path(ARGUMENTS[2])
    return environment.built()


def timed(*commands):
    """Runs commands at the same time: wall seconds, processor seconds, largest memory of one in MB, and the last one's output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    running = [subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, text=True) for command in commands]
    memory, text = 0.0, ""
    for process in running:
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0, process.args
        memory = max(memory, usage.ru_maxrss / 1024)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, processor, memory, text


def manifest(path, muscles):
    with open(path, "w") as file:
        file.write("muscle,description,files\n")
        for i in range(muscles):
            file.write(f"m{i:05d},r{i % RECORDED}/muscle.toml,r{i % RECORDED}/*Pa.csv\n")
    return path


def dask(bin_, cores, fit_per, wall_per):
    """The section on the Dask job, which fits as many muscles as there are different ones."""
    path = Path(manifest("fleet.csv", 2 * RECORDED)).resolve()
    _, _, _, text = timed([sys.executable, HERE / "fleet_dask.py", path, cores])
    muscles, wall, processor = (float(word) for word in text.split())
    lines = ["## Beside a Dask job that calls SciPy", "", "| program | muscles | wall per muscle | processor per muscle |", "| --- | ---: | ---: | ---: |"]
    lines.append(f"| `host batch --only fit`, {cores} jobs | {MUSCLES:,} | {1e3 * wall_per:.0f} ms | {1e3 * fit_per:.0f} ms |")
    lines.append(f"| Dask, {cores} workers, SciPy | {muscles:.0f} | {1e3 * wall / muscles:.0f} ms | {1e3 * processor / muscles:.0f} ms |")
    return [*lines, "", "The Dask job reads the same files with polars and minimises the objective of the thesis (eq. 23) with SLSQP for each pressure, "
            "over 200 points of the mid-line, for a given deadband. `host batch` also finds the deadband, fits all pressures together with friction, "
            "computes uncertainties, checks the recordings, hashes them, and writes four tables.", ""]  # fmt: skip


def main():
    bin_ = programs()
    cores = os.cpu_count()
    work = Path(tempfile.mkdtemp())
    os.chdir(work)
    for i in range(RECORDED):
        hertz = ROWS / ROWS_PER_HZ
        subprocess.run([bin_ / "virtual-bench", "record", "--muscle", "mini", "--protocol", "thesis", "--seed", str(i + 1),
                        "--sample-hz", f"{hertz:.3f}", "-o", f"r{i}"], stdout=subprocess.DEVNULL, check=True)  # fmt: skip
    rows = sum(len(f.read_text().splitlines()) - 1 for f in Path("r0").glob("*Pa.csv"))

    def batch(muscles, *options):
        shutil.rmtree("out", ignore_errors=True)
        return timed([bin_ / "host", "batch", manifest("fleet.csv", muscles), "-o", "out", "--quiet", "--json", *options])

    lines = ["# Speed of batches", "", f"{cores} cores, {rows:,} rows per muscle; the load of the machine before the start was {os.getloadavg()[0]:.1f}.", ""]

    # Fit: throughput, and memory over the number of muscles.
    lines += ["## Fit", "", "| muscles | jobs | wall | processor | per muscle | memory |", "| ---: | ---: | ---: | ---: | ---: | ---: |"]
    memory = {}
    walls, processors = {}, {}
    for muscles in (MUSCLES // 16, MUSCLES // 4, MUSCLES, *([FLEET] if WHOLE else [])):
        wall, processor, mb, _ = batch(muscles, "--only", "fit")
        memory[muscles], walls[muscles], processors[muscles] = mb, wall, processor
        per = processor / muscles
        lines.append(f"| {muscles:,} | {cores} | {wall:.1f} s | {processor:.1f} s | {1e3 * per:.0f} ms | {mb:.0f} MB |")
    wall_per, fit_per = walls[MUSCLES] / MUSCLES, processors[MUSCLES] / MUSCLES
    fleet_minutes = (processors[FLEET] if WHOLE else FLEET * fit_per) / 2 / 60
    lines += ["", "A muscle of the whole fleet has one of 24 sets of recordings."] if WHOLE else []
    lines += [""] if WHOLE else ["", f"Extrapolated from {MUSCLES:,} muscles: {FLEET:,} muscles need {FLEET * fit_per / cores / 60:.0f} min of both cores by processor time, "
              f"{FLEET * wall_per / 60:.0f} min by the wall time above.", ""]  # fmt: skip

    # The same muscles by a Dask job that calls SciPy.
    lines += dask(bin_, cores, fit_per, wall_per)

    # Strong and weak scaling over shards.
    lines += ["## Shards", "", "| shards | work | processor per muscle | efficiency |", "| ---: | --- | ---: | ---: |"]
    n = MUSCLES // 4
    _, one, _, _ = batch(n, "--only", "fit", "--jobs", "1")
    lines.append(f"| 1 | {n} muscles | {1e3 * one / n:.0f} ms | 1 |")

    def shards(muscles, of, chosen):
        shutil.rmtree("out", ignore_errors=True)
        manifest("fleet.csv", muscles)
        return timed(*[[bin_ / "host", "batch", "fleet.csv", "-o", "out", "--only", "fit", "--jobs", "1", "--quiet", "--json", "--shard", f"{i}/{of}"]
                       for i in chosen])  # fmt: skip

    efficiencies = {}
    for name, muscles in (("strong, the same work", n), ("weak, twice the work", 2 * n)):
        _, processor, _, _ = shards(muscles, 2, [1, 2])
        efficiencies[name] = (one / n) / (processor / muscles)
        lines.append(f"| 2 at a time | {muscles} muscles ({name}) | {1e3 * processor / muscles:.0f} ms | {efficiencies[name]:.2f} |")
    total, done = 0.0, 0
    for shard in (1, 22, 43, 64):
        _, processor, _, text = shards(MUSCLES * 4, 64, [shard])
        total += processor
        done += json.loads(text)["computed"]
    efficiencies["64"] = (one / n) / (total / done)
    lines.append(f"| 64, of which 4 one by one | {done} of {MUSCLES * 4:,} muscles | {1e3 * total / done:.0f} ms | {efficiencies['64']:.2f} |")
    lines += ["", "Efficiency: processor time per muscle of one process, divided by that of the shards. It contains what shards cost in addition: their "
              "start, reading the whole manifest, and competition for caches. It does not contain that hashing gives shards of different size.", ""]  # fmt: skip

    # Diagnosis beside single runs.
    few = 8
    single = 0.0
    for i in range(few):
        files = sorted(map(str, Path(f"r{i}").glob("*Pa.csv")))
        os.environ["RAYON_NUM_THREADS"] = "1"
        _, processor, _, _ = timed([bin_ / "host", "diagnose", "--muscle", f"r{i}/muscle.toml", *files, "--json", "d.json", "--quiet"])
        del os.environ["RAYON_NUM_THREADS"]
        single += processor / few
    wall, processor, mb, _ = batch(few, "--only", "diagnose")
    ratio = single / (processor / few)
    lines += ["## Diagnosis", "", f"`host diagnose` needs {single:.2f} s of processor time for one muscle on one thread; `host batch` needs {processor / few:.2f} s per "
              f"muscle on {cores} cores. The throughput per core is {ratio:.2f} of 1 / single time. Memory: {mb:.0f} MB.", ""]  # fmt: skip

    checks = [
        (f"fit 10,000 muscles on two cores, min, {'measured' if WHOLE else 'extrapolated'} by processor time", 30, fleet_minutes, "most"),
        *([("fit 10,000 muscles, min by the clock of this machine", 30, walls[FLEET] / 60, "most")] if WHOLE else []),
        ("memory, MB", 500, max(memory.values()), "most"),
        ("memory of all muscles / of a sixteenth", 1.5, memory[FLEET if WHOLE else MUSCLES] / memory[MUSCLES // 16], "most"),
        ("efficiency of two shards, strong", 0.9, efficiencies["strong, the same work"], "least"),
        ("efficiency of two shards, weak", 0.9, efficiencies["weak, twice the work"], "least"),
        ("efficiency of 64 shards", 0.9, efficiencies["64"], "least"),
        ("diagnosis, throughput per core x single time", 0.9, ratio, "least"),
    ]
    lines += ["## Bounds", "", "| | bound | measured | met |", "| --- | --- | ---: | --- |"]
    for name, bound, value, kind in checks:
        met = value <= bound if kind == "most" else value >= bound
        lines.append(f"| {name} | {'≤' if kind == 'most' else '≥'} {bound} | {value:.2f} | {'yes' if met else '**no**'} |")
    (HERE / "fleet.md").write_text("\n".join(lines) + "\n")
    os.chdir("/")
    shutil.rmtree(work)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
