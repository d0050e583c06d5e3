#!/usr/bin/env bash
# The whole story on this machine, no hardware: builds what it needs, then runs `host demo` (its options may follow).
#
#     bash tests/demo.sh [--muscle mini|contractile|push|random:SEED] [-o FOLDER] [--json]
#
# The firmware's image and QEMU are installed by firmware/build where they are missing. Where that is not possible the demo
# runs the same firmware as a library in its own process, and says so.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v cargo >/dev/null || { echo "tests/demo.sh: no Rust compiler; install one from https://rustup.rs" >&2; exit 1; }
firmware/build --install mps2-an386 || echo "tests/demo.sh: going on without QEMU" >&2
cargo build --release --locked --package host
exec target/release/host demo "$@"
