/* Simple: whether the rings of a polygon neither cross nor touch, and if so the weight of each ring's area.
 * In: rings.  Out: a weight for each ring, and a flag for each polygon.
 *
 * Where rings do not meet, the winding number is constant on either side of each: k outside of it and k + s inside, s
 * its direction.  By the rule f (odd, or not 0) its signed area then counts s (f(k + s) - f(k)), and the area of the
 * polygon is the weighted sum of the areas of its rings, whichever way these run.
 *
 * A ring that only turns one way, once round, is simple.  Otherwise rings are cut into chains of a few edges, the
 * leaves of a tree: neighbours along a ring are near each other, so no sort is needed.  Two nodes are apart when their
 * boxes are, or when a line separates them.  A chain whose edges point into one half plane does not meet itself, and a
 * line across its direction is a good candidate to separate it: this suits noisy rings with spikes side by side.  Other
 * pairs are compared edge by edge.  All in integers, or in doubles that hold integers.
 *
 * Based on: M. I. Shamos, D. Hoey, Geometric Intersection Problems, 1976 (that n log n comparisons do); D. H. Ballard,
 * Strip Trees, 1981 (a tree over the chain itself). */
#ifndef TL_POLYGON_SIMPLE_C
#define TL_POLYGON_SIMPLE_C

#include <stdint.h>

#include "base/sort_pairs.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "polygons/crossings.c"
#include "polygons/points.c"
#include "polygons/polygons.h"

/* Edges of a leaf; tl_certify_words depends on it.  32 saves a fifth on noisy rings, and costs a third more on
 * contours. */
#define TL_CHAIN_EDGES 16

/* The most points that are compared with a line; a node with more is split. */
#define TL_LINE_POINTS 128

/* Comparisons per edge, and a constant: polygons that need more are resolved pixel by pixel. */
#define TL_COMPARED_NODES 128

/* The side of the line from a to b on which c lies: the sign of the area of a, b, c. */
TL_INLINE int side_of(const tl_polygons *p, int is_wide, int64_t a, int64_t b, int64_t c)
{
    const int64_t ax = polygon_x(p, is_wide, a), ay = polygon_y(p, is_wide, a);
    const int64_t bx = polygon_x(p, is_wide, b) - ax, by = polygon_y(p, is_wide, b) - ay;
    const int64_t cx = polygon_x(p, is_wide, c) - ax, cy = polygon_y(p, is_wide, c) - ay;
    if (is_wide)
        return i128_sign(i128_sub(i128_product(bx, cy), i128_product(by, cx)));
    const int64_t area = bx * cy - by * cx;
    return (area > 0) - (area < 0);
}

/* 1 or -1 for a convex ring with the interior on its right or left, y down; otherwise 0.  Points may repeat, and be
 * collinear. */
TL_INLINE int convex_turn(const tl_polygons *p, int is_wide, int64_t first, int64_t end)
{
    int turn = 0, n_extremes = 0, was_down = 0, first_down = 0, has_first = 0;
    int64_t last = end - 1; /* the last point before `i` that differs from it */
    while (last > first && polygon_x(p, is_wide, last) == polygon_x(p, is_wide, first) &&
           polygon_y(p, is_wide, last) == polygon_y(p, is_wide, first))
        last--;
    for (int64_t i = first; i < end; i++) {
        const int64_t x = polygon_x(p, is_wide, i), y = polygon_y(p, is_wide, i);
        if (x == polygon_x(p, is_wide, last) && y == polygon_y(p, is_wide, last))
            continue;
        int64_t next = i + 1 < end ? i + 1 : first;
        while (next != i && polygon_x(p, is_wide, next) == x && polygon_y(p, is_wide, next) == y)
            next = next + 1 < end ? next + 1 : first;
        const int side = side_of(p, is_wide, last, i, next);
        if (side == 0) {
            const int64_t dx = x - polygon_x(p, is_wide, last), dy = y - polygon_y(p, is_wide, last);
            const int64_t ex = polygon_x(p, is_wide, next) - x, ey = polygon_y(p, is_wide, next) - y;
            if ((dx > 0) != (ex > 0) || (dx < 0) != (ex < 0) || (dy > 0) != (ey > 0) || (dy < 0) != (ey < 0))
                return 0; /* turns back on itself */
        } else if (turn && side != turn) {
            return 0;
        } else {
            turn = side;
        }
        /* half planes of directions: a ring that turns once changes between them twice */
        const int64_t dx = polygon_x(p, is_wide, next) - x, dy = polygon_y(p, is_wide, next) - y;
        const int is_down = dy > 0 || (dy == 0 && dx > 0);
        if (!has_first)
            first_down = is_down, has_first = 1;
        else
            n_extremes += is_down != was_down;
        was_down = is_down;
        last = i;
    }
    return n_extremes + (was_down != first_down) == 2 ? turn : 0;
}

