"""The pages with charts: sweep, budget, codes."""

import csv
import re

import pytest

from conftest import NARROW, WIDE, macropulse


@pytest.fixture(scope="session")
def pages(tmp_path_factory):
    """Folders of a sweep, a budget and a comparison of codes."""
    folder = tmp_path_factory.mktemp("pages")
    macropulse(
        *"sweep peregrine --scene wall --shots 4096 --score pd,precision --vary".split(),
        "scene:object.wall.position_m.x=40..70:4",
        "-o",
        folder / "sweep",
    )
    macropulse("budget", "kim-park-2016-physical", "-o", folder / "budget")
    macropulse("codes", "prime=7", "m-sequence=5", "-o", folder / "codes")
    return folder


ALL = ["sweep/index.html", "budget/budget.html", "codes/index.html"]


def test_a_chart_tells_the_values_of_the_table(visit, pages):
    page = visit(pages / "sweep/index.html")
    chart = page.locator("svg.mp").first
    with open(pages / "sweep/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    expected = [(float(row["scene:object.wall.position_m.x"]), float(row["pd"])) for row in rows]
    chart.focus()
    for x, y in expected:
        page.keyboard.press("ArrowRight")
        told = page.locator(".at-pointer p").all_inner_texts()
        assert float(told[0].split(": ")[-1]) == pytest.approx(x, rel=1e-4)
        assert float(told[1].split(": ")[-1]) == pytest.approx(y, rel=1e-4, abs=1e-9)
    page.keyboard.press("Escape")
    assert page.locator(".at-pointer").is_hidden()


def test_the_value_at_the_pointer_is_the_one_beside_it(visit, pages):
    page = visit(pages / "sweep/index.html")
    dots = page.locator("svg.mp").first.locator("circle.dot")
    dots.nth(2).scroll_into_view_if_needed()
    dots.nth(2).hover(force=True)
    assert page.locator(".at-pointer p").first.inner_text().endswith(": 60")
    page.mouse.move(5, 5)
    assert page.locator(".at-pointer").is_hidden()


@pytest.mark.parametrize("name", ALL)
def test_every_chart_has_titles_on_its_axes_and_values_to_tell(visit, pages, name):
    page = visit(pages / name)
    told = page.locator("svg.mp metadata").evaluate_all("(all) => all.map((one) => JSON.parse(one.textContent))")
    assert len(told) >= 2
    for chart in told:
        assert chart["x"] and chart["y"]
        assert any(series["points"] for series in chart["series"])
    texts = page.locator("svg.mp").evaluate_all("(all) => all.map((one) => one.textContent)")
    for chart, text in zip(told, texts, strict=True):
        assert text.count(chart["x"]) >= 2 and text.count(chart["y"]) >= 2, "drawn, not only told"


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["1400", "390"])
def test_pages_are_light_and_dark_at_both_widths(visit, pages, name, size, pictures):
    for scheme, limit in [("light", range(600, 766)), ("dark", range(0, 150))]:
        page = visit(pages / name, size=size, scheme=scheme)
        ground = lambda: sum(
            map(int, re.findall(r"\d+", page.evaluate("getComputedStyle(document.body).backgroundColor")))
        )
        assert ground() in limit
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        page.screenshot(path=pictures / f"{name.split('/')[0]}-{size['width']}-{scheme}.png", full_page=True)
        page.locator("[data-theme-switch]").click()
        assert ground() not in limit


def test_links_lead_to_the_files_beside_the_page(visit, pages):
    for name in ["sweep", "codes"]:
        page = visit(pages / name / "index.html")
        links = page.locator(".files a").evaluate_all("(all) => all.map((one) => one.getAttribute('href'))")
        assert len(links) >= 3
        for link in links:
            assert (pages / name / link).is_file(), link
