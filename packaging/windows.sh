#!/usr/bin/env bash
# The package for Windows, built on Linux with MinGW and tried under Wine: the demo, a fit and a diagnosis from the unpacked ZIP file, whose
# results are compared with those of the program for this machine.
#
#   packaging/windows.sh [--binary FILE] [--output FOLDER]
#
# Needs rustup, `gcc-mingw-w64-x86-64` and `wine64`. Without --binary the program is built.
set -euo pipefail
cd "$(dirname "$0")/.."

binary="" output="dist"
while [ $# -gt 0 ]; do
    case "$1" in
        --binary) binary="$2"; shift 2 ;;
        --output) output="$2"; shift 2 ;;
        -h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' packaging/windows.sh; exit 0 ;;
        *) echo "unknown option: $1" >&2; exit 2 ;;
    esac
done
fail() { echo "packaging/windows.sh: $1" >&2; exit 1; }
for tool in rustup x86_64-w64-mingw32-gcc wine python3; do
    command -v $tool > /dev/null || fail "$tool is missing"
done

triple=x86_64-pc-windows-gnu
rustup target add $triple 2> /dev/null || fail "rustup could not install the target $triple"
target=${CARGO_TARGET_DIR:-target}
if [ -z "$binary" ]; then
    cargo build --release --locked -p host --bin host --target $triple
    binary="$target/$triple/release/host.exe"
fi
# The program for this machine prints the completions, and gives the results to compare with.
cargo build --release --locked -p host --bin host
native=$(realpath "$target/release/host")
package=$(PAM_TOOL="$native" packaging/package.sh --binary "$binary" --platform windows-x86_64 --target $triple --output "$output" --no-deb)

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m zipfile -e "$package" "$work"
bin=$(echo "$work"/pam-*/bin)
for file in share/doc/pam/LICENSE-MIT share/doc/pam/LICENSE-APACHE share/doc/pam/VERSION share/doc/pam/sbom.cdx.json share/powershell/pam.ps1; do
    test -s "$bin/../$file" || fail "$file is missing in the package"
done

export WINEDEBUG=-all WINEPREFIX="$work/wine"
wine wineboot --init > /dev/null 2>&1 || true
if [ ! -e "$WINEPREFIX/drive_c/windows/system32/bcryptprimitives.dll" ]; then
    # Wine before 8.7 has no such library, which Windows has since 7. The program asks it for random numbers.
    cat > "$work/random.c" <<'SOURCE'
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) { return SystemFunction036(data, (ULONG)size); }
SOURCE
    x86_64-w64-mingw32-gcc -shared -o "$bin/bcryptprimitives.dll" "$work/random.c" -ladvapi32
fi

for called in pam host; do
    grep -q "^$called " <<< "$(wine "$bin/$called.exe" --version)" || fail "$called.exe does not run"
    grep -q "^Usage: $called \[" <<< "$(wine "$bin/$called.exe" --help)" || fail "the help of $called.exe does not call it $called"
done
wine "$bin/pam.exe" --help | head -n 1 > /dev/null || fail "a reader that stops reading is a failure"
cd "$work"
wine "$bin/pam.exe" --quiet demo -o demo > /dev/null || fail "the demo fails"
for called in wine native; do
    program=("$native")
    if [ $called = wine ]; then program=(wine "$bin/pam.exe"); fi
    "${program[@]}" --quiet fit --muscle demo/muscle.toml demo/0*.csv -o $called.pam --json fit-$called.json --report fit-$called.html > /dev/null
    "${program[@]}" --quiet diagnose --muscle demo/muscle.toml demo/0*.csv --json diagnosis-$called.json > /dev/null
done
if wine "$bin/pam.exe" fit --muscle none.toml none.csv -o none.pam 2> error.txt; then fail "a missing file is not a failure"; fi
grep -q "none.toml" error.txt || fail "the error does not name the missing file"
python3 - <<'COMPARE' || fail "results differ from those of this machine"
import json
import math


def differences(one, other, at=""):
    """Where two results differ by more than rounding: the C libraries of both systems round exponentials and logarithms differently."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        for key in one:
            yield from differences(one[key], other[key], f"{at}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other)):
            yield from differences(*pair, f"{at}[{number}]")
    elif isinstance(one, float) and isinstance(other, float):
        if not math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-9):
            yield f"{at}: {one} and {other}"
    elif one != other:
        yield f"{at}: {one!r} and {other!r}"


found = []
for result in ["fit", "diagnosis"]:
    one, other = (json.load(open(f"{result}-{called}.json")) for called in ["wine", "native"])
    found += differences(one, other, result)
print("\n".join(found[:10]))
raise SystemExit(bool(found))
COMPARE
echo "packaging/windows.sh: $package runs, and its results are those of this machine"
