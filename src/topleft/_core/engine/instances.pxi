# Instances of meshes behind the vertex stage: many in one call.


def project_instances(meshes: Sequence[tuple[Array, I32]], const double[:, :, ::1] matrices, const int32_t[::1] culls,
                      const int64_t[::1] numbers, Viewport viewport, how: tuple[int, int, int, int, int, int],
                      room: Array, const int64_t[::1] firsts, int64_t first,
                      int64_t end) -> list[SnappedMesh | None]:
    """Project instances [first, end) of meshes, ready to be drawn; None where one needs a closer look.

    That is one with a vertex that is bad, wide or clipped, without triangles, or with a matrix beyond float32.

    `meshes`: vertices (V, 3) float32 or float64 and checked triangles of each. `matrices`: clip from object of each.
    `culls`, `numbers`: the `tl_cull` of each, and the id of its triangle 0. `how`: that of a view. `room`: records
    of all vertices, uint8, or points (V, PLACED) float64, which are not snapped; from vertex firsts[i] on for instance i.
    """
    cdef int64_t i, n = end - first
    cdef bint is_exact = room.dtype == np.float64, is_held
    cdef uint8_t[::1] raw = as_bytes(room)
    cdef uint8_t[::1] source_room = np.empty(max(1, n) * sizeof(tl_source), np.uint8)
    cdef float[:, ::1] rounded = np.empty((max(1, n), 16), np.float32)
    cdef tl_source *source = <tl_source *>&source_room[0]
    cdef tl_vertex_counts counts
    cdef const float[:, ::1] narrow
    cdef const double[:, ::1] wide
    cdef const int32_t[:, ::1] triangles
    cdef object mesh = None, kept = (meshes, matrices, rounded, source_room, room)
    cdef SnappedMesh made
    cdef list found = []
    cdef tl_source of_mesh
    cdef uint8_t *place
    memset(&of_mesh, 0, sizeof(of_mesh))
    of_mesh.n_components = 3
    is_held = firsts[end] - firsts[first] < HELD_VERTICES
    for i in range(first, end):
        if meshes[i] is not mesh:
            mesh = meshes[i]
            vertices, triangles = mesh
            of_mesh.n = vertices.shape[0]
            of_mesh.data = NULL
            if of_mesh.n and vertices.dtype == np.float32:
                narrow, of_mesh.scalar = vertices, TL_F32
                of_mesh.data = &narrow[0, 0]
            elif of_mesh.n:
                wide, of_mesh.scalar = vertices, TL_F64
                of_mesh.data = &wide[0, 0]
        source[0] = of_mesh
        source.is_affine = set_matrix(source, &matrices[i, 0, 0], &rounded[i - first, 0])
        if of_mesh.data == NULL or not triangles.shape[0] or source.matrix == NULL:
            found.append(None)
            continue
        place = &raw[firsts[i] * (TL_PLACED * sizeof(double) if is_exact else sizeof(tl_vertex))]
        if is_held:
            counts = project_whole(source, viewport, place, is_exact)
        else:
            with nogil:
                counts = project_whole(source, viewport, place, is_exact)
        if counts.n_bad or counts.n_wide or counts.n_clipped:
            found.append(None)
            continue
        made = SnappedMesh.__new__(SnappedMesh)
        memset(&made.snapped, 0, sizeof(made.snapped))
        made.arrays, made.viewport, made.is_used = kept, viewport, None
        made.snapped.mesh.source, made.snapped.mesh.n_vertices = source, of_mesh.n
        made.snapped.triangles, made.snapped.n_triangles = &triangles[0, 0], triangles.shape[0]
        made.x_px, made.y_px, made.subpixel_bits, _, made.snapped.method, made.test = how
        made.snapped.cull, made.snapped.first_id = <tl_cull>culls[i], <int32_t>numbers[i]
        if is_exact:
            made.exact = whole_points(<double *>place, of_mesh.n, triangles, kept)
            made.snapped.mesh.exact = &made.exact.points
        else:
            made.snapped.mesh.vertices = <tl_vertex *>place
        source += 1
        found.append(made)
    return found


def joined(SnappedMesh like, room: Array, const int32_t[:, ::1] triangles) -> SnappedMesh:
    """Return some of the instances that `project_instances` placed in a room as one mesh, for drawing alone.

    `like`: one of them, which tells the rest. `triangles`: of theirs, by vertices of the whole room.
    """
    cdef uint8_t[::1] raw = as_bytes(room)
    cdef SnappedMesh made = like.copy()
    made.arrays = room, triangles
    made.snapped.mesh.source, made.snapped.first_id = NULL, 0
    made.snapped.triangles, made.snapped.n_triangles = &triangles[0, 0], triangles.shape[0]
    if like.exact is not None:
        made.snapped.mesh.n_vertices = raw.shape[0] // <int64_t>(TL_PLACED * sizeof(double))
        made.exact = whole_points(<double *>&raw[0], made.snapped.mesh.n_vertices, triangles, made.arrays)
        made.snapped.mesh.exact = &made.exact.points
    else:
        made.snapped.mesh.n_vertices = raw.shape[0] // <int64_t>sizeof(tl_vertex)
        made.snapped.mesh.vertices = <tl_vertex *>&raw[0]
    return made


cdef inline tl_vertex_counts project_whole(const tl_source *source, Viewport viewport, uint8_t *place,
                                           bint is_exact) noexcept nogil:
    """Project all vertices of a mesh into points or records."""
    cdef tl_projected out
    if is_exact:
        out = points_to(<double *>place)
        return K.project_to(source, 0, source.n, &viewport.view, &out)
    return K.project(source, 0, source.n, &viewport.view, <tl_vertex *>place, NULL)


cdef bint set_matrix(tl_source *source, const double *matrix, float *rounded) noexcept:
    """Give a mesh its matrix, in its own type, or NULL if that cannot hold it; return whether every w is 1."""
    cdef int k
    source.matrix = matrix
    if source.scalar == TL_F32:
        source.matrix = rounded
        for k in range(16):
            rounded[k] = <float>matrix[k]
            if isinf(rounded[k]):
                source.matrix = NULL
    return matrix[12] == 0 and matrix[13] == 0 and matrix[14] == 0 and matrix[15] == 1


cdef UnsnappedPoints whole_points(const double *points, int64_t n, const int32_t[:, ::1] triangles, object arrays):
    """Points (n, PLACED) in `arrays` that are not snapped, of triangles that no plane cuts."""
    cdef UnsnappedPoints made = UnsnappedPoints.__new__(UnsnappedPoints)
    memset(&made.counted, 0, sizeof(made.counted))
    memset(&made.points, 0, sizeof(made.points))
    made.arrays, made.n_vertices, made.points.band = arrays, n, 1.0
    made.points.points, made.points.n_points, made.points.stride = points, n, TL_PLACED
    made.points.triangles, made.points.n_triangles = &triangles[0, 0], triangles.shape[0]
    return made
