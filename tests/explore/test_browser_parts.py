"""Steps, Mesh and Race in a browser: what is on the screen is what the library draws, by mouse, touch and keys."""

import io
import json
from contextlib import contextmanager

import numpy as np
import pytest
from node_page import CHROMIUM
from PIL import Image

pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")
pytest.importorskip("uvicorn", reason="the explorer needs its extra: pip install '.[explore]'")

import topleft as tl
from topleft._apps.explore.mesh_view import HANDLERS, MeshView
from topleft._apps.explore.session import Content, Session

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no browser: apt-get install chromium")

PART = "document.querySelector('.explorer').app.parts"
AT_REST = """() => {
  const frames = document.querySelector(".explorer").app?.parts.mesh.frames;
  return frames?.last?.image instanceof ImageData && frames.newest === frames.asked && !frames.waiting;
}"""
PIXELS = """(where) => {
  const canvas = document.querySelector(where);
  const {data, width, height} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return [height, width, btoa([...data].map((byte) => String.fromCharCode(byte)).join(""))];
}"""


@pytest.fixture(scope="module")
def explorer():
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"))
    with tl.explore(mesh, wait=False, browser=False) as found:
        yield found


@contextmanager
def opened(chromium, explorer, fragment, **more):
    """The page, and nothing that its console complains of."""
    context = chromium.new_context(**{"viewport": {"width": 900, "height": 700}, "bypass_csp": True, **more})
    page, complaints = context.new_page(), []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(explorer.url.split("#")[0] + fragment)
    page.wait_for_function("() => document.querySelector('.explorer').app?.parts")
    yield page
    context.close()
    assert complaints == []


@pytest.fixture
def mesh_page(chromium, explorer):
    with opened(chromium, explorer, "#mesh=%7B%7D") as page:
        page.wait_for_function(AT_REST)
        yield page


@pytest.fixture
def steps_page(chromium, explorer):
    with opened(chromium, explorer, "#steps=" + json.dumps({"scene": "two-triangles", "method": "edge"})) as page:
        page.wait_for_function(f"() => {PART}.steps.state().step === 0")
        yield page


def canvas_of(page, where):
    import base64

    height, width, data = page.evaluate(PIXELS, where)
    return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)


# ---- Mesh -----------------------------------------------------------------------------------------------------------


def check_mesh(page):
    """Compare the canvas, when it rests, with what `render` draws of the view; returns the view."""
    page.wait_for_function(AT_REST)
    view = page.evaluate(f"({{...{PART}.mesh.view, size: {PART}.mesh.frames.last.size}})")
    _, arrays = HANDLERS["mesh.save"](
        Session(Content(mesh=tl.Mesh(*tl.scenes.shape("torus-knot")))), {**view, "what": "png"}
    )
    wanted = np.asarray(Image.open(io.BytesIO(arrays["file"])))
    shown = canvas_of(page, ".stage.mesh canvas")
    assert shown.shape == wanted.shape
    assert (wanted[..., 3] > 0).any()
    assert np.array_equal(shown[..., 3], wanted[..., 3])
    is_opaque = wanted[..., 3] == 255
    assert np.array_equal(shown[is_opaque], wanted[is_opaque])
    # A canvas keeps colours multiplied by their alpha, in bytes.
    slack = 128 / np.maximum(wanted[..., 3:], 1)
    assert (np.abs(shown.astype(int) - wanted) <= slack + 1)[wanted[..., 3] > 0].all()
    return MeshView.parse(view)


def test_mesh_rests_in_the_pixels_of_render(mesh_page):
    assert check_mesh(mesh_page).azimuth == 35


def test_mesh_is_turned_moved_and_zoomed_by_the_mouse(mesh_page):
    page = mesh_page
    page.mouse.move(300, 300)
    page.mouse.down()
    page.mouse.move(350, 280, steps=4)
    page.mouse.up()
    view = check_mesh(page)
    assert view.azimuth == pytest.approx(35 - 0.4 * 50)
    assert view.elevation == pytest.approx(20 - 0.4 * 20)
    page.mouse.down(button="right")
    page.mouse.move(380, 280, steps=3)
    page.mouse.up(button="right")
    page.mouse.wheel(0, -300)
    view = check_mesh(page)
    assert view.pan[0] > 0.05
    assert view.zoom == pytest.approx(1.0015**300)


