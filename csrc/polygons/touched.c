/* Touched: the squares of pixels that meet a polygon in positive area, or lie wholly inside of it.
 * In: rings, and the pixels with their centre inside.  Out: bits.
 *
 * Where rings do not meet, each edge separates inside from outside: a square that an edge passes through meets both,
 * and any other square is like its centre.  Where rings meet, the share of each pixel decides (pieces.c). */
#ifndef TL_POLYGON_TOUCHED_C
#define TL_POLYGON_TOUCHED_C

#include <stdint.h>

#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "polygons/pieces.c"
#include "polygons/points.c"
#include "polygons/polygons.h"
#include "polygons/row_bits.c"

#define TL_NO_SHARE 0x1p-40 /* smaller shares of a pixel are rounding, see pieces.c */

typedef struct {
    uint64_t *bits; /* of row `top` */
    int64_t row_words, top, width;
    tl_polygon_test test;
} square_bits;

static inline void mark_squares(const square_bits *s, int64_t row, int64_t begin, int64_t end)
{
    uint64_t *bits = s->bits + (row - s->top) * s->row_words;
    begin = begin < 0 ? 0 : begin, end = end > s->width ? s->width : end;
    if (s->test == TL_POLYGON_OUTER) {
        set_bits(bits, begin, end);
        return;
    }
    for (int64_t c = begin; c < end; c++)
        bits[c >> 6] &= ~((uint64_t)1 << (c & 63));
}

/* Marks the squares that an edge passes through. */
TL_INLINE void touch_edge(const tl_polygons *p, int is_wide, int64_t i, int64_t j, int64_t bottom, const square_bits *s)
{
    const int bits = p->bits;
    const int64_t unit = (int64_t)1 << bits;
    const int64_t ya = polygon_y(p, is_wide, i), yb = polygon_y(p, is_wide, j);
    const int64_t top_end = ya <= yb ? i : j, x0 = polygon_x(p, is_wide, top_end),
                  dx = polygon_x(p, is_wide, ya <= yb ? j : i) - x0;
    const int64_t y0 = ya <= yb ? ya : yb, y1 = ya <= yb ? yb : ya, dy = y1 - y0;
    if (dy == 0) {
        const int64_t low = dx < 0 ? x0 + dx : x0, high = dx < 0 ? x0 : x0 + dx;
        if (dx && (y0 & (unit - 1)) && y0 >> bits >= s->top && y0 >> bits < bottom)
            mark_squares(s, y0 >> bits, low >> bits, (high + unit - 1) >> bits);
        return;
    }
    int64_t row = y0 >> bits, last = (y1 - 1) >> bits;
    row = row < s->top ? s->top : row, last = last >= bottom ? bottom - 1 : last;
    for (; row <= last; row++) {
        const int64_t t = row * unit - y0, ta = t > 0 ? t : 0, tb = t + unit < dy ? t + unit : dy;
        const tl_int128 start = i128_product(x0, dy), d = i128_product(dy, unit);
        const tl_int128 a = i128_add(start, i128_product(ta, dx)), b = i128_add(start, i128_product(tb, dx));
        tl_int128 first, last_touched, rest;
        i128_floor_divide(dx < 0 ? a : b, d, &last_touched, &rest);
        const int64_t end = i128_low(last_touched) + !i128_is_zero(rest);
        i128_floor_divide(dx < 0 ? b : a, d, &first, &rest);
        mark_squares(s, row, i128_low(first), end);
    }
}

static void mark_shares(void *to, int64_t row, int64_t left, int64_t right, const double *shares)
{
    const square_bits *s = to;
    uint64_t *bits = s->bits + (row - s->top) * s->row_words;
    const double least = s->test == TL_POLYGON_OUTER ? TL_NO_SHARE : 1.0 - TL_NO_SHARE;
    for (int64_t k = 0; k < s->row_words && k < (s->width + 63) >> 6; k++)
        bits[k] = 0;
    for (int64_t c = left; c < right; c++)
        bits[c >> 6] |= (uint64_t)(shares[c - left] > least) << (c & 63);
}

/* Turns the bits of centres inside, rows [top, bottom), into the bits of squares. */
static void test_squares(const tl_polygons *p, int64_t polygon, const tl_polygon_box *box, tl_polygon_test test,
                         int64_t width, int64_t top, int64_t bottom, uint64_t *bits, int64_t row_words,
                         const tl_piece_scratch *scratch)
{
    square_bits s = {bits, row_words, top, width, test};
    if (!p->is_simple[polygon]) {
        resolve_polygon(p, polygon, box, top, bottom, scratch, mark_shares, &s);
        return;
    }
    for (int64_t ring = p->polygons[polygon]; ring < p->polygons[polygon + 1]; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1];
        if (p->weights[ring] == 0)
            continue;
        for (int64_t i = first; i < end; i++) {
            const int64_t j = i + 1 < end ? i + 1 : first;
            if (p->is_wide[polygon])
                touch_edge(p, 1, i, j, bottom, &s);
            else
                touch_edge(p, 0, i, j, bottom, &s);
        }
    }
}

#endif
