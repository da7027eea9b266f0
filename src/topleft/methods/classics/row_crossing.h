/* Row crossing: each row computes where it crosses the three edges, and fills from the least to the greatest crossing.
 *
 * In: vertices, truncated to pixels.  Crossings are float32, rounded to the nearest pixel, for the rows between the ends of
 * an edge, both included; a horizontal edge has none, so a horizontal line vanishes and a vertical line stays.  Out: spans
 * that include both ends.  "zero-area-test" drops triangles without area first; "cull-back" and "cull-front" drop triangles
 * without area and one winding (the front is counter-clockwise as seen).
 *
 * Based on: C. Wylie, G. Romney, D. Evans, A. Erdahl, Half-tone perspective drawings by computer, 1967;
 * D. R. Finley, Efficient Polygon Fill Algorithm, 2007 (each row crosses each edge). */
#ifndef CLASSIC_ROW_CROSSING_H
#define CLASSIC_ROW_CROSSING_H

#include <math.h>

#include "target.h"

enum { ROW_CROSSING = 0, ROW_CROSSING_WITH_AREA = 1, ROW_CROSSING_FRONT = 2, ROW_CROSSING_BACK = 3 };

/* Widens a span to where an edge crosses a row, and returns it; NaN where it does not. */
static inline float ask_edge(int64_t *first, int64_t *last, int64_t y, classic_point a, classic_point b)
{
    if (a.y == b.y || y < smaller(a.y, b.y) || y > larger(a.y, b.y))
        return NAN;
    const float at = floorf((float)a.x + (float)(y - a.y) * (float)(b.x - a.x) / (float)(b.y - a.y) + (float)0.5);
    *first = smaller(*first, (int64_t)at), *last = larger(*last, (int64_t)at);
    return at;
}

static void fill_row_crossing(const classic_target *t, const double *va, const double *vb, const double *vc, int form,
                              int subpixel_bits)
{
    const classic_point a = truncated(va), b = truncated(vb), c = truncated(vc);
    const int64_t area = cross_of_points(a, b, c);
    (void)subpixel_bits;
    if ((form != ROW_CROSSING && area == 0) || (form == ROW_CROSSING_FRONT && area > 0) ||
        (form == ROW_CROSSING_BACK && area < 0))
        return;
    CLASSIC_STEP(t, CLASSIC_SET_UP_AREA, a.x, a.y, a.x, 0, a.x, a.y, b.x, b.y, c.x, c.y, area);
    const int64_t y_end = smaller(t->y1, larger(larger(a.y, b.y), c.y) + 1);
    for (int64_t y = larger(t->y0, smaller(smaller(a.y, b.y), c.y)); y < y_end; y++) {
        int64_t first = t->x1, last = t->x0 - 1; /* empty */
        const float ab = ask_edge(&first, &last, y, a, b);
        const float bc = ask_edge(&first, &last, y, b, c);
        const float ca = ask_edge(&first, &last, y, c, a);
        (void)ab, (void)bc, (void)ca;
        CLASSIC_REAL_STEP(t, CLASSIC_ROW_CROSSING, first, y, first, 0, ab, bc, ca);
        fill_span(t, y, first, last);
    }
}

#endif
