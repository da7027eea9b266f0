"""Writes files that are whole or not there: under another name first, then renamed."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO

from topleft._core.base.remote import Location, RemotePath

#: A file that nobody has written to for so long was left by a process that was killed.
STALE_S = 3600

BUFFER_BYTES = 1 << 16
"""Writes are put together to so much; to be told it spares the question whether a file is a terminal."""


def write_whole(path: Location, write: Callable[[IO[bytes]], object]) -> None:
    """Write to a new name in the same folder, then rename: a reader or a crash never meets half a file.

    A file at a URL is sent in one piece.
    """
    if isinstance(path, RemotePath):
        content = io.BytesIO()
        write(content)
        path.write_bytes(content.getvalue())
        return
    folder, name = os.path.split(path)
    temporary = os.path.join(folder, f".{name[:100]}.{os.urandom(4).hex()}.part")
    try:
        with open(temporary, "xb", BUFFER_BYTES) as file:
            write(file)
        os.replace(temporary, path)
    except OSError as error:
        _remove(temporary)
        if error.errno is None:
            raise
        if path.is_dir():
            raise IsADirectoryError(f"cannot write {str(path)!r}: it is a folder") from error
        raise type(error)(error.errno, f"cannot write: {error.strerror}", str(path)) from error
    except BaseException:
        _remove(temporary)
        raise


def is_whole(path: Location) -> bool:
    """Tell whether a file is there, and not empty."""
    if isinstance(path, RemotePath):
        return path.size() > 0
    return path.is_file() and path.stat().st_size > 0


def remove_stale_parts(paths: Iterable[Path]) -> None:
    """Remove partial files that killed processes have left here an hour ago or earlier."""
    names: dict[Path, set[str]] = {}
    for path in paths:
        names.setdefault(path.parent, set()).add(path.name[:100])
    for folder, own in names.items():
        with suppress(OSError):  # it is not there yet, or not ours
            for left in folder.glob(".*.part"):
                stem = left.name.removesuffix(".part")
                is_ours = stem[1:-9] in own and stem[-9:-8] == "."
                if is_ours and time.time() - left.stat().st_mtime > STALE_S:
                    left.unlink()


def _remove(temporary: str) -> None:
    with suppress(OSError):  # it was never made
        os.unlink(temporary)
