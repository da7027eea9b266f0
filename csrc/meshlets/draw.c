/* Draws meshlets: from the list of visible ones to ids and depths, band by band, a batch at a time.
 * In: meshlets, a view, the list.  Out: the target's buffers; the names of triangles that are still to be drawn.
 *
 * The window is cleared 64 rows at a time from the top, and a meshlet is drawn as soon as all of its rows are clear:
 * its part of the buffers is still in the second-level cache then.  The blocks of meshlets to come are prefetched.
 *
 * Where both sides are drawn, the meshlets that all show the one which lies farther off, as the backs of a closed mesh
 * do, wait for the next band, and are left out if they are hidden then. */
#ifndef TL_DRAW_MESHLETS_C
#define TL_DRAW_MESHLETS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"
#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "clusters/behind.h"
#include "meshlets/batch.h"
#include "meshlets/fallback.c"
#include "meshlets/flush.c"
#include "meshlets/list.c"
#include "meshlets/queues.c"
#include "meshlets/snap_meshlet.c"
#include "meshlets/tiny.c"
#include "meshlets/turn.c"
#include "meshlets/write.c"

#if TL_HAS_HALVES

#define TL_ORDER_SLABS 8 /* of depth, in a band */
#define TL_ORDERED (2 * TL_ORDER_SLABS)
#define TL_BAND_BITS 6 /* rows that are cleared at a time */
#define TL_AHEAD 6     /* meshlets that are prefetched: 10,000,000 triangles take 24 ms without, 10.5 with */

TL_INLINE void flush_queued(meshlet_batch *s, meshlet_slot *slot)
{
    if (s->small.n)
        flush_small_boxes(s, slot);
    if (s->middle.n && s->is_farthest)
        flush_middle_boxes_farthest(s, slot);
    else if (s->middle.n)
        flush_middle_boxes_nearest(s, slot);
    if (s->rows.n && s->is_farthest)
        flush_long_boxes_farthest(s, slot);
    else if (s->rows.n)
        flush_long_boxes_nearest(s, slot);
    if (__builtin_expect((slot->fallback[0] | slot->fallback[1]) != 0, 0))
        draw_fallback(s, slot->meshlet, slot->fallback);
}

static __attribute__((noinline)) void draw_larger(meshlet_batch *s, meshlet_slot *slot)
{
    queue_larger(s, slot);
    flush_queued(s, slot);
}

static __attribute__((noinline)) void draw_wide(meshlet_batch *s, meshlet_slot *slot)
{
    queue_wide(s, slot);
    flush_queued(s, slot);
}

static void draw_batch_of_meshlets(meshlet_batch *s)
{
    find_tiny_boxes(s);
    cover_one(s);
    cover_tiny(s);
    list_covered(s);
    for (int j = 0; j < s->n_slots; j++)
        if (s->slots[j].n_larger || (s->slots[j].fallback[0] | s->slots[j].fallback[1]))
            draw_larger(s, s->slots + j);
    make_fragment_room(s, TL_FRAGMENTS_KEPT - TL_FRAGMENTS_WRITTEN);
    s->n_slots = 0;
}

static inline int32_t in_slot(int32_t px) { return px < 0 ? 0 : px > 255 ? 255 : px; }

static __attribute__((noinline)) vi snap_slot_f64(meshlet_batch *s, meshlet_slot *slot)
{
    return snap_slot(s, slot, 0, 1);
}

static __attribute__((noinline)) void draw_on_32_bits(meshlet_batch *s, meshlet_slot *slot)
{
    s->is_too_far = 0;
    if (s->is_f64)
        snap_slot(s, slot, 1, 1);
    else
        snap_slot(s, slot, 1, 0);
    if (s->is_too_far) {
        const uint64_t all[2] = {UINT64_MAX, UINT64_MAX};
        draw_fallback(s, slot->meshlet, all);
        return;
    }
    if (slot->at.side & TL_SIDE_BOTH)
        turn_wide(s, slot);
    draw_wide(s, slot);
}

