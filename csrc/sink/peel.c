/* Peel: the nearest layers of every pixel, in one pass; or bits of columns that cross the surface.
 * In: covered samples with depth and id, in any order.  Out: planes of ids and depths, sorted by depth, then id; or
 * bits.
 *
 * Depth peeling draws the mesh once a layer, each time the surfaces behind the last layer.  Here a sample is inserted
 * by one pass over the planes: where it comes before the sample of a plane, the two are swapped, until an empty plane
 * ends the pass.  A vector inserts neighbouring pixels together.
 *
 * Based on: C. Everitt, Interactive Order-Independent Transparency, 2001 (depth peeling); L. Carpenter, The A-buffer,
 * 1984 (the fragments of a pixel in a list). */
#ifndef TL_PEEL_C
#define TL_PEEL_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "sink/fragments.h"

static void clear_layers(const tl_window *window, const tl_target *target)
{
    const tl_peeled *p = target->peeled;
    const float last = p->is_farthest ? -INFINITY : INFINITY;
    for (int k = 0; k < p->n_layers; k++)
        for (int64_t row = 0; row < window->height; row++) {
            const int64_t at = k * p->plane_px + row * target->stride_px;
            memset(p->ids + at, 0xff, (size_t)window->width * sizeof(int32_t));
            for (int64_t col = 0; col < window->width; col++)
                p->depth[at + col] = last;
        }
}

/* Flips or sets the bit where a column crosses a surface. */
TL_INLINE void note_crossing(const tl_crossings *c, int64_t at, float depth)
{
    const float end = (float)c->n_steps, z = c->is_set ? floorf(depth) : ceilf(depth - 0.5f);
    const int is_step = z >= 0.0f && z < end;
    const int64_t step = is_step ? (int64_t)z : z < 0.0f ? 0 : c->n_steps;
    const int64_t i = at * c->n_words + (step >> 6);
    uint64_t *const word = c->bits + i;
    if (c->twos)
        c->twos[i] ^= (c->is_back ? ~*word : *word) & 1ull << (step & 63);
    if (!c->is_set)
        *word ^= 1ull << (step & 63);
    else if (is_step)
        *word |= 1ull << (step & 63);
    else if (depth == end) /* the end of the grid belongs to its last step */
        c->bits[at * c->n_words + ((c->n_steps - 1) >> 6)] |= 1ull << ((c->n_steps - 1) & 63);
}

/* Adds the crossings of the lanes in m of a triangle. */
static void cross_lanes(const tl_crossings *c, int64_t at, vm m, vf depth)
{
    float depths[TL_MAX_LANES];
    vf_store(depths, depth);
    for (unsigned rest = vm_bits(m); rest; rest &= rest - 1) {
        const int lane = __builtin_ctz(rest);
        note_crossing(c, at + lane, depths[lane]);
    }
}

/* Inserts the lanes in m of a triangle into the layers of their pixels. */
static void peel_lanes(const tl_target *target, int64_t at, vm m, vf depth, int32_t id)
{
    const tl_peeled *p = target->peeled;
    if (p->crossings) {
        cross_lanes(p->crossings, at, m, depth);
        return;
    }
    const int has_room = at + TL_LANES <= target->n_samples;
    const int32_t *end = p->ids + p->n_layers * p->plane_px + at;
    float *depths = p->depth + at;
    vi carried = vi_set1(id);
    if (p->n_layers > 2) { /* 4,000 triangles of 600 px, most behind all of 8 layers: half the time */
        const int64_t last = (p->n_layers - 1) * p->plane_px;
        const vf old = vf_load_some(m, depths + last, has_room);
        m = vm_and_not(m, p->is_farthest ? vf_lt(depth, old) : vf_lt(old, depth));
        if (!vm_any(m))
            return;
    }
    for (int32_t *ids = p->ids + at; ids < end; ids += p->plane_px, depths += p->plane_px) {
        const vf old = vf_load_some(m, depths, has_room);
        const vi old_ids = vi_load_some(m, ids, has_room);
        const vm equal = vm_and(vf_eq(depth, old), vi_gt(old_ids, carried));
        const vm wins = vm_and(m, vm_or(p->is_farthest ? vf_lt(old, depth) : vf_lt(depth, old), equal));
        if (!vm_any(wins))
            continue;
        vf_store_some(depths, wins, depth, has_room);
        vi_store_some(ids, wins, carried, has_room);
        depth = vf_select(wins, old, depth);
        carried = vi_select(wins, old_ids, carried);
        m = vm_and(m, vi_gt(carried, vi_set1(-1)));
        if (!vm_any(m))
            break;
    }
}

/* Inserts samples of small triangles, one by one, without branches on who wins. */
static void peel_fragments(const tl_peeled *p, const fragment_list *f, int n)
{
    const int32_t turn = p->is_farthest ? -1 : 0;
    for (int i = 0; p->crossings && i < n; i++)
        note_crossing(p->crossings, (uint32_t)f->sample[i], f->depth[i]);
    for (int i = 0; !p->crossings && i < n; i++) {
        int64_t at = (uint32_t)f->sample[i], key = sample_key(f->depth[i], f->id[i], turn);
        __builtin_prefetch(p->ids + f->sample[i + TL_PREFETCH], 1);
        __builtin_prefetch(p->depth + f->sample[i + TL_PREFETCH], 1);
        for (int k = 0; k < p->n_layers && (int32_t)key >= 0; k++, at += p->plane_px) {
            const int64_t old = sample_key(p->depth[at], p->ids[at], turn), first = key < old ? key : old;
            key = key < old ? old : key;
            p->ids[at] = (int32_t)first;
            p->depth[at] = key_depth(first, turn);
        }
    }
}

#endif
