/* Edge increment: integer edge functions, set up once a triangle, then stepped by additions along rows and columns.
 *
 * In: vertices, snapped to sub-pixels ("integer": truncated to pixels, which are sampled at their corner).  Out: the pixels
 * with all three edge functions >= 0 after a bias of -1 on the edges that are neither top nor left.  "bottom-right" has the
 * bias on the top and left edges: as watertight, but other pixels.
 *
 * Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988;
 * F. Giesen, Optimizing the basic rasterizer, 2013 (the steps and the bias);
 * K. Dyrkorn, A fast and precise triangle rasterizer, 2022 (the variant without top and left edges). */
#ifndef CLASSIC_EDGE_INCREMENT_H
#define CLASSIC_EDGE_INCREMENT_H

#include "edges.h"

enum { EDGE_INCREMENT = 0, EDGE_INCREMENT_INTEGER = 1, EDGE_INCREMENT_BOTTOM_RIGHT = 2 };

static void fill_edge_increment(const classic_target *t, const double *a, const double *b, const double *c, int form,
                                int subpixel_bits)
{
    classic_edges e;
    if (form == EDGE_INCREMENT_INTEGER) {
        int64_t x[3] = {(int64_t)a[0], (int64_t)b[0], (int64_t)c[0]};
        int64_t y[3] = {(int64_t)a[1], (int64_t)b[1], (int64_t)c[1]};
        if (!set_up_edges(&e, t, x, y, 0, 0, 0))
            return;
    } else if (!snap_edges(&e, t, a, b, c, subpixel_bits, form == EDGE_INCREMENT_BOTTOM_RIGHT))
        return;
    note_edges(&e, t);
    for (int64_t y = e.y_first; y <= e.y_last; y++) {
        int64_t w0 = e.value[0], w1 = e.value[1], w2 = e.value[2];
        for (int64_t x = e.x_first; x <= e.x_last; x++) {
            CLASSIC_STEP(t, CLASSIC_TEST, x, y, x, (w0 | w1 | w2) >= 0, w0, w1, w2);
            if ((w0 | w1 | w2) >= 0) /* no sign bit in any of them */
                put(t, x, y);
            w0 += e.step_x[0], w1 += e.step_x[1], w2 += e.step_x[2];
        }
        for (int k = 0; k < 3; k++)
            e.value[k] += e.step_y[k];
    }
}

#endif
