"""The page of the explorer in a browser: what is seen is what the library draws, whatever is dragged or pressed."""

import json
import re
from contextlib import contextmanager

import numpy as np
import pytest
from node_page import CHROMIUM, NODE, NodePage

pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")
pytest.importorskip("uvicorn", reason="the explorer needs its extra: pip install '.[explore]'")

import topleft as tl
from topleft._apps.explore.content import content_of
from topleft._apps.explore.content import scene as scene_of
from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import split
from topleft._apps.explore.notebook import markup
from topleft._apps.explore.session import Session

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no browser: apt-get install chromium"),
    pytest.mark.skipif(NODE is None, reason="node is not installed"),
]

DESKTOP, PHONE = {"width": 1280, "height": 860}, {"width": 390, "height": 844}
STATE = "document.querySelector('.explorer').app.parts.pixels.state()"
QUIET = """() => {
  const part = document.querySelector(".explorer").app?.parts.pixels;
  return part?.drawn && part.drawn === part.state();
}"""
NAME = """(({ariaLabel, labels, textContent}) => ariaLabel ?? labels?.[0]?.textContent.trim() ?? textContent)(
  document.activeElement)"""
PIXELS = """(key) => {
  const canvas = document.querySelector(`[data-key="${key}"] canvas`);
  const {data, width, height} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return [height, width, [...data]];
}"""


@pytest.fixture
def explorer():
    with tl.explore("shared-edge", wait=False, browser=False) as found:
        yield found


@contextmanager
def opened(chromium, explorer, fragment="", viewport=DESKTOP, **more):
    """The page, once it has been drawn; it may fetch from its server alone, and complain of nothing."""
    context = chromium.new_context(viewport=viewport, accept_downloads=True, **more)
    page, complaints = context.new_page(), []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.set_default_timeout(10_000)
    ours = explorer.url.split("#")[0]
    page.on(
        "request", lambda sent: None if sent.url.startswith((ours, "data:", "blob:")) else complaints.append(sent.url)
    )
    page.goto(ours + fragment)
    page.wait_for_function(QUIET)
    yield page
    context.close()
    assert complaints == []


@pytest.fixture
def page(chromium, explorer):
    with opened(chromium, explorer) as found:
        yield found


def pixels_of(page):
    return page.locator("[data-panel=pixels]")


def state_of(page):
    return page.evaluate(STATE)


def check_pictures(page):
    """Compare each picture, pixel by pixel, with what the page makes of the state in node; returns the owners."""
    page.wait_for_function(QUIET)
    drawing = NodePage()
    panels, _ = drawing.draw(state_of(page))
    drawing.close()
    shown = page.evaluate("[...document.querySelectorAll('[data-key]')].map((one) => one.dataset.key)")
    assert shown == [*panels]
    for key in shown:
        height, width, data = page.evaluate(PIXELS, key)
        pixels = np.array(data, np.uint8).reshape(height, width, 4)
        wanted = panels[key]["picture"]
        is_seen = wanted[..., 3] > 0
        assert (pixels[..., 3] == wanted[..., 3]).all()
        assert (np.abs(pixels[is_seen].astype(int) - wanted[is_seen]) <= (wanted[is_seen][:, 3:] < 255) * 128).all()
    return panels["a"]["owners"]


def grip(page, i, key="a"):
    """Where a vertex is on the screen."""
    page.wait_for_function(QUIET)
    knob = f"""document.querySelectorAll('[data-key="{key}"] .grip .knob')[{i}].getBoundingClientRect()"""
    return page.evaluate(f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])({knob})")


def drag(page, i, by, key="a"):
    x, y = grip(page, i, key)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by[0] / 2, y + by[1] / 2)
    page.mouse.move(x + by[0], y + by[1])
    page.mouse.up()


def test_page_shows_what_the_library_draws(page):
    state = state_of(page)
    owners = check_pictures(page)
    assert (owners == tl.rasterize(state["vertices"], state["triangles"], state["size"]).triangle).all()
    assert page.locator("figcaption").count() == 4


@pytest.mark.parametrize("snap", ["free", "sub-pixel", "pixel centre"])
def test_dragged_vertex_moves_in_the_chosen_steps(page, snap):
    pixels_of(page).get_by_label("drag to").select_option(snap)
    pixels_of(page).get_by_label("sub-pixel bits").select_option("2")
    before = state_of(page)["vertices"]
    drag(page, 3, (-33, 21))
    check_pictures(page)
    after = state_of(page)["vertices"]
    assert after[:3] == before[:3]
    assert after[3] != before[3]
    step = {"free": 2**-20, "sub-pixel": 0.25, "pixel centre": 1.0}[snap]
    offset = 0.5 if snap == "pixel centre" else 0
    assert all((value - offset) % step == 0 for value in after[3])


