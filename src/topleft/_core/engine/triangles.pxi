# Snapped triangles, and the passes that draw them: whole, by bands of rows, in layers.


cdef inline tl_slice no_slice() noexcept nogil:
    """An empty slice, without clusters or lists."""
    cdef tl_slice slice
    memset(&slice, 0, sizeof(slice))
    return slice


cdef class SnappedMesh:
    """Snapped vertices and triangles, ready to be drawn or resolved; keeps its arrays alive."""

    cdef tl_snapped snapped
    cdef int64_t x_px, y_px
    cdef readonly int subpixel_bits
    cdef tl_test test
    cdef object arrays
    cdef readonly Viewport viewport
    cdef readonly UnsnappedPoints exact  # vertices that are not snapped; None: they are
    cdef const uint8_t[::1] is_used  # the blocks of vertices that have been snapped; None: all

    def __init__(self, Source source, const uint8_t[::1] records, const int64_t[:, ::1] wide or None,
                 const int32_t[:, ::1] triangles, Pieces pieces or None, how: tuple[int, int, int, int, int, int],
                 Viewport viewport or None, const uint8_t[::1] is_used=None, UnsnappedPoints exact=None):
        """`how`: of `topleft._core.raster.view.RasterState`; with `exact` there are no records."""
        cdef int test
        self.viewport, self.is_used, self.exact = viewport, is_used, exact
        self.arrays = (source, records, wide, triangles, pieces)
        self.snapped.mesh.vertices = <const tl_vertex *>data(records)
        self.snapped.mesh.wide = <const tl_wide *>&wide[0, 0] if wide is not None and wide.shape[0] else NULL
        self.snapped.mesh.inv_w = NULL
        self.snapped.mesh.source = &source.source if source.is_clip_space else NULL
        self.snapped.mesh.n_vertices = records.shape[0] // <int64_t>sizeof(tl_vertex)
        self.snapped.mesh.exact = NULL
        if exact is not None:
            self.snapped.mesh.exact, self.snapped.mesh.n_vertices = &exact.points, exact.n_vertices
        self.snapped.n_triangles = triangles.shape[0]
        self.snapped.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.snapped.pieces = &pieces.pieces if pieces is not None and len(pieces) else NULL
        self.snapped.first_id, self.snapped.names = 0, NULL
        self.x_px, self.y_px, self.subpixel_bits, self.snapped.cull, self.snapped.method, test = how
        self.test = <tl_test>test

    def __reduce__(self):
        raise TypeError("a drawn mesh refers to memory of this process and is not pickled or copied deeply: take "
                        "its arrays, such as .triangle and .depth")

    @property
    def n_triangles(self) -> int:
        """How many triangles the mesh has, before clipping."""
        return self.snapped.n_triangles

    def at_sample(self, int32_t x_fx, int32_t y_fx) -> SnappedMesh:
        """Return the mesh with its samples off the centres of the pixels, in sub-pixels."""
        if self.snapped.mesh.sample_x_fx == x_fx and self.snapped.mesh.sample_y_fx == y_fx:
            return self
        cdef SnappedMesh seen = self.copy()
        seen.snapped.mesh.sample_x_fx, seen.snapped.mesh.sample_y_fx = x_fx, y_fx
        return seen

    def numbered_from(self, int32_t first_id) -> SnappedMesh:
        """Return the mesh with ids that begin at `first_id` in the buffers that `draw` fills."""
        cdef SnappedMesh named = self.copy()
        named.snapped.first_id = first_id
        return named

    def named(self, const int32_t[::1] names) -> SnappedMesh:
        """Return the mesh with the id names[i] for triangle i in the buffers that `draw` fills."""
        cdef SnappedMesh named = self.copy()
        named.snapped.names = &names[0] if names.shape[0] else NULL
        named.arrays = (self.arrays, names)
        return named

    @property
    def is_named(self) -> bool:
        """Whether buffers hold other ids than the indices of triangles."""
        return self.snapped.names != NULL or self.snapped.first_id != 0

    def moved(self, int64_t x_px, int64_t y_px) -> SnappedMesh:
        """Return the mesh in a window that begins x_px columns and y_px rows later."""
        cdef SnappedMesh part = self.copy()
        part.x_px += x_px
        part.y_px += y_px
        return part

    @property
    def can_find_inverse_w(self) -> bool:
        """Whether shading can compute 1/w of visible vertices from their positions."""
        cdef const tl_source *source = self.snapped.mesh.source
        return source != NULL and source.matrix != NULL

    def with_inverse_w(self, int64_t n_pixels, empty: Callable[..., Array] = np.empty) -> SnappedMesh:
        """Return the mesh with 1/w of all vertices computed, where `n_pixels` are enough to repay it.

        `empty(shape, dtype)` allocates the array.
        """
        cdef const tl_source *source = self.snapped.mesh.source
        cdef double[::1] inv_w
        cdef SnappedMesh other
        if source == NULL or source.is_affine or self.snapped.mesh.inv_w != NULL or self.snapped.mesh.n_vertices > 2 * n_pixels:
            return self
        inv_w = empty((max(1, self.snapped.mesh.n_vertices),), np.float64)
        with nogil:
            K.inverse_ws(source, 0, self.snapped.mesh.n_vertices, &inv_w[0])
        other = self.copy()
        other.snapped.mesh.inv_w = &inv_w[0]
        other.arrays = (self.arrays, inv_w)
        return other

    cdef SnappedMesh copy(self):
        cdef SnappedMesh other = SnappedMesh.__new__(SnappedMesh)
        other.snapped, other.arrays = self.snapped, self.arrays
        other.x_px, other.y_px, other.subpixel_bits, other.test = self.x_px, self.y_px, self.subpixel_bits, self.test
        other.viewport, other.is_used, other.exact = self.viewport, self.is_used, self.exact
        return other

    cdef const tl_view *clip_view(self) noexcept nogil:
        """How clip space maps to pixels; NULL where vertices are in pixels."""
        return &self.viewport.view if self.viewport is not None else NULL

    cdef tl_window window(self, int64_t first_row, int64_t n_rows, int64_t width) noexcept nogil:
        cdef tl_window w
        w.x_px, w.y_px, w.subpixel_bits = self.x_px, self.y_px + first_row, self.subpixel_bits
        w.width, w.height, w.test, w.pause = width, n_rows, self.test, pause_of_thread()
        return w

    def guess_seen(self, int64_t width, int64_t height) -> tuple[float, float, float]:
        """Estimate how many triangles reach into the picture, how often they cover each pixel, and the sum of their rows.

        From the boxes and areas of up to 128 triangles; a triangle with a vertex that is wide or outside of a clip plane
        counts as if it covered the picture.
        """
        cdef const tl_vertex *v = self.snapped.mesh.vertices
        cdef const int32_t *t = self.snapped.triangles
        cdef const int32_t *corners
        cdef const double *points = NULL
        cdef int64_t n_triangles = self.snapped.n_triangles, last = self.snapped.mesh.n_vertices - 1, n, i, k, n_seen = 0, stride = 0
        cdef double left = self.x_px, top = self.y_px, right = left + width, bottom = top + height, cols, rows
        cdef double area, total = 0, n_rows = 0, n_pixels = <double>width * height, each, unit = 2.0**-self.subpixel_bits
        cdef double x[3]
        cdef double y[3]
        cdef bint is_wide
        cdef int32_t at
        if self.exact is not None:
            t, n_triangles, last = self.exact.points.triangles, self.exact.points.n_triangles, self.exact.points.n_points - 1
            points, stride = self.exact.points.points, self.exact.points.stride
        n = min(n_triangles, 128)
        for i in range(n):
            corners, is_wide = t + 3 * (i * n_triangles // n), False
            for k in range(3):
                at = corners[k]  # read once: another thread may write it
                if not 0 <= at <= last:
                    return 0.0, 0.0, 0.0  # an error that draw finds
                if points != NULL:
                    x[k], y[k] = points[at * stride], points[at * stride + 1]
                else:
                    x[k], y[k] = v[at].x_fx * unit, v[at].y_fx * unit
                    is_wide = is_wide or v[at].x_fx == TL_SPECIAL
            cols = min(max(x[0], x[1], x[2]), right) - max(min(x[0], x[1], x[2]), left)
            rows = min(max(y[0], y[1], y[2]), bottom) - max(min(y[0], y[1], y[2]), top)
            if is_wide:
                n_seen += 1
                total += n_pixels
                n_rows += height
            elif cols > 0 and rows > 0:
                n_seen += 1
                n_rows += rows
                area = 0.5 * abs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]))
                total += area if area < cols * rows else cols * rows
        if not n or not n_pixels:
            return 0.0, 0.0, 0.0
        each = n_triangles / <double>n
        return n_seen * each, total * each / n_pixels, n_rows * each

    def count_classes(self, int sink, int64_t width, int64_t height,
                      const int32_t[:, ::1] samples=None) -> tuple[int, list[tuple[int, float, float]]]:
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
            bad_row = K.count_classes(&self.snapped, &window, &target, &census)
        raise_if_given_up()
        return bad_row, [(census.n[k], census.boxes[k], census.covered[k]) for k in range(TL_N_CLASSES)]

    def drop_sides(self, const uint8_t[::1] is_single, int64_t first, int64_t end, int32_t[:, ::1] triangles):
        """The kernel `drop_sides`."""
        if end > first:
            with nogil:
                K.drop_sides(&self.snapped, &is_single[0], first, end, &triangles[0, 0])

    def draw(self, Target target, int64_t first_row, int64_t n_rows, bint is_first=True, bint is_last=True) -> int:
        """Draw rows of a picture; the first of several meshes clears them, the last mesh finishes them.

        Returns -1, or a number that is not negative when a triangle has an index outside the vertices.
        """
        cdef tl_slice slice = no_slice()
        slice.end, slice.is_first, slice.is_last = self.snapped.n_triangles, is_first, is_last
        return self.draw_rows(target, first_row, n_rows, &slice)

    cdef int64_t draw_rows(self, Target target, int64_t first_row, int64_t n_rows, tl_slice *slice) except? -2:
        cdef tl_target rows = target.rows(first_row)
        cdef tl_window window = self.window(first_row, n_rows, target.width)
        cdef int64_t bad_row
        if n_rows == target.height and (n_rows * target.width + 64) * self.snapped.n_triangles < HELD_DRAWN_PX:
            bad_row = K.draw_mesh(&self.snapped, &window, &rows, slice)
        else:
            with nogil:
                bad_row = K.draw_mesh(&self.snapped, &window, &rows, slice)
        raise_if_given_up()
        return bad_row

    def draw_slice(self, Target target, int64_t first_row, int64_t n_rows, int64_t first,
                   int32_t[::1] outside) -> tuple[int, int]:
        """Clear rows of a picture and draw the triangles from `first` on, as many as `outside` has room for, less 16.

        `outside` lists the triangles that reach other rows; returns the first bad row or -1, and how many are listed.
        """
        cdef tl_window picture = self.window(0, target.height, target.width)
        cdef tl_slice slice = no_slice()
        cdef int64_t bad_row
        slice.outside, slice.picture = &outside[0], &picture
        slice.first, slice.end, slice.is_first = first, first + outside.shape[0] - 16, True
        bad_row = self.draw_rows(target, first_row, n_rows, &slice)
        return bad_row, slice.n_outside

    def draw_listed(self, Target target, int64_t first_row, int64_t n_rows, const int32_t[::1] ids, bint is_last):
        """Draw the listed triangles over the rows."""
        cdef tl_slice slice = no_slice()
        slice.ids, slice.end, slice.is_last = &ids[0] if ids.shape[0] else NULL, ids.shape[0], is_last
        self.draw_rows(target, first_row, n_rows, &slice)

    def draw_area(self, float[:, ::1] pixels, uint8_t[::1] cells, int64_t first_row, int64_t n_rows, bint is_wide,
                  bint is_clamped, Bins bins=None) -> int:
        """Write the area that triangles cover of the pixels in rows [first_row, first_row + n_rows).

        `cells`: of the rows, clear. `bins`: the rows are a band of it; None: all triangles are tested. Returns as `draw`
        does, or AREA_OVERFLOW when the cells must be wide.
        """
        cdef tl_slice slice = no_slice()
        cdef tl_area target
        cdef tl_window window = self.window(first_row, n_rows, pixels.shape[1])
        cdef int64_t status
        if n_rows == 0 or pixels.shape[1] == 0:
            return -1
        target.pixels, target.stride_px, target.cells = &pixels[first_row, 0], pixels.shape[1], &cells[0]
        target.is_wide, target.is_clamped = is_wide, is_clamped
        slice.end = self.snapped.n_triangles
        if bins is not None:
            bins.take(&slice, first_row >> bins.band_bits)
        with nogil:
            status = K.draw_area(&self.snapped, &window, &slice, &target)
        raise_if_given_up()
        return status

    def paint(self, const int32_t[:, ::1] labels, const uint8_t[::1] colors, uint8_t[::1] pixels, int64_t first_row,
              int64_t n_rows, bint is_flat, bint is_u8, int n_channels, const uint8_t[::1] ground=None):
        """Colour the rows [first_row, first_row + n_rows) by their labels; `ground`, with flat colours: the background."""
        cdef int64_t width = labels.shape[1]
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        cdef const void *under = data(ground) if ground is not None else NULL
        cdef tl_window window = self.window(first_row, n_rows, width)
        if width == 0 or n_rows == 0 or self.snapped.n_triangles == 0:
            return
        with nogil:
            if is_flat:
                K.paint_flat(&labels[first_row, 0], n_rows * width, <const uint8_t *>data(colors), pixel_bytes,
                             <const uint8_t *>under, &pixels[first_row * width * pixel_bytes])
            else:
                K.paint_gouraud(&self.snapped, &window, &labels[first_row, 0], data(colors), n_channels, is_u8,
                                &pixels[first_row * width * pixel_bytes])

    def blend(self, uint8_t[::1] pixels, int64_t width, int64_t first_row, int64_t n_rows, const uint8_t[::1] colors,
              int n_channels, bint is_u8, bint is_flat, int blend, bint is_premultiplied, int64_t band_rows,
              const uint8_t[::1] ground or None, int32_t[::1] packed or None, int32_t[::1] cells or None) -> int:
        """Blend the colours of triangles, in their order, into rows [first_row, first_row + n_rows) of a picture.

        `band_rows`: rows of a band, which is finished before the next. `ground`: the colour that the rows are cleared to,
        or None. `packed`: room for a band, for uint8 with other than 4 channels; `cells`: clear, for areas.
        Returns as `draw` does.
        """
        cdef tl_canvas canvas
        cdef tl_window window = self.window(first_row, n_rows, width)
        cdef int pixel_bytes = n_channels if is_u8 else 4 * n_channels
        cdef int64_t bad_row
        if width == 0 or n_rows == 0 or self.snapped.n_triangles == 0:
            return -1
        canvas.pixels, canvas.stride_px = &pixels[first_row * width * pixel_bytes], width
        canvas.colors, canvas.n_channels, canvas.is_u8, canvas.is_flat = data(colors), n_channels, is_u8, is_flat
        canvas.blend, canvas.is_premultiplied, canvas.is_area = <tl_blend>blend, is_premultiplied, cells is not None
        canvas.band_rows = band_rows
        canvas.ground = &ground[0] if ground is not None else NULL
        canvas.packed = &packed[0] if packed is not None else NULL
        canvas.cells = &cells[0] if cells is not None else NULL
        with nogil:
            bad_row = K.blend(&self.snapped, &window, &canvas)
        raise_if_given_up()
        return bad_row

    def is_large_shapes(self, int64_t width, int64_t height, int n_samples) -> bool:
        """Return whether to fill flat colours row by row: few snapped triangles for the size of the picture."""
        cdef int64_t n = self.snapped.n_triangles + (self.snapped.pieces.n_pieces if self.snapped.pieces != NULL else 0)
        return self.snapped.mesh.exact == NULL and tl_is_large_shapes(n, n_samples, width, height)

    def fill_large_shapes(self, pixels: Array, int64_t first_row, int64_t n_rows, colors: Array, int blend,
                          bint is_premultiplied, Transfer transfer or None, const uint8_t[::1] ground,
                          const int32_t[:, ::1] samples_fx) -> int:
        """The kernel `fill_large_shapes`."""
        cdef tl_canvas canvas
        cdef int64_t bad_row, width = pixels.shape[1]
        cdef tl_window window = self.window(first_row, n_rows, width)
        cdef uint8_t[::1] flat = as_bytes(pixels)
        cdef const uint8_t[::1] palette = as_bytes(colors)
        cdef const tl_transfer *c_transfer = NULL if transfer is None else &transfer.transfer
        cdef int sample_bits = int(samples_fx.shape[0]).bit_length() - 1
        memset(&canvas, 0, sizeof(canvas))
        canvas.n_channels, canvas.is_u8 = 1 if pixels.ndim == 2 else pixels.shape[2], pixels.dtype == np.uint8
        canvas.pixels = &flat[first_row * width * canvas.n_channels * (1 if canvas.is_u8 else 4)]
        canvas.stride_px, canvas.colors, canvas.ground, canvas.is_flat = width, data(palette), &ground[0], True
        canvas.blend, canvas.is_premultiplied = <tl_blend>blend, is_premultiplied
        with nogil:
            bad_row = K.fill_large_shapes(&self.snapped, &window, &canvas, &samples_fx[0, 0], sample_bits, c_transfer)
        raise_if_given_up()
        return bad_row

    def barycentric(self, const int32_t[:, ::1] ids, float[:, :, ::1] out):
        """The kernel `barycentric`."""
        cdef tl_window window = self.window(0, ids.shape[0], ids.shape[1])
        if ids.shape[0] and ids.shape[1]:
            with nogil:
                K.barycentric(&self.snapped, &window, &ids[0, 0], &out[0, 0, 0])

    def interpolate(self, const int32_t[:, ::1] ids, const float[:, ::1] values, bint per_corner, float background,
                    float[:, :, ::1] out):
        """The kernel `interpolate`."""
        cdef tl_window window = self.window(0, ids.shape[0], ids.shape[1])
        cdef int n_values = out.shape[2]
        if ids.shape[0] and ids.shape[1] and n_values:
            with nogil:
                K.interpolate(&self.snapped, &window, &ids[0, 0], &values[0, 0] if values.shape[0] else NULL, n_values,
                              per_corner, background, &out[0, 0, 0])


