/* The edge between two neighbouring pixels that show different triangles, and the share of its neighbour's colour that
 * each pixel takes.
 *
 * Coordinates are pixels relative to the centre of the near pixel: `along` towards the far pixel, `beside` across.
 *
 *   silhouette   a silhouette edge of the near triangle, steeper than 45 degrees, that passes between the two centres
 *                at t: beyond 1/2 the far pixel takes t - 1/2, before it the near pixel takes 1/2 - t
 *                (Laine et al. 2020, 3.5)
 *   area         the edge where the surface ends or folds, found by a walk from the near triangle towards the far
 *                centre; each pixel takes the exact share of it that lies beyond the line of that edge.  Near 45
 *                degrees rows and columns share it; the shorter the edge, the wider the transition */
#ifndef TL_GRAD_PAIRS_C
#define TL_GRAD_PAIRS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "grad/grad.h"
#include "grad/outline.c"
#include "grad/pixels.h"
#include "lanes/lanes.h"

#define TL_CROSSING_SLACK 0.0625 /* px by which the snap may move an edge past the centre of a pixel */
#define TL_HANDOVER 0.6          /* width of the transition about 45 degrees, in the cosine of twice the angle */
#define TL_WALK_STEPS 256        /* the most steps of a walk */
#define TL_PAIRS_AT_ONCE 512     /* pairs in a list */
#define TL_PAIRS_ROOM (TL_PAIRS_AT_ONCE + 2 * TL_MAX_LANES)

/* Two neighbouring pixels. */
typedef struct {
    int64_t near, far;      /* pixels */
    int32_t id, far_id;     /* their triangles; far_id may be -1 */
    int axis;               /* 0: in a row */
    double flip, middle[2]; /* flip: 1, or -1 where the far pixel comes first */
} tl_pair;

/* The edge between the pixels of a pair. */
typedef struct {
    int32_t vertices[2];
    double t, slope, rise, ends[2]; /* position on the line of centres; d along / d beside; weights of the ends in t */
    double near, far;               /* shares */
    double near_by[2], far_by[2];   /* derivatives of the shares by t and by the slope */
} tl_pair_edge;

/* A pair and its edge. */
typedef struct {
    tl_pair pair;
    tl_pair_edge edge;
} tl_met_pair;

/* A list of pairs of neighbours. */
typedef struct {
    int64_t n;
    int32_t near[TL_PAIRS_ROOM], far[TL_PAIRS_ROOM];     /* triangles; `far` may be -1 */
    int32_t column[TL_PAIRS_ROOM], where[TL_PAIRS_ROOM]; /* of the near pixel; where: its row and TL_IN_COLUMN, ... */
    int32_t turned[TL_PAIRS_ROOM];                       /* see orient_pairs */
    int32_t end[TL_PAIRS_ROOM];                          /* the triangle that has the edge of the pair, -1 for none */
} tl_pair_list;

enum { TL_IN_COLUMN = 1, TL_IS_BEYOND = 2, TL_ROW_SHIFT = 2 };

/* Walks of the pairs of a list: the triangle that each has reached, and `far`, `column`, `where` of its pair. */
typedef struct {
    const tl_grad_view *view;
    const tl_grad_edges *edges;
    tl_pair_list *list;
    int64_t n, n_failed;
    int32_t id[TL_PAIRS_ROOM], far[TL_PAIRS_ROOM], column[TL_PAIRS_ROOM], where[TL_PAIRS_ROOM], pair[TL_PAIRS_ROOM];
    int32_t failed[TL_PAIRS_ROOM]; /* pairs whose walks failed */
} pair_walks;

/* TL_LANES walks. */
typedef struct {
    vi id, far, column, where, pair;
} walker_lanes;

TL_INLINE vm bits_set(vi a, int bits) { return vm_and_not(vm_all(), vi_eq(vi_and(a, vi_set1(bits)), vi_set1(0))); }
TL_INLINE vm vd_exceeds(vd a, vd b) { return vm_and_not(vd_ge(a, b), vd_ge(b, a)); }

/* The corners of triangles relative to the near pixels of pairs. */
typedef struct {
    vd along[3], beside[3];
} placed_lanes;