/* Adds a meshlet to the batch, which is drawn when it is full. */
TL_INLINE void draw_meshlet(meshlet_batch *s, tl_seen_meshlet at)
{
    meshlet_slot *slot = s->slots + s->n_slots;
    const tl_meshlet *m = s->meshlets + at.meshlet;
    slot->meshlet = m, slot->at = at, slot->n_triangles = at.n_triangles;
    turn_slot(slot, at.side == TL_SIDE_BACK);
    slot->n_one = slot->n_tiny = slot->n_larger = slot->n_covered = 0;
    slot->fallback[0] = slot->fallback[1] = 0;
    slot->name0 = (int32_t)(m->names - (const int32_t *)s->meshlets);
    slot->base = (at.below_px - 1) * s->stride_px + at.left_px;
    const vi any = s->is_f64 ? snap_slot_f64(s, slot) : snap_slot(s, slot, 0, 0);
    if (__builtin_expect(vm_any(vi_any_bit(any, vi_set1(~(INT16_MAX >> s->fine_bits)))), 0)) {
        draw_on_32_bits(s, slot);
        return;
    }
    if (at.side & TL_SIDE_BOTH)
        turn_pairs(slot);
    const vi round = vi_set1(TL_ROUND_PAIR);
    for (int k = 0; k < 2; k++)
        vh_part(vi_add_halves(slot->pairs[2 * k], round), vi_add_halves(slot->pairs[2 * k + 1], round), slot->x + k,
                slot->y + k);
    slot->low = in_slot(at.below_px - s->row1) << 16 | in_slot(-at.left_px);
    slot->high = in_slot(at.below_px - s->row0) << 16 | in_slot(s->width - at.left_px);
    if (++s->n_slots == TL_BATCH)
        draw_batch_of_meshlets(s);
}

TL_INLINE void prefetch_meshlet(const tl_meshlet *m, int n_triangles)
{
    const char *names = (const char *)m->names;
    const int first = (int)offsetof(tl_meshlet, names);
    for (int k = 0; k < first; k += 64)
        prefetch((const char *)m + k);
    for (int k = 0; k < 4 * TL_MESHLET_GROWN; k += 64)
        prefetch(names + k);
    for (int k = 4 * TL_MESHLET_GROWN; k < 4 * n_triangles; k += 64)
        prefetch(names + k);
}

static void clear_rows(const meshlet_batch *s, int32_t first, int32_t end)
{
    const vf farthest = vf_set1(s->is_farthest ? -INFINITY : INFINITY);
    for (int64_t row = first; row < end; row++) {
        const int64_t at = row * s->stride_px;
        int64_t k = 0;
        memset(s->ids + at, 0xff, (size_t)s->width * sizeof *s->ids);
        for (; k + TL_LANES <= s->width; k += TL_LANES)
            vf_store(s->depth + at + k, farthest);
        vf_store_masked(s->depth + at + k, vm_first(s->width - k), farthest);
    }
    float *bounds = s->pass->target->bounds;
    const int64_t n_segments = tl_segments(s->stride_px);
    for (int64_t k = first * n_segments; bounds && k < end * n_segments; k++)
        bounds[k] = s->is_farthest ? -INFINITY : INFINITY;
}

static void start_meshlets(meshlet_batch *s, const tl_meshlet_pass *pass, int32_t row0, int32_t row1)
{
    const tl_window *window = pass->window;
    const double unit = (double)(1 << window->subpixel_bits);
    s->pass = pass, s->meshlets = pass->mesh->meshlets;
    s->ids = pass->target->pixels, s->depth = pass->target->depth;
    s->stride_px = (int32_t)pass->target->stride_px, s->width = (int32_t)window->width;
    s->row0 = row0, s->row1 = row1, s->first_id = pass->first_id;
    s->is_farthest = pass->target->sink == TL_SINK_FARTHEST;
    s->fine_bits = TL_PX_BITS - window->subpixel_bits;
    s->is_f64 = pass->source->scalar == TL_F64;
    memcpy(s->is_f64 ? (void *)s->matrix64 : (void *)s->matrix, pass->source->matrix,
           s->is_f64 ? sizeof s->matrix64 : sizeof s->matrix);
    s->scale_x = pass->seen->scale_x, s->scale_y = pass->seen->scale_y;
    /* a sample off the centre sees the view of the centre with vertices moved the other way */
    s->x_fx = s->scale_x - unit * (double)window->x_px - (double)pass->sample_x_fx;
    s->y_fx = s->scale_y - unit * (double)window->y_px - (double)pass->sample_y_fx;
    s->is_zero_to_one = pass->view->zero_to_one;
    s->n_slots = s->n_fragments = s->small.n = s->middle.n = s->rows.n = 0;
    memset(s->sample, 0, sizeof s->sample); /* prefetched behind the end of the list */
}

