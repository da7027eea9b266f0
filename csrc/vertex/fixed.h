/* The fixed-point format: snapping, ranges, and why nothing overflows.
 *
 * A coordinate x_fx counts 2^-subpixel_bits pixels.  The centre of pixel j is (2j + 1) * 2^bits / 2, half a unit off
 * the grid when bits = 0, so edge functions are evaluated doubled: 2E = dx * (2py - 2ay) - dy * (2px - 2ax).
 *
 * Range: at any point inside the bounding box of a triangle |E| <= width * height of the box (twice the area of a
 * triangle in a rectangle is at most the rectangle), so
 *   |x_fx| < 2^30:  width, height <= 2^31 - 2,  |2E| <= 2 (2^31 - 2)^2 < 2^63;
 *   |x_fx| < 2^62:  width, height <= 2^63 - 2,  |2E| <= 2 (2^63 - 2)^2 < 2^127.
 * The two products may each wrap; their difference, modulo 2^64 or 2^128, is right.
 */
#ifndef TL_FIXED_H
#define TL_FIXED_H

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "base/integers.h"

#define TL_NARROW_LIMIT 0x1p30
#define TL_WIDE_LIMIT 0x1p62

_Static_assert(sizeof(tl_vertex) == 16, "a vertex is one 16-byte load");
_Static_assert(sizeof(tl_int128) == 16, "the wide path needs 128-bit integers");
_Static_assert(2 * ((1ULL << 31) - 2) * ((1ULL << 31) - 2) < 1ULL << 63, "2E must fit 64 bits");

static inline int64_t min64(int64_t a, int64_t b) { return a < b ? a : b; }
static inline int64_t max64(int64_t a, int64_t b) { return a > b ? a : b; }
static inline int64_t min3(int64_t a, int64_t b, int64_t c) { return min64(min64(a, b), c); }
static inline int64_t max3(int64_t a, int64_t b, int64_t c) { return max64(max64(a, b), c); }

/* The centre of a pixel, from a coordinate, in half sub-pixels. */
static inline int64_t center_from_64(int64_t px, int bits, int64_t fx)
{
    return (px * 2 + 1) * ((int64_t)1 << bits) - fx * 2;
}
static inline tl_int128 center_from_128(int64_t px, int bits, int64_t fx)
{
    const tl_int128 center = i128_shift_left(i128_add(i128_product(px, 2), i128_from(1)), bits);
    return i128_sub(center, i128_product(fx, 2));
}

/* Whether a window lies within 2^30 pixels of 0, so that 32-bit lanes hold its pixels. */
static inline int is_near(const tl_window *window)
{
    const int64_t farthest = (int64_t)1 << 30;
    return window->x_px > -farthest && window->x_px < farthest && window->y_px > -farthest && window->y_px < farthest;
}

/* Writes vertex i: its record, and its row of the wide table if there is one.  x_fx and y_fx are integers, infinite or
 * NaN. */
static inline void store_vertex(double x_fx, double y_fx, double z, int64_t i, tl_vertex *out, tl_wide *wide,
                                tl_vertex_counts *n)
{
    if (fabs(x_fx) < TL_NARROW_LIMIT && fabs(y_fx) < TL_NARROW_LIMIT && fabs(z) <= FLT_MAX) {
        out[i] = (tl_vertex){(int32_t)x_fx, (int32_t)y_fx, z};
    } else if (fabs(x_fx) < TL_WIDE_LIMIT && fabs(y_fx) < TL_WIDE_LIMIT && fabs(z) <= FLT_MAX) {
        out[i] = (tl_vertex){TL_SPECIAL, TL_WIDE, z};
        n->n_wide++;
        if (wide)
            wide[i] = (tl_wide){(int64_t)x_fx, (int64_t)y_fx};
    } else {
        out[i] = (tl_vertex){TL_SPECIAL, TL_BAD, z};
        n->n_bad++;
    }
}

#endif
