#!/usr/bin/env bash
# Runs the tests, in one of three tiers:
#
#     bash tests/all.sh --quick    # format, language, unit tests of the libraries: up to 3 minutes on 2 cores after the first build
#     bash tests/all.sh            # the whole suite: about 20 minutes after the build of the tests, 35 with it
#     bash tests/all.sh --long     # the whole suite, the long tests, and the coverage
#
#     --lint                       # with any tier: Clippy, documentation, licences of the dependencies
#
# The README lists the contents of each tier. Tests on real recordings run if the recordings are next to the project
# (../shared/data). A missing tool skips its test with a message; with CI=true it is installed if possible, and is a failure otherwise.
set -euo pipefail
cd "$(dirname "$0")/.."

tier=whole
lint=no
for argument in "$@"; do
    case $argument in
        --quick) tier=quick ;;
        --long) tier=long ;;
        --lint) lint=yes ;;
        *) echo "tests/all.sh: unknown option '$argument'; options: --quick, --long, --lint" >&2; exit 2 ;;
    esac
done

say() { echo "tests/all.sh: $*"; }
has() { command -v "$1" >/dev/null 2>&1; }

# Steps beside others end with the script.
trap 'kill $(jobs -p) 2>/dev/null || true' EXIT

failed=0
report=()
# A step that fails does not stop the others.
step() {
    local name=$1 start=$SECONDS outcome=passed
    shift
    echo "== $name =="
    "$@" || { failed=1; outcome=FAILED; }
    report+=("$(printf '%-28s %-7s %5d s' "$name" "$outcome" $((SECONDS - start)))")
}

# Starts a step beside the steps that follow: one that mostly waits, for simulated time or for downloads. `join` prints what it said.
beside_names=() beside_pids=() beside_logs=()
beside() {
    local name=$1 log
    shift
    log=$(mktemp)
    {
        start=$SECONDS status=0
        "$@" || status=$?
        echo $((SECONDS - start)) > "$log.seconds"
        exit $status
    } > "$log" 2>&1 < /dev/null &
    beside_names+=("$name") beside_pids+=($!) beside_logs+=("$log")
}

# Waits for all steps of `beside`.
join() {
    local i outcome
    for i in "${!beside_names[@]}"; do
        outcome=passed
        wait "${beside_pids[$i]}" || { failed=1; outcome=FAILED; }
        echo "== ${beside_names[$i]} =="
        cat "${beside_logs[$i]}"
        report+=("$(printf '%-28s %-7s %5d s' "${beside_names[$i]}" "$outcome" "$(cat "${beside_logs[$i]}.seconds")")")
        rm -f "${beside_logs[$i]}" "${beside_logs[$i]}.seconds"
    done
    beside_names=() beside_pids=() beside_logs=()
}

# Whether a tool is there; in continuous integration the distribution's packages are installed first. Its absence is a failure there.
require() {
    local what=$1 tool=$2
    shift 2
    has "$tool" && return 0
    if [ "${CI:-}" = true ] && has apt-get; then
        local root=()
        [ "$(id -u)" = 0 ] || root=(sudo)
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2 || true
        "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >&2 || true
        has "$tool" && return 0
    fi
    if [ "${CI:-}" = true ]; then
        say "FAILED: $what: $tool is missing and could not be installed (packages: $*)" >&2
        failed=1
    else
        say "skipped: $what: $tool is missing (packages: $*)"
    fi
    return 1
}

has cargo || { echo "tests/all.sh: no Rust compiler; install one from https://rustup.rs" >&2; exit 1; }
target=${CARGO_TARGET_DIR:-target}
# Property tests draw the same cases in every run, so that a failure can be repeated; another number draws other cases.
export PROPTEST_RNG_SEED="${PROPTEST_RNG_SEED:-1}"

# The programs are built with the features of the whole workspace, as in the tests: those of one package would compile the host and many
# of its dependencies again.
browser() {
    cargo build --quiet --locked --workspace --bin host && python3 tests/studio.py "$target/debug/host"
}

packages() {
    cargo build --quiet --locked --workspace --bin pam && bash packaging/test.sh "$target/debug/pam"
}

# The names of test programs whose source matches a pattern.
programs() {
    cargo metadata --no-deps --locked --format-version 1 | tr '{' '\n' | grep '^"kind":\["test"\]' | grep "$@" | sed 's/.*"name":"\([^"]*\)".*/\1/' | sort -u
}

# Names as options of `cargo test`.
chosen() { sed 's/^/--test /'; }

# Tests of the emulated controller run alone: a controller that gets no processor falls silent. The same packages are selected as for the
# other tests: others would have other features, and compile everything again. A name that both have runs here.
emulator_tests() {
    # shellcheck disable=SC2046 # words on purpose
    cargo test --workspace --locked --no-fail-fast $(programs /tests/emulator/ | chosen)
}

