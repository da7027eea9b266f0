# The most pixels that a visible point moves by when it moves by a unit of the mesh: it decides the level of detail.
# _meshes/lod/detail.py states the rules.

cdef int EXTENT = 10  # numbers of a row: lowest and highest x, y, z; centre and radius of the sphere round it


cdef double dot3(const double *a, const double *b) noexcept nogil:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


cdef double lesser(double a, double b) noexcept nogil:
    return b if b < a else a


cdef double larger(double a, double b) noexcept nogil:
    return b if b > a else a


cdef double least_in_box(const double *row, const double *low, const double *high) noexcept nogil:
    """The least value of an affine function in a box."""
    cdef double value = row[3]
    cdef int k
    for k in range(3):
        value = value + lesser(row[k] * low[k], row[k] * high[k])
    return value


cdef double least_on(const double *row, const double *low, const double *high, const double *extents, int n) noexcept nogil:
    """A lower bound of an affine function on n surfaces: by their box, or by their spheres."""
    cdef double length = sqrt(dot3(row, row)), sphere = INFINITY
    cdef int i
    for i in range(n):
        sphere = lesser(sphere, dot3(row, extents + EXTENT * i + 6) - length * extents[EXTENT * i + 9])
    return larger(least_in_box(row, low, high), row[3] + sphere)


cdef double stretch(const double *a, const double *b) noexcept nogil:
    """The largest singular value of a matrix of two rows."""
    cdef double aa = dot3(a, a), ab = dot3(a, b), bb = dot3(b, b), half = (aa - bb) / 2
    return sqrt((aa + bb) / 2 + sqrt(half * half + ab * ab))


