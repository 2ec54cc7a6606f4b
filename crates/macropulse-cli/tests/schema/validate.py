"""Holds every ready file and example against the schema that its first line names, and slips against
all of them.

The only argument is the root of the repository.
"""

import copy
import json
import sys
from pathlib import Path

import jsonschema

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib

ROOT = Path(sys.argv[1]).resolve()
FOLDERS = ["sensors", "scenes", "environments", "docs/examples"]
# What the others leave out, not a sensor.
DEFAULTS = ROOT / "sensors" / "defaults.toml"


def validator(path):
    schema = json.loads(path.read_text(encoding="utf-8"))
    kind = jsonschema.validators.validator_for(schema)
    kind.check_schema(schema)
    return kind(schema)


KINDS = ["sensor", "scene", "environment", "requirements"]
SCHEMAS = {kind: validator(ROOT / "schemas" / f"{kind}.json") for kind in KINDS}


def files():
    """Each file, its content, and the name of its schema."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.toml")):
            if path == DEFAULTS:
                continue
            text = path.read_text(encoding="utf-8")
            first = text.split("\n", 1)[0]
            assert first.startswith("#:schema "), f"{path} does not begin with #:schema"
            named = (path.parent / first.removeprefix("#:schema ")).resolve()
            assert named.parent == ROOT / "schemas" and named.is_file(), f"{path}: there is no {named}"
            yield path, tomllib.loads(text), named.stem


def valid(kind, content):
    return SCHEMAS[kind].is_valid(content)


count = 0
whole = {}
for path, content, kind in files():
    for fault in SCHEMAS[kind].iter_errors(content):
        sys.exit(f"{path}: {fault.json_path}: {fault.message}")
    whole.setdefault(kind, {})[path.stem] = content
    count += 1
assert count > 30, count


def but(kind, name, change):
    """A file with a slip in it."""
    content = copy.deepcopy(whole[kind][name])
    change(content)
    return kind, content


SENSOR, SCENE, ENVIRONMENT = "hdl-64e", "wall", "fog-50m"
SLIPS = {
    "a misspelt key": but("sensor", SENSOR, lambda f: f["scan"].update(max_rnage_m=90)),
    "a misspelt table": but("sensor", SENSOR, lambda f: f.update(scna={})),
    "text for a number": but("sensor", SENSOR, lambda f: f["scan"].update(max_range_m="90")),
    "a part for a whole number": but("sensor", SENSOR, lambda f: f["tdc"].update(bits=1.5)),
    "a range out of bounds": but("sensor", SENSOR, lambda f: f["scan"].update(max_range_m=-1)),
    "a wavelength in metres": but("sensor", SENSOR, lambda f: f["light"].update(wavelength_nm=9.05e-7)),
    "an unknown receiver": but("sensor", SENSOR, lambda f: f["receiver"].update(kind="best")),
    "an unknown detector": but("sensor", SENSOR, lambda f: f["detector"].update(spad={})),
    "an unknown effect": but("sensor", SENSOR, lambda f: f.update(idealised=["sun"])),
    "two patterns": but("sensor", SENSOR, lambda f: f["scan"].update(flash=dict(
        rows=1, columns=1, horizontal_deg=1, vertical_deg=1))),
    "no pattern": but("sensor", SENSOR, lambda f: f["scan"].pop("spinning")),
    "no light": but("sensor", SENSOR, lambda f: f.pop("light")),
    "a family without its value": ("sensor", {"extends": "kim-park-2016", "code": {"family": "prime"}}),
    "two families": ("sensor", {"extends": "kim-park-2016", "code": {"family": {"prime": 29, "gold": 7}}}),
    "a prism too few": ("sensor", {"extends": "rosette-mid-40", "scan": {"rosette": {"prisms": [
        {"deflection_deg": 1, "turns_per_s": 1}]}}}),
    "an object of no kind": but("scene", SCENE, lambda f: f["object"].append({"name": "a"})),
    "an object of two kinds": but("scene", SCENE, lambda f: f["object"][0].update(car={})),
    "one object as a table": but("scene", SCENE, lambda f: f.update(object={"car": {}})),
    "a position of two numbers": but("scene", SCENE, lambda f: f["object"][0].update(position_m=[1, 2])),
    "an unknown shape": but("scene", SCENE, lambda f: f["object"][0].update(shape={"cube": {}})),
    "an unknown unit": but("scene", SCENE, lambda f: f["object"][0].update(unit="km")),
    "an unknown environment": but("scene", SCENE, lambda f: f.update(environment="fog")),
    "visibility in metres": but("scene", SCENE, lambda f: f.update(environment={"visibility_m": 50})),
    "no version": but("scene", SCENE, lambda f: f.pop("version")),
    "an unknown sky": but("environment", ENVIRONMENT, lambda f: f.update(sky="clear")),
    "albedo in per cent": but("environment", ENVIRONMENT, lambda f: f.update(albedo=30)),
}
for slip, (kind, content) in SLIPS.items():
    assert not valid(kind, content), f"{slip} is valid"

# What a file may leave out: everything, if it extends another, and what has a default in any case.
assert valid("sensor", {"extends": "vlp-16"})
assert valid("sensor", {"extends": "my.toml", "scan": {"raster": {"rows": 12}}})
assert valid("sensor", {"extends": "kim-park-2016", "code": {"family": {"sparse": {"seed": 2}}}})
assert valid(*but("sensor", SENSOR, lambda f: f.pop("receiver", None) and None))
assert valid("scene", {"version": 1, "environment": "night", "object": [{"car": {}, "material": "mine"}]})
print(f"{count} files are valid, {len(SLIPS)} slips are not")
