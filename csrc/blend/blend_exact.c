/* Blend of vertices that are not snapped: as blend.c, by the row ends of rows_exact.c.
 * In: points in pixels, triangles and their colours.  Out: pixels.
 *
 * Row ends in the band of doubt are decided by the exact sign, all of a triangle's.  Where clip planes cut triangles,
 * every triangle is drawn by itself, and the pieces of one in its place. */
#ifndef TL_BLEND_EXACT_C
#define TL_BLEND_EXACT_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/snap.c"
#include "exact/alone_exact.c"
#include "exact/draw_exact.c"
#include "exact/setup_exact.c"
#include "raster/batch.c"
#include "blend/blend_queue.c"
#include "blend/mix.c"
#include "blend/mix.h"

typedef struct {
    exact_state exact; /* its queue `rows` holds what waits */
    blend_state mix;
} exact_blend;

/* A triangle of the list that is drawn, with the name of one of the mesh. */
static __attribute__((noinline)) void blend_exact_alone(exact_state *s, blend_state *b, int64_t drawn, int64_t name)
{
    const int64_t n_whole = b->snapped->n_triangles;
    if (b->is_flat && !begin_flat(b, name))
        return;
    if (!b->is_flat)
        begin_exact_gouraud(b, name, drawn < n_whole ? -1 : drawn - n_whole);
    draw_lone(s, (int32_t)drawn, TL_SINK_BLEND);
}

static __attribute__((noinline)) void flush_exact_blend(exact_blend *p)
{
    flush_blend_rows((walk_state){.floats = &p->exact}, TL_FLOAT, &p->mix);
}

/* Setup of TL_LANES triangles, which come after all that wait. */
TL_INLINE void blend_exact_batch(exact_blend *p, const int32_t *corners, vi id, vm live)
{
    exact_state *s = &p->exact;
    exact_batch b;
    if (!load_exact_batch(s, TL_SINK_BLEND, corners, id, live, &b))
        return;
    vm drawn = b.drawn, alone = b.alone;
    if (TL_LANES == 1) { /* one lane gains nothing from the rows above */
        alone = vm_or(alone, drawn);
        drawn = vm_and_not(drawn, alone);
    }
    if (__builtin_expect(vm_any(alone), 0)) {
        int32_t ids[TL_MAX_LANES];
        vi_store(ids, id);
        for (unsigned lanes = vm_bits(alone); lanes && s->bad_row < 0; lanes &= lanes - 1) {
            const int lane = __builtin_ctz(lanes);
            const vm before = vm_first(lane);
            push_exact(&s->rows, vm_and(drawn, before), &b, id);
            drawn = vm_and_not(drawn, before);
            flush_exact_blend(p);
            if (tl_is_given_up(s->window))
                return;
            blend_exact_alone(s, &p->mix, ids[lane], ids[lane]);
        }
    }
    if (vm_any(drawn)) {
        push_exact(&s->rows, drawn, &b, id);
        if (TL_IS_FULL(s->rows))
            flush_exact_blend(p);
    }
}

/* Every triangle by itself; where clip planes cut one, its pieces. */
static void blend_exact_each(exact_blend *p)
{
    exact_state *s = &p->exact;
    const tl_snapped *snapped = p->mix.snapped;
    const tl_exact_pieces *pieces = snapped->mesh.exact->pieces;
    const int64_t n_pieces = pieces ? pieces->n_pieces : 0;
    s->bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    for (int64_t i = 0, k = 0; i < snapped->n_triangles && s->bad_row < 0 && !tl_is_given_up(s->window); i++) {
        tl_count_work(s->window, TL_SETUP_PX);
        blend_exact_alone(s, &p->mix, i, i);
        for (; k < n_pieces && pieces->source[k] == i; k++)
            blend_exact_alone(s, &p->mix, snapped->n_triangles + k, i);
    }
}

/* A window of fewer than 2^31 samples; the state is ready.  Returns as `draw` does. */
static __attribute__((noinline)) int64_t blend_exact(const blend_state *ready)
{
    exact_blend pass, *p = &pass;
    exact_state *s = &p->exact;
    p->mix = *ready, p->mix.target.pixels = &p->mix;
    const tl_snapped *snapped = ready->snapped, drawn = drawn_mesh(snapped);
    const tl_share all = {.first = 0, .end = snapped->n_triangles};
    int32_t corners[3 * TL_LANES];
    tl_exact_counts counts = {0, 0, 0, 0, 0, 0};
    start_exact(s, &drawn, p->mix.window, &p->mix.target, &counts);
    if (snapped->mesh.exact->pieces || !is_near_0(s->window)) {
        blend_exact_each(p);
        return s->bad_row;
    }
    for (int64_t i = 0; i < all.end && s->bad_row < 0 && !tl_is_given_up(s->window); i += TL_LANES) {
        tl_count_work(s->window, TL_SETUP_PX * TL_LANES);
        blend_exact_batch(p, share_corners(snapped, &all, i, corners), vi_add(vi_set1((int32_t)i), vi_iota()),
                          vm_first(all.end - i));
    }
    flush_exact_blend(p);
    return s->bad_row;
}

#endif
