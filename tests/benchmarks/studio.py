#!/usr/bin/env python3
"""Runs the live page of `host studio` for an hour at 1 kHz, in headless Chromium with an emulated controller.

    python3 tests/benchmarks/studio.py                     # an hour; writes studio.md next to this script
    python3 tests/benchmarks/studio.py --minutes 2         # a short run; writes nothing
    python3 tests/benchmarks/studio.py --on native         # the firmware as a library, if QEMU is too slow for 1 kHz on this machine
    python3 tests/benchmarks/studio.py --shots FOLDER      # screenshots of the page at the end, light and dark, wide and phone
    python3 tests/benchmarks/studio.py --program FILE      # a `host` other than the release build

A sine of force runs for the whole time; four live pictures are drawn, force against stroke among them. Every ten seconds: how far
apart the pictures were and what drawing took, how far the page is behind the controller, samples received and missing, the
page's memory and the program's. Ends with 1 where a bound is missed.
Needs chromium, chromedriver and, for the firmware's image, qemu-system-arm; nothing of Python beyond its own library.
"""

import argparse
import os
import statistics
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import browser
import measure
from environment import built

INTERVAL = 10.0

# Records what the code of the page does: nothing is replaced, each call is only timed. Samples are counted by their own times, so that a
# sample lost anywhere on its way is detected.
WATCH = """
    window.seen = null;
    window.anew = () => { seen = {gaps: [], draws: [], late: [], long: [], samples: 0, missing: 0}; };
    anew();
    let drawn = 0, newest = null;
    const drawAsBefore = draw, takeAsBefore = take;
    draw = () => {
      const begun = performance.now();
      if (drawn) seen.gaps.push(begun - drawn);
      drawn = begun;
      drawAsBefore();
      seen.draws.push(performance.now() - begun);
    };
    take = (m) => {
      takeAsBefore(m);
      if (m.k !== "t") return;
      for (const t of m.t) {
        if (newest !== null) seen.missing += Math.abs(Math.round((t - newest) * 1e3) - 1);
        newest = t;
      }
      seen.samples += m.t.length;
      seen.late.push(performance.now() - 1e3 * newest);
    };
    new PerformanceObserver((list) => { for (const e of list.getEntries()) seen.long.push(e.duration); }).observe({entryTypes: ["longtask"]});
"""

# The records since the last query.
REPORT = """
    const s = seen; anew();
    const sorted = (a) => a.sort((x, y) => x - y), at = (a, q) => a.length ? a[Math.min(a.length - 1, Math.floor(q * a.length))] : 0;
    const gaps = sorted(s.gaps), draws = sorted(s.draws), late = sorted(s.late);
    return {pictures: draws.length, gap50: at(gaps, .5), gap99: at(gaps, .99), gap_most: at(gaps, 1), draw50: at(draws, .5), draw99: at(draws, .99),
      late50: at(late, .5), late_most: at(late, 1), stalls: gaps.filter((g) => g > 100).length, long: s.long.length, long_most: Math.max(0, ...s.long),
      samples: s.samples, missing: s.missing, lost: state.lost, fault: state.fault, running: document.getElementById("state").textContent,
      heap: performance.memory.usedJSHeapSize / 1e6};
"""


def program_memory(pid):
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def watch(page, pid, minutes):
    """One row per ten seconds."""
    page.js(WATCH)
    page.js("anew()")
    rows, began, last = [], time.time(), time.time()
    while time.time() < began + 60 * minutes:
        time.sleep(max(0.0, began + (len(rows) + 1) * INTERVAL - time.time()))
        row = page.js(REPORT)
        now = time.time()
        row |= {"seconds": now - last, "at": now - began, "program": program_memory(pid), "load": os.getloadavg()[0]}
        last = now
        rows.append(row)
        print(
            "{at:6.0f} s: {pictures} pictures, {gap50:.0f} / {gap99:.0f} / {gap_most:.0f} ms apart (median, 99 %, most), drawing {draw50:.1f} / {draw99:.1f} ms, "
            "{samples} samples, {missing} missing, {lost} lost, {late_most:.0f} ms behind at most, page {heap:.1f} MB, program {program:.1f} MB, "
            "load {load:.1f}".format(**row),
            flush=True,
        )
        assert row["running"].startswith("running"), f"the controller is no longer running: {row['running']}; {row['fault'] or 'no fault'}"
    return rows


