#!/usr/bin/env bash
# Installs the bindings from this checkout into a temporary environment with pip, as a user does, and runs their tests on recordings of the
# virtual bench and with an emulated controller. The build has no optimisation across crates, which keeps it short.
#   host/python/tests/run.sh [frames] [regression] [device] [notebook] [fleet]    # these tests only
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
if ! python3 -c 'import venv, ensurepip, sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    echo "host/python/tests/run.sh: skipped: there is no Python 3.10 or later with venv" >&2
    exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/env"
# The build back-end and NumPy are from the package index.
if ! "$work/env/bin/pip" --quiet download --no-deps --dest "$work/wheels" numpy; then
    echo "host/python/tests/run.sh: skipped: the package index is not available" >&2
    exit 0
fi
tests=("$@")
[ $# -gt 0 ] || tests=(notebook frames regression device fleet)
# The build folder of the workspace, so that crates that are built already are reused.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}
"$work/env/bin/pip" install --quiet --find-links "$work/wheels" --config-settings=build-args='--profile dev' "$root/host/python"
# With the features of the whole workspace, as in its tests: others would compile the host and many of its dependencies again.
cargo build --quiet --locked --manifest-path "$root/Cargo.toml" --workspace --bin host --bin virtual-bench
"$CARGO_TARGET_DIR/debug/virtual-bench" record --muscle mini --protocol thesis -o "$work/bench"
export PAM_HOST="$CARGO_TARGET_DIR/debug/host"
"$work/env/bin/pip" install --quiet --find-links "$work/wheels" pandas polars pyarrow scikit-learn matplotlib
if [[ " ${tests[*]} " == *" fleet "* ]]; then
    "$work/env/bin/pip" install --quiet "dask[distributed]" ray
fi
for test in "${tests[@]}"; do
    "$work/env/bin/python" "$here/test_$test.py" "$work/bench"
done
