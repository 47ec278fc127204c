"""Writes what an image is made of, as CycloneDX 1.5: the bill of materials of a release.

    python3 tests/release/sbom.py out/firmware/holdfast.cdx.json [FEATURE,...]

The components are the crates that are linked for the board (`cargo tree` with the board's target and
features, no build tools), with the checksums of Cargo.lock. The same source gives the same file.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = "thumbv7em-none-eabihf"


def cargo(*arguments):
    command = ["cargo", *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def licence(text):
    return [{"expression": text.replace("/", " OR ")}] if text else []


def main():
    out = Path(sys.argv[1])
    features = sys.argv[2] if len(sys.argv) > 2 else "board"
    tree = cargo(
        *["tree", "--locked", "-p", "product", "--features", features, "--target", TARGET],
        *["-e", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}|{l}"],
    )
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    sums = {(p["name"], p["version"]): p.get("checksum") for p in lock["package"]}
    components, product = [], None
    for line in sorted(set(tree.splitlines())):
        package, text = line.replace(" (*)", "").split("|")
        name, version = package.split()[0], package.split()[1].removeprefix("v")
        component = {
            "type": "library",
            "bom-ref": f"pkg:cargo/{name}@{version}",
            "name": name,
            "version": version,
            "licenses": licence(text),
            "purl": f"pkg:cargo/{name}@{version}",
        }
        if name == "product":
            product = {**component, "type": "firmware", "name": "holdfast"}
            continue
        checksum = sums[name, version]
        # A package of this workspace stands with its folder, and has no checksum.
        assert checksum or "(" in package, f"{name} {version} has no checksum in Cargo.lock"
        if checksum:
            component["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        if component not in components:
            components.append(component)
    assert product and len(components) > 5, "the tree is not that of an image"
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": product,
            "properties": [
                {"name": "holdfast:target", "value": TARGET},
                {"name": "holdfast:features", "value": features},
            ],
        },
        "components": components,
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(bill, indent=2) + "\n")
    print(f"{out}: {len(components)} components")


main()
