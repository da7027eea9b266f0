# Points of pixels, and what follows from them. Included by _engine.pyx, which declares the kernels.


cdef class Points:
    """What `tl_points` holds: positions of vertices, and what is told of a point."""

    cdef tl_points points
    cdef object array

    def __init__(self, positions, int kind, const double[:, ::1] rows, half_size, double background, bint is_f64_out):
        """`positions`: (V, 3) float32 or float64; `rows`: (N, 4); `half_size`: half of width and height of the whole picture."""
        cdef const uint8_t[::1] raw = as_bytes(positions)
        cdef int i, k
        self.array = raw
        self.points.positions, self.points.is_f64 = data(raw), positions.dtype == np.float64
        self.points.kind, self.points.n_rows, self.points.background = <tl_point_kind>kind, rows.shape[0], background
        self.points.half_width_px, self.points.half_height_px = half_size
        self.points.is_f64_out = is_f64_out
        for i in range(rows.shape[0]):
            for k in range(4):
                self.points.rows[i][k] = rows[i, k]

    def fill(self, Scene scene, const int32_t[:, ::1] ids, out, int64_t first_row, int64_t n_rows):
        """Write rows of what is told of the pixels of a visibility buffer, (H, W) or (H, W, C)."""
        cdef tl_window window = scene.window(first_row, n_rows, ids.shape[1])
        cdef uint8_t[::1] flat
        if n_rows and ids.shape[1]:
            flat = as_bytes(out[first_row:first_row + n_rows])
            with nogil:
                K.fill_points(&scene.scene, &window, &self.points, &ids[first_row, 0], &flat[0])