/* ---- occlusion: depths only come nearer, so a meshlet that is hidden now stays hidden -------------------------- */

/* Whether the depth of a sample, if that is drawn here, does not beat this one. */
TL_INLINE int shows_at(const meshlet_batch *s, int32_t col, int32_t row, float depth)
{
    if (col < 0 || col >= s->width || row < s->row0 || row >= s->row1)
        return 0;
    const float there = s->depth[(int64_t)row * s->stride_px + col];
    return !(s->is_farthest ? there > depth : there < depth);
}

/* Whether a meshlet is certain to change no sample. */
static int is_meshlet_hidden(const meshlet_batch *s, const tl_seen_meshlet *at)
{
    const int32_t col = at->left_px + TL_SLOT_PX / 2, row = at->below_px - TL_SLOT_PX / 2;
    const int32_t col0 = col - at->reach_x > 0 ? col - at->reach_x : 0;
    const int32_t col1 = col + at->reach_x < s->width ? col + at->reach_x + 1 : s->width;
    const int32_t first = row - at->reach_y > s->row0 ? row - at->reach_y : s->row0;
    const int32_t end = row + at->reach_y < s->row1 ? row + at->reach_y + 1 : s->row1;
    const int32_t x = at->reach_x >> 1, y = at->reach_y >> 1;
    if (shows_at(s, col, row, at->depth) || shows_at(s, col - x, row - y, at->depth) ||
        shows_at(s, col + x, row - y, at->depth) || shows_at(s, col - x, row + y, at->depth) ||
        shows_at(s, col + x, row + y, at->depth))
        return 0; /* settles most that show */
    return all_beat(s->depth, s->stride_px, s->pass->target->bounds, first, end, col0, col1, at->depth, s->is_farthest);
}

/* ---- the order in which they are drawn ------------------------------------------------------------------------- */

/* The order in which meshlets of a band are drawn: those of one side first, in slabs by depth. */
typedef struct {
    int late; /* the side that lies farther off on the mean, if both are drawn, as that of a meshlet; -1: none does */
    int n_bands_later;
    float nearest, slabs_a_unit;
} draw_order;

static draw_order find_order(const tl_seen_meshlet *seen, int64_t n, int has_sides, int is_farthest)
{
    double sum[2] = {0.0, 0.0};
    int64_t n_of[2] = {0, 0}, reach = 0;
    float low = INFINITY, high = -INFINITY;
    for (int64_t i = 0; i < n; i++) {
        const int side = seen[i].side & TL_SIDE_BACK;
        sum[side] += seen[i].depth;
        n_of[side]++;
        reach += seen[i].reach_y;
        low = seen[i].depth < low ? seen[i].depth : low;
        high = seen[i].depth > high ? seen[i].depth : high;
    }
    const double front = sum[0] / (double)n_of[0], back = sum[1] / (double)n_of[1];
    const float a_unit = high > low ? (float)TL_ORDER_SLABS / (high - low) : 0.0f;
    return (draw_order){
        .late = has_sides && n_of[0] && n_of[1] ? (back > front) != is_farthest : -1,
        .n_bands_later = 1 + (int)((3 * reach / (n > 0 ? n : 1)) >> TL_BAND_BITS),
        .nearest = is_farthest ? high : low,
        .slabs_a_unit = is_farthest ? -a_unit : a_unit,
    };
}

static inline int slab_in_order(const draw_order *order, const tl_seen_meshlet *at)
{
    const float slab = (at->depth - order->nearest) * order->slabs_a_unit;
    const int in_slab = slab > 0.0f ? slab < (float)(TL_ORDER_SLABS - 1) ? (int)slab : TL_ORDER_SLABS - 1 : 0;
    return ((at->side & TL_SIDE_BACK) == order->late ? TL_ORDER_SLABS : 0) + in_slab;
}

/* Sorts meshlets that reach into rows [row0, row1) by the band of their last row, and there into the order of
 * drawing; starts[TL_ORDERED * band] is where a band begins, TL_ORDER_SLABS on where those of it that are late do. */
