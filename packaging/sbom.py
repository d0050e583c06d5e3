"""Writes the bill of materials of a package: every crate that is in the program, with its version, source, check sum and licence.

    python3 packaging/sbom.py --target x86_64-unknown-linux-musl -o sbom.cdx.json

The form is CycloneDX 1.6. Crates that only tests or build scripts use are not in the program and are left out; macros that run in the
compiler are listed with the scope `excluded`. Everything comes from Cargo.lock and `cargo metadata`, so the same commit gives the same
bytes. Needs cargo and the standard library of Python 3.11.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess
import tomllib
import uuid

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = "host"


def metadata(target):
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--manifest-path", str(ROOT / "host/Cargo.toml")]
    if target:
        command += ["--filter-platform", target]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def checksums():
    """SHA-256 of each crate's archive, by name and version."""
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    return {(one["name"], one["version"]): one.get("checksum") for one in lock["package"]}


def in_program(meta):
    """The packages that the program is made of, each with those it uses: normal dependencies, followed from the program."""
    nodes = {node["id"]: node for node in meta["resolve"]["nodes"]}
    packages = {package["id"]: package for package in meta["packages"]}
    macros = {key for key, one in packages.items() if any("proc-macro" in target["kind"] for target in one["targets"])}
    start = next(key for key, one in packages.items() if one["name"] == PROGRAM and one["source"] is None)
    found, compiled, waiting = {}, set(), [(start, False)]
    while waiting:
        key, in_compiler = waiting.pop()
        in_compiler |= key in macros
        # Again where a crate that only macros used before is in the program itself.
        if key in found and (in_compiler or key in compiled):
            continue
        if not in_compiler:
            compiled.add(key)
        uses = [dep["pkg"] for dep in nodes[key]["deps"] if any(kind["kind"] is None for kind in dep["dep_kinds"])]
        found[key] = sorted(uses)
        waiting += [(one, in_compiler) for one in uses]
    return start, packages, found, compiled


def reference(package):
    return f"pkg:cargo/{package['name']}@{package['version']}"


def component(package, sums, kind="library", scope="required"):
    one = {
        "type": kind,
        "bom-ref": reference(package),
        "name": package["name"],
        "version": package["version"],
        "purl": reference(package),
        "scope": scope,
    }
    if package["license"]:
        # Older crates separate alternatives with a slash.
        one["licenses"] = [{"expression": " ".join(package["license"].replace("/", " OR ").split())}]
    if checksum := sums.get((package["name"], package["version"])):
        one["hashes"] = [{"alg": "SHA-256", "content": checksum}]
    if package["repository"]:
        one["externalReferences"] = [{"type": "vcs", "url": package["repository"]}]
    return one


def bill(target):
    start, packages, found, compiled = in_program(metadata(target))
    sums = checksums()
    order = sorted((key for key in found if key != start), key=lambda key: reference(packages[key]))
    scope = lambda key: "required" if key in compiled else "excluded"
    program = component(packages[start], sums, "application")
    del program["scope"]
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": program,
            "properties": [{"name": "cargo:target", "value": target or "any"}],
        },
        "components": [component(packages[key], sums, scope=scope(key)) for key in order],
        "dependencies": [
            {"ref": reference(packages[key]), "dependsOn": sorted({reference(packages[used]) for used in found[key]})}
            for key in [start, *order]
        ],
    }
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
    document["serialNumber"] = uuid.uuid5(uuid.NAMESPACE_OID, digest).urn
    return document


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", help="the platform for which the program was built")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.output.write_text(json.dumps(bill(arguments.target), indent=1) + "\n")


main()
