"""The page in the cell of a notebook: the widget answers what the page asks, and gives back what was moved."""

import sys
import types

import numpy as np
import pytest

import topleft as tl
from topleft._apps.explore import notebook
from topleft._apps.explore.content import content_of
from topleft.errors import MissingPackageError

VERTICES, TRIANGLES = [[1.0, 1], [7, 1], [1, 7]], [[0, 1, 2]]


@pytest.fixture
def shell(monkeypatch):
    """What `topleft.explore` finds where a cell is run."""
    found = types.ModuleType("IPython")
    found.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", found)


def test_widget_answers_and_returns_the_vertices_that_were_moved():
    pytest.importorskip("anywidget", reason="the explorer needs its extra: pip install '.[explore]'")
    widget, sent = notebook.widget_of(content_of(VERTICES, TRIANGLES, 8)), []
    widget.send = lambda header, parts: sent.append((header, parts))
    assert widget.vertices.tolist() == VERTICES
    moved = [[2.0, 2], [7, 1], [1, 7]]
    parts = [np.array(moved).tobytes(), np.array(TRIANGLES, np.int32).tobytes()]
    question = {"n_components": 2, "size": [8, 8], "origin": ["0", "0"], "drawings": [{"triangles": 1}]}
    widget._answer(None, {"do": "engine.draw", "id": 1, **question}, parts)
    header, parts = sent.pop()
    owners = header["arrays"]["shown0"]
    shown = np.frombuffer(parts[owners["part"]], owners["dtype"]).reshape(owners["shape"])
    assert (shown[..., 0] == tl.rasterize(moved, TRIANGLES, 8).triangle).all()
    widget._answer(None, {"do": "pixels.moved", "id": 2, "vertices": moved}, [])
    assert widget.vertices.tolist() == moved


def test_explore_in_a_notebook_is_a_widget_with_the_page(shell):
    anywidget = pytest.importorskip("anywidget", reason="the explorer needs its extra: pip install '.[explore]'")
    widget = tl.explore(VERTICES, TRIANGLES, 8)
    assert isinstance(widget, anywidget.AnyWidget)
    assert widget.markup.startswith('<div class="explorer">')
    assert "export default {render}" in widget._esm


def test_notebook_without_anywidget_is_told_how_to_get_it(shell, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(MissingPackageError, match="pip install anywidget"):
        tl.explore(VERTICES, TRIANGLES, 8)


@pytest.mark.parametrize("name", ["uvicorn", "starlette.applications", "websockets"])
def test_explore_without_its_extra_is_told_how_to_get_it(name, monkeypatch):
    monkeypatch.delitem(sys.modules, "topleft._apps.explore.server", raising=False)
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingPackageError, match=r"the explorer needs .*: pip install starlette"):
        tl.explore(VERTICES, TRIANGLES, 8, wait=False, browser=False)
