/* Tiny triangles of a batch of meshlets: which hold a sample, which samples they cover, their depths.  A stage runs
 * over all meshlets of the batch before the next one begins: the end of a loop has long been known then.
 * In: meshlets with snapped vertices.  Out: samples of triangles with boxes up to 2x2 in the list; the numbers of those
 * with larger ones.
 *
 * Half-open boxes: samples from the left on, without the right one; y runs upwards, so without the bottom one. */
#ifndef TL_TINY_C
#define TL_TINY_C

#include <stdint.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "meshlets/batch.h"
#include "meshlets/plane.c"
#include "meshlets/write.c"

#if TL_HAS_HALVES

/* Constants that round x and y to samples, as pairs and as halves. */
#define TL_ROUND_X 0x7f
#define TL_ROUND_Y 0x80
#define TL_ROUND_PAIR (TL_ROUND_X | TL_ROUND_Y << 16)

/* Vectors of triangles of a batch. */
typedef struct {
    uint8_t slot, vector;
} slot_vector;

#define TL_MAX_VECTORS 8 /* of a meshlet */

typedef struct {
    int n;
    slot_vector list[TL_BATCH * TL_MAX_VECTORS + TL_MAX_VECTORS];
} vector_list;

TL_INLINE void add_vectors(vector_list *v, int slot, int n_triangles, int n_lanes)
{
    count_pairs(v->list + v->n, slot);
    v->n += (n_triangles + n_lanes - 1) / n_lanes;
}

/* The boxes of all triangles, and by them which list each goes to. */
static __attribute__((noinline)) void find_tiny_boxes(meshlet_batch *s)
{
    vector_list v = {.n = 0};
    for (int j = 0; j < s->n_slots; j++)
        add_vectors(&v, j, s->slots[j].n_triangles, 32);
    for (int q = 0; q < v.n; q++) {
        meshlet_slot *slot = s->slots + v.list[q].slot;
        const int first = 32 * v.list[q].vector;
        vi x[3], y[3];
        for (int k = 0; k < 3; k++) {
            const vi corner = vh_from_bytes(slot->meshlet->corners[k] + first);
            x[k] = vh_pick_of(slot->x[0], corner, slot->x[1]);
            y[k] = vh_pick_of(slot->y[0], corner, slot->y[1]);
        }
        const vi left = vh_max(vi_upper_bytes(vh_min(vh_min(x[0], x[1]), x[2])), vh_set1(slot->low));
        const vi right = vh_min(vi_upper_bytes(vh_max(vh_max(x[0], x[1]), x[2])), vh_set1(slot->high));
        const vi below = vh_max(vi_upper_bytes(vh_min(vh_min(y[0], y[1]), y[2])), vh_set1(slot->low >> 16));
        const vi above = vh_min(vi_upper_bytes(vh_max(vh_max(y[0], y[1]), y[2])), vh_set1(slot->high >> 16));
        const vhm has_box = vh_signed_gt_in(vh_signed_gt(right, left), above, below);
        const vi longer = vh_signed_max(vi_sub_halves(right, left), vi_sub_halves(above, below));
        const vhm over_one = vh_signed_gt_in(has_box, longer, vh_set1(1));
        const vhm one = vh_signed_le_in(has_box, longer, vh_set1(1)),
                  tiny = vh_signed_le_in(over_one, longer, vh_set1(2));
        const vb number = vb_count_from(first);
        slot->n_one += vb_compress(slot->one + slot->n_one, one, number);
        slot->n_tiny += vb_compress(slot->tiny + slot->n_tiny, tiny, number);
        vhm larger = vh_signed_gt_in(over_one, longer, vh_set1(2));
        if (larger) { /* whole pairs */
            larger |= (larger & 0x55555555u) << 1 | (larger >> 1 & 0x55555555u);
            slot->n_larger += vb_compress(slot->larger + slot->n_larger, larger, number);
        }
    }
}