def test_vertices_that_were_dragged_are_those_of_python(page, explorer):
    drag(page, 0, (40, 40))
    page.wait_for_function(QUIET)
    assert explorer.vertices.tolist() == state_of(page)["vertices"]


def test_keys_take_and_move_a_corner_and_undo(page):
    stage = page.locator("[data-panel=pixels] .stage")
    stage.focus()
    before = state_of(page)["vertices"]
    for keys, moved in ((["2", "ArrowRight"], [13.5 + 1 / 256, 1.5]), (["s"], [13.5 + 1 / 256, 1.5 + 1 / 256]),
                        (["Shift+ArrowLeft"], [12.5 + 1 / 256, 1.5 + 1 / 256])):  # fmt: skip
        for key in keys:
            page.keyboard.press(key)
        check_pictures(page)
        assert state_of(page)["vertices"][1] == moved
    for _ in range(3):
        page.keyboard.press("z")
    assert state_of(page)["vertices"] == before
    page.keyboard.press("f")
    assert state_of(page)["look"] == "wireframe"
    check_pictures(page)


def test_page_down_goes_through_the_scenes_and_tab_leaves_the_picture(page):
    page.locator("[data-panel=pixels] .stage").focus()
    for name in ("wide", "tall"):
        page.keyboard.press("PageDown")
        page.wait_for_function(f"() => document.querySelector('.status').textContent === '{name}'")
        check_pictures(page)
    page.keyboard.press("PageUp")
    page.wait_for_function("() => document.querySelector('.status').textContent === 'wide'")
    assert page.inner_text("[data-panel=pixels] .about") == "a triangle wider than tall"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.getAttribute('aria-label')") == "Scene"


def test_all_controls_are_reached_by_keyboard_alone(page):
    page.locator("[data-tab=pixels]").focus()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "stage"
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => document.querySelector('.why').textContent.includes('(9, 6)')")
    page.keyboard.press("Tab")
    reached = set()
    for _ in range(60):
        reached.add(page.evaluate(NAME))
        page.keyboard.press("Tab")
    assert {
        "Scene",
        "method",
        "compare with",
        "sub-pixel bits",
        "sampling",
        "corner 1, x",
        "split",
        "Copy link",
    } <= reached


def edit(page, name):
    page.evaluate(f"window.before = {STATE}")
    pixels_of(page).get_by_role("button", name=name, exact=True).click()
    page.wait_for_function(f"() => window.before !== {STATE}")


def test_triangles_are_added_split_flipped_and_removed(page):
    for name, n in (("add", 3), ("split", 5), ("flip", 5), ("remove", 4)):
        edit(page, name)
        check_pictures(page)
        assert len(state_of(page)["triangles"]) == n
    for _ in range(4):
        edit(page, "remove")
    check_pictures(page)
    assert state_of(page)["vertices"] == []
    edit(page, "undo")
    assert len(state_of(page)["triangles"]) == 1


def test_methods_and_rules_are_switched(page):
    for label, value in (("method", "edge_increment/bottom-right"),
                         ("compare with", ""), ("method", "scanline"), ("sampling", "msaa4"),
                         ("sub-pixel bits", "exact"),
                         ("sampling", "outer"), ("sampling", "area"), ("cull", "back"), ("winding", "clockwise"),
                         ("sampling", "center")):  # fmt: skip
        pixels_of(page).get_by_label(label, exact=True).select_option(value)
        check_pictures(page)
    pixels_of(page).get_by_role("button", name="overdraw").click()
    check_pictures(page)


def test_failure_scene_opens_on_a_pixel_that_fails(page):
    pixels_of(page).locator("[data-name=scene]").select_option("any-gap")
    page.wait_for_function("() => document.querySelector('.why').textContent.includes(\"triangle 1's: a gap\")")
    ring = page.locator('[data-key="a"] .ring')
    assert [ring.get_attribute(name) for name in ("x", "y", "width")] == ["6", "11", "1"]


def test_hovered_pixel_says_whose_it_is(page):
    box = page.locator('[data-key="b"] svg').bounding_box()
    cell = box["width"] / 18
    page.mouse.move(box["x"] + 9.5 * cell, box["y"] + 7.5 * cell)
    page.wait_for_function("() => document.querySelector('.why').textContent.includes('draws it')")
    told = page.locator(".why").inner_text()
    assert "left edge of triangle 1, so the pixel belongs to it" in told
    assert (
        "bresenham_scanline draws it 2 times, for triangle 0 and triangle 1; by the exact rule it is triangle 1's."
        in told
    )