/* The sign of the area that a ring encloses. */
static int ring_turn(const tl_polygons *p, int is_wide, int64_t first, int64_t end)
{
    /* high 2^64 + low: sums of wide products may exceed 128 bits */
    tl_int128 high = i128_from(0), low = high;
    const int64_t x0 = polygon_x(p, is_wide, first), y0 = polygon_y(p, is_wide, first);
    for (int64_t i = first + 1; !is_wide && i + 1 < end;) {
        int64_t some = 0; /* products have 51 bits */
        for (const int64_t stop = i + 2048 < end - 1 ? i + 2048 : end - 1; i < stop; i++)
            some += (p->x_fx[i] - x0) * (p->y_fx[i + 1] - y0) - (p->y_fx[i] - y0) * (p->x_fx[i + 1] - x0);
        low = i128_add(low, i128_from(some));
    }
    for (int64_t i = first + 1; is_wide && i + 1 < end; i++) {
        const tl_int128 a = i128_product(polygon_x(p, 1, i) - x0, polygon_y(p, 1, i + 1) - y0);
        const tl_int128 b = i128_product(polygon_y(p, 1, i) - y0, polygon_x(p, 1, i + 1) - x0), area = i128_sub(a, b);
        high = i128_add(high, i128_shift_right(area, 64));
        low = i128_add(low, i128_from_u64((uint64_t)i128_low(area)));
    }
    high = i128_add(high, i128_shift_right(low, 64));
    return i128_is_zero(high) ? i128_low(low) != 0 : i128_sign(high);
}

typedef struct {
    int64_t x, y;
} direction;

TL_INLINE int64_t turn_between(direction a, direction b) { return a.x * b.y - a.y * b.x; }

/* The edges [first, first + n) of a ring, with a node for each half of them; or several whole rings. */
typedef struct {
    int64_t x0, y0, x1, y1;
    int32_t first, n;        /* points, relative to the polygon's first */
    int32_t ring;            /* relative to the polygon's first; -1: several */
    int32_t left, right;     /* nodes; -1 for a leaf */
    int32_t is_monotone;     /* all edges point into one half plane, between `low` and `high`; never when wide */
    int32_t low[2], high[2]; /* cross(low, high) > 0, or equal directions; 0: all points are equal */
} chain_node;

_Static_assert(sizeof(chain_node) == 9 * sizeof(int64_t) && TL_CHAIN_EDGES == 16, "tl_certify_words");

typedef struct {
    const tl_polygons *p;
    int64_t base, ring_base; /* the polygon's first point and ring */
    chain_node *nodes;
    int32_t n_nodes;
    int is_wide;
    int64_t n_left; /* comparisons */
} simple_search;

TL_INLINE int64_t ring_first(const simple_search *s, int32_t ring) { return s->p->rings[s->ring_base + ring]; }
TL_INLINE int64_t ring_end(const simple_search *s, int32_t ring) { return s->p->rings[s->ring_base + ring + 1]; }

/* The point where edge i of a ring ends. */
TL_INLINE int64_t edge_end(const simple_search *s, int32_t ring, int64_t i)
{
    return i + 1 < ring_end(s, ring) ? i + 1 : ring_first(s, ring);
}

