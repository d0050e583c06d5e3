#!/usr/bin/env python3
"""Measures what a build costs after one line was changed, now and at an earlier commit, and writes rebuild.md.

    python3 tests/benchmarks/rebuild.py [COMMIT]       the commit before the host became several crates by default

Each tree is a worktree in a temporary folder with a build folder of its own; PAM_BUILDS names a folder that keeps them for the next run.
The program `host` is built with debug profile; then a function is added to one file, and the program is built again. Processor time is
compared, since wall time depends on what else the machine does. The table also counts the packages that the Python bindings link.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The last commit with one crate for the host.
BEFORE = "3790793e^"
# File names of one module in diagnosis and one in the recordings; both trees have them.
CHANGED = {"diagnosis": "diagnose/**/verdict.rs", "recordings": "recording/cells.rs"}
# The smallest cost of this number of changes counts, because other programs can only add to it.
CHANGES = 3


def build(tree: Path, builds: Path) -> float:
    """Builds the program; processor seconds."""
    before = os.times()
    command = ["cargo", "build", "--quiet", "--locked", "--workspace", "--bin", "host"]
    subprocess.run(command, cwd=tree, env={**os.environ, "CARGO_TARGET_DIR": str(builds)}, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def after_one_line(tree: Path, builds: Path, pattern: str) -> float:
    """The smallest cost of a build after one line was added to the file."""
    (path,) = [p for p in tree.glob(f"host/**/{pattern}") if "target" not in p.parts]
    text = path.read_text()
    costs = []
    for n in range(CHANGES):
        path.write_text(f"{text}\n#[doc(hidden)] #[allow(dead_code, missing_docs)] pub(crate) fn line_{n}() -> usize {{ {n} }}\n")
        costs.append(build(tree, builds))
    path.write_text(text)
    build(tree, builds)
    return min(costs)


def packages(tree: Path) -> int:
    """The packages in the lock file of the Python bindings."""
    return (tree / "host/python/Cargo.lock").read_text().count("\n[[package]]")


def measured(commit: str, place: Path, kept: Path) -> dict[str, float]:
    """All figures of one commit."""
    name = subprocess.run(["git", "rev-parse", "--short", commit], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    tree = place / name
    subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, commit], cwd=ROOT, check=True)
    try:
        builds = kept / name
        build(tree, builds)
        figures = {}
        for what, pattern in CHANGED.items():
            figures[what] = after_one_line(tree, builds, pattern)
        return {**figures, "packages": packages(tree)}
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


def main() -> None:
    before = sys.argv[1] if len(sys.argv) > 1 else BEFORE
    with tempfile.TemporaryDirectory() as place:
        kept = Path(os.environ.get("PAM_BUILDS", f"{place}/builds"))
        kept.mkdir(parents=True, exist_ok=True)
        old, new = measured(before, Path(place), kept), measured("HEAD", Path(place), kept)
    page = (
        "# Cost of a build after one changed line\n\n"
        "Written by `python3 tests/benchmarks/rebuild.py`; nothing here is typed by hand. Processor time of a debug build of the "
        f"program `host`, at `{before}` (one crate for the host) and now; the smallest of {CHANGES} changes.\n\n"
        "| | one crate | now |\n| --- | ---: | ---: |\n"
    )
    for what in CHANGED:
        page += f"| one line in {what} | {old[what]:.1f} s | {new[what]:.1f} s |\n"
    page += f"| packages in the lock file of the Python bindings | {old['packages']} | {new['packages']} |\n"
    (Path(__file__).parent / "rebuild.md").write_text(page)
    print(page)


if __name__ == "__main__":
    main()
