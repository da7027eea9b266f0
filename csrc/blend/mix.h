/* Mix: how a colour is combined with pixels.  The state of one pass, and the modes.
 *
 * uint8 pixels are four bytes in a 32-bit lane, alpha in the highest; pictures with fewer channels are packed into such
 * lanes before the pass and unpacked after it, with alpha 255 where they have no alpha.  float32 pixels are mixed in
 * place: a lane holds a channel. */
#ifndef TL_MIX_H
#define TL_MIX_H

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "sink/sink.c"
#include "raster/state.h"
#include "area/ramp.c"
#include "pixels/weights_one.c"

/* STRAIGHT: the last channel is alpha, and the other channels are not multiplied by it.  The other modes treat all
 * channels alike, except that OVER_PREMULTIPLIED reads alpha in the last channel of the colour. */
typedef enum {
    TL_MIX_REPLACE,
    TL_MIX_REPLACE_STRAIGHT, /* REPLACE where a triangle covers the whole pixel */
    TL_MIX_OVER_STRAIGHT,
    TL_MIX_OVER_PREMULTIPLIED,
    TL_MIX_ADD,
    TL_MIX_MULTIPLY,
    TL_MIX_MAX,
    TL_MIX_MIN,
} tl_mix;

TL_INLINE int reads_alpha(tl_mix mode)
{
    return mode == TL_MIX_OVER_STRAIGHT || mode == TL_MIX_OVER_PREMULTIPLIED || mode == TL_MIX_REPLACE_STRAIGHT;
}

typedef struct blend_state {
    const tl_snapped *snapped;
    const tl_window *window;
    const tl_canvas *canvas;
    tl_target target;           /* for the walkers */
    struct shape_state *shapes; /* of fill_shapes.c, or NULL */
    int32_t *packed;            /* uint8: a pixel a lane */
    float *floats;              /* float32: a channel a lane */
    int64_t stride;             /* in pixels, of either */
    int64_t n_samples;
    int32_t ground; /* the initial colour of all pixels, packed; uint8 */
    int64_t n_laid; /* the first n_laid rows are filled with `ground`; all rows where there is no ground */
    int n_channels, is_flat;
    tl_mix mode;
    tl_mix whole_mode; /* of the current triangle, for pixels that it covers wholly */
    int32_t color;     /* of a flat triangle; `pattern`: as float32, repeated */
    float pattern[TL_MAX_LANES + 4];
    /* Gouraud: the current triangle, and the colours of a run of its pixels. */
    int64_t id;
    resolve_state resolve;
    int32_t source[TL_CHUNK + TL_MAX_LANES];
    float source_f32[4 * (TL_CHUNK + TL_MAX_LANES)];
} blend_state;

/* Rows of TL_LANES triangles: the first sample of each, and the number of samples. */
typedef struct {
    int32_t first[TL_MAX_BOX_PX][TL_MAX_LANES], n[TL_MAX_BOX_PX][TL_MAX_LANES];
} blend_rows;

/* Calls f(..., mode) with the mode as a constant. */
#define TL_MIX_CALL(f, mode, ...)                                                     \
    switch (mode) {                                                                   \
    case TL_MIX_REPLACE: f(__VA_ARGS__, TL_MIX_REPLACE); break;                       \
    case TL_MIX_REPLACE_STRAIGHT: f(__VA_ARGS__, TL_MIX_REPLACE_STRAIGHT); break;     \
    case TL_MIX_OVER_STRAIGHT: f(__VA_ARGS__, TL_MIX_OVER_STRAIGHT); break;           \
    case TL_MIX_OVER_PREMULTIPLIED: f(__VA_ARGS__, TL_MIX_OVER_PREMULTIPLIED); break; \
    case TL_MIX_ADD: f(__VA_ARGS__, TL_MIX_ADD); break;                               \
    case TL_MIX_MULTIPLY: f(__VA_ARGS__, TL_MIX_MULTIPLY); break;                     \
    case TL_MIX_MAX: f(__VA_ARGS__, TL_MIX_MAX); break;                               \
    default: f(__VA_ARGS__, TL_MIX_MIN); break;                                       \
    }

#define TL_WHOLE (1 << TL_AREA_BITS) /* the area of a pixel, in the units of ramp.c */

#endif
