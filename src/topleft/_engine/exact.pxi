# Triangles whose vertices are not snapped, and the passes that draw them.


cdef class ExactMesh:
    """Vertices in pixels as they are, and triangles: what `SnappedMesh` does that needs no snap."""

    cdef tl_snapped scene
    cdef tl_exact_points points
    cdef int64_t x_px, y_px
    cdef object arrays
    cdef readonly int subpixel_bits

    def __init__(self, const double[:, ::1] points, const int32_t[:, ::1] triangles, how, double band=1.0):
        """`points`: (V, 2) or (V, 3); `how`: that of a view; `band` less than 1 draws wrong pictures, to test bands."""
        cdef int cull
        self.arrays = (points, triangles)
        memset(&self.scene, 0, sizeof(self.scene))
        self.points.points = &points[0, 0] if points.shape[0] else NULL
        self.points.n_points, self.points.stride = points.shape[0], points.shape[1]
        self.points.sample_x_px = self.points.sample_y_px = 0.0
        self.points.band = band
        self.scene.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.scene.n_triangles, self.scene.mesh.n_vertices = triangles.shape[0], points.shape[0]
        self.x_px, self.y_px, self.subpixel_bits, cull, _, _ = how
        self.scene.cull = <tl_cull>cull

    cdef ExactMesh copy(self):
        cdef ExactMesh other = ExactMesh.__new__(ExactMesh)
        other.scene, other.points, other.arrays = self.scene, self.points, self.arrays
        other.x_px, other.y_px, other.subpixel_bits = self.x_px, self.y_px, self.subpixel_bits
        return other

    def seen_from(self, int32_t x_fx, int32_t y_fx):
        """Return the same mesh with its samples off the centres of the pixels, in units of 2**-subpixel_bits px."""
        cdef ExactMesh seen = self.copy()
        seen.points.sample_x_px, seen.points.sample_y_px = x_fx / 2.0**self.subpixel_bits, y_fx / 2.0**self.subpixel_bits
        return seen

    cdef tl_window window(self, int64_t first_row, int64_t n_rows, int64_t width) noexcept nogil:
        cdef tl_window w
        memset(&w, 0, sizeof(w))
        w.x_px, w.y_px, w.subpixel_bits = self.x_px, self.y_px + first_row, self.subpixel_bits
        w.width, w.height, w.pause = width, n_rows, pause_of_thread()
        return w

    def guess_seen(self, int64_t width, int64_t height):
        """Return what `SnappedMesh.guess_seen` does."""
        cdef int64_t n = min(self.scene.n_triangles, 128), i, n_seen = 0, last = self.points.n_points - 1
        cdef const int32_t *t
        cdef const double *a
        cdef const double *b
        cdef const double *c
        cdef double area, total = 0, n_rows = 0, n_pixels = <double>width * height, cols, rows, each
        for i in range(n):
            t = self.scene.triangles + 3 * (i * self.scene.n_triangles // n)
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
        each = self.scene.n_triangles / <double>n
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
        share.first, share.end, share.is_first, share.is_last = 0, self.scene.n_triangles, is_first, is_last
        with nogil:
            bad_row = K.draw_exact(&self.scene, &self.points, &window, &rows, &share, &counts)
        raise_if_given_up()
        return bad_row, (counts.n_triangles, counts.n_on_grid, counts.n_asked, counts.n_turns, counts.n_expansions,
                         counts.n_integers)

    def paint(self, const int32_t[:, ::1] labels, const uint8_t[::1] colors, uint8_t[::1] pixels, int64_t first_row, int64_t n_rows,
              bint is_flat, bint is_u8, int n_channels):
        """Colour the rows [first_row, first_row + n_rows) by their labels, a colour a triangle."""
        cdef int64_t width = labels.shape[1]
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        if width == 0 or n_rows == 0 or self.scene.n_triangles == 0:
            return
        with nogil:
            K.paint_flat(&labels[first_row, 0], n_rows * width, <const uint8_t *>data(colors), pixel_bytes,
                         &pixels[first_row * width * pixel_bytes])
