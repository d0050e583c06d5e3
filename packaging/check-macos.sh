#!/usr/bin/env bash
# Compiles the program for macOS on Linux, as far as that goes without a Mac: everything but the linking, which needs Apple's frameworks.
#
#   packaging/check-macos.sh
#
# Needs rustup, `python3-venv` and a network: Zig compiles the C sources of libraries, and comes as a Python package.
set -euo pipefail
cd "$(dirname "$0")/.."

triple=aarch64-apple-darwin
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rustup target add $triple
python3 -m venv "$work/zig"
"$work/zig/bin/pip" install --quiet ziglang==0.17.1 cargo-zigbuild==0.24.1
PATH="$work/zig/bin:$PATH" cargo-zigbuild check -p host --bins --locked --target $triple
echo "packaging/check-macos.sh: the program compiles for macOS"