/* The box of sixteen triangles: its first sample, and the one behind its last, as pairs. */
TL_INLINE vi first_sample(const meshlet_slot *slot, const vi *v)
{
    const vi least = vh_min(vh_min(v[0], v[1]), v[2]);
    return vh_max(vi_upper_bytes(vi_add_halves(least, vi_set1(TL_ROUND_PAIR))), vi_set1(slot->low));
}
TL_INLINE vi last_sample(const meshlet_slot *slot, const vi *v)
{
    const vi most = vh_max(vh_max(v[0], v[1]), v[2]);
    return vh_min(vi_upper_bytes(vi_add_halves(most, vi_set1(TL_ROUND_PAIR))), vi_set1(slot->high));
}

/* The pairs of the corners of sixteen triangles. */
TL_INLINE void pick_triangles(const meshlet_slot *slot, vi triangle, vi *v)
{
    vi corner[3];
    pick_corners(slot, triangle, corner);
    for (int k = 0; k < 3; k++)
        v[k] = pick_pairs(slot, corner[k]);
}

/* Edge functions at a sample, a pair; less one where a zero lies outside.  `from_sample`: corners seen from there. */
TL_INLINE void edges_at(const vi *v, vi sample, vi *from_sample, vi *e)
{
    const vi at = place_of_sample(sample);
    for (int k = 0; k < 3; k++)
        from_sample[k] = vi_sub_halves(v[k], at);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        e[k] = less_bias(edge_at(from_sample[k], from_sample[next]), v[k], v[next]);
    }
}

/* Boxes of one sample: those that are covered. */
static __attribute__((noinline)) void cover_one(meshlet_batch *s)
{
    vector_list list = {.n = 0};
    for (int j = 0; j < s->n_slots; j++)
        add_vectors(&list, j, s->slots[j].n_one, 16);
    for (int q = 0; q < list.n; q++) {
        meshlet_slot *slot = s->slots + list.list[q].slot;
        const int first = 16 * list.list[q].vector;
        const vm live = vm_first_of_few(slot->n_one - first > 16 ? 16 : slot->n_one - first);
        const vi triangle = vi_bytes_at(slot->one + first);
        vi v[3], u[3], e[3];
        pick_triangles(slot, triangle, v);
        const vi sample = first_sample(slot, v);
        edges_at(v, sample, u, e);
        const vm in = vm_and(vi_none_negative(e[0], e[1], e[2]), live);
        slot->n_covered += vi_compress(slot->covered + slot->n_covered, in,
                                       vi_or_three(sample, vi_shift_left(triangle, 8), vi_set1(1 << 24)));
    }
}

/* Boxes of up to 2x2 samples: which of these are covered. */
static __attribute__((noinline)) void cover_tiny(meshlet_batch *s)
{
    vector_list list = {.n = 0};
    for (int j = 0; j < s->n_slots; j++)
        add_vectors(&list, j, s->slots[j].n_tiny, 16);
    for (int q = 0; q < list.n; q++) {
        meshlet_slot *slot = s->slots + list.list[q].slot;
        const int first = 16 * list.list[q].vector;
        const vm live = vm_first_of_few(slot->n_tiny - first > 16 ? 16 : slot->n_tiny - first);
        const vi triangle = vi_bytes_at(slot->tiny + first), zero = vi_set1(0);
        vi v[3], u[3], e[3], right[3], above[3], both[3];
        pick_triangles(slot, triangle, v);
        const vi sample = first_sample(slot, v), size = vi_sub_halves(last_sample(slot, v), sample);
        edges_at(v, sample, u, e);
        for (int k = 0; k < 3; k++) {
            const vi side = vi_sub_halves(u[k == 2 ? 0 : k + 1], u[k]), dx = vi_signed_low(side);
            right[k] = vi_sub(e[k], vi_shift_left(vi_signed_high(side), TL_PX_BITS));
            above[k] = vi_shift_left(dx, TL_PX_BITS);
            both[k] = vi_add(right[k], above[k]);
            above[k] = vi_add(e[k], above[k]);
        }
        const vm has_right = vi_any_bit(size, vi_set1(2)), has_above = vi_any_bit(size, vi_set1(2 << 16));
        vi bits = vi_select(vi_none_negative(e[0], e[1], e[2]), vi_set1(1), zero);
        bits =
            vi_select(vm_and(vi_none_negative(right[0], right[1], right[2]), has_right), vi_or(bits, vi_set1(2)), bits);
        bits =
            vi_select(vm_and(vi_none_negative(above[0], above[1], above[2]), has_above), vi_or(bits, vi_set1(4)), bits);
        bits = vi_select(vm_and(vi_none_negative(both[0], both[1], both[2]), vm_and(has_right, has_above)),
                         vi_or(bits, vi_set1(8)), bits);
        const vm any = vm_and(live, vi_any_bit(bits, bits));
        slot->n_covered += vi_compress(slot->covered + slot->n_covered, any,
                                       vi_or_three(sample, vi_shift_left(triangle, 8), vi_shift_left(bits, 24)));
    }
}

