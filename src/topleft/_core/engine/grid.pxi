# Rasterizes meshes into voxels (columns of crossings, bytes and shares, the voxels that triangles meet) and texels.


def column_words(int64_t n_steps) -> int:
    """Return how many uint64 a column of n_steps takes in `draw_crossings`."""
    return n_steps // 64 + 1


def draw_crossings(SnappedMesh mesh, uint64_t[:, :, ::1] bits, uint64_t[:, :, ::1] twos or None, int64_t n_steps,
                   bint is_set, int64_t first, int64_t end) -> int:
    """Store the crossings of rows [first, end) of columns (H, W, column_words): `tl_crossings`.

    With `twos` fronts are drawn, then backs.
    Returns as `SnappedMesh.draw` does.
    """
    cdef tl_crossings crossings
    cdef tl_peeled peeled
    cdef tl_target target
    cdef tl_window window = mesh.window(first, end - first, bits.shape[1])
    cdef tl_slice slice = no_slice()
    cdef int64_t bad_row
    cdef tl_snapped snapped = mesh.snapped
    if end <= first or not bits.shape[1]:
        return -1
    memset(&target, 0, sizeof(target))
    memset(&peeled, 0, sizeof(peeled))
    memset(&crossings, 0, sizeof(crossings))
    crossings.bits, crossings.n_words = &bits[first, 0, 0], bits.shape[2]
    crossings.n_steps, crossings.is_set = n_steps, is_set
    peeled.crossings = &crossings
    target.sink, target.stride_px, target.peeled = <tl_sink>TL_SINK_PEEL, bits.shape[1], &peeled
    slice.end = mesh.snapped.n_triangles
    if twos is not None:
        crossings.twos, snapped.cull = &twos[first, 0, 0], TL_CULL_BACK
    with nogil:
        bad_row = K.draw_mesh(&snapped, &window, &target, &slice)
        if crossings.twos and bad_row < 0:
            crossings.is_back, snapped.cull = 1, TL_CULL_FRONT
            bad_row = K.draw_mesh(&snapped, &window, &target, &slice)
    raise_if_given_up()
    return bad_row


def fill_columns(uint64_t[:, :, ::1] bits, const uint64_t[:, :, ::1] twos, int64_t first,
                 int64_t end) -> tuple[int, int, int]:
    """The kernel `fill_columns`: how many columns are odd, and nested of either way."""
    cdef int64_t n_odd = 0
    cdef int64_t[2] n_nested
    n_nested[0], n_nested[1] = 0, 0
    if end > first and bits.shape[1]:
        with nogil:
            n_odd = K.fill_columns(&bits[first, 0, 0], &twos[first, 0, 0], (end - first) * bits.shape[1], bits.shape[2],
                                   n_nested)
    return n_odd, n_nested[0], n_nested[1]


def expand_columns(const uint64_t[:, :, ::1] bits, uint8_t[:, :, ::1] out, int64_t first, int64_t end):
    """The kernel `expand_columns`."""
    if end > first and bits.shape[1]:
        with nogil:
            K.expand_columns(&bits[first, 0, 0], (end - first) * bits.shape[1], bits.shape[2], out.shape[2],
                             &out[first, 0, 0])


def count_columns(const uint64_t[:, :, ::1] bits, int sample_bits, float[:, :, ::1] out, int64_t first, int64_t end):
    """The kernel `count_columns`."""
    cdef int64_t row
    if out.shape[1] and out.shape[2]:
        with nogil:
            for row in range(first, end):
                K.count_columns(&bits[row << sample_bits, 0, 0], out.shape[1], bits.shape[2], out.shape[2], sample_bits,
                                &out[row, 0, 0])


def scatter_columns(const uint64_t[:, :, ::1] bits, uint8_t[::1] out, strides: tuple[int, int, int]):
    """The kernel `scatter_columns`."""
    cdef int64_t axis_strides[3]
    axis_strides[0], axis_strides[1], axis_strides[2] = strides
    if bits.shape[0] and bits.shape[1]:
        with nogil:
            K.scatter_columns(&bits[0, 0, 0], bits.shape[0], bits.shape[1], bits.shape[2], axis_strides, &out[0])


