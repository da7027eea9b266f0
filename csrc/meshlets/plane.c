/* Planes of depth of sixteen triangles of a meshlet: the operations of setup_plane in setup.c; its second corner is
 * the third here.
 * In: corners as pairs from a sample.  Out: z = (z0 + slope_y * y) + slope_x * x of units of 2^-8 px, as setup.c has it
 * of half sub-pixels: slopes and distances differ from those by powers of two, and products not at all. */
#ifndef TL_PLANE_C
#define TL_PLANE_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "meshlets/batch.h"

#if TL_HAS_HALVES

#define TL_MESHLET_SLIVER_BITS 12 /* TL_SLIVER_BITS of setup.c */

typedef struct {
    vd z0, slope_x, slope_y;
    vd x, y; /* of the sample, from the first corner; y runs down here */
} lane_plane;

TL_INLINE lane_plane make_plane(const meshlet_slot *slot, const vi *corner, const vi *v)
{
    const vi zero = vi_set1(0), first = vi_sub_halves(v[2], v[0]), second = vi_sub_halves(v[1], v[0]);
    const vd z0 = pick_depths(slot, corner[0]);
    const vd z1 = vd_sub(pick_depths(slot, corner[2]), z0), z2 = vd_sub(pick_depths(slot, corner[1]), z0);
    const vd x1 = vd_from_vi(vi_signed_low(first)), y1 = vd_from_vi(vi_sub(zero, vi_signed_high(first)));
    const vd x2 = vd_from_vi(vi_signed_low(second)), y2 = vd_from_vi(vi_sub(zero, vi_signed_high(second)));
    const vd inverse = vd_div(vd_set1(1.0), vd_sub(vd_mul(x1, y2), vd_mul(y1, x2)));
    return (lane_plane){z0, vd_mul(vd_sub(vd_mul(z1, y2), vd_mul(z2, y1)), inverse),
                        vd_mul(vd_sub(vd_mul(z2, x1), vd_mul(z1, x2)), inverse),
                        vd_from_vi(vi_sub(zero, vi_signed_low(v[0]))), vd_from_vi(vi_signed_high(v[0]))};
}

/* Notes the lanes of m for draw_fallback. */
TL_INLINE void leave_lanes(meshlet_slot *slot, vm m, vi triangle)
{
    if (!__builtin_expect(vm_any(m), 0))
        return;
    int32_t numbers[TL_LANES];
    vi_store(numbers, triangle);
    for (unsigned rest = vm_bits(m); rest; rest &= rest - 1) {
        const int i = numbers[__builtin_ctz(rest)] & (TL_MESHLET_ROOM - 1);
        slot->fallback[i >> 6] |= 1ull << (i & 63);
    }
}

/* Slivers, as setup_plane tells them: their depth is interpolated with exact weights, so they are left for
 * draw_fallback.  Returns which lanes of `live` are. */
TL_INLINE vm leave_slivers(meshlet_slot *slot, const vi *v, vm live, vi triangle)
{
    const vi least = vh_signed_min(vh_signed_min(v[0], v[1]), v[2]),
             most = vh_signed_max(vh_signed_max(v[0], v[1]), v[2]);
    const vi extent = vi_sub_halves(most, least), one = vi_set1(1);
    const vi box = vi_mul(vi_low_half(extent), vi_high_half(extent));
    const vi area = edge_at(vi_sub_halves(v[1], v[0]), vi_sub_halves(v[2], v[0]));
    /* box > area * 2^12 */
    const vm found = vm_and(live, vi_gt(vi_shift_right(vi_sub(box, one), TL_MESHLET_SLIVER_BITS), vi_sub(area, one)));
    leave_lanes(slot, found, triangle);
    return found;
}

#endif
#endif
