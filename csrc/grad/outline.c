/* The edges of a mesh in a view: pixel positions of vertices, which side of a triangle is visible, and which edges are
 * silhouettes.
 * In: vertices, triangles, the triangle across each edge.  Out: positions in pixels, bits by triangle. */
#ifndef TL_GRAD_OUTLINE_C
#define TL_GRAD_OUTLINE_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/pixels.h"
#include "lanes/lanes.h"

/* x, y, z, w of some vertices; all of them exist. */
TL_INLINE void load_vertices_of(const tl_grad_view *view, const int32_t *vertices, vd *columns, int is_f64)
{
    vi bits[4];
    if (is_f64) {
        vd_load_records(view->pos, 4, vertices, columns);
        return;
    }
    vi_load_records(view->pos, 16, vertices, bits);
    for (int k = 0; k < 4; k++)
        columns[k] = vd_from_vf(vf_of_bits(bits[k]));
}

/* The range [*first, *end) of n items that a part has. */
TL_INLINE void share_of_part(int64_t n, const tl_grad_outline *o, int64_t *first, int64_t *end)
{
    *first = n * o->part / o->n_parts, *end = n * (o->part + 1) / o->n_parts;
}

/* Sets the pixel positions of vertices. */
TL_INLINE void place_vertices(const tl_grad_view *view, const tl_grad_outline *o, int is_f64)
{
    int32_t rows[TL_MAX_LANES];
    double px[2][TL_MAX_LANES];
    vd columns[4];
    int64_t i, end;
    for (share_of_part(view->n_vertices, o, &i, &end); i < end; i += TL_LANES) {
        const int64_t n = end - i < TL_LANES ? end - i : TL_LANES;
        for (int64_t k = 0; k < TL_LANES; k++)
            rows[k] = (int32_t)(k < n ? i + k : i);
        load_vertices_of(view, rows, columns, is_f64);
        for (int axis = 0; axis < 2; axis++)
            vd_store(px[axis], vd_div(vd_sub(vd_div(columns[axis], columns[3]), vd_set1(view->shift[axis])),
                                      vd_set1(2.0 * view->scale[axis])));
        for (int64_t k = 0; k < n; k++)
            o->places[2 * (i + k)] = px[0][k], o->places[2 * (i + k) + 1] = px[1][k];
    }
}

/* Loads three numbers of each of TL_LANES triangles from i on, 0 beyond n, as columns. */
TL_INLINE void load_threes(const int32_t *rows, int64_t i, int64_t n, vi *columns)
{
    int32_t last[3 * TL_MAX_LANES + 4];
    vf bits[4];
    const int32_t *some = rows + 3 * i;
    if (n - i <= TL_LANES) { /* a row beyond is read */
        memset(last, 0, sizeof last);
        memcpy(last, some, (size_t)(3 * (n - i)) * sizeof *last);
        some = last;
    }
    load_columns_f32((const float *)some, 3, bits);
    for (int k = 0; k < 3; k++)
        columns[k] = vi_bits_of_vf(bits[k]);
}

/* The sign of TL_LANES numbers: 1 above 0, 2 below, 0 else. */
TL_INLINE vi sign_code(vd area)
{
    const vd zero = vd_set1(0.0);
    const vi one = vi_set1(1), two = vi_set1(2), none = vi_set1(0);
    const vm is_up = vd_ge(area, zero), is_down = vd_ge(zero, area);
    return vi_select(vm_and_not(is_up, is_down), one, vi_select(vm_and_not(is_down, is_up), two, none));
}

