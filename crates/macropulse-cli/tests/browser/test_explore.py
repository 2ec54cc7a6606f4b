"""The page to explore a cloud. What it tells is held against the PCD file beside it."""

import io
import json
import math
import shutil
import urllib.parse

import numpy as np
import pytest
from PIL import Image

from conftest import NARROW, WIDE, macropulse, read_pcd, write_pcd

# Half of the field of view of the page, from top to bottom.
HALF_FIELD = math.tan(math.radians(25))


def opened(page):
    page.wait_for_selector("body[data-drawn]")
    return page


def told(page):
    """What the page tells of the point that is picked, by name."""
    lines = page.locator("#point div").all()
    return {line.get_attribute("data-name"): line.locator("dd").inner_text() for line in lines}


def number(text):
    return float(text.split()[0])


def picture(locator):
    return np.asarray(Image.open(io.BytesIO(locator.screenshot())).convert("RGB")).astype(int)


def click_pixel(page, pixel, shape):
    box = page.locator("#image").bounding_box()
    page.locator("#image").click(
        position={
            "x": float((pixel[1] + 0.5) / shape[1] * box["width"]),
            "y": float((pixel[0] + 0.5) / shape[0] * box["height"]),
        }
    )


def seen_from_the_sensor(page, point):
    """Where the cloud, seen from the sensor, shows a point, px from the top left."""
    box = page.locator("#cloud").bounding_box()
    scale = box["height"] / 2 / HALF_FIELD / point["x"]
    return float(box["width"] / 2 - point["y"] * scale), float(box["height"] / 2 - point["z"] * scale)


def returns(cloud):
    """Pixels of a cloud that have a return, a few of them, spread over all."""
    rows, columns = np.nonzero(np.isfinite(cloud["range"]))
    return [(int(rows[at]), int(columns[at])) for at in np.linspace(0, len(rows) - 1, 7).astype(int)]


def assert_tells(page, point):
    page_tells = told(page)
    for name, most in [("range", 6e-5), ("x", 6e-5), ("y", 6e-5), ("z", 6e-5), ("intensity", 6e-5)]:
        assert abs(number(page_tells[name]) - point[name]) <= most, (name, page_tells, point)
    assert abs(number(page_tells["time"]) - point["time_ns"]) <= 0.051
    for name in ["row", "column", "peak", "marks", "margin"]:
        assert number(page_tells[name]) == point[name]


