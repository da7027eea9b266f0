# The edges of a scene and their lines. Included by _engine.pyx, which declares the kernels.


def list_edges(Scene scene, int64_t[::1] starts, int32_t[::1] last_low, int32_t[::1] highs, uint64_t[::1] edges):
    """Write the edges of the triangles that are not culled; returns how many, -1 when an index is outside the vertices.

    `edges` has room for three a triangle; the others are scratch, as in `tl_edge_scratch`.
    """
    cdef tl_edge_scratch scratch
    cdef int64_t n = 0, bad_row = -1
    if scene.scene.n_triangles and scene.scene.mesh.n_vertices:
        scratch.starts, scratch.last_low, scratch.highs = &starts[0], &last_low[0], &highs[0]
        with nogil:
            bad_row = K.list_edges(&scene.scene, &scratch, &edges[0], &n)
    return n if bad_row < 0 else -1


def draw_lines(Scene scene, View view, const uint64_t[::1] edges, uint8_t[::1] pixels, const float[:, ::1] depth, double depth_bias,
               bint is_farthest, bint is_smooth, int64_t width, int64_t first_row, int64_t n_rows):
    """Clear the rows [first_row, first_row + n_rows) of a buffer that is `width` pixels wide and draw lines into them."""
    cdef tl_edges lines
    cdef tl_line_target target
    cdef tl_window window = scene.window(first_row, n_rows, width)
    if width == 0 or n_rows == 0:
        return
    lines.mesh, lines.n_edges = scene.scene.mesh, edges.shape[0]
    lines.view = &view.view if view is not None else NULL
    lines.edges = <const int32_t *>&edges[0] if edges.shape[0] else NULL
    target.is_smooth, target.is_farthest, target.depth_bias, target.stride_px = is_smooth, is_farthest, depth_bias, width
    target.pixels = &pixels[first_row * width * (4 if is_smooth else 1)]
    target.depth = &depth[first_row, 0] if depth is not None else NULL
    with nogil:
        K.draw_lines(&lines, &window, &target)
