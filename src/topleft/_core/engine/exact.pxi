# Vertices that are not snapped, and the pieces of their clipped triangles.


cdef class ExactPieces:
    """The pieces of triangles that clip planes cut, of vertices that are not snapped."""

    cdef tl_exact_pieces pieces
    cdef readonly object arrays  #: tuple[Array, ...] | None

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

    def __len__(self) -> int:
        return self.pieces.n_pieces

    def join(self, points: F64, triangles: I32) -> tuple[F64, I32, I32]:
        """Return points, triangles and names of a mesh, its cut triangles collapsed to one point, and of the pieces."""
        n, is_cut = len(points), np.isnan(points[:, 0])[triangles].any(axis=1)
        own = [np.asarray(array) for array in self.arrays] if len(self) else [np.empty((0, 3)), *[None] * 4]
        if len(self):
            own[0], own[3], own[4] = own[0][: self.pieces.n_points], own[3][: len(self)], own[4][: len(self)]
        collapsed = np.where(is_cut[:, None], np.int32(n), triangles)
        places = np.rint(np.clip(own[0][:, :2], -TL_PLACE_LIMIT_PX, TL_PLACE_LIMIT_PX) * (1 << TL_PLACE_BITS))
        placed = np.ascontiguousarray(places.astype(np.int32)).view(np.float64)
        all_points = np.concatenate([points, np.zeros((1, TL_PLACED)), np.hstack([own[0], placed])])
        if not len(self):
            return all_points, collapsed, np.arange(len(triangles), dtype=np.int32)
        names = np.concatenate([np.arange(len(triangles), dtype=np.int32), own[4]])
        return all_points, np.concatenate([collapsed, own[3] + np.int32(n + 1)]), names


cdef class UnsnappedPoints:
    """Vertices in pixels as they are, the triangles that are drawn of them, and how many samples were decided how."""

    cdef tl_exact_points points
    cdef tl_exact_counts counted
    cdef int64_t n_vertices
    cdef object arrays

    def __init__(self, points_given: F64, const int32_t[:, ::1] triangles_given, ExactPieces pieces=None,
                 double band=1.0):
        """`points_given`: (V, 2), (V, 3) or (V, PLACED); `band` less than 1 draws wrong pictures, to test bands."""
        cdef const double[:, ::1] points = points_given
        cdef const int32_t[:, ::1] triangles = triangles_given
        cdef const int32_t[::1] names = None
        memset(&self.counted, 0, sizeof(self.counted))
        self.n_vertices = points.shape[0]
        if pieces is not None:
            points, triangles, names = pieces.join(points_given, np.asarray(triangles_given))
        self.arrays = (points, triangles, names, pieces)
        self.points.points = &points[0, 0] if points.shape[0] else NULL
        self.points.n_points, self.points.stride = points.shape[0], points.shape[1]
        self.points.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.points.n_triangles = triangles.shape[0]
        self.points.names = &names[0] if names is not None and names.shape[0] else NULL
        self.points.pieces = &pieces.pieces if pieces is not None and len(pieces) else NULL
        self.points.band = band

    @property
    def counts(self) -> tuple[int, int, int, int, int, int]:
        """`tl_exact_counts` of all that has been drawn, in its order."""
        cdef tl_exact_counts *c = &self.counted
        return c.n_triangles, c.n_on_grid, c.n_refined, c.n_turns, c.n_expansions, c.n_integers

    cdef void add(self, const tl_exact_counts *counts):
        cdef tl_exact_counts *c = &self.counted
        c.n_triangles += counts.n_triangles
        c.n_on_grid += counts.n_on_grid
        c.n_refined += counts.n_refined
        c.n_turns += counts.n_turns
        c.n_expansions += counts.n_expansions
        c.n_integers += counts.n_integers
