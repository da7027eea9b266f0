"""`overlap`: the exact share of each pixel in each polygon, as a sparse table.

Input: rings and a size. Output: `Overlap`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from itertools import pairwise
from threading import Condition, Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX, as_array, as_checked_triangles, as_number, as_real, check_real, shown
from topleft._core.base.defaults import MAX_CROSSINGS
from topleft._core.base.georeference import check_centers, check_rows_along_y, numbers_without_data
from topleft._core.base.grid import Grid
from topleft._core.base.memory import FRESH, SCRATCH, check_fits, fits
from topleft._core.base.options import parse
from topleft._core.base.threads import run_parts
from topleft._core.polygons.draw import cells_for
from topleft._core.polygons.polygons import frame_of, in_crs_of, warn_if_apart
from topleft._core.polygons.prepared import Prepared, prepare
from topleft._core.polygons.rings import as_points, rings_of_triangles
from topleft.errors import MissingPackageError
from topleft.typing import RuleOption

#: Entries allocated at a time, or as many as the largest polygon needs; pages that are not written cost nothing.
MAX_ENTRIES_AT_ONCE = 1 << 27

#: Entries that a thread lists before it copies them to the table: they stay in the second-level cache.
MAX_BLOCK_ENTRIES = 1 << 16

#: Entries that the kernel may write beyond the last one: a whole vector.
TAIL = 16


@dataclass(frozen=True, eq=False)
class Overlap:
    """The areas that polygons and pixels share: a sparse matrix, a row for each polygon and a column for each pixel.

    Parameters
    ----------
    starts : ndarray of int64, shape (P + 1,)
        The entries of polygon i are ``[starts[i], starts[i + 1])``: `indptr` of a CSR matrix.
    pixels : ndarray of int32 (int64 for pictures of 2**31 pixels), shape (E,)
        ``row * width + column`` of each entry, ascending within a polygon: `indices`.
    areas : ndarray of float32, shape (E,)
        The area of the pixel that lies in the polygon, in pixels, above 0 and at most 1: `data`.
    size : (int, int)
        Width and height of the picture.
    nodata : number, optional
        The value of pixels without data in rasters, unless a method gets another; by default of the `Grid`.
    grid : Grid, optional
        Where the picture lies. Rasters of rasterio and xarray that lie elsewhere raise an error.

    Examples
    --------
    >>> import topleft as tl
    >>> table = tl.overlap([[[(0.5, 0), (2, 0), (2, 1), (0.5, 1)]]], (3, 1))
    >>> table.pixels.tolist(), table.areas.tolist()
    ([0, 1], [0.5, 1.0])
    >>> table.means([[2.0, 8.0, 9.0]]).tolist()
    [6.0]
    """

    starts: npt.NDArray[np.int64]
    pixels: npt.NDArray[Any]
    areas: npt.NDArray[np.float32]
    size: tuple[int, int]
    nodata: float | None = None
    grid: Grid | None = None
    _room: list[tuple[npt.NDArray[Any], npt.NDArray[np.float32]]] = field(
        default_factory=list, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        """Refuse arrays that are no table."""
        n = len(self.pixels)
        for name, kinds in (("starts", "iu"), ("pixels", "iu"), ("areas", "f")):
            array = getattr(self, name)
            if not isinstance(array, np.ndarray) or array.ndim != 1 or array.dtype.kind not in kinds:
                raise ValueError(f"{name} must be an array of {'numbers' if kinds == 'f' else 'integers'} in one row")
        if len(self.areas) != n:
            raise ValueError(f"areas must be as many as pixels, {n}, got {len(self.areas)}")
        if not len(self.starts) or self.starts[0] != 0 or self.starts[-1] != n or (np.diff(self.starts) < 0).any():
            raise ValueError(f"starts must ascend from 0 to the {n} entries")

    def __len__(self) -> int:
        """Return the number of polygons."""
        return len(self.starts) - 1

    @property
    def shape(self) -> tuple[int, int]:
        """Polygons, pixels."""
        return len(self), self.size[0] * self.size[1]

    @property
    def polygons(self) -> npt.NDArray[np.int32]:
        """The polygon (E,) of each entry."""
        return np.repeat(np.arange(len(self), dtype=np.int32), np.diff(self.starts))

    @property
    def rows_columns(self) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Row and column (E,) of the pixel of each entry."""
        return self.pixels // max(1, self.size[0]), self.pixels % max(1, self.size[0])

    def to_scipy(self) -> Any:
        """Return the table as `scipy.sparse.csr_array` (P, H * W), without a copy."""
        from scipy.sparse import csr_array

        return csr_array((self.areas, self.pixels, self.starts), shape=self.shape)

    def to_sparse(self) -> Any:
        """Return the table as `sparse.COO` (P, H, W) of pydata/sparse, of float32, without a dense array.

        Raises
        ------
        MissingPackageError
            If sparse is not installed.
        """
        try:
            import sparse
        except ImportError:
            raise MissingPackageError("to_sparse needs the package sparse: pip install sparse") from None
        places = np.stack([self.polygons, *self.rows_columns])
        return sparse.COO(
            places, self.areas, (len(self), *self.size[::-1]), has_duplicates=False, sorted=True, fill_value=0
        )

    def sums(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the integral (P,) of a raster (H, W) over each polygon; pixels without data count 0, see `means`."""
        values = self._values_of(raster, nodata)
        return self._added(np.where(np.isnan(values), 0.0, values) * self.areas)

    def means(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the mean (P,) of a raster (H, W) over each polygon; pixels without data do not count.

        Pixels have no data where the raster is NaN or `nodata`, where a masked array is masked, and where a raster of
        xarray or an open dataset of rasterio, of a single band, has its number of no data. The mean is NaN where no
        pixel of a polygon has data.
        """
        return self._mean_of(self._values_of(raster, nodata))

    def counts(self, raster: npt.ArrayLike | None = None, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the sum (P,) of the shares of pixels with data in each polygon; see `means`.

        Without a raster all pixels count, as in `totals`.
        """
        return self.totals() if raster is None else self._added(self.areas * ~np.isnan(self._values_of(raster, nodata)))

    def minima(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the least number (P,) of a raster (H, W) in pixels that each polygon meets; NaN without data."""
        return self._reduced(np.fmin, self._values_of(raster, nodata))

    def maxima(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the largest number (P,) of a raster (H, W) in pixels that each polygon meets; NaN without data."""
        return self._reduced(np.fmax, self._values_of(raster, nodata))

    def stdevs(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the population standard deviation (P,) of a raster (H, W) over each polygon; NaN without data.

        It is the root of the mean of the squares of the differences to the mean, each weighted by its share.
        """
        values = self._values_of(raster, nodata)
        is_known = ~np.isnan(values)
        weights = self.areas * is_known
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.where(is_known, values - np.repeat(self._mean_of(values), np.diff(self.starts)), 0.0)
            return np.sqrt(self._added(off**2 * weights) / self._added(weights))

    def majorities(self, raster: npt.ArrayLike, *, nodata: float | None = None) -> npt.NDArray[np.float64]:
        """Return the number (P,) of a raster (H, W) that takes the largest area of each polygon; NaN without data.

        At equal areas the least number wins.
        """
        values, areas, starts = self._sorted(self._values_of(raster, nodata))
        result = np.full(len(self), np.nan)
        if not len(values):
            return result
        polygons = np.repeat(np.arange(len(self)), np.diff(starts))
        is_first = np.ones(len(values), np.bool_)
        is_first[1:] = (values[1:] != values[:-1]) | (polygons[1:] != polygons[:-1])
        firsts = np.flatnonzero(is_first)
        sums = np.add.reduceat(areas, firsts)
        order = np.lexsort((values[firsts], -sums, polygons[firsts]))  # the largest area first, then the least number
        of_polygons = polygons[firsts][order]
        is_best = np.ones(len(of_polygons), np.bool_)
        is_best[1:] = of_polygons[1:] != of_polygons[:-1]
        result[of_polygons[is_best]] = values[firsts][order][is_best]
        return result

    def quantiles(
        self, raster: npt.ArrayLike, q: npt.ArrayLike = 0.5, *, nodata: float | None = None
    ) -> npt.NDArray[np.float64]:
        """Return quantiles (P,), or (P, Q) of several, of a raster (H, W) over each polygon; NaN without data.

        The least number that a share `q`, 0 to 1, of the polygon's area does not exceed; the default 0.5 is the
        median. Equal to ``numpy.quantile(..., method="inverted_cdf", weights=)``.
        """
        wanted = as_real("q", q)
        if wanted.ndim > 1 or not ((wanted >= 0) & (wanted <= 1)).all():
            raise ValueError(f"q must be one number from 0 to 1 or several, got {shown(q)}")
        values, areas, starts = self._sorted(self._values_of(raster, nodata))
        sums = np.concatenate([[0.0], np.cumsum(areas)])
        first, end = starts[:-1], starts[1:]
        result = np.full((len(self), wanted.size), np.nan)
        is_full = first < end
        for i, share in enumerate(wanted.ravel().tolist()):
            goal = sums[first] + share * (sums[end] - sums[first])
            at = np.searchsorted(
                sums[1:], goal - 1e-9
            )  # areas are multiples of 2**-24: a sum is met, or missed by more
            result[is_full, i] = values[np.clip(at, first, end - 1)[is_full]]
        return result[:, 0] if wanted.ndim == 0 else result

    def totals(self) -> npt.NDArray[np.float64]:
        """Return the area (P,) of each polygon inside of the frame, in pixels."""
        return self._added(self.areas)

    def spread(self, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return a raster (H, W): the values (P,) of polygons, weighted by the area shared with each pixel.

        Amounts a pixel's area are conserved: the raster sums to the sum of values times areas.
        """
        amounts = as_real("values", values)
        if amounts.shape != (len(self),):
            raise ValueError(f"values must have shape ({len(self)},), a number for each polygon, got {amounts.shape}")
        self._check_pixels()
        weights = np.repeat(amounts, np.diff(self.starts)) * self.areas
        picture: npt.NDArray[np.float64] = np.bincount(self.pixels, weights, minlength=self.shape[1])  # type: ignore[assignment]
        return picture.reshape(self.size[::-1])

    def _check_pixels(self) -> None:
        """Raise an error where a table of the caller has pixels outside of the grid; a pass over the entries."""
        n = self.shape[1]
        unsigned = self.pixels.view(f"u{self.pixels.dtype.itemsize}")  # below 0 is beyond
        if len(unsigned) and int(unsigned.max()) >= n:
            raise ValueError(f"pixels must lie in 0..{n - 1}, got {self.pixels.min()}..{self.pixels.max()}")

    def _values_of(self, raster: Any, nodata: float | None) -> npt.NDArray[np.float64]:
        """Return the number (E,) of the pixel of each entry, NaN where it has no data."""
        if nodata is None:
            nodata = self.nodata
        else:
            as_number("nodata", nodata)
            nodata = np.asarray(nodata).item()  # an integer stays an integer
        caller_raster = raster
        if hasattr(raster, "read") and hasattr(raster, "count"):  # of rasterio
            if raster.count != 1:
                raise ValueError(f"raster must have one band, got {raster.count}: pass raster.read(1, masked=True)")
            raster = raster.read(1, masked=True)
        check_rows_along_y(raster)
        numbers = [nodata, *numbers_without_data(raster)]
        is_masked = np.ma.getmask(raster) if isinstance(raster, np.ma.MaskedArray) else np.ma.nomask
        array = as_array("raster", raster.data if is_masked is not np.ma.nomask else raster)
        if array.shape != self.size[::-1]:
            raise ValueError(f"raster must have shape {self.size[::-1]}, got {array.shape}")
        check_real("raster", array, "biuf")
        if self.grid is not None:
            check_centers(caller_raster, (self.grid.x_centers, self.grid.y_centers), self.grid.pixel_size)
        self._check_pixels()
        entries = array.reshape(-1)[self.pixels]
        values = entries.astype(np.float64)
        with np.errstate(all="ignore"):
            for number in numbers:
                if number is not None:
                    values[entries == number] = np.nan  # Python's number takes the dtype of the raster
        if is_masked is not np.ma.nomask:
            values[is_masked.reshape(-1)[self.pixels]] = np.nan
        return values

    def _mean_of(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the mean (P,) of the numbers of entries."""
        is_known = ~np.isnan(values)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._added(np.where(is_known, values, 0.0) * self.areas) / self._added(self.areas * is_known)

    def _sorted(
        self, values: npt.NDArray[np.float64]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]:
        """Return the numbers of each polygon, ascending, the areas of their entries, and where polygons begin."""
        known = np.flatnonzero(~np.isnan(values))
        polygons = self.polygons[known]
        order = known[np.lexsort((values[known], polygons))]
        starts = np.concatenate([[0], np.cumsum(np.bincount(polygons, minlength=len(self)))]).astype(np.int64)
        return values[order], self.areas[order].astype(np.float64), starts

    def _reduced(
        self, ufunc: np.ufunc, values: npt.NDArray[np.float64], empty: float = np.nan
    ) -> npt.NDArray[np.float64]:
        """Reduce the entries of each polygon by a ufunc; `empty` where a polygon has no entry."""
        is_full = np.diff(self.starts) > 0
        result = np.full(len(self), empty)
        if is_full.any():
            result[is_full] = ufunc.reduceat(values, self.starts[:-1][is_full])
        return result

    def _added(self, entries: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """Return the sum over the entries of each polygon."""
        return self._reduced(np.add, entries.astype(np.float64), empty=0.0)


def overlap(
    rings: Any,
    size: int | tuple[int, int] | Grid,
    *,
    triangles: npt.ArrayLike | None = None,
    crs: object = None,
    rule: RuleOption = "evenodd",
    origin: tuple[int, int] = (0, 0),
    subpixel_bits: int = 16,
    assume_valid: bool = False,
    max_crossings: int = MAX_CROSSINGS,
    threads: int | None = None,
    out: Overlap | None = None,
) -> Overlap:
    """Return the exact area that each polygon shares with each pixel, a sparse table.

    Parameters
    ----------
    rings, size, crs, rule, origin, assume_valid, max_crossings, threads
        As in `polygons`. The table takes the `nodata` of a `Grid`.
    subpixel_bits : int, 0 to 16
        Points snap to ``2**-subpixel_bits`` pixels.
    triangles : array_like of integers, shape (T, 3), optional
        Then `rings` are the vertices (V, 2) of a mesh, and its triangles the polygons.
    out : Overlap, optional
        A table that is no longer needed: its memory is reused, if it is large enough.

    Returns
    -------
    Overlap
        ``.starts``, ``.pixels`` and ``.areas``, the arrays of a CSR matrix; ``.means(raster)`` and ``.sums(raster)``
        over polygons, ``.spread(values)`` to pixels, ``.to_scipy()``.

    Raises
    ------
    ValueError, TypeError
        As in `polygons`.
    IndexError
        For an index outside the vertices; names the row.

    Notes
    -----
    Points move by up to half of ``2**-subpixel_bits`` pixels along x and y when they snap. Of the snapped polygons each
    area has an error below ``2**-24`` for each edge that passes its pixel. Where polygons tile a pixel, its areas
    sum to 1 within as much; the areas of a polygon sum to its area inside of the frame.

    Examples
    --------
    >>> import topleft as tl
    >>> table = tl.overlap([[[(0, 0), (2, 0), (0, 2)]], [[(2, 0), (2, 2), (0, 2)]]], (2, 2))
    >>> table.starts, table.pixels, table.areas
    (array([0, 3, 6]), array([0, 1, 2, 1, 2, 3], dtype=int32), array([1. , 0.5, 0.5, 0.5, 0.5, 1. ], dtype=float32))
    >>> table.means([[1, 2], [3, 4]])
    array([1.75, 3.25])
    """
    is_nonzero = parse(RuleOption, "rule", rule) == "nonzero"
    if triangles is None:
        ring_set = in_crs_of(size, rings, crs)
    else:
        if crs is not None:
            raise ValueError("crs is for polygons, not for triangles=")
        vertices = as_points(rings, "vertices")
        ring_set = rings_of_triangles(vertices, as_checked_triangles(triangles, len(vertices)))
    rings_px, frame = frame_of(ring_set, size, origin, subpixel_bits, threads, 1, max_crossings)
    prepared = prepare(SCRATCH, rings_px, frame, is_nonzero=is_nonzero)
    warn_if_apart(prepared, ring_set, size)
    prepared.certify(assume_valid=assume_valid)
    if out is not None and not isinstance(out, Overlap):
        raise TypeError(f"out must be an Overlap, got {type(out).__name__}")
    table = list_areas(prepared, [] if out is None else out._room)
    return table if not isinstance(size, Grid) else replace(table, nodata=size.nodata, grid=size)


Chunk = tuple[npt.NDArray[Any], npt.NDArray[np.float32]]


def list_areas(prepared: Prepared, used: list[Chunk]) -> Overlap:
    """Return the table of snapped polygons; `used`: arrays to reuse, if they are large enough."""
    size, n = prepared.frame.size, len(prepared)
    boxes = prepared.compiled.boxes_px.astype(np.int64)
    widths, heights = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    before = np.concatenate([[0], np.cumsum(widths * heights)])  # the most entries before each polygon
    dtype = np.int32 if size[0] * size[1] <= INT32_MAX else np.int64
    starts = np.zeros(n + 1, np.int64)
    if not n or 0 in size:
        return Overlap(starts, np.empty(0, dtype), np.empty(0, np.float32), size)
    n_threads = max(1, min(prepared.threads_with_pieces(), n))
    most = max(MAX_BLOCK_ENTRIES, int((widths * heights).max())) + TAIL  # of the buffer of a thread
    if n_threads > 1 and not fits((n_threads, most), dtype, np.float32):
        n_threads = 1
    n_cells = cells_for(prepared, size[1])
    cells = SCRATCH.constant("cells", n_cells * n_threads, engine.CELL_CLEAR).reshape(n_threads, n_cells)

    def take_room(n_entries: int) -> Chunk:
        for i, (pixels, areas) in enumerate(used):
            if len(pixels) >= n_entries + TAIL and pixels.dtype == dtype:
                del used[i]
                return pixels, areas
        return FRESH.empty("pixels", (n_entries + TAIL,), dtype), FRESH.empty("areas", (n_entries + TAIL,), np.float32)

    rooms: list[Chunk] = []
    done, n_listed, entries = 0, 0, []
    while done < n:  # a pass lists all polygons, except in huge tables
        end = end_of_room(before, done, MAX_ENTRIES_AT_ONCE)
        n_room = int(before[end] - before[done])
        check_fits((n_listed + n_room,), dtype, np.float32)
        room = take_room(n_room)
        list_range(prepared, before, (done, end), starts, room, cells)
        n_entries = int(starts[end] - starts[done])
        entries.append((room[0][:n_entries], room[1][:n_entries]))
        rooms.append(room)
        done, n_listed = end, n_listed + n_entries
    if len(entries) == 1:
        return Overlap(starts, *entries[0], size, _room=rooms)
    check_fits((2 * n_listed,), dtype, np.float32)
    return Overlap(starts, np.concatenate([c[0] for c in entries]), np.concatenate([c[1] for c in entries]), size)


def end_of_room(before: npt.NDArray[np.int64], first: int, n_entries: int) -> int:
    """Return the end of the polygons from `first` on that fit into n_entries; at least a polygon."""
    end = int(np.searchsorted(before, before[first] + n_entries, "right")) - 1
    return min(len(before) - 1, max(end, first + 1))


def list_range(
    prepared: Prepared,
    before: npt.NDArray[np.int64],
    polygons: tuple[int, int],
    starts: npt.NDArray[np.int64],
    room: Chunk,
    cells: npt.NDArray[np.int32],
) -> None:
    """Write the entries of a range of polygons to the begin of `room`, and where each polygon ends to `starts`.

    `cells`: a row for each thread. Several threads pop blocks of polygons from a queue: the thread with the next block
    in order writes it to `room`, other threads write to a buffer and copy it when the blocks before are done.
    """
    begin, last = polygons
    pixels, areas = room
    if len(cells) == 1:
        before_all, starts[begin] = int(starts[begin]), 0
        prepared.compiled.list_shares(begin, last, starts, pixels, areas, cells[0], prepared.piece_scratch())
        starts[begin : last + 1] += before_all
        return
    bounds = [begin]
    while bounds[-1] < last:
        bounds.append(min(last, end_of_room(before, bounds[-1], MAX_BLOCK_ENTRIES)))
    most = int(np.diff(before[bounds]).max()) + TAIL
    blocks, free = deque(pairwise(bounds)), deque(cells)
    queue_lock, turn = Lock(), Condition()
    done = begin
    is_lost = False

    def list_blocks(*_: int) -> None:
        nonlocal done, is_lost
        scratch, thread_cells = prepared.piece_scratch(), free.popleft()
        block_starts = np.empty(len(starts), np.int64)
        block = np.empty(most, pixels.dtype), np.empty(most, np.float32)
        try:
            while True:
                with queue_lock:
                    if not blocks:
                        return
                    first, end = blocks.popleft()
                block_starts[first] = 0
                is_next = done == first  # all blocks before are done: no copy
                at = int(starts[first] - starts[begin])
                to = (pixels[at:], areas[at:]) if is_next else block
                prepared.compiled.list_shares(first, end, block_starts, *to, thread_cells, scratch)
                with turn:
                    while not is_lost and done != first:
                        turn.wait()
                    if is_lost:
                        return
                    at, n_entries = int(starts[first] - starts[begin]), int(block_starts[end])
                    starts[first + 1 : end + 1] = block_starts[first + 1 : end + 1] + starts[first]
                    done = end
                    turn.notify_all()
                if not is_next:
                    pixels[at : at + n_entries], areas[at : at + n_entries] = block[0][:n_entries], block[1][:n_entries]
        except BaseException:
            with turn:  # wake the threads that wait for this block
                is_lost = True
                turn.notify_all()
            raise

    run_parts(list_blocks, len(cells), len(cells))
