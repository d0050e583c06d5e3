"""All changes of cargo-mutants compiled into one program. A variable of the environment selects the one that is in force.

Building the tests again for each of a thousand changes takes hours. Here every function that has changes gets a copy of its body for each:

    fn halved(x: f32) -> f32 { match crate::change_in_force() { 1 => { x * 2.0 } 2 => { x % 2.0 } _ => { x / 2.0 } } }

The program is built once and runs once for each change. A change that does not compile is found by the place of the compiler's message
and left out. Functions that are evaluated while compiling cannot choose; their changes are built one by one. A `const fn` loses its
`const` if no constant needs it.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BUILD = ["cargo", "test", "--locked", "-q", "--profile", "mutants", "-p", "firmware", "-p", "model-core", "--lib"]
VARIABLE = "CHANGE_IN_FORCE"
CHOICE = f"""
#[doc(hidden)]
pub fn change_in_force() -> u32 {{
    extern crate std;
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("{VARIABLE}").ok().and_then(|text| text.parse().ok()).unwrap_or(0))
}}
"""
# The tests take seconds. A change that makes them compute this long does not end, or hardly. Time of the processor: the machine may be
# busy. Tests that wait without end are given up after ten times as long.
PATIENCE_S = 60
# The whole program is built in minutes. A constant whose loop does not end never ends in the compiler: by its own lint
# (`long_running_const_eval`, off here with all lints) that is an error.
BUILD_PATIENCE_S = 600
# Parts of the names of tests that take seconds, by their module. They run last, on changes of their module that the others do not notice.
LATE = {"health": ["correlated_noise"], "watch": ["watch::tests::calm"], "store": ["loses_power", "lose_power"]}
# What is not code: comments, strings, characters (but no lifetimes).
NO_CODE = re.compile(r"//[^\n]*|/\*.*?\*/|r(#*)\".*?\"\1|\"(?:\\.|[^\"\\])*\"|'(?:\\[^\n]*?|[^'\\\n])'", re.DOTALL)
INLINE = re.compile(r"#\[inline(\((always|never)\))?\]")


def listed(root):
    """The changes that cargo-mutants makes, numbered from 1 on."""
    command = ["cargo", "mutants", "--list", "--json"]
    run = subprocess.run(command, cwd=root, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"`cargo mutants` does not list its changes; install it with `cargo install --locked cargo-mutants`:\n{run.stderr}")
    return [mutant | {"id": number} for number, mutant in enumerate(json.loads(run.stdout), 1)]


def ended(command, **options):
    """Runs a command; None if it had to be stopped, with all that it started."""
    with subprocess.Popen(command, start_new_session=True, **options) as child:
        try:
            stdout, stderr = child.communicate(timeout=BUILD_PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            return None
    return subprocess.CompletedProcess(command, child.returncode, stdout, stderr)


class Source:
    """The text of a file, in which cargo-mutants counts lines and columns from 1."""

    def __init__(self, text, constant=()):
        self.constant = constant
        # Copies of copies, if functions with changes were inlined into each other, would keep the compiler busy for hours.
        self.text = INLINE.sub(lambda found: " " * len(found[0]), text)
        self.code = NO_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
        self.starts = [0, *(found.end() for found in re.finditer("\n", text))]

    def at(self, place):
        return self.starts[place["line"] - 1] + place["column"] - 1

    def span(self, of):
        return self.at(of["start"]), self.at(of["end"])

    def body(self, function):
        """Where a function begins, its `const` if it has one, and where its body begins and ends, without its braces; none where it is
        evaluated while compiling."""
        begin, end = self.span(function["span"])
        name = function["function_name"].split("::")[-1].split("<")[0]
        head = re.compile(rf"\bfn\s+{re.escape(name)}\b").search(self.code, begin, end)
        if not head:
            return None
        const = re.search(r"\bconst\s+(?=(unsafe\s+)?$)", self.code[begin:head.start()])
        if const and name in self.constant:
            return None
        const = (begin + const.start(), begin + const.end()) if const else (begin, begin)
        depth = 0
        for at in range(head.end(), end):
            depth += self.code[at] in "(["
            depth -= self.code[at] in ")]"
            if self.code[at] == "{" and depth == 0:
                return begin, at + 1, self.code.rindex("}", at, end), const
        return None

    def changed(self, mutant, within):
        """A part of the text with one change in it."""
        begin, end = self.span(mutant["span"])
        return self.text[within[0]:begin] + mutant["replacement"] + " " + self.text[end:within[1]]


def assembled(source, mutants):
    """The text with all changes of a file, the lines of each of them in it, and the changes that it cannot have."""
    bodies, alone = {}, []
    for mutant in mutants:
        body = source.body(mutant["function"]) if mutant["function"] else None
        if body is None:
            alone.append(mutant)
        else:
            bodies.setdefault(body, []).append(mutant)
    # A function within another one is changed in copies of the outer one.
    for inner in sorted(bodies):
        outer = next((one for one in bodies if one[1] < inner[1] and inner[2] < one[2]), None)
        if outer:
            bodies[outer] += bodies.pop(inner)
    text, lines, line, last = [], {}, 1, 0

    def add(part, number=None):
        nonlocal line
        text.append(part)
        first, line = line, line + part.count("\n")
        if number is not None:
            lines[number] = (first, line)

    for (head, begin, end, const), here in sorted(bodies.items()):
        add(source.text[last:head] + "#[inline(never)] " + source.text[head:const[0]] + source.text[const[1]:begin] + "\nmatch crate::change_in_force() {\n")
        for mutant in here:
            add(f"{mutant['id']} => {{{source.changed(mutant, (begin, end))}}}", mutant["id"])
            add("\n")
        add(f"_ => {{{source.text[begin:end]}}}\n}}\n")
        last = end
    add(source.text[last:])
    return "".join(text), lines, alone


class Program:
    """The tests with the changes of a list."""

    def __init__(self, place, target, mutants):
        self.place = place
        self.environment = os.environ | {
            "CARGO_TARGET_DIR": str(target), "RUSTFLAGS": "--cap-lints=allow", "PROPTEST_RNG_SEED": "1",
            "PROPTEST_DISABLE_FAILURE_PERSISTENCE": "true", "RUST_MIN_STACK": str(64 << 20),
        }
        self.mutants = mutants
        self.not_built, self.alone, self.tests = set(), [], {}
        # Names of functions that constants need.
        self.constant, self.needed = set(), set()

    def build(self):
        """Builds the program; what does not compile is left out and tried again without."""
        originals = {file: (self.place / file).read_text() for file in {one["file"] for one in self.mutants}}
        roots = {file.split("/")[0] + "/src/lib.rs" for file in originals}
        originals |= {root: (self.place / root).read_text() for root in roots}
        try:
            for _ in range(20):
                places = self.write(originals, roots)
                wrong = self.compile()
                if wrong is None:
                    return
                bad = {number for file, line in wrong for number, (first, last) in places.get(file, {}).items() if first <= line <= last}
                if not bad and not self.needed:
                    sys.exit(f"the changed program cannot be built: {wrong[0][0][-2000:]}")
                self.not_built |= bad
            sys.exit("the changed program cannot be built after 20 attempts")
        finally:
            for file, text in originals.items():
                (self.place / file).write_text(text)

    def write(self, originals, roots):
        self.alone, places = [], {}
        for file, text in originals.items():
            here = [one for one in self.mutants if one["file"] == file and one["id"] not in self.not_built]
            changed, places[file], alone = assembled(Source(text, self.constant), here)
            self.alone += alone
            (self.place / file).write_text(changed + (CHOICE if file in roots else ""))
        return places

    def compile(self):
        """Builds the tests; files and lines of the errors if they cannot be built."""
        command = [*BUILD, "--no-run", "--message-format=json"]
        run = ended(command, cwd=self.place, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if run is None:
            return [("the compiler does not end", 0)]
        messages = [json.loads(line) for line in run.stdout.splitlines() if line.startswith("{")]
        if run.returncode == 0:
            built = {one["target"]["name"]: one["executable"] for one in messages if one.get("executable")}
            # Copies, so that another build does not replace what runs. A program that still runs cannot be written to.
            for name, path in built.items():
                self.tests[name] = self.place / f"{name}-tests"
                self.tests[name].unlink(missing_ok=True)
                shutil.copy(path, self.tests[name])
            return None
        wrong, words, known = [], [run.stderr[-3000:]], set(self.constant)
        for one in messages:
            if one["reason"] == "compiler-message" and one["message"]["level"] == "error":
                spans = one["message"]["spans"]
                if (one["message"]["code"] or {}).get("code") == "E0015":
                    needs = re.search(r"`([^`]*)`", one["message"]["message"])
                    self.constant |= {needs[1].split("::")[-1].split("<")[0]} if needs else set()
                words.append(one["message"]["rendered"])
                wrong += [(span["file_name"], span["line_start"]) for span in spans if span["is_primary"]]
        self.needed = self.constant - known
        return wrong or [("".join(words), 0)]

    def outcome(self, number, file):
        """Whether the tests notice the change of a number; 0 is none."""
        # The firmware uses the model, not the other way round.
        crates = ["firmware"] if file.startswith("firmware/") else ["model_core", "firmware"]
        # First the tests of the file's own module, which notice most.
        module = file.split("/")[2].removesuffix(".rs")
        skipped = [part for names in LATE.values() for name in names for part in ("--skip", name)]
        stages = [[f"{module}::", *skipped], [*skipped, "--skip", f"{module}::"]]
        for chosen in [*stages, LATE[module]] if module in LATE else stages:
            for crate in crates:
                folder = self.place / crate.replace("_", "-")
                environment = self.environment | {VARIABLE: str(number), "CARGO_MANIFEST_DIR": str(folder)}
                limited = ["sh", "-c", f'ulimit -t {PATIENCE_S} && exec "$0" "$@"']
                command = [*limited, self.tests[crate], "-q", "--test-threads=1", *chosen]
                try:
                    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=10 * PATIENCE_S)
                except subprocess.TimeoutExpired:
                    return "caught"
                if run.returncode:
                    return "caught"
        return "missed"

    def judge(self, jobs=2):
        """Each change with its outcome, as they come."""
        for file in ("firmware/src/lib.rs", "model-core/src/lib.rs"):
            if self.outcome(0, file) != "missed":
                sys.exit("the tests fail before anything is changed")
        apart = {one["id"] for one in self.alone} | self.not_built
        with ThreadPoolExecutor(jobs) as pool:
            together = [one for one in self.mutants if one["id"] not in apart]
            yield from ((one, "not built") for one in self.mutants if one["id"] in self.not_built)
            yield from zip(together, pool.map(lambda one: self.outcome(one["id"], one["file"]), together))
        for one in self.alone:
            yield one, self.alone_outcome(one)

    def alone_outcome(self, mutant):
        """The outcome of a change that has a program of its own."""
        path = self.place / mutant["file"]
        text = path.read_text()
        try:
            path.write_text(Source(text).changed(mutant, (0, len(text))))
            return "not built" if self.compile() is not None else self.outcome(0, mutant["file"])
        finally:
            path.write_text(text)
