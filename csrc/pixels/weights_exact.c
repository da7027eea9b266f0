/* Exact weights of the three corners at one pixel, from vertices that are not snapped.
 * In: a triangle's id and the points it was drawn from.  Out: edge functions in proportion, float64.
 *
 * A float64 edge function is used where its error bound is below 2^-32 of it; elsewhere, near an edge and for slivers,
 * an edge function that is exact to 2^-50.  So each weight is within 2^-30 of its own size, however much w differs.
 * weights.c and paint.c use plain float64 where `has_float_weights` proves weights within 2^-36 of 1. */
#ifndef TL_WEIGHTS_EXACT_C
#define TL_WEIGHTS_EXACT_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "exact/pieces.c"
#include "exact/sign.c"

/* The position of the sample of a pixel. */
TL_INLINE exact_point sample_of(const tl_vertex_set *set, int64_t x_px, int64_t y_px, int bits)
{
    const double unit = 1.0 / (double)(1 << bits);
    return (exact_point){(double)x_px + 0.5 + set->sample_x_fx * unit, (double)y_px + 0.5 + set->sample_y_fx * unit};
}

/* Whether float64 edge functions over the area are weights within 2^-36: not for slivers, nor where products overflow.
 * *area is then twice the area, within 2^-38 of its size. */
static int has_float_weights(const exact_point *p, double *area)
{
    const double x1 = p[1].x - p[0].x, y1 = p[1].y - p[0].y, x2 = p[2].x - p[0].x, y2 = p[2].y - p[0].y;
    const double x3 = p[2].x - p[1].x, y3 = p[2].y - p[1].y;
    const double width = fmax(fabs(x1), fmax(fabs(x2), fabs(x3))), height = fmax(fabs(y1), fmax(fabs(y2), fabs(y3)));
    const double box = width * height;
    *area = x1 * y2 - y1 * x2;
    return box < 0x1p100 && box > 0x1p-100 && fabs(*area) * 0x1p12 >= box;
}

/* Whether a sample lies in a triangle of either winding. */
static int holds(const exact_point *p, exact_point sample)
{
    const int sign = edge_sign(p[0], p[1], p[2]);
    const exact_point turned[3] = {p[0], p[sign < 0 ? 2 : 1], p[sign < 0 ? 1 : 2]};
    return sign && is_inside(turned, sample, TL_TEST_SAMPLE);
}

/* The piece of a triangle that holds a sample, or -1; sets its corners. */
static int64_t piece_at(const tl_pieces *pieces, int64_t id, exact_point sample, exact_point *corners)
{
    const int64_t n = pieces ? pieces->n_pieces : 0;
    const int32_t *source = pieces ? pieces->source : NULL;
    for (int64_t i = first_piece(source, n, id); i < n && source[i] == id; i++) {
        for (int k = 0; k < 3; k++)
            corners[k] = piece_point(pieces, pieces->triangles[3 * i + k]);
        if (holds(corners, sample))
            return i;
    }
    return -1;
}

/* The edge functions opposite the corners, all scaled by one power of two to numbers near 1. */
static void scaled_edges(const exact_point *corners, exact_point s, double *e)
{
    scaled_number found[3];
    int exponents[3], most = INT32_MIN;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const exact_point a = corners[next], b = corners[3 - k - next];
        double bound;
        found[k] = (scaled_number){rounded_edge(a, b, s, &bound), 0};
        if (!(fabs(found[k].mantissa) * 0x1p-32 > bound))
            found[k] = edge_value(a, b, s);
        int exponent;
        found[k].mantissa = frexp(found[k].mantissa, &exponent);
        exponents[k] = found[k].exponent + exponent;
        most = found[k].mantissa != 0.0 && exponents[k] > most ? exponents[k] : most;
    }
    for (int k = 0; k < 3; k++)
        e[k] = found[k].mantissa == 0.0 ? 0.0 : ldexp(found[k].mantissa, exponents[k] - most);
}

#endif
