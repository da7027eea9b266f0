# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False, embedsignature=False
"""Memoryviews in, one nogil kernel call, status out. The array layer has checked every shape, dtype and index."""

from libc.stdint cimport int32_t, int64_t, uint8_t, uint16_t, uint64_t
from libc.string cimport memset

import numpy as np


cdef extern from "topleft.h" nogil:
    ctypedef struct tl_vertex:
        int32_t x_fx, y_fx
    ctypedef struct tl_wide:
        pass
    ctypedef int tl_scalar
    ctypedef struct tl_source:
        const void *data
        tl_scalar scalar
        int n_components
        int64_t n
        const void *matrix
        int is_affine
    ctypedef struct tl_vertex_set:
        const tl_vertex *vertices
        const tl_wide *wide
        const double *inv_w
        const tl_source *source
        int64_t n_vertices
        int32_t sample_x_fx, sample_y_fx
    ctypedef struct tl_vertex_counts:
        int64_t n_bad, n_wide, n_clipped
    ctypedef struct tl_view:
        double half_width_px, half_height_px, guard_band_x, guard_band_y
        int subpixel_bits, zero_to_one, near_clip, far_clip
    ctypedef struct tl_pieces:
        tl_vertex *vertices
        tl_wide *wide
        double *inv_w
        double *weights
        int32_t *triangles
        int32_t *source
        int64_t n_vertices, n_pieces
    ctypedef int tl_test
    ctypedef struct tl_window:
        int64_t x_px, y_px, width, height
        int subpixel_bits
        tl_test test
    ctypedef int tl_cull
    ctypedef int tl_method
    ctypedef int tl_sink
    ctypedef struct tl_census:
        tl_sink sink
        int64_t *n
        double *boxes
        double *covered
    int TL_MAX_LAYERS, TL_SINK_PEEL
    ctypedef struct tl_peeled:
        int n_layers, is_farthest
        int32_t *ids
        float *depth
        int64_t plane_px
    ctypedef struct tl_target:
        tl_sink sink
        void *pixels
        float *depth
        int64_t stride_px
        int64_t n_samples
        uint64_t *covered
        int sample_bits
        const int32_t *samples_fx
        int sample
        int32_t flip
        const tl_peeled *peeled
    int64_t tl_covered_words(int64_t)
    ctypedef struct tl_bins:
        int64_t n
        int32_t *ids
        int32_t *first_band
        int32_t *last_band
    ctypedef struct tl_transfer:
        const int32_t *decode
        const uint8_t *encode
        int n_channels
        int is_straight
    ctypedef struct tl_area:
        float *pixels
        int64_t stride_px
        void *cells
        int is_wide, is_clamped
    int64_t TL_CELL_CLEAR, TL_AREA_OVERFLOW, TL_PLANE_DOUBLES
    int64_t tl_area_stride(int64_t width)
    ctypedef int tl_blend
    ctypedef struct tl_canvas:
        void *pixels
        int64_t stride_px
        const void *colors
        int n_channels, is_u8, is_flat
        tl_blend blend
        int is_premultiplied
        const uint8_t *ground
        int is_area
        int32_t *packed
        int32_t *cells
    int64_t tl_blend_cells(int64_t width)
    ctypedef struct tl_scene:
        tl_vertex_set mesh
        const int32_t *triangles
        int64_t n_triangles
        const tl_pieces *pieces
        tl_cull cull
        tl_method method
        int32_t first_id
    ctypedef struct tl_share:
        const int32_t *ids
        int64_t first, end
        int32_t *others
        int64_t n_others
        const tl_window *picture
        int is_first, is_last
    ctypedef struct tl_composite:
        const int32_t *ids
        int64_t plane_px
        int n_layers, n_channels, is_u8, is_flat
        const void *colors
        const float *background
    ctypedef struct tl_edges:
        tl_vertex_set mesh
        const tl_view *view
        const int32_t *edges
        int64_t n_edges
    ctypedef struct tl_edge_scratch:
        int64_t *starts
        int32_t *last_low
        int32_t *highs
    ctypedef struct tl_line_target:
        int is_smooth
        void *pixels
        const float *depth
        double depth_bias
        int is_farthest
        int64_t stride_px
    enum:
        TL_N_CLASSES, TL_FLIP
    ctypedef int tl_filter
    ctypedef int tl_wrap
    ctypedef int tl_light_kind
    ctypedef int tl_show
    int TL_MAX_LEVELS
    ctypedef struct tl_texture:
        const uint16_t *texels
        int32_t *offset
        int32_t *width
        int32_t *height
        int n_levels
        tl_filter filter
        tl_wrap wrap_u, wrap_v
    ctypedef struct tl_material:
        float *color
        float *back_color
        float *specular
        float back_side, shininess, cutoff
        int is_unlit
        const tl_texture *texture
    ctypedef struct tl_light:
        tl_light_kind kind
        float *at
        float *color
        float falloff
    ctypedef struct tl_shading:
        const float *normals
        const float *face_normals
        const void *positions
        int is_f64
        const uint8_t *is_turned
        const float *uv
        const float *colors
        const int32_t *material_of
        const tl_material *materials
        int n_materials
        const tl_light *lights
        int n_lights
        float *ambient
        tl_show show
        const tl_texture *matcap
        float[3][4] eye_from
        int has_perspective
        float *eye
        float[4][3] ray
        float *fog_color
        float fog_near, fog_scale, distance_start, distance_scale
        const float *decode
        float *background
        uint8_t *background_bytes
    ctypedef struct tl_valued:
        const double *points_px
        const double *values
        const int32_t *triangles
        int64_t n_points, n_triangles
        double *planes
    ctypedef struct tl_kernels:
        void (*set_inverse_w)(const tl_source *, const float *, int64_t, int64_t, float *) noexcept nogil
        void (*cut_out)(const tl_scene *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, int64_t, int32_t *, float *) noexcept nogil
        void (*shade_samples)(const tl_scene *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, int, int64_t, const int32_t *, const float *, uint8_t *) noexcept nogil
        void (*shade)(const tl_scene *, const tl_window *, const tl_view *, const tl_shading *, const int32_t *, const float *, uint8_t *) noexcept nogil
        tl_vertex_counts (*snap)(const tl_source *, int64_t, int64_t, int, int, tl_vertex *, tl_wide *) noexcept nogil
        tl_vertex_counts (*project)(const tl_source *, int64_t, int64_t, const tl_view *, tl_vertex *, tl_wide *) noexcept nogil
        void (*clip)(const tl_source *, const tl_vertex *, const int32_t *, int64_t, const tl_view *, tl_pieces *) noexcept nogil
        int64_t (*first_bad)(const tl_vertex *, const int32_t *, int64_t) noexcept nogil
        int64_t (*first_bad_row)(const int32_t *, int64_t, int64_t) noexcept nogil
        int64_t (*narrow_triangles)(const int64_t *, int64_t, int64_t, int32_t *) noexcept nogil
        int64_t (*draw)(const tl_scene *, const tl_window *, const tl_target *, tl_share *) noexcept nogil
        int64_t (*count_classes)(const tl_scene *, const tl_window *, const tl_target *, tl_census *) noexcept nogil
        void (*set_flat_depth)(int32_t *, int64_t, int32_t, float, float, float *) noexcept nogil
        int64_t (*bin)(const tl_scene *, const tl_window *, int32_t, int, tl_bins *) noexcept nogil
        void (*list_bins)(const tl_bins *, int64_t, int64_t *, int32_t *) noexcept nogil
        int64_t (*draw_area)(const tl_scene *, const tl_window *, const tl_area *) noexcept nogil
        int64_t (*blend)(const tl_scene *, const tl_window *, const tl_canvas *) noexcept nogil
        void (*barycentric)(const tl_scene *, const tl_window *, const int32_t *, float *) noexcept nogil
        void (*interpolate)(const tl_scene *, const tl_window *, const int32_t *, const float *, int, int, float, float *) noexcept nogil
        void (*paint_flat)(const int32_t *, int64_t, const uint8_t *, int, uint8_t *) noexcept nogil
        void (*paint_gouraud)(const tl_scene *, const tl_window *, const int32_t *, const void *, int, int, void *) noexcept nogil
        void (*composite)(const tl_composite *, int64_t, void *) noexcept nogil
        int64_t (*list_edges)(const tl_scene *, const tl_edge_scratch *, uint64_t *, int64_t *) noexcept nogil
        void (*draw_lines)(const tl_edges *, const tl_window *, const tl_line_target *) noexcept nogil
        void (*list_planes)(const tl_valued *, int64_t, int64_t) noexcept nogil
        void (*fill_planes)(const tl_valued *, const tl_window *, const int32_t *, int, void *) noexcept nogil
        void (*mean_flat)(const int32_t *, int, int64_t, int64_t, const void *, int, int, const tl_transfer *, void *) noexcept nogil
        void (*mean_colors)(const void *, int, int64_t, int64_t, int, int, const tl_transfer *, void *) noexcept nogil

