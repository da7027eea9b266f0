"""The page that needs no Python, in Chromium: the pixels that Python gives, and the parts that it has."""

import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from shutil import which

import numpy as np
import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")

from topleft._apps.explore.handlers import answer  # noqa: E402
from topleft._apps.explore.session import Content, Session  # noqa: E402
from topleft._apps.explore.static import SETS, write_static  # noqa: E402

CHROMIUM = next(filter(None, map(which, ("chromium", "chromium-browser", "google-chrome"))), None)
PAGE = files("topleft._apps.explore").joinpath("page")
HAS_KERNELS = all(PAGE.joinpath(f"topleft-{name}.wasm").is_file() for name in SETS)
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no browser: apt-get install chromium"),
    pytest.mark.skipif(not HAS_KERNELS, reason="no kernels for WebAssembly: python packaging/wasm.py"),
]

#: What a question of the page's own line gets: its arrays as lists.
ASK = """async ([name, given]) => {
  try {
    const {arrays, ...header} = await document.querySelector(".explorer").app.line.ask(name, given);
    return {...header, arrays: Object.fromEntries(Object.entries(arrays).map(([key, array]) => [key, [...array]]))};
  } catch (error) {
    return {error: error.message};
  }
}"""


class Quiet(SimpleHTTPRequestHandler):
    """A server of files that tells nobody."""

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("static")
    write_static(folder, Content())
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        found = browser.new_page()
        found.goto(f"http://127.0.0.1:{server.server_port}/")
        found.wait_for_function("document.querySelector('.explorer').app?.parts.pixels?.drawn")
        yield found
        browser.close()
    server.shutdown()
    server.server_close()


def ask(page, question, **given):
    return page.evaluate(ASK, [question, given])


def test_first_picture_is_that_of_python(page):
    state = page.evaluate("document.querySelector('.explorer').app.parts.pixels.state()")
    own = answer(Session(Content()), {"id": 1, "do": "pixels.draw", "state": state})
    mine = ask(page, "pixels.draw", state=state)
    assert sorted(mine["arrays"]) == sorted(own.arrays)
    for name, array in own.arrays.items():
        assert mine["arrays"][name] == np.ravel(array).tolist()


def test_page_without_python_has_no_part_mesh(page):
    shown = page.evaluate(
        "[...document.querySelectorAll('[data-tab]')].filter((one) => !one.hidden).map((one) => one.dataset.tab)"
    )
    assert shown == ["pixels", "steps", "race"]
