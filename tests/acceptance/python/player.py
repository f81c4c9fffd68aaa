"""Clicks through the players of two reports in a browser without a window: that of a driven test with faults, and that of a run without
a car. Arguments: the browser, both pages, and a text of others that the first page has as the name of a check."""

import pathlib
import shutil
import sys

from playwright.sync_api import sync_playwright

BROWSER, WITH_CAR, WITHOUT_CAR, FOREIGN = sys.argv[1:]
CAR = "svg.close g.car"
CURSOR = "#player line.cursor"


class Watched:
    """A page whose errors, questions and requests count."""

    def __init__(self, browser, path, **context):
        self.address = pathlib.Path(path).resolve().as_uri()
        self.wrong = []
        self.page = browser.new_context(**context).new_page()
        self.page.on("console", lambda it: it.type == "error" and self.wrong.append(f"console: {it.text}"))
        self.page.on("pageerror", lambda it: self.wrong.append(f"error: {it}"))
        self.page.on("dialog", lambda it: self.wrong.append(f"dialog: {it.message}"))
        self.page.on("request", lambda it: it.url != self.address and self.wrong.append(f"request: {it.url}"))
        self.page.goto(self.address)

    def transform(self, selector):
        return self.page.locator(selector).first.get_attribute("transform")

    def time(self):
        return float(self.page.locator("input.time").input_value())

    def drag(self, selector, to):
        """Drags from the middle of an element to a share of its width."""
        self.page.locator(selector).first.scroll_into_view_if_needed()
        box = self.page.locator(selector).first.bounding_box()
        y = box["y"] + box["height"] / 2
        self.page.mouse.move(box["x"] + box["width"] / 2, y)
        self.page.mouse.down()
        self.page.mouse.move(box["x"] + to * box["width"], y, steps=3)
        self.page.mouse.up()

    def expect_moved(self, what, before, selectors):
        for selector, old in zip(selectors, before):
            new = self.transform(selector)
            assert new and new != old, f"{what} left {selector} at {old}"

    def finish(self):
        assert not self.wrong, self.wrong
        self.page.context.close()


def drive(browser):
    """The slider, a plot and the button move the car and the cursors."""
    watched = Watched(browser, WITH_CAR, viewport={"width": 1920, "height": 1080}, color_scheme="light")
    page = watched.page
    page.wait_for_selector("#player.live")
    moving = [CAR, "svg.whole g.car", CURSOR]
    state = lambda: [watched.transform(it) for it in moving]

    before = state()
    watched.drag("input.time", 0.8)
    watched.expect_moved("the slider", before, moving)
    late = watched.time()

    before = state()
    watched.drag("#player svg.chart", 0.4)
    watched.expect_moved("a plot", before, moving)
    assert watched.time() < late, "the slider follows a plot"

    before, at = state(), watched.time()
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(f"document.querySelector('input.time').value > {at} + 0.1")
    page.keyboard.press(" ")
    watched.expect_moved("playing", before, moving)
    at = watched.time()
    page.wait_for_timeout(100)
    assert watched.time() == at, "the space bar pauses"
    page.keyboard.press("ArrowRight")
    assert watched.time() > at, "an arrow moves the time"

    cones, hit = [page.locator(f"svg.close path.cones{it}").get_attribute("d").count("M") for it in (":not(.hit)", ".hit")]
    assert hit > 0 and cones + hit == 30, (cones, hit)
    assert f"hits {hit} of 30 cones" in page.locator("p.hits").inner_text()
    assert "run with test.entry_speed = 78 km/h" in page.locator("h1").inner_text()
    assert page.locator("p.laps").inner_text() == "lap 1: 1:23.456"

    diagram = page.locator("figure", has_text="Accelerations")
    diagram.scroll_into_view_if_needed()
    bound = diagram.locator("svg.area path.dash[d]")
    bound.wait_for(state="attached")
    before = bound.get_attribute("d")
    watched.drag("input.time", 0.45)
    assert before and bound.get_attribute("d") != before, "a curve of signals moves"
    size = [float(diagram.locator("svg.area").get_attribute(it)) for it in ("width", "height")]
    assert abs(size[0] - 2 * size[1]) < 1, f"one scale for one unit: {size}"
    assert diagram.get_by_text("a_y [m/s²]").count() == 1, "units as people write them"
    assert page.locator("#player rect.fault").count() > 0, "faults are shaded"
    assert page.get_by_text(FOREIGN).count() > 0, "text of others is text"
    failed = page.locator("#player figure.failed").all_inner_texts()
    assert len(failed) == 2 and "no cone is hit" in failed[0], "failed checks of results and of signals come first"
    light = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.emulate_media(color_scheme="dark")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != light
    page.set_viewport_size({"width": 420, "height": 900})
    assert page.evaluate("document.documentElement.scrollWidth") <= 420, "a narrow page does not scroll aside"
    watched.finish()


def run_without_car(browser):
    """Signals have a cursor, and there is no map."""
    watched = Watched(browser, WITHOUT_CAR)
    page = watched.page
    page.wait_for_selector("#player.live")
    assert page.locator("svg.map").count() == 0
    before = watched.transform(CURSOR)
    watched.drag("input.time", 0.3)
    watched.expect_moved("the slider", [before], [CURSOR])
    watched.finish()


def read_without_script(browser):
    """The way and the checks are there."""
    watched = Watched(browser, WITH_CAR, java_script_enabled=False)
    assert watched.page.locator("figure.still > svg").is_visible()
    assert watched.page.locator("table.checks").first.is_visible()
    watched.finish()


with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path=shutil.which(BROWSER), args=["--no-sandbox", "--disable-gpu"])
    drive(browser)
    run_without_car(browser)
    read_without_script(browser)
    browser.close()
