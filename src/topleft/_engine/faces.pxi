# Normals, and other arrays that shading needs of a mesh. Included by _engine.pyx, which declares the kernels.
# What has to do with triangles returns -1, or a row with an index outside the vertices.


def vertex_normals(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[:, ::1] out):
    """Write the unit normals of vertices [first, end), the faces weighted by the angle."""
    cdef int64_t bad = -1
    cdef const int32_t *corners = &triangles[0, 0] if triangles.shape[0] else NULL
    if end > first:
        with nogil:
            bad = K.vertex_normals(&source.source, corners, triangles.shape[0], first, end, &out[0, 0])
    return bad


def face_normals(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[:, ::1] out, float[:, ::1] rows):
    """Write the unit normals of triangles [first, end), float64 or rows of four float32; the other is None."""
    cdef int64_t bad = -1
    cdef double *wide = &out[0, 0] if out is not None and out.shape[0] else NULL
    cdef float *fours = &rows[0, 0] if rows is not None and rows.shape[0] else NULL
    if end > first:
        with nogil:
            bad = K.face_normals(&source.source, &triangles[0, 0], first, end, wide, fours)
    return bad


def find_turned(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, const float[:, ::1] normals, uint8_t[::1] is_turned):
    """Write 1 for the triangles of [first, end) whose corners have normals that point to the other side, else 0."""
    cdef int64_t bad = -1
    if end > first:
        if not normals.shape[0]:
            return first
        with nogil:
            bad = K.find_turned(&source.source, &triangles[0, 0], first, end, &normals[0, 0], &is_turned[0])
    return bad


def box_of_faces(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[::1] box):
    """Write low and high of the corners of triangles [first, end), at least one."""
    cdef int64_t bad
    with nogil:
        bad = K.box_of_faces(&source.source, &triangles[0, 0], first, end, &box[0])
    return bad


def unit_vectors(Source vectors, const double[:, ::1] turn, int64_t first, int64_t end, double[:, ::1] out, float[:, ::1] rows):
    """Write vectors [first, end) as unit ones, by a matrix (3, 3) from the right or None; out as for `face_normals`."""
    cdef const double *matrix = &turn[0, 0] if turn is not None else NULL
    cdef double *wide = &out[0, 0] if out is not None and out.shape[0] else NULL
    cdef float *fours = &rows[0, 0] if rows is not None and rows.shape[0] else NULL
    if end > first:
        with nogil:
            K.unit_vectors(&vectors.source, matrix, first, end, wide, fours)


def move_points(Source points, const double[:, ::1] matrix, int64_t first, int64_t end, double[:, ::1] out):
    """Write points [first, end) moved by the upper rows of an affine matrix (4, 4)."""
    if end > first:
        with nogil:
            K.move_points(&points.source, &matrix[0, 0], first, end, &out[0, 0])


def color_rows(const uint8_t[:, ::1] colors, int64_t first, int64_t end, float[:, ::1] rows):
    """Write red, green and blue of colours [first, end), and 1."""
    if end > first:
        with nogil:
            K.color_rows(&colors[0, 0], colors.shape[1], first, end, &rows[0, 0])
