# Float barycentric: every pixel centre of the bounding box, three weights in floating point, all of them >= 0.
#
# In: vertices as they are, nothing is snapped.  Out: the pixels whose centre has no negative weight; edges belong to both
# their triangles, where rounding lets them.  All in float32; "float64" is the same in float64.
#
# Based on: scratchapixel, Rasterization: a Practical Implementation, 2015;
# Y. Feng, face3d, 2018, and J. Guo, 3DDFA_V2 with Sim3DR, 2020 (the renderers that Python programs use most do this).

FORMS["float_barycentric"] = ("", "float64")
cdef enum:
    FLOAT64 = 1

ctypedef fused real:
    float
    double


cdef inline real cross_of_reals(real ax, real ay, real bx, real by, real x, real y) noexcept nogil:
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


cdef inline void fill_centers(target *t, real ax, real ay, real bx, real by, real cx, real cy) noexcept nogil:
    cdef real area = cross_of_reals(ax, ay, bx, by, cx, cy), inv_area, x_center, y_center
    cdef int64_t x, y, x_first, x_end, y_first, y_end
    if not area != 0:
        return
    inv_area = 1 / area
    x_first, x_end = pixel_floor(min(ax, bx, cx), t.x0, t.x1), pixel_floor(max(ax, bx, cx), t.x0 - 1, t.x1 - 1) + 1
    y_first, y_end = pixel_floor(min(ay, by, cy), t.y0, t.y1), pixel_floor(max(ay, by, cy), t.y0 - 1, t.y1 - 1) + 1
    for y in range(y_first, y_end):
        y_center = <real>y + <real>0.5
        for x in range(x_first, x_end):
            x_center = <real>x + <real>0.5
            if (
                cross_of_reals(bx, by, cx, cy, x_center, y_center) * inv_area >= 0
                and cross_of_reals(cx, cy, ax, ay, x_center, y_center) * inv_area >= 0
                and cross_of_reals(ax, ay, bx, by, x_center, y_center) * inv_area >= 0
            ):
                put(t, x, y)


cdef void fill_float_barycentric(
    target *t, const double *a, const double *b, const double *c, int form, int subpixel_bits
) noexcept nogil:
    if form == FLOAT64:
        fill_centers[double](t, a[0], a[1], b[0], b[1], c[0], c[1])
    else:
        fill_centers[float](t, <float>a[0], <float>a[1], <float>b[0], <float>b[1], <float>c[0], <float>c[1])
