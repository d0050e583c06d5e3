#!/usr/bin/env bash
# Packs a binary, unpacks every package, and runs the program from it.
#   packaging/test.sh [BINARY]     without one, a static binary is built
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
packaging/package.sh ${1:+--binary "$1"} --output "$work/dist"
fail() { echo "packaging: $1" >&2; exit 1; }

mkdir "$work/archive" "$work/deb"
tar -C "$work/archive" --strip-components=1 -xzf "$work"/dist/pam-*.tar.gz
for called in pam host; do
    grep -q "^$called " <<< "$("$work/archive/bin/$called" --version)" || fail "$called does not run from the archive"
done
grep -q pam "$work/archive/share/bash-completion/completions/pam" || fail "no completions for bash"
for file in LICENSE-MIT LICENSE-APACHE VERSION sbom.cdx.json; do
    test -s "$work/archive/share/doc/pam/$file" || fail "$file is missing in the archive"
done
if [ -z "${1:-}" ] && command -v ldd > /dev/null; then
    linked=$(ldd "$work/archive/bin/pam" 2>&1 || true)
    grep -Eq "not a dynamic executable|statically linked" <<< "$linked" || fail "the binary is not static"
fi

if command -v dpkg-deb > /dev/null; then
    dpkg-deb -x "$work"/dist/pam_*.deb "$work/deb"
    needs=$(dpkg-deb -f "$work"/dist/pam_*.deb Depends)
    # Read whole: with pipefail a reader that ends early would make ldd fail.
    linked=$(ldd "$work/deb/usr/bin/pam" 2> /dev/null || true)
    if grep -q "libc\.so" <<< "$linked"; then
        case "$needs" in "libc6 (>= 2."*) ;; *) fail "the Debian package of a dynamic binary names no C library: $needs" ;; esac
    elif [ -n "$needs" ]; then
        fail "the Debian package of a static binary depends on $needs"
    fi
    grep -q "^pam " <<< "$("$work/deb/usr/bin/pam" --version)" || fail "pam does not run from the Debian package"
    test ! -e "$work/deb/usr/bin/host" || fail "the Debian package would replace another package's host"
    test -s "$work/deb/usr/share/doc/pam/copyright" || fail "the Debian package lacks its licences"
    grep -q "pam fit --muscle" "$work/deb/usr/share/doc/pam/README.md" || fail "the Debian package's README does not call pam"
    if grep -q "host fit" "$work/deb/usr/share/doc/pam/README.md"; then fail "the Debian package's README calls host"; fi
    test -d "$work/deb/usr/share/doc/pam/examples/imports" || fail "the Debian package lacks the examples"
    test -s "$work/deb/usr/share/man/man1/pam-fit.1.gz" || fail "the Debian package lacks manual pages"
fi
# Each package is named in the provenance with its own check sum, and the bill of materials lists what is in the program.
python3 - "$work/dist" <<'CHECK' || fail "bill of materials or provenance is wrong"
import hashlib, json, pathlib, sys
dist = pathlib.Path(sys.argv[1])
(provenance,) = map(json.loads, (path.read_text() for path in dist.glob("*.provenance.json")))
named = {one["name"]: one["digest"]["sha256"] for one in provenance["subject"]}
packages = [*dist.glob("*.tar.gz"), *dist.glob("*.deb")]
assert named == {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in packages}, named
assert provenance["predicate"]["buildDefinition"]["resolvedDependencies"][0]["digest"], "no commit"
(bill,) = map(json.loads, (path.read_text() for path in dist.glob("*.sbom.cdx.json")))
components = {one["name"]: one for one in bill["components"]}
listed = {one["bom-ref"] for one in [bill["metadata"]["component"], *bill["components"]]}
for name in ["clap", "serialport", "nalgebra", "model-core"]:
    assert components[name]["scope"] == "required", name
assert components["serde_derive"]["scope"] == "excluded", "a macro is not in the program"
assert not {"proptest", "insta", "criterion"} & components.keys(), "a library of the tests is not in the program"
assert all("licenses" in one for one in components.values()), "a licence is missing"
assert all("hashes" in one for one in components.values() if not one["name"].startswith("pam-")
           and one["name"] not in ("firmware", "model-core", "virtual-bench")), "a check sum is missing"
assert all(used in listed for one in bill["dependencies"] for used in one["dependsOn"]), "a crate that is used is not listed"
CHECK
grep -q "sha256 \"[0-9a-f]\{64\}\"" "$work/dist/pam.rb" || fail "the formula has no check sum"
echo "packaging: archive, Debian package, formula, bill of materials and provenance are complete"