def test_touch_drags_a_vertex(chromium, explorer):
    with opened(chromium, explorer, viewport=PHONE, has_touch=True, is_mobile=True) as page:
        before = state_of(page)["vertices"]
        x, y = grip(page, 3)
        touch = page.context.new_cdp_session(page)
        points = [(x, y), (x - 20, y - 10), (x - 44, y - 30)]
        for kind, at in zip(("touchStart", "touchMove", "touchMove"), points, strict=True):
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": at[0], "y": at[1]}]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        check_pictures(page)
        after = state_of(page)["vertices"]
        assert after[:3] == before[:3]
        assert after[3][0] < before[3][0]
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]


def test_exported_code_runs_and_draws_the_same(page, folder):
    drag(page, 3, (-40, 13))
    owners = check_pictures(page)
    with page.expect_download() as download:
        pixels_of(page).get_by_role("button", name="Python").click()
    made = {}
    exec(download.value.path().read_text(), made)
    assert (made["owners"] == owners).all()


@pytest.mark.parametrize(("button", "begins"), [("PNG", b"\x89PNG"), ("SVG", b"<svg"), ("Test case", b"import numpy")])
def test_exported_file_is_saved(page, button, begins):
    with page.expect_download() as download:
        pixels_of(page).get_by_role("button", name=button).click()
    assert download.value.path().read_bytes().startswith(begins)


def test_link_restores_the_state_in_another_page(page, chromium, explorer):
    drag(page, 2, (30, -20))
    pixels_of(page).get_by_label("method", exact=True).select_option("zigzag")
    pixels_of(page).get_by_label("sub-pixel bits").select_option("4")
    check_pictures(page)
    page.wait_for_timeout(400)
    fragment, state = page.evaluate("location.hash"), state_of(page)
    with opened(chromium, explorer, fragment) as other:
        check_pictures(other)
        assert state_of(other) == state
    with tl.explore(f"{explorer.url}{fragment}", wait=False, browser=False) as again:
        context = chromium.new_context()
        third = context.new_page()
        third.goto(again.url)
        third.wait_for_function(QUIET)
        assert state_of(third) == state
        context.close()


def test_broken_link_is_told_of(chromium, explorer):
    with opened(chromium, explorer, "#pixels=%7Bno") as page:
        assert "This link cannot be read" in page.locator(".status").inner_text()


def test_two_pages_are_moved_apart(page, chromium, explorer):
    with opened(chromium, explorer) as other:
        drag(page, 0, (25, 25))
        drag(other, 1, (-25, 25))
        check_pictures(page)
        check_pictures(other)
        assert state_of(page)["vertices"] != state_of(other)["vertices"]


def test_page_says_that_its_server_has_ended(page, explorer):
    explorer.close()
    page.wait_for_function("() => document.querySelector('.status').textContent.includes('has ended')")


def test_page_works_in_the_cell_of_a_notebook(page):
    """A model as anywidget's: messages with buffers, which need not begin at multiples of eight bytes."""
    content = content_of([[1, 1], [12, 3], [2, 9]], [[0, 1, 2]], (14, 11))
    session = Session(content)

    def ask(question, given):
        header, parts = split(answer(session, {**question, "parts": [memoryview(bytes(part)) for part in given]}))
        return [header, [list(part) for part in parts]]

    page.expose_function("askPython", ask)
    page.evaluate(
        """async (markup) => {
          document.querySelector(".explorer").remove();
          const el = document.body.appendChild(document.createElement("div"));
          const module = await import(new URL("explore.js", document.baseURI).href);
          let hear;
          const odd = (part) => new DataView(Uint8Array.from([0, ...part]).buffer, 1);
          const model = {
            get: () => markup,
            on: (_, heard) => { hear = heard; },
            send: async (header, _, given) => {
              const [answer, parts] = await window.askPython(header, given.map((part) => [...part]));
              hear(answer, parts.map(odd));
            },
          };
          await module.default.render({model, el});
        }""",
        markup(),
    )
    page.wait_for_timeout(300)  # the first page notes its state 0.2 s after the last change
    before = page.evaluate("location.hash")
    drag(page, 1, (-35, 35))
    check_pictures(page)
    assert content.moved.tolist() == state_of(page)["vertices"] != [[1, 1], [12, 3], [2, 9]]
    assert page.evaluate("location.hash") == before


def test_window_is_zoomed_and_moved_and_shown_whole_again(page):
    """Wheel and keys zoom round a place, Shift and the mouse move: each time the window is drawn anew."""
    whole = state_of(page)
    box = page.locator('[data-key="a"] svg').bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.wheel(0, -300)
    page.wait_for_function(QUIET)
    near = state_of(page)
    assert near["size"] < whole["size"]
    assert all(0 < at < n for at, n in zip(near["origin"], whole["size"], strict=True))
    check_pictures(page)
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 80, box["y"] + box["height"] / 2, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    assert state_of(page)["origin"][0] < near["origin"][0]
    check_pictures(page)
    page.locator("[data-panel=pixels] .stage").focus()
    page.keyboard.press("-")
    assert state_of(page)["size"] > near["size"]
    page.keyboard.press("Home")
    check_pictures(page)
    assert (state_of(page)["size"], state_of(page)["origin"]) == (whole["size"], whole["origin"])


