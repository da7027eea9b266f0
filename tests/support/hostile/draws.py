"""What a hostile call is made of: numbers of a seed or a file become odd arrays, options, sizes and `out=`.

A case is drawn from a `Source`: hypothesis (`tests/trust/test_fuzz.py`), a random generator, or the bytes of a fuzzer
that coverage guides (`fuzz.py`). The cases are in `fuzzing.py` and `fuzzing_grids.py`.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, get_args

import numpy as np

import topleft as tl
from topleft.typing import SamplesOption

REFUSALS = (ValueError, TypeError, IndexError, MemoryError, tl.TopleftError)
TINY = [0.0, -0.0, 5e-324, 1e-310, 1e-45, 0.5, -0.5, 1 / 512, 2.0**22, -(2.0**24)]
SPECIAL = [2.0**31, 2.0**53, 2.0**61, -(2.0**62), 1e30, -1e30, 1e300, 3.4e38, 1e39, float("inf"), float("-inf"),
           float("nan")]  # fmt: skip
INDICES = [-1, -2, 2**15, 2**16 - 1, 2**31 - 1, -(2**31), 2**31, 2**32, 2**63 - 1, -(2**63)]
SIZES = [(0, 0), (0, 5), (5, 0), (2**31 - 1, 0), (0, 2**31 - 1), (2**31 - 1, 2**31 - 1), (2**31, 1), (1, -1),
         (2**63, 2), (-(2**63), 1), (2**64, 2**64)]  # fmt: skip
DTYPES = ["f8", "f4", "f2", ">f4", ">f8", "i4", "i8", "i2", "u1", "u8", ">i4", "g"]
ODD_DTYPES = ["?", "c8", "O", "U3", "M8[s]"]
INDEX_DTYPES = ["i4", "i8", "u4", "u8", "i2", "u1", ">i4", ">u8"]
SAMPLINGS = [*get_args(SamplesOption)]
GUARD = 64
LARGEST = 5000  # the longest side of a picture that is drawn; what is larger is to be refused
FAR = [2.0**20, -(2.0**22), 2.0**23, -(2.0**27), 2.0**31]


class Source(Protocol):
    """Where decisions come from."""

    def integer(self, low: int, high: int) -> int:
        """Return a number in [low, high]."""


class FromRandom:
    """Decisions of a seed."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def integer(self, low: int, high: int) -> int:
        return int(self._rng.integers(low, high, endpoint=True))


class FromBytes:
    """Decisions of a file: up to four bytes each, zeros after its end."""

    def __init__(self, content: bytes) -> None:
        self._content, self._at = content, 0

    def integer(self, low: int, high: int) -> int:
        n = 1 if high - low < 256 else 2 if high - low < 65536 else 4
        part = self._content[self._at : self._at + n]
        self._at += n
        return low + int.from_bytes(part, "little") % (high - low + 1)


