# Triangles whose vertices are not snapped, and the passes that draw them.


cdef class ExactPieces:
    """What clip planes leave of triangles whose vertices are not snapped."""

    cdef tl_exact_pieces pieces
    cdef readonly object arrays

    def __init__(self, Source source, const double[:, ::1] points, const int32_t[:, ::1] triangles, Viewport viewport):
        cdef double[:, ::1] own_points, weights
        cdef double[::1] inv_w
        cdef int32_t[:, ::1] own_triangles
        cdef int32_t[::1] sources
        memset(&self.pieces, 0, sizeof(self.pieces))
        with nogil:
            K.clip_points(&source.source, &points[0, 0], &triangles[0, 0], triangles.shape[0], &viewport.view, &self.pieces)
        if self.pieces.n_pieces:
            own_points, weights = np.empty((self.pieces.n_points, 3)), np.empty((self.pieces.n_points, 3))
            inv_w, own_triangles = np.empty(self.pieces.n_points), np.empty((self.pieces.n_pieces, 3), np.int32)
            sources = np.empty(self.pieces.n_pieces, np.int32)
            self.arrays = own_points, inv_w, weights, own_triangles, sources
            self.pieces.points, self.pieces.weights, self.pieces.inv_w = &own_points[0, 0], &weights[0, 0], &inv_w[0]
            self.pieces.triangles, self.pieces.source = &own_triangles[0, 0], &sources[0]
            with nogil:
                K.clip_points(&source.source, &points[0, 0], &triangles[0, 0], triangles.shape[0], &viewport.view,
                              &self.pieces)

    def __len__(self):
        return self.pieces.n_pieces

    def join(self, points, triangles):
        """Return points, triangles and names of a mesh, its cut triangles collapsed to one point, and of the pieces."""
        n, is_cut = len(points), np.isnan(points[:, 0])[triangles].any(axis=1)
        own = [np.asarray(array) for array in self.arrays] if len(self) else [np.empty((0, 3)), *[None] * 4]
        if len(self):
            own[0], own[3], own[4] = own[0][: self.pieces.n_points], own[3][: len(self)], own[4][: len(self)]
        collapsed = np.where(is_cut[:, None], np.int32(n), triangles)
        all_points = np.concatenate([points, np.zeros((1, 3)), own[0]])
        if not len(self):
            return all_points, collapsed, np.arange(len(triangles), dtype=np.int32)
        names = np.concatenate([np.arange(len(triangles), dtype=np.int32), own[4]])
        return all_points, np.concatenate([collapsed, own[3] + np.int32(n + 1)]), names


