"""Checks calls against the published JSON schemas of OCPP 2.1, which the package `ocpp` ships.

    python published_schemas.py DIR

DIR is what `table-gen ocpp export SPEC --table TABLE --key KEY --out DIR` wrote.
"""

import json
import sys
from pathlib import Path

import jsonschema
import ocpp

EXPECTED = {
    "SetChargingProfile": "SetChargingProfile",
    "SetDERControl-FreqDroop": "SetDERControl",
    "SetDERControl-EnterService": "SetDERControl",
    "SetDERControl-FreqWatt": "SetDERControl",
    "DataTransfer": "DataTransfer",
}


def main():
    schemas = Path(ocpp.__file__).parent / "v21" / "schemas"
    folder = Path(sys.argv[1])
    for name, expected in EXPECTED.items():
        kind, _, action, payload = json.loads((folder / f"{name}.json").read_text())
        if (kind, action) != (2, expected):
            sys.exit(f"{name}: {kind}, {action}; expected 2, {expected}")
        schema = json.loads((schemas / f"{action}Request.json").read_text("utf-8-sig"))
        validator = jsonschema.validators.validator_for(schema)
        # A schema that takes anything would prove nothing.
        if not list(validator(schema).iter_errors({**payload, "noSuchField": 1})):
            sys.exit(f"{action}: the schema takes an unknown field")
        for error in validator(schema).iter_errors(payload):
            sys.exit(f"{name}: {error.json_path}: {error.message}")
    print(f"{len(EXPECTED)} calls are valid by the published schemas of OCPP 2.1")


main()
