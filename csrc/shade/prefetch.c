/* Starts vectors of pixels ahead, so that texels of large textures are prefetched before they are read.
 * In: the runs of a span.  Out: the light of a vector of its pixels.  Prefetching changes no value. */
#ifndef TL_PREFETCH_C
#define TL_PREFETCH_C

#include <stddef.h>
#include <stdint.h>

#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/full.c"
#include "shade/shade_pixels.c"
#include "shade/texture.c"

/* Smaller textures stay in the second-level cache of many processors. */
#define TL_FAR_TEXELS (1 << 19)

#define TL_AHEAD 2   /* how many vectors are started ahead */
#define TL_STARTED 4 /* a power of two > TL_AHEAD */

typedef struct {
    shaded_lanes lanes;
    laid_texture laid;
} started_lanes;

/* The started vectors of a span; vector i is at i modulo TL_STARTED. */
typedef struct {
    int next; /* the first vector that is not started */
    started_lanes lanes[TL_STARTED];
} started_span;

/* Whether the texels of a texture are prefetched: it is large, and sampled by the first set of uv without a
 * transform. */
TL_INLINE int is_far(const tl_texture *t)
{
    return t->filter != TL_FILTER_NEAREST && !t->uv_set && !t->has_transform &&
           (int64_t)t->width[0] * t->height[0] >= TL_FAR_TEXELS;
}

/* Sets whether the materials have textures that are prefetched. */
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

/* Prefetches texels of the material of the first lane: of its first texture that `is_far`, and of all that are laid
 * alike. */
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

/* The light of vector i, equal to that of `light_pixels`. */
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

/* The light and the opacity of vector i of n of the span that begins at `column`; some pixel of it is visible.  Vectors
 * must be shaded in order.  `depth` points to its first pixel. */
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
