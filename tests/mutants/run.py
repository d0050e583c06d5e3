"""Changes the controller on purpose and looks whether its tests notice; see tests/mutants.sh."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

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
    return place


def tested(place):
    """Whether the tests pass, fail, or cannot be built."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(TARGET / "mutants-built"), "RUSTFLAGS": "-Awarnings"}
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


def generated(arguments):
    """Runs cargo-mutants on the files of its configuration and adds its outcomes to those of earlier runs."""
    output = TARGET / "mutants-generated"
    output.mkdir(parents=True, exist_ok=True)
    if shutil.which("cargo-mutants") is None:
        sys.exit("no cargo-mutants: install it with `cargo install --locked cargo-mutants`")
    command = ["cargo", "mutants", "-j1", "--no-shuffle", "--output", str(output), *arguments]
    subprocess.run(command, cwd=ROOT, env=os.environ | {"CARGO_TARGET_DIR": str(TARGET / "mutants-cargo")})
    collected(output / "mutants.out/outcomes.json")


def missed():
    """The arguments that select the changes which no test has caught yet: lines move with every edit, so that they are not part of it."""
    mutants = json.loads((RESULTS / "generated.json").read_text())
    wanted = sorted({(one["file"], one["change"]) for one in mutants if one["outcome"] == "missed"})
    return [part for file, change in wanted for part in ("--re", f"^{re.escape(file)}:[0-9]+:[0-9]+: {re.escape(change)}$")]


def collected(outcomes):
    """Adds the outcomes of a run to the kept ones. Those of the same changes are replaced, wherever they were."""
    kept = RESULTS / "generated.json"
    fresh = {
        (mutant["file"], mutant["name"].split(": ", 1)[1])
        for one in json.loads(outcomes.read_text())["outcomes"]
        if isinstance(one["scenario"], dict) and (mutant := one["scenario"].get("Mutant"))
    }
    earlier = json.loads(kept.read_text()) if kept.exists() else []
    known = {one["name"]: one for one in earlier if (one["file"], one["change"]) not in fresh}
    for one in json.loads(outcomes.read_text())["outcomes"]:
        mutant = one["scenario"].get("Mutant") if isinstance(one["scenario"], dict) else None
        if mutant:
            summary = {"CaughtMutant": "caught", "MissedMutant": "missed", "Timeout": "caught", "Unviable": "not built"}
            # Without line and column, which move with every edit.
            name = mutant["name"].split(": ", 1)[1]
            line = mutant["span"]["start"]["line"]
            known[mutant["name"]] = {
                "name": mutant["name"], "file": mutant["file"], "line": line, "change": name,
                # The same change may occur in several lines of a function.
                "text": (ROOT / mutant["file"]).read_text().splitlines()[line - 1].strip(),
                "outcome": summary.get(one["summary"], "missed"),
            }
    RESULTS.mkdir(exist_ok=True)
    kept.write_text(json.dumps(list(known.values()), indent=1) + "\n")


def page():
    """Writes the page of the book."""
    removed_checks = json.loads((RESULTS / "removed.json").read_text())
    kept = RESULTS / "generated.json"
    mutants = json.loads(kept.read_text()) if kept.exists() else []
    accepted = tomllib.loads((HERE / "equivalent.toml").read_text()).get("mutant", [])

    def reason(mutant):
        """Why nothing could notice a change; none where it is not in the list."""
        fits = lambda one: (one["file"], one["change"]) == (mutant["file"], mutant["change"]) and one["text"] in mutant.get("text", "")
        return next((one["reason"] for one in accepted if fits(one)), None)

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
        "cargo-mutants replaces operators and return values. Changes that do not compile are left out.", "",
        "| file | changes | caught | equivalent | not caught |", "| --- | ---: | ---: | ---: | ---: |",
    ]
    total = [0, 0, 0, 0]
    built = [one for one in mutants if one["outcome"] != "not built"]
    for file in sorted({one["file"] for one in built}):
        here = [one for one in built if one["file"] == file]
        caught = sum(one["outcome"] == "caught" for one in here)
        same = sum(one["outcome"] == "missed" and reason(one) is not None for one in here)
        row = [len(here), caught, same, len(here) - caught - same]
        total = [a + b for a, b in zip(total, row)]
        text.append(f"| `{file}` | " + " | ".join(map(str, row)) + " |")
    text.append("| **all** | " + " | ".join(f"**{n}**" for n in total) + " |")
    missed = [one for one in built if one["outcome"] == "missed"]
    same = [one for one in missed if reason(one) is not None]
    if same:
        text += ["", "## Equivalent changes", "", "These changes make no difference that a test could see.", "", "| change | reason |", "| --- | --- |"]
        text += [f"| `{one['file']}`: {cell(one)} | {reason(one)} |" for one in same]
    rest = [one for one in missed if one not in same]
    if rest:
        text += ["", "## Changes that no test of the host catches", "", "| file | change |", "| --- | --- |"]
        text += [f"| `{one['file']}` | {cell(one)} |" for one in rest]
    PAGE.write_text("\n".join(text) + "\n")


def cell(one):
    return "`" + one["change"].replace("|", "\\|") + "`"


def main(arguments):
    match arguments:
        case ["--removed", *rest]:
            sys.exit(not removed(*rest))
        case ["--generated", *rest]:
            generated(rest)
        case ["--missed", *rest]:
            generated([*missed(), *rest])
        case ["--collect", path]:
            collected(Path(path))
        case ["--page"]:
            page()
        case []:
            whole = removed()
            generated([])
            page()
            sys.exit(not whole)
        case _:
            sys.exit("tests/mutants.sh [--removed [NAME] | --generated [ARGUMENTS] | --missed | --page]")


main(sys.argv[1:])
