#!/usr/bin/env python3
"""Draws the crates of the workspace and their dependencies as docs/src/pictures/crates.svg, for the architecture page.

    python3 tests/crates.py            # writes the picture
    python3 tests/crates.py --check    # exits with 1 if the picture is not that of the manifests

Crates that only test others are left out, and so are dependencies that follow from others (A uses C if A uses B and B uses C).
Needs only cargo and the standard library of Python.
"""

import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs/src/pictures/crates.svg"
TESTS = {"benchmarks", "emulator-tests", "published-schemas", "trials"}
# Columns in which no line crosses a box; a new crate is drawn in a column of its own until it has an entry here.
COLUMN = {
    "host": 1, "pamtools": 3, "pam-report": 2, "pam-fleet": 1.2, "pam-evaluate": 0.6, "pam-diagnose": 2.6, "pam-device": 0.2, "pam-fit": 1.9,
    "pam-campaign": 3.1, "firmware": 0, "virtual-bench": 1, "bootloader": 4.1, "pam-data": 2, "model-core": 0.6, "pam-protocol": 3,
}
WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 132, 36, 28, 52, 16


def metadata(manifest):
    command = ["cargo", "metadata", "--no-deps", "--offline", "--format-version", "1", "--manifest-path", str(manifest)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["packages"]


def dependencies():
    """For each crate, the crates that it uses, and whether always."""
    packages = metadata(ROOT / "Cargo.toml") + metadata(ROOT / "host/python/Cargo.toml")
    names = {p["name"] for p in packages} - TESTS
    return {
        p["name"]: {d["name"]: not d["optional"] for d in p["dependencies"] if d["kind"] is None and d["name"] in names}
        for p in packages
        if p["name"] in names
    }


def reached(uses, start):
    """All crates that a crate uses, directly or not."""
    found, todo = set(), list(uses[start])
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            todo.extend(uses[name])
    return found


def layer(uses, name):
    """0 for a crate that uses no other, and one more than the highest of those it uses."""
    return 1 + max((layer(uses, used) for used in uses[name]), default=-1)


def draw(uses):
    top = max(layer(uses, name) for name in uses)
    place = {name: COLUMN.get(name, max(COLUMN.values()) + 1) for name in uses}
    columns = max(place.values()) + 1
    x = lambda n: MARGIN + place[n] * (WIDTH + GAP_X)
    y = lambda n: MARGIN + (top - layer(uses, n)) * (HEIGHT + GAP_Y)
    width = round(2 * MARGIN + columns * (WIDTH + GAP_X) - GAP_X)
    height = 2 * MARGIN + (top + 1) * (HEIGHT + GAP_Y) - GAP_Y
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" font-family="sans-serif" font-size="14">',
        '<defs><marker id="a" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#777"/></marker></defs>',
    ]
    for name in sorted(uses):
        for used in sorted(uses[name]):
            if any(used in reached(uses, other) for other in uses[name] if other != used):
                continue
            dashed = "" if uses[name][used] else ' stroke-dasharray="5 4"'
            line = f"M{x(name) + WIDTH / 2:.0f} {y(name) + HEIGHT:.0f} L{x(used) + WIDTH / 2:.0f} {y(used):.0f}"
            out.append(f'<path d="{line}" fill="none" stroke="#777"{dashed} marker-end="url(#a)"/>')
    for name in sorted(uses):
        fill = "#e4eefc" if name in ("host", "firmware", "model-core") else "#f6f6f6"
        out.append(f'<rect x="{x(name):.0f}" y="{y(name):.0f}" width="{WIDTH}" height="{HEIGHT}" rx="5" fill="{fill}" stroke="#777"/>')
        out.append(f'<text x="{x(name) + WIDTH / 2:.0f}" y="{y(name) + HEIGHT / 2 + 5:.0f}" text-anchor="middle" fill="#222">{name}</text>')
    return "\n".join([*out, "</svg>", ""])


def main():
    picture = draw(dependencies())
    if "--check" in sys.argv[1:]:
        if not PICTURE.exists() or PICTURE.read_text() != picture:
            print("tests/crates.py: docs/src/pictures/crates.svg is not that of the manifests: run python3 tests/crates.py", file=sys.stderr)
            return 1
        return 0
    PICTURE.write_text(picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
