# Describes the input and output of a pass: viewport, vertices, buffers of pixels, indices, clipped pieces.

cdef enum:
    VERTEX_BLOCK_BITS = 4
    VERTEX_BLOCK = 1 << VERTEX_BLOCK_BITS  # vertices that are snapped together when some of them are needed: whole vectors


cdef class Viewport:
    """How clip space maps to pixels."""

    cdef tl_view view

    def __init__(self, size: tuple[int, int], int subpixel_bits, int guard_bits, bint zero_to_one, bint near_clip,
                 bint far_clip):
        self.view.half_width_px, self.view.half_height_px = size[0] / 2, size[1] / 2
        self.view.guard_band_x, self.view.guard_band_y = (2.0**60 / (side / 2 * 2**guard_bits) for side in size)
        self.view.subpixel_bits, self.view.zero_to_one = subpixel_bits, zero_to_one
        self.view.near_clip, self.view.far_clip = near_clip, far_clip

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the whole picture."""
        return int(2 * self.view.half_width_px), int(2 * self.view.half_height_px)


cdef object as_float32(const double[:, ::1] matrix):
    """A (4, 4) matrix in float32."""
    cdef float[:, ::1] rounded = np.empty((4, 4), np.float32)
    cdef int i, j
    for i in range(4):
        for j in range(4):
            rounded[i, j] = <float>matrix[i, j]
            if isinf(rounded[i, j]):
                raise ValueError("transform must fit float32, because the vertices are float32; pass float64 vertices")
    return rounded.base


cdef inline tl_projected points_to(double *points) noexcept nogil:
    """The output of vertices that are not snapped."""
    cdef tl_projected out
    memset(&out, 0, sizeof(out))
    out.points = points
    return out


cdef tl_projected projected_to(vertices: Array):
    """Return `tl_projected` of records, or of points (V, PLACED) float64."""
    cdef tl_projected out = points_to(NULL)
    cdef const uint8_t[::1] raw = as_bytes(vertices)
    if vertices.dtype == np.float64:
        out.points = <double *>data(raw)
    else:
        out.records = <tl_vertex *>data(raw)
    return out


cdef class Source:
    """The caller's (V, C) vertices, contiguous float32, float64 or int64, and their matrix to clip space."""

    cdef tl_source source
    cdef object arrays
    cdef readonly bint is_clip_space, is_affine
    cdef readonly object matrix  #: Array | None

    def __init__(self, vertices: Array, matrix: Array | None = None, bint is_affine=False):
        """`matrix`: finite, (4, 4); it is rounded to the dtype of the vertices."""
        cdef const uint8_t[::1] raw = as_bytes(vertices)
        if matrix is not None:
            matrix = np.ascontiguousarray(matrix, np.float64)
            if vertices.dtype == np.float32:
                matrix = as_float32(matrix)
        cdef const uint8_t[::1] raw_matrix = None if matrix is None else as_bytes(matrix)
        self.arrays, self.matrix = (raw, raw_matrix), matrix
        self.source.data = data(raw)
        self.source.matrix = data(raw_matrix)
        self.source.is_affine = self.is_affine = matrix is not None and is_affine
        self.source.scalar = <tl_scalar><int>SCALARS[vertices.dtype]
        self.source.n, self.source.n_components = vertices.shape
        self.is_clip_space = matrix is not None or self.source.n_components == 4

    def snap(self, int64_t first, int64_t end, int subpixel_bits, bint with_depth, uint8_t[::1] records,
             int64_t[:, ::1] wide or None) -> tuple[int, int, int]:
        """The kernel `snap`. Returns the numbers of bad, wide and clipped vertices."""
        cdef tl_wide *table = <tl_wide *>&wide[0, 0] if wide is not None else NULL
        cdef tl_vertex_counts counts
        if end - first == self.source.n < HELD_VERTICES:
            counts = K.snap(&self.source, first, end, subpixel_bits, with_depth, <tl_vertex *>&records[0], table)
        else:
            with nogil:
                counts = K.snap(&self.source, first, end, subpixel_bits, with_depth, <tl_vertex *>&records[0], table)
        return counts.n_bad, counts.n_wide, counts.n_clipped

    def take(self, int64_t first, int64_t end, double[:, ::1] points or None, int bits=-1) -> int:
        """The kernel `take_points`."""
        cdef int64_t n_bad
        with nogil:
            n_bad = K.take_points(&self.source, first, end, bits, &points[0, 0] if points is not None else NULL)
        return n_bad

    def project(self, int64_t first, int64_t end, Viewport viewport, vertices: Array,
                int64_t[:, ::1] wide or None) -> tuple[int, int, int]:
        """The kernel `project`. `vertices`: records, or points (V, PLACED). Returns as `snap` does."""
        cdef tl_projected out = projected_to(vertices)
        cdef tl_vertex_counts counts
        out.wide = <tl_wide *>&wide[0, 0] if wide is not None else NULL
        if end - first == self.source.n < HELD_VERTICES:
            counts = K.project(&self.source, first, end, &viewport.view, &out)
        else:
            with nogil:
                counts = K.project(&self.source, first, end, &viewport.view, &out)
        return counts.n_bad, counts.n_wide, counts.n_clipped

    def project_blocks(self, const uint8_t[::1] is_used, Viewport viewport,
                       uint8_t[::1] records) -> tuple[int, int, int]:
        """Project and snap the blocks of VERTEX_BLOCK vertices that are used; returns as `project` does."""
        cdef int64_t i = 0, end, n = is_used.shape[0], n_bad = 0, n_wide = 0, n_clipped = 0
        cdef tl_projected out
        cdef tl_vertex_counts counts
        memset(&out, 0, sizeof(out))
        out.records = <tl_vertex *>&records[0]
        with nogil:
            while i < n:
                end = i
                while end < n and is_used[end]:
                    end += 1
                if end > i:
                    counts = K.project(&self.source, i * VERTEX_BLOCK, min(end * VERTEX_BLOCK, self.source.n), &viewport.view, &out)
                    n_bad += counts.n_bad
                    n_wide += counts.n_wide
                    n_clipped += counts.n_clipped
                i = end + 1
        return n_bad, n_wide, n_clipped


