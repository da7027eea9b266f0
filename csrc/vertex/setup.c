/* Triangle setup: the three corners in one winding, the box of samples they can cover, the weights of a sample.
 * In: a triangle of vertex records.  Out: tl_triangle, or nothing when it is culled, degenerate or outside.
 * Based on: J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988. */
#ifndef TL_SETUP_C
#define TL_SETUP_C

#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"

/* A triangle with positive area (y down) and its samples inside the window. */
typedef struct {
    int64_t x_fx[3], y_fx[3];
    double z[3];
    int32_t corner[3]; /* vertex indices, in the order of x_fx */
    int32_t id;
    int is_narrow;                  /* every |x_fx| < 2^30: edge functions fit 64 bits */
    int64_t col0, col1, row0, row1; /* half-open box of samples, relative to the window */
    /* Weights: the doubled edge functions opposite corners 1 and 2 at sample (row0, col0), their steps, and the sum
     * over all three corners, which is constant.  Integers, exact in float64 when `weights_exact`. */
    int weights_exact;
    double w1, w2, w1_col, w2_col, w1_row, w2_row, w_sum;
    /* Depth: z[0] + slope_y * (2py - 2y0) + slope_x * (2px - 2x0) when `has_plane`, by weights otherwise. */
    int has_plane;
    double slope_x, slope_y;
} tl_triangle;

/* Rounds an extent [low, high] to pixels [(low + first) >> bits, (high + end) >> bits). */
typedef struct {
    int32_t first, end;
} extent_rounding;

/* The centres at or right of low and left of high; the squares that the extent meets in more than a line; or the
 * squares inside it. */
static inline extent_rounding round_extent(const tl_window *window)
{
    const int32_t unit = (int32_t)1 << window->subpixel_bits, half = unit > 1 ? unit / 2 - 1 : 0;
    if (window->test == TL_TEST_SAMPLE)
        return (extent_rounding){half, half};
    return window->test == TL_TEST_OUTER ? (extent_rounding){0, unit - 1} : (extent_rounding){unit - 1, 0};
}

static inline tl_wide vertex_fx(const tl_vertex_set *set, int32_t i)
{
    const tl_vertex v = set->vertices[i];
    /* without a table: the mesh has changed since the snap */
    const tl_wide p = v.x_fx == TL_SPECIAL && set->wide ? set->wide[i] : (tl_wide){v.x_fx, v.y_fx};
    return (tl_wide){p.x_fx - set->sample_x_fx, p.y_fx - set->sample_y_fx};
}

/* The doubled edge function from corner a to corner b at the centre of a picture pixel, unbiased. */
static inline tl_int128 doubled_edge(const tl_triangle *t, int a, int b, int64_t x_px, int64_t y_px, int bits)
{
    const int64_t dx = t->x_fx[b] - t->x_fx[a], dy = t->y_fx[b] - t->y_fx[a];
    const tl_int128 px = center_from_128(x_px, bits, t->x_fx[a]), py = center_from_128(y_px, bits, t->y_fx[a]);
    return i128_wrapping_sub(i128_wrapping_times(py, dx), i128_wrapping_times(px, dy));
}

/* The sum of the three doubled edge functions, at any point: four times the signed area. */
static inline tl_int128 weight_sum(const tl_triangle *t)
{
    const int64_t x1 = t->x_fx[1] - t->x_fx[0], y1 = t->y_fx[1] - t->y_fx[0];
    const int64_t x2 = t->x_fx[2] - t->x_fx[0], y2 = t->y_fx[2] - t->y_fx[0];
    return i128_wrapping_times(i128_wrapping_sub(i128_product(x1, y2), i128_product(y1, x2)), 2);
}

/* 1 or -1 by the winding of the corners, 0 when they lie on a line. */
static inline int area_sign(const tl_triangle *t)
{
    if (t->is_narrow) {
        const int64_t area = (t->x_fx[1] - t->x_fx[0]) * (t->y_fx[2] - t->y_fx[0]) -
                             (t->y_fx[1] - t->y_fx[0]) * (t->x_fx[2] - t->x_fx[0]); /* two products below 2^62 */
        return (area > 0) - (area < 0);
    }
    return i128_sign(weight_sum(t));
}

/* Loads the corners, and swaps two of them if the area is negative; returns the sign of the area before, 0 if
 * degenerate. */
static inline int load_triangle(const tl_vertex_set *set, const int32_t *corners, tl_triangle *t)
{
    t->is_narrow = 1;
    for (int k = 0; k < 3; k++) {
        const tl_wide v = vertex_fx(set, corners[k]);
        t->is_narrow &= set->vertices[corners[k]].x_fx != TL_SPECIAL;
        t->x_fx[k] = v.x_fx;
        t->y_fx[k] = v.y_fx;
        t->z[k] = set->vertices[corners[k]].z;
        t->corner[k] = corners[k];
    }
    const int sign = area_sign(t);
    if (sign < 0) {
        const int64_t x = t->x_fx[1], y = t->y_fx[1];
        const double z = t->z[1];
        t->x_fx[1] = t->x_fx[2], t->y_fx[1] = t->y_fx[2], t->z[1] = t->z[2], t->corner[1] = corners[2];
        t->x_fx[2] = x, t->y_fx[2] = y, t->z[2] = z, t->corner[2] = corners[1];
    }
    return sign;
}

