"""Both engines of the page in Chromium, Python and the kernels in WebAssembly: the same questions, the same answers."""

import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import get_args

import pytest
from node_page import CHROMIUM, PAGE

playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")
pytest.importorskip("uvicorn", reason="the explorer needs its extra: pip install '.[explore]'")

import topleft as tl  # noqa: E402
from topleft._apps.explore.session import Content  # noqa: E402
from topleft._apps.explore.static import MODULE, write_static  # noqa: E402
from topleft.typing import SamplingOption  # noqa: E402

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no browser: apt-get install chromium"),
    pytest.mark.skipif(not PAGE.joinpath(MODULE).is_file(), reason="no topleft.wasm: python packaging/wasm.py"),
]

#: What a function of the page returns, its arrays as lists, without times.
CALL = """async ([module, name, ...given]) => {
  const {app} = document.querySelector(".explorer"), called = await import(new URL(module, document.baseURI).href);
  const plain = (key, value) => key === "seconds" ? 0 : ArrayBuffer.isView(value) ? Array.from(value, Number) : value;
  const isTime = (one) => Array.isArray(one) && one[2] === "of the call that draws it";
  const found = await called[name](app.line, app.hello, ...given);
  for (const panel of found.panels ?? []) panel.facts = panel.facts.filter((one) => !isTime(one));
  return JSON.stringify(found, plain);
}"""

SCENE = {
    "vertices": [[1.5, 1.5, 0.5], [9.5, 1.5, 0.25], [1.5, 9.5, 0.75], [9.5, 9.5, 0.0]],
    "triangles": [[0, 1, 2], [1, 3, 2]], "size": [11, 12], "origin": [0, 0], "exact": True, "other": "zigzag",
}  # fmt: skip


class Quiet(SimpleHTTPRequestHandler):
    """A server of files that tells nobody."""

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The page that Python serves, and the folder that `--export` writes."""
    folder = tmp_path_factory.mktemp("static")
    write_static(folder, Content())
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tl.explore("shared-edge", wait=False, browser=False) as explorer, playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        found = []
        for url in (explorer.url, f"http://127.0.0.1:{server.server_port}/"):
            found.append(browser.new_page())
            found[-1].goto(url)
            found[-1].wait_for_function("document.querySelector('.explorer').app?.parts.pixels?.drawn")
        yield found
        browser.close()
    server.shutdown()
    server.server_close()


def check(pages, *call):
    served, static = (page.evaluate(CALL, [*call]) for page in pages)
    assert served == static
    return served


@pytest.mark.parametrize("sampling", get_args(SamplingOption))
def test_pixels_and_reasons_are_the_same(pages, sampling):
    state = SCENE | {"sampling": sampling}
    assert "picture" in check(pages, "pixels.js", "drawPixels", state)
    assert "sentences" in check(pages, "probe.js", "probe", {"state": state, "pixel": [5, 5], "method": "zigzag"})


@pytest.mark.parametrize("method", ["edge", "scanline", "bresenham_scanline", "float_barycentric"])
def test_steps_are_the_same(pages, method):
    assert "outlines" in check(pages, "steps.js", "recorded", SCENE, method, 8)


@pytest.mark.parametrize("family", ["fan", "far", "layers"])
def test_races_are_the_same(pages, family):
    for name in ("race", "raceColumn"):
        check(pages, "race.js", name, {"family": family, "positions": [3], "seed": 1 if family == "fan" else 0})


def test_page_without_python_has_no_part_mesh(pages):
    shown = [
        page.evaluate(
            "[...document.querySelectorAll('[data-tab]')].filter((one) => !one.hidden).map((one) => one.dataset.tab)"
        )
        for page in pages
    ]
    assert shown == [["pixels", "steps", "mesh", "race"], ["pixels", "steps", "race"]]
