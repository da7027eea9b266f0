"""Reads the files that a mesh file names: material libraries, buffers, pictures; from its own folder and nowhere else.

Input: names out of a file that nobody has checked. Output: bytes, or the pixels of a picture; None, and a note, for
files that are missing, lie outside of the folder or cannot be read.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import unquote

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import U8
from topleft._core.base.notes import Notes, tell_files
from topleft._meshes.io.limits.budget import Budget
from topleft._meshes.model.texture import MAX_TEXTURE_SIZE
from topleft.errors import ImageError, MeshError

if TYPE_CHECKING:
    from PIL import Image

ROWS_AT_ONCE = 256
"""Rows of a picture that are made RGBA together."""

PICTURE_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF", "PPM", "DDS", "AVIF")
"""Formats of Pillow that are data and nothing else: EPS, say, would run a program."""


LFS_POINTER = b"version https://git-lfs.github.com/spec/"
"""The beginning of a pointer, which stands for a file that has not been fetched."""


class LfsPointerError(MeshError):
    """A file stands for a file that has not been fetched."""


class Cloud(NamedTuple):
    """Points of a file that belong to no triangle."""

    positions: npt.NDArray[Any]
    colors: U8 | None = None
    """(N, 4) sRGB."""
    normals: npt.NDArray[Any] | None = None


class Moment(NamedTuple):
    """The animation of a file and the time of it to read."""

    time: float
    """Seconds."""
    clip: int | str | None = None
    """The index or the name of the animation."""


class InputFile:
    """A mesh file and the files beside it, with their limits and notes of missing ones.

    `archive`: that it was unpacked from, which gets its notes and its points. `home`: the folder that it may name files
    of beside the folder of `path`.
    """

    def __init__(
        self, path: Path, budget: Budget, *, archive: InputFile | None = None, home: Path | None = None
    ) -> None:
        self.path = path
        self.budget = budget
        self.notes: Notes = Notes(str(path)) if archive is None else archive.notes
        self.clouds: list[Cloud] = [] if archive is None else archive.clouds
        self.moment: Moment | None = None if archive is None else archive.moment
        self._folder = path.parent.resolve()
        self._homes = (self._folder,) if home is None else (self._folder, home.resolve())
        self._is_unpacked = archive is not None
        self._found: dict[tuple[Path, str], Path | None] = {}
        self._resolved: dict[Path, Path] = {}
        self._listings: dict[Path, dict[str, Path]] = {}
        self._pictures: dict[Any, U8 | None] = {}
        self._not_laid: set[int] = set()

    def content(self) -> bytes:
        """The bytes of the mesh file."""
        return self._read(self.path)

    def read(self, name: str, what: str, folder: Path | None = None) -> bytes | None:
        """The content of a file that the mesh names; `what` is the plural of its kind, for notes."""
        path = self.find(name, what, folder)
        return None if path is None else self.read_at(path, name, what)

    def read_at(self, path: Path, name: str, what: str) -> bytes | None:
        """The content of a file at a path of `find`."""
        try:
            return self._read(path)
        except OSError:
            self.notes.add(f"{what} that cannot be read", name)
        except LfsPointerError:
            self.notes.add(f"{what} that are Git LFS pointers (git lfs pull)", name)
        return None

    def _read(self, path: Path) -> bytes:
        if not self._is_unpacked:
            self.budget.read(path.stat().st_size)
        content = path.read_bytes()
        if content.startswith(LFS_POINTER):
            raise LfsPointerError(f"{str(path)!r} is a Git LFS pointer, not the file itself: run git lfs pull")
        return content

    def find(self, name: str, what: str, folder: Path | None = None) -> Path | None:
        """Where such a file is: in the folder of the mesh, or below.

        A file with a path that leads elsewhere, as other machines have them, is looked for in the folder itself.
        """
        key = self._folder if folder is None else folder, name
        if key not in self._found:
            self.budget.spend("max_nodes", 1)
            self._found[key] = self._looked_for(name.replace("\\", "/"), what, key[0])
        return self._found[key]

    def _looked_for(self, name: str, what: str, folder: Path) -> Path | None:
        if name[:5].lower() == "file:":
            name = unquote(name[5:].removeprefix("//").removeprefix("localhost"))
        leads_elsewhere = "\0" in name or re.match(r"/|[A-Za-z][A-Za-z0-9+.-]*:", name) is not None
        try:
            if not leads_elsewhere:
                found = self._as_spelled(folder / name)
                if found is not None and self._is_at_home(found):
                    return found
                leads_elsewhere = not self._is_at_home(folder / name) or found is not None
            if leads_elsewhere:
                found = self._as_spelled(folder / name.rpartition("/")[2].replace("\0", ""))
                if found is not None and self._is_at_home(found):
                    return found
        except (OSError, RuntimeError, ValueError):  # names that no disk can have; circles of links
            pass
        where = "outside of its folder not read" if leads_elsewhere else "not found"
        self.notes.add(f"{what} {where}", name)
        return None

    def _is_at_home(self, path: Path) -> bool:
        return any(path.resolve().is_relative_to(home) for home in self._homes)

    def _as_spelled(self, path: Path) -> Path | None:
        """The file of that name, whatever the case of its letters; no pipe, no device."""
        if path.is_file():
            return path
        if path.parent not in self._listings:
            others = sorted(path.parent.iterdir(), reverse=True) if path.parent.is_dir() else ()
            self._listings[path.parent] = {other.name.casefold(): other for other in others if other.is_file()}
        return self._listings[path.parent].get(path.name.casefold())

    def files(self) -> list[Path]:
        """The file, those that it names, and where others that it names would be."""
        wanted = (folder / name if path is None else path for (folder, name), path in self._found.items())
        return [self.path, *(path for path in wanted if "\0" not in str(path) and self._is_at_home(path))]

    def picture(self, name: str, folder: Path | None = None) -> U8 | None:
        """The picture (H, W, 4) of a file that the mesh names; each is read once, whatever names it has."""
        path = self.find(name, "textures", folder)
        if path is None:
            return None
        if path not in self._resolved:
            self._resolved[path] = path.resolve()
        return self.decoded(self._resolved[path], name, lambda: self.read_at(path, name, "textures"))

    def decoded(self, key: Any, name: str, read: Callable[[], bytes | None]) -> U8 | None:
        """The picture (H, W, 4) of the bytes that `read` returns; that of a key is decoded once."""
        if key not in self._pictures:
            content = read()
            self._pictures[key] = picture = None if content is None else self._decode(content, name)
            if picture is not None:
                self._not_laid.add(id(picture))
        return self._pictures[key]

    def may_lay(self, picture: U8, name: str) -> bool:
        """Whether a texture may be made of a picture, or of as many pixels; if not, that is noted.

        The first texture of each picture that was decoded has been counted.
        """
        if id(picture) in self._not_laid:
            self._not_laid.remove(id(picture))
            return True
        return self.may_have(picture.shape[0] * picture.shape[1], name)

    def may_have(self, n_pixels: int, name: str) -> bool:
        """Whether there may be so many more pixels of textures; if not, that is noted."""
        if self.budget.has("max_texture_pixels", n_pixels):
            self.budget.spend("max_texture_pixels", n_pixels)
            return True
        most = self.budget.limit("max_texture_pixels")
        self.notes.add(f"textures beyond the {most} pixels of max_texture_pixels not read", name)
        return False

    def _decode(self, content: bytes, name: str) -> U8 | None:
        try:
            with opened(content) as image:
                return rgba_of(image) if self.may_have(image.width * image.height, name) else None
        except MeshError as error:
            self.notes.add(f"textures {error} not read", name)
        except Exception:  # broken bytes end in whatever the decoder meets: OSError, SyntaxError, struct.error, ...
            self.notes.add("textures that cannot be read", name)
        return None


def utf8_of(content: bytes) -> bytes:
    """A text in UTF-8, or with a byte order mark in UTF-16, as UTF-8 without a mark."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        content = content.decode("utf-16", errors="replace").encode()
    return content.removeprefix(b"\xef\xbb\xbf")


