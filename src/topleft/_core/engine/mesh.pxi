# Kernels on meshes: normals, other arrays that shading needs, distances between surfaces.
# Functions that read triangles return -1, or a row with an index outside the vertices.


def vertex_normals(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end,
                   double[:, ::1] out) -> int:
    """The kernel `vertex_normals`."""
    cdef int64_t bad = -1
    cdef const int32_t *corners = &triangles[0, 0] if triangles.shape[0] else NULL
    if end > first:
        with nogil:
            bad = K.vertex_normals(&source.source, corners, triangles.shape[0], first, end, &out[0, 0])
    return bad


def face_normals(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[:, ::1] out or None,
                 float[:, ::1] rows or None) -> int:
    """The kernel `face_normals`. One of the two outputs is None."""
    cdef int64_t bad = -1
    cdef double *wide = &out[0, 0] if out is not None and out.shape[0] else NULL
    cdef float *fours = &rows[0, 0] if rows is not None and rows.shape[0] else NULL
    if end > first:
        with nogil:
            bad = K.face_normals(&source.source, &triangles[0, 0], first, end, wide, fours)
    return bad


def find_turned(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, const float[:, ::1] normals,
                const int32_t[:, ::1] row_of_corner, uint8_t[::1] is_turned) -> int:
    """The kernel `find_turned`."""
    cdef int64_t bad = -1
    if end > first:
        if not normals.shape[0]:
            return first
        with nogil:
            bad = K.find_turned(&source.source, &triangles[0, 0], first, end, &normals[0, 0], &row_of_corner[0, 0], &is_turned[0])
    return bad


def face_angles(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[:, ::1] normals,
                double[:, ::1] angles) -> int:
    """The kernel `face_angles`."""
    cdef int64_t bad = -1
    if end > first:
        with nogil:
            bad = K.face_angles(&source.source, &triangles[0, 0], first, end, &normals[0, 0], &angles[0, 0])
    return bad


def cut_faces(const double[:, ::1] points, const int64_t[::1] corners, const int64_t[::1] n_corners,
              int64_t most_corners, int64_t most_steps, int64_t[:, ::1] triangles) -> int:
    """The kernel `cut_faces`."""
    cdef int64_t[::1] room = np.empty(tl_ear_words(most_corners), np.int64)
    cdef tl_faces faces
    cdef int64_t n
    faces.points, faces.corners, faces.n_corners = &points[0, 0], &corners[0], &n_corners[0]
    faces.n_faces, faces.most_steps, faces.pause = n_corners.shape[0], most_steps, pause_of_thread()
    with nogil:
        n = K.cut_faces(&faces, &triangles[0, 0], &room[0])
    raise_if_given_up()
    return n


cdef class Fans:
    """The triangles round the vertices of a mesh: `tl_fans`, at least one triangle. The indices have been checked."""

    cdef tl_fans fans
    cdef object arrays
    cdef int64_t n_vertices
    cdef readonly int most_corners

    def __init__(self, const int32_t[:, ::1] triangles, int64_t n_vertices, const double[:, ::1] normals,
                 const double[:, ::1] angles, double least_cosine):
        cdef int32_t[::1] starts = np.empty(n_vertices + 1, np.int32)
        cdef int32_t[::1] corners = np.empty(3 * triangles.shape[0], np.int32)
        cdef tl_fans *f = &self.fans
        self.arrays = (triangles, starts, corners, normals, angles)
        self.n_vertices = n_vertices
        f.triangles, f.starts, f.corners = &triangles[0, 0], &starts[0], &corners[0]
        f.normals, f.angles, f.least_cosine = &normals[0, 0], &angles[0, 0], least_cosine
        with nogil:
            K.list_corners(f.triangles, triangles.shape[0], n_vertices, &starts[0], &corners[0])
        self.most_corners = int(np.diff(starts).max())

    def find_creases(self, int64_t first, int64_t end, int32_t[:, ::1] groups, int32_t[::1] n_groups):
        """Write the groups of the corners of vertices [first, end), and how many each vertex has."""
        cdef uint64_t[::1] room = np.empty(5 * self.most_corners, np.uint64)
        if end > first:
            with nogil:
                K.find_creases(&self.fans, first, end, &room[0], &groups[0, 0], &n_groups[0])

    def sum_creases(self, int64_t first, int64_t end, const int32_t[::1] starts, const int32_t[:, ::1] groups,
                    const int32_t[:, ::1] own_triangles, int64_t first_row, double[:, ::1] of_vertices,
                    double[:, ::1] of_groups, int32_t[:, ::1] row_of_corner or None):
        """The kernel `sum_creases`."""
        cdef tl_creases c
        c.starts, c.groups, c.own_triangles = &starts[0], &groups[0, 0], &own_triangles[0, 0]
        c.first_row, c.of_vertices = first_row, &of_vertices[0, 0]
        c.of_groups = &of_groups[0, 0] if of_groups.shape[0] else NULL
        c.row_of_corner = &row_of_corner[0, 0] if row_of_corner is not None else NULL
        if end > first:
            with nogil:
                K.sum_creases(&self.fans, &c, first, end)