include "_dispatch.pxi"

cdef enum:
    LABEL = 2  # TL_SINK_LABEL

VERTEX_BYTES = sizeof(tl_vertex)
CELL_CLEAR = TL_CELL_CLEAR
AREA_OVERFLOW = TL_AREA_OVERFLOW
MAX_LAYERS = TL_MAX_LAYERS
SCALARS = {np.dtype(np.float32): 0, np.dtype(np.float64): 1, np.dtype(np.int64): 2}  # tl_scalar


cdef inline const void *data(const uint8_t[::1] view) noexcept nogil:
    return &view[0] if view is not None and view.shape[0] > 0 else NULL


def area_stride(int64_t width):
    """Return how many cells `Scene.draw_area` needs for a row of pixels."""
    return tl_area_stride(width)


def blend_cells(int64_t width):
    """Return how many cells `Scene.blend` needs for areas."""
    return tl_blend_cells(width)


def as_bytes(array):
    """Return the memory of a contiguous array as a flat uint8 view."""
    return array.reshape(-1).view(np.uint8)


cdef class View:
    """How clip space maps to pixels."""

    cdef tl_view view

    def __init__(self, viewport, int subpixel_bits, int guard_bits, bint zero_to_one, bint near_clip, bint far_clip):
        self.view.half_width_px, self.view.half_height_px = viewport[0] / 2, viewport[1] / 2
        self.view.guard_band_x, self.view.guard_band_y = (2.0**60 / (side / 2 * 2**guard_bits) for side in viewport)
        self.view.subpixel_bits, self.view.zero_to_one = subpixel_bits, zero_to_one
        self.view.near_clip, self.view.far_clip = near_clip, far_clip

    @property
    def viewport(self):
        """Width and height of the whole picture."""
        return int(2 * self.view.half_width_px), int(2 * self.view.half_height_px)


