/* The methods of the literature in the module of WebAssembly: what classic_kernels.pyx is for Python.  A unit of its own,
 * as they are independent of the kernels that they are compared with. */
#include "classics.h"

/* Clears a window of the picture, x0, y0, width, height, and draws triangles over it: a mask (uint8), counts, or labels
 * (int32, -1 for none). */
__attribute__((export_name("web_classic"))) void web_classic(int method, int form, int subpixel_bits,
                                                             const double *points, int n_components,
                                                             const int32_t *triangles, int n_triangles, int sink,
                                                             double x, double y, int width, int height, void *pixels)
{
    classic_target t = {.pixels = pixels, .sink = (classic_sink)sink, .x0 = (int64_t)x, .y0 = (int64_t)y};
    t.x1 = t.x0 + width, t.y1 = t.y0 + height;
    for (int64_t i = 0, n = (int64_t)width * height; i < n; i++) {
        if (t.sink == CLASSIC_MASK)
            ((uint8_t *)pixels)[i] = 0;
        else
            ((int32_t *)pixels)[i] = t.sink == CLASSIC_LABEL ? -1 : 0;
    }
    draw_classic(method, form, subpixel_bits, points, n_components, triangles, n_triangles, &t);
}