TL_INLINE direction edge_direction(const simple_search *s, int64_t a, int64_t b)
{
    return (direction){polygon_x(s->p, s->is_wide, b) - polygon_x(s->p, s->is_wide, a),
                       polygon_y(s->p, s->is_wide, b) - polygon_y(s->p, s->is_wide, a)};
}

/* Widens the directions [low, high] by d; branches only for parallel directions.  Returns 0 when no half plane holds
 * them all. */
TL_INLINE int widen_directions(direction *low, direction *high, direction d)
{
    const int64_t after_low = turn_between(*low, d), before_high = turn_between(d, *high);
    if ((after_low | before_high) == 0) { /* equal or opposite directions, or 0 */
        *low = low->x | low->y ? *low : d, *high = high->x | high->y ? *high : d;
        return low->x * d.x + low->y * d.y >= 0;
    }
    const int is_higher = before_high < 0, is_lower = after_low < 0;
    high->x = is_higher ? d.x : high->x, high->y = is_higher ? d.y : high->y;
    low->x = is_lower ? d.x : low->x, low->y = is_lower ? d.y : low->y;
    return !((is_higher & (after_low <= 0)) | (is_lower & (before_high <= 0)));
}

/* Joins the directions of two nodes. */
TL_INLINE int join_directions(const chain_node *a, const chain_node *b, direction *low, direction *high)
{
    *low = (direction){a->low[0], a->low[1]}, *high = (direction){a->high[0], a->high[1]};
    return a->is_monotone && b->is_monotone && widen_directions(low, high, (direction){b->low[0], b->low[1]}) &&
           widen_directions(low, high, (direction){b->high[0], b->high[1]});
}

TL_INLINE void keep_directions(chain_node *node, int is_monotone, direction low, direction high)
{
    node->is_monotone = is_monotone;
    node->low[0] = (int32_t)low.x, node->low[1] = (int32_t)low.y;
    node->high[0] = (int32_t)high.x, node->high[1] = (int32_t)high.y;
}

TL_INLINE int32_t make_leaf(simple_search *s, int is_wide, int32_t ring, int64_t first, int64_t n)
{
    const tl_polygons *p = s->p;
    const int64_t end = ring_end(s, ring), last = first + n < end ? first + n : ring_first(s, ring);
    int64_t x = polygon_x(p, is_wide, last), y = polygon_y(p, is_wide, last);
    int64_t x0 = x, x1 = x, y0 = y, y1 = y;
    direction low = {0, 0}, high = {0, 0};
    int is_monotone = !is_wide;
    for (int64_t i = first + n - 1; i >= first; i--) {
        const int64_t ax = polygon_x(p, is_wide, i), ay = polygon_y(p, is_wide, i);
        x0 = ax < x0 ? ax : x0, x1 = ax > x1 ? ax : x1, y0 = ay < y0 ? ay : y0, y1 = ay > y1 ? ay : y1;
        if (!is_wide)
            is_monotone &= widen_directions(&low, &high, (direction){x - ax, y - ay});
        x = ax, y = ay;
    }
    s->nodes[s->n_nodes] =
        (chain_node){x0, y0, x1, y1, (int32_t)(first - s->base), (int32_t)n, ring, -1, -1, 0, {0, 0}, {0, 0}};
    keep_directions(s->nodes + s->n_nodes, is_monotone, low, high);
    return s->n_nodes++;
}

static int32_t join_nodes(simple_search *s, int32_t left, int32_t right)
{
    const chain_node *a = s->nodes + left, *b = s->nodes + right;
    chain_node *node = s->nodes + s->n_nodes;
    direction low, high;
    *node = (chain_node){a->x0 < b->x0 ? a->x0 : b->x0,
                         a->y0 < b->y0 ? a->y0 : b->y0,
                         a->x1 > b->x1 ? a->x1 : b->x1,
                         a->y1 > b->y1 ? a->y1 : b->y1,
                         a->first,
                         a->n + b->n,
                         a->ring == b->ring ? a->ring : -1,
                         left,
                         right,
                         0,
                         {0, 0},
                         {0, 0}};
    if (node->ring >= 0) {
        const int is_monotone = join_directions(a, b, &low, &high);
        keep_directions(node, is_monotone, low, high);
    }
    return s->n_nodes++;
}

