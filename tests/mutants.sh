#!/usr/bin/env bash
# Which faults in the code that keeps people safe do the tests of the controller notice?
#
#     bash tests/mutants.sh --removed       remove each check of tests/mutants/removed-checks.toml in turn (minutes)
#     bash tests/mutants.sh --generated     judge the changes that cargo-mutants makes in the files of .cargo/mutants.toml
#     bash tests/mutants.sh --missed        the same for the changes that no test has caught yet, and for files that have changed
#     bash tests/mutants.sh --page          write docs/src/mutants.md from the kept outcomes
#     bash tests/mutants.sh                 both, then write docs/src/mutants.md
#
# --generated and --missed take the beginnings of paths, such as firmware/src/control, to judge only the files there, in that order.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v python3 >/dev/null || { echo "tests/mutants.sh: no python3; install Python 3.11 or later" >&2; exit 1; }
exec python3 tests/mutants/run.py "$@"
