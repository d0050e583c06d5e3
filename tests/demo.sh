#!/usr/bin/env bash
# The whole workflow on this machine, without hardware: builds what it needs, then runs `host demo` with the given options.
#
#     bash tests/demo.sh [--muscle mini|contractile|push|random:SEED] [-o FOLDER] [--json]
#
# firmware/build installs a missing compiler and QEMU. If that is not possible, the demo runs the same firmware as a library in its own
# process, and reports it.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v cargo >/dev/null || { echo "tests/demo.sh: no Rust compiler; install one from https://rustup.rs" >&2; exit 1; }
firmware/build --install mps2-an386 || echo "tests/demo.sh: continuing without QEMU" >&2
cargo build --release --locked --package host
exec target/release/host demo "$@"
