/* The corners of a meshlet in the order in which the side that shows is counter-clockwise: as they stand, the other way
 * round, or, where either may show, triangle by triangle.
 * In: a meshlet, its snapped vertices where they decide.  Out: the corners of its slot. */
#ifndef TL_TURN_C
#define TL_TURN_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "meshlets/batch.h"

#if TL_HAS_HALVES

TL_INLINE void turn_slot(meshlet_slot *slot, int is_back)
{
    const tl_meshlet *m = slot->meshlet;
    slot->corners[0] = m->corners[0];
    slot->corners[1] = m->corners[is_back ? 2 : 1], slot->corners[2] = m->corners[is_back ? 1 : 2];
}

/* Exchanges the last two corners of the triangles in `turned`, a bit each. */
TL_INLINE void turn_some(meshlet_slot *slot, const uint64_t *turned)
{
    for (int k = 0; k < 2; k++) {
        const vi b = vi_load_aligned(slot->meshlet->corners[1] + 64 * k),
                 c = vi_load_aligned(slot->meshlet->corners[2] + 64 * k);
        vi_store_aligned(slot->turned[0] + 64 * k, vi_select_bytes(turned[k], c, b));
        vi_store_aligned(slot->turned[1] + 64 * k, vi_select_bytes(turned[k], b, c));
    }
    slot->corners[1] = slot->turned[0], slot->corners[2] = slot->turned[1];
}

static __attribute__((noinline)) void turn_pairs(meshlet_slot *slot)
{
    uint64_t turned[2] = {0, 0};
    for (int i = 0; i < slot->n_triangles; i += TL_LANES) {
        vi corner[3], v[3];
        pick_corners(slot, vi_add(vi_set1(i), vi_iota()), corner);
        for (int k = 0; k < 3; k++)
            v[k] = pick_pairs(slot, corner[k]);
        const vi area = edge_at(vi_sub_halves(v[1], v[0]), vi_sub_halves(v[2], v[0]));
        turned[i >> 6] |= (uint64_t)vm_bits(vi_gt(vi_set1(0), area)) << (i & 63);
    }
    turn_some(slot, turned);
}

/* The same from 32 bits, right for triangles that lanes draw: others need not be turned. */
static __attribute__((noinline)) void turn_wide(const meshlet_batch *s, meshlet_slot *slot)
{
    uint64_t turned[2] = {0, 0};
    for (int i = 0; i < slot->n_triangles; i += TL_LANES) {
        vi corner[3], x[3], y[3];
        pick_corners(slot, vi_add(vi_set1(i), vi_iota()), corner);
        for (int k = 0; k < 3; k++)
            x[k] = vi_pick_64(s->wide_x, corner[k]), y[k] = vi_pick_64(s->wide_y, corner[k]);
        const vi area =
            vi_sub(vi_mul(vi_sub(x[1], x[0]), vi_sub(y[2], y[0])), vi_mul(vi_sub(y[1], y[0]), vi_sub(x[2], x[0])));
        turned[i >> 6] |= (uint64_t)vm_bits(vi_gt(vi_set1(0), area)) << (i & 63);
    }
    turn_some(slot, turned);
}

/* The triangles of sixteen with a partner that shows the other side: the two of them may cover the same samples. */
TL_INLINE vm is_folded(const meshlet_slot *slot, vi triangle)
{
    if (!(slot->at.side & TL_SIDE_BOTH))
        return vm_from_bits(0);
    const vi byte = vi_set1(0xff), own = vi_and(vi_pick_bytes(slot->corners[1], triangle), byte);
    const vi as_it_stands = vi_and(vi_pick_bytes(slot->meshlet->corners[1], triangle), byte);
    const unsigned turned = vm_bits(vi_eq(own, as_it_stands)), unlike = (turned ^ turned >> 1) & 0x5555;
    return vm_from_bits(unlike | unlike << 1);
}

#endif
#endif
