# Values on the planes of triangles. Included by _engine.pyx, which declares the kernels.

PLANE_DOUBLES = TL_PLANE_DOUBLES


cdef class Valued:
    """Triangles with a value at each point."""

    cdef tl_valued mesh
    cdef object arrays

    def __init__(self, const double[:, ::1] points_px, const int32_t[:, ::1] triangles, const double[::1] values,
                 double[::1] planes=None):
        """`planes`: (1 + n_triangles) * PLANE_DOUBLES, for `list_planes`."""
        self.arrays = (points_px, triangles, values, planes)
        self.mesh.points_px = &points_px[0, 0] if points_px.shape[0] else NULL
        self.mesh.values = &values[0] if values.shape[0] else NULL
        self.mesh.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.mesh.n_points, self.mesh.n_triangles = points_px.shape[0], triangles.shape[0]
        self.mesh.planes = &planes[0] if planes is not None else NULL

    def list_planes(self, int64_t first, int64_t end):
        """Compute the planes of triangles [first, end); those of all must be there before `fill_planes`."""
        with nogil:
            K.list_planes(&self.mesh, first, end)

    def fill_planes(self, const int32_t[:, ::1] ids, out, int64_t first_row, int64_t n_rows):
        """Write the values of the pixels in the rows [first_row, first_row + n_rows) of a float32 or float64 array."""
        cdef tl_window window
        cdef bint is_f32 = out.dtype == np.float32
        cdef uint8_t[::1] flat = as_bytes(out)
        cdef int64_t width = ids.shape[1]
        if width == 0 or n_rows == 0:
            return
        window.x_px, window.y_px, window.width, window.height = 0, first_row, width, n_rows
        window.subpixel_bits, window.test = 0, 0
        with nogil:
            K.fill_planes(&self.mesh, &window, &ids[first_row, 0], is_f32, &flat[first_row * width * (4 if is_f32 else 8)])