def test_a_click_on_a_point_tells_its_range(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html"))
    page.get_by_role("button", name="Sensor").click()
    tried = 0
    for pixel in returns(cloud):
        x, y = seen_from_the_sensor(page, cloud[pixel])
        box = page.locator("#cloud").bounding_box()
        if not (10 < x < box["width"] - 10 and 60 < y < box["height"] - 10):
            continue
        page.locator("#cloud").click(position={"x": x, "y": y})
        assert_tells(page, cloud[pixel])
        assert abs(number(page.locator("#brief").inner_text()) - cloud[pixel]["range"]) <= 6e-5
        tried += 1
    assert tried >= 3


def test_a_click_on_the_range_image_marks_the_point_in_the_cloud(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html"))
    page.get_by_role("button", name="Sensor").click()
    pixel = returns(cloud)[3]
    click_pixel(page, pixel, cloud.shape)
    assert_tells(page, cloud[pixel])
    page.wait_for_timeout(100)
    mark = page.evaluate(
        "['left', 'top'].map((side) => parseFloat(document.getElementById('cloud-mark').style[side]))"
    )
    assert np.allclose(mark, seen_from_the_sensor(page, cloud[pixel]), atol=1.0)


def test_a_click_on_a_point_marks_its_pixel(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html"))
    page.get_by_role("button", name="Sensor").click()
    pixel = returns(cloud)[3]
    x, y = seen_from_the_sensor(page, cloud[pixel])
    page.locator("#cloud").click(position={"x": x, "y": y})
    mark = page.evaluate(
        "['top', 'left'].map((side) => parseFloat(document.getElementById('image-mark').style[side]))"
    )
    expected = [100 * (place + 0.5) / count for place, count in zip(pixel, cloud.shape, strict=True)]
    assert np.allclose(mark, expected, atol=1e-3)


def test_a_pixel_without_a_return_says_so(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    rows, columns = np.nonzero(cloud["outcome"] == 0)
    page = opened(visit(coarse / "index.html"))
    click_pixel(page, (rows[0], columns[0]), cloud.shape)
    assert told(page) == {
        "row": str(rows[0]),
        "column": str(columns[0]),
        "range": "no return",
        "outcome": "empty",
    }
    assert page.locator("#cloud-mark").is_hidden()


def test_the_colours_of_a_range_lie_between_percentiles(visit, street):
    ranges = read_pcd(street / "scan-000000.pcd")["range"]
    low, high = np.percentile(ranges[np.isfinite(ranges)], [1, 99])
    page = opened(visit(street / "index.html"))
    ends = [number(text) for text in page.locator(".ends span").all_inner_texts()]
    assert np.allclose(ends, [low, (low + high) / 2, high], atol=0.51)
    assert "percentile" in page.locator("#legend").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_lightness_of_the_colours_rises_evenly(visit, coarse, scheme):
    page = opened(visit(coarse / "index.html", scheme=scheme))
    bar = page.evaluate(
        "[...document.getElementById('ramp').getContext('2d').getImageData(0, 0, 255, 1).data]"
    )
    srgb = np.array(bar).reshape(-1, 4)[:, :3] / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    # CIE L*, all of it above the linear part near black.
    lightness = 116 * np.cbrt(luminance) - 16
    steps = np.diff(lightness[::16])
    assert lightness[-1] - lightness[0] > 50
    assert np.all(np.diff(lightness) > -0.2)
    assert np.allclose(steps, steps.mean(), rtol=0.12), steps


def test_every_colouring_paints_the_cloud_and_the_image_anew(visit, coarse):
    page = opened(visit(coarse / "index.html"))
    offered = page.locator("#colour option").evaluate_all("(all) => all.map((one) => one.value)")
    assert offered == ["range", "intensity", "row", "z", "outcome", "return_number"]
    seen = []
    for colouring in offered:
        page.select_option("#colour", colouring)
        page.wait_for_timeout(150)
        image = page.evaluate("document.getElementById('image').toDataURL()")
        seen.append((picture(page.locator(".view")), image))
    for at, (cloud, image) in enumerate(seen):
        for other_cloud, other_image in seen[:at]:
            assert np.any(cloud != other_cloud) and image != other_image


def test_the_legend_of_outcomes_counts_pixels_and_hides_points(visit, coarse):
    page = opened(visit(coarse / "index.html"))
    page.select_option("#colour", "outcome")
    shown = {}
    for text in page.locator("#legend button").all_inner_texts():
        name, count = text.replace("\u202f", "").split()
        shown[name] = int(count)
    codes = read_pcd(coarse / "scan-000000.pcd")["outcome"]
    names = ["empty", "right", "near", "wrong", "missed", "false"]
    counted = {name: int(np.sum(codes == code)) for code, name in enumerate(names)}
    assert shown == {name: count for name, count in counted.items() if count > 0}
    before = picture(page.locator(".view"))
    page.locator("#legend button", has_text="right").click()
    page.wait_for_timeout(150)
    after = picture(page.locator(".view"))
    green = lambda seen: int(np.sum(np.all(np.abs(seen - [74, 163, 122]) < 6, axis=2)))
    assert green(after) < 0.02 * green(before)


def test_another_scan_can_be_chosen(visit, coarse):
    page = opened(visit(coarse / "index.html"))
    assert page.locator("#scan option").all_inner_texts() == ["scan 0", "scan 1"]
    page.get_by_role("button", name="Next scan").click()
    page.wait_for_selector("body[data-scan='1']")
    cloud = read_pcd(coarse / "scan-000001.pcd")
    pixel = returns(cloud)[2]
    click_pixel(page, pixel, cloud.shape)
    assert_tells(page, cloud[pixel])


def test_links_lead_to_the_files_beside_the_page(visit, coarse):
    page = opened(visit(coarse / "index.html"))
    links = page.locator(".files a").evaluate_all("(all) => all.map((one) => one.getAttribute('href'))")
    files = {path.name for path in coarse.iterdir()} - {"index.html"}
    assert {urllib.parse.unquote(link).removeprefix("./") for link in links} == files
    manifest = json.loads((coarse / "manifest.json").read_text())
    assert "index.html" in manifest["files"]


def test_light_and_dark_by_system_and_by_the_switch(visit, coarse):
    def ground(page):
        return sum(map(int, page.evaluate("getComputedStyle(document.body).backgroundColor").strip("rgb()").split(",")))

    for scheme, other in [("light", "Dark"), ("dark", "Light")]:
        page = opened(visit(coarse / "index.html", scheme=scheme))
        is_light = ground(page) > 600
        assert is_light == (scheme == "light")
        cloud = picture(page.locator(".view"))
        page.locator("[data-theme-switch]", has_text=other).click()
        page.wait_for_timeout(150)
        assert (ground(page) > 600) != is_light
        assert np.abs(picture(page.locator(".view")).mean() - cloud.mean()) > 100
        page.reload()
        opened(page)
        assert (ground(page) > 600) != is_light


def test_all_is_reached_by_keys(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html"))
    reached = []
    for _ in range(14):
        page.keyboard.press("Tab")
        reached.append(page.evaluate("document.activeElement.id || document.activeElement.textContent"))
    assert {"scan", "colour", "size", "cloud", "image", "All", "Sensor", "Dark"} <= set(reached)
    page.focus("#cloud")
    before = picture(page.locator(".view"))
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(300)
    assert np.any(picture(page.locator(".view")) != before)
    page.keyboard.press("Enter")
    first = told(page)
    pixel = int(first["row"]), int(first["column"])
    assert_tells(page, cloud[pixel])
    page.focus("#image")
    page.keyboard.press("ArrowUp")
    assert int(told(page)["row"]) == pixel[0] - 1
    page.focus("#cloud")
    page.keyboard.press("Escape")
    assert told(page) == {}


def test_a_telephone_has_it_all(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html", size=NARROW, touch=True))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    for control in page.locator("button:visible, select:visible").all():
        box = control.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= 390 and box["height"] >= 40
    page.get_by_role("button", name="Sensor").tap()
    points = [cloud[pixel] for pixel in returns(cloud)]
    box = page.locator("#cloud").bounding_box()
    places = [seen_from_the_sensor(page, point) for point in points]
    inside = [at for at, (x, y) in enumerate(places) if 15 < x < box["width"] - 15 and 60 < y < box["height"] - 15]
    page.locator("#cloud").tap(position=dict(zip("xy", places[inside[0]], strict=True)))
    assert_tells(page, points[inside[0]])


def test_a_large_cloud_moves_fluently(visit, street):
    page = opened(visit(street / "index.html"))
    points = int(np.sum(np.isfinite(read_pcd(street / "scan-000000.pcd")["range"])))
    assert int(page.get_attribute("body", "data-drawn")) == points
    box = page.locator("#cloud").bounding_box()
    page.evaluate(
        """() => {
          window.times = [];
          const tick = (now) => { window.times.push(now); requestAnimationFrame(tick); };
          requestAnimationFrame(tick);
        }"""
    )
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    page.mouse.down()
    for step in range(60):
        page.mouse.move(box["x"] + 200 + 4 * step, box["y"] + 200 + step)
    drawn = int(page.get_attribute("body", "data-drawn"))
    page.mouse.up()
    times = np.diff(page.evaluate("window.times"))[-50:]
    print(f"{np.median(times):.0f} ms a picture, {drawn} of {points} points drawn by a processor alone")
    # A graphics unit draws all of them; a processor in its place, shared with other tests, draws a part.
    assert np.median(times) < 120 or drawn < points
    page.wait_for_timeout(1000)
    assert int(page.get_attribute("body", "data-drawn")) == points
    assert told(page) == {}, "a drag is no click"


def test_the_cloud_of_another_program_has_a_page(visit, tmp_path):
    points = np.random.default_rng(5).uniform([5e5, 4.9e6, 200], [5e5 + 40, 4.9e6 + 30, 210], (2000, 3))
    write_pcd(tmp_path / "other.pcd", points)
    assert "other.html" in macropulse("view", tmp_path / "other.pcd")
    page = opened(visit(tmp_path / "other.html"))
    assert page.locator("#image-part").is_hidden() and page.locator("#said").is_hidden()
    page.locator("#cloud").focus()
    page.keyboard.press("Enter")
    place = np.array([number(told(page)[axis]) for axis in "xyz"])
    nearest = np.abs(points.astype("<f4").astype(float) - place).max(axis=1).min()
    assert nearest < 6e-5


def test_a_pixel_that_is_explained_leads_to_its_ticks(visit, coarse, tmp_path):
    folder = shutil.copytree(coarse, tmp_path / "explained")
    told = {
        "row": 13,
        "column": 30,
        "shot": 654,
        "fired_at_fs": 0,
        "label": 30,
        "code_word": 1,
        "decided": "accepted",
        "why": "Four of four marks.",
        "returns": [],
        "rejects": [],
        "marks_ticks": [0, 5, 9, 20],
        "gate_ticks": [140, 142],
        "light": None,
        "window_ticks": 1,
        "ticks_in_time": 4,
        "ticks_of_others": 0,
        "density": 0.0,
        "threshold_marks": None,
        "sidelobe": None,
        "others": [],
        "ticks": [141, 146, 150, 161],
        "is_of_others": [False] * 4,
        "peak": {"lag_ticks": 141, "range_m": 47.9, "marks": 4},
        "correlation": {"first_lag_ticks": 140, "step_ticks": 1, "first_range_m": 47.5, "step_m": 0.4, "marks": [0, 4, 1], "marks_without_others": [0, 4, 1]},
    }
    (folder / "explain-000000-13-30.json").write_text(json.dumps(told))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"].append("explain-000000-13-30.json")
    (folder / "manifest.json").write_text(json.dumps(manifest))
    macropulse("view", folder)
    page = opened(visit(folder / "index.html"))
    click_pixel(page, (13, 29), (24, 48))
    assert page.locator("#to-pixel").is_hidden()
    click_pixel(page, (13, 30), (24, 48))
    page.locator("#to-pixel").click()
    section = page.locator("#pixel-13-30")
    assert "Four of four marks." in section.inner_text()
    section.locator("svg.mp").nth(1).focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    lines = page.locator(".at-pointer p").all_inner_texts()
    assert lines == ["Range, m: 47.9", "all ticks: 4", "without those of other shots: 4"]


def test_an_empty_cloud_says_so(visit, tmp_path):
    write_pcd(tmp_path / "empty.pcd", np.zeros((0, 3)))
    macropulse("view", tmp_path / "empty.pcd")
    page = visit(tmp_path / "empty.html")
    page.wait_for_selector("#said:visible")
    assert "No point" in page.locator("#said").inner_text()


def test_pages_at_both_widths_in_light_and_dark(visit, street, coarse, pictures):
    for name, run in [("street", street), ("coarse", coarse)]:
        for width, size in [(1400, None), (390, NARROW)]:
            for scheme in ["light", "dark"]:
                page = visit(run / "index.html", **({"size": size} if size else {}), scheme=scheme)
                opened(page)
                page.focus("#cloud")
                page.keyboard.press("Enter")
                page.wait_for_timeout(300)
                page.screenshot(path=pictures / f"{name}-{width}-{scheme}.png", full_page=True)
                view = picture(page.locator(".view"))
                ground = np.median(view.reshape(-1, 3), axis=0)
                # Points are seen: a part of the view is neither ground nor line.
                share = np.mean(np.abs(view - ground).max(axis=2) > 40)
                assert share > 0.01, (name, width, scheme, share)


@pytest.fixture(scope="session")
def explained(tmp_path_factory):
    """Folders of a simulation and of what was decoded of its ticks, with the same pixel explained; and
    that pixel."""
    folder = tmp_path_factory.mktemp("runs")
    sensor = "--sensor kim-park-2016-fixed --set scan.raster.rows=24 --set scan.raster.columns=48"
    pixel = "--explain 13,30"
    macropulse("simulate", *f"{sensor} --scene street {pixel} --format pcd,ticks -o".split(), folder / "was")
    files = [folder / "was" / name for name in ("shots-000000.mps", "ticks-000000.mpt")]
    macropulse("decode", *sensor.split(), *files, *pixel.split(), "-o", folder / "again")
    return folder, (13, 30)


def lanes(page):
    """The ticks in each lane of the first chart of the pixel, by its name; and the names from the top."""
    chart = page.locator("#pixel-13-30 svg.mp").first
    texts = chart.locator("text").evaluate_all(
        "(all) => all.map((one) => [one.textContent, one.getBoundingClientRect().y])"
    )
    named = sorted((y, text) for text, y in texts if text in LANES)
    told = json.loads(chart.locator("metadata").text_content())
    points = [point for series in told["series"] for point in series["points"]]
    ticks = {name: [float(tick) for *_, tick, lane in points if lane == name] for _, name in named}
    return ticks, [name for _, name in named]


LANES = [
    "marks sent",
    "ticks on a mark",
    "ticks of other shots",
    "other ticks",
    "detection events",
    "light of others",
    "light of this shot",
]


def test_a_simulation_shows_light_above_the_ticks_and_a_decoding_says_it_knows_none(visit, explained):
    folder, pixel = explained
    whole = json.loads((folder / "was" / "explain-000000-13-30.json").read_text())
    page = opened(visit(folder / "was" / "index.html"))
    click_pixel(page, pixel, (24, 48))
    page.locator("#to-pixel").click()
    ticks, names = lanes(page)
    assert names == LANES[::-1], "light is above the ticks"
    (ours,) = [train for train in whole["light"]["trains"] if train["of"] == "this_shot"]
    assert len(ticks["light of this shot"]) == len(ours["marks_ticks"]) > 100
    # Nearly each mark that arrived made an event, told to the nearest tick, and that a tick.
    on_mark = {int(tick) for tick in ticks["ticks on a mark"]}
    events = {int(tick) - less for tick in ticks["detection events"] for less in (0, 1)}
    assert on_mark <= events and len(on_mark) > 0.9 * len(ours["marks_ticks"])
    page = opened(visit(folder / "again" / "index.html"))
    assert "decoded" in page.title()
    ticks, names = lanes(page)
    assert names == LANES[3::-1] and len(ticks["marks sent"]) > 100
    assert "What light there was is not known" in page.locator("#pixel-13-30").inner_text()


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["1400", "390"])
def test_an_explained_pixel_is_light_and_dark_at_both_widths(visit, explained, size, pictures):
    folder, _ = explained
    for scheme in ("light", "dark"):
        page = opened(visit(folder / "was" / "index.html", size=size, scheme=scheme))
        section = page.locator("#pixel-13-30")
        section.scroll_into_view_if_needed()
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        section.screenshot(path=pictures / f"pixel-{size['width']}-{scheme}.png")
        assert picture(section.locator("svg.mp").first).std() > 10


def test_an_intensity_that_is_a_bound_says_so(visit, coarse):
    cloud = read_pcd(coarse / "scan-000000.pcd")
    page = opened(visit(coarse / "index.html"))
    seen = set()
    for pixel in returns(cloud):
        click_pixel(page, pixel, cloud.shape)
        point = cloud[pixel]
        is_bound = bool(point["flags"] & 4)
        assert told(page)["intensity"].endswith(" or more") == is_bound
        seen.add(is_bound)
    assert True in seen
