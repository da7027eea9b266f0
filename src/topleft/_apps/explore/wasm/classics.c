/* The methods of the literature in the module of WebAssembly: what classic_kernels.pyx is for Python.  A unit of its own,
 * as they are independent of the kernels that they are compared with. */
#include <string.h>

#include "classics.h"
#include "trace.h"

/* Clears a window of the picture, x0, y0, width, height, and draws triangles over it: a mask (uint8), counts, or labels
 * (int32, -1 for none). */
__attribute__((export_name("web_classic"))) void web_classic(int method, int form, int subpixel_bits,
                                                             const double *points, int n_components,
                                                             const int32_t *triangles, int n_triangles, int sink,
                                                             int64_t x, int64_t y, int width, int height, void *pixels)
{
    classic_target t = {.pixels = pixels, .sink = (classic_sink)sink, .x0 = x, .y0 = y};
    t.x1 = t.x0 + width, t.y1 = t.y0 + height;
    for (int64_t i = 0, n = (int64_t)width * height; i < n; i++) {
        if (t.sink == CLASSIC_MASK)
            ((uint8_t *)pixels)[i] = 0;
        else
            ((int32_t *)pixels)[i] = t.sink == CLASSIC_LABEL ? -1 : 0;
    }
    draw_classic(method, form, subpixel_bits, points, n_components, triangles, n_triangles, &t);
}

/* Draws counts (int32), and writes the steps as trace.h says.  Returns how many there are. */
__attribute__((export_name("web_trace"))) int web_trace(int method, int form, int subpixel_bits, const double *points,
                                                        int n_components, const int32_t *triangles, int n_triangles,
                                                        int64_t x, int64_t y, int width, int height, int32_t *counts,
                                                        int64_t *words, int n_words)
{
    const int64_t window[4] = {x, y, width, height};
    memset(counts, 0, sizeof *counts * (size_t)width * (size_t)height);
    return (int)trace_steps(method, form, subpixel_bits, points, n_components, triangles, n_triangles, window, counts,
                            words, n_words);
}
