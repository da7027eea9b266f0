/* Float barycentric: every pixel centre of the bounding box, three weights in floating point, all of them >= 0.
 *
 * In: vertices, not snapped.  Out: the pixels without a negative weight at the centre; pixels on an edge are in both its
 * triangles, up to rounding.  Computes in float32, "float64" in float64.
 *
 * Based on: scratchapixel, Rasterization: a Practical Implementation, 2015;
 * Y. Feng, face3d, 2018, and J. Guo, 3DDFA_V2 with Sim3DR, 2020 (the renderers that Python programs use most). */
#ifndef CLASSIC_FLOAT_BARYCENTRIC_H
#define CLASSIC_FLOAT_BARYCENTRIC_H

#include "target.h"

enum { FLOAT_BARYCENTRIC = 0, FLOAT_BARYCENTRIC_FLOAT64 = 1 };

/* The method in a type of floating point. */
#define CLASSIC_FILL_CENTERS(real)                                                                                 \
    static inline real cross_of_##real(real ax, real ay, real bx, real by, real x, real y)                         \
    {                                                                                                              \
        return (bx - ax) * (y - ay) - (by - ay) * (x - ax);                                                        \
    }                                                                                                              \
    static inline real least_##real(real a, real b) { return b < a ? b : a; }                                      \
    static inline real greatest_##real(real a, real b) { return b > a ? b : a; }                                   \
    static void fill_centers_##real(const classic_target *t, real ax, real ay, real bx, real by, real cx, real cy) \
    {                                                                                                              \
        const real area = cross_of_##real(ax, ay, bx, by, cx, cy);                                                 \
        if (!(area != 0))                                                                                          \
            return;                                                                                                \
        const real inv_area = 1 / area;                                                                            \
        const int64_t x_first = pixel_floor(least_##real(least_##real(ax, bx), cx), t->x0, t->x1);                 \
        const int64_t x_last = pixel_floor(greatest_##real(greatest_##real(ax, bx), cx), t->x0 - 1, t->x1 - 1);    \
        const int64_t y_first = pixel_floor(least_##real(least_##real(ay, by), cy), t->y0, t->y1);                 \
        const int64_t y_last = pixel_floor(greatest_##real(greatest_##real(ay, by), cy), t->y0 - 1, t->y1 - 1);    \
        CLASSIC_REAL_STEP(t, CLASSIC_SET_UP_REAL, x_first, y_first, x_first, 0, ax, ay, bx, by, cx, cy, area);     \
        for (int64_t y = y_first; y <= y_last; y++) {                                                              \
            const real y_center = (real)y + (real)0.5;                                                             \
            for (int64_t x = x_first; x <= x_last; x++) {                                                          \
                const real x_center = (real)x + (real)0.5;                                                         \
                const real w0 = cross_of_##real(bx, by, cx, cy, x_center, y_center) * inv_area;                    \
                const real w1 = cross_of_##real(cx, cy, ax, ay, x_center, y_center) * inv_area;                    \
                const real w2 = cross_of_##real(ax, ay, bx, by, x_center, y_center) * inv_area;                    \
                CLASSIC_REAL_STEP(t, CLASSIC_TEST_REAL, x, y, x, w0 >= 0 && w1 >= 0 && w2 >= 0, w0, w1, w2);       \
                if (w0 >= 0 && w1 >= 0 && w2 >= 0)                                                                 \
                    put(t, x, y);                                                                                  \
            }                                                                                                      \
        }                                                                                                          \
    }
CLASSIC_FILL_CENTERS(float)
CLASSIC_FILL_CENTERS(double)

static void fill_float_barycentric(const classic_target *t, const double *a, const double *b, const double *c, int form,
                                   int subpixel_bits)
{
    (void)subpixel_bits;
    if (form == FLOAT_BARYCENTRIC_FLOAT64)
        fill_centers_double(t, a[0], a[1], b[0], b[1], c[0], c[1]);
    else
        fill_centers_float(t, (float)a[0], (float)a[1], (float)b[0], (float)b[1], (float)c[0], (float)c[1]);
}

#endif