/* Sets the sides of triangles, and TL_IS_AHEAD; -1 where corners do not exist. */
TL_INLINE void face_triangles(const tl_grad_view *view, const tl_grad_outline *o, int is_f64)
{
    const vd zero = vd_set1(0.0);
    const vi n_vertices = vi_set1(clamped_to_int(view->n_vertices)), none = vi_set1(0);
    int32_t rows[TL_MAX_LANES];
    vd p[3][4];
    int64_t i, end;
    share_of_part(view->n_triangles, o, &i, &end);
    for (; i < end && !view->n_vertices; i++)
        o->sides[i] = -1;
    for (; i < end; i += TL_LANES) {
        const vm m = vm_first(end - i);
        vi corners[3], ahead = vi_set1(TL_IS_AHEAD);
        vm is_there = m;
        load_threes(view->tri, i, view->n_triangles, corners);
        for (int k = 0; k < 3; k++)
            is_there = vm_and(is_there, vi_gt_unsigned(n_vertices, corners[k]));
        for (int k = 0; k < 3; k++) {
            vi_spill(rows, vi_select(is_there, corners[k], none));
            load_vertices_of(view, rows, p[k], is_f64);
            const vm is_behind = vd_ge(zero, p[k][3]); /* w > 0 */
            ahead = vi_select(vm_and_not(vd_ge(p[k][3], zero), is_behind), ahead, none);
        }
        const vd a = vd_sub(vd_mul(p[1][1], p[2][3]), vd_mul(p[1][3], p[2][1]));
        const vd b = vd_sub(vd_mul(p[1][3], p[2][0]), vd_mul(p[1][0], p[2][3]));
        const vd c = vd_sub(vd_mul(p[1][0], p[2][1]), vd_mul(p[1][1], p[2][0]));
        const vd area = vd_add(vd_add(vd_mul(p[0][0], a), vd_mul(p[0][1], b)), vd_mul(p[0][3], c));
        const vi side = vi_or(vi_shift_left(sign_code(area), TL_SIDE_SHIFT), ahead);
        vi_store_masked(o->sides + i, m, vi_select(is_there, side, vi_set1(-1)));
    }
}

/* Whether the surface folds at an edge of triangles that are wound differently, or of more than two. */
TL_INLINE int is_twisted_fold(const tl_grad_view *view, const int32_t *sides, int32_t id, int k, int32_t other)
{
    const int32_t own = sides[id] & TL_SIDES, across = sides[other / 3] & TL_SIDES;
    const int32_t *a = view->tri + 3 * (int64_t)id, *b = view->tri + 3 * (int64_t)(other / 3);
    const int is_reversed = a[(k + 1) % 3] != b[(other % 3 + 1) % 3];
    return is_reversed ? (own | across) == TL_SIDES : own && own == across;
}

/* Triangles of half-edges >= 0: a third of them. */
TL_INLINE vi triangles_of_halves(vi a)
{
    return vi_round(vd_mul(vd_from_vi(vi_sub(a, vi_set1(1))), vd_set1(1.0 / 3.0)));
}

/* Marks the edges that are borders or folds of the surface. */
static void mark_silhouettes(const tl_grad_view *view, const tl_grad_outline *o)
{
    const vi none = vi_set1(-1), sides = vi_set1(TL_SIDES), most = vi_set1((int32_t)(3 * view->n_triangles));
    int32_t halves[TL_MAX_LANES];
    int64_t i, end;
    for (share_of_part(view->n_triangles, o, &i, &end); i < end; i += TL_LANES) {
        const vm m = vm_first(end - i);
        const vi own = vi_load_masked(m, o->sides + i);
        vi marks = own, across[3];
        load_threes(o->across, i, view->n_triangles, across);
        for (int k = 0; k < 3; k++) {
            const vi other = vi_select(vi_gt(none, across[k]), vi_sub(vi_set1(-2), across[k]), across[k]);
            vm is_there = vm_and(m, vm_and(vi_gt(other, none), vi_gt(most, other)));
            const vi beyond = vi_gather(is_there, o->sides, triangles_of_halves(other));
            is_there = vm_and(is_there, vi_gt(beyond, none));
            const vm goes_on = vm_and_not(is_there, vi_eq(vi_and(vi_or(own, beyond), sides), sides));
            unsigned bits = vm_bits(goes_on);
            unsigned twisted = vm_bits(vm_and(vm_and(is_there, vi_gt(own, none)), vi_gt(none, across[k])));
            vi_spill(halves, other);
            for (; twisted; twisted &= twisted - 1) {
                const int lane = __builtin_ctz(twisted);
                const int folds = is_twisted_fold(view, o->sides, (int32_t)i + lane, k, halves[lane]);
                bits = (bits & ~(1u << lane)) | (unsigned)!folds << lane;
            }
            marks = vi_select(vm_from_bits(bits), marks, vi_or(marks, vi_set1(1 << k)));
        }
        vi_store_masked(o->outline + i, m, vi_select(vi_gt(own, none), marks, own));
    }
}

/* See kernels.h. */
static void grad_sides(const tl_grad_view *view, const tl_grad_outline *o)
{
    if (view->is_f64) {
        place_vertices(view, o, 1);
        face_triangles(view, o, 1);
    } else {
        place_vertices(view, o, 0);
        face_triangles(view, o, 0);
    }
}

#endif
