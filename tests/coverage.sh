#!/usr/bin/env bash
# Measures which lines of the libraries their unit tests and integration tests execute, and prints one row per file.
#
#     bash tests/coverage.sh                  # the whole workspace; needs the emulated firmware image (firmware/build mps2-an386)
#     bash tests/coverage.sh -p model-core    # one crate; other options of cargo-llvm-cov are passed on too
#     bash tests/coverage.sh --html           # writes target/llvm-cov/html/index.html
#
# Requires cargo-llvm-cov (cargo install --locked cargo-llvm-cov) and llvm-profdata and llvm-cov of the same LLVM version as the compiler:
# those of rustup (rustup component add llvm-tools), or those of the distribution (Debian: apt-get install llvm-VERSION).
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v cargo-llvm-cov >/dev/null; then
    echo "tests/coverage.sh: cargo-llvm-cov is missing: cargo install --locked cargo-llvm-cov" >&2
    exit 1
fi
sysroot=$(rustc --print sysroot)
host=$(rustc -vV | sed -n 's/^host: //p')
llvm=$(rustc -vV | sed -n 's/^LLVM version: \([0-9]*\).*/\1/p')
if [ ! -x "$sysroot/lib/rustlib/$host/bin/llvm-profdata" ] && [ -z "${LLVM_PROFDATA:-}" ]; then
    LLVM_PROFDATA=$(command -v "llvm-profdata-$llvm" || true)
    LLVM_COV=$(command -v "llvm-cov-$llvm" || true)
    if [ -z "$LLVM_PROFDATA" ] || [ -z "$LLVM_COV" ]; then
        echo "tests/coverage.sh: llvm-tools are missing: rustup component add llvm-tools, or apt-get install llvm-$llvm" >&2
        exit 1
    fi
    export LLVM_PROFDATA LLVM_COV
fi
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}"
if [ "${1:-}" = --html ]; then
    shift
    set -- --html "$@"
else
    set -- --summary-only "$@"
fi
case " $* " in
    *" -p "* | *" --package "*) ;;
    *) set -- --workspace "$@" ;;
esac
exec cargo llvm-cov --locked --lib --tests "$@"
