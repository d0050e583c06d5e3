#!/usr/bin/env bash
# The Nucleo's own image, executed on a model of its chip:
#
#     bash tests/nucleo/run.sh [unittest arguments]
#
# The image is built by firmware/build; the processor (unicorn), the reader of images (pyelftools) and signatures (cryptography) are installed from PyPI into
# target/nucleo-tests the first time.
set -euo pipefail
cd "$(dirname "$0")/../.."

command -v python3 >/dev/null || { echo "tests/nucleo/run.sh: no python3; install Python 3.9 or later" >&2; exit 1; }
firmware/build --test-key nucleo-f446re
firmware/build --test-key --slot-b nucleo-f446re
place=target/nucleo-tests
if ! "$place/bin/python" -c 'import unicorn, elftools, cryptography' 2>/dev/null; then
    python3 -m venv "$place" || { echo "tests/nucleo/run.sh: no virtual environment; install Python's venv (Debian: apt-get install python3-venv)" >&2; exit 1; }
    "$place/bin/python" -m pip install --quiet --disable-pip-version-check -r tests/nucleo/requirements.txt
fi
cd tests/nucleo
run() { PYTHONDONTWRITEBYTECODE=1 "../../$place/bin/python" -m unittest "$@"; }
if [ $# -gt 0 ]; then
    run "$@"
    exit
fi

# One process for each file, as many at a time as there are processors: what is executed has a clock of its own. The longest begin first.
logs=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$logs"' EXIT
files=(test_image test_can test_valves test_power_cuts test_update)
for file in "${files[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; do wait -n || true; done
    { run "$file" > "$logs/$file" 2>&1 && touch "$logs/$file.passed"; } &
done
wait || true
status=0
for file in "${files[@]}"; do
    echo "-- $file"
    cat "$logs/$file"
    [ -e "$logs/$file.passed" ] || status=1
done
exit $status
