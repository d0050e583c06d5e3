#!/usr/bin/env bash
# Installs the bindings from this checkout into an environment of its own and runs their tests on the virtual bench.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv --system-site-packages "$work/env"
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target/python}
"$work/env/bin/pip" install --quiet "$root/host/python"
(unset CARGO_TARGET_DIR && cargo run -q --manifest-path "$root/Cargo.toml" -p virtual-bench -- record --muscle mini --protocol thesis -o "$work/bench")
"$work/env/bin/python" "$here/test_notebook.py" "$work/bench"