cdef class Source:
    """The caller's (V, C) vertices, contiguous float32, float64 or int64, and the matrix that takes them to clip space."""

    cdef tl_source source
    cdef object arrays
    cdef readonly bint is_clip_space

    def __init__(self, vertices, matrix=None, bint is_affine=False):
        cdef const uint8_t[::1] raw = as_bytes(vertices)
        cdef const uint8_t[::1] raw_matrix = None if matrix is None else as_bytes(matrix)
        self.arrays = (raw, raw_matrix)
        self.source.data = data(raw)
        self.source.matrix = data(raw_matrix)
        self.source.is_affine = matrix is not None and is_affine
        self.source.scalar = <tl_scalar><int>SCALARS[vertices.dtype]
        self.source.n, self.source.n_components = vertices.shape
        self.is_clip_space = matrix is not None or self.source.n_components == 4

    def snap(self, int64_t first, int64_t end, int subpixel_bits, bint with_depth, uint8_t[::1] records, int64_t[:, ::1] wide):
        """Snap the pixels of vertices [first, end) into records; returns the numbers of bad, wide and clipped vertices."""
        cdef tl_wide *table = <tl_wide *>&wide[0, 0] if wide is not None else NULL
        cdef tl_vertex_counts counts
        with nogil:
            counts = K.snap(&self.source, first, end, subpixel_bits, with_depth, <tl_vertex *>&records[0], table)
        return counts.n_bad, counts.n_wide, counts.n_clipped

    def project(self, int64_t first, int64_t end, View view, uint8_t[::1] records, int64_t[:, ::1] wide):
        """Project and snap vertices [first, end) into records; returns the numbers of bad, wide and clipped vertices."""
        cdef tl_wide *table = <tl_wide *>&wide[0, 0] if wide is not None else NULL
        cdef tl_vertex_counts counts
        with nogil:
            counts = K.project(&self.source, first, end, &view.view, <tl_vertex *>&records[0], table)
        return counts.n_bad, counts.n_wide, counts.n_clipped


cdef class Target:
    """The contiguous buffers of a picture, neither side of it 0, and what becomes of a covered sample."""

    cdef tl_sink sink
    cdef int64_t width, height
    cdef int pixel_bytes
    cdef uint8_t[::1] pixels
    cdef float[:, ::1] depth
    cdef uint64_t[:, ::1] covered
    cdef int sample_bits
    cdef const int32_t[:, ::1] samples
    cdef int32_t flip

    def __init__(self, int sink, pixels, depth, covered, samples=None, bint earlier_wins=False):
        self.sink, self.flip = <tl_sink>sink, TL_FLIP if earlier_wins else 0
        self.height, self.width = pixels.shape
        self.pixel_bytes = pixels.itemsize
        self.pixels, self.depth, self.covered = as_bytes(pixels), depth, covered
        self.samples, self.sample_bits = samples, 0 if samples is None else len(samples).bit_length() - 1

    @staticmethod
    def covered_shape(int64_t height, int64_t width, int64_t n_samples=1):
        """Return the shape of the uint64 scratch that a mask needs: any rows of it are enough for as many of the mask."""
        return height, tl_covered_words(width * n_samples)

    cdef tl_target rows(self, int64_t first_row) noexcept:
        """The buffers from a row on."""
        cdef tl_target t
        memset(&t, 0, sizeof(t))
        t.sink = self.sink
        t.pixels = &self.pixels[first_row * self.width * self.pixel_bytes]
        t.depth = &self.depth[first_row, 0] if self.depth is not None else NULL
        t.covered = &self.covered[first_row, 0] if self.covered is not None else NULL
        t.stride_px = self.width
        t.flip = self.flip
        t.sample_bits = self.sample_bits
        t.samples_fx = &self.samples[0, 0] if self.samples is not None else NULL
        return t


