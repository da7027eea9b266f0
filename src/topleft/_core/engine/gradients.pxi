# Tensors of pixels and their gradients. Included by kernels.pyx.

MOST_LEVELS = TL_MOST_LEVELS
SUMS_OF_POINTS = TL_SUMS_OF_POINTS
IDS_ROOM = TL_IDS_ROOM
HEAD_OF_FACE = TL_HEAD_OF_FACE
SUMS_OF_FACE = TL_SUMS_OF_FACE
ROWS_KEPT = TL_ROWS_KEPT
PAIR_BYTES = TL_PAIR_BYTES
FACE_ROWS = TL_FACE_ROWS


cdef const void *first_of(array: object):
    """Return the address of a contiguous array, NULL for None; the caller holds the array."""
    cdef Py_buffer held
    if array is None:
        return NULL
    PyObject_GetBuffer(array, &held, PyBUF_SIMPLE)
    cdef const void *first = held.buf if held.len else NULL
    PyBuffer_Release(&held)
    return first


cdef tl_grad_texture looked_up(levels: list[Array], codes: tuple[int, int], arrays: tuple[Array | None, ...]):
    """Return `tl_grad_texture` of the parameters of `GradientView.texels`."""
    cdef tl_grad_texture t
    cdef int64_t n_texels = 0
    cdef int k
    memset(&t, 0, sizeof(t))
    t.n_levels, t.n_channels = len(levels), levels[0].shape[3]
    for k in range(len(levels)):
        t.levels[k], t.heights[k], t.widths[k] = first_of(levels[k]), levels[k].shape[1], levels[k].shape[2]
        t.first_texels[k] = n_texels
        n_texels += levels[k].shape[0] * levels[k].shape[1] * levels[k].shape[2]
    t.filter, t.edge = <tl_texel_filter><int>codes[0], <tl_texel_edge><int>codes[1]
    t.uv, t.uv_da, t.bias = first_of(arrays[0]), first_of(arrays[1]), first_of(arrays[2])
    t.out = <void *>first_of(arrays[3])
    return t


