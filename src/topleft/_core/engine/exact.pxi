# Vertices that are not snapped, and the pieces of their clipped triangles.


cdef tuple[Array, Array, Array] joined(Pieces pieces, points: Array, triangles: Array):
    """Return points, triangles and names of a mesh and its pieces; cut triangles are collapsed to a point."""
    cdef int64_t n = points.shape[0], n_pieces = len(pieces)
    is_cut = np.isnan(points[:, 0])[triangles].any(axis=1)
    collapsed = np.where(is_cut[:, None], np.int32(n), triangles)
    clipped, _, _, _, corners, owners = pieces.arrays if n_pieces else (np.empty((0, 3)), *[np.empty((0, 3), np.int32)] * 5)
    clipped = clipped[: pieces.pieces.n_vertices]
    places = np.rint(np.clip(clipped[:, :2], -TL_PLACE_LIMIT_PX, TL_PLACE_LIMIT_PX) * (1 << TL_PLACE_BITS))
    placed = np.ascontiguousarray(places.astype(np.int32)).view(np.float64)
    all_points = np.concatenate([points, np.zeros((1, TL_PLACED)), np.hstack([clipped, placed])])
    names = np.concatenate([np.arange(len(triangles), dtype=np.int32), owners.reshape(-1)[:n_pieces]])
    return all_points, np.concatenate([collapsed, corners[:n_pieces] + np.int32(n + 1)]), names


cdef class UnsnappedPoints:
    """Vertices in pixels, not snapped, and their triangles."""

    cdef tl_exact_points points
    cdef int64_t n_vertices
    cdef object arrays

    def __init__(self, points_given: F64, const int32_t[:, ::1] triangles_given, Pieces pieces=None,
                 double band=1.0):
        """`points_given`: (V, 2), (V, 3) or (V, PLACED); `band` less than 1 draws wrong pictures, to test bands."""
        cdef const double[:, ::1] points = points_given
        cdef const int32_t[:, ::1] triangles = triangles_given
        cdef const int32_t[::1] names = None
        self.n_vertices = points.shape[0]
        if pieces is not None:
            points, triangles, names = joined(pieces, points_given, np.asarray(triangles_given))
        self.arrays = (points, triangles, names, pieces)
        self.points.points = &points[0, 0] if points.shape[0] else NULL
        self.points.n_points, self.points.stride = points.shape[0], points.shape[1]
        self.points.triangles = &triangles[0, 0] if triangles.shape[0] else NULL
        self.points.n_triangles = triangles.shape[0]
        self.points.names = &names[0] if names is not None and names.shape[0] else NULL
        self.points.pieces = &pieces.pieces if pieces is not None and len(pieces) else NULL
        self.points.band = band
