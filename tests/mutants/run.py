"""Changes the controller on purpose and looks whether its tests notice; see tests/mutants.sh."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tomllib
from datetime import date
from functools import cache
from pathlib import Path

from one_program import Program, Source, listed

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
PAGE = ROOT / "docs/src/mutants.md"
RESULTS = HERE / "results"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
TESTS = ["cargo", "test", "--locked", "-q", "--profile", "mutants", "-p", "firmware", "-p", "model-core", "--lib"]


def copied():
    """A copy of the tree, whose times stay as they are so that only what changes is built again."""
    place = TARGET / "mutants-tree"
    files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout.split(b"\0")
    for name in filter(None, files):
        source, copy = ROOT / name.decode(), place / name.decode()
        if not source.is_file():
            continue
        if not copy.exists() or copy.read_bytes() != source.read_bytes():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, copy)
    # What has been moved or removed since: cargo would find its tests twice. The programs of an earlier run stay.
    tracked = {place / name.decode() for name in files}
    for path in place.rglob("*"):
        if path.is_file() and path not in tracked and not path.name.endswith("-tests"):
            path.unlink()
    return place


def tested(place):
    """Whether the tests pass, fail, or cannot be built."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(TARGET / "mutants-built"), "RUSTFLAGS": "--cap-lints=allow"}
    built = subprocess.run([*TESTS, "--no-run"], cwd=place, env=environment, capture_output=True, text=True)
    if built.returncode:
        return "not built", built.stderr
    run = subprocess.run(TESTS, cwd=place, env=environment, capture_output=True, text=True, timeout=600)
    return ("missed" if run.returncode == 0 else "caught"), run.stdout


def changed(place, file, old, new):
    text = (place / file).read_text()
    if text.count(old) != 1:
        sys.exit(f"tests/mutants/removed-checks.toml: the text occurs {text.count(old)} times in {file}, not once:\n{old}")
    (place / file).write_text(text.replace(old, new))


def removed(only=None):
    """Removes each check of the list in turn."""
    place = copied()
    checks = tomllib.loads((HERE / "removed-checks.toml").read_text())["check"]
    outcome, words = tested(place)
    if outcome != "missed":
        sys.exit(f"the tests fail before anything is changed ({outcome}):\n{words[-3000:]}")
    found = []
    for check in checks:
        if only and only not in check["name"]:
            continue
        edits = [(check["file"], check["old"], check["new"])]
        if "helper" in check:
            edits.append((check["helper"], check["helper_old"], check["helper_new"]))
        before = {file: (place / file).read_text() for file, _, _ in edits}
        try:
            for edit in edits:
                changed(place, *edit)
            outcome, words = tested(place)
        finally:
            for file, text in before.items():
                (place / file).write_text(text)
        if outcome == "not built":
            sys.exit(f"the tree without `{check['name']}` cannot be built:\n{words[-3000:]}")
        print(f"{outcome:8} {check['name']}", flush=True)
        found.append({"name": check["name"], "file": check["file"], "outcome": outcome})
    if not only:
        RESULTS.mkdir(exist_ok=True)
        (RESULTS / "removed.json").write_text(json.dumps(found, indent=1) + "\n")
    return all(one["outcome"] == "caught" for one in found)


def generated(begins, only_missed=False):
    """Judges the changes of cargo-mutants in the files whose paths begin like one of these, and adds the outcomes to those of earlier runs."""
    every = listed(ROOT)
    kept = kept_outcomes(every)
    wanted = [one for begin in begins or [""] for one in every if one["file"].startswith(begin)]
    if only_missed:
        rest = lambda one: one["outcome"] == "not judged" or (one["outcome"] == "missed" and reason(one) is None)
        wanted = [one for one in wanted if rest(kept[one["name"]])]
    print(f"{len(wanted)} changes to judge", flush=True)
    if wanted:
        program = Program(copied(), TARGET / "mutants-built", wanted)
        program.build()
        for mutant, outcome in program.judge():
            one = kept[mutant["name"]]
            one["outcome"], one["judged"] = outcome, str(date.today())
            if outcome == "missed":
                print(f"{outcome:10} {mutant['name']}\n           {one['text']}", flush=True)
            keep(kept)
    keep(kept)


def code_hash(text):
    """Of a file without its tests, so that an outcome is that of the code that was judged."""
    code = text.split("\n#[cfg(test)]\nmod ")[0]
    return hashlib.sha256(code.encode()).hexdigest()[:12]