/* Places the corners of TL_LANES triangles, whose vertices exist. */
TL_INLINE void place_corners(const tl_grad_view *view, const tl_grad_edges *e, const int32_t *ids, vi column, vi where,
                             placed_lanes *p)
{
    int32_t corners[3 * TL_MAX_LANES];
    const vm in_column = bits_set(where, TL_IN_COLUMN);
    const vd half = vd_set1(0.5), x = vd_add(vd_from_vi(column), half);
    const vd y = vd_add(vd_from_vi(vi_shift_right(where, TL_ROW_SHIFT)), half);
    const vd flip = vd_select(bits_set(where, TL_IS_BEYOND), vd_set1(-1.0), vd_set1(1.0));
    for (int lane = 0; lane < TL_LANES; lane++)
        memcpy(corners + 3 * lane, view->tri + 3 * (int64_t)ids[lane], 3 * sizeof *corners);
    for (int k = 0; k < 3; k++) {
        vd px[2];
        vd_load_pairs(e->places, 2, corners + k, &px[0], &px[1]);
        px[0] = vd_sub(px[0], x), px[1] = vd_sub(px[1], y);
        p->along[k] = vd_mul(flip, vd_select(in_column, px[1], px[0]));
        p->beside[k] = vd_select(in_column, px[0], px[1]);
    }
}

/* Edges: the opposite corner, and `beside` of the two ends; t, slope and rise as in tl_pair_edge. */
typedef struct {
    vi corner;
    vd t, slope, rise, beside[2];
} exit_lanes;

/* Finds the edges that cross the lines of centres farthest along, of all edges or those allowed; returns the lanes with
 * an edge. */
TL_INLINE vm exit_edges(const placed_lanes *p, const vm *allowed, exit_lanes *edge)
{
    const vd zero = vd_set1(0.0);
    *edge = (exit_lanes){vi_set1(0), vd_set1(-9.0), zero, zero, {zero, zero}};
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const vm before = vd_ge(zero, p->beside[i]), after = vd_ge(zero, p->beside[j]);
        const vd rise = vd_sub(p->beside[j], p->beside[i]), slope = vd_div(vd_sub(p->along[j], p->along[i]), rise);
        const vd t = vd_sub(p->along[i], vd_mul(p->beside[i], slope));
        vm m = vm_and(vm_and_not(vm_or(before, after), vm_and(before, after)), vd_exceeds(t, edge->t));
        if (allowed)
            m = vm_and(m, allowed[k]);
        edge->corner = vi_select(m, vi_set1(k), edge->corner), edge->t = vd_select(m, t, edge->t);
        edge->slope = vd_select(m, slope, edge->slope), edge->rise = vd_select(m, rise, edge->rise);
        edge->beside[0] = vd_select(m, p->beside[i], edge->beside[0]);
        edge->beside[1] = vd_select(m, p->beside[j], edge->beside[1]);
    }
    return vm_and(vd_exceeds(edge->t, vd_set1(-TL_CROSSING_SLACK)),
                  vd_exceeds(vd_set1(1.0 + TL_CROSSING_SLACK), edge->t));
}

/* A step of the walks from i on, to the next triangle or to the end; returns the walks that continue.  A walk fails
 * where the snap moved an edge past a centre, and behind the eye. */
