"""The exceptions for meshes, files and optional packages, each with a message of one line.

The core raises `ValueError`, `TypeError` and `IndexError`.
"""

from __future__ import annotations


class TopleftError(Exception):
    """Base of the exceptions that only this library raises.

    Examples
    --------
    >>> import topleft as tl
    >>> issubclass(tl.MeshError, tl.TopleftError)
    True
    """


class MeshError(TopleftError, ValueError):
    """A mesh that cannot be used: a broken, empty or unsupported file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import topleft as tl
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "empty.obj")
    ...     _ = path.write_text("# nothing")
    ...     try:
    ...         tl.load(path)
    ...     except tl.MeshError:
    ...         print("no mesh")
    no mesh
    """


class ImageError(TopleftError, ValueError):
    """A picture that does not fit the format of its file's name.

    Examples
    --------
    >>> import topleft as tl
    >>> try:
    ...     tl.save_image("depth.png", [[1.5, 2.5]])
    ... except tl.ImageError:
    ...     print("PNG holds no floats")
    PNG holds no floats
    """


class MissingPackageError(TopleftError, ImportError):
    """An optional package that the call needs is not installed; the message says how to get it.

    Examples
    --------
    >>> import topleft as tl
    >>> issubclass(tl.MissingPackageError, ImportError)
    True
    """


class MeshWarning(UserWarning):
    """A part of a mesh file is not read, a file that it names is missing, or planes cut: the picture will lack it.

    Examples
    --------
    >>> import warnings
    >>> import topleft as tl
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", tl.MeshWarning)  # a mesh that lacks something is then refused
    """
