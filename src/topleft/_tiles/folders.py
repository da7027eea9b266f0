"""Chunks in a folder or behind a URL: each is whole or not there, and one process at a time writes a folder.

Input: names with slashes, bytes. On disk a chunk is written under another name and renamed, and files that no raster
has are never removed.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from topleft._base.arrays import shown
from topleft._base.remote import RemotePath, as_place
from topleft._base.whole_file import write_whole

__all__ = ["MANIFEST", "DiskFolder", "Folder", "check_space", "folder_of", "only_writer"]

MANIFEST = "topleft.txt"
"""The chunk that tells whose a folder is."""

OWN_NAME = re.compile(rf"{re.escape(MANIFEST)}|\d+/\d+_\d+(\.png)?|(\d+/)?(zarr\.json|c/\d+/\d+(/0)*)")
"""The names of chunks: of parts of a TIFF, of Deep Zoom, of Zarr."""

PART = re.compile(r"\.(.+)\.[0-9a-f]{8}\.part")
"""The name of a chunk that is being written: `write_whole`."""

NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""What a file system without locks answers."""


class Folder(Protocol):
    """Where chunks are kept."""

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""

    def exists(self) -> bool:
        """Whether anything is there."""

    def absolute(self) -> Folder:
        """The same folder for processes that run in other ones."""


class DiskFolder:
    """A folder on a disk."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        path = self.path / name
        if not path.parent.is_dir():
            path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, lambda file: file.write(content))

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return (self.path / name).read_bytes()
        except FileNotFoundError:
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return (self.path / name).is_file()

    def exists(self) -> bool:
        """Whether anything is there but what a killed process had not renamed yet."""
        if not self.path.is_dir():
            return self.path.exists()
        return any(not name.startswith(".") for name in os.listdir(self.path))

    def absolute(self) -> DiskFolder:
        """The same folder for processes that run in other ones."""
        return DiskFolder(self.path.absolute())

    def sweep(self) -> None:
        """Remove what a killed process had not renamed yet."""
        for path in self._files():
            if PART.fullmatch(path.name) and self._is_own(path):
                path.unlink(missing_ok=True)

    def check_own(self) -> None:
        """Raise an error for a file that is no chunk of a raster.

        Raises
        ------
        FileExistsError
            If there is one.
        """
        for path in self._files():
            if not self._is_own(path):
                raise FileExistsError(
                    f"{self.path} holds {path.relative_to(self.path)}, which is of no raster: move it"
                )

    def remove(self) -> None:
        """Remove the chunks, and the folders that are empty then."""
        for path in self._files():
            if self._is_own(path):
                path.unlink(missing_ok=True)
        for folder, _, _ in os.walk(self.path, topdown=False):
            with suppress(OSError):  # something is in it
                os.rmdir(folder)

    def _files(self) -> Iterator[Path]:
        """All that is below the folder and is no folder."""
        for folder, folders, names in os.walk(self.path):
            links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
            yield from (Path(folder, name) for name in [*names, *links])

    def _is_own(self, path: Path) -> bool:
        name = PART.sub(r"\1", path.name)
        return OWN_NAME.fullmatch(path.with_name(name).relative_to(self.path).as_posix()) is not None


class RemoteFolder:
    """What fsspec reaches."""

    def __init__(self, path: RemotePath) -> None:
        self._path = path
        path.exists()  # what is wrong with the URL is told before anything is drawn

    def put(self, name: str, content: bytes) -> None:
        """Write a chunk."""
        (self._path / name).write_bytes(content)

    def get(self, name: str) -> bytes | None:
        """Read a chunk; None where there is none."""
        try:
            return (self._path / name).read_bytes()
        except FileNotFoundError:
            return None

    def has(self, name: str) -> bool:
        """Whether a chunk is there."""
        return (self._path / name).exists()

    def exists(self) -> bool:
        """Whether anything is there."""
        return self._path.exists()

    def absolute(self) -> RemoteFolder:
        """The same folder for processes that run in other ones."""
        return self


def folder_of(path: str | os.PathLike[str], storage: dict[str, Any] | None = None) -> DiskFolder | RemoteFolder:
    """Return where chunks of a path or URL are kept."""
    if not (storage is None or isinstance(storage, dict)):
        raise TypeError(f"storage must be a dict or None, got {shown(storage)}")
    place = as_place("path", path)
    if isinstance(place, RemotePath):
        return RemoteFolder(replace(place, storage=tuple((storage or {}).items())))
    return DiskFolder(place)


@contextmanager
def only_writer(path: Path) -> Iterator[None]:
    """Hold the lock of what is written: a file beside it, locked by the system as long as this process lives.

    Raises
    ------
    BlockingIOError
        If another call writes it, here or in another process.
    """
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
                    return file  # and not one that its owner has removed meanwhile
        except BaseException:
            os.close(file)
            raise
        os.close(file)


def _take(file: int) -> bool:
    """Lock an open file, and tell whether that went; where the file system has no locks it goes."""
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


def check_space(folder: Path, n_bytes: int, what: str) -> None:
    """Raise an error unless so many bytes are free where a folder is, or is to be.

    Raises
    ------
    OSError
        If they are not.
    """
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    if n_bytes > free:
        raise OSError(f"{what} takes up to {n_bytes:,} bytes, and {place} has {free:,} free: nothing was written")