def touch_voxels(const double[:, ::1] points, const int32_t[:, ::1] triangles, int64_t first, int64_t end,
                 uint8_t[:, :, ::1] out):
    """The kernel `touch_voxels`."""
    cdef int64_t shape[3]
    shape[0], shape[1], shape[2] = out.shape[0], out.shape[1], out.shape[2]
    if end > first:
        with nogil:
            K.touch_voxels(&points[0, 0], points.shape[0], &triangles[0, 0], first, end, shape, &out[0, 0, 0])


cdef class Atlas:
    """Triangles in texels, and values of their corners: `tl_atlas`. The arrays have been checked."""

    cdef tl_atlas atlas
    cdef object arrays
    cdef int64_t height

    def __init__(self, const double[:, ::1] points, const int32_t[:, ::1] triangles, size: tuple[int, int],
                 const float[:, ::1] values, bint per_corner):
        """`points` (V, 2), at least one triangle; `values` (V, K), or (3 T, K) per corner."""
        self.arrays = (points, triangles, values)
        self.atlas.points, self.atlas.triangles, self.atlas.n_triangles = &points[0, 0], &triangles[0, 0], triangles.shape[0]
        self.atlas.width, self.height = size
        self.atlas.n_points = points.shape[0]
        self.atlas.values, self.atlas.n_values, self.atlas.per_corner = &values[0, 0], values.shape[1], per_corner

    def touch(self, int64_t first, int64_t end, int32_t[:, ::1] ids, float[:, ::1] squared, float[:, :, ::1] out):
        """The kernel `touch_texels`."""
        if end > first:
            with nogil:
                K.touch_texels(&self.atlas, first, end, &ids[0, 0], &squared[first, 0], &out[0, 0, 0])

    def average(self, int64_t first, int64_t end, double[:, :, ::1] sums, float[:, ::1] most, int32_t[:, ::1] ids,
                float[:, :, ::1] out):
        """The kernel `average_texels`."""
        if end > first:
            with nogil:
                K.average_texels(&self.atlas, first, end, &sums[first, 0, 0], &most[first, 0], &ids[0, 0], &out[0, 0, 0])


def find_in_rows(const int32_t[:, ::1] ids, int64_t first, int64_t end, int reach, int16_t[:, ::1] along):
    """The kernel `find_in_rows`."""
    if end > first and ids.shape[1]:
        with nogil:
            K.find_in_rows(&ids[0, 0], ids.shape[1], first, end, reach, &along[0, 0])


def find_gutter(const int16_t[:, ::1] along, int64_t first, int64_t end, int reach, int32_t[:, ::1] from_texel):
    """The kernel `find_gutter`."""
    cdef int32_t[::1] room = np.empty(max(1, 2 * along.shape[1]), np.int32)
    if end > first and along.shape[1]:
        with nogil:
            K.find_gutter(&along[0, 0], along.shape[1], along.shape[0], first, end, reach, &room[0], &from_texel[0, 0])


def copy_texels(const int32_t[:, ::1] from_texel, int64_t first, int64_t end, texels: Array):
    """The kernel `copy_texels`."""
    cdef uint8_t[::1] raw = as_bytes(texels)
    cdef int64_t n = from_texel.shape[0] * from_texel.shape[1], width = from_texel.shape[1]
    if end > first and n and raw.shape[0]:
        with nogil:
            K.copy_texels(&from_texel[0, 0], first * width, end * width, raw.shape[0] // n, &raw[0])


def add_taken(const int32_t[:, ::1] seen, const float[:, ::1] depth, const float[:, :, ::1] light,
              const double[:, ::1] clip_from_object, const double[::1] eye, bint keeps_best,
              const float[:, ::1] positions, const float[:, ::1] normals, const int32_t[::1] ids, int64_t first,
              int64_t end, float[:, ::1] sums, float[::1] weights):
    """The kernel `add_taken`."""
    cdef tl_taken taken
    cdef int k
    taken.height, taken.width, taken.n_channels = light.shape[0], light.shape[1], light.shape[2]
    if end <= first or not (taken.height and taken.width):
        return
    taken.ids, taken.depth, taken.light, taken.keeps_best = &seen[0, 0], &depth[0, 0], &light[0, 0, 0], keeps_best
    for k in range(16):
        taken.clip_from_object[k] = clip_from_object[k // 4, k % 4]
    for k in range(4):
        taken.eye[k] = eye[k]
    with nogil:
        K.add_taken(&taken, &positions[0, 0], &normals[0, 0], &ids[0], first, end, &sums[0, 0], &weights[0])
