/* Zigzag: integer edge functions, in a walk that turns round at the triangle's sides instead of the box's.
 *
 * In: vertices, snapped to sub-pixels.  Out: the pixels of edge_increment, in another order: a row to the right, the next
 * row to the left.  A row ends where an edge function is negative, and will stay so, both there and in the row below; then
 * the samples that the next row covers lie in the other direction.
 *
 * Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988 (smarter traversal, figure 5);
 * T. Akenine-Moeller, J. Stroem, Graphics for the Masses, 2003 (the zigzag by name). */
#ifndef CLASSIC_ZIGZAG_H
#define CLASSIC_ZIGZAG_H

#include "edges.h"

/* Whether no later sample is covered, neither in this row nor in the next (step_y NULL: in this row). */
static inline int is_behind(const int64_t *w, const int64_t *step_x, const int64_t *step_y, int64_t way)
{
    int here = 0, below = step_y == NULL;
    for (int k = 0; k < 3; k++)
        if (step_x[k] * way <= 0) {
            here = here || w[k] < 0;
            below = below || w[k] + step_y[k] < 0;
        }
    return here && below;
}

static void fill_zigzag(const classic_target *t, const double *a, const double *b, const double *c, int form,
                        int subpixel_bits)
{
    classic_edges e;
    int64_t w[3];
    (void)form;
    if (!snap_edges(&e, t, a, b, c, subpixel_bits, 0))
        return;
    note_edges(&e, t);
    /* Start below the topmost vertex, and step to the left until the first row lies to the right. */
    const double top_x = a[1] <= (b[1] < c[1] ? b[1] : c[1]) ? a[0] : b[1] <= c[1] ? b[0] : c[0];
    int64_t x = pixel_floor(top_x, e.x_first, e.x_last);
    for (int k = 0; k < 3; k++)
        w[k] = e.value[k] + (x - e.x_first) * e.step_x[k];
    while (x > e.x_first && !is_behind(w, e.step_x, NULL, -1)) {
        x--;
        for (int k = 0; k < 3; k++)
            w[k] -= e.step_x[k];
    }
    int64_t way = 1;
    for (int64_t y = e.y_first; y <= e.y_last; y++, way = -way) {
        for (;;) {
            CLASSIC_STEP(t, CLASSIC_TEST_WAY, x, y, x, (w[0] | w[1] | w[2]) >= 0, w[0], w[1], w[2], way);
            if ((w[0] | w[1] | w[2]) >= 0)
                put(t, x, y);
            if (x == (way > 0 ? e.x_last : e.x_first) || is_behind(w, e.step_x, e.step_y, way))
                break;
            x += way;
            for (int k = 0; k < 3; k++)
                w[k] += way * e.step_x[k];
        }
        for (int k = 0; k < 3; k++)
            w[k] += e.step_y[k];
    }
}

#endif
