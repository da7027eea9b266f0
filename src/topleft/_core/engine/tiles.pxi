# Windows of huge rasters: lists the triangles of each window. Included by kernels.pyx.


def list_spans(tiling: tuple[int, int, int, int, int], const double[:, :, ::1] corners_px, int64_t first_triangle,
               int32_t[:, ::1] boxes, int64_t[::1] starts, int32_t[:, ::1] spans or None) -> int:
    """The kernel `list_spans`. `tiling`: width and height of the raster and of a window, sub-pixel bits."""
    cdef tl_tiling t
    cdef int64_t bad = -1
    cdef tl_window_span *out = NULL
    t.width_px, t.height_px, t.window_width_px, t.window_height_px, t.subpixel_bits = tiling
    if spans is not None:
        if not spans.shape[0]:
            return -1
        out = <tl_window_span *>&spans[0, 0]
    if corners_px.shape[0]:
        with nogil:
            bad = K.list_spans(&t, &corners_px[0, 0, 0], corners_px.shape[0], first_triangle,
                               <tl_window_box *>&boxes[0, 0], &starts[0], out)
    return bad


SHORT_SPAN = TL_SHORT_SPAN


def sort_spans(const int32_t[:, ::1] spans, int64_t[::1] starts, int32_t[::1] out or None) -> int:
    """The kernel `sort_spans`."""
    cdef int64_t n_long = 0
    cdef const tl_window_span *first
    if spans.shape[0]:
        first = <const tl_window_span *>&spans[0, 0]
        with nogil:
            n_long = K.sort_spans(first, spans.shape[0], &starts[0], &out[0] if out is not None else NULL)
    return n_long


def count_windows(const int32_t[:, ::1] spans, const int64_t[::1] starts, int32_t[:, ::1] steps):
    """The kernel `count_windows`."""
    cdef const tl_window_span *first
    if spans.shape[0] and steps.shape[0]:
        first = <const tl_window_span *>&spans[0, 0]
        with nogil:
            K.count_windows(first, &starts[0], steps.shape[0], steps.shape[1] - 1, &steps[0, 0])


cdef class StridedMesh:
    """The vertices and the triangles of a mesh in memory or in a mapped file, with strides."""

    cdef tl_corners mesh
    cdef Py_buffer points, triangles
    cdef int64_t n_triangles

    def __cinit__(self, points: Array, triangles: Array):
        """`points`: (V, C), `triangles`: (T, 3) int32 or int64; each row is contiguous."""
        PyObject_GetBuffer(points, &self.points, PyBUF_STRIDED_RO)
        PyObject_GetBuffer(triangles, &self.triangles, PyBUF_STRIDED_RO)
        self.mesh.points, self.mesh.point_stride = <const char *>self.points.buf, self.points.strides[0]
        self.mesh.n_points = self.points.shape[0]
        self.mesh.point_bytes = self.points.shape[1] * self.points.itemsize
        self.mesh.triangles, self.mesh.triangle_stride = <const char *>self.triangles.buf, self.triangles.strides[0]
        self.mesh.is_wide, self.n_triangles = self.triangles.itemsize == 8, self.triangles.shape[0]

    def __dealloc__(self):
        PyBuffer_Release(&self.points)
        PyBuffer_Release(&self.triangles)

    def take(self, const int32_t[::1] which or None, int64_t first, uint8_t[::1] out) -> int:
        """Copy the corners of the triangles `which`, or of the triangles from `first` on; `out` sets how many.

        Returns the first triangle with an index outside the vertices, or -1.
        """
        cdef int64_t n = out.shape[0] // (3 * self.mesh.point_bytes), bad = -1
        if n:
            with nogil:
                bad = K.take_corners(&self.mesh, &which[0] if which is not None else NULL, first, n, &out[0])
        return bad