def first_bad_row(const int32_t[:, ::1] triangles, int64_t n_vertices):
    """Return the first row with an index outside ``[0, n_vertices)``, -1 if there is none."""
    cdef int64_t n = triangles.shape[0], row = -1
    if n:
        with nogil:
            row = K.first_bad_row(&triangles[0, 0], n, n_vertices)
    return row


def narrow_triangles(const int64_t[:, ::1] triangles, int64_t n_vertices, int32_t[:, ::1] out):
    """Write the indices as int32; returns the first row with one outside ``[0, n_vertices)``, -1 if there is none."""
    cdef int64_t n = triangles.shape[0], row = -1
    if n:
        with nogil:
            row = K.narrow_triangles(&triangles[0, 0], n, n_vertices, &out[0, 0])
    return row


def set_flat_depth(int32_t[:, ::1] ids, float[:, ::1] out, int64_t first_row, int64_t n_rows, bint earlier_wins, float depth,
                   float background):
    """Write the depth of rows of a picture whose triangles all lie at one; ids as `Target` has them drawn become ids."""
    cdef int64_t n = n_rows * ids.shape[1]
    if n:
        with nogil:
            K.set_flat_depth(&ids[first_row, 0], n, TL_FLIP if earlier_wins else 0, depth, background, &out[first_row, 0])


def first_bad(const uint8_t[::1] records, const int32_t[:, ::1] triangles):
    """Return the lowest index of a vertex in use that has no fixed-point position, -1 if there is none."""
    cdef int64_t n = triangles.shape[0], found = -1
    if n:
        with nogil:
            found = K.first_bad(<const tl_vertex *>&records[0], &triangles[0, 0], n)
    return found


cdef class Pieces:
    """What the clip planes leave of the triangles that they cut."""

    cdef tl_pieces pieces
    cdef readonly object arrays

    def __init__(self, Source source, const uint8_t[::1] records, const int32_t[:, ::1] triangles, View view):
        cdef tl_pieces *p = &self.pieces
        cdef int64_t n = triangles.shape[0]
        cdef uint8_t[::1] vertices
        cdef int64_t[:, ::1] wide
        cdef double[::1] inv_w
        cdef double[:, ::1] weights
        cdef int32_t[:, ::1] corners
        cdef int32_t[::1] owners
        p.vertices = NULL
        p.n_vertices = p.n_pieces = 0
        if n == 0:
            return
        with nogil:
            K.clip(&source.source, <const tl_vertex *>&records[0], &triangles[0, 0], n, &view.view, p)
        if p.n_pieces == 0:
            return
        vertices, wide = np.empty(p.n_vertices * VERTEX_BYTES, np.uint8), np.empty((p.n_vertices, 2), np.int64)
        inv_w, weights = np.empty(p.n_vertices), np.empty((p.n_vertices, 3))
        corners, owners = np.empty((p.n_pieces, 3), np.int32), np.empty(p.n_pieces, np.int32)
        self.arrays = (vertices, wide, inv_w, weights, corners, owners)
        p.vertices, p.wide = <tl_vertex *>&vertices[0], <tl_wide *>&wide[0, 0]
        p.inv_w, p.weights = &inv_w[0], &weights[0, 0]
        p.triangles, p.source = &corners[0, 0], &owners[0]
        with nogil:
            K.clip(&source.source, <const tl_vertex *>&records[0], &triangles[0, 0], n, &view.view, p)

    def __len__(self):
        return self.pieces.n_pieces


