"""Opens the explorer: in the browser, or in the cell of a notebook."""

from __future__ import annotations

import os
import sys
import warnings
import webbrowser
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._apps.explore.content import content_of
from topleft._apps.explore.session import Content

if TYPE_CHECKING:
    from topleft._apps.explore.server import Server


class Explorer:
    """An open explorer: the address of its page, and the vertices as the page has moved them.

    It ends when its page has been closed for half a minute, with `close`, or at the end of a ``with`` block.

    Attributes
    ----------
    url : str
        The address of the page. It holds a token, which grants access.

    Examples
    --------
    >>> import topleft as tl
    >>> with tl.explore("torus-knot", wait=False, browser=False) as explorer:  # doctest: +SKIP
    ...     print(explorer.url)
    """

    def __init__(self, content: Content, server: Server) -> None:
        self._content, self._server = content, server
        self.url = server.url

    @property
    def vertices(self) -> NDArray[np.float64] | None:
        """The vertices as the page has moved them last, (V, 2) or (V, 3) in pixels; None for a mesh."""
        return None if self._content.moved is None else self._content.moved.copy()

    def wait(self) -> None:
        """Return when the page has been closed for a while."""
        self._server.wait()

    def close(self) -> None:
        """End the explorer."""
        self._server.close()

    def __enter__(self) -> Explorer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Explorer({self.url!r})"


def explore(
    vertices: Any = None, triangles: ArrayLike | None = None, size: int | tuple[int, int] | None = None, *,
    wait: bool | None = None, browser: bool = True,
) -> Any:  # fmt: skip
    """Return an explorer: a page in the browser, or in the cell of a notebook, where triangles can be moved.

    Parameters
    ----------
    vertices : array_like, shape (V, 2) or (V, 3); or a mesh, a path, a mesh of another library; or the name of a scene
        Pixels, or pixels and depth, with `triangles`, at most 1,000, which are drawn magnified. A mesh is shown from an
        orbit. A name of `topleft.scenes.TUTORIAL_SCENES` or of `topleft.failure_scenes.FAILURE_SCENES` is drawn
        magnified; the default is two triangles that share an edge.
    triangles : array_like of integers, shape (T, 3), optional
        Indices of vertices.
    size : (int, int), or int for a square, optional
        Width and height of the picture in pixels, at most 256; the default holds all vertices.
    wait : bool, optional
        Whether to return only when the page is closed, or at Ctrl-C. The default is True in programs, False in an
        interactive interpreter.
    browser : bool
        Whether the browser is opened. The address is printed anyway.

    Returns
    -------
    Explorer, or a widget in a notebook
        ``.vertices`` are the vertices as the page has moved them, (V, 2) or (V, 3) float64, None for a mesh; ``.url``,
        ``.wait()`` and ``.close()``; a widget has only ``.vertices``.

    Raises
    ------
    MissingPackageError
        If a package of the extra `explore` is missing.
    ValueError, TypeError, IndexError
        If the arrays are no triangles in pixels, or too many.
    MeshError
        If a file is no mesh.

    Examples
    --------
    >>> import topleft as tl
    >>> explorer = tl.explore([[1, 1], [7, 2], [2, 7]], [[0, 1, 2]], 8, wait=False, browser=False)  # doctest: +SKIP
    >>> explorer.close()  # doctest: +SKIP
    """
    content = content_of(vertices, triangles, size)
    if in_notebook():
        from topleft._apps.explore.notebook import widget_of

        return widget_of(content)
    explorer = open_page(content, browser=browser)
    if wait if wait is not None else not hasattr(sys, "ps1"):
        try:
            explorer.wait()
        except KeyboardInterrupt:
            explorer.close()
    return explorer


def open_page(
    content: Content, *, host: str | None = None, port: int = 0, idle: float = 30.0, browser: bool = True
) -> Explorer:
    """Serve a content, print the address, open the browser, and return the explorer."""
    from topleft._apps.explore.server import LOOPBACK, Server  # which needs the extra

    if host not in (None, LOOPBACK, "localhost", "::1"):
        warnings.warn(
            f"whoever reaches {host} and knows the address sees the page, and nothing is encrypted", stacklevel=3
        )
    server = Server(content, host or LOOPBACK, port, idle)
    server.start()
    try:
        print(f"topleft explore: {server.url}", flush=True)  # noqa: T201 -- where to look
        if browser and has_display():
            webbrowser.open(server.url)
    except BaseException:  # Ctrl-C, say
        server.close()
        raise
    return Explorer(content, server)


def has_display() -> bool:
    """Whether a browser can show a window: otherwise `webbrowser` would open a browser in the terminal."""
    return sys.platform != "linux" or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))


def in_notebook() -> bool:
    """Whether a cell is being run: Jupyter, VS Code."""
    shell = sys.modules.get("IPython")
    running = None if shell is None else shell.get_ipython()
    return running is not None and hasattr(running, "kernel")