cdef class GradientView:
    """A picture and the mesh in it: `tl_grad_view`."""

    cdef tl_grad_view view
    cdef object arrays

    def __init__(self, pos: Array, const int32_t[:, ::1] tri, size: tuple[int, int], scale: tuple[float, float],
                 shift: tuple[float, float], double z_most):
        """`pos` (V, 4) float32 or float64, the dtype of all tensors; `size` is width and height."""
        self.arrays = (pos, tri)
        self.view.pos, self.view.n_vertices, self.view.is_f64 = first_of(pos), pos.shape[0], pos.dtype == np.float64
        self.view.tri, self.view.n_triangles = &tri[0, 0] if tri.shape[0] else NULL, tri.shape[0]
        self.view.width, self.view.height = size
        self.view.z_most = z_most
        self.view.scale[0], self.view.scale[1] = scale
        self.view.shift[0], self.view.shift[1] = shift

    cdef tl_grad_view rows(self, int64_t first, int64_t end) noexcept:
        cdef tl_grad_view view = self.view
        view.first_row, view.end_row = first, end
        return view

    def points(self, const int32_t[:, ::1] ids, bint is_flipped, int64_t first_id, rast: Array, rast_db: Array | None,
               int64_t first, int64_t end):
        """Write rows of `rast` and, unless it is None, `rast_db` (H, W, 4), from ids; flipped: row 0 is on top."""
        cdef tl_grad_view view = self.rows(first, end)
        cdef void *out = <void *>first_of(rast)
        cdef void *out_db = <void *>first_of(rast_db)
        cdef int64_t step = view.width
        cdef const int32_t *lowest
        if first >= end or view.width == 0:
            return
        lowest = &ids[0, 0]
        if is_flipped:
            lowest, step = &ids[ids.shape[0] - 1, 0], -step
        with nogil:
            K.grad_points(&view, lowest, step, first_id, out, out_db)

    def points_vjp(self, rast: Array, g_rast: Array, g_db: Array | None, GradientSums faces, GradientSums sums,
                   int64_t first, int64_t end) -> int:
        """The kernel `grad_points_vjp`. `faces`: scratch by triangle, SUMS_OF_POINTS columns."""
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_points p
        cdef int64_t bad
        p.rast, p.g_rast, p.g_db = first_of(rast), first_of(g_rast), first_of(g_db)
        p.faces, p.vertices = &faces.sums, &sums.sums
        with nogil:
            bad = K.grad_points_vjp(&view, &p)
        return bad

    def values(self, attr: Array, const int32_t[::1] wanted, arrays: tuple[Array | None, ...],
               GradientSums sums or None, int64_t first, int64_t end) -> int:
        """Write rows of attributes (V, K); with sums, of their gradients. Returns as `points_vjp` does.

        `arrays`: rast, rast_db, out, out_da, and with sums g_rast, g_rast_db; None where an array is absent.
        """
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_values v
        cdef int64_t bad
        memset(&v, 0, sizeof(v))
        v.attr, v.n_attr, v.n_columns = first_of(attr), attr.shape[0], attr.shape[1]
        v.wanted, v.n_wanted = &wanted[0] if wanted.shape[0] else NULL, wanted.shape[0]
        v.rast, v.rast_db = first_of(arrays[0]), first_of(arrays[1])
        v.out, v.out_da = <void *>first_of(arrays[2]), <void *>first_of(arrays[3])
        if sums is None:
            with nogil:
                bad = K.grad_values(&view, &v)
            return bad
        v.g_rast, v.g_rast_db = <void *>first_of(arrays[4]), <void *>first_of(arrays[5])
        with nogil:
            bad = K.grad_values_vjp(&view, &v, &sums.sums)
        return bad

    def texels(self, levels: list[Array], codes: tuple[int, int], arrays: tuple[Array | None, ...], int64_t first,
               int64_t end):
        """Write rows of a texture, levels (., H, W, C).

        `codes`: `tl_texel_filter` and `tl_texel_edge` of ``csrc/grad/grad.h``. `arrays`: uv, uv_da, bias, out; None where an
        array is absent.
        """
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_texture t = looked_up(levels, codes, arrays)
        with nogil:
            K.grad_texels(&view, &t)

    def texels_vjp(self, levels: list[Array], codes: tuple[int, int], arrays: tuple[Array | None, ...],
                   GradientSums sums or None, int64_t first, int64_t end):
        """Backward of `texels`: write rows of the gradients of coordinates, accumulate the gradients of texels in `sums`.

        `arrays`: as for `texels`, `out` a gradient, and g_uv, g_uv_da, g_bias. Without g_uv the gradients of coordinates
        are skipped, without sums the gradients of texels. `sums` have a multiple of four columns, the first C are used.
        """
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_texture t = looked_up(levels, codes, arrays)
        t.g_uv, t.g_uv_da = <void *>first_of(arrays[4]), <void *>first_of(arrays[5])
        t.g_bias = <void *>first_of(arrays[6])
        cdef tl_grad_sums *of_texels = NULL if sums is None else &sums.sums
        with nogil:
            K.grad_texels_vjp(&view, &t, of_texels)

    def outline(self, mesh: tuple[Array, Array, Array], int32_t[::1] sides, bint has_sides, int64_t part, int64_t n_parts):
        """Write a part of the positions of vertices (V, 2), pixels, and of sides (T); with all sides, of outlines (T).

        `mesh`: across, places, outline, as `edges` takes them.
        """
        cdef tl_grad_outline o
        if not sides.shape[0]:
            return
        o.across, o.places = <const int32_t *>first_of(mesh[0]), <double *>first_of(mesh[1])
        o.sides, o.outline = &sides[0], <int32_t *>first_of(mesh[2])
        o.part, o.n_parts = part, n_parts
        with nogil:
            if has_sides:
                K.mark_silhouettes(&self.view, &o)
            else:
                K.grad_sides(&self.view, &o)

    def edges(self, mesh: tuple[Array, Array, Array], int32_t[:, ::1] scratch, int rule,
              arrays: tuple[Array | None, ...], GradientSums sums or None, int64_t first, int64_t end):
        """Write rows of a picture with smooth silhouettes; with sums, the gradients of its colours.

        `mesh`: across, places, outline. `scratch`: (3, W + IDS_ROOM). `arrays`: rast, color, out; with sums rast,
        color, gradients of out, gradients of color.
        """
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_edges e
        memset(&e, 0, sizeof(e))
        if first >= end or view.width == 0:
            return
        e.rast, e.color, e.n_channels = first_of(arrays[0]), first_of(arrays[1]), arrays[1].shape[2]
        e.across, e.places = <const int32_t *>first_of(mesh[0]), <const double *>first_of(mesh[1])
        e.outline = <const int32_t *>first_of(mesh[2])
        e.ids, e.rule = &scratch[0, 0], <tl_pair_rule>rule
        if sums is None:
            e.out = <void *>first_of(arrays[2])
            with nogil:
                K.grad_edges(&view, &e, NULL)
            return
        e.g_out, e.g_color = first_of(arrays[2]), <void *>first_of(arrays[3])
        with nogil:
            K.grad_edges(&view, &e, &sums.sums)

    def picture(self, const int32_t[:, ::1] ids, attr: Array, mesh: tuple[Array | None, ...],
                codes: tuple[int, float], pixels: tuple[Array | None, Array | None, Array | None],
                seen: tuple[Array, ...], int64_t n_faces, scratch: list[Array],
                sums: tuple[GradientSums, GradientSums], int64_t first, int64_t end) -> tuple[float, int]:
        """Write rows of a picture of `attr` (V, K) float32, or add their gradients to sums.

        `ids`: row 0 is on top. `mesh` and `scratch[0]`: as for `edges`; the arrays of `mesh` are None where `seen` is
        filled. `codes`: the rule and the weight of squares.
        `pixels`: the picture, its gradients, or a target whose squared differences count; two of the three are None.
        `seen` and the rest of `scratch`: fields of ``tl_grad_picture``. `sums`: by triangle, HEAD_OF_FACE columns and
        SUMS_OF_FACE for each three attributes; by vertex, four columns and a column for each attribute. Returns the sum
        of squares, and how many faces are visible.
        """
        cdef tl_grad_view view = self.rows(first, end)
        cdef tl_grad_picture l
        cdef GradientSums faces = sums[0], vertices = sums[1]
        cdef double squares
        memset(&l, 0, sizeof(l))
        if first >= end or view.width == 0 or attr.shape[1] == 0:
            return 0.0, 0
        l.ids, l.step = &ids[ids.shape[0] - 1, 0], -view.width
        l.attr, l.n_attr, l.n_columns = <const float *>first_of(attr), attr.shape[0], attr.shape[1]
        l.edges.across, l.edges.places = <const int32_t *>first_of(mesh[0]), <const double *>first_of(mesh[1])
        l.edges.outline, l.edges.rule = <const int32_t *>first_of(mesh[2]), <tl_pair_rule><int>codes[0]
        l.edges.ids, l.edges.n_channels = <int32_t *>first_of(scratch[0]), l.n_columns
        l.out, l.g_out = <float *>first_of(pixels[0]), <const float *>first_of(pixels[1])
        l.target, l.scale = <const float *>first_of(pixels[2]), codes[1]
        l.row_runs, l.row_pairs = <int64_t *>first_of(seen[0]), <int64_t *>first_of(seen[1])
        l.begins, l.run_faces = <int32_t *>first_of(seen[2]), <int32_t *>first_of(seen[3])
        l.of_faces, l.face_step, l.n_faces = <int32_t *>first_of(seen[4]), seen[4].shape[1], n_faces
        l.pairs, l.steps = <void *>first_of(seen[5]), <float *>first_of(seen[6])
        l.window, l.moves = <float *>first_of(scratch[1]), <double *>first_of(scratch[2])
        l.rast = <float *>first_of(scratch[3])
        l.faces, l.vertices = &faces.sums, &vertices.sums
        with nogil:
            squares = K.grad_picture(&view, &l)
        return squares, l.n_faces


