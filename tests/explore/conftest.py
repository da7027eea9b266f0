"""The page of the explorer in node and in Chromium, for the tests of its parts."""

import pytest
from node_page import CHROMIUM, NODE, NodePage


@pytest.fixture(scope="module")
def node_page():
    if NODE is None:
        pytest.skip("node is not installed")
    found = NodePage()
    yield found
    found.close()


@pytest.fixture(scope="module")
def page(node_page):
    return node_page


@pytest.fixture(scope="module")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install playwright")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()