other_tests() {
    local status=0
    # shellcheck disable=SC2046 # words on purpose
    cargo test --workspace --locked --no-fail-fast --lib --bins --examples \
        $(comm -23 <(programs .) <(programs /tests/emulator/) | chosen) || status=1
    cargo test --workspace --locked --no-fail-fast --doc || status=1
    return $status
}

language() {
    local status=0
    bash tests/prose/run.sh --sources || status=$?
    # 3: the linter could not be installed, for example without a network.
    if [ $status = 3 ] && [ "${CI:-}" != true ]; then
        say "skipped: language of pages and sources: the linter could not be installed"
        return 0
    fi
    return $status
}

board_documentation() {
    # The files of the boards compile for their target only. The distribution's compiler, which builds the images on machines
    # without rustup, is not used for documentation.
    local triple=thumbv7em-none-eabihf board
    if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$triple/lib" ]; then
        say "skipped: documentation of the boards: rustup target add $triple"
        return 0
    fi
    for board in mps2-an386 nucleo-f446re; do
        RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked --package firmware --target $triple --no-default-features \
            --features $board --target-dir "$target/firmware/doc" || return 1
    done
}

if cargo fmt --version >/dev/null 2>&1; then
    step "format" cargo fmt --all --check
fi
if require "language of pages and sources" npm nodejs npm; then
    step "language of pages and sources" language
fi
step "subjects of commits" bash tests/commits.sh
if require "picture of the crates" python3 python3; then
    step "picture of the crates" python3 tests/crates.py --check
fi

if [ $tier = quick ]; then
    step "unit tests" cargo test --workspace --locked --no-fail-fast --lib
else
    [ -d ../shared/data ] || say "skipped: tests on real recordings: ../shared/data does not exist"
    step "firmware image, emulated" firmware/build --install mps2-an386
    step "firmware image, Nucleo" firmware/build nucleo-f446re
    step "build of the tests" cargo test --quiet --workspace --locked --no-run
    step "tests with the emulator" emulator_tests
    if require "Python bindings" python3 python3 python3-venv; then
        beside "Python bindings" bash host/python/tests/run.sh
    fi
    step "tests" other_tests
    if require "live view in a browser" python3 python3 && require "live view in a browser" chromedriver chromium chromium-driver; then
        step "live view in a browser" browser
    fi
    if has dpkg-deb; then
        step "packages" packages
    else
        say "skipped: packages: dpkg-deb is missing"
    fi
    if require "fleet on a workflow engine" python3 python3 python3-venv; then
        step "fleet on a workflow engine" bash tests/fleet/run.sh
    fi
    if require "image of the Nucleo, executed" python3 python3 python3-venv; then
        step "image of the Nucleo, executed" bash tests/nucleo/run.sh
    fi
    join
fi
if [ $tier = long ]; then
    step "long tests" env PAM_LONG=1 cargo test --workspace --release --locked --no-fail-fast \
        --test kills --test closed_loop --test commands --test batch --test soak
    if require "batch in a bucket" python3 python3 python3-venv; then
        step "batch in a bucket" env PAM_LONG=1 bash tests/fleet/run.sh
    fi
    if has rustup && require "package for Windows" x86_64-w64-mingw32-gcc gcc-mingw-w64-x86-64 &&
        require "package for Windows" wine wine wine64 && require "package for Windows" python3 python3; then
        step "package for Windows" packaging/windows.sh --output "$(mktemp -d)"
    fi
    if has rustup && require "compiled for macOS" python3 python3 python3-venv; then
        step "compiled for macOS" packaging/check-macos.sh
    fi
    if has cargo-llvm-cov; then
        step "coverage" bash tests/coverage.sh
    else
        say "skipped: coverage: cargo install --locked cargo-llvm-cov"
    fi
fi

if [ $lint = yes ]; then
    step "Clippy" cargo clippy --workspace --all-targets --locked -- -D warnings
    step "documentation" env RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked
    step "documentation of the boards" board_documentation
    if has cargo-deny; then
        # Advisories change from day to day and need a network: .github/workflows/ci.yml checks them.
        step "licences of dependencies" cargo deny --locked check bans licenses sources
    else
        say "skipped: licences of dependencies: cargo install --locked cargo-deny"
    fi
fi

echo "== summary =="
printf '%s\n' "${report[@]}"
if [ $failed = 0 ]; then
    say "all tests of the $tier tier passed in $SECONDS s"
else
    say "FAILED, see above ($SECONDS s)" >&2
fi
exit $failed
