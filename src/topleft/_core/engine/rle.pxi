# Run lengths of masks and ids, down the columns. Included by kernels.pyx.

RLE_LINE = TL_RLE_LINE


def list_runs(pixels: Array, box: tuple[int, int, int, int], corner: tuple[int, int, int], int64_t background,
              int64_t first_key, int64_t first_picture, int32_t[::1] rows, int64_t[:, ::1] runs,
              int64_t n) -> tuple[int, int]:
    """Append the runs of pictures (N, H, W), of int32 or bytes, to a table of n: rows (start, end, key).

    `box`: left, top, right and bottom of the part to read of each picture; `corner`: x and y of pixel (0, 0) in the
    frame, and the height of the frame. `rows`: RLE_LINE numbers for each row of the box. The key of int32 pixels is
    their value, and the background has no runs; the key of bytes, 0 and 1, is first_key plus the index of the picture.
    Returns the number of runs, and the first picture for which there is no room.
    """
    cdef const uint8_t[::1] raw = as_bytes(pixels)
    cdef tl_run_source source
    cdef int64_t i, kept, at, n_pictures = pixels.shape[0], n_room = runs.shape[0], height = pixels.shape[1]
    cdef int64_t left = box[0], top = box[1]
    memset(&source, 0, sizeof(source))
    source.width, source.height, source.n_bytes = box[2] - left, box[3] - top, pixels.itemsize
    if source.width <= 0 or source.height <= 0 or not n_room:
        return n, n_pictures if n_room else first_picture
    source.stride, source.is_mask = pixels.shape[2] * source.n_bytes, source.n_bytes == 1
    source.left, source.top, source.frame_height = left + <int64_t>corner[0], top + <int64_t>corner[1], corner[2]
    source.background = background
    with nogil:
        for i in range(first_picture, n_pictures):
            at = (i * height + top) * source.stride + left * source.n_bytes
            source.pixels, source.key = &raw[at], first_key + i
            kept = n
            if not K.list_column_runs(&source, &rows[0], <tl_run *>&runs[0, 0], n_room, &n):
                n, n_pictures = kept, i
                break
    return n, n_pictures


def count_runs(const int64_t[:, ::1] runs, const int32_t[::1] objects, int64_t n_pixels, const int64_t[::1] starts,
               int64_t[::1] n_counts, int64_t[::1] counts):
    """The kernel `count_runs`."""
    cdef tl_rles rles
    cdef int64_t n = runs.shape[0]
    cdef int64_t[::1] ends = np.empty(n_counts.shape[0], np.int64)
    if not n_counts.shape[0]:
        return
    rles.n, rles.n_pixels, rles.starts = n_counts.shape[0], n_pixels, &starts[0]
    rles.n_counts, rles.ends, rles.counts = &n_counts[0], &ends[0], &counts[0]
    with nogil:
        K.count_runs(<const tl_run *>&runs[0, 0] if n else NULL, &objects[0] if n else NULL, n, &rles)


def write_counts(const int64_t[::1] starts, int64_t[::1] n_counts, int64_t[::1] counts, int64_t[::1] text_starts,
                 uint8_t[::1] text):
    """The kernel `write_counts`."""
    cdef tl_rles rles
    if not n_counts.shape[0]:
        return
    memset(&rles, 0, sizeof(rles))
    rles.n, rles.starts, rles.n_counts, rles.counts = n_counts.shape[0], &starts[0], &n_counts[0], &counts[0]
    with nogil:
        K.write_counts(&rles, &text_starts[0], &text[0])