def test_window_is_pinched_by_two_fingers(chromium, explorer):
    with opened(chromium, explorer, viewport=PHONE, has_touch=True) as page:
        whole = state_of(page)["size"]
        box = page.locator('[data-key="a"] svg').bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        touch = page.context.new_cdp_session(page)
        for kind, reach in (("touchStart", 20), ("touchMove", 40), ("touchMove", 60)):
            fingers = [{"x": x - reach, "y": y, "id": 0}, {"x": x + reach, "y": y, "id": 1}]
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        page.wait_for_function(f"() => {STATE}.size[0] < {whole[0]}")
        check_pictures(page)


BOXES = """() => ["figcaption", ".view", ".why", ".side"]
  .flatMap((one) => [...document.querySelectorAll(`[data-panel=pixels] ${one}`)])
  .map((one) => one.getBoundingClientRect()).map(({left, right, top, bottom}) => [left, right, top, bottom])"""


@pytest.mark.parametrize("width", [390, 1280, 1440, 1920])
@pytest.mark.parametrize("scene", ["shared-edge", "tight-fan", "fan-128-gap"])
def test_nothing_overlaps_and_nothing_is_wider_than_the_page(chromium, scene, width):
    viewport = {"width": width, "height": 860}
    with tl.explore(scene, wait=False, browser=False) as found, opened(chromium, found, viewport=viewport) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        boxes = page.evaluate(BOXES)
        for i, (left, right, top, bottom) in enumerate(boxes):
            for others in boxes[:i]:
                is_beside = right <= others[0] + 1 or left >= others[1] - 1
                assert is_beside or bottom <= others[2] + 1 or top >= others[3] - 1


def test_edges_are_switched_off(page):
    page.locator("[data-panel=pixels] .edged").uncheck()
    assert page.locator('[data-key="a"] .edges').get_attribute("d") == ""
    page.locator("[data-panel=pixels] .edged").check()
    assert page.locator('[data-key="a"] .edges').get_attribute("d") != ""


APART = """[...document.querySelectorAll(".panel")].every((panel) => {
  const words = [...panel.querySelectorAll("figcaption *, .legend *")].map((one) => one.getBoundingClientRect().right);
  return words.length > 2 && Math.max(...words) <= panel.getBoundingClientRect().right + 1;
})"""


@pytest.mark.parametrize("scene", ["tight-fan", "tight-fan-sideways"])
@pytest.mark.parametrize("width", [1280, 1920])
def test_fans_have_six_screen_pixels_a_pixel_and_words_keep_apart(chromium, explorer, width, scene):
    state = json.dumps(scene_of(scene) | {"other": "bresenham_scanline"})
    with opened(chromium, explorer, f"#pixels={state}", viewport={"width": width, "height": 800}) as page:
        assert page.locator("figcaption").count() == 3
        assert page.evaluate("document.querySelector('.explorer').app.parts.pixels.cell") >= 6
        assert page.evaluate(APART)
        assert page.evaluate("document.documentElement.scrollWidth") == width


def test_counts_add_up(page):
    """Kinds of pixels are all that a method draws; those of the difference all that either draws."""
    told = page.inner_text('[data-key="b"] .bad')
    n, kinds = re.fullmatch(r"(\d+) pixels drawn: (.*)", told).groups()
    assert int(n) == sum(map(int, re.findall(r"\d+", kinds)))
    n, whole = re.search(
        r"(\d+) of (\d+) pixels differ", page.inner_text('[data-key="difference"] figcaption')
    ).groups()
    legend = [int(one) for one in re.findall(r"(\d+) ", page.inner_text('[data-key="difference"] .legend'))]
    assert sum(legend) == int(whole)
    assert sum(legend[1:]) == int(n)


@pytest.mark.parametrize("blocked", ["setTimeout(() => this.onerror?.(), 0)", ""], ids=["refused", "held up"])
def test_page_without_its_socket_asks_by_post(chromium, explorer, blocked):
    context = chromium.new_context()
    context.add_init_script(f"WebSocket = class {{ constructor() {{ {blocked} }} close() {{}} }}")
    page = context.new_page()
    page.goto(explorer.url.split("#")[0])
    page.wait_for_function("() => document.querySelector('.status').textContent.includes('WebSocket is blocked')")
    pixels_of(page).locator("[data-name=scene]").select_option("two-triangles")
    page.wait_for_function(f"() => {STATE}.scene === 'two-triangles'")
    check_pictures(page)
    explorer.close()
    pixels_of(page).locator("[data-name=scene]").select_option("wide")
    page.wait_for_function("() => document.querySelector('.status').textContent.includes('Failed to fetch')")
    context.close()