TL_INLINE vm step_walks(pair_walks *w, int64_t i, int is_last, walker_lanes *at)
{
    placed_lanes placed;
    exit_lanes edge;
    vm m = vm_first(w->n - i);
    place_corners(w->view, w->edges, w->id + i, at->column, at->where, &placed);
    const vi outline = vi_gather(m, w->edges->outline, at->id);
    const vm has_edge = vm_and(exit_edges(&placed, 0, &edge), bits_set(outline, TL_IS_AHEAD));
    const vm fails = vm_and_not(m, has_edge);
    w->n_failed += vi_compress(w->failed + w->n_failed, fails, at->pair);
    m = vm_and(m, has_edge);
    const vi other = vi_gather(m, w->edges->across, vi_add(vi_add(at->id, vi_add(at->id, at->id)), edge.corner));
    const vi most = vi_set1((int32_t)(3 * w->view->n_triangles));
    vm ends = vm_or(vi_gt(vi_set1(0), other), vm_and_not(m, vi_gt(most, other))); /* `across` may have changed */
    for (int k = 0; k < 3; k++)
        ends = vm_or(ends, vm_and(bits_set(outline, 1 << k), vi_eq(edge.corner, vi_set1(k))));
    ends = is_last ? m : vm_and(m, ends);
    for (unsigned bits = vm_bits(ends); bits; bits &= bits - 1) {
        const int64_t k = i + __builtin_ctz(bits);
        w->list->end[w->pair[k]] = w->id[k];
    }
    at->id = triangles_of_halves(other);
    return vm_and_not(vm_and_not(m, ends), vi_eq(at->id, at->far));
}

/* Walks from the near triangles to where the surface ends or folds, or to the far triangles. */
static void walk_pairs(pair_walks *w)
{
    w->n_failed = 0;
    for (int step = 0; step <= TL_WALK_STEPS && w->n; step++) {
        int64_t n_left = 0;
        vi_store(w->id + w->n, vi_set1(w->id[0])); /* every lane has a triangle */
        for (int64_t i = 0; i < w->n; i += TL_LANES) {
            walker_lanes at = {vi_load(w->id + i), vi_load(w->far + i), vi_load(w->column + i), vi_load(w->where + i),
                               vi_load(w->pair + i)};
            const vm m = step_walks(w, i, step == TL_WALK_STEPS, &at);
            vi_compress(w->id + n_left, m, at.id), vi_compress(w->far + n_left, m, at.far);
            vi_compress(w->column + n_left, m, at.column), vi_compress(w->where + n_left, m, at.where);
            n_left += vi_compress(w->pair + n_left, m, at.pair);
        }
        w->n = n_left;
    }
}

/* Swaps the near and far pixels of the pairs with `turned` = -1. */
TL_INLINE void orient_pairs(tl_pair_list *list)
{
    const vi in_column = vi_set1(TL_IN_COLUMN), is_beyond = vi_set1(TL_IS_BEYOND);
    for (int64_t i = 0; i < list->n; i += TL_LANES) {
        const vi near = vi_load(list->near + i), far = vi_load(list->far + i), where = vi_load(list->where + i);
        const vi turned = vi_load(list->turned + i), one = vi_and(turned, vi_set1(1));
        const vm m = vi_gt(vi_set1(0), turned), is_back = vi_eq(vi_and(where, is_beyond), is_beyond);
        const vi step = vi_select(is_back, vi_sub(vi_set1(0), one), one), down = vi_and(where, in_column);
        const vi row = vi_mul(step, down);
        vi_store(list->near + i, vi_select(m, far, near)), vi_store(list->far + i, vi_select(m, near, far));
        vi_store(list->column + i, vi_add(vi_load(list->column + i), vi_sub(step, row)));
        vi_store(list->where + i, vi_xor(vi_add(where, vi_shift_left(row, TL_ROW_SHIFT)), vi_and(turned, is_beyond)));
    }
}

/* Finds where the surface ends or folds between pairs: by walks from the near triangles, or, if these fail, from the
 * far ones. */
static void finish_walks(const tl_grad_view *view, const tl_grad_edges *e, tl_pair_list *list)
{
    pair_walks w;
    const size_t size = (size_t)list->n * sizeof(int32_t);
    w.view = view, w.edges = e, w.list = list, w.n = list->n;
    memcpy(w.id, list->near, size), memcpy(w.far, list->far, size);
    memcpy(w.column, list->column, size), memcpy(w.where, list->where, size);
    for (int64_t i = 0; i < list->n; i++)
        w.pair[i] = (int32_t)i, list->end[i] = -1, list->turned[i] = 0;
    walk_pairs(&w);
    for (int64_t k = 0; k < w.n_failed; k++)
        list->turned[w.failed[k]] = list->far[w.failed[k]] < 0 ? 0 : -1;
    orient_pairs(list);
    w.n = 0;
    for (int64_t k = 0; k < w.n_failed; k++) {
        const int32_t i = w.failed[k];
        if (!list->turned[i])
            continue;
        w.id[w.n] = list->near[i], w.far[w.n] = list->far[i];
        w.column[w.n] = list->column[i], w.where[w.n] = list->where[i], w.pair[w.n++] = i;
    }
    walk_pairs(&w);
}