/* Whether a triangle with an area of this sign is not drawn. */
static inline int is_culled(int sign, tl_cull cull)
{
    return sign == 0 || (sign > 0 && cull == TL_CULL_BACK) || (sign < 0 && cull == TL_CULL_FRONT);
}

/* Sets the box of pixels in the triangle's extent and the window.  Half-open on the right and at the bottom: no centre
 * exactly at the largest x or y can be covered under the top-left rule.  Returns whether the box has pixels. */
static inline int clip_box(tl_triangle *t, const tl_window *window)
{
    const int bits = window->subpixel_bits;
    const int64_t x0 = min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]), x1 = max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]);
    const int64_t y0 = min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]), y1 = max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]);
    const extent_rounding round = round_extent(window);
    t->col0 = max64(((x0 + round.first) >> bits) - window->x_px, 0);
    t->col1 = min64(((x1 + round.end) >> bits) - window->x_px, window->width);
    t->row0 = max64(((y0 + round.first) >> bits) - window->y_px, 0);
    t->row1 = min64(((y1 + round.end) >> bits) - window->y_px, window->height);
    return t->col0 < t->col1 && t->row0 < t->row1;
}

/* A triangle is a sliver when its box holds more than 2^12 times twice its area: the slopes of its depth plane are then
 * so steep that float64 would lose bits that float32 shows, and the exact weights are used. */
#define TL_SLIVER_BITS 12

/* The depth plane over the corners, per half sub-pixel.  The operations are those of `plane_lanes` in
 * triangles_fixed.c: equal bits. */
static inline void setup_plane(tl_triangle *t)
{
    const double x1 = (double)(t->x_fx[1] - t->x_fx[0]), y1 = (double)(t->y_fx[1] - t->y_fx[0]), z1 = t->z[1] - t->z[0];
    const double x2 = (double)(t->x_fx[2] - t->x_fx[0]), y2 = (double)(t->y_fx[2] - t->y_fx[0]), z2 = t->z[2] - t->z[0];
    const double width = (double)(max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]) - min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]));
    const double height = (double)(max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]) - min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]));
    const double area = x1 * y2 - y1 * x2;
    /* products below 2^52 are exact */
    t->has_plane = width * height < 0x1p52 && width * height <= area * (1 << TL_SLIVER_BITS);
    if (!t->has_plane)
        return;
    const double inverse = 0.5 / area;
    t->slope_x = (z1 * y2 - z2 * y1) * inverse;
    t->slope_y = (z2 * x1 - z1 * x2) * inverse;
}

/* Sets the weights for `weights_at`: for colours and for the depth of slivers. */
static inline void setup_weights(tl_triangle *t, const tl_window *window)
{
    const int bits = window->subpixel_bits;
    const int64_t x_px = t->col0 + window->x_px, y_px = t->row0 + window->y_px;
    const double step = (double)((int64_t)2 << bits);
    const double width =
        (double)max3(t->x_fx[0], t->x_fx[1], t->x_fx[2]) - (double)min3(t->x_fx[0], t->x_fx[1], t->x_fx[2]);
    const double height =
        (double)max3(t->y_fx[0], t->y_fx[1], t->y_fx[2]) - (double)min3(t->y_fx[0], t->y_fx[1], t->y_fx[2]);
    t->weights_exact = 2.0 * width * height < 0x1p52; /* |2E| <= 2 * width * height */
    t->w_sum = i128_to_f64(weight_sum(t));
    t->w1 = i128_to_f64(doubled_edge(t, 2, 0, x_px, y_px, bits));
    t->w2 = i128_to_f64(doubled_edge(t, 0, 1, x_px, y_px, bits));
    t->w1_col = -step * ((double)t->y_fx[0] - (double)t->y_fx[2]),
    t->w1_row = step * ((double)t->x_fx[0] - (double)t->x_fx[2]);
    t->w2_col = -step * ((double)t->y_fx[1] - (double)t->y_fx[0]),
    t->w2_row = step * ((double)t->x_fx[1] - (double)t->x_fx[0]);
}

/* The weights of corners 1 and 2, with the sum w_sum, for n samples of a row: correctly rounded integers. */
static inline void weights_at(const tl_triangle *t, const tl_window *window, int64_t row, int64_t col, int n,
                              double *restrict w1, double *restrict w2)
{
    if (t->weights_exact) {
        const double row1 = t->w1 + (double)(row - t->row0) * t->w1_row;
        const double row2 = t->w2 + (double)(row - t->row0) * t->w2_row;
        const int first = (int)(col - t->col0);
        for (int k = 0; k < n; k++) {
            w1[k] = row1 + (double)(first + k) * t->w1_col;
            w2[k] = row2 + (double)(first + k) * t->w2_col;
        }
        return;
    }
    for (int k = 0; k < n; k++) {
        w1[k] = i128_to_f64(doubled_edge(t, 2, 0, col + k + window->x_px, row + window->y_px, window->subpixel_bits));
        w2[k] = i128_to_f64(doubled_edge(t, 0, 1, col + k + window->x_px, row + window->y_px, window->subpixel_bits));
    }
}

#endif
