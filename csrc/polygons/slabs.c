/* Slabs: the share of one pixel that lies in a polygon, from the pieces of edges that reach into it.
 * In: pieces, and the changes of the winding number left of the pixel.  Out: float64.
 *
 * The heights at which pieces begin, end, enter or leave the pixel cut it into slabs: within a slab no piece does. The
 * pieces of a slab are sorted from left to right at its upper end, and swapped where they cross, the highest crossing
 * first, until they are sorted at its lower end: a crossing costs log n, and the order is unique at each height,
 * whatever rounding does to the heights.  The trapezoid between two neighbours is inside or outside.
 *
 * Error: heights are off by 2^-50 px unless edges cross at a small angle; slabs thinner than TL_THIN count as nothing,
 * and so does the error of a crossing of nearly parallel edges, which is as thin.
 *
 * Based on: J. L. Bentley, T. A. Ottmann, Algorithms for Reporting and Counting Geometric Intersections, 1979. */
#ifndef TL_POLYGON_SLABS_C
#define TL_POLYGON_SLABS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/sort_pairs.h"
#include "polygons/points.c"
#include "polygons/polygons.h"

#define TL_THIN 0x1p-44 /* px of height */

#define TL_FEW_NEW 8 /* new pieces that are sorted by insertion */
/* Slabs of many edges count as crossings, too: TL_EDGES_OF_CROSSING edges take as long as a crossing. */
#define TL_FEW_EDGES 64
#define TL_EDGES_OF_CROSSING 16

#define TL_CROSSINGS_TO_POLL 256 /* between two polls for cancelling; a power of two */

/* A piece in the slab. */
typedef struct {
    double top, bottom;     /* px right of the pixel's left border, at the ends of the slab */
    double since;           /* the height up to which its area is added */
    int32_t piece, winding; /* winding: left of it */
} slab_edge;

/* An event at a height: N_KINDS * piece + kind, or -1 - k for the k-th change. */
enum { COMES_LEFT, ENDS_LEFT, ENTERS, ENTERS_FROM_LEFT, LEAVES, LEAVES_TO_LEFT, N_KINDS = 8 };

/* The pieces of one row, from left to right, and the state of its sweep. */
typedef struct {
    const tl_polygons *p;
    const tl_edge_piece *pieces;
    int32_t *active;       /* pieces that reach into the pixel */
    int32_t *at, *change;  /* the winding number left of the pixel changes by `change` at height `at`, in sub-pixels */
    keyed *events, *spare; /* by height */
    slab_edge *edges, *moved;
    double *crossings; /* a tree: the heights at which neighbours cross; each node is the least below it */
    int n_active, n_changes, n_events, n_edges, n_new;
    int32_t winding; /* left of the pixel, in the slab */
    int is_nonzero, is_given_up;
    int64_t n_crossings;
    double pixel; /* a sub-pixel */
} piece_row;

static inline double piece_x(const tl_edge_piece *e, int64_t col, double y)
{
    return e->x + (double)(e->col - col) + (y - e->ya) * e->slope;
}

static inline int64_t key_of_f64(double x)
{
    int64_t key;
    memcpy(&key, &x, sizeof key);
    return key ^ (key >> 63 & INT64_MAX);
}

static inline double f64_of_key(int64_t key)
{
    double x;
    key ^= key >> 63 & INT64_MAX;
    memcpy(&x, &key, sizeof x);
    return x;
}

/* Whether the rings have crossed more often than the call allows. */
static inline int cross_too_often(const tl_polygons *p)
{
    return __atomic_load_n(p->crossings_left, __ATOMIC_RELAXED) < 0;
}

static void count_crossings(piece_row *w)
{
    __atomic_fetch_sub(w->p->crossings_left, w->n_crossings, __ATOMIC_RELAXED);
    w->n_crossings = 0;
}

static inline void list_event(piece_row *w, double height, int64_t i)
{
    if (height < 1.0)
        w->events[w->n_events++] = (keyed){key_of_f64(height), i};
}