/* Pairs in lanes, with their edges and shares; the shares as in tl_pair_edge. */
typedef struct {
    int32_t ids[TL_MAX_LANES]; /* the triangles that have the edges */
    vi where;
    vm m; /* pairs with an effect */
    placed_lanes placed;
    exit_lanes edge;
    vd near, far, near_by[2], far_by[2];
} pair_lanes;

TL_INLINE vd vd_clamped(vd a, vd low, vd high)
{
    return vd_select(vd_exceeds(low, a), low, vd_select(vd_exceeds(a, high), high, a));
}

/* Shares by silhouettes of the near triangles: edges steep enough for a pair in a row, or flat enough for a pair in a
 * column. */
TL_INLINE void share_silhouettes(const tl_grad_edges *e, pair_lanes *p)
{
    const vi outline = vi_gather(p->m, e->outline, vi_load(p->ids));
    const vm in_column = bits_set(p->where, TL_IN_COLUMN);
    const vd zero = vd_set1(0.0), one = vd_set1(1.0), minus = vd_set1(-1.0), *along = p->placed.along;
    vm allowed[3];
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const vd rise = vd_abs(vd_sub(p->placed.beside[j], p->placed.beside[i])),
                 run = vd_abs(vd_sub(along[j], along[i]));
        const vm is_steep = vm_and_not(vd_ge(rise, run), vm_and(in_column, vd_ge(run, rise)));
        allowed[k] = vm_and(is_steep, bits_set(outline, 1 << k));
    }
    p->m = vm_and(p->m, vm_and(bits_set(outline, TL_IS_AHEAD), exit_edges(&p->placed, allowed, &p->edge)));
    const vm is_between = vm_and(vd_ge(p->edge.t, zero), vd_ge(one, p->edge.t));
    const vd shift = vd_sub(vd_clamped(p->edge.t, zero, one), vd_set1(0.5));
    const vm is_far = vd_exceeds(shift, zero), is_near = vd_exceeds(zero, shift);
    p->near = vd_select(is_far, zero, vd_mul(minus, shift)), p->far = vd_select(is_far, shift, zero);
    p->near_by[0] = vd_select(vm_and(is_between, is_near), minus, zero);
    p->far_by[0] = vd_select(vm_and(is_between, is_far), one, zero);
    p->near_by[1] = p->far_by[1] = zero;
}

/* The area of unit squares before lines that cross their middle lines at u with slopes of 2 h; and its derivatives by u
 * and by h. */
TL_INLINE vd area_before(vd u, vd h, vd *by_u, vd *by_h)
{
    const vd zero = vd_set1(0.0), one = vd_set1(1.0), two = vd_set1(2.0), four = vd_set1(4.0);
    const vm is_whole = vm_or(vd_ge(vd_mul(vd_set1(-1.0), h), u), vd_ge(u, vd_add(one, h)));
    h = vd_max(vd_set1(1e-9), h);
    const vd p = vd_max(vd_sub(h, u), zero), up = vd_add(u, h);
    const vd q = vd_select(vd_exceeds(up, one), vd_sub(up, one), zero);
    const vd over = vd_sub(vd_mul(p, vd_add(h, u)), vd_mul(q, vd_add(vd_sub(h, u), one)));
    *by_u = vd_select(is_whole, zero, vd_sub(one, vd_div(vd_add(p, q), vd_mul(two, h))));
    *by_h = vd_select(is_whole, zero, vd_div(over, vd_mul(vd_mul(four, h), h)));
    const vd part = vd_add(u, vd_div(vd_sub(vd_mul(p, p), vd_mul(q, q)), vd_mul(four, h)));
    return vd_select(is_whole, vd_select(vd_exceeds(u, vd_set1(0.5)), one, zero), part);
}

