/* Draws meshlets: from the list of those that a view shows to ids and depths, band by band, a batch at a time.
 * In: meshlets, a view, the list.  Out: the target's buffers; the names of triangles that are still to be drawn.
 *
 * The window is cleared 64 rows at a time from the top, and a meshlet is drawn as soon as all of its rows are clear:
 * its part of the buffers is still in the second-level cache then.  The blocks of meshlets to come are prefetched. */
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
#include "meshlets/batch.h"
#include "meshlets/care.c"
#include "meshlets/flush.c"
#include "meshlets/list.c"
#include "meshlets/queues.c"
#include "meshlets/snap_meshlet.c"
#include "meshlets/tiny.c"
#include "meshlets/write.c"

#if TL_HAS_HALVES

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
    if (__builtin_expect((slot->alone[0] | slot->alone[1]) != 0, 0))
        draw_with_care(s, slot->meshlet, slot->alone);
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
        if (s->slots[j].n_larger || (s->slots[j].alone[0] | s->slots[j].alone[1]))
            draw_larger(s, s->slots + j);
    make_fragment_room(s, TL_FRAGMENTS_KEPT - TL_FRAGMENTS_WRITTEN);
    s->n_slots = 0;
}

static inline int32_t in_slot(int32_t px) { return px < 0 ? 0 : px > 255 ? 255 : px; }

/* Adds a meshlet to the batch, which is drawn when it is full. */
TL_INLINE void draw_meshlet(meshlet_batch *s, tl_seen_meshlet at)
{
    meshlet_slot *slot = s->slots + s->n_slots;
    const tl_meshlet *m = s->meshlets + at.meshlet;
    slot->meshlet = m, slot->at = at, slot->n_triangles = at.n_triangles;
    for (int k = 0; k < 3; k++)
        slot->corners[k] = m->corners[s->turn[k]];
    slot->n_one = slot->n_tiny = slot->n_larger = slot->n_covered = 0;
    slot->alone[0] = slot->alone[1] = 0;
    slot->name0 = (int32_t)(m->names - (const int32_t *)s->meshlets);
    slot->base = (at.below_px - 1) * s->stride_px + at.left_px;
    const vi any = snap_slot(s, slot, 0);
    if (__builtin_expect(!vm_any(vi_any_bit(any, vi_set1(~(INT16_MAX >> s->fine_bits)))), 1)) {
        const vi round = vi_set1(TL_ROUND_PAIR);
        for (int k = 0; k < 2; k++)
            vh_part(vi_add_halves(slot->pairs[2 * k], round), vi_add_halves(slot->pairs[2 * k + 1], round), slot->x + k,
                    slot->y + k);
        slot->low = in_slot(at.below_px - s->row1) << 16 | in_slot(-at.left_px);
        slot->high = in_slot(at.below_px - s->row0) << 16 | in_slot(s->width - at.left_px);
        if (++s->n_slots == TL_BATCH)
            draw_batch_of_meshlets(s);
        return;
    }
    s->is_too_far = 0;
    snap_slot(s, slot, 1);
    if (s->is_too_far) {
        const uint64_t all[2] = {UINT64_MAX, UINT64_MAX};
        draw_with_care(s, m, all);
    } else {
        draw_wide(s, slot);
    }
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
    memcpy(s->matrix, pass->source->matrix, sizeof s->matrix);
    s->scale_x = pass->seen->scale_x, s->scale_y = pass->seen->scale_y;
    s->x_fx = s->scale_x - unit * (double)window->x_px, s->y_fx = s->scale_y - unit * (double)window->y_px;
    s->is_zero_to_one = pass->view->zero_to_one;
    s->turn[0] = 0, s->turn[1] = pass->seen->cull == TL_CULL_FRONT ? 2 : 1, s->turn[2] = 3 - s->turn[1];
    s->n_slots = s->n_fragments = s->small.n = s->middle.n = s->rows.n = 0;
    memset(s->sample, 0, sizeof s->sample); /* what is prefetched behind the end of the list */
}

/* Sorts what reaches into rows [row0, row1) by the band that its last row lies in; `bands` gets where each begins. */
static int64_t sort_bands(const tl_seen_meshlet *seen, int64_t n, int32_t row0, int32_t row1, int64_t *bands,
                          tl_seen_meshlet *sorted)
{
    const int n_bands = (row1 - row0 + (1 << TL_BAND_BITS) - 1) >> TL_BAND_BITS;
    memset(bands, 0, (size_t)(n_bands + 2) * sizeof *bands);
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = 0; i < n; i++) {
            const int32_t middle = seen[i].below_px - TL_SLOT_PX / 2, last = middle + seen[i].reach_y;
            if (last < row0 || middle - seen[i].reach_y >= row1)
                continue;
            const int32_t band = (last >= row1 ? row1 - 1 - row0 : last - row0) >> TL_BAND_BITS;
            if (pass)
                sorted[bands[band + 1]++] = seen[i];
            else
                bands[band + 2]++;
        }
        for (int k = 0; !pass && k < n_bands; k++)
            bands[k + 2] += bands[k + 1];
    }
    return n_bands;
}

/* Draws what `seen` and `odd` list of rows [row0, row1) of the window, cleared first if `is_first`.  `others` gets the
 * names of triangles that clip planes may cut, or that 64 bits cannot hold; returns how many. */
static int64_t draw_meshlets(const tl_meshlet_pass *pass, const tl_seen_meshlet *seen, int64_t n_seen,
                             const int32_t *odd, int64_t n_odd, int32_t row0, int32_t row1, int is_first,
                             tl_seen_meshlet *sorted, int32_t *others)
{
    meshlet_batch s;
    int64_t bands[(TL_MAX_DRAWN_PX >> TL_BAND_BITS) + 3];
    start_meshlets(&s, pass, row0, row1);
    s.others = others, s.n_others = 0;
    const int64_t n_bands = sort_bands(seen, n_seen, row0, row1, bands, sorted), n = bands[n_bands];
    int64_t i = 0;
    int is_given_up = 0;
    for (int64_t band = 0; band < n_bands && !is_given_up; band++) {
        const int32_t first = row0 + (int32_t)(band << TL_BAND_BITS);
        if (is_first)
            clear_rows(&s, first, first + (1 << TL_BAND_BITS) < row1 ? first + (1 << TL_BAND_BITS) : row1);
        for (; i < bands[band + 1] && !is_given_up; i++) {
            const tl_seen_meshlet *next = sorted + (i + TL_AHEAD < n ? i + TL_AHEAD : n - 1);
            prefetch_meshlet(s.meshlets + next->meshlet, next->n_triangles);
            draw_meshlet(&s, sorted[i]);
            tl_count_work(pass->window, (int64_t)TL_SETUP_PX * TL_MESHLET_GROWN);
            is_given_up = tl_is_given_up(pass->window);
        }
    }
    draw_batch_of_meshlets(&s);
    make_fragment_room(&s, TL_FRAGMENTS_KEPT);
    for (int64_t k = 0; k < n_odd && !is_given_up; k++) {
        const uint64_t all[2] = {UINT64_MAX, UINT64_MAX};
        draw_with_care(&s, s.meshlets + odd[k], all);
        is_given_up = tl_is_given_up(pass->window);
    }
    return s.n_others;
}

#endif
#endif
