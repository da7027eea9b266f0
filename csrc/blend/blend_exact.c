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
#include "exact/rows_exact.c"
#include "exact/setup_exact.c"
#include "raster/batch.c"
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

/* Row ends of TL_LANES triangles of at most 62 x 62 samples; returns the lanes with one in doubt. */
TL_INLINE vm find_blend_rows(const lane_exact *t, const exact_edges *e, vi n_cols, int n_rows, int32_t stride,
                             blend_rows *rows)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    vm doubted = vm_first(0);
    vi sample = t->sample;
    for (int row = 0; row < n_rows; row++) {
        vi quotient[3];
        for (int side = 0; side < 3; side++) {
            const vf q = vf_mul(vf_fma(e->step[side], vf_set1((float)row), e->start[side]), e->inverse[side]);
            quotient[side] = vi_floor(q);
            doubted = vm_or(doubted, is_near_integer(q, e->band[side]));
        }
        const vi left = vi_select(e->third_is_left, vi_min(quotient[0], quotient[2]), quotient[0]);
        const vi right = vi_select(e->third_is_right, vi_min(quotient[1], quotient[2]), quotient[1]);
        const vi begin = vi_max(vi_sub(zero, left), zero), end = vi_max(vi_min(vi_add(right, one), n_cols), zero);
        vi_store(rows->first[row], vi_add(sample, begin));
        vi_store(rows->n[row], vi_sub(end, begin));
        sample = vi_add(sample, vi_set1(stride));
    }
    return vm_and(doubted, t->live);
}

/* Decides the row ends of the lanes in doubt: on the grid by lanes, else by the exact sign. */
static __attribute__((noinline)) void ask_blend_rows(exact_state *s, int i, lane_exact *t, exact_edges *e, vi n_cols,
                                                     int n_rows, int32_t stride, vm doubted, blend_rows *rows)
{
    const box_queue *q = &s->rows.boxes;
    int32_t sample[TL_MAX_LANES];
    if (vm_any(vm_and(try_grid(s, t, 0), doubted))) {
        sort_exact_edges(s, t, TL_FAR_BAND, e);
        doubted = find_blend_rows(t, e, n_cols, n_rows, stride, rows);
    }
    vi_store(sample, t->sample);
    for (unsigned left = vm_bits(doubted); left; left &= left - 1) {
        const int k = __builtin_ctz(left), n = q->size[i + k] >> 16;
        asked_triangle a;
        set_asked(s, q, i, k, t, TL_FAR_BAND, &a);
        for (int row = 0; row < n; row++) {
            int64_t first, end;
            decide_row(&a, row, &first, &end, s->counts);
            rows->first[row][k] = sample[k] + row * stride + (int32_t)first;
            rows->n[row][k] = (int32_t)(end - first);
        }
        s->counts->n_asked += n;
    }
}

static __attribute__((noinline)) void flush_exact_blend(exact_blend *p)
{
    exact_state *s = &p->exact;
    blend_state *b = &p->mix;
    box_queue *q = &s->rows.boxes;
    const int32_t stride = (int32_t)b->stride;
    for (int i = 0; i < q->n; i += TL_LANES) {
        lane_exact t;
        exact_edges e;
        blend_rows rows;
        const int end = q->n - i < TL_LANES ? q->n - i : TL_LANES;
        const vi n_cols = vi_and(vi_load(q->size + i), vi_set1(0xffff));
        int max_rows = 0;
        for (int k = 0; k < end; k++)
            max_rows = q->size[i + k] >> 16 > max_rows ? q->size[i + k] >> 16 : max_rows;
        pop_exact(s, TL_SINK_BLEND, &s->rows, i, &t);
        setup_exact(s, TL_SINK_BLEND, &t, 0);
        sort_exact_edges(s, &t, TL_FAR_BAND, &e);
        const vm doubted = find_blend_rows(&t, &e, n_cols, max_rows, stride, &rows);
        if (__builtin_expect(vm_any(doubted), 0))
            ask_blend_rows(s, i, &t, &e, n_cols, max_rows, stride, doubted, &rows);
        const unsigned live = vm_bits(t.live);
        for (int k = 0; k < end; k++) {
            const int64_t id = q->id[i + k];
            if (!(live >> k & 1) || (b->is_flat && !begin_flat(b, id)))
                continue;
            if (!b->is_flat)
                begin_exact_gouraud(b, id, -1);
            mix_runs(b, &rows.first[0][k], &rows.n[0][k], TL_MAX_LANES, q->size[i + k] >> 16);
        }
    }
    q->n = 0;
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