cdef class GradientSums:
    """Sums for the rows of a tensor that a band touches."""

    cdef tl_grad_sums sums
    cdef object arrays

    def __init__(self, int32_t[::1] slot_of, int32_t[::1] rows, double[:, ::1] sums):
        """`slot_of`: -1 for each row of the tensor; `rows`, `sums`: room for the rows that a band may touch."""
        self.arrays = (slot_of, rows, sums)
        self.sums.slot_of = &slot_of[0] if slot_of.shape[0] else NULL
        self.sums.rows = &rows[0] if rows.shape[0] else NULL
        self.sums.sums = &sums[0, 0] if sums.shape[0] and sums.shape[1] else NULL
        self.sums.n, self.sums.n_columns = 0, sums.shape[1]

    def add_to(self, outs: tuple[Array, ...]):
        """Add the sums to the rows of `outs`, arrays (N, K) that share the columns of the sums, and clear the sums."""
        cdef int64_t i, c, n_rows, n_columns, at, first = 0, n_sums = self.sums.n_columns
        cdef void *rows
        cdef const double *sums
        cdef bint is_f64
        for out in outs:
            n_rows, n_columns = out.shape
            rows, is_f64 = <void *>first_of(out), out.dtype == np.float64
            with nogil:
                for i in range(self.sums.n):
                    if self.sums.rows[i] >= n_rows:  # a row of the longer arrays of `outs`
                        continue
                    at, sums = self.sums.rows[i] * n_columns, self.sums.sums + i * n_sums + first
                    for c in range(n_columns):
                        if is_f64:
                            (<double *>rows)[at + c] += sums[c]
                        else:
                            (<float *>rows)[at + c] = <float>((<float *>rows)[at + c] + sums[c])
            first += n_columns
        self.sums.n = 0


def area_vjp(const double[:, ::1] points_px, const int32_t[:, ::1] triangles, const double[:, ::1] values or None,
             const double[:, :, ::1] grad, double[:, ::1] out):
    """Backward of areas times values (T, C), or 1: add the gradients of points to `out` (V, 2); `grad`: (H, W, C)."""
    cdef tl_grad_area p
    if not triangles.shape[0] or not grad.shape[0] or not grad.shape[1] or not grad.shape[2]:
        return
    p.points_px, p.triangles, p.n_triangles = &points_px[0, 0], &triangles[0, 0], triangles.shape[0]
    p.height, p.width, p.n_channels = grad.shape[0], grad.shape[1], grad.shape[2]
    p.values, p.grad, p.out = &values[0, 0] if values is not None else NULL, &grad[0, 0, 0], &out[0, 0]
    with nogil:
        K.grad_area(&p)