static int sort_bands(const tl_seen_meshlet *seen, int64_t n, int32_t row0, int32_t row1, const draw_order *order,
                      int64_t *starts, tl_seen_meshlet *sorted)
{
    const int n_bands = (row1 - row0 + (1 << TL_BAND_BITS) - 1) >> TL_BAND_BITS;
    memset(starts, 0, (size_t)(TL_ORDERED * n_bands + 2) * sizeof *starts);
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = 0; i < n; i++) {
            const int32_t middle = seen[i].below_px - TL_SLOT_PX / 2, last = middle + seen[i].reach_y;
            if (last < row0 || middle - seen[i].reach_y >= row1)
                continue;
            const int32_t band = (last >= row1 ? row1 - 1 - row0 : last - row0) >> TL_BAND_BITS;
            const int32_t at = TL_ORDERED * band + slab_in_order(order, seen + i);
            if (pass)
                sorted[starts[at + 1]++] = seen[i];
            else
                starts[at + 2]++;
        }
        for (int k = 0; !pass && k < TL_ORDERED * n_bands; k++)
            starts[k + 2] += starts[k + 1];
    }
    return n_bands;
}

/* Draws list[first] to list[end - 1] without those that are hidden; those up to `limit` are drawn soon. */
static int draw_listed_meshlets(meshlet_batch *s, const tl_seen_meshlet *list, int64_t first, int64_t end,
                                int64_t limit)
{
    int is_given_up = 0;
    for (int64_t i = first; i < end && !is_given_up; i++) {
        const tl_seen_meshlet *next = list + (i + TL_AHEAD < limit ? i + TL_AHEAD : limit - 1);
        prefetch_meshlet(s->meshlets + next->meshlet, next->n_triangles);
        if (is_meshlet_hidden(s, list + i))
            continue;
        draw_meshlet(s, list[i]);
        tl_count_work(s->pass->window, (int64_t)TL_SETUP_PX * TL_MESHLET_GROWN);
        is_given_up = tl_is_given_up(s->pass->window);
    }
    return is_given_up;
}

/* The same where most are hidden, so that those alone are prefetched which are not. */
static int draw_late_meshlets(meshlet_batch *s, tl_seen_meshlet *list, int64_t first, int64_t end)
{
    int64_t n = first;
    for (int64_t i = first; i < end; i++)
        if (!is_meshlet_hidden(s, list + i))
            list[n++] = list[i];
    return draw_listed_meshlets(s, list, first, n, n);
}

/* Draws `seen` and `fallback` in rows [row0, row1) of the window, cleared first if `is_first`.  `others` gets
 * the names of triangles that clip planes may cut, or that 64 bits cannot hold; returns how many. */
static int64_t draw_meshlets(const tl_meshlet_pass *pass, const tl_seen_meshlet *seen, int64_t n_seen,
                             const int32_t *fallback, int64_t n_fallback, int32_t row0, int32_t row1, int is_first,
                             tl_seen_meshlet *sorted, int32_t *others)
{
    meshlet_batch s;
    int64_t starts[TL_ORDERED * (TL_MAX_DRAWN_PX >> TL_BAND_BITS) + 2];
    start_meshlets(&s, pass, row0, row1);
    s.others = others, s.n_others = 0;
    const draw_order order = find_order(seen, n_seen, pass->seen->cull == TL_CULL_NONE, s.is_farthest);
    const int n_bands = sort_bands(seen, n_seen, row0, row1, &order, starts, sorted);
    int is_given_up = 0;
    const int n_later = order.late < 0 ? 0 : order.n_bands_later;
    for (int band = 0; band < n_bands + n_later && !is_given_up; band++) {
        const int64_t *at = starts + TL_ORDERED * band, *before = at - (int64_t)TL_ORDERED * n_later;
        const int32_t first = row0 + (band << TL_BAND_BITS);
        if (is_first && first < row1)
            clear_rows(&s, first, first + (1 << TL_BAND_BITS) < row1 ? first + (1 << TL_BAND_BITS) : row1);
        if (band < n_bands)
            is_given_up = draw_listed_meshlets(&s, sorted, at[0], at[TL_ORDER_SLABS], at[TL_ORDER_SLABS]);
        if (n_later && band >= n_later && !is_given_up)
            is_given_up = draw_late_meshlets(&s, sorted, before[TL_ORDER_SLABS], before[TL_ORDERED]);
    }
    draw_batch_of_meshlets(&s);
    make_fragment_room(&s, TL_FRAGMENTS_KEPT);
    for (int64_t k = 0; k < n_fallback && !is_given_up; k++) {
        const uint64_t all[2] = {UINT64_MAX, UINT64_MAX};
        draw_fallback(&s, s.meshlets + fallback[k], all);
        is_given_up = tl_is_given_up(pass->window);
    }
    return s.n_others;
}

#endif
#endif