cdef class Scene:
    """Snapped vertices and triangles, ready to be drawn or resolved; keeps what it points to alive."""

    cdef tl_scene scene
    cdef int64_t x_px, y_px
    cdef readonly int subpixel_bits
    cdef tl_test test
    cdef object arrays
    cdef readonly View view

    def __init__(
        self, Source source, const uint8_t[::1] records, const int64_t[:, ::1] wide, const int32_t[:, ::1] triangles,
        Pieces pieces, int64_t x_px, int64_t y_px, int subpixel_bits, int cull, int method, int test=0, View view=None,
    ):
        self.view = view
        self.arrays = (source, records, wide, triangles, pieces)
        self.scene.mesh.vertices = <const tl_vertex *>data(records)
        self.scene.mesh.wide = <const tl_wide *>&wide[0, 0] if wide is not None and wide.shape[0] else NULL
        self.scene.mesh.inv_w = NULL
        self.scene.mesh.source = &source.source if source.is_clip_space else NULL
        self.scene.mesh.n_vertices = records.shape[0] // <int64_t>sizeof(tl_vertex)
        self.scene.n_triangles = triangles.shape[0]
        self.scene.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.scene.pieces = &pieces.pieces if pieces is not None and len(pieces) else NULL
        self.scene.cull, self.scene.method, self.scene.first_id = cull, method, 0
        self.x_px, self.y_px, self.subpixel_bits, self.test = x_px, y_px, subpixel_bits, test

    def seen_from(self, int32_t x_fx, int32_t y_fx):
        """Return the same scene with its samples off the centres of the pixels, in sub-pixels."""
        cdef Scene seen = self.copy()
        seen.scene.mesh.sample_x_fx, seen.scene.mesh.sample_y_fx = x_fx, y_fx
        return seen

    def numbered_from(self, int32_t first_id):
        """Return the same scene with other ids in the buffers that `draw` fills: triangle 0 is called `first_id`."""
        cdef Scene named = self.copy()
        named.scene.first_id = first_id
        return named

    def moved(self, int64_t x_px, int64_t y_px):
        """Return the same scene behind a window that begins x_px columns and y_px rows later."""
        cdef Scene part = self.copy()
        part.x_px += x_px
        part.y_px += y_px
        return part

    cdef Scene copy(self):
        cdef Scene other = Scene.__new__(Scene)
        other.scene, other.arrays = self.scene, self.arrays
        other.x_px, other.y_px, other.subpixel_bits, other.test = self.x_px, self.y_px, self.subpixel_bits, self.test
        other.view = self.view
        return other

    cdef tl_window window(self, int64_t first_row, int64_t n_rows, int64_t width) noexcept nogil:
        cdef tl_window w
        w.x_px, w.y_px, w.subpixel_bits = self.x_px, self.y_px + first_row, self.subpixel_bits
        w.width, w.height, w.test = width, n_rows, self.test
        return w

    def guess_layers(self, double n_pixels):
        """Return about how often triangles cover each of n_pixels: from the areas of up to 128 of them, window or not."""
        cdef const tl_vertex *v = self.scene.mesh.vertices
        cdef int64_t n = min(self.scene.n_triangles, 128), i, last = self.scene.mesh.n_vertices - 1
        cdef const int32_t *t
        cdef double unit = 2.0 * 4.0**self.subpixel_bits, area, total = 0
        for i in range(n):
            t = self.scene.triangles + 3 * (i * self.scene.n_triangles // n)
            if not (0 <= t[0] <= last and 0 <= t[1] <= last and 0 <= t[2] <= last):
                return 0.0  # an error that draw finds
            area = (<double>v[t[1]].x_fx - v[t[0]].x_fx) * (<double>v[t[2]].y_fx - v[t[0]].y_fx)
            area -= (<double>v[t[1]].y_fx - v[t[0]].y_fx) * (<double>v[t[2]].x_fx - v[t[0]].x_fx)
            total += min(abs(area) / unit, n_pixels)
        return total * self.scene.n_triangles / (n * n_pixels) if n else 0.0

    def count_classes(self, int sink, int64_t width, int64_t height, const int32_t[:, ::1] samples=None):
        """Count the triangles by the code that draws them into a sink: `tl_census` in ``csrc/topleft.h``.

        Returns the first bad row or -1, and triangles, samples in their boxes, and covered samples of each `tl_class`.
        """
        cdef tl_window window = self.window(0, height, width)
        cdef tl_target target
        cdef tl_census census
        cdef int64_t bad_row
        memset(&census, 0, sizeof(census))
        memset(&target, 0, sizeof(target))
        census.sink = <tl_sink>sink
        if samples is not None:
            target.samples_fx, target.sample_bits = &samples[0, 0], samples.shape[0].bit_length() - 1
        with nogil:
            bad_row = K.count_classes(&self.scene, &window, &target, &census)
        return bad_row, [(census.n[k], census.boxes[k], census.covered[k]) for k in range(TL_N_CLASSES)]

    def draw(self, Target target, int64_t first_row, int64_t n_rows, bint is_first=True, bint is_last=True):
        """Draw rows of a picture, which the first of several scenes clears and the last one finishes.

        Returns -1, or a number that is not negative when a triangle has an index outside the vertices.
        """
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = self.window(first_row, n_rows, target.width)
        cdef tl_share share
        cdef int64_t bad_row
        share.ids = share.others = NULL
        share.first, share.end, share.is_first, share.is_last = 0, self.scene.n_triangles, is_first, is_last
        with nogil:
            bad_row = K.draw(&self.scene, &window, &rows, &share)
        return bad_row

    def draw_share(self, Target target, int64_t first_row, int64_t n_rows, int64_t first, int32_t[::1] others):
        """Clear rows of a picture and draw there the triangles from `first` on for which `others` has room, 16 numbers left.

        What of them lies in other rows is listed in `others`; returns the first bad row or -1, and how many those are.
        """
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = self.window(first_row, n_rows, target.width), picture = self.window(0, target.height, target.width)
        cdef tl_share share
        cdef int64_t bad_row
        share.ids, share.others, share.n_others, share.picture = NULL, &others[0], 0, &picture
        share.first, share.end, share.is_first, share.is_last = first, first + others.shape[0] - 16, True, False
        with nogil:
            bad_row = K.draw(&self.scene, &window, &rows, &share)
        return bad_row, share.n_others

    def draw_listed(self, Target target, int64_t first_row, int64_t n_rows, const int32_t[::1] ids, bint is_last):
        """Draw the triangles listed over what the rows hold."""
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = self.window(first_row, n_rows, target.width)
        cdef tl_share share
        share.ids, share.others = &ids[0] if ids.shape[0] else NULL, NULL
        share.first, share.end, share.is_first, share.is_last = 0, ids.shape[0], False, is_last
        with nogil:
            K.draw(&self.scene, &window, &rows, &share)

    def draw_area(self, float[:, ::1] pixels, uint8_t[::1] cells, int64_t first_row, int64_t n_rows, bint is_wide, bint is_clamped):
        """Write the area that triangles cover of the pixels in rows [first_row, first_row + n_rows).

        `cells`: those of these rows, clear. Returns as `draw` does, or AREA_OVERFLOW when the cells must be wide.
        """
        cdef tl_area target
        cdef tl_window window = self.window(first_row, n_rows, pixels.shape[1])
        cdef int64_t status
        if n_rows == 0 or pixels.shape[1] == 0:
            return -1
        target.pixels, target.stride_px, target.cells = &pixels[first_row, 0], pixels.shape[1], &cells[0]
        target.is_wide, target.is_clamped = is_wide, is_clamped
        with nogil:
            status = K.draw_area(&self.scene, &window, &target)
        return status

    def paint(self, const int32_t[:, ::1] labels, const uint8_t[::1] colors, uint8_t[::1] pixels, int64_t first_row, int64_t n_rows,
              bint is_flat, bint is_u8, int n_channels):
        """Colour the rows [first_row, first_row + n_rows) by their labels."""
        cdef int64_t width = labels.shape[1]
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        cdef tl_window window = self.window(first_row, n_rows, width)
        if width == 0 or n_rows == 0 or self.scene.n_triangles == 0:
            return
        with nogil:
            if is_flat:
                K.paint_flat(&labels[first_row, 0], n_rows * width, <const uint8_t *>data(colors), pixel_bytes,
                             &pixels[first_row * width * pixel_bytes])
            else:
                K.paint_gouraud(&self.scene, &window, &labels[first_row, 0], data(colors), n_channels, is_u8,
                                &pixels[first_row * width * pixel_bytes])

    def blend(self, uint8_t[::1] pixels, int64_t width, int64_t first_row, int64_t n_rows, const uint8_t[::1] colors, int n_channels,
              bint is_u8, bint is_flat, int blend, bint is_premultiplied, const uint8_t[::1] ground, int32_t[::1] packed, int32_t[::1] cells):
        """Blend the colours of triangles into rows [first_row, first_row + n_rows) of a picture, one after the other.

        `ground`: one colour, which the rows get first, or None. `packed`: room for the picture, for uint8 with other than 4 channels; `cells`: clear, for areas. Returns as `draw` does.
        """
        cdef tl_canvas canvas
        cdef tl_window window = self.window(first_row, n_rows, width)
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        cdef int64_t bad_row
        if width == 0 or n_rows == 0 or self.scene.n_triangles == 0:
            return -1
        canvas.pixels, canvas.stride_px = &pixels[first_row * width * pixel_bytes], width
        canvas.colors, canvas.n_channels, canvas.is_u8, canvas.is_flat = data(colors), n_channels, is_u8, is_flat
        canvas.blend, canvas.is_premultiplied, canvas.is_area = <tl_blend>blend, is_premultiplied, cells is not None
        canvas.ground = &ground[0] if ground is not None else NULL
        canvas.packed = &packed[first_row * width] if packed is not None else NULL
        canvas.cells = &cells[0] if cells is not None else NULL
        with nogil:
            bad_row = K.blend(&self.scene, &window, &canvas)
        return bad_row

    def barycentric(self, const int32_t[:, ::1] ids, float[:, :, ::1] out):
        """Write the weights of the three vertices of the triangle at each pixel."""
        cdef tl_window window = self.window(0, ids.shape[0], ids.shape[1])
        if ids.shape[0] and ids.shape[1]:
            with nogil:
                K.barycentric(&self.scene, &window, &ids[0, 0], &out[0, 0, 0])

    def interpolate(self, const int32_t[:, ::1] ids, const float[:, ::1] values, bint per_corner, float background,
                    float[:, :, ::1] out):
        """Write the interpolated values at each pixel; `values` has a row per vertex, or per corner of each triangle."""
        cdef tl_window window = self.window(0, ids.shape[0], ids.shape[1])
        cdef int n_values = out.shape[2]
        if ids.shape[0] and ids.shape[1] and n_values:
            with nogil:
                K.interpolate(&self.scene, &window, &ids[0, 0], &values[0, 0] if values.shape[0] else NULL, n_values,
                              per_corner, background, &out[0, 0, 0])


cdef class Bins:
    """The triangles that reach into each band of 2**band_bits rows of a picture."""

    cdef tl_bins bins
    cdef int64_t[::1] starts
    cdef int32_t[::1] listed
    cdef object room
    cdef readonly int band_bits
    cdef readonly int64_t bad_row, n_bands, n_listed

    def __init__(self, Scene scene, int64_t height, int64_t width, int32_t reach_fx, int band_bits, int32_t[:, ::1] room):
        """`room`: (3, n_triangles + 16). `bad_row` is -1, or a triangle has an index outside the vertices."""
        cdef tl_window window = scene.window(0, height, width)
        self.room, self.band_bits, self.n_bands = room, band_bits, (height + (1 << band_bits) - 1) >> band_bits
        self.starts = np.empty(self.n_bands + 2, np.int64)
        self.bins.n = self.n_listed = 0
        self.bins.ids, self.bins.first_band, self.bins.last_band = &room[0, 0], &room[1, 0], &room[2, 0]
        with nogil:
            self.bad_row = K.bin(&scene.scene, &window, reach_fx, band_bits, &self.bins)
            if self.bad_row < 0:
                K.list_bins(&self.bins, self.n_bands, &self.starts[0], NULL)
                self.n_listed = self.starts[self.n_bands + 1]

    def fill(self, int32_t[::1] listed):
        """Sort the triangles into `listed`, which has room for `n_listed` and one more."""
        self.listed = listed
        with nogil:
            K.list_bins(&self.bins, self.n_bands, &self.starts[0], &listed[0])


def draw_bands(scenes, targets, Bins bins, int64_t first_band, int64_t end_band):
    """Clear and draw bands of several pictures, a scene each, one band of all after the other."""
    cdef Scene scene
    cdef Target target
    cdef tl_target rows
    cdef tl_window window
    cdef tl_share share
    cdef int64_t band, first_row
    cdef list pairs = list(zip(scenes, targets, strict=True))
    share.others, share.first, share.is_first, share.is_last = NULL, 0, True, True
    for band in range(first_band, end_band):
        first_row = band << bins.band_bits
        share.ids = &bins.listed[0] + bins.starts[band]
        share.end = bins.starts[band + 1] - bins.starts[band]
        for scene, target in pairs:
            rows = target.rows(first_row)
            window = scene.window(first_row, min(<int64_t>1 << bins.band_bits, target.height - first_row), target.width)
            with nogil:
                K.draw(&scene.scene, &window, &rows, &share)


def peel(scenes, bins, int32_t[:, :, ::1] ids, float[:, :, ::1] depth, bint is_farthest, int band_bits,
         int64_t first_band, int64_t end_band):
    """Write the nearest layers of all scenes together, as planes (K, H, W), in bands of 2**band_bits rows.

    `bins`: those of each scene, or None, where a band is to look at all triangles. Returns as `Scene.draw` does.
    """
    cdef tl_peeled peeled
    cdef tl_target target
    cdef tl_window window
    cdef tl_share share
    cdef Scene scene
    cdef Bins own
    cdef int64_t band, first_row, height = ids.shape[1], width = ids.shape[2], bad_row = -1
    cdef list pairs = list(zip(scenes, bins, strict=True))
    cdef int64_t i, n = len(pairs)
    peeled.n_layers, peeled.is_farthest = ids.shape[0], is_farthest
    peeled.plane_px = height * width
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px, target.peeled = <tl_sink>TL_SINK_PEEL, width, &peeled
    for band in range(first_band, end_band):
        first_row = band << band_bits
        peeled.ids, peeled.depth = &ids[0, first_row, 0], &depth[0, first_row, 0]
        for i in range(n):
            scene, own = pairs[i]
            share.ids, share.others, share.first, share.end = NULL, NULL, 0, scene.scene.n_triangles
            if own is not None:
                share.ids, share.end = &own.listed[0] + own.starts[band], own.starts[band + 1] - own.starts[band]
            share.is_first, share.is_last = i == 0, i == n - 1
            window = scene.window(first_row, min(<int64_t>1 << band_bits, height - first_row), width)
            with nogil:
                bad_row = K.draw(&scene.scene, &window, &target, &share)
            if bad_row >= 0:
                return bad_row
    return bad_row


def composite(const int32_t[:, :, ::1] ids, int64_t first_row, int64_t n_rows, const uint8_t[::1] colors, bint is_flat, bint is_u8,
              int n_channels, const float[::1] background, uint8_t[::1] pixels):
    """Write what is seen through layers, planes (K, H, W), in rows [first_row, first_row + n_rows) of a picture.

    `colors`: of the triangles, or of the layers of these rows, (K, n_rows, W, n_channels) float32. `background` may be None.
    """
    cdef tl_composite layers
    cdef int64_t width = ids.shape[2], n = n_rows * width
    cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
    if n == 0:
        return
    layers.ids, layers.plane_px, layers.n_layers = &ids[0, first_row, 0], ids.shape[1] * width, ids.shape[0]
    layers.n_channels, layers.is_u8, layers.is_flat, layers.colors = n_channels, is_u8, is_flat, data(colors)
    layers.background = &background[0] if background is not None else NULL
    with nogil:
        K.composite(&layers, n, &pixels[first_row * width * pixel_bytes])


cdef class Transfer:
    """What is averaged of colours with several samples a pixel: their light, or as much of them as their alpha tells."""

    cdef tl_transfer transfer
    cdef object arrays

    def __init__(self, tables, int n_channels, bint is_straight):
        cdef const int32_t[::1] decode
        cdef const uint8_t[::1] encode
        self.transfer.n_channels, self.transfer.is_straight = n_channels, is_straight
        if tables is not None:
            decode, encode = self.arrays = tables
            self.transfer.decode, self.transfer.encode = &decode[0], &encode[0]


cdef class Palette:
    """The colours of triangles, (T[, C]) uint8 or float32, and how those of samples become one."""

    cdef const uint8_t[::1] colors
    cdef int n_channels
    cdef bint is_u8
    cdef Transfer transfer

    def __init__(self, colors, Transfer transfer):
        self.n_channels, self.is_u8, self.transfer = 1 if colors.ndim == 1 else colors.shape[1], colors.dtype == np.uint8, transfer
        if self.is_u8:  # four bytes a colour, aligned
            wide = np.zeros(max(1, len(colors)), np.int32)
            wide.view(np.uint8).reshape(-1, 4)[: len(colors), : self.n_channels] = colors.reshape(len(colors), -1)
            colors = wide
        self.colors = as_bytes(colors)

    cdef void mean(self, const int32_t *labels, int sample_bits, int64_t stride, int64_t n, uint8_t *pixels, int64_t first) noexcept nogil:
        """Write the means of n pixels from the first on: planes of labels lie `stride` apart."""
        cdef const tl_transfer *own = NULL if self.transfer is None else &self.transfer.transfer
        K.mean_flat(labels, sample_bits, stride, n, data(self.colors), self.n_channels, self.is_u8, own,
                    &pixels[first * self.n_channels * (1 if self.is_u8 else 4)])

    def mean_flat(self, const int32_t[:, :, ::1] labels, pixels, int64_t first_row, int64_t n_rows):
        """Write the mean colour of the triangles that the samples see over rows of pixels; labels (S, H, W)."""
        cdef uint8_t[::1] flat = as_bytes(pixels)
        cdef int64_t width = labels.shape[2]
        cdef int sample_bits = int(labels.shape[0]).bit_length() - 1
        if n_rows and width and self.colors.shape[0]:
            with nogil:
                self.mean(&labels[0, first_row, 0], sample_bits, labels.shape[1] * width, n_rows * width, &flat[0], first_row * width)


def fill_bands(scenes, int32_t[:, ::1] labels, Palette palette, pixels, Bins bins, int64_t first_band, int64_t end_band):
    """Write the mean colours of samples over bands of (H, W[, C]) pixels: `scenes` is the scene as each of them sees it.

    `labels`: memory for those of a band, (S, rows * W).
    """
    cdef tl_scene seen[16]
    cdef Scene scene
    cdef tl_target target
    cdef tl_window window
    cdef tl_share share
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int k, n_samples = len(scenes), sample_bits = int(len(scenes)).bit_length() - 1
    cdef int64_t band, first_row, n_rows, height = pixels.shape[0], width = pixels.shape[1]
    for k in range(n_samples):
        scene = scenes[k]
        seen[k] = scene.scene
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px = <tl_sink>LABEL, width
    share.others, share.first, share.is_first, share.is_last = NULL, 0, True, True
    with nogil:
        for band in range(first_band, end_band):
            first_row = band << bins.band_bits
            n_rows = min(<int64_t>1 << bins.band_bits, height - first_row)
            window = scene.window(first_row, n_rows, width)
            share.ids = &bins.listed[0] + bins.starts[band]
            share.end = bins.starts[band + 1] - bins.starts[band]
            for k in range(n_samples):
                target.pixels = &labels[k, 0]
                K.draw(&seen[k], &window, &target, &share)
            palette.mean(&labels[0, 0], sample_bits, labels.shape[1], n_rows * width, &flat[0], first_row * width)


def mean_colors(painted, pixels, int64_t first_row, int64_t n_rows, int n_channels, Transfer transfer):
    """Write the mean of planes of colours (S, H, W[, C]) over rows of pixels."""
    cdef const uint8_t[::1] planes = as_bytes(painted)
    cdef uint8_t[::1] flat = as_bytes(pixels)
    cdef int is_u8 = painted.dtype == np.uint8
    cdef int64_t height = painted.shape[1], width = painted.shape[2], first
    cdef int sample_bits = int(painted.shape[0]).bit_length() - 1
    cdef const tl_transfer *own = NULL if transfer is None else &transfer.transfer
    first = first_row * width * n_channels * (1 if is_u8 else 4)
    if n_rows and width:
        with nogil:
            K.mean_colors(&planes[first], sample_bits, height * width, n_rows * width, n_channels, is_u8, own, &flat[first])


include "_lines.pxi"
include "_shade.pxi"
include "_planes.pxi"