@dataclass
class Draw:
    """Decisions of a case, by what they are for."""

    source: Source

    def of(self, choices: Sequence[Any]) -> Any:
        """One of some; the first is the plainest."""
        return choices[self.source.integer(0, len(choices) - 1)]

    def chance(self, one_in: int) -> bool:
        """True once in so many times."""
        return self.source.integer(0, one_in - 1) == one_in - 1

    def mostly(self, usual: Sequence[Any], odd: Sequence[Any]) -> Any:
        """One of the usual ones, now and then an odd one."""
        return self.of(odd if self.chance(16) else usual)

    def rng(self) -> np.random.Generator:
        """A generator for the bulk of an array."""
        return np.random.default_rng(self.source.integer(0, 65535))

    def numbers(self, shape: tuple[int, ...], low: float, high: float) -> np.ndarray:
        """Numbers of a range, of a lattice, or with some special ones among them."""
        rng, kind = self.rng(), self.source.integer(0, 6)
        values = np.asarray(rng.uniform(low, high, shape))
        if kind == 1:
            values = np.asarray(np.round(values * 2) / 2)
        elif kind == 2:
            values = np.asarray(values * 10.0 ** rng.integers(-3, 9))
        if kind >= 4 and values.size:
            for _ in range(self.source.integer(1, 3)):
                values.reshape(-1)[self.source.integer(0, values.size - 1)] = self.mostly(TINY, SPECIAL)
        return values

    def as_dtype(self, values: np.ndarray, dtypes: Sequence[str]) -> np.ndarray:
        """The numbers as another dtype."""
        dtype = np.dtype(self.mostly(dtypes, ODD_DTYPES))
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = values.astype("i8").astype(dtype) if dtype.kind == "M" else values.astype(dtype)
        if dtype.kind == "f" and dtype.itemsize in (4, 8) and made.size and self.chance(16):  # NaN with contents
            words = made.view(f"{dtype.byteorder}u{dtype.itemsize}").reshape(-1)
            words[self.source.integer(0, words.size - 1)] = (0x7FF << 52) + 0xABC if dtype.itemsize == 8 else 0xFFC12345
        return made

    def laid_out(self, array: np.ndarray) -> Any:
        """The same numbers at an odd address, with other strides, read-only, or as a list."""
        array, kind = np.asarray(array), self.source.integer(0, 9)
        if kind == 1:
            return np.asfortranarray(array)
        if kind == 2 and array.ndim:
            return array[::-1].copy()[::-1]
        if kind == 3 and array.ndim:
            wide = np.zeros((*array.shape[:-1], 2 * array.shape[-1]), array.dtype)
            wide[..., ::2] = array
            return wide[..., ::2]
        if kind == 4 and not array.dtype.hasobject:
            memory = np.zeros(array.nbytes + 1, np.uint8)
            odd = memory[1:].view(array.dtype).reshape(array.shape)
            odd[...] = array
            return odd
        if kind == 5:
            array.flags.writeable = False
        if kind == 6 and array.ndim and array.shape[0]:
            return np.broadcast_to(array[:1], array.shape)
        if kind == 7 and array.size < 64:
            return array.tolist()
        if kind == 8 and array.ndim > 1:
            return array[:, ::-1].copy()[:, ::-1]
        return array

    def vertices(
        self, n: int, n_columns: Sequence[int], size: tuple[int, int], origin: tuple[int, int] = (0, 0)
    ) -> Any:
        """Rows of coordinates round a picture, now and then stretched along an axis, or far away."""
        side = min(max(*size, 4), 80)
        columns = self.of(n_columns)
        values = self.numbers((n, columns), -0.4 * side, 1.4 * side)
        with np.errstate(all="ignore"):
            for axis in (0, 1):
                if max(*size) > 80:
                    values[:, axis] *= size[axis] / side
                if self.chance(8):
                    values[:, axis] *= 2.0 ** self.source.integer(-4, 24)
                values[:, axis] += self.of(FAR) if self.chance(8) else origin[axis]
        if columns == 4 and n:
            values[:, 3] = np.where(np.isfinite(values[:, 3]), values[:, 3] / side + 0.5, values[:, 3])
        return self.laid_out(self.as_dtype(values, DTYPES))

    def as_index(self, values: np.ndarray, dtypes: Sequence[str]) -> np.ndarray:
        """Indices as another dtype, now and then one that holds no indices."""
        with np.errstate(all="ignore"):
            return values.astype(self.mostly(dtypes, ["f8", "?", "O"]))

    def triangles(self, n: int, n_vertices: int) -> Any:
        """Rows of indices, now and then one at a border or beyond."""
        array = self.as_index(self.rng().integers(0, max(n_vertices, 1), (n, 3)), INDEX_DTYPES)
        if n and self.chance(12):
            wrong = self.of([n_vertices, n_vertices - 1, *INDICES])
            info = np.iinfo(array.dtype) if array.dtype.kind in "iu" else None
            if info and info.min <= wrong <= info.max:
                array.reshape(-1)[self.source.integer(0, array.size - 1)] = wrong
        return self.laid_out(array)

    def shape(self, *wanted: int) -> tuple[int, ...]:
        """A shape, now and then another one."""
        if not self.chance(30):
            return wanted
        return self.of([(), (0,), (1, 1), wanted[:-1], (*wanted, 1), (wanted[0] + 1, *wanted[1:])])

    def size(self) -> Any:
        """A picture of a few thousand pixels, a wide, tall or larger one, or of a size that no memory holds."""
        if self.chance(30):
            return self.of(SIZES)
        if self.chance(6):
            wide = self.source.integer(1, 4000), self.source.integer(1, 12)
            return self.of([wide, wide[::-1], (self.source.integer(70, 1600), self.source.integer(50, 320))])
        return self.source.integer(1, 70), self.source.integer(1, 50)

    def colors(self, n: int) -> Any:
        """A row of colours for each."""
        values = self.numbers(self.shape(n, self.of([4, 3, 1, 2])), 0, 255)
        if not self.chance(12):
            values = np.clip(np.nan_to_num(values), 0, 255)
        return self.laid_out(self.as_dtype(values, ["u1", "f4", "f8", "i8", "f2"]))


