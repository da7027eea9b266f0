/* Lerp scanline: sorted by height, two float interpolations a row, and the pixels between them.
 *
 * In: vertices, truncated to pixels.  The long edge runs from the top to the bottom vertex, the short edges from the top to
 * the middle and from the middle to the bottom; x is interpolated by a float32 fraction of the height, and truncated.
 * Out: spans that include both ends, without the last row.  "plus-one" is the first form of the lesson: the heights of the
 * short edges plus 1, against division by zero, and two loops that both draw the middle row.
 *
 * Based on: D. Sokolov, tinyrenderer, lesson 2: Triangle rasterization and back face culling, 2015. */
#ifndef CLASSIC_LERP_SCANLINE_H
#define CLASSIC_LERP_SCANLINE_H

#include "target.h"

enum { LERP_SCANLINE = 0, LERP_SCANLINE_PLUS_ONE = 1 };

static inline int64_t lerp(int64_t a, int64_t b, int64_t i, int64_t height)
{
    return a + (int64_t)((float)(b - a) * ((float)i / (float)height));
}

static inline void fill_between(const classic_target *t, int64_t y, int64_t x, int64_t other)
{
    CLASSIC_STEP(t, CLASSIC_ROW_LERP, x < other ? x : other, y, 0, 0, x, other);
    fill_span(t, y, x < other ? x : other, x < other ? other : x);
}

static void fill_lerp_scanline(const classic_target *t, const double *a, const double *b, const double *c, int form,
                               int subpixel_bits)
{
    classic_point p = truncated(a), q = truncated(b), r = truncated(c);
    (void)subpixel_bits;
    if (p.y > q.y)
        swap_points(&p, &q);
    if (p.y > r.y)
        swap_points(&p, &r);
    if (q.y > r.y)
        swap_points(&q, &r);
    const int64_t height = r.y - p.y;
    if (!height) /* horizontal, or a point: the height divides */
        return;
    CLASSIC_STEP(t, CLASSIC_SET_UP, p.x, p.y, p.x, 0, p.x, p.y, q.x, q.y, r.x, r.y);
    if (form == LERP_SCANLINE_PLUS_ONE) {
        for (int64_t y = larger(p.y, t->y0); y < smaller(q.y + 1, t->y1); y++)
            fill_between(t, y, lerp(p.x, r.x, y - p.y, height), lerp(p.x, q.x, y - p.y, q.y - p.y + 1));
        for (int64_t y = larger(q.y, t->y0); y < smaller(r.y + 1, t->y1); y++)
            fill_between(t, y, lerp(p.x, r.x, y - p.y, height), lerp(q.x, r.x, y - q.y, r.y - q.y + 1));
        return;
    }
    for (int64_t y = larger(p.y, t->y0); y < smaller(r.y, t->y1); y++) {
        const int is_lower = y > q.y || q.y == p.y;
        const int64_t short_x = is_lower ? lerp(q.x, r.x, y - q.y, r.y - q.y) : lerp(p.x, q.x, y - p.y, q.y - p.y);
        fill_between(t, y, lerp(p.x, r.x, y - p.y, height), short_x);
    }
}

#endif
