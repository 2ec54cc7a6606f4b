"""The Python of the pages: fragments run one after the other, and print what the page says.

What a page tells its reader to save as a file is no fragment: the tests of the program run that.
"""

import contextlib
import importlib.util
import io
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]

# What the Python of a page needs beside the package.
NEEDS = {"docs/guide/cluster.md": "ray"}

# Pages whose Python reads what their commands have written.
AFTER_COMMANDS = {"docs/guide/ros.md"}

BLOCK = re.compile(r"^```(\w+)( [^\n]*)?\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def blocks(page):
    """Language and text of each block of a page that is run here, in order."""
    text = (ROOT / page).read_text()
    for found in BLOCK.finditer(text):
        language, rest, body = found.groups()
        paragraph = text[: found.start()].rstrip().rpartition("\n\n")[2]
        is_saved = re.search(r"`[^`/ ]+\.py`", paragraph)
        if rest is None and not (language == "python" and is_saved):
            yield language, body


PAGES = [
    str(page.relative_to(ROOT))
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if any(language == "python" for language, _ in blocks(page.relative_to(ROOT)))
]


def test_the_pages_with_python_are_found():
    assert {"README.md", "docs/formats.md", "docs/guide/python.md"} <= set(PAGES)


@pytest.mark.parametrize("page", PAGES)
def test_the_python_of_a_page_does_what_it_says(page, program, tmp_path, monkeypatch):
    package = NEEDS.get(page)
    if package and importlib.util.find_spec(package) is None:
        pytest.skip(f"{page} needs {package}, which is not installed")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "macropulse").symlink_to(program.path)
    # The examples of the repository, as beside the reader.
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    path = f"{tmp_path}:{os.environ['PATH']}"
    names, printed = {"__name__": page}, None
    for language, body in blocks(page):
        if language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(body, page, "exec"), names)
            printed = out.getvalue()
        elif language == "sh":
            printed = None
            if page in AFTER_COMMANDS:
                # The tests of the program run the commands as they stand.
                body = body.replace("--scans 20", "--scans 2")
                subprocess.run(["bash", "-euc", body], check=True, env={**os.environ, "PATH": path})
        elif language == "text" and printed is not None:
            rest = " ".join(printed.split())
            for piece in body.split("…"):
                piece = " ".join(piece.split())
                assert piece in rest, printed
                rest = rest.partition(piece)[2]