cdef double pixels_a_unit(const double *m, double width, double height, const double *window, const double *extents,
                          int n) noexcept nogil:
    """The bound of `pixels_per_unit`, NaN where there is none. Never less for more surfaces."""
    cdef double low[3]
    cdef double high[3]
    cdef double row[4]
    cdef double ends[2][2]
    cdef double places[2][2]
    cdef double moves[2][2][3]
    cdef double corner[3]
    cdef double of_size[2]
    cdef double nearest, w, at, most = 0.0
    cdef const double *of_w = m + 12
    cdef int i, k, axis
    for k in range(3):
        low[k], high[k] = extents[k], extents[3 + k]
        for i in range(1, n):
            low[k], high[k] = lesser(low[k], extents[EXTENT * i + k]), larger(high[k], extents[EXTENT * i + 3 + k])
    for i in range(5):  # beyond a side of the window, or behind the eye: nothing shows
        for k in range(4):
            row[k] = -of_w[k] if i == 4 else (-1.0 if i % 2 else 1.0) * (window[i] * of_w[k] - m[4 * (i // 2) + k])
        if least_in_box(row, low, high) > 0.0:
            return 0.0
    nearest = least_on(of_w, low, high, extents, n)
    if not nearest > 0.0:
        return NAN
    for i in range(2):  # within near and far
        for k in range(4):
            row[k] = of_w[k] + m[8 + k] if i == 0 else of_w[k] - m[8 + k]
        if not least_on(row, low, high, extents, n) >= 0.0:
            return NAN
    for axis in range(2):
        ends[axis][0], ends[axis][1] = window[2 * axis], window[2 * axis + 1]
    if least_in_box(of_w, low, high) > 0.0:  # then the box is drawn within the hull of its corners
        for axis in range(2):
            places[axis][0], places[axis][1] = INFINITY, -INFINITY
        for i in range(8):
            for k in range(3):
                corner[k] = high[k] if i >> k & 1 else low[k]
            w = dot3(of_w, corner) + of_w[3]
            for axis in range(2):
                at = (dot3(m + 4 * axis, corner) + m[4 * axis + 3]) / w
                places[axis][0], places[axis][1] = lesser(places[axis][0], at), larger(places[axis][1], at)
        for axis in range(2):
            ends[axis][0], ends[axis][1] = larger(ends[axis][0], places[axis][0]), lesser(ends[axis][1], places[axis][1])
        for axis in range(2):
            if ends[axis][0] > ends[axis][1]:
                return 0.0
    of_size[0], of_size[1] = width / 2, height / 2
    for axis in range(2):
        for i in range(2):
            for k in range(3):
                moves[axis][i][k] = of_size[axis] * (m[4 * axis + k] - ends[axis][i] * of_w[k])
    for i in range(2):
        for k in range(2):
            most = larger(most, stretch(moves[0][i], moves[1][k]))
    return most / nearest * (1 + 1e-9)  # a billionth more for rounding in float64


def pixels_per_unit(const double[:, ::1] matrix, size: tuple[int, int], const double[::1] window,
                    const double[:, ::1] extents) -> float | None:
    """Return the most pixels that a visible point moves by when it moves by a unit, on surfaces of these extents (N, 10).

    None where there is no bound. `matrix`: clip from object; `window`: lower and upper x, and y, in normalised device
    coordinates.
    """
    cdef double scale = pixels_a_unit(&matrix[0, 0], size[0], size[1], &window[0], &extents[0, 0], extents.shape[0])
    return None if isnan(scale) else scale


def coarsest_levels(const double[:, :, ::1] matrices, size: tuple[int, int], const double[::1] window,
                    const double[:, ::1] extents, const double[::1] bounds, double tolerance, int64_t[::1] levels,
                    double[::1] scales):
    """Write the coarsest level that is surely within a tolerance, under each matrix (N, 4, 4); level 0 is the mesh.

    `extents`, `bounds`: of the levels; `scales`: pixels per unit of the chosen level.
    """
    cdef double width = size[0], height = size[1], least, scale
    cdef double both[20]
    cdef int64_t i
    cdef int k
    for i in range(matrices.shape[0]):
        levels[i], scales[i] = 0, 0.0
        least = pixels_a_unit(&matrices[i, 0, 0], width, height, &window[0], &extents[0, 0], 1)
        if isnan(least):
            continue
        memcpy(both, &extents[0, 0], sizeof(double) * EXTENT)
        for k in range(extents.shape[0] - 1, 0, -1):
            if bounds[k] * least <= tolerance:  # the scale is no less where the level reaches beyond the mesh
                memcpy(both + EXTENT, &extents[k, 0], sizeof(double) * EXTENT)
                scale = pixels_a_unit(&matrices[i, 0, 0], width, height, &window[0], both, 2)
                if not isnan(scale) and bounds[k] * scale <= tolerance:
                    levels[i], scales[i] = k, scale
                    break


cdef int64_t choose_under(const double *m, double width, double height, const double *window, const double *extents,
                          const double *bounds, const int64_t *counts, int64_t level, int64_t first, int64_t part,
                          double tolerance, int32_t *chosen, int64_t n, double *off) noexcept nogil:
    """Append a part, or the finer parts that replace it, to n chosen parts; returns how many. `first`: row 0 of its level."""
    cdef int64_t row = first + part, n_children, k
    cdef double scale = 0.0
    if level > 0:
        scale = pixels_a_unit(m, width, height, window, extents + EXTENT * row, 1)
    if level == 0 or bounds[row] * scale <= tolerance:  # false where the scale is NaN
        chosen[n] = <int32_t>row
        off[0] = larger(off[0], bounds[row] * scale)
        return n + 1
    n_children = counts[level - 1] // counts[level]
    for k in range(n_children * part, n_children * (part + 1)):
        n = choose_under(m, width, height, window, extents, bounds, counts, level - 1, first - counts[level - 1], k,
                         tolerance, chosen, n, off)
    return n


def choose_parts(const double[:, ::1] matrix, size: tuple[int, int], const double[::1] window,
                 const double[:, ::1] extents, const double[::1] bounds, const int64_t[::1] counts, double tolerance,
                 int32_t[::1] chosen) -> tuple[int, float]:
    """Write the rows of the coarsest parts that are surely within a tolerance, of the mesh where no coarser part is.

    `extents` (N, 10), `bounds`: of the parts, first of the mesh, then level by level; `counts`: how many parts a level
    has. Returns how many parts are chosen, and a bound of their error in pixels.
    """
    cdef double width = size[0], height = size[1], off = 0.0
    cdef int64_t top = counts.shape[0] - 1, first = bounds.shape[0] - counts[counts.shape[0] - 1], part, n = 0
    for part in range(counts[top]):
        n = choose_under(&matrix[0, 0], width, height, &window[0], &extents[0, 0], &bounds[0], &counts[0], top, first,
                         part, tolerance, &chosen[0], n, &off)
    return n, off