cdef class Bins:
    """The triangles that reach into each band of 2**band_bits rows of a picture."""

    cdef tl_bins bins
    cdef int64_t[::1] starts
    cdef int32_t[::1] listed
    cdef object room
    cdef readonly int band_bits
    cdef readonly int64_t bad_row, n_bands, n_listed

    def __init__(self, SnappedMesh mesh, int64_t height, int64_t width, int32_t reach_fx, int band_bits,
                 int32_t[:, ::1] room):
        """`room`: (3, n_triangles + 16). `bad_row` is -1, or a triangle has an index outside the vertices."""
        cdef tl_window window = mesh.window(0, height, width)
        self.room, self.band_bits, self.n_bands = room, band_bits, (height + (1 << band_bits) - 1) >> band_bits
        self.starts = np.empty(self.n_bands + 2, np.int64)
        self.bins.n = self.n_listed = 0
        self.bins.ids, self.bins.first_band, self.bins.last_band = &room[0, 0], &room[1, 0], &room[2, 0]
        with nogil:
            self.bad_row = K.bin(&mesh.snapped, &window, reach_fx, band_bits, &self.bins)
            if self.bad_row < 0:
                K.list_bins(&self.bins, self.n_bands, &self.starts[0], NULL)
                self.n_listed = self.starts[self.n_bands + 1]

    def fill(self, int32_t[::1] listed):
        """Sort the triangles into `listed`, which has room for `n_listed` + 1."""
        self.listed = listed
        with nogil:
            K.list_bins(&self.bins, self.n_bands, &self.starts[0], &listed[0])

    cdef void take(self, tl_slice *slice, int64_t band) noexcept:
        """Set the triangles of a slice to a band's."""
        slice.ids, slice.end = &self.listed[0] + self.starts[band], self.starts[band + 1] - self.starts[band]

    cdef const int32_t *backwards(self, int64_t band) noexcept nogil:
        """Reverse the triangles of a band in place and return them."""
        cdef int32_t *ids = &self.listed[0] + self.starts[band]
        cdef int64_t i, n = self.starts[band + 1] - self.starts[band]
        cdef int32_t other
        for i in range(n // 2):
            other = ids[i]
            ids[i], ids[n - 1 - i] = ids[n - 1 - i], other
        return ids


def draw_bands(meshes: Sequence[SnappedMesh], targets: Sequence[Target], Bins bins, int64_t first_band, int64_t end_band):
    """Clear and draw bands of several pictures, a mesh each: a band of all pictures before the next band."""
    cdef SnappedMesh mesh
    cdef Target target
    cdef tl_target rows
    cdef tl_window window
    cdef tl_slice slice = no_slice()
    cdef int64_t band, first_row
    cdef list pairs = list(zip(meshes, targets, strict=True))
    slice.is_first = slice.is_last = True
    for band in range(first_band, end_band):
        first_row = band << bins.band_bits
        bins.take(&slice, band)
        for mesh, target in pairs:
            rows = target.rows(first_row)
            window = mesh.window(first_row, min(<int64_t>1 << bins.band_bits, target.height - first_row), target.width)
            with nogil:
                K.draw_mesh(&mesh.snapped, &window, &rows, &slice)
        raise_if_given_up()


def peel(meshes: Sequence[SnappedMesh], bins: Sequence[Bins | None], int32_t[:, :, ::1] ids, float[:, :, ::1] depth,
         bint is_farthest, int band_bits, int64_t first_band, int64_t end_band, bint is_first) -> int:
    """Write the nearest layers of all meshes together, as planes (K, H, W), in bands of 2**band_bits rows.

    `bins`: of each mesh, or None, where a band tests all triangles. `is_first`: clear the planes before; otherwise the
    planes hold layers. Returns as `SnappedMesh.draw` does.
    """
    cdef tl_peeled peeled
    cdef tl_target target
    cdef tl_window window
    cdef tl_slice slice = no_slice()
    cdef SnappedMesh mesh
    cdef Bins mesh_bins
    cdef int64_t band, first_row, height = ids.shape[1], width = ids.shape[2], bad_row = -1
    cdef list pairs = list(zip(meshes, bins, strict=True))
    cdef int64_t i, n = len(pairs)
    memset(&peeled, 0, sizeof(peeled))
    peeled.n_layers, peeled.is_farthest = ids.shape[0], is_farthest
    peeled.plane_px = height * width
    memset(&target, 0, sizeof(target))
    target.sink, target.stride_px, target.peeled = <tl_sink>TL_SINK_PEEL, width, &peeled
    for band in range(first_band, end_band):
        first_row = band << band_bits
        peeled.ids, peeled.depth = &ids[0, first_row, 0], &depth[0, first_row, 0]
        for i in range(n):
            mesh, mesh_bins = pairs[i]
            slice.ids, slice.end = NULL, mesh.snapped.n_triangles
            if mesh_bins is not None:
                slice.ids, slice.end = &mesh_bins.listed[0] + mesh_bins.starts[band], mesh_bins.starts[band + 1] - mesh_bins.starts[band]
            slice.is_first, slice.is_last = is_first and i == 0, i == n - 1
            window = mesh.window(first_row, min(<int64_t>1 << band_bits, height - first_row), width)
            with nogil:
                bad_row = K.draw_mesh(&mesh.snapped, &window, &target, &slice)
            raise_if_given_up()
            if bad_row >= 0:
                return bad_row
    return bad_row
