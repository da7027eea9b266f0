# Windows of huge rasters: which triangles each of them needs; visibility buffers put together. Included by kernels.pyx.


def list_spans(tuple tiling, const double[:, :, ::1] corners_px,
               int64_t first_triangle, int64_t[::1] starts, int32_t[:, ::1] spans):
    """Count the spans of each row of windows into starts[row + 1], or write them where spans is not None.

    `tiling`: width and height of the raster, those of a window, sub-pixel bits. Returns the first triangle that cannot
    be snapped, or -1.
    """
    cdef tl_tiling t
    cdef int64_t bad = -1
    cdef tl_window_span *out = NULL
    t.width_px, t.height_px, t.window_width_px, t.window_height_px, t.subpixel_bits = tiling
    if spans is not None:
        if not spans.shape[0]:
            return -1
        out = <tl_window_span *>&spans[0, 0]
    if corners_px.shape[0]:
        with nogil:
            bad = K.list_spans(&t, &corners_px[0, 0, 0], corners_px.shape[0], first_triangle, &starts[0], out)
    return bad


def merge_fragments(int32_t[::1] ids, float[::1] depth, const int32_t[::1] other_ids, const float[::1] other_depth,
                    int32_t first_id, int rule, int64_t first, int64_t end):
    """Merge pixels [first, end) of two visibility buffers into the first; `rule`: `tl_merge_rule`."""
    cdef tl_merge m
    if first >= end:
        return
    m.ids, m.depth, m.other_ids, m.other_depth = &ids[0], &depth[0], &other_ids[0], &other_depth[0]
    m.first_id, m.rule = first_id, <tl_merge_rule>rule
    with nogil:
        K.merge_fragments(&m, first, end)


def name_triangles(int32_t[::1] ids, int64_t first, int64_t end, const int32_t[::1] names):
    """Let names[1 + id] take the place of ids [first, end)."""
    if first < end:
        with nogil:
            K.name_triangles(&ids[0], first, end, &names[0])
