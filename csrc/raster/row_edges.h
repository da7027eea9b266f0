/* Row edges: the edges of a vector of triangles, sorted into edges that end rows on the left and on the right.
 * In: edge functions.  Out: row ends.
 *
 * An edge ends a row at floor(q), q = v / d, d = |dy|: samples up to floor(q) lie inside a right edge, samples from
 * -floor(q) on inside a left edge.
 *
 * TL_FIXED: v = E' at the row's first sample.  It is computed in float32 as floor((v + 0.5) * (1 / d)), exactly: v +
 * 0.5 has at most 22 bits; with |v / d| < 64 the two roundings err by less than 64 * 2^-22 = 2^-16, while (v + 0.5) / d
 * is at least 0.5 / d > 2^-15 from an integer.  Farther out the result is clamped to the box.  Squares
 * (triangles_fixed.c): 60 pixels of 2^8 make |v| < 2^22, which float32 still holds exactly, with the half.
 *
 * TL_FLOAT: v = E there, rounded.  Where q is nearer to an integer than the band (triangles_float.c), that column is in
 * doubt, and refine.c decides. */
#ifndef TL_ROW_EDGES_H
#define TL_ROW_EDGES_H

#include <stddef.h>

#include "topleft.h"
#include "lanes/lanes.h"

/* The two geometries: snapped vertices, and vertices that are not snapped. */
typedef enum { TL_FIXED, TL_FLOAT } tl_geometry;

/* For TL_LANES triangles: the first edge on the left, the first on the right, and the third edge, which is on either
 * side or horizontal.  Each is edge 0 where is0, edge 1 where is1, else edge 2. */
typedef struct {
    vm is0[3], is1[3];
    vm third_is_left, third_is_right;
} lane_sides;

/* The edges of TL_LANES triangles, sorted by lane_sides. */
typedef struct {
    vf start[3], step[3], inverse[3]; /* left, right, third */
    vf band[3], row;                  /* TL_FLOAT: in columns; the next row */
    vm third_is_left, third_is_right;
} lane_edges;

TL_INLINE lane_sides sides_of(const vm *left, const vm *right)
{
    const vm third0 = vm_and_not(vm_and_not(vm_all(), left[0]), right[0]);
    const vm taken1 = vm_or(vm_and_not(left[1], left[0]), vm_and_not(right[1], right[0]));
    const vm third1 = vm_and_not(vm_and_not(vm_all(), taken1), third0);
    const vm third2 = vm_and_not(vm_and_not(vm_all(), third0), third1);
    return (lane_sides){
        {left[0], right[0], third0},
        {left[1], right[1], third1},
        vm_or(vm_and(third1, left[1]), vm_and(third2, left[2])),
        vm_or(vm_and(third1, right[1]), vm_and(third2, right[2])),
    };
}

/* Sides of edges from their dy, integers. */
TL_INLINE lane_sides find_sides(const vi *dy)
{
    vm left[3], right[3];
    for (int k = 0; k < 3; k++)
        left[k] = vi_gt(vi_set1(0), dy[k]), right[k] = vi_gt(dy[k], vi_set1(0));
    return sides_of(left, right);
}

TL_INLINE void pick_edges(const lane_sides *sides, const vf *edges, vf *picked)
{
    for (int side = 0; side < 3; side++)
        picked[side] = vf_select(sides->is0[side], edges[0], vf_select(sides->is1[side], edges[1], edges[2]));
}

/* band: TL_FLOAT only */
TL_INLINE void sort_edges(tl_geometry g, const lane_sides *sides, const vf *start, const vf *step, const vf *inverse,
                          const vf *band, lane_edges *r)
{
    pick_edges(sides, start, r->start), pick_edges(sides, step, r->step), pick_edges(sides, inverse, r->inverse);
    r->third_is_left = sides->third_is_left, r->third_is_right = sides->third_is_right;
    if (g == TL_FLOAT)
        pick_edges(sides, band, r->band), r->row = vf_set1(0.0f);
}

/* Sorts edges with edge functions e at the first samples, in integers: TL_FIXED. */
TL_INLINE void sort_fixed_edges(const vi *e, const vi *dx, const vi *dy, lane_edges *r)
{
    const lane_sides sides = find_sides(dy);
    vf start[3], step[3], inverse[3];
    for (int k = 0; k < 3; k++) {
        start[k] = vf_add(vf_from_vi(e[k]), vf_set1(0.5f));
        step[k] = vf_from_vi(dx[k]);
        /* a horizontal edge ends no row: 1 keeps infinities away */
        inverse[k] = vf_div(vf_set1(1.0f), vf_from_vi(vi_max(vi_max(dy[k], vi_sub(vi_set1(0), dy[k])), vi_set1(1))));
    }
    sort_edges(TL_FIXED, &sides, start, step, inverse, NULL, r);
}

/* Whether a row end lies in the band. */
TL_INLINE vm is_near_integer(vf q, vf band)
{
    const vf off = vf_off_integer(q);
    return vf_ge(band, vf_max(off, vf_sub(vf_set1(0.0f), off)));
}

/* The last samples inside left edges, counted to the left, and inside right edges, from quotients of three edges. */
TL_INLINE void meet_third(const vi *quotient, vm third_is_left, vm third_is_right, vi *left, vi *right)
{
    /* without a branch: the side of the third edge is unpredictable */
    *left = vi_select(third_is_left, vi_min(quotient[0], quotient[2]), quotient[0]);
    *right = vi_select(third_is_right, vi_min(quotient[1], quotient[2]), quotient[1]);
}

/* Sets the samples [begin, end) of the current row of each triangle, and steps its edges to the next row.  Adds to
 * *doubted the lanes with an end in doubt. */
TL_INLINE void next_row(tl_geometry g, lane_edges *e, vi n_cols, vi *begin, vi *end, vm *doubted)
{
    const vi zero = vi_set1(0), one = vi_set1(1);
    vi quotient[3], left, right;
    for (int side = 0; side < 3; side++) {
        if (g == TL_FIXED) {
            quotient[side] = vi_floor(vf_mul(e->start[side], e->inverse[side]));
            e->start[side] = vf_add(e->start[side], e->step[side]);
            continue;
        }
        const vf q = vf_mul(vf_fma(e->step[side], e->row, e->start[side]), e->inverse[side]);
        quotient[side] = vi_floor(q);
        *doubted = vm_or(*doubted, is_near_integer(q, e->band[side]));
    }
    if (g == TL_FLOAT)
        e->row = vf_add(e->row, vf_set1(1.0f));
    meet_third(quotient, e->third_is_left, e->third_is_right, &left, &right);
    *begin = vi_max(vi_sub(zero, left), zero), *end = vi_min(vi_add(right, one), n_cols);
}

#endif