/* The weight of this axis for edges; the other axis, rows or columns of pixels, has the rest. */
TL_INLINE vd share_of_axis(const exit_lanes *edge, vm in_column)
{
    const vd zero = vd_set1(0.0), one = vd_set1(1.0), half = vd_set1(0.5), size = vd_abs(edge->slope);
    const vd low = vd_max(vd_min(edge->beside[0], edge->beside[1]), vd_set1(-0.5));
    const vd high = vd_min(vd_max(edge->beside[0], edge->beside[1]), half);
    const vd width = vd_mul(vd_set1(TL_HANDOVER), vd_add(vd_sub(one, high), low));
    const vm is_steep = vm_and_not(vd_ge(one, size), vm_and(in_column, vd_ge(size, one)));
    const vd squared = vd_mul(edge->slope, edge->slope);
    const vd cosine = vd_div(vd_sub(one, squared), vd_add(one, squared));
    const vd part = vd_add(half, vd_div(cosine, vd_mul(vd_set1(2.0), width)));
    return vd_select(vd_ge(vd_set1(1e-9), width), vd_select(is_steep, one, zero), vd_clamped(part, zero, one));
}

/* Shares by the area beyond the edges where walks end. */
TL_INLINE void share_area(pair_lanes *p)
{
    const vd zero = vd_set1(0.0), half = vd_set1(0.5);
    exit_edges(&p->placed, 0, &p->edge);
    const vd slope = p->edge.slope, u = vd_clamped(p->edge.t, zero, vd_set1(1.0)), h = vd_mul(vd_abs(slope), half);
    const vd sign = vd_select(vd_exceeds(zero, slope), vd_set1(-0.5), vd_select(vd_exceeds(slope, zero), half, zero));
    const vd part = share_of_axis(&p->edge, bits_set(p->where, TL_IN_COLUMN)), less = vd_mul(vd_set1(-1.0), part);
    vd by_u, by_h;
    p->m = vm_and_not(p->m, vm_and(vd_ge(part, zero), vd_ge(zero, part)));
    p->near = vd_mul(part, vd_sub(vd_set1(1.0), area_before(vd_add(u, half), h, &by_u, &by_h)));
    p->near_by[0] = vd_mul(less, by_u), p->near_by[1] = vd_mul(vd_mul(less, by_h), sign);
    p->far = vd_mul(part, area_before(vd_sub(u, half), h, &by_u, &by_h));
    p->far_by[0] = vd_mul(part, by_u), p->far_by[1] = vd_mul(vd_mul(part, by_h), sign);
}

/* Pair i of a list, without its edge. */
TL_INLINE tl_pair pair_of(const tl_grad_view *view, const tl_pair_list *list, int64_t i)
{
    const int axis = list->where[i] & TL_IN_COLUMN, flip = list->where[i] & TL_IS_BEYOND ? -1 : 1;
    const int64_t row = list->where[i] >> TL_ROW_SHIFT, near = row * view->width + list->column[i];
    const int64_t far = near + flip * (axis ? view->width : 1);
    return (tl_pair){near, far, list->near[i], list->far[i], axis, flip, {list->column[i] + 0.5, (double)row + 0.5}};
}

/* Stores the pairs of lanes with an effect; returns how many. */
static int64_t store_pairs(const tl_grad_view *view, const tl_pair_list *list, const int32_t *which,
                           const pair_lanes *p, tl_met_pair *out)
{
    const vd rise = p->edge.rise, from = vd_div(p->edge.beside[1], rise);
    const vd to = vd_div(vd_mul(vd_set1(-1.0), p->edge.beside[0]), rise);
    const vd numbers[] = {p->edge.t, p->edge.slope, rise,          from,         to,          p->near,
                          p->far,    p->near_by[0], p->near_by[1], p->far_by[0], p->far_by[1]};
    double at[11][TL_MAX_LANES];
    int32_t corners[TL_MAX_LANES];
    int64_t n = 0;
    for (int k = 0; k < 11; k++)
        vd_store(at[k], numbers[k]);
    vi_spill(corners, p->edge.corner);
    for (unsigned bits = vm_bits(p->m); bits; bits &= bits - 1, n++) {
        const int i = __builtin_ctz(bits), k = corners[i];
        const int32_t *tri = view->tri + 3 * (int64_t)p->ids[i];
        tl_pair_edge *edge = &out[n].edge;
        out[n].pair = pair_of(view, list, which[i]);
        edge->vertices[0] = tri[(k + 1) % 3], edge->vertices[1] = tri[(k + 2) % 3];
        edge->t = at[0][i], edge->slope = at[1][i], edge->rise = at[2][i];
        edge->ends[0] = at[3][i], edge->ends[1] = at[4][i], edge->near = at[5][i], edge->far = at[6][i];
        edge->near_by[0] = at[7][i], edge->near_by[1] = at[8][i];
        edge->far_by[0] = at[9][i], edge->far_by[1] = at[10][i];
    }
    return n;
}