cdef class Target:
    """The contiguous buffers of a picture, neither side of it 0, and the sink of its covered samples."""

    cdef readonly int sink
    cdef int64_t width, height
    cdef int pixel_bytes
    cdef uint8_t[::1] pixels
    cdef float[:, ::1] depth
    cdef uint64_t[:, ::1] covered
    cdef int sample_bits
    cdef const int32_t[:, ::1] samples
    cdef int32_t flip
    cdef float[:, ::1] bounds

    def __init__(self, int sink, pixels: Array, depth: F32 | None, covered: U64 | None, samples: I32 | None = None,
                 bint earlier_wins=False, bounds: F32 | None = None):
        """`bounds`: `bounds_shape` float32: large triangles and clusters that lie behind them are skipped."""
        self.sink, self.flip, self.bounds = sink, TL_FLIP if earlier_wins else 0, bounds
        self.height, self.width = pixels.shape
        self.pixel_bytes = pixels.itemsize
        self.pixels, self.depth, self.covered = as_bytes(pixels), depth, covered
        self.samples, self.sample_bits = samples, 0 if samples is None else len(samples).bit_length() - 1

    @staticmethod
    def covered_shape(int64_t height, int64_t width, int64_t n_samples=1) -> tuple[int, int]:
        """Return the shape of the uint64 scratch of a mask: n rows of it suffice for any n rows of the mask."""
        return height, tl_covered_words(width * n_samples)

    @staticmethod
    def bounds_shape(int64_t height, int64_t width) -> tuple[int, int]:
        """Return the shape of the float32 scratch that bounds of depth take."""
        return height, tl_segments(width)

    def keep_bounds(self, float[:, ::1] bounds):
        """Keep bounds of depth in `bounds_shape` float32, from the next clear on."""
        self.bounds = bounds

    cdef tl_target rows(self, int64_t first_row) noexcept:
        """The buffers from a row on."""
        cdef tl_target t
        memset(&t, 0, sizeof(t))
        t.sink = <tl_sink>self.sink
        t.pixels = &self.pixels[first_row * self.width * self.pixel_bytes]
        t.depth = &self.depth[first_row, 0] if self.depth is not None else NULL
        t.covered = &self.covered[first_row, 0] if self.covered is not None else NULL
        t.stride_px = self.width
        t.flip = self.flip
        t.bounds = &self.bounds[first_row, 0] if self.bounds is not None else NULL
        t.sample_bits = self.sample_bits
        t.samples_fx = &self.samples[0, 0] if self.samples is not None else NULL
        return t