cdef class ExactMesh:
    """Vertices in pixels as they are, and triangles: what `SnappedMesh` does that needs no snap."""

    cdef tl_snapped drawn, given  # what is drawn; the triangles as they were given, with 1/w
    cdef tl_exact_points points
    cdef ExactPieces pieces
    cdef int64_t x_px, y_px
    cdef tl_test test
    cdef object arrays
    cdef readonly int subpixel_bits

    def __init__(self, points_given, const int32_t[:, ::1] triangles_given, how, double band=1.0, Source source=None,
                 ExactPieces pieces=None):
        """`points_given`: (V, 2) or (V, 3); `how`: that of a view; `band` less than 1 draws wrong pictures, to test bands.

        `source`: of clip space, where 1/w comes from; `pieces`: of the triangles that a clip plane cuts.
        """
        cdef int cull, test
        cdef const double[:, ::1] points = points_given
        cdef const int32_t[:, ::1] triangles = triangles_given
        cdef const int32_t[::1] names = None
        memset(&self.given, 0, sizeof(self.given))
        self.given.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.given.n_triangles, self.given.mesh.n_vertices = triangles.shape[0], points.shape[0]
        self.given.mesh.source = &source.source if source is not None and source.is_clip_space else NULL
        self.pieces = pieces
        if pieces is not None:
            points, triangles, names = pieces.join(points_given, np.asarray(triangles_given))
        self.arrays = (points, triangles, names, triangles_given, source)
        memset(&self.drawn, 0, sizeof(self.drawn))
        self.points.points = &points[0, 0] if points.shape[0] else NULL
        self.points.n_points, self.points.stride = points.shape[0], points.shape[1]
        self.points.sample_x_px = self.points.sample_y_px = 0.0
        self.points.band, self.points.n_whole = band, triangles_given.shape[0]
        self.drawn.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.drawn.n_triangles, self.drawn.mesh.n_vertices = triangles.shape[0], points.shape[0]
        self.drawn.names = &names[0] if names is not None and names.shape[0] else NULL
        self.x_px, self.y_px, self.subpixel_bits, cull, _, test = how
        self.drawn.cull, self.test = <tl_cull>cull, <tl_test>test

    cdef ExactMesh copy(self):
        cdef ExactMesh other = ExactMesh.__new__(ExactMesh)
        other.drawn, other.given, other.pieces = self.drawn, self.given, self.pieces
        other.points, other.arrays = self.points, self.arrays
        other.x_px, other.y_px, other.subpixel_bits, other.test = self.x_px, self.y_px, self.subpixel_bits, self.test
        return other

    def named(self, const int32_t[::1] names):
        """Return the same mesh with other ids in the buffers that `draw` fills: triangle i is called names[i]."""
        cdef ExactMesh named = self.copy()
        named.drawn.names = &names[0] if names.shape[0] else NULL
        named.arrays = (self.arrays, names)
        return named

    def seen_from(self, int32_t x_fx, int32_t y_fx):
        """Return the same mesh with its samples off the centres of the pixels, in units of 2**-subpixel_bits px."""
        cdef ExactMesh seen = self.copy()
        seen.points.sample_x_px, seen.points.sample_y_px = x_fx / 2.0**self.subpixel_bits, y_fx / 2.0**self.subpixel_bits
        return seen

    cdef tl_window window(self, int64_t first_row, int64_t n_rows, int64_t width) noexcept nogil:
        cdef tl_window w
        memset(&w, 0, sizeof(w))
        w.x_px, w.y_px, w.subpixel_bits = self.x_px, self.y_px + first_row, self.subpixel_bits
        w.width, w.height, w.test, w.pause = width, n_rows, self.test, pause_of_thread()
        return w

    def guess_seen(self, int64_t width, int64_t height):
        """Return what `SnappedMesh.guess_seen` does."""
        cdef int64_t n = min(self.drawn.n_triangles, 128), i, n_seen = 0, last = self.points.n_points - 1
        cdef const int32_t *t
        cdef const double *a
        cdef const double *b
        cdef const double *c
        cdef double area, total = 0, n_rows = 0, n_pixels = <double>width * height, cols, rows, each
        for i in range(n):
            t = self.drawn.triangles + 3 * (i * self.drawn.n_triangles // n)
            if not (0 <= t[0] <= last and 0 <= t[1] <= last and 0 <= t[2] <= last):
                return 0.0, 0.0, 0.0  # an error that draw finds
            a = self.points.points + <int64_t>t[0] * self.points.stride
            b = self.points.points + <int64_t>t[1] * self.points.stride
            c = self.points.points + <int64_t>t[2] * self.points.stride
            cols = min(max(a[0], b[0], c[0]), <double>(self.x_px + width)) - max(min(a[0], b[0], c[0]), <double>self.x_px)
            rows = min(max(a[1], b[1], c[1]), <double>(self.y_px + height)) - max(min(a[1], b[1], c[1]), <double>self.y_px)
            if not (cols > 0 and rows > 0):
                continue
            n_seen += 1
            n_rows += rows
            area = 0.5 * abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
            total += area if area < cols * rows else cols * rows
        if not n or not n_pixels:
            return 0.0, 0.0, 0.0
        each = self.drawn.n_triangles / <double>n
        return n_seen * each, total * each / n_pixels, n_rows * each

    def draw(self, Target target, int64_t first_row, int64_t n_rows, bint is_first=True, bint is_last=True):
        """Draw as `SnappedMesh.draw` does; a bad row may also be that of a vertex that is not finite."""
        return self.draw_counted(target, first_row, n_rows, is_first, is_last)[0]

    def draw_counted(self, Target target, int64_t first_row, int64_t n_rows, bint is_first=True, bint is_last=True):
        """Return what `draw` does, and `tl_exact_counts`: what was decided how."""
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = self.window(first_row, n_rows, target.width)
        cdef tl_share share = no_share()
        cdef tl_exact_counts counts
        cdef int64_t bad_row
        memset(&counts, 0, sizeof(counts))
        share.first, share.end, share.is_first, share.is_last = 0, self.drawn.n_triangles, is_first, is_last
        with nogil:
            bad_row = K.draw_exact(&self.drawn, &self.points, &window, &rows, &share, &counts)
        raise_if_given_up()
        return bad_row, (counts.n_triangles, counts.n_on_grid, counts.n_asked, counts.n_turns, counts.n_expansions,
                         counts.n_integers)

    def with_inverse_w(self, int64_t n_pixels, empty=None):
        """Return the same mesh: 1/w is computed a triangle at a time."""
        return self

    def weigh(self, const int32_t[:, ::1] ids, const float[:, ::1] values, int n_values, bint per_corner, float background,
              float[:, :, ::1] out):
        """Write weights, or values where they are given, at each pixel."""
        cdef tl_window window = self.window(0, ids.shape[0], ids.shape[1])
        cdef const tl_exact_pieces *pieces = &self.pieces.pieces if self.pieces is not None else NULL
        if ids.shape[0] and ids.shape[1] and n_values:
            with nogil:
                K.weigh_exact(&self.given, &self.points, pieces, &window, &ids[0, 0],
                              &values[0, 0] if values is not None and values.shape[0] else NULL, n_values, per_corner,
                              background, &out[0, 0, 0])

    def barycentric(self, const int32_t[:, ::1] ids, float[:, :, ::1] out):
        """Write the weights of the three vertices of the triangle at each pixel."""
        self.weigh(ids, None, 3, False, 0.0, out)

    def interpolate(self, const int32_t[:, ::1] ids, const float[:, ::1] values, bint per_corner, float background,
                    float[:, :, ::1] out):
        """Write the interpolated values at each pixel, as `SnappedMesh.interpolate` does."""
        self.weigh(ids, values, out.shape[2], per_corner, background, out)

    def paint(self, const int32_t[:, ::1] labels, const uint8_t[::1] colors, uint8_t[::1] pixels, int64_t first_row, int64_t n_rows,
              bint is_flat, bint is_u8, int n_channels):
        """Colour the rows [first_row, first_row + n_rows) by their labels, a colour a triangle."""
        cdef int64_t width = labels.shape[1]
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        if width == 0 or n_rows == 0 or self.drawn.n_triangles == 0:
            return
        with nogil:
            K.paint_flat(&labels[first_row, 0], n_rows * width, <const uint8_t *>data(colors), pixel_bytes,
                         &pixels[first_row * width * pixel_bytes])
