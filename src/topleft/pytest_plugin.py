"""A plugin of pytest: compares pictures of tests with PNG files that are kept beside them.

In: meshes and pictures of tests. Out: nothing, or an `AssertionError` in plain words, and files of the picture and of
the difference. A project takes it by ``pytest_plugins = ["topleft.pytest_plugin"]`` in its first conftest.py.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from topleft import render, save_image
from topleft._core.base.arrays import shown
from topleft.testing import assert_same_picture

__all__ = ["assert_picture", "pytest_addoption"]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--update-pictures``, which replaces the kept pictures by those of the tests."""
    parser.getgroup("topleft").addoption(
        "--update-pictures",
        action="store_true",
        help="write the pictures of assert_picture, in place of comparing them",
    )


@dataclass(frozen=True)
class StoredPictures:
    """A folder of pictures to compare those of tests with."""

    folder: Path
    is_updating: bool

    def check(self, what: Any, name: str, *arguments: Any, tolerance: float = 0, **options: Any) -> None:
        """Raise an error with the places of the differences if a picture differs from the one that is kept."""
        __tracebackhide__ = True  # pytest shows the line of the caller
        if not (isinstance(name, str) and re.fullmatch(r"[\w-]+(\.[\w-]+)*", name)):
            raise ValueError(f"name must be letters, digits, '_', '-' and '.', got {shown(name)}")
        if name.endswith((".got", ".off")):
            raise ValueError(f"name must not end in .got or .off, the pictures of a difference, got {shown(name)}")
        got = what if isinstance(what, np.ndarray) else render(what, *arguments, **options)
        if isinstance(what, np.ndarray) and (arguments or options):
            raise TypeError("a picture takes no camera, size or options: they are for meshes")
        got = np.where(got, np.uint8(255), np.uint8(0)) if got.dtype == np.bool_ else got
        kept, drawn, off = (self.folder / f"{name}{end}.png" for end in ("", ".got", ".off"))
        for path in (drawn, off):
            path.unlink(missing_ok=True)
        if self.is_updating:
            self.folder.mkdir(parents=True, exist_ok=True)
            save_image(kept, got)
            return
        if not kept.exists():
            raise AssertionError(f"there is no picture {kept} yet: pytest --update-pictures writes it")
        try:
            assert_same_picture(got, _read(kept), tolerance=tolerance, path=off)
        except AssertionError as error:
            save_image(drawn, got)
            told = f"{error}\n  the picture is {drawn}; if it is right: pytest --update-pictures"
            raise AssertionError(told) from None


def _read(path: Path) -> NDArray[Any]:
    try:
        with Image.open(path) as image:
            return np.asarray(image)
    except (OSError, SyntaxError, ValueError) as error:  # of Pillow, for files that are damaged
        raise AssertionError(f"the picture {path} cannot be read: {error}") from error


@pytest.fixture
def assert_picture(request: pytest.FixtureRequest) -> Callable[..., None]:
    """A function that compares a picture of a mesh with the PNG file of its name.

    ``assert_picture(mesh, "name", camera, size, tolerance=0, **options)`` draws by `topleft.render`; a picture, (H, W),
    (H, W, 3) or (H, W, 4) uint8, (H, W) uint16 or bool, is taken as it is. Its PNG file stands in the folder `pictures`
    beside the file of the test. A difference raises an `AssertionError` with the number of pixels and the first of
    them; name.got.png and name.off.png beside it show the new picture and the difference.
    """
    folder = request.path.parent / "pictures"
    return StoredPictures(folder, request.config.getoption("--update-pictures")).check