/* Makes the tree of n edges of a ring. */
static int32_t make_chain(simple_search *s, int32_t ring, int64_t first, int64_t n)
{
    if (n <= TL_CHAIN_EDGES)
        return s->is_wide ? make_leaf(s, 1, ring, first, n) : make_leaf(s, 0, ring, first, n);
    const int64_t n_left = (n / 2 + TL_CHAIN_EDGES - 1) / TL_CHAIN_EDGES * TL_CHAIN_EDGES;
    const int32_t left = make_chain(s, ring, first, n_left), right = make_chain(s, ring, first + n_left, n - n_left);
    return join_nodes(s, left, right);
}

/* Makes the tree of rings that are sorted by position. */
static int32_t make_rings(simple_search *s, const keyed *rings, int64_t n)
{
    if (n == 1)
        return (int32_t)rings[0].i;
    const int32_t left = make_rings(s, rings, n / 2), right = make_rings(s, rings + n / 2, n - n / 2);
    return join_nodes(s, left, right);
}

/* Makes the whole tree; `pairs` has room for two for each ring.  Sets *sorted to their roots, sorted by position. */
static int32_t make_tree(simple_search *s, int64_t n_rings, keyed *pairs, const keyed **sorted)
{
    int64_t x0 = INT64_MAX, y0 = INT64_MAX, extent = 1;
    for (int64_t ring = 0; ring < n_rings; ring++) {
        const int64_t first = ring_first(s, (int32_t)ring);
        const int32_t root = make_chain(s, (int32_t)ring, first, ring_end(s, (int32_t)ring) - first);
        const chain_node *node = s->nodes + root;
        pairs[ring].i = root;
        x0 = node->x0 < x0 ? node->x0 : x0, y0 = node->y0 < y0 ? node->y0 : y0;
    }
    for (int64_t ring = 0; ring < n_rings; ring++) {
        const chain_node *node = s->nodes + pairs[ring].i;
        extent = node->x0 - x0 > extent ? node->x0 - x0 : extent;
        extent = node->y0 - y0 > extent ? node->y0 - y0 : extent;
    }
    int shift = 0; /* of 62 bits at most */
    while (extent >> shift > 0xffff)
        shift++;
    for (int64_t ring = 0; ring < n_rings; ring++) {
        const chain_node *node = s->nodes + pairs[ring].i;
        pairs[ring].key = interleave_zeros((node->x0 - x0) >> shift) | interleave_zeros((node->y0 - y0) >> shift) << 1;
    }
    *sorted = sort_pairs(pairs, pairs + n_rings, n_rings);
    return make_rings(s, *sorted, n_rings);
}

/* The next edge with a length. */
static int64_t next_edge(simple_search *s, int32_t ring, int64_t i)
{
    int64_t next = edge_end(s, ring, i);
    for (; next != i && s->n_left >= 0; s->n_left--) {
        const direction d = edge_direction(s, next, edge_end(s, ring, next));
        if (d.x || d.y)
            break;
        next = edge_end(s, ring, next);
    }
    return next;
}

/* Whether two edges that share a point do so only because one ends where the other begins. */
static int is_corner(simple_search *s, int32_t ring_e, int64_t e, int32_t ring_f, int64_t f)
{
    if (ring_e != ring_f)
        return 0;
    int64_t before = e, after = f;
    if (next_edge(s, ring_e, e) != f)
        before = f, after = e;
    if (before == f && next_edge(s, ring_e, f) != e)
        return 0;
    const int64_t middle = edge_end(s, ring_e, before), end = edge_end(s, ring_e, after);
    if (side_of(s->p, s->is_wide, before, middle, end))
        return 1;
    const direction d = edge_direction(s, before, middle), g = edge_direction(s, after, end);
    return (d.x > 0) == (g.x > 0) && (d.x < 0) == (g.x < 0) && (d.y > 0) == (g.y > 0) && (d.y < 0) == (g.y < 0);
}

