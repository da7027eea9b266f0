/* Blend: the queue of triangles of at most 62 x 62 samples, of either geometry.
 * In: a queue of batch.c or setup_exact.c, which keeps their order.  Out: pixels.
 *
 * Setup and row ends a vector of triangles at a time, as in rows.c; rows are then drawn triangle by triangle. */
#ifndef TL_BLEND_QUEUE_C
#define TL_BLEND_QUEUE_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "exact/rows_exact.c"
#include "exact/setup_exact.c"
#include "raster/batch.c"
#include "raster/geometry.h"
#include "raster/rows.c"
#include "blend/mix.c"
#include "blend/mix.h"

/* Row ends of TL_LANES triangles, which it goes through; returns the lanes with one in doubt. */
TL_INLINE vm find_blend_rows(tl_geometry g, lane_edges *e, vi sample, vi n_cols, int n_rows, vi stride,
                             blend_rows *rows)
{
    vm doubted = vm_first(0);
    for (int row = 0; row < n_rows; row++) {
        vi begin, end;
        next_row(g, e, n_cols, &begin, &end, &doubted);
        begin = vi_min(begin, n_cols), end = vi_max(end, vi_set1(0)); /* corners may not be those of the box any more */
        vi_store(rows->first[row], vi_add(sample, begin));
        vi_store(rows->n[row], vi_sub(end, begin));
        sample = vi_add(sample, stride);
    }
    return doubted;
}

/* Decides the row ends of the lanes in doubt: on the grid by lanes, else by the exact sign. */
static __attribute__((noinline)) void refine_blend_rows(exact_state *s, int i, lane_exact *t, vi n_cols, int n_rows,
                                                        int32_t stride, vm doubted, blend_rows *rows)
{
    const box_queue *q = &s->rows.boxes;
    int32_t sample[TL_MAX_LANES];
    if (vm_any(vm_and(try_grid(s, t, 0), doubted))) {
        lane_edges e;
        sort_float_edges(s, t, TL_FAR_BAND, &e);
        doubted = vm_and(find_blend_rows(TL_FLOAT, &e, t->sample, n_cols, n_rows, vi_set1(stride), rows), t->live);
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

TL_INLINE void flush_blend_rows(walk_state s, tl_geometry g, blend_state *b)
{
    box_queue *q = rows_queue(s, g);
    const int32_t stride = (int32_t)b->stride;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_exact t; /* TL_FLOAT */
        row_lanes r;
        blend_rows rows;
        const int end = lanes_at(i, n), max_rows = most_rows(q, i, n);
        const vi n_cols = vi_and(vi_load(q->size + i), vi_set1(0xffff));
        if (g == TL_FIXED)
            load_fixed(s.fixed, TL_SINK_BLEND, q, i, n, &r);
        else
            load_floats(s.floats, TL_SINK_BLEND, &s.floats->rows, i, n, TL_FAR_BAND, &t, &r);
        const vm doubted = find_blend_rows(g, &r.edges, r.sample, n_cols, max_rows, vi_set1(stride), &rows);
        if (g == TL_FLOAT && __builtin_expect(vm_bits(doubted) & r.live, 0))
            refine_blend_rows(s.floats, i, &t, n_cols, max_rows, stride, vm_and(doubted, t.live), &rows);
        for (int k = 0; k < end; k++) {
            const int64_t id = q->id[i + k];
            if ((g == TL_FLOAT && !(r.live >> k & 1)) || (b->is_flat && !begin_flat(b, id)))
                continue;
            if (!b->is_flat && g == TL_FIXED)
                begin_gouraud_of_mesh(b, id);
            else if (!b->is_flat)
                begin_exact_gouraud(b, id, -1);
            mix_runs(b, &rows.first[0][k], &rows.n[0][k], TL_MAX_LANES, q->size[i + k] >> 16);
        }
    }
}

#endif
