/* Slopes: the derivatives of vertices' values along x and along y, per pixel.
 * In: ids, weights of pixels, and the slopes of the weights of each visible triangle.  Out: float32.
 *
 * The weights of a pixel are l / (l0 + l1 + l2) with l linear in x and y, and the sum is 1/w: d weight = w (d l -
 * weight d sum).  All is float64, rounded once at the end. */
#ifndef TL_SLOPES_C
#define TL_SLOPES_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* The derivatives of the three weights along an axis. */
TL_INLINE void slopes_of_weights(const double *steps, int axis, double w, const float *weights, double *slopes)
{
    const double sum = steps[axis] + steps[3 + axis] + steps[6 + axis];
    for (int k = 0; k < 3; k++)
        slopes[k] = w * (steps[3 * k + axis] - (double)weights[k] * sum);
}

static void fill_slopes(const tl_sloped *s, const int32_t *ids, const float *weights, int64_t n, float *out)
{
    const int64_t n_values = s->n_values;
    for (int64_t i = 0; i < n; i++, out += 2 * n_values) {
        if (ids[i] < 0) {
            for (int64_t k = 0; k < 2 * n_values; k++)
                out[k] = 0.0f;
            continue;
        }
        const int64_t slot = s->slot[ids[i]];
        const double *steps = s->steps + 9 * slot;
        const float *own = weights + 3 * i;
        const double w = (double)own[0] * steps[2] + (double)own[1] * steps[5] + (double)own[2] * steps[8];
        double by[2][3];
        for (int axis = 0; axis < 2; axis++)
            slopes_of_weights(steps, axis, w, own, by[axis]);
        const float *a = s->values + n_values * s->rows[3 * slot], *b = s->values + n_values * s->rows[3 * slot + 1],
                    *c = s->values + n_values * s->rows[3 * slot + 2];
        for (int64_t k = 0; k < n_values; k++)
            for (int axis = 0; axis < 2; axis++)
                out[2 * k + axis] =
                    (float)((double)a[k] * by[axis][0] + (double)b[k] * by[axis][1] + (double)c[k] * by[axis][2]);
    }
}

#endif