/* The lanes of TL_LANES edges from (ax, ay) to (bx, by) that share a point with the edge from (px, py) to (qx, qy).
 * Differences have 25 bits, so products are exact. */
TL_INLINE vm lanes_that_meet(int32_t px, int32_t py, int32_t qx, int32_t qy, vi ax, vi ay, vi bx, vi by)
{
    const vi x0 = vi_set1(px < qx ? px : qx), x1 = vi_set1(px < qx ? qx : px);
    const vi y0 = vi_set1(py < qy ? py : qy), y1 = vi_set1(py < qy ? qy : py);
    const vm beside = vm_or(vi_gt(x0, vi_max(ax, bx)), vi_gt(vi_min(ax, bx), x1));
    const vm apart = vm_or(beside, vm_or(vi_gt(y0, vi_max(ay, by)), vi_gt(vi_min(ay, by), y1)));
    const vm is_point = vm_and(vi_eq(ax, bx), vi_eq(ay, by));
    vm on = vm_and_not(vm_and_not(vm_all(), apart), is_point);
    if (!vm_any(on))
        return on;
    const vd one = vd_set1(1.0), dx = vd_set1((double)(qx - px)), dy = vd_set1((double)(qy - py));
    const vd cx = vd_from_vi(vi_sub(ax, vi_set1(px))), cy = vd_from_vi(vi_sub(ay, vi_set1(py)));
    const vd ex = vd_from_vi(vi_sub(bx, vi_set1(px))), ey = vd_from_vi(vi_sub(by, vi_set1(py)));
    const vd a = vd_sub(vd_mul(dx, cy), vd_mul(dy, cx)), b = vd_sub(vd_mul(dx, ey), vd_mul(dy, ex));
    on = vm_and_not(on, vd_ge(vd_mul(a, b), one)); /* both ends on one side */
    if (!vm_any(on))
        return on;
    const vd fx = vd_sub(ex, cx), fy = vd_sub(ey, cy);
    const vd c = vd_sub(vd_mul(fy, cx), vd_mul(fx, cy));
    const vd d = vd_sub(vd_mul(fx, vd_sub(dy, cy)), vd_mul(fy, vd_sub(dx, cx)));
    return vm_and_not(on, vd_ge(vd_mul(c, d), one));
}

static int do_wide_edges_meet(const simple_search *s, int64_t a, int64_t b, int64_t c, int64_t d)
{
    const int64_t *v = s->p->wide_fx;
    for (int k = 0; k < 2; k++) {
        const int64_t e = v[2 * a + k], f = v[2 * b + k], g = v[2 * c + k], h = v[2 * d + k];
        if ((e < g && e < h && f < g && f < h) || (e > g && e > h && f > g && f > h))
            return 0;
    }
    return side_of(s->p, 1, a, b, c) * side_of(s->p, 1, a, b, d) <= 0 &&
           side_of(s->p, 1, c, d, a) * side_of(s->p, 1, c, d, b) <= 0;
}

