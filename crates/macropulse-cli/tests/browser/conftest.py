"""A browser, the program, and clouds read in another way than the pages do."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

# As on a machine without a screen or a graphics unit; nothing but files is opened.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WIDE = {"width": 1400, "height": 900}
NARROW = {"width": 390, "height": 844}


def macropulse(*words):
    """Runs the program; gives what it printed."""
    ran = subprocess.run([os.environ["MACROPULSE"], *map(str, words)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def read_pcd(path):
    """The points of a binary PCD file, a record each."""
    header, _, body = path.read_bytes().partition(b"DATA binary\n")
    lines = dict(line.split(" ", 1) for line in header.decode().splitlines() if line[0] != "#")
    kinds = zip(lines["TYPE"].split(), lines["SIZE"].split(), strict=True)
    formats = ["<" + kind.lower() + size for kind, size in kinds]
    points = np.frombuffer(body, np.dtype(list(zip(lines["FIELDS"].split(), formats, strict=True))))
    return points.reshape(int(lines["HEIGHT"]), int(lines["WIDTH"]))


def write_pcd(path, points):
    """A binary PCD file as other programs write it: x, y and z of each point, nothing else."""
    count = len(points)
    header = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    path.write_bytes(header.encode() + np.asarray(points, "<f4").tobytes())


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        program = os.environ["MACROPULSE_CHROMIUM"]
        chromium = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture
def visit(browser):
    """Opens a page from disk. Whatever it asks of a network, and any error of it, is a failure."""
    contexts, faults = [], []

    def visit(path, size=WIDE, scheme="light", touch=False):
        context = browser.new_context(viewport=size, color_scheme=scheme, has_touch=touch)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("request", lambda request: request.url.startswith(("file:", "blob:", "data:")) or faults.append(request.url))
        page.goto(Path(path).absolute().as_uri())
        return page

    yield visit
    for context in contexts:
        context.close()
    assert faults == []


@pytest.fixture(scope="session")
def pictures():
    """Folder of screenshots for people to look at."""
    folder = Path(os.environ["MACROPULSE_PICTURES"]) / "browser"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def coarse(tmp_path_factory):
    """Two scans of a few shots, whose points lie far apart on a screen, beside the truth."""
    folder = tmp_path_factory.mktemp("runs") / "coarse grid"
    words = (
        "--sensor kim-park-2016-fixed --scene street --set scan.raster.rows=24 --set "
        "scan.raster.columns=48 --scans 2 --truth --format pcd,png,csv -o"
    )
    macropulse("simulate", *words.split(), folder)
    return folder


@pytest.fixture(scope="session")
def street(tmp_path_factory):
    """A scan of 407 040 shots."""
    folder = tmp_path_factory.mktemp("runs") / "street"
    macropulse("simulate", *"--sensor kim-park-2016-fixed --scene street -o".split(), folder)
    return folder