/* Lists the events of a piece: where it enters and leaves the pixel by its left, right, upper or lower side. */
static void list_ends(piece_row *w, int64_t col, int64_t piece)
{
    const tl_edge_piece *e = w->pieces + piece;
    const double left = (double)(col - e->col) - e->x; /* px from the piece's upper end to the pixel */
    const int is_leftwards = e->slope < 0.0;
    double at_left = left >= 0.0 ? e->yb : e->ya, at_right = left > -1.0 ? e->yb : e->ya;
    if (e->slope != 0.0) {
        at_left = fmin(fmax(e->ya + left / e->slope, e->ya), e->yb);
        at_right = fmin(fmax(e->ya + (left + 1.0) / e->slope, e->ya), e->yb);
    }
    const double in = is_leftwards ? at_right : at_left, out = is_leftwards ? at_left : at_right;
    const int has_left = is_leftwards ? out < e->yb : e->ya < in, is_inside = in < out;
    piece *= N_KINDS;
    if (has_left && !is_leftwards)
        list_event(w, e->ya, piece + COMES_LEFT);
    if (is_inside) {
        list_event(w, in, piece + (has_left && !is_leftwards ? ENTERS_FROM_LEFT : ENTERS));
        list_event(w, out, piece + (has_left && is_leftwards ? LEAVES_TO_LEFT : LEAVES));
    } else if (has_left) {
        list_event(w, is_leftwards ? out : in, piece + (is_leftwards ? COMES_LEFT : ENDS_LEFT));
    }
    if (has_left && is_leftwards)
        list_event(w, e->yb, piece + ENDS_LEFT);
}

static void take_event(piece_row *w, int64_t i)
{
    if (i < 0) {
        w->winding += w->change[-1 - i];
        return;
    }
    const int32_t piece = (int32_t)(i / N_KINDS), sign = w->pieces[piece].sign;
    const int kind = (int)(i % N_KINDS);
    if (kind == COMES_LEFT || kind == LEAVES_TO_LEFT)
        w->winding += sign;
    if (kind == ENDS_LEFT || kind == ENTERS_FROM_LEFT)
        w->winding -= sign;
    if (kind == ENTERS || kind == ENTERS_FROM_LEFT) {
        w->edges[w->n_edges++].piece = piece;
        w->n_new++;
    }
    if (kind == LEAVES || kind == LEAVES_TO_LEFT) {
        int k = 0;
        while (w->edges[k].piece != piece)
            k++;
        memmove(w->edges + k, w->edges + k + 1, sizeof *w->edges * (size_t)(--w->n_edges - k));
    }
}

/* Sorts the edges by x at the upper end of the slab, equal ones by x at the lower end. */
static void sort_slab(piece_row *w)
{
    const int n = w->n_edges;
    if (w->n_new > TL_FEW_NEW) {
        keyed *pairs = w->spare, *room = pairs + n;
        for (int k = 0; k < n; k++)
            pairs[k] = (keyed){key_of_f64(w->edges[k].bottom), k};
        keyed *sorted = sort_pairs(pairs, room, n);
        for (int k = 0; k < n; k++)
            sorted[k].key = key_of_f64(w->edges[sorted[k].i].top);
        sorted = sort_pairs(sorted, sorted == pairs ? room : pairs, n);
        for (int k = 0; k < n; k++)
            w->moved[k] = w->edges[sorted[k].i];
        slab_edge *const other = w->edges;
        w->edges = w->moved, w->moved = other;
    }
    w->n_new = 0;
    for (int i = 1; i < n; i++) {
        const slab_edge e = w->edges[i];
        int k = i;
        for (; k > 0 &&
               (w->edges[k - 1].top > e.top || (w->edges[k - 1].top == e.top && w->edges[k - 1].bottom > e.bottom));
             k--)
            w->edges[k] = w->edges[k - 1];
        w->edges[k] = e;
    }
}

static inline int is_winding_inside(const piece_row *w, int32_t winding)
{
    return w->is_nonzero ? winding != 0 : winding & 1;
}

/* Sets the height at which the edges k and k + 1 cross in the slab, INFINITY if they do not. */
static void set_crossing(piece_row *w, int n_leaves, int k, double y, double next)
{
    if (k < 0 || k + 1 >= w->n_edges)
        return;
    const slab_edge *a = w->edges + k, *b = a + 1;
    const double before = b->top - a->top, after = a->bottom - b->bottom;
    double *tree = w->crossings;
    k += n_leaves;
    tree[k] = after > 0.0 ? y + (next - y) * (before / (before + after)) : INFINITY;
    for (; k > 1; k >>= 1)
        tree[k >> 1] = tree[k] < tree[k ^ 1] ? tree[k] : tree[k ^ 1];
}

/* The area inside that an edge adds from e->since to height y: x times the height where only its left side is inside,
 * -x times it where only its right side is. */
static inline double area_along(const piece_row *w, int64_t col, slab_edge *e, double y)
{
    const tl_edge_piece *piece = w->pieces + e->piece;
    const int step = is_winding_inside(w, e->winding) - is_winding_inside(w, e->winding + piece->sign);
    const double height = y - e->since, x = step ? piece_x(piece, col, 0.5 * (e->since + y)) : 0.0;
    e->since = y;
    return (double)step * x * height;
}