def page_of(rows):
    """The lines of the page: one for each tenth of the time."""
    yield "| until | pictures a second | apart: median, 99 %, most | drawing: median, 99 % | samples a second | missing | page | program | load |"
    yield "| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    # The lateness of the first interval is the clock's zero: the controller's clock and the page's begin at different times.
    size = -(-len(rows) // 10)
    for i in range(0, len(rows), size):
        part = rows[i : i + size]
        seconds = sum(r["seconds"] for r in part)
        total = lambda key: sum(r[key] for r in part)
        middle = lambda key: statistics.median(r[key] for r in part)
        most = lambda key: max(r[key] for r in part)
        yield (
            f"| {part[-1]['at'] / 60:.0f} min | {total('pictures') / seconds:.1f} | {middle('gap50'):.0f}, {middle('gap99'):.0f}, {most('gap_most'):.0f} ms "
            f"| {middle('draw50'):.1f}, {middle('draw99'):.1f} ms | {total('samples') / seconds:.1f} | {total('missing')} "
            f"| {min(r['heap'] for r in part):.1f} MB | {most('program'):.1f} MB | {middle('load'):.1f} |"
        )


def bounds_of(rows):
    seconds = sum(r["seconds"] for r in rows)
    third = max(1, len(rows) // 3)
    grown = lambda key, of: of(r[key] for r in rows[-third:]) - of(r[key] for r in rows[:third])
    # The offset between the clocks is unknown; the delay of the page is counted from its minimum.
    drift = statistics.median(r["late50"] for r in rows[-third:]) - statistics.median(r["late50"] for r in rows[:third])
    return [
        measure.Bound("samples missing or lost", sum(r["missing"] for r in rows) + rows[-1]["lost"], 0),
        measure.Bound("samples a second", sum(r["samples"] for r in rows) / seconds, 999, at_least=True),
        measure.Bound("pictures a second", sum(r["pictures"] for r in rows) / seconds, 25, at_least=True),
        measure.Bound("time between pictures, 99 % of a ten seconds' (median of all), ms", statistics.median(r["gap99"] for r in rows), 50),
        measure.Bound("drawing, 99 % of a ten seconds' (median of all), ms", statistics.median(r["draw99"] for r in rows), 16),
        measure.Bound("pictures more than 100 ms apart, per minute", 60 * sum(r["stalls"] for r in rows) / seconds, 1),
        measure.Bound("the page falls behind the controller, last third against first, ms", drift, 20),
        measure.Bound("the page's memory grows, last third against first, MB", grown("heap", min), 2),
        measure.Bound("the program's memory grows, last third against first, MB", grown("program", max), 5),
    ]


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--minutes", type=float, default=60.0)
    options.add_argument("--on", choices=["qemu", "native"], default="qemu")
    options.add_argument("--shots", metavar="FOLDER")
    options.add_argument("--program", metavar="FILE")
    options = options.parse_args()
    with browser.studio(options.program or str(built() / "host"), options.on) as (url, driver, program):
        page = browser.Browser(driver, url, "1300,1000")
        page.state("disarmed", 60)
        controller = {"qemu": "the firmware's image in QEMU", "native": "the firmware as a library in a process of its own"}[options.on]
        page.table_on_device()
        page.click("arm")
        page.state("armed")
        page.click("follow")
        page.state("running")
        rows = watch(page, program.pid, options.minutes)
        page.shot(options.shots, "hour")
        page.close()
    bounds = bounds_of(rows)
    lines = [
        f"{rows[-1]['at'] / 60:.0f} minutes of live pictures at 1 kHz from {controller}, a sine of force running; four pictures, "
        "force against stroke among them, in headless Chromium, which draws without a graphics card. Each line is a tenth of the time.",
        "",
        *page_of(rows),
    ]
    if options.minutes < 60:
        print("\n".join([*lines, "", *map(str, bounds)]))
        sys.exit(0 if all(b.met for b in bounds) else 1)
    print("\n".join(lines))
    measure.finish(__file__, "The live page for an hour", lines, bounds, packages=())


main()
