#!/usr/bin/env bash
# Runs the workflow of examples/fleet with Snakemake on this machine, its dry run on Slurm, and the queries of the book's page on fleets.
# With PAM_LONG=1, also batches in buckets of an S3 server and an Azure server on this machine.
#
#     bash tests/fleet/run.sh [FOLDER]      FOLDER holds the programs `host` and `virtual-bench`; by default they are built,
#                                           with PAM_LONG=1 with the feature `buckets`
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
if ! python3 -c 'import venv, ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    echo "tests/fleet/run.sh: skipped: there is no Python 3.11 or later with venv" >&2
    exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# An environment that holds the packages already can be named, so that they are not installed for each run.
python=${FLEET_PYTHON:-}
if [ -z "$python" ]; then
    python3 -m venv "$work/env"
    packages=(-r "$here/requirements.txt")
    if [ -n "${PAM_LONG:-}" ]; then packages+=(-r "$here/requirements-buckets.txt"); fi
    if ! "$work/env/bin/pip" --quiet install "${packages[@]}"; then
        echo "tests/fleet/run.sh: skipped: the package index is not available" >&2
        exit 0
    fi
    python=$work/env/bin/python
fi
programs=${1:-}
if [ -z "$programs" ]; then
    features=()
    if [ -n "${PAM_LONG:-}" ]; then features=(--features host/buckets); fi
    (cd "$root" && cargo build --quiet --locked --workspace --bin host --bin virtual-bench "${features[@]}")
    programs=${CARGO_TARGET_DIR:-$root/target}/debug
fi
programs=$(cd "$programs" && pwd)
export PATH="$programs:$(dirname "$python"):$PATH" XDG_CACHE_HOME="$work/cache"

cp -r "$root/examples/fleet" "$work/fleet"
cd "$work/fleet"
echo "muscle,description,files,batch" > fleet.csv
for i in 1 2 3 4; do
    virtual-bench record --muscle mini --protocol thesis --seed $i --sample-hz 2 -o m$i > /dev/null
    echo "mini-$i,m$i/muscle.toml,m$i/*Pa.csv,B$((i % 2))" >> fleet.csv
done
echo "mini-5,m1/muscle.toml,none.csv,B0" >> fleet.csv

snakemake --profile profiles/local --quiet all > local.log 2>&1 || { cat local.log; exit 1; }
test -s fleet.html
# The workflow's shards are the whole batch.
host batch fleet.csv -o whole --quiet > whole.txt
diff -r results whole
# Nothing is left to do.
snakemake --profile profiles/local --dry-run 2>&1 | grep -q "Nothing to be done"
# The same file with another profile.
snakemake --profile profiles/slurm --dry-run --forceall > slurm.log 2>&1 || { cat slurm.log; exit 1; }
grep -Eq "^shard +4" slurm.log
"$python" "$here/queries.py" "$root/docs/src/fleets.md"
echo "fleet: workflow, dry run on Slurm and queries of the book: 3 passed, 0 failed"
if [ -n "${PAM_LONG:-}" ]; then
    "$python" "$here/buckets.py" "$programs/host" "$programs/virtual-bench"
    if command -v npx > /dev/null; then
        "$python" "$here/buckets_azure.py" "$programs/host" "$programs/virtual-bench"
    else
        echo "tests/fleet/run.sh: skipped: Azure: npm is missing" >&2
    fi
fi
