"""Files behind URLs that fsspec reaches: whole or not there, as files on a disk are.

Input: a URL. Output: the methods of `pathlib.Path` that writing needs. A URL that begins with
file:// is a path of this machine.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from topleft._core.base.arrays import shown
from topleft._core.base.cached import cached_property
from topleft.errors import MissingPackageError

#: File systems that show a file before it is whole: there it gets another name first. Stores of
#: objects show an object when all of it is there.
SHOWS_PARTS = frozenset({"arrow_hdfs", "dbfs", "ftp", "hdfs", "sftp", "smb", "ssh", "webhdfs"})

OF_THIS_MACHINE = ("file://", "local://")


def is_url(value: object) -> bool:
    """Whether a name is a URL and no path."""
    return isinstance(value, str) and "://" in value


def location_of(value: str | os.PathLike[str]) -> Path | RemotePath:
    """Return where a file is: a path, or a location that fsspec reaches by a URL."""
    if isinstance(value, RemotePath | Path):
        return value
    text = os.fspath(value)
    if not is_url(text):
        return Path(text)
    if text.startswith(OF_THIS_MACHINE):
        from urllib.request import url2pathname

        return Path(url2pathname(text.partition("://")[2]))
    return RemotePath(text)


def as_location(name: str, value: object) -> Location:
    """Return where the file of a caller's argument is."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be a path or a URL, got {shown(value)}")
    return location_of(value)


@dataclass(frozen=True)
class RemotePath:
    """A file or a folder behind a URL."""

    url: str
    storage: tuple[tuple[str, Any], ...] = ()  # further options of fsspec

    def __str__(self) -> str:
        return self.url

    def __fspath__(self) -> str:
        return self.url  # goes wherever a name goes, and `location_of` makes it out

    @cached_property
    def _reached(self) -> tuple[Any, str]:
        """The file system, and the name that the file has there."""
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise MissingPackageError(f"writing to {self.url} needs the package fsspec: pip install fsspec") from None
        try:
            found: tuple[Any, str] = url_to_fs(self.url, **dict(self.storage))
        except ImportError as error:  # of the package for that kind of URL
            raise MissingPackageError(f"writing to {self.url}: {error}") from None
        except ValueError as error:  # a kind of URL that is unknown
            raise ValueError(f"cannot write to {self.url}: {error}") from None
        return found

    @property
    def name(self) -> str:
        """The text behind the last slash."""
        return self.url.rstrip("/").rpartition("/")[2]

    @property
    def suffix(self) -> str:
        """The end of the name, from its last point on."""
        return PurePosixPath(self.name).suffix

    @property
    def stem(self) -> str:
        """The name without its suffix."""
        return PurePosixPath(self.name).stem

    @property
    def parent(self) -> RemotePath:
        """The folder that it is in."""
        return replace(self, url=self.url.rstrip("/").rpartition("/")[0])

    def with_name(self, name: str) -> RemotePath:
        """Return the file of another name in the same folder."""
        return self.parent / name

    def __truediv__(self, name: str) -> RemotePath:
        return replace(self, url=f"{self.url.rstrip('/')}/{name}")  # fsspec keeps file systems: both URLs share one

    def __getstate__(self) -> dict[str, Any]:
        return {"url": self.url, "storage": self.storage}  # and not how it was reached

    def exists(self) -> bool:
        """Whether anything is there."""
        fs, name = self._reached
        return bool(fs.exists(name))

    def is_file(self) -> bool:
        """Whether a file is there."""
        fs, name = self._reached
        return bool(fs.isfile(name))

    def is_dir(self) -> bool:
        """Whether it is a folder that the store knows; folders need not be made."""
        fs, name = self._reached
        return bool(fs.isdir(name))

    def size(self) -> int:
        """How many bytes the file has; 0 where there is none."""
        fs, name = self._reached
        try:
            return int(fs.info(name).get("size") or 0)
        except FileNotFoundError:
            return 0

    def names_below(self) -> list[str]:
        """The names of all files below it, with slashes."""
        fs, name = self._reached
        return [found[len(name.rstrip("/")) + 1 :] for found in fs.find(name)]

    def unlink(self) -> None:
        """Remove the file, if it is there."""
        fs, name = self._reached
        with suppress(FileNotFoundError):
            fs.rm_file(name)

    def read_bytes(self) -> bytes:
        """Return the file's bytes."""
        fs, name = self._reached
        return bytes(fs.cat_file(name))

    def ends(self, n: int) -> bytes:
        """Return the first and the last `n` bytes, or all of a short file."""
        fs, name = self._reached
        size = self.size()
        return bytes(fs.cat_file(name, 0, min(n, size)) + fs.cat_file(name, max(min(n, size), size - n), size))

    def write_bytes(self, content: bytes) -> None:
        """Write the file, whole or not at all."""
        fs, name = self._reached
        try:
            self._send(fs, name, content)
        except (NotImplementedError, ValueError) as error:  # fsspec only reads that kind of URL
            raise ValueError(f"cannot write to {self.url}: {error}") from None
        except OSError as error:
            told = f"cannot write to {self.url}: {error.strerror or error}"
            kind = type(error) if type(error).__module__ == "builtins" else OSError
            raise (kind(told) if error.errno is None else kind(error.errno, told)) from error

    def _send(self, fs: Any, name: str, content: bytes) -> None:
        protocols = {fs.protocol} if isinstance(fs.protocol, str) else set(fs.protocol)
        if not protocols & SHOWS_PARTS:
            fs.pipe_file(name, content)
            return
        folder = name.rpartition("/")[0]
        if folder:
            fs.makedirs(folder, exist_ok=True)
        part = f"{folder}/.{self.name[:100]}.{os.urandom(4).hex()}.part"
        try:
            fs.pipe_file(part, content)
            if fs.exists(name):
                fs.rm_file(name)
            fs.mv(part, name)
        except BaseException:
            if fs.exists(part):
                fs.rm_file(part)
            raise


Location = Path | RemotePath
"""Where a file is."""