/* Whether the edges of two leaves, or of a leaf with itself, do not meet. */
static int are_leaves_apart(simple_search *s, const chain_node *a, const chain_node *b)
{
    const tl_polygons *p = s->p;
    const int64_t first_a = s->base + a->first, first_b = s->base + b->first;
    s->n_left -= a->n;
    for (int64_t i = first_a; i < first_a + a->n; i++) {
        const int64_t end = edge_end(s, a->ring, i), skip = a == b ? i + 1 - first_b : 0;
        const direction d = edge_direction(s, i, end);
        if (d.x == 0 && d.y == 0)
            continue;
        if (s->is_wide) {
            for (int64_t j = first_b + skip; j < first_b + b->n; j++) {
                const int64_t end_j = edge_end(s, b->ring, j);
                const direction g = edge_direction(s, j, end_j);
                if ((g.x || g.y) && do_wide_edges_meet(s, i, end, j, end_j) && !is_corner(s, a->ring, i, b->ring, j))
                    return 0;
            }
            continue;
        }
        const int32_t px = p->x_fx[i], py = p->y_fx[i], qx = p->x_fx[end], qy = p->y_fx[end];
        if ((px < b->x0 && qx < b->x0) || (px > b->x1 && qx > b->x1) || (py < b->y0 && qy < b->y0) ||
            (py > b->y1 && qy > b->y1))
            continue;
        for (int64_t k = skip; k < b->n; k += TL_LANES) {
            vi ax, ay, bx, by;
            load_ring_edges(p, ring_first(s, b->ring), ring_end(s, b->ring), first_b + k, &ax, &ay, &bx, &by);
            const vm meets = vm_and(lanes_that_meet(px, py, qx, qy, ax, ay, bx, by), vm_first(b->n - k));
            for (unsigned lanes = vm_bits(meets); lanes; lanes &= lanes - 1)
                if (!is_corner(s, a->ring, i, b->ring, first_b + k + __builtin_ctz(lanes)))
                    return 0;
        }
    }
    return s->n_left >= 0;
}

/* Whether a line across the direction of chain a separates a from b.  A chain b that begins where a ends, or ends where
 * a begins, may reach that line: only one point of a does. */
static int is_parted(simple_search *s, const chain_node *a, const chain_node *b, int is_next, int is_before)
{
    const tl_polygons *p = s->p;
    const int64_t start = s->base + a->first, stop = edge_end(s, a->ring, start + a->n - 1);
    const double x = (double)p->x_fx[start], y = (double)p->y_fx[start];
    double dx = (double)a->high[1] - a->low[1], dy = (double)a->low[0] - a->high[0]; /* 26 bits, products 52 */
    if (dx == 0 && dy == 0)
        dx = a->low[0], dy = a->low[1];
    const double end = ((double)p->x_fx[stop] - x) * dx + ((double)p->y_fx[stop] - y) * dy;
    /* b lies beyond `after` or before `before`, both integers */
    const double after = is_next ? end - 1 : end, before = is_before ? 1 : 0;
    const double ax = ((double)b->x0 - x) * dx, bx = ((double)b->x1 - x) * dx;
    const double ay = ((double)b->y0 - y) * dy, by = ((double)b->y1 - y) * dy;
    if ((ax < bx ? ax : bx) + (ay < by ? ay : by) > after || (ax > bx ? ax : bx) + (ay > by ? ay : by) < before)
        return 1;
    if (b->n > TL_LINE_POINTS || b->ring < 0) /* b of several rings: not tested */
        return 0;
    s->n_left -= b->n / TL_CHAIN_EDGES;
    const int64_t first = s->base + b->first, last = edge_end(s, b->ring, first + b->n - 1);
    const double own = ((double)p->x_fx[last] - x) * dx + ((double)p->y_fx[last] - y) * dy;
    int is_after = own > after, is_ahead = own < before;
    for (int64_t k = 0; k < b->n && (is_after || is_ahead); k += TL_LANES) {
        const vm live = vm_first(b->n - k);
        const vd px = vd_sub(vd_from_vi(vi_load(p->x_fx + first + k)), vd_set1(x));
        const vd py = vd_sub(vd_from_vi(vi_load(p->y_fx + first + k)), vd_set1(y));
        const vd at = vd_add(vd_mul(px, vd_set1(dx)), vd_mul(py, vd_set1(dy)));
        is_after = is_after && !vm_any(vm_and(live, vd_ge(vd_set1(after), at)));
        is_ahead = is_ahead && !vm_any(vm_and(live, vd_ge(at, vd_set1(before))));
    }
    return is_after || is_ahead;
}

