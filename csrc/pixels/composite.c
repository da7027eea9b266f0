/* Composite: the colour of a pixel through its layers, nearest first.
 * In: planes of ids, colours of triangles or of the layers of pixels.  Out: pixels with alpha.
 *
 * A layer of opacity a transmits 1 - a of the light behind it, so layer k has the weight w = a_k * (1 - a_0) * ... * (1
 * - a_(k-1)).  The colour is the mean of the colours by w, the alpha is the sum of w.  All is float64, in this order of
 * operations, rounded once: a colour of uint8 is within 1/2 + 2^-37 of the exact mean.
 *
 * Based on: T. Porter, T. Duff, Compositing Digital Images, 1984 ("over"). */
#ifndef TL_COMPOSITE_C
#define TL_COMPOSITE_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* Adds the layer whose colour is at `color`, in steps of 1 / ONE. */
#define TL_ADD_LAYER(NAME, T, ONE)                                                                 \
    TL_INLINE void NAME(const T *color, int n_colors, double *through, double *sum, double *alpha) \
    {                                                                                              \
        const double own = (double)color[n_colors] / ONE, share = own * *through;                  \
        for (int c = 0; c < n_colors; c++)                                                         \
            sum[c] += share * (double)color[c];                                                    \
        *alpha += share;                                                                           \
        *through *= 1.0 - own;                                                                     \
    }
TL_ADD_LAYER(add_layer_u8, uint8_t, 255.0)
TL_ADD_LAYER(add_layer_f32, float, 1.0)
TL_ADD_LAYER(add_layer_f32_of_255, float, 255.0)

static void composite(const tl_composite *p, int64_t n, void *pixels)
{
    const int n_colors = p->n_channels - 1;
    const double one = p->is_u8 ? 255.0 : 1.0;
    for (int64_t i = 0; i < n; i++) {
        double sum[3] = {0.0, 0.0, 0.0}, alpha = 0.0, through = 1.0;
        for (int k = 0; k < p->n_layers; k++) {
            const int64_t id = p->ids[k * p->plane_px + i];
            if (id < 0 || id >= p->n_triangles) /* the caller may have changed the layers */
                break;
            const int64_t at = (p->is_flat ? id : k * n + i) * p->n_channels;
            if (!p->is_u8)
                add_layer_f32((const float *)p->colors + at, n_colors, &through, sum, &alpha);
            else if (p->is_flat)
                add_layer_u8((const uint8_t *)p->colors + at, n_colors, &through, sum, &alpha);
            else
                add_layer_f32_of_255((const float *)p->colors + at, n_colors, &through, sum, &alpha);
        }
        if (p->background && p->is_u8)
            add_layer_f32_of_255(p->background, n_colors, &through, sum, &alpha);
        else if (p->background)
            add_layer_f32(p->background, n_colors, &through, sum, &alpha);
        for (int c = 0; c < p->n_channels; c++) {
            const double value = c == n_colors ? alpha * one : alpha > 0.0 ? sum[c] / alpha : 0.0;
            if (p->is_u8)
                ((uint8_t *)pixels)[i * p->n_channels + c] = (uint8_t)rint(value < 0.0     ? 0.0
                                                                           : value > 255.0 ? 255.0
                                                                                           : value);
            else
                ((float *)pixels)[i * p->n_channels + c] = (float)value;
        }
    }
}

#endif