def kept_outcomes(every):
    """The outcomes of earlier runs for the changes that there are now; `not judged` where the file has changed since."""
    path = RESULTS / "generated.json"
    earlier = {one["name"]: one for one in json.loads(path.read_text())} if path.exists() else {}
    kept, texts = {}, {file: (ROOT / file).read_text() for file in {one["file"] for one in every}}
    for mutant in every:
        name, text = mutant["name"], texts[mutant["file"]]
        line = mutant["span"]["start"]["line"]
        lines = text.splitlines()
        kept[name] = {
            "name": name, "file": mutant["file"], "line": line, "change": name.split(": ", 1)[1], "text": lines[line - 1].strip(),
            "becomes": Source(text).changed(mutant, (0, len(text))).splitlines()[line - 1].strip(),
            "code": code_hash(text), "outcome": "not judged",
        }
        before = earlier.get(name, {})
        if before.get("code") == kept[name]["code"]:
            kept[name] |= {key: before[key] for key in ("outcome", "judged") if key in before}
    return kept


def keep(kept):
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "generated.json").write_text(json.dumps(list(kept.values()), indent=1) + "\n")


@cache
def accepted():
    return tomllib.loads((HERE / "equivalent.toml").read_text())["mutant"]


def reason(mutant):
    """Why nothing could notice a change; none where it is not in the list."""
    lines = [" ".join(mutant[line].split()) for line in ("text", "becomes")]
    fits = lambda one: (one["file"], one["change"]) == (mutant["file"], mutant["change"]) and one["text"] in lines
    return next((one["reason"] for one in accepted() if fits(one)), None)


def page():
    """Writes the page of the book."""
    removed_checks = json.loads((RESULTS / "removed.json").read_text())
    kept = RESULTS / "generated.json"
    mutants = json.loads(kept.read_text()) if kept.exists() else []
    hashes = {file: code_hash((ROOT / file).read_text()) for file in {one["file"] for one in mutants}}

    def is_judged(mutant):
        return mutant["outcome"] != "not judged" and mutant["code"] == hashes[mutant["file"]]

    text = [
        "# Tests of the safety functions", "",
        "Would the tests notice if a safety function of the controller were broken? `bash tests/mutants.sh` breaks the controller on purpose,",
        "one change at a time, runs the tests of the host on it, and writes this page. A change is *caught* if a test fails.", "",
        "## Removed checks", "",
        "Each row is a check that was removed. A test fails without it.", "",
        "| check | file | outcome |", "| --- | --- | --- |",
    ]
    text += [f"| {one['name']} | `{one['file']}` | {one['outcome']} |" for one in removed_checks]
    caught = sum(one["outcome"] == "caught" for one in removed_checks)
    text += ["", f"{caught} of {len(removed_checks)} removed checks are caught."]
    if not mutants:
        PAGE.write_text("\n".join(text) + "\n")
        return
    text += [
        "", "## Generated changes", "",
        "cargo-mutants replaces operators and return values, and deletes arms and fields. Changes that do not compile are left out. A change is",
        "*equivalent* if no test can notice it; the reasons follow below. An outcome holds for the code that was judged: after a file has changed,",
        "its changes count as *not judged*.", "",
        "| file | judged | changes | caught | equivalent | not caught | not judged |", "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    total = [0] * 5
    built = [one for one in mutants if one["outcome"] != "not built"]
    for file in sorted({one["file"] for one in built}):
        here = [one for one in built if one["file"] == file]
        judged = [one for one in here if is_judged(one)]
        missed = [one for one in judged if one["outcome"] == "missed"]
        same = sum(reason(one) is not None for one in missed)
        row = [len(here), len(judged) - len(missed), same, len(missed) - same, len(here) - len(judged)]
        total = [a + b for a, b in zip(total, row)]
        day = max((one["judged"] for one in judged), default="—")
        text.append(f"| `{file}` | {day} | " + " | ".join(map(str, row)) + " |")
    text.append("| **all** | | " + " | ".join(f"**{n}**" for n in total) + " |")
    missed = [one for one in built if is_judged(one) and one["outcome"] == "missed"]
    same = [one for one in missed if reason(one) is not None]
    if same:
        text += ["", "## Equivalent changes", "", "These changes make no difference that a test can notice.", "", "| file | change | changed line | reason |", "| --- | --- | --- | --- |"]
        text += [f"| `{one['file']}` | {cell(one['change'])} | {cell(one['text'])} | {reason(one)} |" for one in same]
    rest = [one for one in missed if one not in same]
    if rest:
        text += ["", "## Changes that no test of the host catches", "", "| file | change | changed line |", "| --- | --- | --- |"]
        text += [f"| `{one['file']}` | {cell(one['change'])} | {cell(one['text'])} |" for one in rest]
    PAGE.write_text("\n".join(text) + "\n")


def cell(code):
    return "`" + code.replace("|", "\\|") + "`"


def main(arguments):
    match arguments:
        case ["--removed", *rest]:
            sys.exit(not removed(*rest))
        case ["--generated", *rest]:
            generated(rest)
        case ["--missed", *rest]:
            generated(rest, only_missed=True)
        case ["--page"]:
            page()
        case []:
            whole = removed()
            generated([])
            page()
            sys.exit(not whole)
        case _:
            sys.exit("tests/mutants.sh [--removed [NAME] | --generated [FILE…] | --missed [FILE…] | --page]")


if __name__ == "__main__":
    main(sys.argv[1:])
