/* Point in triangle: every pixel of the bounding box, three cross products each.
 *
 * In: vertices, truncated to pixels.  Out: the pixels with three cross products of equal sign, zero included, so both
 * windings are drawn and pixels on an edge are in both its triangles.  "top-left" makes the winding clockwise and has a
 * bias of -1 on the edges that are neither top nor left.
 *
 * Based on: xterminal86, Software 3D renderer tutorial, part 3: Scanline is a lie, 2023 (this form);
 * J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (the origin). */
#ifndef CLASSIC_POINT_IN_TRIANGLE_H
#define CLASSIC_POINT_IN_TRIANGLE_H

#include "target.h"

enum { POINT_IN_TRIANGLE = 0, POINT_IN_TRIANGLE_TOP_LEFT = 1 };

/* 0 for a top or left edge of a triangle that turns clockwise as seen, -1 for the others. */
static inline int64_t bias_of(classic_point a, classic_point b)
{
    return b.y < a.y || (b.y == a.y && b.x > a.x) ? 0 : -1;
}

static void fill_point_in_triangle(const classic_target *t, const double *va, const double *vb, const double *vc,
                                   int form, int subpixel_bits)
{
    classic_point a = truncated(va), b = truncated(vb), c = truncated(vc);
    int64_t bias[3] = {0, 0, 0};
    (void)subpixel_bits;
    if (form == POINT_IN_TRIANGLE_TOP_LEFT) {
        if (cross_of_points(a, b, c) < 0)
            swap_points(&b, &c);
        bias[0] = bias_of(a, b), bias[1] = bias_of(b, c), bias[2] = bias_of(c, a);
    }
    CLASSIC_STEP(t, CLASSIC_SET_UP, larger(t->x0, smaller(smaller(a.x, b.x), c.x)),
                 larger(t->y0, smaller(smaller(a.y, b.y), c.y)), 0, 0, a.x, a.y, b.x, b.y, c.x, c.y);
    const int64_t y_end = smaller(t->y1, larger(larger(a.y, b.y), c.y) + 1);
    const int64_t x_end = smaller(t->x1, larger(larger(a.x, b.x), c.x) + 1);
    for (int64_t y = larger(t->y0, smaller(smaller(a.y, b.y), c.y)); y < y_end; y++)
        for (int64_t x = larger(t->x0, smaller(smaller(a.x, b.x), c.x)); x < x_end; x++) {
            const classic_point p = {x, y};
            const int64_t w0 = cross_of_points(a, b, p) + bias[0], w1 = cross_of_points(b, c, p) + bias[1];
            const int64_t w2 = cross_of_points(c, a, p) + bias[2];
            const int is_inside =
                (w0 >= 0 && w1 >= 0 && w2 >= 0) || (form == POINT_IN_TRIANGLE && w0 <= 0 && w1 <= 0 && w2 <= 0);
            CLASSIC_STEP(t, CLASSIC_TEST, x, y, x, is_inside, w0, w1, w2);
            if (is_inside)
                put(t, x, y);
        }
}

#endif
