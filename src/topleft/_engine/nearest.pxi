# Distances between surfaces. Included by _engine.pyx, which declares the kernels.


cdef class Surface:
    """Triangles in a tree of boxes, to find the nearest of."""

    cdef tl_surface surface
    cdef object arrays

    def __init__(self, const double[:, ::1] points, const int32_t[:, ::1] triangles, double slack):
        """`triangles`: at least one, neighbours near each other; `slack`: by which boxes are widened."""
        cdef int64_t n = triangles.shape[0], n_below = (n + TL_TREE_LEAF - 1) // TL_TREE_LEAF, n_all = 0
        cdef int level = 0
        while level == 0 or n_below > 1:
            n_below = (n_below + TL_TREE_WIDTH - 1) // TL_TREE_WIDTH
            self.surface.first_node[level] = n_all
            self.surface.n_nodes[level] = n_below
            n_all += n_below
            level += 1
        nodes = np.empty(n_all * sizeof(tl_tree_node), np.uint8)
        cdef uint8_t[::1] memory = nodes
        self.arrays = (points, triangles, nodes)
        self.surface.points = &points[0, 0]
        self.surface.triangles = &triangles[0, 0]
        self.surface.n_triangles = n
        self.surface.nodes = <tl_tree_node *>&memory[0]
        self.surface.n_levels = level
        self.surface.slack = slack
        with nogil:
            K.build_tree(&self.surface)

    def find_nearest(self, const double[:, ::1] points, int64_t first, int64_t end, int32_t[::1] triangle,
                     double[:, ::1] at=None):
        """Write the nearest triangle of points [first, end), and where on it; return the largest distance."""
        cdef double *out = &at[0, 0] if at is not None and at.shape[0] > 0 else NULL
        cdef double largest = 0.0
        if first < end:
            with nogil:
                largest = K.find_nearest(&self.surface, &points[0, 0], first, end, &triangle[0], out)
        return largest

    def find_reach(self, const double[:, ::1] points, const int32_t[:, ::1] triangles,
                   int64_t first, int64_t end, double known, double share, double least):
        """Return how far triangles [first, end) are at least and at most, and the most pieces that one was cut into."""
        cdef tl_reach reach
        reach.known, reach.bound, reach.n_pieces = known, 0.0, 0
        if first < end:
            with nogil:
                K.find_reach(&self.surface, &points[0, 0], &triangles[0, 0], first, end, share, least, &reach)
        return reach.known, reach.bound, reach.n_pieces


def set_feet(const double[:, ::1] points, const int32_t[:, ::1] triangles, const double[:, ::1] from_points,
             const int32_t[::1] triangle, const int32_t[::1] point, double[:, ::1] at, double[::1] squared):
    """Write where on a triangle is nearest to a point, and the squared distance, of each pair of row numbers."""
    cdef int64_t n = triangle.shape[0]
    if n:
        with nogil:
            K.set_feet(&points[0, 0], &triangles[0, 0], &from_points[0, 0], &triangle[0], &point[0], n, &at[0, 0], &squared[0])
