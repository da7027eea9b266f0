"""Coercion and checks: arguments become contiguous native arrays, or an error that names the argument."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable
from numbers import Real
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.threads import run_parts

#: The largest side of a picture and the largest number of triangles or vertices: ids and indices are int32.
INT32_MAX = 2**31 - 1

SIZE_HINT = "; the shape of a picture begins with its height: image.shape[1::-1] is its size"

#: Device types of DLPack with memory that the CPU reads: CPU, pinned for CUDA or ROCm, CUDA managed.
CPU_DEVICES = frozenset({1, 3, 11, 13})
DEVICES = {2: "CUDA device", 4: "OpenCL device", 7: "Vulkan device", 8: "Metal device", 10: "ROCm device",
           14: "oneAPI device", 15: "WebGPU device"}  # fmt: skip


def as_array(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return `values` as a NumPy array, aligned for the kernels, without a copy where it can; masked floats are NaN."""
    if not isinstance(values, np.ndarray) and (hasattr(values, "__dlpack__") or hasattr(values, "__array__")):
        values = array_of_tensor(name, values)
    if hasattr(values, "filled"):
        values = without_masked(name, values)
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{name} must be array_like, got rows of different lengths ({error})") from None
    except Exception as error:  # of arrays of other libraries in a list
        first: Any = values
        while isinstance(first, (list, tuple)) and len(first):
            first = first[0]
        if hasattr(first, "__dlpack_device__"):
            array_of_tensor(name, first)
        raise TypeError(f"{name} must be array_like, got {shown(values)} ({error})") from None
    return as_aligned(array)


def without_masked(name: str, values: Any) -> NDArray[Any]:
    """Return a masked array with NaN where it is masked; one that has no NaN must not be masked anywhere."""
    if not np.ma.is_masked(values):
        return np.ma.getdata(values)
    if values.dtype.kind != "f":
        raise ValueError(
            f"{name} must not be masked, having no NaN, got {values.dtype} with {values.mask.sum()} masked"
        )
    filled: NDArray[Any] = values.filled(np.nan)
    return filled


