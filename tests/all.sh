#!/usr/bin/env bash
# Every test: both firmware images, all crates with their documentation, the firmware in QEMU, the page in a browser.
#
#     bash tests/all.sh            # everything
#     bash tests/all.sh --lint     # and clippy, and documentation without a warning
#
# Missing tools for the firmware are installed (firmware/build --install). Tests on real recordings run where these are
# beside the project (../shared/data), the test of the page where Chromium is; both say so when they are skipped.
set -euo pipefail
cd "$(dirname "$0")/.."

lint=no
for argument in "$@"; do
    case $argument in
        --lint) lint=yes ;;
        *) echo "tests/all.sh: '$argument' is no option; there is --lint" >&2; exit 2 ;;
    esac
done

command -v cargo >/dev/null || { echo "tests/all.sh: no Rust compiler; install one from https://rustup.rs" >&2; exit 1; }
[ -d ../shared/data ] || echo "tests/all.sh: tests on real recordings are skipped: ../shared/data is not there"
browser=no
if command -v chromedriver >/dev/null && command -v python3 >/dev/null; then browser=yes; fi
[ $browser = yes ] || echo "tests/all.sh: the test of the page is skipped: there is no chromedriver, or no python3"

# Property tests draw the same cases in every run, so that a red run can be repeated; another number tries others.
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}"

began=$SECONDS
echo "== firmware images =="
firmware/build --install mps2-an386
firmware/build nucleo-f446re

if command -v rustfmt >/dev/null && cargo fmt --version >/dev/null 2>&1; then
    echo "== format =="
    cargo fmt --all --check
fi

echo "== tests =="
failed=0
cargo test --workspace --locked --no-fail-fast || failed=$?

if [ "$browser" = yes ]; then
    echo "== the page in a browser =="
    { cargo build --quiet --locked --package host && python3 tests/studio.py target/debug/host; } || failed=$?
fi

if command -v python3 >/dev/null; then
    echo "== Python =="
    bash host/python/tests/run.sh || failed=$?
else
    echo "tests/all.sh: the Python bindings are not tested: there is no python3"
fi

if [ "$lint" = yes ]; then
    echo "== lints =="
    cargo clippy --workspace --all-targets --locked -- -D warnings || failed=$?
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked || failed=$?
    # The boards' own files are only there for their target; the distribution's compiler, which builds the images elsewhere, is not asked.
    target=thumbv7em-none-eabihf
    if [ -d "$(rustc --print sysroot)/lib/rustlib/$target/lib" ]; then
        for board in mps2-an386 nucleo-f446re; do
            RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked --package firmware --target $target --no-default-features \
                --features $board --target-dir target/firmware/doc || failed=$?
        done
    fi
fi

if [ "$failed" = 0 ]; then
    echo "tests/all.sh: everything passed in $((SECONDS - began)) s"
else
    echo "tests/all.sh: FAILED, see above ($((SECONDS - began)) s)" >&2
fi
exit "$failed"
