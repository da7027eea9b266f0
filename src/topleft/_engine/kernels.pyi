"""The types of the compiled module. What each does stands in kernels.pyx and the .pxi files."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

VERTEX_BYTES: int
CELL_CLEAR: int
PLANE_DOUBLES: int
AREA_OVERFLOW: int
MAX_LAYERS: int
CLUSTER: int
CLUSTER_GROUP: int
CLUSTER_TAIL: int
CLUSTER_BYTES: int
BLOCK: int
SCALARS: dict[np.dtype[Any], int]

def use_isa(name: str) -> None: ...
def isa_in_use() -> str: ...
def isa_built() -> list[str]: ...
def isa_available() -> list[str]: ...
def compiler_info() -> dict[str, object]: ...
def hear_signals_in(thread: int, threads: object) -> None: ...

class Stop:
    def set(self) -> None: ...
    def run(self, work: Callable[[], object]) -> None: ...

def area_stride(width: int) -> int: ...
def blend_cells(width: int) -> int: ...
def as_bytes(array: NDArray[Any]) -> NDArray[np.uint8]: ...
def first_bad_row(triangles: NDArray[np.int32], n_vertices: int) -> int: ...
def narrow_triangles(triangles: NDArray[np.int64], n_vertices: int, out: NDArray[np.int32]) -> int: ...
def set_flat_depth(
    ids: NDArray[np.int32],
    out: NDArray[np.float32],
    first_row: int,
    n_rows: int,
    earlier_wins: bool,
    depth: float,
    background: float,
) -> None: ...
def first_bad(records: NDArray[np.uint8], triangles: NDArray[np.int32]) -> int: ...

class Target:
    sink: int
    def __init__(
        self,
        sink: int,
        pixels: NDArray[Any],
        depth: NDArray[np.float32] | None,
        covered: NDArray[np.uint64] | None,
        samples: NDArray[np.int32] | None = None,
        earlier_wins: bool = False,
    ) -> None: ...
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
    def __init__(self, vertices: NDArray[Any], matrix: NDArray[Any] | None = None, is_affine: bool = False) -> None: ...
    def snap(
        self,
        first: int,
        end: int,
        subpixel_bits: int,
        with_depth: bool,
        records: NDArray[np.uint8],
        wide: NDArray[np.int64] | None,
    ) -> tuple[int, int, int]: ...
    def project_blocks(
        self, is_used: NDArray[np.uint8], viewport: Viewport, records: NDArray[np.uint8]
    ) -> tuple[int, int, int]: ...
    def project(
        self, first: int, end: int, viewport: Viewport, records: NDArray[np.uint8], wide: NDArray[np.int64] | None
    ) -> tuple[int, int, int]: ...
    def take(self, first: int, end: int, points: NDArray[np.float64] | None) -> int: ...

class Pieces:
    arrays: tuple[Any, ...] | None
    def __init__(
        self,
        source: Source,
        records: NDArray[np.uint8],
        triangles: NDArray[np.int32],
        viewport: Viewport,
        ids: NDArray[np.int32] | None = None,
    ) -> None: ...
    def __len__(self) -> int: ...

class SnappedMesh:
    viewport: Viewport | None
    subpixel_bits: int
    def __init__(
        self,
        source: Source,
        records: NDArray[np.uint8],
        wide: NDArray[np.int64] | None,
        triangles: NDArray[np.int32],
        pieces: Pieces | None,
        how: tuple[int, int, int, int, int, int],
        viewport: Viewport | None,
        is_used: NDArray[np.uint8] | None = None,
    ) -> None: ...
    def seen_from(self, x_fx: int, y_fx: int) -> SnappedMesh: ...
    def guess_seen(self, width: int, height: int) -> tuple[float, float, float]: ...
    def count_classes(
        self, sink: int, width: int, height: int, samples: NDArray[np.int32] | None = None
    ) -> tuple[int, list[tuple[int, float, float]]]: ...
    def with_inverse_w(self, n_pixels: int) -> SnappedMesh: ...
    def numbered_from(self, first_id: int) -> SnappedMesh: ...
    def moved(self, x_px: int, y_px: int) -> SnappedMesh: ...
    def drop_sides(self, is_single: NDArray[np.uint8], first: int, end: int, triangles: NDArray[np.int32]) -> None: ...
    def draw(self, target: Target, first_row: int, n_rows: int, is_first: bool = True, is_last: bool = True) -> int: ...
    def draw_share(
        self, target: Target, first_row: int, n_rows: int, first: int, others: NDArray[np.int32]
    ) -> tuple[int, int]: ...
    def draw_listed(
        self, target: Target, first_row: int, n_rows: int, ids: NDArray[np.int32], is_last: bool
    ) -> None: ...
    def draw_area(
        self,
        pixels: NDArray[np.float32],
        cells: NDArray[np.uint8],
        first_row: int,
        n_rows: int,
        is_wide: bool,
        is_clamped: bool,
    ) -> int: ...
    def paint(
        self,
        labels: NDArray[np.int32],
        colors: NDArray[np.uint8],
        pixels: NDArray[np.uint8],
        first_row: int,
        n_rows: int,
        is_flat: bool,
        is_u8: bool,
        n_channels: int,
    ) -> None: ...
    def blend(
        self,
        pixels: NDArray[np.uint8],
        width: int,
        first_row: int,
        n_rows: int,
        colors: NDArray[np.uint8],
        n_channels: int,
        is_u8: bool,
        is_flat: bool,
        blend: int,
        is_premultiplied: bool,
        ground: NDArray[np.uint8] | None,
        packed: NDArray[np.int32] | None,
        cells: NDArray[np.int32] | None,
    ) -> int: ...
    def barycentric(self, ids: NDArray[np.int32], out: NDArray[np.float32]) -> None: ...
    def interpolate(
        self,
        ids: NDArray[np.int32],
        values: NDArray[np.float32],
        per_corner: bool,
        background: float,
        out: NDArray[np.float32],
    ) -> None: ...

class ExactMesh(SnappedMesh):  # has draw, seen_from, guess_seen and paint; what asks for more is refused before
    def __init__(
        self,
        points: NDArray[np.float64],
        triangles: NDArray[np.int32],
        how: tuple[int, int, int, int, int, int],
        band: float = 1.0,
    ) -> None: ...
    def draw_counted(
        self, target: Target, first_row: int, n_rows: int, is_first: bool = True, is_last: bool = True
    ) -> tuple[int, tuple[int, ...]]: ...

def list_edges(
    mesh: SnappedMesh,
    starts: NDArray[np.int64],
    last_low: NDArray[np.int32],
    highs: NDArray[np.int32],
    edges: NDArray[np.uint64],
) -> int: ...
def draw_lines(
    mesh: SnappedMesh,
    edges: NDArray[np.uint64],
    pixels: NDArray[np.uint8],
    depth: NDArray[np.float32] | None,
    depth_bias: float,
    is_farthest: bool,
    is_smooth: bool,
    width: int,
    first_row: int,
    n_rows: int,
) -> None: ...

class Valued:
    def __init__(
        self,
        points_px: NDArray[np.float64],
        triangles: NDArray[np.int32],
        values: NDArray[np.float64],
        planes: NDArray[np.float64] | None = None,
    ) -> None: ...
    def list_planes(self, first: int, end: int) -> None: ...
    def fill_planes(
        self, ids: NDArray[np.int32], out: NDArray[Any], first_row: int, n_rows: int, x_px: int, y_px: int
    ) -> None: ...

class PixelPoints:
    def __init__(
        self,
        positions: NDArray[Any],
        kind: int,
        rows: NDArray[np.float64],
        half_size: tuple[float, float],
        background: float,
        is_f64_out: bool,
    ) -> None: ...
    def fill(
        self, mesh: SnappedMesh, ids: NDArray[np.int32], out: NDArray[Any], first_row: int, n_rows: int
    ) -> None: ...

class Bins:
    bad_row: int
    n_bands: int
    n_listed: int
    band_bits: int
    def __init__(
        self, mesh: SnappedMesh, height: int, width: int, reach_fx: int, band_bits: int, room: NDArray[np.int32]
    ) -> None: ...
    def fill(self, listed: NDArray[np.int32]) -> None: ...

def draw_bands(
    meshes: Sequence[SnappedMesh], targets: Sequence[Target], bins: Bins, first_band: int, end_band: int
) -> None: ...
def peel(
    meshes: Sequence[SnappedMesh],
    bins: Sequence[Bins | None],
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    is_farthest: bool,
    band_bits: int,
    first_band: int,
    end_band: int,
) -> int: ...
def composite(
    ids: NDArray[np.int32],
    n_triangles: int,
    first_row: int,
    n_rows: int,
    colors: NDArray[np.uint8],
    is_flat: bool,
    is_u8: bool,
    n_channels: int,
    background: NDArray[np.float32] | None,
    pixels: NDArray[np.uint8],
) -> None: ...

class Transfer:
    def __init__(
        self, tables: tuple[NDArray[np.int32], NDArray[np.uint8]] | None, n_channels: int, is_straight: bool
    ) -> None: ...

class Palette:
    def __init__(self, colors: NDArray[Any], transfer: Transfer | None) -> None: ...
    def mean_flat(self, labels: NDArray[np.int32], pixels: NDArray[Any], first_row: int, n_rows: int) -> None: ...

def fill_bands(
    meshes: Sequence[SnappedMesh],
    labels: NDArray[np.int32],
    palette: Palette,
    pixels: NDArray[Any],
    bins: Bins,
    first_band: int,
    end_band: int,
) -> None: ...
def mean_colors(
    painted: NDArray[Any], pixels: NDArray[Any], first_row: int, n_rows: int, n_channels: int, transfer: Transfer | None
) -> None: ...

class Mipmap:
    def __init__(
        self,
        texels: NDArray[np.uint16],
        levels: NDArray[np.int32],
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
        texels: NDArray[np.float32] | None,
        levels: NDArray[np.int32] | None,
        sky: Sequence[float],
        ground: Sequence[float],
        diffuse: float,
        from_shading: Sequence[Sequence[float]],
    ) -> None: ...

class ShadingTable:
    def __init__(
        self,
        normals: NDArray[np.float32],
        normal_of_corner: NDArray[np.int32] | None,
        face_normals: NDArray[np.float32] | None,
        positions: NDArray[Any],
        is_turned: NDArray[np.uint8] | None,
        uv: NDArray[np.float32] | None,
        uv1: NDArray[np.float32] | None,
        colors: NDArray[np.float32] | None,
        has_alpha: bool,
        front_side: float,
        material_of: NDArray[np.int32] | None,
        decode: NDArray[np.float32],
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

def set_inverse_w(
    mesh: SnappedMesh, rows: NDArray[np.float32], vertex_of_row: NDArray[np.int32] | None, out: NDArray[np.float32]
) -> None: ...
def shade(
    mesh: SnappedMesh,
    shading: ShadingTable,
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    pixels: NDArray[np.uint8],
    first_row: int,
    n_rows: int,
) -> None: ...
def shade_samples(
    mesh: SnappedMesh,
    shading: ShadingTable,
    positions: NDArray[np.int32],
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    pixels: NDArray[np.uint8],
    first_row: int,
    n_rows: int,
) -> None: ...
def shade_normals(
    mesh: SnappedMesh,
    shading: ShadingTable,
    ids: NDArray[np.int32],
    out: NDArray[np.float32],
    first_row: int,
    n_rows: int,
) -> None: ...
def cut_out_over(
    mesh: SnappedMesh,
    shading: ShadingTable,
    triangles: NDArray[np.int32],
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    is_peeled: bool,
    first_row: int,
    n_rows: int,
) -> None: ...
def cut_out(
    mesh: SnappedMesh,
    shading: ShadingTable,
    opaque: NDArray[np.int32],
    triangles: NDArray[np.int32],
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    first_row: int,
    n_rows: int,
) -> None: ...
def mark_vertices(ids: NDArray[np.int32], corners: NDArray[np.int32], is_used: NDArray[np.uint8]) -> None: ...
def list_cut(
    ids: NDArray[np.int32], corners: NDArray[np.int32], records: NDArray[np.uint8], cut: NDArray[np.int32]
) -> int: ...
def order_triangles(
    source: Source,
    triangles: NDArray[np.int32],
    box: NDArray[np.float64],
    keys: NDArray[np.uint32],
    room: NDArray[np.uint64],
    order: NDArray[np.int32],
) -> None: ...
def cut_clusters(
    triangles: NDArray[np.int32],
    order: NDArray[np.int32],
    seen: NDArray[np.int32],
    clusters: NDArray[np.uint8],
    vertices: NDArray[np.int32],
    corners: NDArray[np.uint8],
) -> tuple[int, int]: ...
def measure_clusters(
    source: Source,
    corners: NDArray[np.uint8],
    clusters: NDArray[np.uint8],
    group_boxes: NDArray[np.float64],
    first: int,
    end: int,
) -> None: ...

class ClusterView:
    def __init__(
        self,
        matrix: NDArray[np.float64],
        mesh: SnappedMesh,
        first_row: int,
        n_rows: int,
        width: int,
        margin_px: float,
        error: float,
        is_farthest: bool,
    ) -> None: ...

class Clustered:
    n_triangles: int
    def __init__(
        self,
        clusters: NDArray[np.uint8],
        group_boxes: NDArray[np.float64],
        corners: NDArray[np.uint8],
        names: NDArray[np.int32],
    ) -> None: ...
    def __len__(self) -> int: ...
    def survey(self, view: ClusterView, step: int, n_of: NDArray[np.int64]) -> None: ...
    def draw(
        self,
        mesh: SnappedMesh,
        source: Source,
        seen: ClusterView,
        may_be_hidden: bool,
        target: Target,
        first_row: int,
        n_rows: int,
        room: NDArray[np.int32],
        others: NDArray[np.int32],
        is_first: bool,
        is_last: bool,
    ) -> tuple[int, int, int]: ...

class Tree:
    def __init__(self, points: NDArray[np.float64], triangles: NDArray[np.int32], slack: float) -> None: ...
    def find_nearest(
        self,
        points: NDArray[np.float64],
        first: int,
        end: int,
        triangle: NDArray[np.int32],
        at: NDArray[np.float64] | None = None,
    ) -> float: ...
    def find_reach(
        self,
        points: NDArray[np.float64],
        triangles: NDArray[np.int32],
        first: int,
        end: int,
        known: float,
        share: float,
        least: float,
    ) -> tuple[float, float, int]: ...

def set_feet(
    points: NDArray[np.float64],
    triangles: NDArray[np.int32],
    from_points: NDArray[np.float64],
    triangle: NDArray[np.int32],
    point: NDArray[np.int32],
    at: NDArray[np.float64],
    squared: NDArray[np.float64],
) -> None: ...
def draw_cloud(
    records: NDArray[np.uint8],
    size_fx: int,
    sizes_fx: NDArray[np.int32] | None,
    is_disc: bool,
    x_fx: int,
    y_fx: int,
    target: Target,
    origin: tuple[int, int],
    subpixel_bits: int,
    first_row: int,
    n_rows: int,
) -> None: ...
def vertex_normals(
    source: Source, triangles: NDArray[np.int32], first: int, end: int, out: NDArray[np.float64]
) -> int: ...
def face_normals(
    source: Source,
    triangles: NDArray[np.int32],
    first: int,
    end: int,
    out: NDArray[np.float64] | None,
    rows: NDArray[np.float32] | None,
) -> int: ...
def find_turned(
    source: Source,
    triangles: NDArray[np.int32],
    first: int,
    end: int,
    normals: NDArray[np.float32],
    row_of_corner: NDArray[np.int32],
    is_turned: NDArray[np.uint8],
) -> int: ...
def face_angles(
    source: Source,
    triangles: NDArray[np.int32],
    first: int,
    end: int,
    normals: NDArray[np.float64],
    angles: NDArray[np.float64],
) -> int: ...

class Fans:
    most_corners: int
    def __init__(
        self,
        triangles: NDArray[np.int32],
        n_vertices: int,
        normals: NDArray[np.float64],
        angles: NDArray[np.float64],
        least_cosine: float,
    ) -> None: ...
    def find_creases(self, first: int, end: int, groups: NDArray[np.int32], n_groups: NDArray[np.int32]) -> None: ...
    def sum_creases(
        self,
        first: int,
        end: int,
        starts: NDArray[np.int32],
        groups: NDArray[np.int32],
        own_triangles: NDArray[np.int32],
        first_row: int,
        of_vertices: NDArray[np.float64],
        of_groups: NDArray[np.float64],
        row_of_corner: NDArray[np.int32] | None,
    ) -> None: ...

def box_of_faces(
    source: Source, triangles: NDArray[np.int32], first: int, end: int, box: NDArray[np.float64]
) -> int: ...
def unit_vectors(
    vectors: Source,
    turn: NDArray[np.float64] | None,
    first: int,
    end: int,
    out: NDArray[np.float64] | None,
    rows: NDArray[np.float32] | None,
) -> None: ...
def move_points(
    points: Source, matrix: NDArray[np.float64], first: int, end: int, out: NDArray[np.float64]
) -> None: ...
def color_rows(colors: NDArray[np.uint8], first: int, end: int, rows: NDArray[np.float32]) -> None: ...

CELL_ROWS: int
CERTIFY_WORDS: int
LABEL_SCRATCH_BYTES: int
LEAST_SHARE_CELLS: int
PIECE_BYTES: int
PIECE_WORDS: int
POLYGON_PAD: int

def polygon_stride(width: int) -> int: ...
def share_cells(width: int, height: int) -> int: ...
def snap_points(
    source: Source,
    first: int,
    end: int,
    bits: int,
    grid_bits: int,
    x_px: int,
    y_px: int,
    x_fx: NDArray[np.int32],
    y_fx: NDArray[np.int32],
    wide_fx: NDArray[np.int64] | None,
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
        x_fx: NDArray[np.int32],
        y_fx: NDArray[np.int32],
        wide_fx: NDArray[np.int64] | None,
        rings: NDArray[np.int64],
        polygons: NDArray[np.int64],
        width: int,
        height: int,
        bits: int,
        is_nonzero: bool,
    ) -> None: ...
    @property
    def boxes_px(self) -> NDArray[np.int32]: ...
    def bound(self, first: int, end: int) -> int: ...
    def make_weights(self) -> None: ...
    def certify(self, first: int, end: int, room: NDArray[np.int64] | None) -> None: ...
    def which_are_simple(self) -> NDArray[np.bool_]: ...
    def seen_from(self, sample_x_fx: int, sample_y_fx: int) -> None: ...
    def sort(
        self, band_rows: int, n_bands: int, starts: NDArray[np.int64], listed: NDArray[np.int32] | None
    ) -> None: ...
    def mask_even_odd(
        self, polygon: int, out: NDArray[np.uint8], top: int, bottom: int, bits: NDArray[np.int32]
    ) -> None: ...
    def mask_nonzero(
        self,
        polygon: int,
        out: NDArray[np.uint8],
        top: int,
        bottom: int,
        at: NDArray[np.uint32],
        room: NDArray[np.int32],
        cells: NDArray[np.int32],
        bits: NDArray[np.uint64],
    ) -> None: ...
    def label(
        self,
        pixels: NDArray[np.uint8],
        n_bytes: int,
        values: NDArray[np.int32] | None,
        background: int,
        test: int,
        waits: bool,
        band_rows: int,
        starts: NDArray[np.int64] | None,
        listed: NDArray[np.int32] | None,
        first_band: int,
        end_band: int,
        cells: NDArray[np.int32],
        scratch: NDArray[np.uint8],
        pieces: PieceScratch | None,
    ) -> None: ...
    def add_shares(
        self,
        pixels: NDArray[np.float32],
        colors: NDArray[np.float32] | None,
        band_rows: int,
        starts: NDArray[np.int64],
        listed: NDArray[np.int32],
        first_band: int,
        end_band: int,
        cells: NDArray[np.int32],
        pieces: PieceScratch | None,
        is_alone: bool,
    ) -> None: ...
    def list_shares(
        self,
        first: int,
        end: int,
        starts: NDArray[np.int64],
        indices: NDArray[Any],
        areas: NDArray[np.float32],
        cells: NDArray[np.int32],
        pieces: PieceScratch | None,
    ) -> int: ...
