# Projects and snaps the instances of meshes, many in a call.


cdef class MeshList:
    """Vertices (V, 3), float32 or float64, and checked triangles of the meshes of a scene."""

    cdef object arrays
    cdef uint8_t[::1] source_room, mesh_room
    cdef tl_source *sources
    cdef tl_snapped *meshes

    def __init__(self, meshes: Sequence[tuple[Array, I32]]):
        cdef int64_t i, n = len(meshes)
        cdef const int32_t[:, ::1] triangles
        cdef const uint8_t[::1] raw
        cdef tl_source *source
        self.arrays = meshes
        self.source_room = np.zeros(max(1, n) * sizeof(tl_source), np.uint8)
        self.mesh_room = np.zeros(max(1, n) * sizeof(tl_snapped), np.uint8)
        self.sources, self.meshes = <tl_source *>&self.source_room[0], <tl_snapped *>&self.mesh_room[0]
        for i in range(n):
            vertices, triangles = meshes[i]
            raw, source = as_bytes(vertices), self.sources + i
            source.data, source.n, source.n_components = data(raw), vertices.shape[0], 3
            source.scalar = TL_F32 if vertices.dtype == np.float32 else TL_F64
            self.meshes[i].mesh.n_vertices, self.meshes[i].n_triangles = source.n, triangles.shape[0]
            self.meshes[i].triangles = &triangles[0, 0] if triangles.shape[0] else NULL


cdef class PlacedMeshes:
    """Instances of the meshes `some` of a list: `project` makes them ready to be drawn.

    `matrices`: clip from object of each. `culls`, `numbers`: the `tl_cull` of each, and the id of its triangle 0.
    `is_apart`: 1 where an instance is skipped. `how`: as for `SnappedMesh`. `room`: records of all vertices, uint8, or
    points (V, PLACED) float64, which are not snapped; from vertex firsts[i] on for instance i.
    """

    cdef object arrays
    cdef Viewport viewport
    cdef uint8_t[::1] raw, source_room, mesh_room, is_apart
    cdef const double[:, :, ::1] matrices
    cdef float[:, ::1] rounded
    cdef const int64_t[::1] firsts
    cdef tl_source *sources
    cdef tl_snapped *meshes
    cdef bint is_exact
    cdef int64_t x_px, y_px
    cdef int subpixel_bits, test

    def __init__(self, MeshList meshes, const int64_t[::1] some, const double[:, :, ::1] matrices, const int32_t[::1] culls,
                 const int64_t[::1] numbers, const uint8_t[::1] is_apart, Viewport viewport,
                 how: tuple[int, int, int, int, int, int], room: Array, const int64_t[::1] firsts):
        cdef int64_t i, n = matrices.shape[0]
        cdef int method
        self.viewport, self.is_exact, self.raw = viewport, room.dtype == np.float64, as_bytes(room)
        self.matrices, self.firsts, self.rounded = matrices, firsts, np.empty((max(1, n), 16), np.float32)
        self.is_apart = np.array(is_apart)
        self.source_room = np.empty(max(1, n) * sizeof(tl_source), np.uint8)
        self.mesh_room = np.empty(max(1, n) * sizeof(tl_snapped), np.uint8)
        self.sources, self.meshes = <tl_source *>&self.source_room[0], <tl_snapped *>&self.mesh_room[0]
        self.arrays = meshes, matrices, self.rounded, self.source_room, room
        self.x_px, self.y_px, self.subpixel_bits, _, method, self.test = how
        for i in range(n):
            self.sources[i], self.meshes[i] = meshes.sources[some[i]], meshes.meshes[some[i]]
            self.sources[i].is_affine = set_matrix(&self.sources[i], &matrices[i, 0, 0], &self.rounded[i, 0])
            self.meshes[i].mesh.source, self.meshes[i].method = &self.sources[i], <tl_method>method
            self.meshes[i].cull, self.meshes[i].first_id = <tl_cull>culls[i], <int32_t>numbers[i]
            if not self.is_exact:
                self.meshes[i].mesh.vertices = <const tl_vertex *>self.place(i)

    cdef uint8_t *place(self, int64_t i) noexcept nogil:
        """The address of an instance's first vertex."""
        cdef int64_t n_bytes = TL_PLACED * sizeof(double) if self.is_exact else sizeof(tl_vertex)
        return &self.raw[0] + self.firsts[i] * n_bytes

    def project(self, int64_t first, int64_t end):
        """Project instances [first, end) and skip each that must be drawn alone.

        That is an instance with a vertex that is bad, wide or clipped, without triangles, or with a matrix beyond float32.
        """
        if self.firsts[end] - self.firsts[first] < HELD_VERTICES:
            self.project_all(first, end)
        else:
            with nogil:
                self.project_all(first, end)

    cdef void project_all(self, int64_t first, int64_t end) noexcept nogil:
        cdef int64_t i
        cdef tl_projected out
        cdef tl_vertex_counts counts
        for i in range(first, end):
            if self.is_apart[i] or not self.sources[i].n or not self.meshes[i].n_triangles or not self.sources[i].matrix:
                self.is_apart[i] = True
                continue
            memset(&out, 0, sizeof(out))
            if self.is_exact:
                out = points_to(<double *>self.place(i))
            else:
                out.records = <tl_vertex *>self.place(i)
            counts = K.project(&self.sources[i], 0, self.sources[i].n, &self.viewport.view, &out)
            self.is_apart[i] = counts.n_bad + counts.n_wide + counts.n_clipped > 0

    def mesh(self, int64_t i) -> SnappedMesh | None:
        """Return an instance ready to be drawn; None if it was skipped."""
        if self.is_apart[i]:
            return None
        cdef SnappedMesh instance = self.like(i)
        if self.is_exact:
            self.set_points(instance, <double *>self.place(i), instance.snapped.mesh.n_vertices)
        return instance

    cdef SnappedMesh like(self, int64_t i):
        cdef SnappedMesh instance = SnappedMesh.__new__(SnappedMesh)
        instance.snapped, instance.arrays, instance.viewport, instance.is_used = self.meshes[i], self.arrays, self.viewport, None
        instance.x_px, instance.y_px, instance.subpixel_bits, instance.test = self.x_px, self.y_px, self.subpixel_bits, <tl_test>self.test
        return instance

    cdef void set_points(self, SnappedMesh mesh, const double *points, int64_t n):
        """Set n points (PLACED,) of a mesh that are not snapped, of triangles that no plane cuts."""
        cdef UnsnappedPoints exact = UnsnappedPoints.__new__(UnsnappedPoints)
        memset(&exact.points, 0, sizeof(exact.points))
        exact.arrays, exact.n_vertices, exact.points.band = mesh.arrays, n, 1.0
        exact.points.points, exact.points.n_points, exact.points.stride = points, n, TL_PLACED
        exact.points.triangles, exact.points.n_triangles = mesh.snapped.triangles, mesh.snapped.n_triangles
        mesh.exact, mesh.snapped.mesh.exact = exact, &exact.points


cdef bint set_matrix(tl_source *source, const double *matrix, float *rounded) noexcept:
    """Set the matrix of a mesh in the type of its vertices, NULL beyond float32; return whether every w is 1."""
    cdef int k
    source.matrix = matrix
    if source.scalar == TL_F32:
        source.matrix = rounded
        for k in range(16):
            rounded[k] = <float>matrix[k]
            if isinf(rounded[k]):
                source.matrix = NULL
    return matrix[12] == 0 and matrix[13] == 0 and matrix[14] == 0 and matrix[15] == 1
