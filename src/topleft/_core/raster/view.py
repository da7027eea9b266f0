"""The options that all verbs share, checked once per call."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, TypedDict, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import as_size, as_subpixel_bits, as_transform, as_window
from topleft._core.base.options import Sampling, parse, parse_sampling
from topleft._core.base.threads import parse_threads
from topleft._core.raster.sampling import SAMPLE_GRID_BITS
from topleft.methods import Method, find_method
from topleft.typing import ClipDepthOption, CullOption, MethodOption, SamplingOption

if TYPE_CHECKING:
    from topleft._core.raster.clusters import Clusters

TEST_CODES = {Sampling.OUTER: 1, Sampling.INNER: 2}  # tl_test in csrc/topleft.h
EXACT_BITS = 8  # of the grid that all samples lie on: TL_GRID_BITS in csrc/exact
MAX_EXACT_PX = 2**48
CULL_CODES = {"none": 0, "back": 1, "front": 2}  # tl_cull in csrc/topleft.h


class Clock:
    """The times of the stages of a call, which `Plan.measure` draws."""

    def __init__(self) -> None:
        self.ns: dict[str, int] = {}
        self._last = time.perf_counter_ns()

    def mark(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter_ns()
        self.ns[stage] = self.ns.get(stage, 0) + now - self._last
        self._last = now


class Static(Protocol):
    """A mesh that does not change: it has checked its triangles, and may be drawn in clusters."""

    @property
    def vertices(self) -> NDArray[Any]:
        """Its vertices (V, 3)."""

    @property
    def triangles(self) -> NDArray[np.int32]:
        """Its triangles (T, 3)."""

    @property
    def drawn_triangles(self) -> NDArray[np.int32]:
        """Its triangles (T, 3), as they are drawn without clusters."""

    def find_clusters(self) -> Clusters | None:
        """Return its clusters, if it is drawn often enough to have them, and count this draw."""


class WindowOptions(TypedDict, total=False):
    """Options of a view of a mesh that no verb names itself."""

    origin: tuple[int, int]
    viewport: tuple[int, int] | None
    subpixel_bits: int | Literal["exact"]
    method: MethodOption
    clip_depth: ClipDepthOption
    near_clip: bool
    far_clip: bool


class ViewOptions(WindowOptions, total=False):
    """The options that all verbs share; `docs/design/rules.md` defines them."""

    transform: ArrayLike | None
    sampling: SamplingOption
    cull: CullOption | None
    threads: int | None


OPTIONS = frozenset(ViewOptions.__annotations__)
KEPT_OPTIONS = frozenset({"clip_depth", "cull", "far_clip", "near_clip", "sampling", "subpixel_bits", "threads"})
"""Options that, unlike arrays and pairs, are equal only where their meaning is, types compared."""


class RasterState(NamedTuple):
    """How the engine draws triangles: the window's first pixel, its grid, and codes of `csrc/topleft.h`."""

    x_px: int
    y_px: int
    grid_bits: int
    cull: int
    method: int
    test: int