def numbers_of_text(content: bytes, dtype: Any = np.float64) -> npt.NDArray[Any]:
    """The numbers of a text that holds nothing else."""
    if not content.strip():
        return np.zeros(0, dtype)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message="string or file could not be read")
            return np.fromstring(content, dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        raise MeshError("a number in it is none") from None


def whole_numbers(values: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """The values as int64; any number for values beyond its range; fractions are refused."""
    if values.dtype.kind == "f" and not (is_whole := np.trunc(values) == values).all():
        raise MeshError(f"a corner of a face is {values[~is_whole][0]:g}, which is no index")
    with np.errstate(invalid="ignore"):
        return values.astype(np.int64)


@contextmanager
def opened(content: bytes) -> Iterator[Image.Image]:
    """A picture before its pixels are decoded."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            image = Image.open(io.BytesIO(content), formats=[name for name in PICTURE_FORMATS if name in _known()])
        except Image.DecompressionBombError:
            raise MeshError("of more pixels than Pillow opens") from None
        with image:
            if max(image.size) > MAX_TEXTURE_SIZE:
                raise MeshError(f"with more than {MAX_TEXTURE_SIZE} pixels a side")
            yield image


def rgba_of(image: Image.Image) -> U8:
    """The picture (H, W, 4), uint8, a few rows at a time, so that memory holds it at most twice."""
    if image.mode.startswith("I"):  # 16 bits, which convert() would cut off at 255
        grey = (np.asarray(image).clip(0, 65535) >> 8).astype(np.uint8)
        return np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    image.load()
    pixels = np.empty((image.height, image.width, 4), np.uint8)
    for top in range(0, image.height, ROWS_AT_ONCE):
        rows = image.crop((0, top, image.width, min(top + ROWS_AT_ONCE, image.height)))
        pixels[top : top + ROWS_AT_ONCE] = np.asarray(rows.convert("RGBA"))
    return pixels


def _known() -> set[str]:
    from PIL import Image

    Image.init()
    return set(Image.OPEN)


def read_picture(path: str) -> U8:
    """The picture (H, W, 4) of a file that a caller names."""
    if not Path(path).is_file() and Path(path).exists():
        raise ImageError(f"cannot read {path!r}: it is no file")
    try:
        tell_files([Path(path)])
        budget = Budget(path)
        budget.read(Path(path).stat().st_size)
        with opened(Path(path).read_bytes()) as image:
            if not budget.has("max_texture_pixels", image.width * image.height):
                raise MeshError(f"of more than {budget.limit('max_texture_pixels')} pixels")
            return rgba_of(image)
    except MeshError as error:
        raise ImageError(f"cannot read {path!r}: it is {error}") from None
    except (OSError, ValueError, SyntaxError, EOFError) as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        raise ImageError(f"cannot read {path!r}: it is no picture that Pillow knows") from None
