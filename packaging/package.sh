#!/usr/bin/env bash
# Packages of the host program: a static Linux binary in an archive, a Debian package, a Homebrew formula, or the archive of a binary that
# was built elsewhere (for Windows a ZIP file). Each contains both names of the program, shell completions, manual pages, and the licences.
#
# Beside them it writes the bill of materials (CycloneDX, also inside each package) and the provenance (in-toto) of the packages.
#
#   packaging/package.sh [--binary FILE] [--target TRIPLE] [--platform NAME] [--output FOLDER] [--no-deb]
#
# Without --binary a static binary is built for this machine: with the musl target where it is installed, else with a static glibc.
set -euo pipefail
cd "$(dirname "$0")/.."

binary="" target="" platform="" output="dist" deb=yes
while [ $# -gt 0 ]; do
    case "$1" in
        --binary) binary="$2"; shift 2 ;;
        --target) target="$2"; shift 2 ;;
        --platform) platform="$2"; shift 2 ;;
        --output) output="$2"; shift 2 ;;
        --no-deb) deb=no; shift ;;
        -h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' packaging/package.sh; exit 0 ;;
        *) echo "unknown option: $1" >&2; exit 2 ;;
    esac
done

version=$(sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' Cargo.toml)
machine=$(uname -m)
command -v python3 > /dev/null || { echo "packaging: no python3; install Python 3.11 or later" >&2; exit 1; }

if [ -z "$binary" ]; then
    target="$machine-unknown-linux-musl"
    if ! ls "$(rustc --print sysroot)/lib/rustlib" | grep -qx "$target"; then
        target="$machine-unknown-linux-gnu"
        export RUSTFLAGS="${RUSTFLAGS:-} -C target-feature=+crt-static"
    fi
    cargo build --release --locked -p host --bin host --target "$target" >&2
    binary="${CARGO_TARGET_DIR:-target}/$target/release/host"
fi
platform=${platform:-linux-$machine}
case "$platform" in windows*) suffix=.exe ;; *) suffix="" ;; esac

# The tree of the package. A binary of another platform cannot print its own completions; then that of this machine does.
tool="$binary"
if ! "$tool" --version > /dev/null 2>&1; then tool=${PAM_TOOL:?"set PAM_TOOL to a program that runs on this machine"}; fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
name="pam-$version-$platform"
tree="$work/$name"
mkdir -p "$tree/bin" "$tree/share/man/man1" "$tree/share/bash-completion/completions" "$tree/share/zsh/site-functions" \
    "$tree/share/fish/vendor_completions.d" "$tree/share/powershell" "$tree/share/doc/pam"
install -m 755 "$binary" "$tree/bin/host$suffix"
# One file under two names: the program looks at the name by which it was called.
if [ -z "$suffix" ]; then ln "$tree/bin/host" "$tree/bin/pam"; else cp "$tree/bin/host$suffix" "$tree/bin/pam$suffix"; fi
for called in host pam; do
    ln -sf "$(realpath "$tool")" "$work/$called"
    "$work/$called" completions bash > "$tree/share/bash-completion/completions/$called"
    "$work/$called" completions zsh > "$tree/share/zsh/site-functions/_$called"
    "$work/$called" completions fish > "$tree/share/fish/vendor_completions.d/$called.fish"
    "$work/$called" completions powershell > "$tree/share/powershell/$called.ps1"
done
"$work/pam" --quiet man -o "$tree/share/man/man1"
cp LICENSE-APACHE LICENSE-MIT README.md CHANGELOG.md "$tree/share/doc/pam/"
cp -r examples "$tree/share/doc/pam/"
echo "$version" > "$tree/share/doc/pam/VERSION"
python3 packaging/sbom.py ${target:+--target "$target"} --output "$tree/share/doc/pam/sbom.cdx.json"

mkdir -p "$output"
if [ -n "$suffix" ]; then
    archive="$name.zip"
    python3 packaging/zip.py "$tree" "$output/$archive"
else
    archive="$name.tar.gz"
    tar -C "$work" --owner=0 --group=0 --sort=name -czf "$output/$archive" "$name"
fi

if [ "$deb" = yes ] && [ -z "$suffix" ] && [ "${platform%%-*}" = linux ]; then
    # `host` belongs to another Debian package (bind9-host): only `pam` is installed beside it.
    root="$work/deb"
    mkdir -p "$root/DEBIAN" "$root/usr/bin"
    cp "$tree/bin/pam" "$root/usr/bin/pam"
    cp -r "$tree/share" "$root/usr/share"
    rm "$root/usr/share/bash-completion/completions/host" "$root/usr/share/zsh/site-functions/_host" \
        "$root/usr/share/fish/vendor_completions.d/host.fish" "$root/usr/share/powershell/host.ps1"
    commands=$("$work/pam" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p' | paste -sd'|')
    sed -i -E "s/(^|[^a-z])host ($commands)([^a-z]|$)/\1pam \2\3/g" "$root/usr/share/doc/pam/README.md"
    gzip -9n "$root"/usr/share/man/man1/*.1
    cat LICENSE-MIT LICENSE-APACHE > "$root/usr/share/doc/pam/copyright"
    case "$machine" in x86_64) arch=amd64 ;; aarch64) arch=arm64 ;; *) arch=$machine ;; esac
    # A dynamic binary names its interpreter at its beginning, and the symbol versions of the C library that it needs.
    depends=""
    if head -c 4096 "$binary" | grep -aq "/ld-linux"; then
        glibc=$(grep -ao 'GLIBC_[0-9.]*[0-9]' "$binary" | sort -Vu | tail -n 1)
        depends="Depends: libc6 (>= ${glibc#GLIBC_})"
        if grep -aq 'libgcc_s\.so\.1' "$binary"; then depends="$depends, libgcc-s1"; fi
    fi
    cat > "$root/DEBIAN/control" <<CONTROL
Package: pam
Version: $version
Architecture: $arch
Maintainer: The authors of the program <maintainers@localhost>
Section: science
Priority: optional
${depends:+$depends
}Description: tables, control and diagnosis of pneumatic artificial muscles
 Fits the table of a pneumatic artificial muscle to recordings, sends it to a
 controller, and finds what the model leaves out.
CONTROL
    chmod -R u=rwX,go=rX "$root"
    dpkg-deb --root-owner-group --build "$root" "$output/pam_${version}_$arch.deb" > /dev/null
fi

if [ -z "$suffix" ]; then
    sum=$(sha256sum "$output/$archive" | cut -d' ' -f1)
    sed -e "s/@VERSION@/$version/g" -e "s/@SHA256@/$sum/g" -e "s/@ARCHIVE@/$archive/g" packaging/pam.rb.in > "$output/pam.rb"
fi
cp "$tree/share/doc/pam/sbom.cdx.json" "$output/$name.sbom.cdx.json"
packages=("$output/$archive")
if [ -n "${arch:-}" ]; then packages+=("$output/pam_${version}_$arch.deb"); fi
python3 packaging/provenance.py --platform "$platform" ${target:+--target "$target"} --output "$output/$name.provenance.json" \
    "${packages[@]}"
echo "$output/$archive"