/* Sets the edges and shares of n pairs of a list, of TL_LANES at most; returns how many have an effect. */
TL_INLINE int64_t find_pairs(const tl_grad_view *view, const tl_grad_edges *e, const tl_pair_list *list,
                             const int32_t *which, int64_t n, tl_met_pair *out)
{
    pair_lanes p;
    const int is_area = e->rule == TL_PAIR_AREA;
    n = n < TL_LANES ? n : TL_LANES;
    if (e->rule == TL_PAIR_STRAIGHT) {
        for (int64_t i = 0; i < n; i++)
            out[i].pair = pair_of(view, list, which[i]);
        return n;
    }
    p.m = vm_first(n);
    const vi pair = vi_select(p.m, vi_load(which), vi_set1(which[0])); /* every lane has a triangle */
    p.where = vi_gather(vm_all(), list->where, pair);
    vi_spill(p.ids, vi_gather(vm_all(), is_area ? list->end : list->near, pair));
    place_corners(view, e, p.ids, vi_gather(vm_all(), list->column, pair), p.where, &p.placed);
    if (is_area)
        share_area(&p);
    else
        share_silhouettes(e, &p);
    return store_pairs(view, list, which, &p, out);
}

/* Lists the pairs that may have an effect, after their walks; returns how many. */
static int64_t list_pairs(const tl_grad_view *view, const tl_grad_edges *e, tl_pair_list *list, int32_t *which)
{
    int64_t n = 0;
    if (e->rule == TL_PAIR_AREA)
        finish_walks(view, e, list);
    for (int64_t i = 0; i < list->n; i++) {
        which[n] = (int32_t)i;
        n += e->rule != TL_PAIR_AREA || list->end[i] >= 0;
    }
    return n;
}

/* Adds the gradient of a vertex's pixel coordinates to its sums of x, y, z, w. */
TL_INLINE void backward_vertex(const tl_grad_view *view, tl_grad_sums *sums, int32_t vertex, const double *g_px)
{
    double *to = sums_of(sums, vertex);
    const double w = get_real(view->pos, 4 * (int64_t)vertex + 3, view->is_f64);
    for (int axis = 0; axis < 2; axis++) {
        const double g = g_px[axis] / (2.0 * view->scale[axis]) / w;
        to[axis] += g;
        to[3] -= g * (get_real(view->pos, 4 * (int64_t)vertex + axis, view->is_f64) / w);
    }
}

/* Adds the gradients of the ends of an edge, from the gradients of both shares. */
static void backward_edge(const tl_grad_view *view, const tl_pair *pair, const tl_pair_edge *edge, double g_near,
                          double g_far, tl_grad_sums *sums)
{
    const double g_t = g_near * edge->near_by[0] + g_far * edge->far_by[0];
    const double by_rise = (g_near * edge->near_by[1] + g_far * edge->far_by[1]) / edge->rise;
    for (int k = 0; k < 2; k++) {
        const double g = g_t * edge->ends[k] + (k ? by_rise : -by_rise);
        double g_px[2];
        g_px[pair->axis] = pair->flip * g, g_px[1 - pair->axis] = -edge->slope * g;
        backward_vertex(view, sums, edge->vertices[k], g_px);
    }
}

#endif
