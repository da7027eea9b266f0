"""Reads the files that a mesh file names: material libraries, buffers, pictures; from its own folder and nowhere else.

Input: names out of a file that nobody has checked. Output: bytes, or the pixels of a picture; None, and a note, for
what is not there, lies outside of the folder or cannot be read.
"""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import U8
from topleft._meshes.io.notes import Notes
from topleft._meshes.model.texture import MAX_TEXTURE_SIZE
from topleft.errors import MeshError

MAX_VERTICES = 200_000_000
MAX_TEXTURE_PIXELS = 1 << 26
"""8192 x 8192."""

MAX_FILE_BYTES = 1 << 32
"""Of a file that is named by a mesh."""

PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF", "PPM", "DDS", "AVIF")
"""Formats of Pillow that are data and nothing else: EPS, say, would run a program."""


class Cloud(NamedTuple):
    """Points of a file that belong to no triangle."""

    positions: npt.NDArray[Any]
    colors: U8 | None = None
    """(N, 4) sRGB."""
    normals: npt.NDArray[Any] | None = None


class Moment(NamedTuple):
    """Which time of which animation of a file is read."""

    time: float
    """Seconds."""
    clip: int | str | None = None
    """The index or the name of the animation."""


class InputFile:
    """A mesh file, the files beside it, what may be taken from them, and what was missing.

    Parameters
    ----------
    path : Path
        The mesh file.
    max_vertices, max_texture_pixels : int
        What has more is refused, or left out.
    """

    def __init__(
        self, path: Path, *, max_vertices: int = MAX_VERTICES, max_texture_pixels: int = MAX_TEXTURE_PIXELS
    ) -> None:
        self.path = path
        self.notes = Notes(str(path))
        self.clouds: list[Cloud] = []
        self.moment: Moment | None = None
        self.max_vertices = max_vertices
        self.max_texture_pixels = max_texture_pixels
        self._pictures: dict[tuple[Path, str], U8 | None] = {}

    def check_n_vertices(self, n: int) -> None:
        """Raise an error if there are more vertices than allowed.

        Raises
        ------
        MeshError
            If so.
        """
        if n > self.max_vertices:
            raise MeshError(f"{str(self.path)!r} has {n} vertices, more than the {self.max_vertices} of max_vertices")

    def read(self, name: str, what: str, folder: Path | None = None) -> bytes | None:
        """The content of a file that the mesh names; `what` is the plural of its kind, for notes."""
        path = self.find(name, what, folder)
        if path is None:
            return None
        if path.stat().st_size > MAX_FILE_BYTES:
            self.notes.add(f"{what} of more than {MAX_FILE_BYTES >> 30} GiB not read", name)
            return None
        try:
            return path.read_bytes()
        except OSError:
            self.notes.add(f"{what} that cannot be read", name)
            return None

    def find(self, name: str, what: str, folder: Path | None = None) -> Path | None:
        """Where such a file is: in the folder of the mesh, or below.

        What is named by a path that leads elsewhere, as other machines have them, is looked for in the folder itself.
        """
        home = self.path.parent.resolve()
        folder = home if folder is None else folder
        name = name.replace("\\", "/")
        leads_elsewhere = "\0" in name or re.match(r"/|[A-Za-z][A-Za-z0-9+.-]*:", name) is not None
        try:
            if not leads_elsewhere:
                found = _as_spelled(folder / name)
                if found is not None and found.resolve().is_relative_to(home):
                    return found
                leads_elsewhere = not (folder / name).resolve().is_relative_to(home) or found is not None
            if leads_elsewhere and not re.match(r"[A-Za-z][A-Za-z0-9+.-]+:", name):
                found = _as_spelled(folder / name.rpartition("/")[2].replace("\0", ""))
                if found is not None and found.resolve().is_relative_to(home):
                    return found
        except (OSError, RuntimeError, ValueError):  # names that no disk can have; circles of links
            pass
        where = "outside of its folder not read" if leads_elsewhere else "not found"
        self.notes.add(f"{what} {where}", name)
        return None

    def picture(self, name: str, folder: Path | None = None) -> U8 | None:
        """The picture (H, W, 4) of a file that the mesh names; each is read once."""
        key = (folder or self.path.parent, name)
        if key not in self._pictures:
            content = self.read(name, "textures", folder)
            self._pictures[key] = None if content is None else self.decode(content, name)
        return self._pictures[key]

    def decode(self, content: bytes, name: str) -> U8 | None:
        """The picture (H, W, 4) that the bytes of a file encode."""
        try:
            return decoded(content, self.max_texture_pixels)
        except MeshError as error:
            self.notes.add(f"textures {error} not read", name)
        except Exception:  # broken bytes end in whatever the decoder meets: OSError, SyntaxError, struct.error, ...
            self.notes.add("textures that cannot be read", name)
        return None


def numbers_of_text(content: bytes, dtype: Any = np.float64) -> npt.NDArray[Any]:
    """The numbers that a text holds and nothing else does.

    Raises
    ------
    MeshError
        If something else is in it.
    """
    if not content.strip():
        return np.zeros(0, dtype)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message="string or file could not be read")
            return np.fromstring(content, dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        raise MeshError("a number in it is none") from None


def whole_numbers(values: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """The values as int64; those that have none there come out as any."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.int64)


def decoded(content: bytes, max_pixels: int = MAX_TEXTURE_PIXELS) -> U8:
    """The picture (H, W, 4), uint8, of an encoded one.

    Raises
    ------
    MeshError
        If it has too many pixels; before they are decoded.
    OSError, ValueError, SyntaxError
        If it is broken.
    """
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            image = Image.open(io.BytesIO(content), formats=[name for name in PICTURE_FORMATS if name in _known()])
        except Image.DecompressionBombError:
            raise MeshError(f"of more than {max_pixels} pixels") from None
        with image:
            width, height = image.size
            if width * height > max_pixels:
                raise MeshError(f"of more than {max_pixels} pixels")
            if max(width, height) > MAX_TEXTURE_SIZE:
                raise MeshError(f"with more than {MAX_TEXTURE_SIZE} pixels a side")
            if image.mode.startswith("I"):  # 16 bits, which convert() would cut off at 255
                grey = (np.asarray(image).astype(np.int64).clip(0, 65535) >> 8).astype(np.uint8)
                return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
            return np.asarray(image.convert("RGBA"))


def _known() -> set[str]:
    from PIL import Image

    Image.init()
    return set(Image.OPEN)


def _as_spelled(path: Path) -> Path | None:
    """The file of that name, whatever the case of its letters; no pipe, no device."""
    if path.is_file():
        return path
    if not path.parent.is_dir():
        return None
    wanted = path.name.casefold()
    return next(
        (other for other in sorted(path.parent.iterdir()) if other.name.casefold() == wanted and other.is_file()), None
    )
