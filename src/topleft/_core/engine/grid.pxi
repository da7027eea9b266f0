# Meshes onto voxels: columns of crossings, bytes and shares, the voxels that triangles meet.


def column_words(int64_t n_steps) -> int:
    """Return how many uint64 a column of so many steps takes in `draw_crossings`."""
    return n_steps // 64 + 1


def draw_crossings(SnappedMesh mesh, uint64_t[:, :, ::1] bits, int64_t n_steps, bint is_set, int64_t first,
                   int64_t end) -> int:
    """Note the crossings of rows [first, end) of columns (H, W, column_words): `tl_crossings`.

    Returns as `SnappedMesh.draw` does.
    """
    cdef tl_crossings crossings
    cdef tl_peeled peeled
    cdef tl_target target
    cdef tl_window window = mesh.window(first, end - first, bits.shape[1])
    cdef tl_share share = no_share()
    cdef int64_t bad_row
    if end <= first or not bits.shape[1]:
        return -1
    memset(&target, 0, sizeof(target))
    memset(&peeled, 0, sizeof(peeled))
    crossings.bits, crossings.n_words = &bits[first, 0, 0], bits.shape[2]
    crossings.n_steps, crossings.is_set = n_steps, is_set
    peeled.crossings = &crossings
    target.sink, target.stride_px, target.peeled = <tl_sink>TL_SINK_PEEL, bits.shape[1], &peeled
    share.end = mesh.snapped.n_triangles
    with nogil:
        bad_row = K.draw(&mesh.snapped, &window, &target, &share)
    raise_if_given_up()
    return bad_row


def fill_columns(uint64_t[:, :, ::1] bits, int64_t first, int64_t end) -> int:
    """Fill rows [first, end) of columns between their crossings, in place; returns how many have an odd number of them."""
    cdef int64_t n_odd = 0
    if end > first and bits.shape[1]:
        with nogil:
            n_odd = K.fill_columns(&bits[first, 0, 0], (end - first) * bits.shape[1], bits.shape[2])
    return n_odd


def expand_columns(const uint64_t[:, :, ::1] bits, uint8_t[:, :, ::1] out, int64_t first, int64_t end):
    """Write a byte for each step of rows [first, end) of columns."""
    if end > first and bits.shape[1]:
        with nogil:
            K.expand_columns(&bits[first, 0, 0], (end - first) * bits.shape[1], bits.shape[2], out.shape[2],
                             &out[first, 0, 0])


def count_columns(const uint64_t[:, :, ::1] bits, int sample_bits, float[:, :, ::1] out, int64_t first, int64_t end):
    """Write the filled share of each voxel of rows [first, end), of which each axis has 2**sample_bits samples."""
    cdef int64_t row
    if out.shape[1] and out.shape[2]:
        with nogil:
            for row in range(first, end):
                K.count_columns(&bits[row << sample_bits, 0, 0], out.shape[1], bits.shape[2], out.shape[2], sample_bits,
                                &out[row, 0, 0])


def scatter_columns(const uint64_t[:, :, ::1] bits, uint8_t[::1] out, strides: tuple[int, int, int]):
    """Write 1 for each bit, at strides of a row, a column and a step."""
    cdef int64_t own[3]
    own[0], own[1], own[2] = strides
    if bits.shape[0] and bits.shape[1]:
        with nogil:
            K.scatter_columns(&bits[0, 0, 0], bits.shape[0], bits.shape[1], bits.shape[2], own, &out[0])


def touch_voxels(const double[:, ::1] points, const int32_t[:, ::1] triangles, int64_t first, int64_t end,
                 uint8_t[:, :, ::1] out):
    """Write 1 for the voxels that triangles [first, end) meet; points in voxels."""
    cdef int64_t shape[3]
    shape[0], shape[1], shape[2] = out.shape[0], out.shape[1], out.shape[2]
    if end > first:
        with nogil:
            K.touch_voxels(&points[0, 0], &triangles[0, 0], first, end, shape, &out[0, 0, 0])