def box_of_faces(Source source, const int32_t[:, ::1] triangles, int64_t first, int64_t end, double[::1] box) -> int:
    """The kernel `box_of_faces`."""
    cdef int64_t bad
    with nogil:
        bad = K.box_of_faces(&source.source, &triangles[0, 0], first, end, &box[0])
    return bad


def unit_vectors(Source vectors, const double[:, ::1] turn or None, int64_t first, int64_t end,
                 double[:, ::1] out or None, float[:, ::1] rows or None):
    """The kernel `unit_vectors`."""
    cdef const double *matrix = &turn[0, 0] if turn is not None else NULL
    cdef double *wide = &out[0, 0] if out is not None and out.shape[0] else NULL
    cdef float *fours = &rows[0, 0] if rows is not None and rows.shape[0] else NULL
    if end > first:
        with nogil:
            K.unit_vectors(&vectors.source, matrix, first, end, wide, fours)


def move_points(Source points, const double[:, ::1] matrix, int64_t first, int64_t end, double[:, ::1] out):
    """The kernel `move_points`. The matrix is (4, 4)."""
    if end > first:
        with nogil:
            K.move_points(&points.source, &matrix[0, 0], first, end, &out[0, 0])


def color_rows(const uint8_t[:, ::1] colors, int64_t first, int64_t end, float[:, ::1] rows):
    """The kernel `color_rows`."""
    if end > first:
        with nogil:
            K.color_rows(&colors[0, 0], colors.shape[1], first, end, &rows[0, 0])


def group_rows(const uint32_t[:, ::1] rows, int table_bits, int32_t[::1] table, int32_t[::1] first,
               int32_t[::1] group) -> int:
    """The kernel `group_rows`."""
    cdef int64_t n_groups
    with nogil:
        n_groups = K.group_rows(&rows[0, 0], rows.shape[1], rows.shape[0], table_bits, &table[0], &first[0], &group[0])
    return n_groups


cdef class Tree:
    """Triangles in a tree of boxes, to find the nearest of."""

    cdef tl_surface tree
    cdef object arrays

    def __init__(self, const double[:, ::1] points, const int32_t[:, ::1] triangles, double slack):
        """`triangles`: at least one, neighbours near each other; `slack`: by which boxes are widened."""
        cdef int64_t n = triangles.shape[0], n_below = (n + TL_TREE_LEAF - 1) // TL_TREE_LEAF, n_all = 0
        cdef int level = 0
        while level == 0 or n_below > 1:
            n_below = (n_below + TL_TREE_WIDTH - 1) // TL_TREE_WIDTH
            self.tree.first_node[level] = n_all
            self.tree.n_nodes[level] = n_below
            n_all += n_below
            level += 1
        nodes = np.empty(n_all * sizeof(tl_tree_node), np.uint8)
        cdef uint8_t[::1] memory = nodes
        self.arrays = (points, triangles, nodes)
        self.tree.points = &points[0, 0]
        self.tree.triangles = &triangles[0, 0]
        self.tree.n_triangles = n
        self.tree.nodes = <tl_tree_node *>&memory[0]
        self.tree.n_levels = level
        self.tree.slack = slack
        with nogil:
            K.build_tree(&self.tree)

    def find_nearest(self, const double[:, ::1] points, int64_t first, int64_t end, int32_t[::1] triangle,
                     double[:, ::1] at=None) -> float:
        """The kernel `nearest_of_points`."""
        cdef double *out = &at[0, 0] if at is not None and at.shape[0] > 0 else NULL
        cdef double largest = 0.0
        if first < end:
            with nogil:
                largest = K.nearest_of_points(&self.tree, &points[0, 0], first, end, &triangle[0], out)
        return largest

    def find_reach(self, const double[:, ::1] points, const int32_t[:, ::1] triangles,
                   int64_t first, int64_t end, double known, double share, double least) -> tuple[float, float, int]:
        """The kernel `find_reach`. Returns least and most of it, and the most pieces that a triangle was cut into."""
        cdef tl_reach reach
        reach.known, reach.bound, reach.n_pieces = known, 0.0, 0
        if first < end:
            with nogil:
                K.find_reach(&self.tree, &points[0, 0], &triangles[0, 0], first, end, share, least, &reach)
        return reach.known, reach.bound, reach.n_pieces


def set_feet(const double[:, ::1] points, const int32_t[:, ::1] triangles, const double[:, ::1] from_points,
             const int32_t[::1] triangle, const int32_t[::1] point, double[:, ::1] at, double[::1] squared):
    """The kernel `set_feet`."""
    cdef int64_t n = triangle.shape[0]
    if n:
        with nogil:
            K.set_feet(&points[0, 0], &triangles[0, 0], &from_points[0, 0], &triangle[0], &point[0], n, &at[0, 0], &squared[0])