@dataclass
class Case:
    """A call: what is called with what, and which arguments the verbs would write to."""

    name: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...]
    options: dict[str, Any] = field(default_factory=dict)

    def run(self) -> list[np.ndarray]:
        """Call it; the arrays that come back."""
        return arrays_of(self.call(*self.arguments, **self.options))

    def __repr__(self) -> str:
        with np.printoptions(threshold=40):
            return f"{self.name}(*{self.arguments!r}, **{self.options!r})"


def arrays_of(result: Any) -> list[np.ndarray]:
    """The arrays of a result, all attributes of fragments among them."""
    if isinstance(result, np.ndarray):
        return [result]
    if isinstance(result, tuple | list):
        return [array for one in result for array in arrays_of(one)]
    if isinstance(result, tl.DepthLayers):
        return [result.triangle, result.depth]
    if isinstance(result, tl.Overlap):
        return [result.starts, result.pixels, result.areas]
    if isinstance(result, tl.Fragments):
        return [result.triangle, result.depth, *map(np.asarray, result.planes if hasattr(result, "planes") else ())]
    return []


def view_of(draw: Draw, samplings: Sequence[str]) -> dict[str, Any]:
    """Options that all verbs share."""
    options: dict[str, Any] = {}
    if draw.chance(2):
        options["sampling"] = draw.of(samplings)
    if draw.chance(3):
        options["subpixel_bits"] = draw.mostly([8, 0, 4, 16, 1, "exact"], [-1, 17, "exactly"])
    if draw.chance(3):
        options["origin"] = draw.mostly(
            [(0, 0), (3, 2), (-7, 9), (2**23, -(2**22)), (2**31 - 866, -(2**32) - 7)],
            [(2**44, 2**44), (2**62, 0), (2**63, 0)],
        )
    if draw.chance(4):
        options["viewport"] = draw.mostly([(64, 48), (1, 1), (2**31 - 1, 2**31 - 1)], [(0, 0), (2**31, 4)])
    if draw.chance(4):
        options["cull"] = draw.of(["none", "back", "front"])
    if draw.chance(5):
        options["method"] = draw.mostly(["auto", "edge", "scanline"], ["float_barycentric", "zigzag"])
    if draw.chance(4):
        options["near_clip"] = options["far_clip"] = draw.of([True, False])
    if draw.chance(6):
        matrix = np.eye(4) + draw.numbers((4, 4), -0.2, 0.2)
        options["transform"] = draw.laid_out(draw.as_dtype(matrix, ["f8", "f4", ">f8"]))
    options["threads"] = draw.of([1, None, 2, 3])
    return options


def mesh_arrays(
    draw: Draw, size: Any, n_columns: Sequence[int] = (2, 3, 4), origin: tuple[int, int] = (0, 0)
) -> tuple[Any, Any, int, int]:
    """Vertices, triangles, and how many there are of each."""
    n_vertices, n_triangles = draw.of([6, 3, 40, 1, 0, 200]), draw.of([2, 1, 0, 30, 300])
    vertices = draw.vertices(n_vertices, n_columns, size if max(size) <= LARGEST else (60, 40), origin)
    return vertices, draw.triangles(n_triangles, n_vertices), n_vertices, n_triangles


def out_of(draw: Draw, shape: tuple[int, ...], dtypes: Sequence[str], inputs: Sequence[Any]) -> Any:
    """An array to draw into: plain, unsuitable, or over an input; nothing for a picture that no memory holds."""
    kind = draw.source.integer(0, 9)
    if kind < 5 or max(shape, default=0) > LARGEST or min(shape, default=1) < 0:
        return None
    dtype = np.dtype(draw.of(dtypes))
    memory = np.full(int(np.prod(shape)) * dtype.itemsize + 2 * GUARD + 1, 0x5A, np.uint8)
    out = memory[GUARD : len(memory) - GUARD - 1].view(dtype).reshape(shape)
    if dtype.kind == "b" or draw.chance(2):
        out[...] = 0
    if kind == 6:
        own = [each for each in inputs if isinstance(each, np.ndarray) and each.flags.c_contiguous and each.size]
        shared = draw.of(own) if own else None
        if shared is not None and shared.nbytes <= out.nbytes and not shared.dtype.hasobject:
            over = out.reshape(-1).view(np.uint8)[: shared.nbytes].view(shared.dtype).reshape(shared.shape)
            over[...] = shared
            for i, each in enumerate(inputs):
                if each is shared:
                    inputs[i] = over  # type: ignore[index]
    if kind == 7:
        return memory[GUARD + 1 : len(memory) - GUARD].view(dtype).reshape(shape)  # at an odd address
    if kind == 8 and out.ndim > 1:
        return draw.of([out[::-1], out[:, ::-1], np.asfortranarray(out), out[::2], out.swapaxes(0, 1)])
    if kind == 9:
        out.flags.writeable = False
    return out
