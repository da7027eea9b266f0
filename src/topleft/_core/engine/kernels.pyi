"""The types of the compiled module. What each does stands in kernels.pyx and the .pxi files."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[Any]
F32: TypeAlias = NDArray[np.float32]
F64: TypeAlias = NDArray[np.float64]
I32: TypeAlias = NDArray[np.int32]
I64: TypeAlias = NDArray[np.int64]
U8: TypeAlias = NDArray[np.uint8]
U32: TypeAlias = NDArray[np.uint32]
U64: TypeAlias = NDArray[np.uint64]

VERTEX_BYTES: int
PLACED: int
CELL_CLEAR: int
PLANE_DOUBLES: int
AREA_OVERFLOW: int
FEW_OF_BITS: int
FEW_STORED: int
FEW_LABELLED: int
BLENDED_ROWS: int
MAX_LAYERS: int
LENS_RINGS: int
CLUSTER: int
CLUSTER_GROUP: int
CLUSTER_TAIL: int
CLUSTER_BYTES: int
MESHLET_BYTES: int
MESHLET_TRIANGLES: int
MESHLET_TAIL: int
MESHLET_BOUNDS: int
MESHLET_PIECE: int
GROW_ROOM: int
SEEN_BYTES: int
MAX_DRAWN_PX: int
BLOCK: int
SCALARS: dict[np.dtype[Any], int]

def use_isa(name: str) -> None: ...
def isa_in_use() -> str: ...
def isa_built() -> list[str]: ...
def isa_available() -> list[str]: ...
def compiler_info() -> dict[str, object]: ...
def hear_signals_in(thread: int, threads: object) -> None: ...

class Block: ...
class Lease: ...

# A `Lease`, which NumPy takes where it takes a memoryview.
def lease_block(n_bytes: int, allocate: Callable[[int], U8]) -> memoryview: ...
def keep_blocks(n_bytes: int) -> None: ...
def waiting_memory() -> int: ...

class Stop:
    def set(self) -> None: ...
    def run(self, work: Callable[[], object]) -> None: ...

def area_stride(width: int) -> int: ...
def blend_cells(width: int) -> int: ...
def as_bytes(array: Array) -> U8: ...
def first_bad_row(triangles: I32, n_vertices: int) -> int: ...
def narrow_triangles(triangles: I64, n_vertices: int, out: I32) -> int: ...
def set_flat_depth(
    ids: I32, out: F32, first_row: int, n_rows: int, earlier_wins: bool, depth: float, background: float
) -> None: ...
def first_bad(records: U8, triangles: I32) -> int: ...

class Target:
    sink: int
    def __init__(
        self,
        sink: int,
        pixels: Array,
        depth: F32 | None,
        covered: U64 | None,
        samples: I32 | None = None,
        earlier_wins: bool = False,
        bounds: F32 | None = None,
    ) -> None: ...
    def keep_bounds(self, bounds: F32) -> None: ...
    @staticmethod
    def bounds_shape(height: int, width: int) -> tuple[int, int]: ...
    @staticmethod
    def covered_shape(height: int, width: int, n_samples: int = 1) -> tuple[int, int]: ...

class Viewport:
    def __init__(
        self,
        size: tuple[int, int],
        subpixel_bits: int,
        guard_bits: int,
        zero_to_one: bool,
        near_clip: bool,
        far_clip: bool,
    ) -> None: ...
    @property
    def size(self) -> tuple[int, int]: ...

class Source:
    is_clip_space: bool
    is_affine: bool
    matrix: Array | None
    def __init__(self, vertices: Array, matrix: Array | None = None, is_affine: bool = False) -> None: ...
    def snap(
        self, first: int, end: int, subpixel_bits: int, with_depth: bool, records: U8, wide: I64 | None
    ) -> tuple[int, int, int]: ...
    def project_blocks(self, is_used: U8, viewport: Viewport, records: U8) -> tuple[int, int, int]: ...
    def project(
        self, first: int, end: int, viewport: Viewport, records: U8, wide: I64 | None
    ) -> tuple[int, int, int]: ...
    def project_points(self, first: int, end: int, viewport: Viewport, points: F64) -> tuple[int, int]: ...
    def take(self, first: int, end: int, points: F64 | None, bits: int = -1) -> int: ...

class Pieces:
    arrays: tuple[Any, ...] | None
    def __init__(
        self, source: Source, records: U8, triangles: I32, viewport: Viewport, ids: I32 | None = None
    ) -> None: ...
    def __len__(self) -> int: ...

class SnappedMesh:
    viewport: Viewport | None
    exact: UnsnappedPoints | None
    subpixel_bits: int
    def __init__(
        self,
        source: Source,
        records: U8,
        wide: I64 | None,
        triangles: I32,
        pieces: Pieces | None,
        how: tuple[int, int, int, int, int, int],
        viewport: Viewport | None,
        is_used: U8 | None = None,
        exact: UnsnappedPoints | None = None,
    ) -> None: ...
    def seen_from(self, x_fx: int, y_fx: int) -> SnappedMesh: ...
    def guess_seen(self, width: int, height: int) -> tuple[float, float, float]: ...
    def guess_scatter(self, n_rows: int) -> float: ...
    def count_classes(
        self, sink: int, width: int, height: int, samples: I32 | None = None
    ) -> tuple[int, list[tuple[int, float, float]]]: ...
    def finds_inverse_w(self, n_pixels: int) -> bool: ...
    def with_inverse_w(self, n_pixels: int, empty: Callable[..., Array] = ...) -> SnappedMesh: ...
    def numbered_from(self, first_id: int) -> SnappedMesh: ...
    @property
    def is_named(self) -> bool: ...
    def named(self, names: I32) -> SnappedMesh: ...
    def moved(self, x_px: int, y_px: int) -> SnappedMesh: ...
    def drop_sides(self, is_single: U8, first: int, end: int, triangles: I32) -> None: ...
    def draw(self, target: Target, first_row: int, n_rows: int, is_first: bool = True, is_last: bool = True) -> int: ...
    def draw_share(self, target: Target, first_row: int, n_rows: int, first: int, others: I32) -> tuple[int, int]: ...
    def draw_listed(self, target: Target, first_row: int, n_rows: int, ids: I32, is_last: bool) -> None: ...
    def draw_area(
        self, pixels: F32, cells: U8, first_row: int, n_rows: int, is_wide: bool, is_clamped: bool
    ) -> int: ...
    def paint(
        self,
        labels: I32,
        colors: U8,
        pixels: U8,
        first_row: int,
        n_rows: int,
        is_flat: bool,
        is_u8: bool,
        n_channels: int,
        ground: U8 | None = None,
    ) -> None: ...
    def blend(
        self,
        pixels: U8,
        width: int,
        first_row: int,
        n_rows: int,
        colors: U8,
        n_channels: int,
        is_u8: bool,
        is_flat: bool,
        blend: int,
        is_premultiplied: bool,
        band_rows: int,
        ground: U8 | None,
        packed: I32 | None,
        cells: I32 | None,
        is_few: bool = False,
    ) -> int: ...
    def blends_few(self, width: int, height: int) -> bool: ...
    def is_few(self, width: int, height: int, n_samples: int, most: int) -> bool: ...
    def fill_few(
        self,
        pixels: Array,
        first_row: int,
        n_rows: int,
        colors: Array,
        transfer: Transfer | None,
        ground: U8,
        samples_fx: I32,
    ) -> int: ...
    def barycentric(self, ids: I32, out: F32) -> None: ...
    def interpolate(self, ids: I32, values: F32, per_corner: bool, background: float, out: F32) -> None: ...

class ExactPieces:
    @property
    def arrays(self) -> tuple[Array, ...] | None: ...
    def __init__(self, source: Source, points: F64, triangles: I32, viewport: Viewport) -> None: ...
    def __len__(self) -> int: ...
    def join(self, points: F64, triangles: I32) -> tuple[F64, I32, I32]: ...

class UnsnappedPoints:
    @property
    def counts(self) -> tuple[int, int, int, int, int, int]: ...
    def __init__(
        self, points_given: F64, triangles_given: I32, pieces: ExactPieces | None = None, band: float = 1.0
    ) -> None: ...

def list_edges(mesh: SnappedMesh, starts: I64, last_low: I32, highs: I32, edges: U64) -> int: ...
def draw_lines(
    mesh: SnappedMesh,
    edges: U64,
    pixels: U8,
    depth: F32 | None,
    depth_bias: float,
    is_farthest: bool,
    is_smooth: bool,
    width: int,
    first_row: int,
    n_rows: int,
) -> None: ...

class Valued:
    def __init__(self, points_px: F64, triangles: I32, values: F64, planes: F64 | None = None) -> None: ...
    def list_planes(self, first: int, end: int) -> None: ...
    def fill_planes(self, ids: I32, out: Array, first_row: int, n_rows: int, x_px: int, y_px: int) -> None: ...

class PixelPoints:
    def __init__(
        self,
        positions: Array,
        kind: int,
        rows: F64,
        half_size: tuple[float, float],
        background: float,
        is_f64_out: bool,
    ) -> None: ...
    def fill(self, mesh: SnappedMesh, ids: I32, out: Array, first_row: int, n_rows: int) -> None: ...

class Bins:
    bad_row: int
    n_bands: int
    n_listed: int
    band_bits: int
    def __init__(
        self, mesh: SnappedMesh, height: int, width: int, reach_fx: int, band_bits: int, room: I32
    ) -> None: ...
    def fill(self, listed: I32) -> None: ...

def draw_bands(
    meshes: Sequence[SnappedMesh], targets: Sequence[Target], bins: Bins, first_band: int, end_band: int
) -> None: ...

class Split:
    rows: NDArray[np.int64]
    columns: NDArray[np.int32]
    ids: NDArray[np.int32]
    depth: NDArray[np.float32]
    def __init__(
        self, rows: NDArray[np.int64], columns: NDArray[np.int32], ids: NDArray[np.int32], depth: NDArray[np.float32]
    ) -> None: ...
    def spread_ids(self, first_ids: I32, ids: I32, first_row: int, n_rows: int) -> None: ...
    @staticmethod
    def room_of(height: int, width: int, n_bands: int) -> int: ...

def draw_split_bands(
    meshes: Sequence[SnappedMesh],
    first: Target,
    ids: I32,
    depth: F32,
    split: Split,
    bins: Bins,
    first_band: int,
    end_band: int,
) -> None: ...
def peel(
    meshes: Sequence[SnappedMesh],
    bins: Sequence[Bins | None],
    ids: I32,
    depth: F32,
    is_farthest: bool,
    band_bits: int,
    first_band: int,
    end_band: int,
) -> int: ...
def composite(
    ids: I32,
    n_triangles: int,
    first_row: int,
    n_rows: int,
    colors: U8,
    is_flat: bool,
    is_u8: bool,
    n_channels: int,
    background: F32 | None,
    pixels: U8,
) -> None: ...
def fill_slopes(
    ids: NDArray[np.int32],
    weights: NDArray[np.float32],
    slot: NDArray[np.int32],
    steps: NDArray[np.float64],
    rows: NDArray[np.int32],
    values: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None: ...
def fill_texels(
    texels: NDArray[np.float32],
    rows: NDArray[np.int64],
    codes: tuple[int, int, int],
    ids: NDArray[np.int32],
    uv: NDArray[np.float32],
    slopes: NDArray[np.float32] | None,
    background: float,
    out: NDArray[np.float32],
) -> None: ...
def halve_rows(
    level: NDArray[np.float32], width: int, height: int, first: int, end: int, out: NDArray[np.float32]
) -> None: ...

class Transfer:
    def __init__(self, tables: tuple[I32, U8] | None, n_channels: int, is_straight: bool) -> None: ...

class Palette:
    def __init__(self, colors: Array, transfer: Transfer | None) -> None: ...
    def mean_flat(self, labels: I32, pixels: Array, first_row: int, n_rows: int) -> None: ...

def find_instances(ids: I32, first_ids: NDArray[np.int64], out: I32, boxes: I32 | None) -> None: ...
def fill_bands(
    meshes: Sequence[SnappedMesh],
    labels: I32,
    covered: NDArray[np.uint64],
    palette: Palette,
    pixels: Array,
    ground: Array | None,
    bins: Bins,
    first_band: int,
    end_band: int,
) -> None: ...
def mean_colors(
    painted: Array, pixels: Array, first_row: int, n_rows: int, n_channels: int, transfer: Transfer | None
) -> None: ...

class Mipmap:
    def __init__(
        self,
        texels: NDArray[np.uint16],
        levels: I32,
        filter_code: int,
        wrap_u: int,
        wrap_v: int,
        uv_set: int = ...,
        transform: Sequence[Sequence[float]] | None = ...,
        tangent: Sequence[float] = ...,
        hand: float = ...,
    ) -> None: ...

class Surroundings:
    def __init__(
        self,
        texels: F32 | None,
        levels: I32 | None,
        sky: Sequence[float],
        ground: Sequence[float],
        diffuse: float,
        from_shading: Sequence[Sequence[float]],
    ) -> None: ...

class ShadingTable:
    def __init__(
        self,
        normals: F32,
        finds_inverse_w: bool,
        normal_of_corner: I32 | None,
        corner_normals: F32 | None,
        face_normals: F32 | None,
        positions: Array,
        is_turned: U8 | None,
        uv: F32 | None,
        uv1: F32 | None,
        colors: F32 | None,
        has_alpha: bool,
        front_side: float,
        material_of: I32 | None,
        decode: F32,
    ) -> None: ...
    def set_materials(self, materials: Sequence[tuple[Any, ...]]) -> None: ...
    def set_lights(self, lights: Sequence[tuple[Any, ...]], ambient: Sequence[float]) -> None: ...
    def set_surroundings(self, surroundings: Surroundings) -> None: ...
    def set_wants_opacity(self) -> None: ...
    def set_view(
        self,
        show: int,
        matcap: Mipmap | None,
        eye_from: Sequence[Sequence[float]],
        has_perspective: bool,
        eye: Sequence[float],
        ray: Sequence[Sequence[float]],
        background: Sequence[float],
        background_bytes: Sequence[int],
    ) -> None: ...
    def set_fog(
        self, color: Sequence[float], near: float, scale: float, distance_start: float, distance_scale: float
    ) -> None: ...

def set_inverse_w(mesh: SnappedMesh, rows: F32, out: F32) -> None: ...
def shade(
    mesh: SnappedMesh, shading: ShadingTable, ids: I32, depth: F32, pixels: U8, first_row: int, n_rows: int
) -> None: ...
def shade_samples(
    mesh: SnappedMesh,
    shading: ShadingTable,
    positions: I32,
    ids: I32,
    depth: F32,
    split: Split | None,
    pixels: U8,
    first_row: int,
    n_rows: int,
) -> None: ...
def shade_normals(
    mesh: SnappedMesh, shading: ShadingTable, ids: I32, out: F32, first_row: int, n_rows: int
) -> None: ...
def cut_out_over(
    mesh: SnappedMesh,
    shading: ShadingTable,
    triangles: I32,
    ids: I32,
    depth: F32,
    is_peeled: bool,
    first_row: int,
    n_rows: int,
) -> None: ...
def cut_out(
    mesh: SnappedMesh,
    shading: ShadingTable,
    opaque: I32,
    triangles: I32,
    ids: I32,
    depth: F32,
    first_row: int,
    n_rows: int,
) -> None: ...
def mark_vertices(ids: I32, corners: I32, n_vertices: int, is_used: U8) -> int: ...
def list_cut(ids: I32, corners: I32, records: U8, cut: I32) -> int: ...
def order_triangles(source: Source, triangles: I32, box: F64, keys: U32, room: U64, order: I32) -> None: ...
def cut_clusters(
    triangles: I32, order: I32, seen: I32, clusters: U8, vertices: I32, corners: U8
) -> tuple[int, int]: ...
def measure_clusters(source: Source, corners: U8, clusters: U8, group_boxes: F64, first: int, end: int) -> None: ...

class ClusterView:
    def __init__(
        self,
        source: Source,
        mesh: SnappedMesh,
        first_row: int,
        n_rows: int,
        width: int,
        margin_px: float,
        error: float,
        sink: int,
    ) -> None: ...

def pixels_per_unit(matrix: F64, size: tuple[int, int], window: F64, extents: F64) -> float | None: ...
def coarsest_levels(
    matrices: F64,
    size: tuple[int, int],
    window: F64,
    extents: F64,
    bounds: F64,
    tolerance: float,
    levels: I64,
    scales: F64,
) -> None: ...
def find_shown(
    mesh: SnappedMesh, view: ClusterView, boxes: F64, matrices: F64, target: Target, is_drawn: bool, shown: U8
) -> None: ...

class Clustered:
    n_triangles: int
    def __init__(self, clusters: U8, group_boxes: F64, corners: U8, names: I32) -> None: ...
    def __len__(self) -> int: ...
    def survey(self, view: ClusterView, step: int, n_of: I64) -> None: ...
    def count_hidden(self, mesh: SnappedMesh, view: ClusterView, target: Target, step: int) -> tuple[int, int]: ...
    def draw(
        self,
        mesh: SnappedMesh,
        source: Source,
        seen: ClusterView,
        may_be_hidden: bool,
        target: Target,
        first_row: int,
        n_rows: int,
        room: I32,
        others: I32,
        is_first: bool,
        is_last: bool,
    ) -> tuple[int, int, int]: ...

def has_meshlets() -> bool: ...
def most_meshlets(n_triangles: int) -> int: ...
def grow_meshlets(
    source: Source,
    triangles: I32,
    order: I32,
    first: int,
    end: int,
    numbers: I32,
    room: U8,
    meshlets: U8,
    records: F32,
    n_triangles: U8,
) -> int: ...

class Grown:
    def __init__(self, meshlets: U8, bounds: F32, n_triangles: U8, largest: Sequence[float]) -> None: ...
    def __len__(self) -> int: ...

class MeshletPass:
    def __init__(
        self, meshlets: Grown, mesh: SnappedMesh, source: Source, seen: ClusterView, target: Target
    ) -> None: ...
    def find(self, first: int, end: int, found: I32, odd: I32) -> tuple[int, int]: ...
    def split_rows(self, found: I32, n: int, n_parts: int) -> list[int]: ...
    def draw(
        self,
        found: I32,
        n: int,
        odd: I32,
        n_odd: int,
        first_row: int,
        end_row: int,
        is_first: bool,
        room: I32,
        others: I32,
    ) -> int: ...

class LensTable:
    def __init__(
        self,
        is_fisheye: bool,
        k: Sequence[float],
        p: Sequence[float],
        s: Sequence[float],
        tilt: Sequence[float],
        px_from_plane: Sequence[Sequence[float]],
        tolerance_px: float,
    ) -> None: ...
    def go_on_from(self, limit: float, cosine: float, sine: float, slope: float) -> None: ...
    def set_frame(self, least_cosine: float, cap_cosine: float, cap_sine: float) -> None: ...
    def set_rings(self, cosine: float, allowed: F32) -> None: ...
    def places(self, points: F64) -> F64: ...
    def bend_vertices(
        self, source: Source, eye_from: F64, near: float, first: int, end: int, bent: F64, records: F32
    ) -> None: ...
    def find_bent(
        self, records: F32, triangles: I32, first: int, end: int, bent: I32, outside: I32
    ) -> tuple[int, int]: ...
    def count_parts(
        self, points: F64, records: F32, triangles: I32, ids: I32, near: float, most: int
    ) -> tuple[int, int]: ...
    def write_parts(
        self,
        points: F64,
        records: F32,
        triangles: I32,
        ids: I32,
        near: float,
        own: I32,
        source: I32,
        weights: F64,
        is_outline: U8,
        own_points: F64,
    ) -> None: ...

class Tree:
    def __init__(self, points: F64, triangles: I32, slack: float) -> None: ...
    def find_nearest(self, points: F64, first: int, end: int, triangle: I32, at: F64 | None = None) -> float: ...
    def find_reach(
        self, points: F64, triangles: I32, first: int, end: int, known: float, share: float, least: float
    ) -> tuple[float, float, int]: ...

def set_feet(
    points: F64, triangles: I32, from_points: F64, triangle: I32, point: I32, at: F64, squared: F64
) -> None: ...
def draw_cloud(
    records: U8,
    size_fx: int,
    sizes_fx: I32 | None,
    is_disc: bool,
    x_fx: int,
    y_fx: int,
    target: Target,
    origin: tuple[int, int],
    subpixel_bits: int,
    first_row: int,
    n_rows: int,
) -> None: ...
def product(a: ArrayLike, b: ArrayLike) -> F64: ...
def row_products(a: ArrayLike, b: ArrayLike) -> F64: ...
def inverse(a: Array) -> F64: ...
def determinant(a: ArrayLike) -> float: ...
def length(vector: ArrayLike) -> float: ...
def camera_rays(clip_from_eye: F64, view: F64, center: F64, width: float, height: float) -> tuple[bool, F64, float]: ...
def cosine_and_sine(degrees: float) -> tuple[float, float]: ...
def arc_sine(sine: float) -> float: ...
def off_axis(points: ArrayLike) -> tuple[F64, F64]: ...
def log2(a: float) -> float: ...
def cube_root(a: float) -> float: ...
def vertex_normals(source: Source, triangles: I32, first: int, end: int, out: F64) -> int: ...
def face_normals(source: Source, triangles: I32, first: int, end: int, out: F64 | None, rows: F32 | None) -> int: ...
def find_turned(
    source: Source, triangles: I32, first: int, end: int, normals: F32, row_of_corner: I32, is_turned: U8
) -> int: ...
def face_angles(source: Source, triangles: I32, first: int, end: int, normals: F64, angles: F64) -> int: ...

class Fans:
    most_corners: int
    def __init__(self, triangles: I32, n_vertices: int, normals: F64, angles: F64, least_cosine: float) -> None: ...
    def find_creases(self, first: int, end: int, groups: I32, n_groups: I32) -> None: ...
    def sum_creases(
        self,
        first: int,
        end: int,
        starts: I32,
        groups: I32,
        own_triangles: I32,
        first_row: int,
        of_vertices: F64,
        of_groups: F64,
        row_of_corner: I32 | None,
    ) -> None: ...

def box_of_faces(source: Source, triangles: I32, first: int, end: int, box: F64) -> int: ...
def unit_vectors(
    vectors: Source, turn: F64 | None, first: int, end: int, out: F64 | None, rows: F32 | None
) -> None: ...
def move_points(points: Source, matrix: F64, first: int, end: int, out: F64) -> None: ...
def color_rows(colors: U8, first: int, end: int, rows: F32) -> None: ...
def group_rows(rows: NDArray[np.uint32], table_bits: int, table: I32, first: I32, group: I32) -> int: ...

CELL_ROWS: int
LABEL_SCRATCH_BYTES: int
LEAST_SHARE_CELLS: int
PIECE_BYTES: int
PIECE_WORDS: int
POLYGON_PAD: int

def polygon_stride(width: int) -> int: ...
def snap_points(
    source: Source,
    first: int,
    end: int,
    bits: int,
    grid_bits: int,
    x_px: int,
    y_px: int,
    x_fx: I32,
    y_fx: I32,
    wide_fx: I64 | None,
) -> tuple[int, int]: ...

class PieceScratch:
    def __init__(self, n_pieces: int, height: int, width: int) -> None: ...

class SnappedPolygons:
    n_polygons: int
    n_rings: int
    width: int
    height: int
    def __init__(
        self,
        x_fx: I32,
        y_fx: I32,
        wide_fx: I64 | None,
        rings: I64,
        polygons: I64,
        width: int,
        height: int,
        bits: int,
        is_nonzero: bool,
    ) -> None: ...
    @property
    def boxes_px(self) -> I32: ...
    def bound(self, first: int, end: int) -> int: ...
    def make_weights(self) -> None: ...
    def certify_words(self) -> int: ...
    def certify(self, first: int, end: int, room: I64 | None) -> None: ...
    def which_are_simple(self) -> NDArray[np.bool_]: ...
    def weights_of_rings(self) -> NDArray[np.int8]: ...
    def seen_from(self, sample_x_fx: int, sample_y_fx: int) -> None: ...
    def sort(self, band_rows: int, n_bands: int, starts: I64, listed: I32 | None) -> None: ...
    def mask_even_odd(self, polygon: int, out: U8, top: int, bottom: int, bits: I32) -> None: ...
    def mask_nonzero(
        self, polygon: int, out: U8, top: int, bottom: int, at: U32, room: I32, cells: I32, bits: U64
    ) -> None: ...
    def label(
        self,
        pixels: U8,
        n_bytes: int,
        values: I32 | None,
        background: int,
        test: int,
        waits: bool,
        band_rows: int,
        starts: I64 | None,
        listed: I32 | None,
        first_band: int,
        end_band: int,
        cells: I32,
        scratch: U8,
        pieces: PieceScratch | None,
    ) -> None: ...
    def add_shares(
        self,
        pixels: F32,
        colors: F32 | None,
        band_rows: int,
        starts: I64,
        listed: I32,
        first_band: int,
        end_band: int,
        cells: I32,
        pieces: PieceScratch | None,
        is_alone: bool,
    ) -> None: ...
    def list_shares(
        self, first: int, end: int, starts: I64, indices: Array, areas: F32, cells: I32, pieces: PieceScratch | None
    ) -> int: ...

# Windows of huge rasters

def list_spans(
    tiling: tuple[int, int, int, int, int],
    corners_px: NDArray[np.float64],
    first_triangle: int,
    boxes: NDArray[np.int32],
    starts: NDArray[np.int64],
    spans: NDArray[np.int32] | None,
) -> int: ...

SHORT_SPAN: int

def sort_spans(spans: I32, starts: I64, out: I32 | None) -> int: ...
def count_windows(spans: I32, starts: I64, steps: I32) -> None: ...

class StridedMesh:
    def __init__(self, points: Array, triangles: Array) -> None: ...
    def take(self, which: I32 | None, first: int, out: U8) -> int: ...

def merge_fragments(
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    other_ids: NDArray[np.int32],
    other_depth: NDArray[np.float32],
    first_id: int,
    rule: int,
    first: int,
    end: int,
) -> None: ...
def name_triangles(ids: NDArray[np.int32], first: int, end: int, names: NDArray[np.int32]) -> None: ...