/* Whether b begins where a ends. */
TL_INLINE int follows(const simple_search *s, const chain_node *a, const chain_node *b)
{
    return a->ring >= 0 && a->ring == b->ring &&
           edge_end(s, a->ring, s->base + a->first + a->n - 1) == s->base + b->first;
}

/* Whether no edge of a leaf meets the box of a node. */
static int is_clear_of(const simple_search *s, const chain_node *leaf, const chain_node *node)
{
    const tl_polygons *p = s->p;
    const int64_t first = s->base + leaf->first;
    const vi x0 = vi_set1((int32_t)node->x0), x1 = vi_set1((int32_t)node->x1);
    const vi y0 = vi_set1((int32_t)node->y0), y1 = vi_set1((int32_t)node->y1);
    for (int64_t k = 0; k < leaf->n; k += TL_LANES) {
        vi ax, ay, bx, by;
        load_ring_edges(p, ring_first(s, leaf->ring), ring_end(s, leaf->ring), first + k, &ax, &ay, &bx, &by);
        const vm beside = vm_or(vi_gt(x0, vi_max(ax, bx)), vi_gt(vi_min(ax, bx), x1));
        const vm apart = vm_or(beside, vm_or(vi_gt(y0, vi_max(ay, by)), vi_gt(vi_min(ay, by), y1)));
        if (vm_any(vm_and_not(vm_first(leaf->n - k), apart)))
            return 0;
    }
    return 1;
}

/* Whether two nodes share no point, except where one ends and the other begins. */
static int are_apart(simple_search *s, const chain_node *a, const chain_node *b)
{
    if (a->x0 > b->x1 || b->x0 > a->x1 || a->y0 > b->y1 || b->y0 > a->y1)
        return 1;
    if (--s->n_left < 0)
        return 0;
    const int is_next = follows(s, a, b), is_before = follows(s, b, a);
    direction low, high;
    if (is_next != is_before && join_directions(a, b, &low, &high))
        return 1;
    if (a->is_monotone && a->ring >= 0 && is_parted(s, a, b, is_next, is_before))
        return 1;
    if (b->is_monotone && b->ring >= 0 && is_parted(s, b, a, is_before, is_next))
        return 1;
    if (a->left < 0 && b->left < 0)
        return are_leaves_apart(s, a, b);
    if (!s->is_wide && !is_next && !is_before && (a->left < 0 || b->left < 0) &&
        (a->left < 0 ? is_clear_of(s, a, b) : is_clear_of(s, b, a)))
        return 1;
    if (b->left < 0 || (a->left >= 0 && a->n >= b->n))
        return are_apart(s, s->nodes + a->left, b) && are_apart(s, s->nodes + a->right, b);
    return are_apart(s, a, s->nodes + b->left) && are_apart(s, a, s->nodes + b->right);
}

/* Whether the edges of a node do not meet. */
static int is_free(simple_search *s, const chain_node *a)
{
    if (a->is_monotone)
        return 1;
    if (a->left < 0)
        return are_leaves_apart(s, a, a);
    if (is_polygon_given_up(s->p, 256))
        return 0;
    return is_free(s, s->nodes + a->left) && is_free(s, s->nodes + a->right) &&
           are_apart(s, s->nodes + a->left, s->nodes + a->right);
}

/* The winding number of the other rings below a node about a point on none of them, from the edges left of it. */
static int wound_by(simple_search *s, const chain_node *a, int32_t ring, int64_t point)
{
    const int is_wide = s->is_wide;
    const int64_t x = polygon_x(s->p, is_wide, point), y = polygon_y(s->p, is_wide, point);
    if (a->ring == ring || y < a->y0 || y >= a->y1 || x < a->x0)
        return 0;
    s->n_left--;
    if (x > a->x1) { /* all of it lies left: its ends suffice */
        if (a->ring < 0)
            return 0;
        const int64_t first = s->base + a->first, last = edge_end(s, a->ring, first + a->n - 1);
        return (polygon_y(s->p, is_wide, first) <= y) - (polygon_y(s->p, is_wide, last) <= y);
    }
    if (a->left >= 0)
        return s->n_left < 0
                   ? 0
                   : wound_by(s, s->nodes + a->left, ring, point) + wound_by(s, s->nodes + a->right, ring, point);
    int winding = 0;
    for (int64_t i = s->base + a->first; i < s->base + a->first + a->n; i++) {
        const int64_t end = edge_end(s, a->ring, i);
        const int down = (polygon_y(s->p, is_wide, i) <= y) - (polygon_y(s->p, is_wide, end) <= y);
        if (down && side_of(s->p, is_wide, down > 0 ? i : end, down > 0 ? end : i, point) < 0)
            winding += down;
    }
    return winding;
}

