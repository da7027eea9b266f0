# Small matrices, sines and roots, bit for bit equal on every machine: sums in a fixed order, no fused multiply-add, no
# library whose last bit depends on the processor.

from libc.math cimport fabs, floor, fmod, frexp, ldexp, rint

cdef double PI = 3.141592653589793
cdef double RADIANS_A_DEGREE = PI / 180.0
cdef double[13] ODD_PARTS = [1.0 / k for k in range(1, 26, 2)]


cdef object as_numbers(values, int n_dims):
    array = np.asarray(values, np.float64)
    if array.ndim != n_dims:
        raise ValueError(f"an array must have {n_dims} dimensions here, got shape {array.shape}")
    return array


cdef void multiply(const double[:, :] left, const double[:, :] right, double[:, ::1] out) noexcept nogil:
    cdef Py_ssize_t i, j, k
    cdef double total
    for i in range(left.shape[0]):
        for j in range(right.shape[1]):
            total = 0.0
            for k in range(left.shape[1]):
                total = total + left[i, k] * right[k, j]
            out[i, j] = total


def product(a: ArrayLike, b: ArrayLike) -> F64:
    """Return the matrix product of float64 arrays (n, k) and (k, m); either may be a vector (k,)."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    is_row, is_column = a.ndim == 1, b.ndim == 1
    cdef const double[:, :] left = as_numbers(a[None] if is_row else a, 2)
    cdef const double[:, :] right = as_numbers(b[:, None] if is_column else b, 2)
    if left.shape[1] != right.shape[0]:
        raise ValueError(f"matrices must fit, got shapes {a.shape} and {b.shape}")
    result = np.empty((left.shape[0], right.shape[1]))
    cdef double[:, ::1] out = result
    if left.shape[0] < HELD_VERTICES:
        multiply(left, right, out)
    else:
        with nogil:
            multiply(left, right, out)
    if is_row and is_column:
        return float(result[0, 0])
    return result[0] if is_row else result[:, 0] if is_column else result


cdef int invert(double[8] *rows, Py_ssize_t n) except -1:
    """Write the inverse of a matrix (n, n), n at most 4, into columns n to 2 n of `rows`; overwrites the matrix."""
    cdef Py_ssize_t i, j, k, best
    cdef double factor, pivot
    for i in range(n):
        for j in range(n):
            rows[i][n + j] = 1.0 if i == j else 0.0
    for k in range(n):  # the largest number of each column becomes the pivot
        best = k
        for i in range(k + 1, n):
            if fabs(rows[i][k]) > fabs(rows[best][k]):
                best = i
        if rows[best][k] == 0.0:
            raise np.linalg.LinAlgError("Singular matrix")
        if best != k:
            for j in range(2 * n):
                rows[k][j], rows[best][j] = rows[best][j], rows[k][j]
        pivot = rows[k][k]
        for i in range(n):
            if i != k:
                factor = rows[i][k] / pivot
                for j in range(k, 2 * n):
                    rows[i][j] = rows[i][j] - factor * rows[k][j]
    for i in range(n):
        for j in range(n):
            rows[i][n + j] = rows[i][n + j] / rows[i][i]
    return 0


def inverse(a: Array) -> F64:
    """Return the inverse of a float64 matrix (n, n), n at most 4; a LinAlgError if it is singular."""
    cdef const double[:, :] matrix = as_numbers(a, 2)
    cdef Py_ssize_t n = matrix.shape[0], i, j
    cdef double[4][8] rows
    if matrix.shape[1] != n or n > 4:
        raise ValueError(f"a matrix must be square, of 4 rows at most, got shape {np.shape(a)}")
    for i in range(n):
        for j in range(n):
            rows[i][j] = matrix[i, j]
    invert(rows, n)
    result = np.empty((n, n))
    cdef double[:, ::1] out = result
    for i in range(n):
        for j in range(n):
            out[i, j] = rows[i][n + j]
    return result


cdef double determinant_of(const double[:, :] m) noexcept:
    """The determinant of the first three rows and columns."""
    return (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )


def determinant(a: ArrayLike) -> float:
    """Return the determinant of a float64 matrix (3, 3)."""
    cdef const double[:, :] m = as_numbers(a, 2)
    if m.shape[0] != 3 or m.shape[1] != 3:
        raise ValueError(f"a matrix must have shape (3, 3), got {np.shape(a)}")
    return determinant_of(m)


cdef int handedness(const double[:, :] m) noexcept:
    """1 of a matrix (4, 4) that is surely a pose, -1 of a pose that mirrors; 0 where the caller must test exactly.

    A pose is finite, ends in 0 0 0 1 and is regular: the least singular value of three rows is at least 2 |det| / |m|^2,
    in Frobenius' norm, and 1e-9 |m| is enough.
    """
    cdef Py_ssize_t i, j
    cdef double squares = 0.0, shift = 0.0, volume
    if m[3, 0] != 0.0 or m[3, 1] != 0.0 or m[3, 2] != 0.0 or m[3, 3] != 1.0:
        return 0
    for i in range(3):
        shift = shift + m[i, 3] - m[i, 3]  # NaN where it is not finite
        for j in range(3):
            squares = squares + m[i, j] * m[i, j]
    volume = determinant_of(m)
    if not (shift == 0.0 and 2.0 * fabs(volume) > 1e-9 * squares * sqrt(squares)):
        return 0
    return -1 if volume < 0.0 else 1


def is_pose(a: Array) -> bool:
    """Return whether a float64 matrix, (4, 4), is surely a pose: finite, regular, with the last row 0 0 0 1."""
    return handedness(a) != 0


def are_mirrored(const double[:, :, :] poses) -> U8 | None:
    """Return 1 for each of poses (N, 4, 4) that mirrors; None unless all are surely poses."""
    cdef Py_ssize_t k
    cdef int hand
    mirrors = np.empty(poses.shape[0], np.uint8)
    cdef uint8_t[::1] out = mirrors
    for k in range(poses.shape[0]):
        hand = handedness(poses[k])
        if not hand:
            return None
        out[k] = hand < 0
    return mirrors


cdef struct Rays:
    # A camera in a space: rows of the eye, four of rays, three of the matrix to eye space, the origin.
    bint has_perspective
    double[9][3] rows
    double scale


@cython.cdivision(True)  # IEEE: no number where there is none
cdef int find_rays(const double[:, ::1] clip_from_eye, const double[:, ::1] view, const double *center, double width, double height,
                   Rays *out) except -1:
    """Compute the `Rays` of a camera in a space with its origin at `center`; `view`: (4, 4), to eye space."""
    cdef double[4][4] clip
    cdef double[3] offset
    cdef double[4][8] rows
    cdef Py_ssize_t i, j, k
    cdef double total, unit
    for i in range(4):
        for j in range(4):
            total = 0.0
            for k in range(4):
                total = total + clip_from_eye[i, k] * view[k, j]
            clip[i][j] = total
    out.has_perspective = clip[3][0] != 0.0 or clip[3][1] != 0.0 or clip[3][2] != 0.0
    cdef int[3] clip_rows = [0, 1, 3 if out.has_perspective else 2]
    for i in range(3):
        for j in range(3):
            rows[i][j] = clip[clip_rows[i]][j]
    invert(rows, 3)
    for i in range(3):
        total = 0.0
        for k in range(3):
            total = total + rows[i][3 + k] * clip[clip_rows[k]][3]
        offset[i] = total
    # the corner, one column, one row and the whole depth, of clip space
    cdef double[4][3] ends = [[-1.0, 1.0, 1.0 if out.has_perspective else -1.0], [2.0 / width, 0.0, 0.0], [0.0, -2.0 / height, 0.0], [0.0, 0.0, 2.0]]
    for i in range(4):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total = total + ends[i][k] * rows[j][3 + k]
            out.rows[1 + i][j] = total
    if out.has_perspective:
        for j in range(3):
            out.rows[0][j] = -offset[j] - center[j]
    else:
        for j in range(3):
            out.rows[1][j] = out.rows[1][j] - (offset[j] + center[j])
        unit = sqrt((out.rows[4][0] * out.rows[4][0] + out.rows[4][1] * out.rows[4][1]) + out.rows[4][2] * out.rows[4][2])
        for j in range(3):
            out.rows[0][j] = -out.rows[4][j] / unit
    out.scale = cube_root(determinant_of(view))
    for i in range(3):
        total = 0.0
        for k in range(3):
            out.rows[5 + i][k] = view[i, k] / out.scale
            total = total + view[i, k] * center[k]
        out.rows[8][i] = total + view[i, 3]
    return 0


def camera_rays(const double[:, ::1] clip_from_eye, const double[:, ::1] view, const double[::1] center, double width,
                double height) -> tuple[bool, F64, float]:
    """Return the fields of `CameraRays`, _meshes/picture/look.py, of a camera in a space with its origin at `center`.

    `view`: (4, 4), to eye space. The result: whether there is perspective, rows (9, 3) float64, the scale.
    """
    cdef Rays rays
    find_rays(clip_from_eye, view, &center[0], width, height, &rays)
    result = np.empty((9, 3))
    cdef double[:, ::1] out = result
    memcpy(&out[0, 0], rays.rows, sizeof(rays.rows))
    return rays.has_perspective, result, rays.scale


def stretches(const double[:, :, ::1] views) -> list[tuple[bool, F64 | None]]:
    """Return whether each matrix (N, 4, 4) mirrors, and its stretch (4, 4) unless it is a rotation times a scale.

    The matrix times the inverse of the stretch is a rotation, and a translation.
    """
    cdef const double[:, ::1] view
    cdef double[:, ::1] stretch, turned
    cdef double[3][3] g
    cdef double turn
    cdef Py_ssize_t n
    cdef int i, j
    cdef bint is_fine
    cdef list results = []
    for n in range(views.shape[0]):
        view = views[n]
        turn = determinant_of(view)
        if turn > 0.0 and keeps_angles(view):
            results.append((False, None))
            continue
        for i in range(3):
            for j in range(i, 3):
                g[i][j] = (view[0, i] * view[0, j] + view[1, i] * view[1, j]) + view[2, i] * view[2, j]
        for i in range(3):
            for j in range(2, i - 1, -1):  # the diagonal last
                g[i][j] = rounded_beside(g[i][j], g[i][i] if i == j else sqrt(g[i][i] * g[j][j]))
        factor = np.eye(4)
        stretch = factor
        root_of(g, stretch)
        if turn < 0.0:
            for j in range(3):
                stretch[0, j] = -stretch[0, j]
        is_fine = stretch[1, 1] > 0.0 and stretch[2, 2] > 0.0  # nor NaN
        if is_fine:
            turned = product(view, inverse(factor))
            is_fine = keeps_angles(turned)
        for i in range(3 if not is_fine else 0):
            for j in range(3):
                stretch[i, j] = view[i, j]
        results.append((not turn > 0.0, factor))
    return results


cdef bint keeps_angles(const double[:, ::1] view) noexcept:
    """Whether a matrix (4, 4) is a rotation times a scale, and a translation; or that and a mirror."""
    cdef double[3] squares, products
    cdef double scale, error = 0.0
    cdef int i, j
    for i in range(3):
        j = (i + 1) % 3
        squares[i] = (view[i, 0] * view[i, 0] + view[i, 1] * view[i, 1]) + view[i, 2] * view[i, 2]
        products[i] = (view[i, 0] * view[j, 0] + view[i, 1] * view[j, 1]) + view[i, 2] * view[j, 2]
    scale = ((squares[0] + squares[1]) + squares[2]) / 3
    for i in range(3):
        error = max(error, fabs(products[i]), fabs(squares[i] - scale))
    return error <= 1e-9 * scale


cdef double rounded_beside(double number, double unit) noexcept:
    """A number rounded to 40 bits of another."""
    cdef int exponent
    frexp(unit, &exponent)
    return ldexp(rint(ldexp(number, 40 - exponent)), exponent - 40)


@cython.cdivision(True)  # IEEE: no number where there is none
cdef void root_of(double[3] *g, double[:, ::1] out) noexcept:
    """Write the upper triangular matrix r with r^T r = g (Cholesky)."""
    cdef double a = sqrt(g[0][0])
    cdef double b = g[0][1] / a, c = g[0][2] / a
    cdef double d = sqrt(g[1][1] - b * b)
    cdef double e = (g[1][2] - b * c) / d
    out[0, 0], out[0, 1], out[0, 2] = a, b, c
    out[1, 1], out[1, 2] = d, e
    out[2, 2] = sqrt((g[2][2] - c * c) - e * e)


def row_products(a: ArrayLike, b: ArrayLike) -> F64:
    """Return the dot products (N,) of the rows of a float64 array (N, 3) with a vector, or with the rows of another."""
    cdef const double[:, :] left = as_numbers(a, 2)
    cdef const double[:, :] right = np.broadcast_to(as_numbers(b, np.ndim(b)), np.shape(a))
    cdef Py_ssize_t i, n = left.shape[0]
    if left.shape[1] != 3:
        raise ValueError(f"rows must have three numbers, got shape {np.shape(a)}")
    result = np.empty(n)
    cdef double[::1] out = result
    with nogil:
        for i in range(n):
            out[i] = (left[i, 0] * right[i, 0] + left[i, 1] * right[i, 1]) + left[i, 2] * right[i, 2]
    return result


def length(vector: ArrayLike) -> float:
    """Return the root of the sum of the squares of a vector of float64."""
    cdef const double[:] numbers = as_numbers(vector, 1)
    cdef double total = 0.0
    cdef Py_ssize_t i
    for i in range(numbers.shape[0]):
        total = total + numbers[i] * numbers[i]
    return sqrt(total)


def cosine_and_sine(double degrees) -> tuple[float, float]:
    """Return the cosine and the sine of an angle in degrees; exact 0, 1 and -1 at multiples of 90."""
    cdef double turns = fmod(degrees, 360.0)
    cdef int quarter = <int>rint(turns / 90.0)
    cdef double x = (turns - 90.0 * quarter) * RADIANS_A_DEGREE, square = x * x
    # Taylor's series within an eighth of a turn: the next terms are below half a last bit.
    cdef double sine = 1.0 / 355687428096000.0
    sine = sine * square - 1.0 / 1307674368000.0
    sine = sine * square + 1.0 / 6227020800.0
    sine = sine * square - 1.0 / 39916800.0
    sine = sine * square + 1.0 / 362880.0
    sine = sine * square - 1.0 / 5040.0
    sine = sine * square + 1.0 / 120.0
    sine = sine * square - 1.0 / 6.0
    sine = x + x * (square * sine)
    cdef double cosine = 1.0 / 20922789888000.0
    cosine = cosine * square - 1.0 / 87178291200.0
    cosine = cosine * square + 1.0 / 479001600.0
    cosine = cosine * square - 1.0 / 3628800.0
    cosine = cosine * square + 1.0 / 40320.0
    cosine = cosine * square - 1.0 / 720.0
    cosine = cosine * square + 1.0 / 24.0
    cosine = 1.0 - (0.5 * square - square * (square * cosine))
    if quarter & 1:
        cosine, sine = -sine, cosine
    if quarter & 2:
        cosine, sine = -cosine, -sine
    return cosine + 0.0, sine + 0.0  # no -0


def log2(double a) -> float:
    """Return the binary logarithm of a positive float64, within two units in the last place of it or of 1."""
    cdef int exponent, k
    cdef double m = frexp(a, &exponent), total = 0.0, t
    if m < 0.7071067811865476:
        m, exponent = 2.0 * m, exponent - 1
    t = (m - 1.0) / (m + 1.0)
    for k in range(12, -1, -1):  # ln m = 2 artanh t
        total = ODD_PARTS[k] + t * t * total
    return exponent + 2.8853900817779268 * t * total


def cube_root(double a) -> float:
    """Return the cube root of a finite float64, within two units in the last place."""
    cdef int exponent, thirds, k
    cdef double m = frexp(fabs(a), &exponent), root = 1.0
    if a == 0.0:
        return a
    thirds = <int>floor(exponent / 3.0)
    m = ldexp(m, exponent - 3 * thirds)  # from 1/2 to 4
    for k in range(7):  # Newton's method
        root = (2.0 * root + m / (root * root)) / 3.0
    root = ldexp(root, thirds)
    return -root if a < 0.0 else root


cdef double arc_tangent(double t) noexcept nogil:
    """The arc tangent of 0 to 1, in radians."""
    cdef double square, total = 0.0
    cdef int k
    for k in range(2):  # of a quarter of the angle, 0.2 at most
        t = t / (1.0 + sqrt(1.0 + t * t))
    square = t * t
    for k in range(12, -1, -1):  # Gregory's series
        total = ODD_PARTS[k] - square * total
    return 4.0 * t * total


def arc_sine(double sine) -> float:
    """Return the angle in degrees, -90 to 90, of a sine of -1 to 1, within four units in the last place."""
    cdef double half = arc_tangent(fabs(sine) / (1.0 + sqrt((1.0 - sine) * (1.0 + sine))))
    cdef double angle = min(90.0, 2.0 * half / RADIANS_A_DEGREE)
    return -angle if sine < 0.0 else angle


@cython.cdivision(True)  # 0 over 0 is NaN, and is not read
def off_axis(points: ArrayLike) -> tuple[F64, F64]:
    """Return the distances (N,) of points (N, 3) from the z axis, and their angles to the z axis, in radians."""
    cdef const double[:, :] xyz = as_numbers(points, 2)
    cdef Py_ssize_t i, n = xyz.shape[0]
    cdef double x, y, z, most, far
    distances, angles = np.empty(n), np.empty(n)
    cdef double[::1] off = distances
    cdef double[::1] angle = angles
    with nogil:
        for i in range(n):
            x, y, z = xyz[i, 0], xyz[i, 1], xyz[i, 2]
            most = max(fabs(x), fabs(y))
            if most > 0.0 or most != most:
                x, y = x / most, y / most
                off[i] = most * sqrt(x * x + y * y)
            else:
                off[i] = 0.0
            most = max(off[i], fabs(z))
            x, z = off[i] / most, z / most
            far = sqrt(x * x + z * z)
            if most == 0.0:
                angle[i] = 0.0
            elif z >= 0.0:
                angle[i] = 2.0 * arc_tangent(x / (far + z))
            else:
                angle[i] = PI - 2.0 * arc_tangent(x / (far - z))
    return distances, angles