def first_bad_row(const int32_t[:, ::1] triangles, int64_t n_vertices) -> int:
    """The kernel `first_bad_row`."""
    cdef int64_t n = triangles.shape[0], row = -1
    if 0 < n < HELD_VERTICES:
        row = K.first_bad_row(&triangles[0, 0], n, n_vertices)
    elif n:
        with nogil:
            row = K.first_bad_row(&triangles[0, 0], n, n_vertices)
    return row


def narrow_triangles(const int64_t[:, ::1] triangles, int64_t n_vertices, int32_t[:, ::1] out) -> int:
    """The kernel `narrow_triangles`."""
    cdef int64_t n = triangles.shape[0], row = -1
    if 0 < n < HELD_VERTICES:
        row = K.narrow_triangles(&triangles[0, 0], n, n_vertices, &out[0, 0])
    elif n:
        with nogil:
            row = K.narrow_triangles(&triangles[0, 0], n, n_vertices, &out[0, 0])
    return row


def set_flat_depth(int32_t[:, ::1] ids, float[:, ::1] out, int64_t first_row, int64_t n_rows, bint earlier_wins,
                   float depth, float background):
    """Write an equal depth for all triangles in rows of a picture; labels, as drawn to a `Target`, become ids."""
    cdef int64_t n = n_rows * ids.shape[1]
    if n:
        with nogil:
            K.set_flat_depth(&ids[first_row, 0], n, TL_FLIP if earlier_wins else 0, depth, background, &out[first_row, 0])


def first_bad(const uint8_t[::1] records, const int32_t[:, ::1] triangles) -> int:
    """The kernel `first_bad`."""
    cdef int64_t n = triangles.shape[0], n_vertices = records.shape[0] // <int64_t>sizeof(tl_vertex), bad = -1
    if n and n_vertices:
        with nogil:
            bad = K.first_bad(<const tl_vertex *>&records[0], n_vertices, &triangles[0, 0], n)
    return bad


cdef class Pieces:
    """The pieces of triangles that clip planes cut."""

    cdef tl_pieces pieces
    cdef readonly object arrays  #: tuple[Any, ...] | None

    def __init__(self, Source source, vertices: Array, const int32_t[:, ::1] triangles, Viewport viewport,
                 const int32_t[::1] ids=None):
        """`vertices`: records, or points (V, PLACED) that are not snapped.

        `ids`: the triangles that may be cut, ascending; None: all triangles.
        """
        cdef tl_pieces *p = &self.pieces
        cdef tl_projected projected = projected_to(vertices)
        cdef int64_t n = triangles.shape[0] if ids is None else ids.shape[0]
        cdef const int32_t *listed = &ids[0] if ids is not None and n else NULL
        cdef bint is_snapped = projected.points == NULL
        cdef uint8_t[::1] records
        cdef int64_t[:, ::1] wide
        cdef double[:, ::1] points, weights
        cdef double[::1] inv_w
        cdef int32_t[:, ::1] corners
        cdef int32_t[::1] owners
        memset(p, 0, sizeof(self.pieces))
        if n == 0:
            return
        with nogil:
            K.clip(&source.source, &projected, &triangles[0, 0], listed, n, &viewport.view, p)
        if p.n_pieces == 0:
            return
        if p.n_vertices >= 1 << 31:
            raise MemoryError(f"triangles cut by planes have {p.n_vertices:,} corners, and int32 counts 2,147,483,647")
        records = wide = points = None
        if is_snapped:
            records, wide = np.empty(p.n_vertices * VERTEX_BYTES, np.uint8), np.empty((p.n_vertices, 2), np.int64)
            p.vertices, p.wide = <tl_vertex *>&records[0], <tl_wide *>&wide[0, 0]
        else:
            points = np.empty((p.n_vertices, 3))
            p.points = &points[0, 0]
        inv_w, weights = np.empty(p.n_vertices), np.empty((p.n_vertices, 3))
        corners, owners = np.empty((p.n_pieces, 3), np.int32), np.empty(p.n_pieces, np.int32)
        first = tuple(map(np.asarray, (records, wide))) if is_snapped else (np.asarray(points), None)
        self.arrays = first + tuple(map(np.asarray, (inv_w, weights, corners, owners)))
        p.inv_w, p.weights = &inv_w[0], &weights[0, 0]
        p.triangles, p.source = &corners[0, 0], &owners[0]
        with nogil:
            K.clip(&source.source, &projected, &triangles[0, 0], listed, n, &viewport.view, p)

    def __len__(self) -> int:
        return self.pieces.n_pieces
