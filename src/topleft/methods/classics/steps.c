/* The classics and the production walkers once more, with their steps: a page plays them, and Python's `trace` returns them. */
#include "steps.h"

#include "classics.h"
#include "trace.h"
#include "walks.h"

int64_t trace_steps(int method, int form, int subpixel_bits, const double *vertices, int64_t stride,
                    const int32_t *triangles, int64_t n, const int64_t *window, int32_t *counts, int64_t *words,
                    int64_t n_words)
{
    classic_trace trace = {.words = words, .end = words + n_words};
    classic_target t = {.pixels = counts, .sink = CLASSIC_COUNT, .trace = &trace};
    t.x0 = window[0], t.y0 = window[1], t.x1 = window[0] + window[2], t.y1 = window[1] + window[3];
    if (method < CLASSIC_N)
        draw_classic(method, form, subpixel_bits, vertices, stride, triangles, n, &t);
    else
        for (int64_t i = 0; i < n; i++) {
            const int32_t *corner = triangles + 3 * i;
            t.label = (int32_t)i;
            fill_walk(&t, vertices + stride * corner[0], vertices + stride * corner[1], vertices + stride * corner[2],
                      form, subpixel_bits);
        }
    return trace.n;
}