def as_aligned(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array, copied unless it is aligned for the kernels."""
    return array if array.flags.aligned else array.copy()


def apart_from(out: object, name: str, values: ArrayLike) -> ArrayLike:
    """Return `values`, copied where `out`, an array or several, may share memory with them."""
    if out is None or isinstance(values, list | tuple | str | int | float):
        return values
    outs = out if isinstance(out, (list, tuple)) else (out,)
    array = as_array(name, values)
    overlaps = any(isinstance(one, np.ndarray) and np.may_share_memory(array, one) for one in outs)
    return array.copy() if overlaps else values


def array_of_tensor(name: str, tensor: Any) -> NDArray[Any]:
    """Return the memory of another library's array: of PyTorch, JAX, or any with DLPack or the array API."""
    kind = f"{type(tensor).__module__.partition('.')[0]}.{type(tensor).__name__}"
    if hasattr(tensor, "__dlpack_device__"):
        try:
            device, number = tensor.__dlpack_device__()
        except Exception as error:  # a device that DLPack has no number for
            raise TypeError(f"{name} must lie in the memory of the CPU, got a {kind} elsewhere ({error})") from None
        if device not in CPU_DEVICES:
            where = f"{DEVICES.get(device, f'DLPack device type {int(device)}')} {number}"
            raise TypeError(f"{name} must lie in the memory of the CPU, got a {kind} on {where}: copy it to the CPU")
    if getattr(tensor, "requires_grad", False) is True:
        raise TypeError(f"{name} must not ask for gradients, got a {kind} that requires grad: pass {name}.detach()")
    try:
        return np.asarray(tensor) if hasattr(tensor, "__array__") else np.from_dlpack(tensor)
    except Exception as error:  # theirs: a dtype or a layout that NumPy has not
        raise TypeError(f"{name} must be an array that NumPy can read, got a {kind} ({error})") from None


def set_aligned(instance: object, state: dict[str, Any]) -> None:
    """Set the state of an object that is unpickled or copied, its arrays aligned for the kernels.

    Arrays that are pickled out of band lie wherever their bytes were received.
    """
    vars(instance).update({name: _aligned(value) for name, value in state.items()})


def set_read_only(instance: object, state: dict[str, Any]) -> None:
    """Set the state as `set_aligned` does, with arrays read-only as they were."""
    set_aligned(instance, state)
    for value in vars(instance).values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False


def _aligned(value: Any) -> Any:
    if isinstance(value, tuple):
        return getattr(value, "_make", tuple)(map(_aligned, value))
    return as_aligned(value) if isinstance(value, np.ndarray) else value


def check_real(name: str, array: NDArray[Any], kinds: str = "fiu") -> None:
    """Raise an error unless an array holds real numbers, by the kinds of dtypes that count as such."""
    if array.dtype.kind not in kinds:
        raise TypeError(f"{name} must be real numbers, got dtype {array.dtype}")


def as_plane_points(name: str, values: ArrayLike) -> NDArray[Any]:
    """Return points (V, 2), or (V, 3) with heights, as they are."""
    array = as_array(name, values)
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise ValueError(f"{name} must have shape (V, 2) or (V, 3), got {array.shape}")
    check_real(name, array)
    return array


def as_vertices(values: ArrayLike, *, has_transform: bool) -> NDArray[Any]:
    """Return (V, C) vertices as a contiguous float32, float64 or int64 array."""
    array = as_array("vertices", values)
    wish = "(V, 3) when transform is given" if has_transform else "(V, 2), (V, 3) or (V, 4)"
    if array.size == 0 and array.ndim == 1:
        array = array.reshape(0, 3 if has_transform else 2)
    if array.ndim != 2 or array.shape[1] not in ((3,) if has_transform else (2, 3, 4)):
        poses = "; rasterize_poses takes (B, V, C)" if array.ndim == 3 else ""
        if array.ndim == 3 and array.shape[1] == 3:
            poses += "; corners (T, 3, C) of triangles are vertices.reshape(3 * T, C), arange(3 * T).reshape(T, 3)"
        raise ValueError(f"vertices must have shape {wish}, got {array.shape}{poses}")
    if array.shape[0] > INT32_MAX:
        raise ValueError(f"vertices must have at most {INT32_MAX} rows, got {array.shape[0]}")
    if array.dtype.kind == "f":
        is_single = array.dtype.itemsize == 4 or (array.dtype.itemsize == 2 and not has_transform)
        dtype: type = np.float32 if is_single else np.float64
    elif array.dtype.kind in "iu":
        dtype = np.float64 if has_transform or array.shape[1] == 4 else np.int64
        if dtype is np.int64 and array.dtype.kind == "u" and array.dtype.itemsize == 8:
            array = np.minimum(array, np.uint64(2**63 - 1))  # out of range either way
    else:
        raise TypeError(f"vertices must be real numbers, got dtype {array.dtype}")
    is_ready = array.dtype == dtype and array.flags.c_contiguous  # told in half the time that NumPy takes
    return array if is_ready else np.ascontiguousarray(array, dtype=dtype)


def as_triangles(values: ArrayLike) -> NDArray[np.signedinteger[Any]]:
    """Return (T, 3) triangles as a contiguous int32 or int64 array; indices are not checked.

    Unsigned indices beyond the signed range come out negative, which no index may be.
    """
    array = as_array("triangles", values)
    if array.size == 0 and array.ndim == 1:
        return np.empty((0, 3), np.int32)
    if array.ndim != 2 or array.shape[1] != 3:
        has_quads = array.ndim == 2 and array.shape[1] == 4
        raise ValueError(
            f"triangles must have shape (T, 3), got {array.shape}"
            + "; topleft.as_mesh((vertices, faces)).triangles cuts quads" * has_quads
        )
    if array.shape[0] > INT32_MAX:
        raise ValueError(f"triangles must have at most {INT32_MAX} rows, got {array.shape[0]}")
    if array.dtype.kind not in "iu":
        raise TypeError(f"triangles must be integers, got dtype {array.dtype}")
    if array.dtype.itemsize < 4:
        return np.ascontiguousarray(array, np.int32)
    native = np.ascontiguousarray(array if array.dtype.isnative else array.astype(array.dtype.newbyteorder("=")))
    return native.view() if array.dtype.kind == "i" else native.view(f"i{native.dtype.itemsize}")


def as_checked_triangles(values: ArrayLike, n_vertices: int) -> NDArray[np.int32]:
    """Return (T, 3) triangles as a contiguous int32 array that nobody writes to, every index in ``[0, n_vertices)``."""
    array = as_triangles(values)
    if array.dtype == np.int32:
        own = as_frozen(array)
        check_rows(own, n_vertices, values)
        return own
    own = np.empty_like(array, np.int32)
    refuse_rows([engine.narrow_triangles(array, n_vertices, own)], values, n_vertices)
    own.flags.writeable = False
    return own


def as_frozen(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only array that nobody can write to: a copy, unless it is such an array."""
    if is_frozen(array):
        return array
    own = array.copy()
    own.flags.writeable = False
    return own


def is_frozen(array: NDArray[Any]) -> bool:
    """Tell whether an array, and all that its memory is borrowed from, is read-only."""
    owner: Any = array
    while isinstance(owner, np.ndarray):
        if owner.flags.writeable:
            return False
        owner = owner.base
    return owner is None or isinstance(owner, bytes)


def check_rows(triangles: NDArray[np.int32], n_vertices: int, given: ArrayLike | None = None) -> None:
    """Raise an error for the first of contiguous triangles that names a vertex that does not exist.

    `given`: the same as the caller has them, for the message.
    """
    refuse_rows([engine.first_bad_row(triangles, n_vertices)], triangles if given is None else given, n_vertices)


def refuse_rows(found: list[int], triangles: ArrayLike, n_vertices: int) -> None:
    """Raise an error for the first row found to name a vertex that does not exist; -1 is none."""
    bad_rows = [row for row in found if row >= 0]
    if bad_rows:
        row = min(bad_rows)
        raise IndexError(
            f"triangles must hold indices in [0, {n_vertices}), the number of vertices; "
            f"row {row} is {as_array('triangles', triangles)[row].tolist()}"
        )


def narrow_triangles(
    triangles: NDArray[Any], given: ArrayLike, n_vertices: int, out: NDArray[np.int32], n_threads: int
) -> None:
    """Write contiguous int64 triangles as int32, and raise an error as `check_rows` does."""

    def narrow(first: int, end: int) -> int:
        row = engine.narrow_triangles(triangles[first:end], n_vertices, out[first:end])
        return first + row if row >= 0 else -1

    refuse_rows(run_parts(narrow, len(triangles), n_threads), given, n_vertices)


def as_transform(values: ArrayLike) -> NDArray[Any]:
    """Return a finite (4, 4) transform."""
    array = as_array("transform", values)
    if array.shape != (4, 4):
        poses = "; rasterize_poses takes (B, 4, 4)" if array.ndim == 3 else ""
        raise ValueError(f"transform must have shape (4, 4), got {array.shape}{poses}")
    check_real("transform", array)
    if not np.isfinite(array).all():
        raise ValueError("transform must be finite, got NaN or infinity")
    return array


def as_real(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return real numbers as float64, a copy only where the dtype is another."""
    array = as_array(name, values)
    if array.dtype.kind not in "fiu" and array.size:
        raise TypeError(f"{name} must be real numbers, got {shown(values)}")
    return array.astype(np.float64, copy=False)


def as_number(name: str, value: object) -> float:
    """Return a real number as a float, which may be infinite or NaN."""
    if isinstance(value, float | int | np.floating | np.integer) and not isinstance(value, bool):
        return float(value)
    try:
        array = as_real(name, value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        array = np.zeros(2)
    if array.ndim:
        raise TypeError(f"{name} must be a number, got {shown(value)}")
    return float(array)


def as_scale(scale: object) -> float:
    """Return a scale that is positive and finite; else raise a `ValueError`."""
    factor = as_number("scale", scale)
    if not 0 < factor < np.inf:
        raise ValueError(f"scale must be a positive number, got {scale!r}")
    return factor


def as_seconds(time: float) -> float:
    """Return a time of 0 or more seconds; else raise a `ValueError`."""
    seconds = as_number("time", time)
    if not 0 <= seconds < np.inf:
        raise ValueError(f"time must be a number of seconds, 0 or more, got {time!r}")
    return seconds


def as_crease(value: float) -> float:
    """Return a crease angle, degrees."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"crease must be an angle in degrees, got {value!r}")
    if not 0 <= value <= 180:
        raise ValueError(f"crease must lie in 0 to 180 degrees, got {value!r}")
    return float(value)


def as_count(name: str, value: object, smallest: int = 1) -> int:
    """Return a whole number that is not below another."""
    try:
        n = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be an integer, got {shown(value)}") from None
    if n < smallest:
        raise ValueError(f"{name} must be at least {smallest}, got {n}")
    return n


def as_path(name: str, value: object) -> Path:
    """Return where a file is."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be a path, got {shown(value)}")
    if "://" in os.fspath(value):
        raise FileNotFoundError(f"{name} must be a file of this machine, got the URL {value!r}: download it first")
    return Path(value)


def as_places(rows: ArrayLike, cols: ArrayLike, shape: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns of pixels of a picture (H, W)."""
    found = []
    for name, values, n in (("rows", rows, shape[0]), ("cols", cols, shape[1])):
        array = as_array(name, values)
        if array.dtype.kind not in "iu" and array.size:
            raise TypeError(f"{name} must be integers, got {shown(values)}")
        if array.dtype.kind == "u":
            array = np.minimum(array, np.iinfo(np.intp).max)
        array = array.astype(np.intp)  # a copy: nobody else changes it after the check
        if array.size and not (array.min() >= 0 and array.max() < n):
            raise IndexError(f"{name} must lie in [0, {n}), got {array.min()} to {array.max()}")
        found.append(array)
    if found[0].shape != found[1].shape:
        raise ValueError(f"rows and cols must have one shape, got {found[0].shape} and {found[1].shape}")
    return found[0], found[1]


def check_progress(progress: object) -> None:
    """Raise a `TypeError` unless it is a function, a truth value or None."""
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise TypeError(f"progress must be a function, True or None, got {shown(progress)}")


def as_names(name: str, values: object) -> tuple[str, ...]:
    """Return strings, of a string or of a sequence of strings."""
    if isinstance(values, str):
        return (values,)
    try:
        names = tuple(cast("Iterable[Any]", values))
    except TypeError:
        names = (values,)
    if not all(isinstance(one, str) for one in names):
        raise TypeError(f"{name} must be a name or a sequence of names, got {shown(values)}")
    return names


def shown(value: object) -> str:
    """Return a wrong value as messages show it: the value if it is short, else its type, and shape."""
    if isinstance(value, str | int | float | bool | tuple | list | None) and len(text := repr(value)) <= 60:
        return text
    shape = getattr(value, "shape", None)
    return type(value).__name__ + (f" of shape {shape}" if isinstance(shape, tuple) else "")


def as_vector(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return three finite numbers."""
    vector = as_real(name, values)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} must be three finite numbers, got {values!r}")
    return vector


def as_square(name: str, values: ArrayLike, n: int) -> NDArray[np.float64]:
    """Return a finite matrix (n, n), always a copy."""
    matrix = as_real(name, values).copy()
    if matrix.shape != (n, n):
        raise ValueError(f"{name} must have shape ({n}, {n}), got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} must hold finite numbers, got {matrix.tolist()}")
    return matrix


def check_regular(name: str, matrix: NDArray[np.float64]) -> None:
    """Raise a `ValueError` if the matrix is singular."""
    is_affine = np.array_equal(matrix[-1], np.eye(len(matrix))[-1])  # a translation of 1e8 would drown the rest
    if np.linalg.matrix_rank(matrix[:-1, :-1] if is_affine else matrix) < len(matrix) - is_affine:
        raise ValueError(f"{name} must not be singular, got {matrix.tolist()}")


def as_pair(name: str, values: object) -> tuple[int, int]:
    """Return two integers."""
    try:
        first, second = map(operator.index, values)  # type: ignore[call-overload]
        return first, second
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be two integers, got {values!r}") from None


def as_size(values: object, name: str = "size", smallest: int = 0) -> tuple[int, int]:
    """Return ``(width, height)``, a square of one number."""
    try:
        width, height = as_pair(name, values)
    except TypeError:
        if isinstance(values, int | np.integer) and not isinstance(values, bool):
            width = height = int(values)
        else:
            raise TypeError(
                f"{name} must be two integers (width, height), or one for a square, got {shown(values)}"
                + SIZE_HINT * (isinstance(values, tuple | list) and len(values) == 3)
                + "; the camera comes before the size" * hasattr(values, "projection")
            ) from None
    if not (smallest <= width <= INT32_MAX and smallest <= height <= INT32_MAX):
        raise ValueError(f"{name} must be (width, height) in {smallest}..{INT32_MAX}, got ({width}, {height})")
    return width, height


def as_window(origin: object, subpixel_bits: int) -> tuple[int, int]:
    """Return the window's first pixel ``(x, y)``; the whole window must have fixed-point coordinates."""
    x, y = as_pair("origin", origin)
    limit = 2 ** (61 - subpixel_bits)
    if not (abs(x) < limit and abs(y) < limit):
        raise ValueError(
            f"origin must lie within {limit} pixels of 0 with {subpixel_bits} sub-pixel bits, got ({x}, {y})"
        )
    return x, y


def as_subpixel_bits(value: object) -> int:
    """Return the number of sub-pixel bits."""
    try:
        bits = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"subpixel_bits must be an integer, got {value!r}") from None
    if not 0 <= bits <= 16:
        raise ValueError(f"subpixel_bits must be in 0..16, got {bits}")
    return bits


def as_colors(values: ArrayLike) -> NDArray[Any]:
    """Return (N, C) or (N,) colours as a contiguous uint8 or float32 array."""
    array = as_array("colors", values)
    if array.size == 0 and array.ndim == 1:
        array = array.astype(np.uint8) if array.dtype == np.float64 else array  # an empty list
    if not (array.ndim == 1 or (array.ndim == 2 and 1 <= array.shape[1] <= 4)):
        raise ValueError(f"colors must have shape (T, C), (V, C), (T,) or (V,) with C in 1..4, got {array.shape}")
    return as_drawn_colors(array, "; dtype= fills labels")


def as_drawn_colors(array: NDArray[Any], hint: str = "") -> NDArray[Any]:
    """Return colours as a contiguous uint8 or float32 array; `hint` ends the error for larger integers."""
    if array.dtype.kind == "f":
        return np.ascontiguousarray(array, dtype=np.float32)
    if array.dtype.kind not in "iu":
        raise TypeError(f"colors must be uint8 or float32, got dtype {array.dtype}")
    if array.dtype != np.uint8 and array.size and not (0 <= array.min() and array.max() <= 255):
        raise ValueError(f"colors must lie in 0..255 when they are integers, got {array.min()}..{array.max()}{hint}")
    return np.ascontiguousarray(array, dtype=np.uint8)


def as_background(background: ArrayLike | None, palette: NDArray[Any]) -> NDArray[Any] | None:
    """Return the colour of empty pixels in the picture's dtype: one number, or one per channel."""
    if background is None:
        return None
    ground = as_array("background", background)
    if ground.shape not in ((), palette.shape[1:]):
        raise ValueError(f"background must be one number or have shape {palette.shape[1:]}, got {ground.shape}")
    check_real("background", ground)
    if palette.dtype == np.uint8 and not ((ground >= 0) & (ground <= 255) & (ground == np.floor(ground))).all():
        raise ValueError(f"background must be whole numbers in 0..255 for uint8 colors, got {ground.tolist()}")
    return ground.astype(palette.dtype)


def as_values(values: ArrayLike, n_vertices: int, n_triangles: int) -> NDArray[np.float32]:
    """Return attributes as a contiguous float32 array of shape (V,), (V, K) or (T, 3, K)."""
    array = as_array("values", values)
    check_real("values", array, "fiub")
    fits = (array.ndim in (1, 2) and array.shape[0] == n_vertices) or (
        array.ndim == 3 and array.shape[:2] == (n_triangles, 3)
    )
    if not fits:
        raise ValueError(
            f"values must have shape (V,), (V, K) or (T, 3, K) with V = {n_vertices} and T = {n_triangles}, "
            f"got {array.shape}"
        )
    return np.ascontiguousarray(array, dtype=np.float32)


def as_out(name: str, array: object, shape: tuple[int, ...], dtype: type) -> NDArray[Any]:
    """Return `array` after checking that results can be written to it."""
    if not isinstance(array, np.ndarray):
        raise TypeError(f"{name} must be a NumPy array, got {type(array).__name__}")
    if array.shape != shape or array.dtype != dtype:
        is_turned = array.shape[:2] == shape[1::-1] != shape[:2]
        raise ValueError(
            f"{name} must have shape {shape} and dtype {np.dtype(dtype)}, got {array.shape} and {array.dtype}"
            + "; size is (width, height), shapes are (height, width)" * is_turned
        )
    if not array.flags.writeable:
        raise ValueError(f"{name} must be writeable, got a read-only array")
    return array


def as_point_size(name: str, value: ArrayLike, n_points: int) -> float | NDArray[np.float64]:
    """Return a positive size, or a size of each point, (N,) float64."""
    array = as_array(name, value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold real numbers, got {array.dtype}")
    if array.shape not in ((), (n_points,)):
        raise ValueError(f"{name} must be one number or have shape ({n_points},), got {array.shape}")
    bad = np.flatnonzero(~((array > 0) & np.isfinite(array)))
    if len(bad):
        raise ValueError(f"{name} must be finite and positive, got {array.ravel()[bad[0]]}")
    if array.ndim == 0:
        return float(array)
    sizes = np.ascontiguousarray(array, np.float64).view()
    sizes.flags.writeable = False
    return sizes
