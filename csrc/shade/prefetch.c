/* Vectors of pixels that are started before their turn, so that the texels of large textures are on their way when
 * their light is found.
 * In: the runs of a span.  Out: the light of a vector of its pixels.  Asking changes no value. */
#ifndef TL_PREFETCH_C
#define TL_PREFETCH_C

#include <stddef.h>
#include <stdint.h>

#include "shading.h"
#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "shade/full.c"
#include "shade/shade_pixels.c"
#include "shade/texture.c"

/* Textures of fewer texels stay in the second-level cache of many processors. */
#define TL_FAR_TEXELS (1 << 19)

#define TL_AHEAD 2   /* how many vectors are started before their turn */
#define TL_STARTED 4 /* a power of two above it */

typedef struct {
    shaded_lanes lanes;
    laid_texture laid;
} started_lanes;

/* The vectors of a span that are started, each at its number modulo TL_STARTED. */
typedef struct {
    int next; /* the first that is not */
    started_lanes lanes[TL_STARTED];
} started_span;

/* Whether its texels are prefetched: they are many, and found by the first set of uv as it is. */
TL_INLINE int is_far(const tl_texture *t)
{
    return t->filter != TL_FILTER_NEAREST && !t->uv_set && !t->has_transform &&
           (int64_t)t->width[0] * t->height[0] >= TL_FAR_TEXELS;
}

/* Finds out whether the materials have such textures. */
static void note_far(shade_runs *s)
{
    s->has_far_texels = 0;
    for (int k = 0; k < s->shading->n_materials && s->needs_uv; k++) {
        const tl_texture *textures[TL_MAX_TEXTURES];
        const int n = textures_of(&s->shading->materials[k], textures);
        for (int i = 0; i < n; i++)
            s->has_far_texels |= is_far(textures[i]);
    }
}

/* Asks for texels of the material of the first lane: of its first such texture and of all that are laid alike. */
static void fetch_texels(started_lanes *p)
{
    const shade_runs *s = p->lanes.s;
    const tl_material *m = s->shading->materials;
    if (s->shading->material_of) {
        int32_t number[TL_MAX_LANES];
        vi_store(number, pick_int(&p->lanes, RUN_MATERIAL));
        m = material_at(s->shading, number[__builtin_ctz(vm_bits(p->lanes.visible))]);
    }
    const tl_texture *textures[TL_MAX_TEXTURES];
    const int n = textures_of(m, textures);
    for (int k = 0; k < n; k++) {
        const tl_texture *t = textures[k];
        if (!is_far(t) || (p->laid.as && !is_laid_alike(t, p->laid.as)))
            continue;
        if (!p->laid.as)
            find_texels(t, p->lanes.uv[0], p->lanes.uv[1], p->lanes.du, p->lanes.dv, &p->laid);
        for (int row = 0; row < 2; row++)
            for (int lane = 0; lane < TL_LANES; lane++) {
                __builtin_prefetch(t->texels + 4 * (int64_t)p->laid.fine.at[row][lane]);
                if (p->laid.has_coarse)
                    __builtin_prefetch(t->texels + 4 * (int64_t)p->laid.coarse.at[row][lane]);
            }
    }
}

/* The light of vector i, as light_pixels has it. */
TL_ONCE void light_started(started_span *span, const shade_runs *s, int i, int n, int64_t column, int64_t row,
                           const float *depth, vf *rgba)
{
    for (; span->next < n && span->next <= i + TL_AHEAD; span->next++) {
        if (!s->visible[span->next])
            continue;
        started_lanes *p = &span->lanes[span->next & (TL_STARTED - 1)];
        start_lanes(&p->lanes, s, span->next, column);
        p->laid.as = NULL;
        fetch_texels(p);
    }
    started_lanes *own = &span->lanes[i & (TL_STARTED - 1)];
    shade_pixels(&own->lanes, &own->laid, row, depth, rgba);
}

/* The light and the opacity of vector i of the n of the span that begins at `column`, which shows something; vectors
 * are taken in order.  `depth` is that of its first pixel. */
TL_INLINE void light_pixels(started_span *span, const shade_runs *s, int i, int n, int64_t column, int64_t row,
                            const float *depth, vf *rgba)
{
    if (s->has_far_texels) {
        light_started(span, s, i, n, column, row, depth, rgba);
        return;
    }
    shaded_lanes p;
    laid_texture laid;
    start_lanes(&p, s, i, column);
    laid.as = NULL;
    shade_pixels(&p, &laid, row, depth, rgba);
}

#endif