TL_INLINE int rule_holds(int is_nonzero, int winding) { return is_nonzero ? winding != 0 : winding & 1; }

/* Whether the rings of a polygon do not meet, by comparison; if so, sets their weights. */
static int compare_rings(const tl_polygons *p, int is_wide, int64_t polygon, int8_t *weights, int64_t *room)
{
    const int64_t r0 = p->polygons[polygon], n_rings = p->polygons[polygon + 1] - r0, base = p->rings[r0];
    const int64_t n_points = p->rings[r0 + n_rings] - base;
    const int is_nonzero = p->is_nonzero[polygon];
    simple_search s = {p, base, r0, NULL, 0, is_wide, TL_COMPARED_NODES * n_points + (1 << 16)};
    if (n_rings == 0)
        return 1;
    s.nodes = (chain_node *)(room + 4 * n_rings);
    const keyed *roots;
    const int32_t root = make_tree(&s, n_rings, (keyed *)room, &roots);
    if (!is_free(&s, s.nodes + root))
        return 0;
    s.n_left = TL_COMPARED_NODES * n_points + (1 << 16);
    for (int64_t k = 0; k < n_rings; k++) { /* in this order neighbours read nodes in the cache */
        const int32_t ring = s.nodes[roots[k].i].ring;
        const int64_t first = p->rings[r0 + ring];
        const int winding = n_rings == 1 ? 0 : wound_by(&s, s.nodes + root, ring, first);
        const int turn = ring_turn(p, is_wide, first, p->rings[r0 + ring + 1]);
        /* y down, a positive area runs downwards on its right: inside the winding number is one less */
        const int is_inside = rule_holds(is_nonzero, winding - turn);
        weights[r0 + ring] = (int8_t)(turn * (is_inside - rule_holds(is_nonzero, winding)));
    }
    return s.n_left >= 0;
}

TL_INLINE int is_simple(const tl_polygons *p, int is_wide, int64_t polygon, int8_t *weights, int64_t *room)
{
    const int64_t r0 = p->polygons[polygon], r1 = p->polygons[polygon + 1];
    if (r1 - r0 == 1) {
        const int turn = convex_turn(p, is_wide, p->rings[r0], p->rings[r1]);
        weights[r0] = (int8_t)turn;
        if (turn)
            return 1;
    }
    return compare_rings(p, is_wide, polygon, weights, room);
}

static void certify_polygons(const tl_polygons *p, int64_t first, int64_t end, int8_t *weights, uint8_t *is_simple_out,
                             int64_t *room)
{
    for (int64_t i = first; i < end && !is_polygon_given_up(p, 64); i++)
        is_simple_out[i] =
            (uint8_t)(p->is_wide[i] ? is_simple(p, 1, i, weights, room) : is_simple(p, 0, i, weights, room));
}

static void trust_polygons(const tl_polygons *p, int64_t first, int64_t end, int8_t *weights, uint8_t *is_simple_out)
{
    for (int64_t i = first; i < end; i++) {
        is_simple_out[i] = 1;
        for (int64_t ring = p->polygons[i]; ring < p->polygons[i + 1]; ring++) {
            const int turn = ring_turn(p, p->is_wide[i], p->rings[ring], p->rings[ring + 1]);
            weights[ring] = (int8_t)(ring == p->polygons[i] ? turn : -turn);
        }
    }
}

#endif
