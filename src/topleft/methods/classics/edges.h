/* Integer edge functions of a triangle, to be stepped: for the methods that step them. */
#ifndef CLASSIC_EDGES_H
#define CLASSIC_EDGES_H

#include "target.h"

typedef struct {
    int64_t x_first, x_last, y_first, y_last; /* pixels to visit: bounding box within the window */
    /* at the centre of (x_first, y_first), with the bias; a sample is inside where all are >= 0 */
    int64_t value[3];
    int64_t step_x[3];           /* one pixel to the right */
    int64_t step_y[3];           /* one pixel down */
    int64_t x[3], y[3], bias[3]; /* the corners, clockwise as seen; -1 on excluded edges */
} classic_edges;

/* Of an edge of a triangle with positive signed area. */
static inline int is_top_left(int64_t dx, int64_t dy) { return dy < 0 || (dy == 0 && dx > 0); }
static inline int is_bottom_right(int64_t dx, int64_t dy) { return dy > 0 || (dy == 0 && dx < 0); }

/* Sets up from three vertices of `bits` fractional bits; pixel centres lie at j * 2^bits + half.  |x|, |y| < 2^29: no
 * edge function of the bounding box exceeds 2^61.  Returns 0 when nothing is drawn. */
static inline int set_up_edges(classic_edges *e, const classic_target *t, int64_t *x, int64_t *y, int bits,
                               int64_t half, int bottom_right)
{
    const int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]), pixel = (int64_t)1 << bits;
    if (area == 0)
        return 0;
    if (area < 0) {
        const int64_t kept_x = x[1], kept_y = y[1];
        x[1] = x[2], y[1] = y[2], x[2] = kept_x, y[2] = kept_y;
    }
    e->x_first = larger(t->x0, smaller(smaller(x[0], x[1]), x[2]) >> bits);
    e->x_last = smaller(t->x1 - 1, larger(larger(x[0], x[1]), x[2]) >> bits);
    e->y_first = larger(t->y0, smaller(smaller(y[0], y[1]), y[2]) >> bits);
    e->y_last = smaller(t->y1 - 1, larger(larger(y[0], y[1]), y[2]) >> bits);
    if (e->x_first > e->x_last || e->y_first > e->y_last)
        return 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const int64_t dx = x[j] - x[i], dy = y[j] - y[i];
        e->x[k] = x[k], e->y[k] = y[k];
        e->bias[k] = -!(bottom_right ? is_bottom_right(dx, dy) : is_top_left(dx, dy));
        e->value[k] = dx * (e->y_first * pixel + half - y[i]) - dy * (e->x_first * pixel + half - x[i]) + e->bias[k];
        e->step_x[k] = -dy * pixel, e->step_y[k] = dx * pixel;
    }
    return 1;
}

static inline void note_edges(const classic_edges *e, const classic_target *t)
{
    (void)e, (void)t;
    CLASSIC_STEP(t, CLASSIC_SET_UP_EDGES, e->x_first, e->y_first, e->x_first, 0, e->x[0], e->y[0], e->x[1], e->y[1],
                 e->x[2], e->y[2], e->x_first, e->x_last, e->y_first, e->y_last, e->bias[0], e->bias[1], e->bias[2],
                 e->step_x[0], e->step_x[1], e->step_x[2], e->step_y[0], e->step_y[1], e->step_y[2]);
}

/* Sets up from vertices snapped to `subpixel_bits`, as the library snaps them; to 1 bit where that is 0, so that a pixel
 * centre is an integer. */
static inline int snap_edges(classic_edges *e, const classic_target *t, const double *a, const double *b,
                             const double *c, int subpixel_bits, int bottom_right)
{
    const int bits = subpixel_bits > 1 ? subpixel_bits : 1;
    const double scale = (double)(1 << subpixel_bits);
    const int64_t spread = 1 << (bits - subpixel_bits);
    int64_t x[3] = {(int64_t)rint(a[0] * scale), (int64_t)rint(b[0] * scale), (int64_t)rint(c[0] * scale)};
    int64_t y[3] = {(int64_t)rint(a[1] * scale), (int64_t)rint(b[1] * scale), (int64_t)rint(c[1] * scale)};
    for (int i = 0; i < 3; i++)
        x[i] *= spread, y[i] *= spread;
    return set_up_edges(e, t, x, y, bits, (int64_t)1 << (bits - 1), bottom_right);
}

#endif
