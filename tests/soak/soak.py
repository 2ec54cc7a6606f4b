"""What the scripts of this folder share: the program they try, and where their results go."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / "docs" / "hardening.md"

# A scan of a few kilobytes, made in some ten milliseconds.
SMALL = ["--set", "scan.raster.rows=8", "--set", "scan.raster.columns=24"]
SENSOR = "kim-park-2016-fixed"

# The same of a sensor whose converters give samples: two of its beams, as dense in time.
SAMPLED = ["coded-32", "--without", "eye-safety", "--set", "scan.scans_per_s=10000", "--set", "scan.raster.rows=4",
           "--set", "scan.raster.beams=2", "--set", "scan.raster.columns=24", "--set", "scan.raster.vertical_deg=0.2",
           "--set", "scan.raster.horizontal_deg=1.2", "--set", "scan.raster.mirror=uniform",
           "--set", "scan.raster.duty=0.8"]

# A search for a lidar that takes seconds, and finds one.
REQUIREMENTS = """version = 1
name = "small"
[wanted]
rows = 30
columns = 212
horizontal_deg = 10.8
vertical_deg = 1.52
scans_per_s = 800.0
range_m = 150.0
clutter_m = 300.0
reflectance = 0.5
[parts]
detectors = ["inalas"]
marks = [3]
beams = [15, 30]
facets = [24]
polygon_mm = 700.0
"""


def program():
    """The program under test: MACROPULSE, or the one that cargo has built."""
    named = os.environ.get("MACROPULSE")
    built = [ROOT / "target" / profile / "macropulse" for profile in ("release", "debug")]
    for path in [Path(named)] if named else built:
        if path.is_file():
            return str(path.resolve())
    sys.exit("no program: cargo build -p macropulse-cli --release, or name one in MACROPULSE")


def fuzz_targets():
    """Names of the targets of the fuzzers."""
    return re.findall(r'path = "fuzz_targets/(\w+)\.rs"', (ROOT / "fuzz" / "Cargo.toml").read_text())


def files(folder):
    """All files below a folder, each with its bytes, but hidden ones."""
    found = {}
    for path in sorted(Path(folder).rglob("*")):
        if path.is_file() and not path.name.startswith("."):
            found[str(path.relative_to(folder))] = path.read_bytes()
    return found


def without_times(name, data):
    """The bytes of a file without what differs between runs: the times that they took, and what
    was found in their folder."""
    if not name.endswith(".json"):
        return data
    text = data.decode()
    for key in ("times_s", "warnings"):
        text = re.sub(rf'"{key}": (\{{[^}}]*\}}|\[[^\]]*\])', f'"{key}": 0', text)
    return text.encode()


def differing(found, whole):
    """Names of files in `found` that are not, or not the same, in `whole`."""
    same = lambda name: name in whole and (
        without_times(name, found[name]) == without_times(name, whole[name])
    )
    return [name for name in found if not same(name)]


def run(words, **options):
    """Runs the program to its end; what it says if it fails."""
    done = subprocess.run([program(), *words], capture_output=True, text=True, **options)
    return done.returncode, done.stderr


def report(name, lines, is_kept):
    """Prints a section, and with `is_kept` puts it in place of the last one of that name in
    docs/hardening.md."""
    section = "\n".join(lines).strip()
    print(section)
    if not is_kept:
        return
    begin, end = f"<!-- tests/soak/{name} -->", f"<!-- no figures: made by tests/soak/{name} -->"
    text = REPORT.read_text()
    if begin not in text:
        sys.exit(f"{REPORT} has no place for {name}")
    before, rest = text.split(begin, 1)
    REPORT.write_text(f"{before}{begin}\n\n{section}\n\n{end}{rest.split(end, 1)[1]}")