def test_mesh_is_turned_by_keys_alone(mesh_page):
    page = mesh_page
    for _ in range(9):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.tagName") == "CANVAS":
            break
    for key in ("ArrowLeft", "ArrowUp", "Shift+ArrowRight", "+"):
        page.keyboard.press(key)
    view = check_mesh(page)
    assert (view.azimuth, view.elevation, view.pan) == (30, 25, (0.05, 0.0))
    assert view.zoom == pytest.approx(1.1)
    page.keyboard.press("0")
    assert check_mesh(page).zoom == 1


def test_mesh_is_pinched_by_two_fingers(chromium, explorer):
    with opened(chromium, explorer, "#mesh=%7B%7D", has_touch=True, viewport={"width": 390, "height": 700}) as page:
        page.wait_for_function(AT_REST)
        touch = page.context.new_cdp_session(page)
        fingers = [{"x": 150, "y": 200, "id": 0}, {"x": 200, "y": 200, "id": 1}]
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": fingers})
        apart = [{"x": 125, "y": 200, "id": 0}, {"x": 225, "y": 200, "id": 1}]
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": apart})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        view = check_mesh(page)
        assert view.zoom == pytest.approx(2)
        assert view.azimuth == 35


def test_click_tells_the_triangle(mesh_page):
    page = mesh_page
    view = check_mesh(page)
    mesh = tl.Mesh(*tl.scenes.shape("torus-knot"))
    frags = tl.rasterize_mesh(mesh, view.camera(mesh), view.size)
    y, x = np.argwhere(frags.mask)[len(np.argwhere(frags.mask)) // 2].tolist()
    box = page.evaluate("(({x, y}) => [x, y])(document.querySelector('.stage.mesh canvas').getBoundingClientRect())")
    page.mouse.click(box[0] + x + 0.5, box[1] + y + 0.5)
    page.wait_for_function("() => document.querySelector('[data-panel=mesh] dl').children.length > 2")
    told = page.inner_text("[data-panel=mesh] dl").split("\n")
    assert told[told.index("triangle") + 1] == str(frags.triangle[y, x])
    page.set_input_files(
        "[data-panel=mesh] input[type=file]",
        {"name": "a.obj", "mimeType": "text/plain", "buffer": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
    )
    page.wait_for_function(
        "() => document.querySelector('[data-panel=mesh] .side').textContent.includes('1 triangles')"
    )
    assert page.evaluate("document.querySelector('[data-panel=mesh] dl').children.length") == 0


def test_layer_is_chosen_and_restored_by_the_link(chromium, explorer, mesh_page):
    page = mesh_page
    page.get_by_label("layer").select_option("triangle")
    page.wait_for_function("() => location.hash.includes('triangle')")
    view = check_mesh(page)
    assert view.layer == "triangle"
    with opened(chromium, explorer, page.evaluate("location.hash")) as other:
        other.wait_for_function(AT_REST)
        assert check_mesh(other) == view


def test_file_dropped_on_the_page_is_drawn(mesh_page):
    cube = tl.Mesh(*tl.scenes.shape("cube"))
    lines = [f"v {x} {y} {z}" for x, y, z in cube.vertices] + [
        f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cube.triangles
    ]
    file = {"name": "cube.obj", "mimeType": "text/plain", "buffer": "\n".join(lines).encode()}
    mesh_page.set_input_files("[data-panel=mesh] input[type=file]", file)
    mesh_page.wait_for_function(
        "() => document.querySelector('[data-panel=mesh] p').textContent.includes('12 triangles')"
    )
    mesh_page.set_input_files("[data-panel=mesh] input[type=file]", {**file, "name": "cube.ply"})
    mesh_page.wait_for_function("() => document.querySelector('.status.bad')?.textContent.includes('cannot read')")
    assert "12 triangles" in mesh_page.inner_text("[data-panel=mesh] p >> nth=0")


def test_view_is_saved_as_python(mesh_page, folder):
    with mesh_page.expect_download() as saving:
        mesh_page.get_by_role("button", name="Python").click()
    code = saving.value.path().read_text(encoding="utf-8")
    assert saving.value.suggested_filename == "torus-knot.py" or saving.value.suggested_filename.endswith(".py")
    compile(code, "view.py", "exec")


def test_mesh_turning_by_itself_paints_frames(mesh_page):
    mesh_page.get_by_label("turn by itself").check()
    mesh_page.wait_for_function(f"() => {PART}.mesh.frames.painted > 20")
    mesh_page.get_by_label("turn by itself").uncheck()
    check_mesh(mesh_page)


# ---- Steps ----------------------------------------------------------------------------------------------------------


def steps_state(page):
    return page.evaluate(f"{PART}.steps.state()")


def test_steps_end_in_the_picture_of_the_method(steps_page):
    page = steps_page
    state = page.evaluate("document.querySelector('.explorer').app.line.ask('pixels.scene', {name: 'two-triangles'})")[
        "state"
    ]
    for method in ("edge", "bresenham_scanline"):
        page.get_by_label("method").last.select_option(method)
        counts = tl.overdraw(state["vertices"], state["triangles"], tuple(state["size"]), method=method)
        page.wait_for_function(f"() => {PART}.steps.state().method === '{method}' && {PART}.steps.state().step === 0")
        page.get_by_role("button", name="Last").click()
        shown = canvas_of(page, ".magnified canvas")
        assert np.array_equal(shown[..., 3] == 255, counts > 0)
        assert np.array_equal((shown[..., 0] == 213) & (shown[..., 3] == 255), counts > 1)


def test_steps_go_on_and_back_by_keys(steps_page):
    page = steps_page
    page.get_by_role("button", name="First").click()
    page.get_by_role("button", name="Step", exact=True).click()
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
    assert steps_state(page)["step"] == 2
    told = page.inner_text("[data-panel=steps] .group >> nth=1")
    assert "2 of" in told
    assert "E0" in told
    page.keyboard.press("Shift+ArrowRight")
    assert steps_state(page)["step"] > 3
    page.keyboard.press("Home")
    assert steps_state(page)["step"] == 0
    page.keyboard.press("PageDown")
    page.keyboard.press("PageDown")
    second = steps_state(page)["step"]
    assert "triangle 1" in page.inner_text("[data-panel=steps] .legend")
    page.keyboard.press("PageUp")
    assert 0 < steps_state(page)["step"] < second
    page.keyboard.press("End")
    page.keyboard.press("Home")
    assert steps_state(page)["step"] == 0


def test_steps_play_and_pause(steps_page):
    page = steps_page
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(f"() => {PART}.steps.state().step > 8")
    page.get_by_role("button", name="Play").click()
    step = steps_state(page)["step"]
    page.wait_for_timeout(300)
    assert steps_state(page)["step"] == step


# ---- Race -----------------------------------------------------------------------------------------------------------


def test_race_marks_the_pixels_that_are_wrong(chromium, explorer, node_page):
    link = "#race=" + json.dumps({"family": "sliver", "positions": [2], "seed": 1})
    with opened(chromium, explorer, link) as page:
        page.wait_for_function(f"() => {PART}.race.drawn > 0")
        told = node_page.call("race.js", "race", {"family": "sliver", "positions": [2], "seed": 1})
        shown = page.evaluate("[...document.querySelectorAll('.race figure')].map((one) => one.title)")
        assert shown == [row["title"] for row in told["rows"]]
        for k, pixels in enumerate(told["pictures"]):
            wanted = np.array(pixels).reshape(64, 64, 4)
            marked = canvas_of(page, f".race figure:nth-child({k + 1}) canvas")
            assert np.array_equal(marked[wanted[..., 3] == 255], wanted[wanted[..., 3] == 255])
        drawn = page.evaluate(f"{PART}.race.drawn")
        page.locator("[data-panel=race] input[type=range]").focus()
        page.keyboard.press("End")
        page.wait_for_function(f"() => {PART}.race.drawn > {drawn}")
        page.wait_for_function("() => document.querySelectorAll('.chart .here').length === 23")
        assert page.evaluate(f"{PART}.race.state().positions") == [11]
