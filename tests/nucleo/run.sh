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
[ $# -gt 0 ] || set -- test_image test_valves test_can test_power_cuts test_update
PYTHONDONTWRITEBYTECODE=1 exec "../../$place/bin/python" -m unittest "$@"
