"""Shows the page in the cell of a notebook: its modules as a single module, its requests over the widget's messages."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft._apps.explore.handlers import answer
from topleft._apps.explore.messages import split
from topleft._apps.explore.session import SCRIPTS, Content, Session
from topleft.errors import MissingPackageError


def widget_of(content: Content) -> Any:
    """Return the widget that shows a content."""
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise MissingPackageError(f"the explorer in a notebook needs {error.name}: pip install anywidget") from error

    page = files("topleft._apps.explore").joinpath("page")

    class ExplorerWidget(anywidget.AnyWidget):  # type: ignore[misc, unused-ignore]
        """The page in a cell; `vertices` are the vertices as the page has moved them."""

        _esm = one_module()
        _css = page.joinpath("explore.css").read_text(encoding="utf-8")
        markup = traitlets.Unicode(markup()).tag(sync=True)

        def __init__(self) -> None:
            super().__init__()
            self._content, self._session = content, Session(content)
            self.on_msg(self._answer)

        @property
        def vertices(self) -> NDArray[np.float64] | None:
            """The vertices as the page has moved them last; None for a mesh."""
            return None if self._content.moved is None else self._content.moved.copy()

        def _answer(self, _: object, question: dict[str, Any], parts: list[memoryview]) -> None:
            header, arrays = split(answer(self._session, {**question, "parts": [memoryview(part) for part in parts]}))
            self.send(header, arrays)

    return ExplorerWidget()


def one_module() -> str:
    """The modules of the page joined to a module for a notebook."""
    page = files("topleft._apps.explore").joinpath("page")
    text = "\n".join(page.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    return re.sub(r"^import .*;\n|^export (?!default)", "", text, flags=re.MULTILINE)


def markup() -> str:
    """The root element of the page."""
    text = files("topleft._apps.explore").joinpath("page", "index.html").read_text(encoding="utf-8")
    return text[text.index('<div class="explorer">') : text.index("</body>")]
