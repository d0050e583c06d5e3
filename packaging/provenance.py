"""Writes from what, how and where packages were built, with the check sum of each: an in-toto statement with the predicate of SLSA 1.0.

    python3 packaging/provenance.py --platform linux-x86_64 -o FILE PACKAGE ...

The statement is not signed. On hosted continuous integration the workflow signs the same check sums (`attest-build-provenance`).
Needs git, cargo and the standard library of Python 3.11.
"""

import argparse
import hashlib
import json
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def said(*command):
    """The first line that a command prints, empty where it fails."""
    try:
        run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout.partition("\n")[0].strip()


def digest(path):
    return {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


def source():
    """The commit, and whether files differ from it."""
    commit = said("git", "rev-parse", "HEAD")
    changed = bool(said("git", "status", "--porcelain", "--untracked-files=no"))
    server, repository = os.environ.get("GITHUB_SERVER_URL"), os.environ.get("GITHUB_REPOSITORY")
    place = f"git+{server}/{repository}" if server and repository else "git+file:."
    return {"uri": place, "digest": {"gitCommit": commit} if commit else {}, "annotations": {"changed": changed}}


def statement(arguments):
    run = os.environ.get("GITHUB_RUN_ID")
    hosted = run and os.environ.get("GITHUB_SERVER_URL") and os.environ.get("GITHUB_REPOSITORY")
    home = f"{os.environ.get('GITHUB_SERVER_URL')}/{os.environ.get('GITHUB_REPOSITORY')}" if hosted else ""
    return {
        "_type": "https://in-toto.io/Statement/v1",
        "subject": [{"name": path.name, "digest": digest(path)} for path in sorted(arguments.packages)],
        "predicateType": "https://slsa.dev/provenance/v1",
        "predicate": {
            "buildDefinition": {
                "buildType": f"{home or '.'}/packaging/package.sh",
                "externalParameters": {"platform": arguments.platform, "target": arguments.target or ""},
                "internalParameters": {"rustc": said("rustc", "--version"), "cargo": said("cargo", "--version")},
                "resolvedDependencies": [
                    source(),
                    {"uri": "Cargo.lock", "digest": digest(ROOT / "Cargo.lock")},
                ],
            },
            "runDetails": {
                "builder": {"id": f"{home}/actions" if hosted else "local"},
                "metadata": {"invocationId": f"{home}/actions/runs/{run}" if hosted else ""},
            },
        },
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", required=True)
    parser.add_argument("--target", help="the platform as the compiler calls it")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    parser.add_argument("packages", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.output.write_text(json.dumps(statement(arguments), indent=1) + "\n")


main()
