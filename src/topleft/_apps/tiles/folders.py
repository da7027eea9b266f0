"""Chunks in a folder or behind a URL: each is whole or not there, and one process at a time writes a folder.

Input: names with slashes, bytes. On disk a chunk is written under another name and renamed. Only files with the name of
a chunk are removed.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, get_args

from topleft._core.base.arrays import shown
from topleft._core.base.remote import Location, RemotePath, as_location
from topleft._core.base.whole_file import is_whole, write_whole
from topleft.typing import RasterKindOption

MANIFEST = "topleft.txt"
"""The chunk that marks a folder as written by topleft."""

ZARR_ARRAYS = "|".join((*get_args(RasterKindOption), "x", "y", "spatial_ref"))
OWN_NAME = re.compile(
    rf"{re.escape(MANIFEST)}|\d+/\d+_\d+(\.png)?|(\d+/)?(({ZARR_ARRAYS})/)?(zarr\.json|c/\d+(/\d+(/0)*)?)"
)
"""The names of chunks: of parts of a TIFF, of Deep Zoom, of Zarr."""

PART = re.compile(r"\.(.+)\.[0-9a-f]{8}\.part")
"""The name of a chunk that is being written: `write_whole`."""

MARK = re.compile(rb"topleft: ([^;]*);")
"""The mark of a file of topleft."""

MARK_BYTES = 4096
"""The mark lies within so many bytes of the beginning."""

NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""Errors of file systems without locks."""


@dataclass(frozen=True)
class Folder:
    """Chunks in a folder on a disk, or behind a URL that fsspec reaches."""

    location: Location

    @property
    def is_on_disk(self) -> bool:
        """Whether other programs may damage chunks, and a killed process leaves parts of them."""
        return isinstance(self.location, Path)

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        file = self.location / name
        if isinstance(file, Path) and not file.parent.is_dir():
            file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, lambda out: out.write(content))

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return (self.location / name).read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return (self.location / name).is_file()

    def place(self, name: str) -> str:
        """Where a chunk is, for messages."""
        return str(self.location / name)

    def exists(self) -> bool:
        """Whether anything is there except files that a killed process had not renamed yet."""
        if not (isinstance(self.location, Path) and self.location.is_dir()):
            return self.location.exists()
        return any(not name.startswith(".") for name in os.listdir(self.location))

    def absolute(self) -> Folder:
        """The folder by its absolute path, for processes that run in other folders."""
        return Folder(self.location.absolute()) if isinstance(self.location, Path) else self

    def names(self) -> list[str]:
        """The names of all files, and of links to folders."""
        if not isinstance(self.location, Path):
            return self.location.names_below()
        found = []
        for folder, folders, files in os.walk(self.location):
            links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
            found += [Path(folder, name).relative_to(self.location).as_posix() for name in [*files, *links]]
        return found

    def delete(self, name: str) -> None:
        """Remove a file, if it is there."""
        with suppress(FileNotFoundError):
            (self.location / name).unlink()

    def check_own(self) -> None:
        """Raise an error for a file that is no chunk of a raster."""
        for name in self.names():
            if not is_own(name):
                raise FileExistsError(f"{self.place(name)} was not written by topleft: move it, or write elsewhere")

    def remove(self) -> None:
        """Remove the chunks, the manifest last, and on a disk the folders that are empty then."""
        for name in sorted(filter(is_own, self.names()), key=lambda name: "/" not in name):
            self.delete(name)
        for folder, _, _ in os.walk(self.location, topdown=False) if self.is_on_disk else ():
            with suppress(OSError):  # something is in it
                os.rmdir(folder)

    def sweep(self) -> None:
        """Remove the files that a killed process had not renamed yet."""
        for name in self.names():
            if PART.fullmatch(name.rpartition("/")[2]) and is_own(name):
                self.delete(name)


def is_own(name: str) -> bool:
    """Whether a file has the name of a chunk, or of a chunk that is being written."""
    folder, slash, last = name.rpartition("/")
    return OWN_NAME.fullmatch(folder + slash + PART.sub(r"\1", last)) is not None


def folder_of(path: str | os.PathLike[str], storage: dict[str, Any] | None = None) -> Folder:
    """Return the folder of chunks at a path or URL."""
    if not (storage is None or isinstance(storage, dict)):
        raise TypeError(f"storage must be a dict or None, got {shown(storage)}")
    place = as_location("path", path)
    if isinstance(place, RemotePath):
        place = replace(place, storage=tuple((storage or {}).items()))
        place.exists()  # raises for a wrong URL before anything is drawn
    return Folder(place)


@contextmanager
def only_writer(path: Location) -> Iterator[None]:
    """Hold the lock of a file or folder: a file beside it, locked by the system as long as this process lives.

    URLs have none: two writers of the same raster write the same bytes. A `BlockingIOError` if another call writes it,
    here or in another process.
    """
    if isinstance(path, RemotePath):
        yield
        return
    path = path.absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    name = path.with_name(f".{path.name}.lock")
    file = _locked(name, path)
    try:
        yield
    finally:
        if sys.platform == "win32":  # where an open file cannot be removed
            os.close(file)
        with suppress(OSError):
            os.unlink(name)
        if sys.platform != "win32":
            os.close(file)


def _locked(name: Path, path: Path) -> int:
    while True:
        try:
            file = os.open(name, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise type(error)(error.errno, f"cannot write: {error.strerror}", str(path)) from error
        try:
            if not _take(file):
                raise BlockingIOError(f"{path} is being written by another call: wait for it, or write elsewhere")
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(file), os.stat(name)):
                    return file  # its owner has not removed it meanwhile
        except BaseException:
            os.close(file)
            raise
        os.close(file)


def _take(file: int) -> bool:
    """Lock an open file; return whether it is locked, True on file systems without locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in NO_LOCKS
    return True


def fingerprints_at(folder: Folder, file: Path) -> list[tuple[object, str | None]]:
    """The folder and the file where they exist, with the fingerprint of the raster; None if they are not topleft's."""
    found: list[tuple[object, str | None]] = []
    if folder.exists():
        manifest = folder.get(MANIFEST)
        found.append((folder.location, None if manifest is None else manifest.decode(errors="replace")))
    if file.is_dir() or is_whole(file):
        found.append((file, _mark_of(file)))
    return found


def write_own(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file, unless another program has written a file there meanwhile."""
    if is_whole(path) and _mark_of(path) is None:
        raise FileExistsError(f"{path} was not written by topleft: move it, or write elsewhere")
    write_whole(path, write)


def _mark_of(path: Path) -> str | None:
    if path.is_dir():
        return None
    with open(path, "rb") as file:
        found = MARK.search(file.read(MARK_BYTES))
    return None if found is None else found[1].decode(errors="replace")


def check_space(folder: Path, n_bytes: int, what: str) -> None:
    """Raise an error unless so many bytes are free where a folder is, or will be."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    if n_bytes > free:
        raise OSError(f"{what} takes up to {n_bytes:,} bytes, and {place} has {free:,} free: nothing was written")
