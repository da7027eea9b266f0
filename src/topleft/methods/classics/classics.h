/* The table of the classics: each method is a file of this folder, with a function that draws a triangle.  Python
 * calls them by classic_kernels.pyx, a page without Python by the module of WebAssembly. */
#ifndef CLASSICS_H
#define CLASSICS_H

#include "bresenham_scanline.h"
#include "edge_increment.h"
#include "float_barycentric.h"
#include "lerp_scanline.h"
#include "point_in_triangle.h"
#include "row_crossing.h"
#include "zigzag.h"

#define CLASSIC_MOST_FORMS 4

typedef struct {
    const char *name;
    const char *forms[CLASSIC_MOST_FORMS]; /* the variants, "" among them, by their number; NULL: no more */
    void (*fill)(const classic_target *t, const double *a, const double *b, const double *c, int form,
                 int subpixel_bits);
} classic;

enum { CLASSIC_N = 7 };
static const classic CLASSICS[CLASSIC_N] = {
    {"bresenham_scanline", {"", "top-left", "wireframe"}, fill_bresenham_scanline},
    {"edge_increment", {"", "integer", "bottom-right"}, fill_edge_increment},
    {"float_barycentric", {"", "float64"}, fill_float_barycentric},
    {"lerp_scanline", {"", "plus-one"}, fill_lerp_scanline},
    {"point_in_triangle", {"", "top-left"}, fill_point_in_triangle},
    {"row_crossing", {"", "zero-area-test", "cull-back", "cull-front"}, fill_row_crossing},
    {"zigzag", {""}, fill_zigzag},
};

/* Draws n triangles in their order over a cleared window.  `vertices` are rows of `stride` numbers. */
static inline void draw_classic(int method, int form, int subpixel_bits, const double *vertices, int64_t stride,
                                const int32_t *triangles, int64_t n, classic_target *t)
{
    for (int64_t i = 0; i < n; i++) {
        const int32_t *corner = triangles + 3 * i;
        t->label = (int32_t)i;
        CLASSICS[method].fill(t, vertices + stride * corner[0], vertices + stride * corner[1],
                              vertices + stride * corner[2], form, subpixel_bits);
    }
}

#endif