@dataclass(frozen=True)
class View:
    """Checked `ViewOptions`."""

    size: tuple[int, int]
    origin: tuple[int, int]
    viewport: tuple[int, int]
    transform: NDArray[Any] | None
    subpixel_bits: int  # EXACT_BITS when vertices are not snapped
    grid_bits: int  # of the grid that holds the snapped vertices and all samples
    sampling: Sampling
    method: int
    cull: int
    zero_to_one: bool
    near_clip: bool
    far_clip: bool
    threads: int | None
    classic: Method | None = None
    clock: Clock | None = None
    static: Static | None = None
    """The mesh that has the arrays, if a mesh does."""
    single_sided: tuple[NDArray[np.uint8], int] | None = None
    """1 for each triangle with a side that is not drawn, and the `tl_cull` that names that side."""
    sides_by_material: bool = True
    """Whether materials say which sides are drawn: no `cull` was given."""
    is_exact: bool = False
    """Whether vertices stay where they are: ``subpixel_bits="exact"``."""

    @property
    def raster_state(self) -> RasterState:
        """How the engine draws triangles."""
        return RasterState(*self.origin, self.grid_bits, self.cull, self.method, self.test)

    def engine_viewport(self) -> engine.Viewport:
        """Return how clip space maps to pixels."""
        bits = self.subpixel_bits, self.grid_bits
        return engine.Viewport(self.viewport, *bits, self.zero_to_one, self.near_clip, self.far_clip)

    def but(self, **changes: Any) -> View:
        """Return the view with other values: `dataclasses.replace` in a tenth of its time."""
        made = object.__new__(View)
        vars(made).update(vars(self), **changes)
        return made

    def mark(self, stage: str) -> None:
        """Note for the clock that a stage has ended."""
        if self.clock is not None:
            self.clock.mark(stage)

    def refuse_classic(self, what: str) -> None:
        """Raise an error when a classic gets an option of the engine alone."""
        if self.classic is not None:
            raise ValueError(f"method {self.classic.name!r} has no {what}; use 'auto', 'edge' or 'scanline'")

    @property
    def test(self) -> int:
        """When a triangle covers a pixel: `tl_test` in ``csrc/topleft.h``."""
        return TEST_CODES.get(self.sampling, 0)

    @classmethod
    def parse(cls, size: object, options: ViewOptions, *, why_snapped: str | None = None) -> View:
        """Check the options of a call; `why_snapped`: why the caller draws snapped vertices alone, if so."""
        checked = as_size(size)
        if options.keys() <= KEPT_OPTIONS:
            with suppress(TypeError):  # what cannot be hashed is looked at below
                return kept_view(checked, why_snapped, **cast("dict[str, Any]", options))
        return cls._parse(checked, options, why_snapped)

    @classmethod
    def _parse(cls, size: tuple[int, int], options: ViewOptions, why_snapped: str | None) -> View:
        if not options.keys() <= OPTIONS:
            unknown = min(options.keys() - OPTIONS)
            raise TypeError(f"unknown option {unknown!r}; the options are {', '.join(ViewOptions.__annotations__)}")
        given_bits = options.get("subpixel_bits", 8)
        is_exact = isinstance(given_bits, str) and given_bits == "exact"
        bits = EXACT_BITS if is_exact else as_subpixel_bits(given_bits)
        sampling = parse_sampling(options.get("sampling", "center"))
        grid_bits = bits if sampling.n_samples == 1 else max(SAMPLE_GRID_BITS, bits)
        viewport = options.get("viewport")
        transform = options.get("transform")
        method = find_method(options.get("method", "auto"))
        cull = options.get("cull")
        view = cls(
            size=size,
            origin=as_window(options.get("origin", (0, 0)), grid_bits),
            viewport=size if viewport is None else as_size(viewport, "viewport", smallest=1),
            transform=None if transform is None else as_transform(transform),
            subpixel_bits=bits,
            grid_bits=grid_bits,
            sampling=sampling,
            method=method.code or 0,
            cull=CULL_CODES["none" if cull is None else parse(CullOption, "cull", cull)],
            zero_to_one=parse(ClipDepthOption, "clip_depth", options.get("clip_depth", "minus_one_to_one"))
            == "zero_to_one",
            near_clip=bool(options.get("near_clip", True)),
            far_clip=bool(options.get("far_clip", True)),
            threads=parse_threads(options.get("threads")),
            classic=method if method.code is None else None,
            sides_by_material=cull is None,
            is_exact=is_exact,
        )
        if is_exact:
            check_exact(view, why_snapped)
        return view


@lru_cache(maxsize=256, typed=True)
def kept_view(size: tuple[int, int], why_snapped: str | None, **options: Any) -> View:
    """A view with options that were checked before; a check takes a tenth of a small picture's time."""
    return View._parse(size, cast(ViewOptions, options), why_snapped)


def check_exact(view: View, why_snapped: str | None) -> None:
    """Raise an error where vertices that are not snapped cannot be drawn."""
    wish = "subpixel_bits must be in 0..16"
    if why_snapped is not None:
        raise ValueError(f"{wish} here, got 'exact': {why_snapped}")
    if view.sampling is Sampling.AREA:
        raise ValueError(
            f"{wish} for sampling 'area', got 'exact': that decides whether a sample or a square is covered, not how "
            "much of it"
        )
    if view.classic:
        raise ValueError(f"{wish} for method {view.classic.name!r}, got 'exact': it has lanes of its own")
    (x, y), (width, height) = view.origin, view.size
    if max(abs(x), abs(y), abs(x + width), abs(y + height)) > MAX_EXACT_PX:
        raise ValueError(f"origin and size must lie within {MAX_EXACT_PX} pixels of 0 for 'exact', got {(x, y)}")
