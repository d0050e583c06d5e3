#!/usr/bin/env python3
"""Counts what makes a code base easy or hard to enter, at an earlier commit and now, and writes docs/src/structure.md.

    python3 tests/structure.py [COMMIT]       the last commit with one crate for the host by default

Production code is every Rust file of the libraries and programs without test modules, test folders, examples and benches. Needs git, cargo
and the standard library of Python.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import crates

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/src/structure.md"
BEFORE = "3790793e^"
LONG = 80
TESTING = {"tests", "examples", "benches", "target", "fuzz"}
PURPOSE = {
    "model-core": "physics, tables, effects, messages of the link; runs on the controller, too",
    "firmware": "the controller", "bootloader": "starts the newer firmware of a board",
    "pam-protocol": "a test protocol as data", "virtual-bench": "a simulated muscle that shares no equation with the model",
    "pam-data": "recordings, motion, muscle descriptions, errors", "pam-fit": "fit, table file, prediction, bench checks",
    "pam-evaluate": "cross-validation, published formulas", "pam-diagnose": "which physics is missing",
    "pam-report": "text, pictures, pages", "pam-fleet": "many campaigns on several processes",
    "pam-device": "link client, recorder, emulated controllers", "pam-campaign": "campaigns that choose their steps",
    "host": "command line, live view, demo", "pamtools": "Python bindings",
}
FUNCTION = re.compile(r"^(\s*)(?:pub(?:\([a-z]+\))? )?(?:const |async |unsafe )*fn (\w+)")
CONSTANT = re.compile(r"^\s*(?:pub(?:\([a-z]+\))? )?const [A-Z0-9_]+: (?:f64|usize|u32) = ")


def production(text):
    """The lines of a file before its test module."""
    return re.split(r"^#\[cfg\(test\)\]\nmod tests \{", text, maxsplit=1, flags=re.M)[0].splitlines()


def sources(folder):
    """Production files of a folder, as lines."""
    found = {}
    for path in sorted(folder.rglob("*.rs")):
        inside = path.relative_to(folder)
        if not TESTING & set(inside.parts[:-1]) and path.name not in ("tests.rs", "build.rs"):
            found[path] = production(path.read_text())
    return found


def module(files, name):
    """The files of one module of a crate."""
    return {path: lines for path, lines in files.items() if name in path.parts or path.name == f"{name}.rs"}


def functions(lines):
    """Name and length of each function."""
    for at, line in enumerate(lines):
        if match := FUNCTION.match(line):
            end = next((i for i in range(at, len(lines)) if lines[i].startswith(match[1] + "}")), at)
            yield match[2], end - at + 1


def folders_of(tree):
    """Folder of each crate that is not only a test; the bench stood among the tests once."""
    packages = crates.metadata(tree / "Cargo.toml") + crates.metadata(tree / "host/python/Cargo.toml")
    found = {p["name"]: Path(p["manifest_path"]).parent for p in packages}
    return {n: f for n, f in found.items() if f.relative_to(tree).parts[0] != "tests" or n == "virtual-bench"}


def effects():
    """The names of all effects of the catalogue."""
    text = "".join(p.read_text() for p in (ROOT / "model-core/src/effects").glob("*.rs"))
    return set(re.findall(r'^\s*name: "([a-z-]+)",$', text, re.M))


def one_word(lines):
    """Documentation of public items that is a single word, or a unit."""
    for before, first, item in zip([""] + lines, lines, lines[1:]):
        if not before.lstrip().startswith("///") and re.match(r"\s*/// [\w/²³%]+\.$", first) and re.match(r"\s*pub ", item):
            yield first


def counts(tree):
    """The figures of one tree."""
    folders = folders_of(tree)
    code = {name: sources(folder / "src") for name, folder in folders.items()}
    everything = [(path, lines) for files in code.values() for path, lines in files.items()]
    diagnosis = code.get("pam-diagnose") or module(code["host"], "diagnose")
    fit = code.get("pam-fit") or module(code["host"], "fit")
    names = effects()
    lengths = [n for _, lines in everything for _, n in functions(lines)]
    lock = tree / "host/python/Cargo.lock"
    crate_lines = {name: sum(map(len, files.values())) for name, files in code.items()}
    count = lambda files, pattern: sum(len(re.findall(pattern, "\n".join(lines))) for lines in files.values())
    return {
        "crates": len(folders),
        "lines of the largest crate": max(crate_lines.values()),
        "lines of production code": sum(crate_lines.values()),
        "lines of the longest file": max(len(lines) for _, lines in everything),
        f"functions of more than {LONG} lines": sum(n > LONG for n in lengths),
        "lines of an average function": f"{sum(lengths) / len(lengths):.1f}",
        "untyped `json!`": sum(len(re.findall(r"\bjson!\(", "\n".join(lines))) for _, lines in everything),
        "names of effects as literals in the diagnosis": sum(
            1 for lines in diagnosis.values() for line in lines if not line.lstrip().startswith("//")
            for literal in re.findall(r'"([a-z-]+)"', line) if literal in names),
        "names of effects as variants in the diagnosis": sum(
            len(re.findall(r"\b(?:EffectName|BenchName|Change)::[A-Z]", line))
            for lines in diagnosis.values() for line in lines if not line.lstrip().startswith("//")),
        "documentation of one word": sum(1 for _, lines in everything for _ in one_word(lines)),
        "constants declared outside the page of criteria, in the diagnosis": sum(
            bool(CONSTANT.match(line)) for path, lines in diagnosis.items() for line in lines if "criteria" not in str(path)),
        "public modules of the fit": count(fit, r"(?m)^\s*pub mod "),
        "packages in the lock file of the Python bindings": lock.read_text().count("\n[[package]]"),
    }, folders, code, crate_lines


def checked_out(commit, place):
    tree = place / "before"
    subprocess.run(["git", "worktree", "add", "--quiet", "--detach", tree, commit], cwd=ROOT, check=True)
    try:
        return counts(tree)[0]
    finally:
        subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


def main():
    commit = sys.argv[1] if len(sys.argv) > 1 else BEFORE
    with tempfile.TemporaryDirectory() as place:
        before = checked_out(commit, Path(place))
    now, folders, code, lines = counts(ROOT)
    rows = "\n".join(f"| {what} | {before[what]} | {value} |" for what, value in now.items())
    unknown = sorted(set(folders) - set(PURPOSE))
    if unknown:
        sys.exit(f"tests/structure.py: give a purpose for {', '.join(unknown)}")
    tree = "\n".join(
        f"| `{folders[name].relative_to(ROOT)}` | `{name}` | {len(code[name])} | {lines[name]} | {purpose} |"
        for name, purpose in PURPOSE.items())
    PAGE.write_text(f"""# Structure in figures

Written by `python3 tests/structure.py`; nothing here is typed by hand. Counted is production code, without tests, examples and benches.
[Architecture](design.md) shows how the parts depend on each other.

## Crates

| folder | crate | files | lines | contents |
| --- | --- | ---: | ---: | --- |
{tree}

`tests` holds the tests of whole programs: the emulated controller, sealed trials, benchmarks, packages, pages in a browser.

## Before and after the split

"Before" is the last commit with one crate for the host. The program has grown since.

| | before | now |
| --- | ---: | ---: |
{rows}

[Crates with one purpose](decisions/02-crates.md) gives the cost of a build after one changed line, before and after.
""")
    print(json.dumps({"before": before, "now": now}, indent=1))


if __name__ == "__main__":
    main()
