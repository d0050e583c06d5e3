#!/usr/bin/env bash
# Measures which lines of the libraries their unit tests and integration tests execute, and prints one row per file.
#
#     bash tests/coverage.sh [--html]     # --html writes target/llvm-cov/html/index.html
#
# Requires cargo-llvm-cov (cargo install --locked cargo-llvm-cov) and the llvm-tools of the compiler (rustup component add
# llvm-tools). The tools must be of the compiler's own LLVM version: those of a distribution cannot read its profiles.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v cargo-llvm-cov >/dev/null; then
    echo "tests/coverage.sh: cargo-llvm-cov is missing: cargo install --locked cargo-llvm-cov" >&2
    exit 1
fi
sysroot=$(rustc --print sysroot)
host=$(rustc -vV | sed -n 's/^host: //p')
if [ ! -x "$sysroot/lib/rustlib/$host/bin/llvm-profdata" ] && [ -z "${LLVM_PROFDATA:-}" ]; then
    echo "tests/coverage.sh: llvm-tools are missing: rustup component add llvm-tools (or set LLVM_COV and LLVM_PROFDATA)" >&2
    exit 1
fi
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}"
if [ "${1:-}" = --html ]; then
    exec cargo llvm-cov --workspace --locked --lib --tests --html
fi
exec cargo llvm-cov --workspace --locked --lib --tests --summary-only
