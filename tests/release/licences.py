"""Checks that every dependency has an allowed licence and comes from crates.io.

    python3 tests/release/licences.py

The allowed licences are those of deny.toml. The dependencies are those of `cargo metadata`: of every
package, feature and target.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"


def tokens(expression):
    """The words of an SPDX expression; the old `A/B` is `A OR B`."""
    spaced = expression.replace("/", " OR ").replace("(", " ( ").replace(")", " ) ")
    return spaced.replace(" WITH ", "\0WITH\0").split()


def allowed(expression, licences):
    """Whether an SPDX expression can be met with these licences. AND binds more than OR."""
    words = tokens(expression)
    at = 0

    def term():
        nonlocal at
        word = words[at]
        at += 1
        if word != "(":
            return word.replace("\0", " ") in licences
        inside = alternatives()
        assert words[at] == ")", expression
        at += 1
        return inside

    def both():
        nonlocal at
        holds = term()
        while at < len(words) and words[at] == "AND":
            at += 1
            holds = term() and holds
        return holds

    def alternatives():
        nonlocal at
        holds = both()
        while at < len(words) and words[at] == "OR":
            at += 1
            holds = both() or holds
        return holds

    holds = alternatives()
    assert at == len(words), expression
    return holds


def check_itself():
    """The expressions that the parser must get right."""
    have = {"MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception"}
    for expression, expected in [
        ("MIT", True),
        ("GPL-3.0", False),
        ("MIT/GPL-3.0", True),
        ("MIT AND GPL-3.0", False),
        ("(MIT OR GPL-3.0) AND Apache-2.0", True),
        ("GPL-3.0 OR MIT AND GPL-2.0", False),
        ("Apache-2.0 WITH LLVM-exception", True),
        ("GPL-3.0 WITH LLVM-exception", False),
    ]:
        assert allowed(expression, have) == expected, expression


def main():
    check_itself()
    config = tomllib.loads((ROOT / "deny.toml").read_text())
    licences = set(config["licenses"]["allow"])
    exceptions = {e["name"]: set(e["allow"]) for e in config["licenses"].get("exceptions", [])}
    command = ["cargo", "metadata", "--format-version", "1", "--all-features", "--locked"]
    found = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
    members = set(found["workspace_members"])
    wrong = []
    for package in found["packages"]:
        if package["id"] in members:
            continue
        name = f"{package['name']} {package['version']}"
        if package["source"] != CRATES_IO:
            wrong.append(f"{name}: from {package['source']}, not crates.io")
        licence = package["license"]
        if licence is None or not allowed(
            licence, licences | exceptions.get(package["name"], set())
        ):
            wrong.append(f"{name}: {licence}, which deny.toml does not allow")
    for line in wrong:
        print(line)
    if wrong:
        sys.exit(1)
    count = len(found["packages"]) - len(members)
    print(f"{count} dependencies, all of allowed licences and from crates.io")


main()