/* Depths of covered samples: they go to the list with their names. */
static __attribute__((noinline)) void list_covered(meshlet_batch *s)
{
    /* the lowest bit that is set -> column | row << 16 */
    static const int32_t offsets[16] = {0, 0, 1, 0, 0x10000, 0, 1, 0, 0x10001, 0, 1, 0, 0x10000, 0, 1, 0};
    const vi step = vi_set1((int32_t)((uint32_t)-s->stride_px << 16 | 1)), one = vi_set1(1);
    vector_list list = {.n = 0};
    for (int j = 0; j < s->n_slots; j++)
        add_vectors(&list, j, s->slots[j].n_covered, 16);
    for (int q = 0; q < list.n; q++) {
        meshlet_slot *slot = s->slots + list.list[q].slot;
        const int first = 16 * list.list[q].vector;
        vm live = vm_first_of_few(slot->n_covered - first > 16 ? 16 : slot->n_covered - first);
        const vi info = vi_load(slot->covered + first), triangle = vi_shift_right_unsigned(info, 8);
        const vi sample = vi_and(info, vi_set1(0x00ff00ff)), number = vi_and(triangle, vi_set1(TL_MESHLET_ROOM - 1));
        const vi name = vi_add(number, vi_set1(slot->name0)), at = place_of_sample(sample);
        vi bits = vi_shift_right_unsigned(info, 24), corner[3], v[3];
        pick_corners(slot, triangle, corner);
        for (int k = 0; k < 3; k++)
            v[k] = vi_sub_halves(pick_pairs(slot, corner[k]), at);
        live = vm_and_not(live, leave_slivers(slot, v, live, number));
        const lane_plane plane = make_plane(slot, corner, v);
        while (vm_any(live)) {
            const vi offset = vi_lookup(offsets, bits);
            const vd x = vd_add(plane.x, vd_from_vi(vi_shift_left(vi_and(offset, one), TL_PX_BITS)));
            const vd y = vd_sub(plane.y, vd_from_vi(vi_shift_left(vi_high_half(offset), TL_PX_BITS)));
            const vf depth =
                vf_add(vf_from_vd(vd_add(vd_add(plane.z0, vd_mul(plane.slope_y, y)), vd_mul(plane.slope_x, x))),
                       vf_set1(0.0f));
            const vi place = vi_add(vi_dot_pairs(vi_add_halves(sample, offset), step), vi_set1(slot->base));
            add_fragments(s, live, place, name, depth);
            bits = vi_and(bits, vi_sub(bits, one));
            live = vm_and(live, vi_any_bit(bits, bits));
        }
        make_fragment_room(s, 4 * TL_LANES);
    }
}

#endif
#endif