/* The area in a slab whose edges cross; they are sorted at its upper end, with their windings there. */
static double resolve_crossings(piece_row *w, int64_t col, double y, double next, int32_t right)
{
    const int n = w->n_edges;
    int n_leaves = 1;
    while (n_leaves < n)
        n_leaves *= 2;
    for (int k = 0; k < 2 * n_leaves; k++)
        w->crossings[k] = INFINITY;
    for (int k = 0; k + 1 < n; k++)
        if (w->edges[k].bottom > w->edges[k + 1].bottom)
            set_crossing(w, n_leaves, k, y, next);
    double area = is_winding_inside(w, right) ? next - y : 0.0, height = y;
    while (w->crossings[1] < INFINITY) {
        int k = 1;
        while (k < n_leaves)
            k = 2 * k + (w->crossings[2 * k] > w->crossings[2 * k + 1]);
        height = fmax(height, fmin(w->crossings[k], next));
        k -= n_leaves;
        slab_edge *a = w->edges + k, *b = a + 1;
        area += area_along(w, col, a, height);
        area += area_along(w, col, b, height);
        const slab_edge now_right = *a;
        *a = *b, *b = now_right;
        a->winding = b->winding;
        b->winding += w->pieces[a->piece].sign;
        set_crossing(w, n_leaves, k, y, next);
        set_crossing(w, n_leaves, k - 1, y, next);
        set_crossing(w, n_leaves, k + 1, y, next);
        if ((++w->n_crossings & (TL_CROSSINGS_TO_POLL - 1)) == 0) {
            count_crossings(w);
            if (cross_too_often(w->p) || is_polygon_given_up(w->p, 32 * TL_CROSSINGS_TO_POLL)) {
                w->is_given_up = 1;
                return 0.0;
            }
        }
    }
    for (int k = 0; k < n; k++)
        area += area_along(w, col, w->edges + k, next);
    return area;
}

/* The area in the slab from height y to `next`. */
static double resolve_slab(piece_row *w, int64_t col, double y, double next)
{
    const int n = w->n_edges;
    for (int k = 0; k < n; k++) {
        const tl_edge_piece *piece = w->pieces + w->edges[k].piece;
        w->edges[k].top = piece_x(piece, col, y), w->edges[k].bottom = piece_x(piece, col, next);
    }
    sort_slab(w);
    int32_t winding = w->winding;
    int is_crossed = 0;
    for (int k = 0; k < n; k++) {
        slab_edge *e = w->edges + k;
        is_crossed |= k > 0 && e[-1].bottom > e->bottom;
        e->winding = winding, e->since = y;
        winding += w->pieces[e->piece].sign;
    }
    w->n_crossings += n > TL_FEW_EDGES ? n / TL_EDGES_OF_CROSSING : 0;
    if (w->n_crossings > TL_CROSSINGS_TO_POLL)
        count_crossings(w);
    if (is_polygon_given_up(w->p, 4 * n) || cross_too_often(w->p))
        w->is_given_up = 1;
    if (is_crossed)
        return resolve_crossings(w, col, y, next, winding);
    double inside = 0.0, before = 0.0;
    for (int k = 0; k < n; k++) {
        const slab_edge *e = w->edges + k;
        const double x = piece_x(w->pieces + e->piece, col, 0.5 * (y + next));
        if (is_winding_inside(w, e->winding))
            inside += x - before;
        before = x;
    }
    if (is_winding_inside(w, winding))
        inside += 1.0 - before;
    return inside * (next - y);
}

/* The share of one pixel. */
static double resolve_pixel(piece_row *w, int64_t col)
{
    w->n_events = w->n_edges = w->n_new = 0, w->winding = 0;
    for (int k = 0; k < w->n_changes; k++)
        list_event(w, (double)w->at[k] * w->pixel, -1 - k);
    for (int k = 0; k < w->n_active; k++)
        list_ends(w, col, w->active[k]);
    const keyed *events = sort_pairs(w->events, w->spare, w->n_events);
    if (events == w->spare)
        w->spare = w->events, w->events = (keyed *)events;
    double area = 0.0, y = 0.0;
    for (int k = 0; k <= w->n_events && !w->is_given_up; k++) {
        const double next = k < w->n_events ? f64_of_key(events[k].key) : 1.0;
        if (next > y + TL_THIN) {
            area += resolve_slab(w, col, y, next);
            y = next;
        }
        if (k < w->n_events)
            take_event(w, events[k].i);
    }
    return area;
}

#endif
