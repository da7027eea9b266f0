/* Simple: whether the rings of a polygon neither cross nor touch, and what the area of each ring then counts.
 * In: rings.  Out: a weight for each ring, and a flag for each polygon.
 *
 * Where rings do not meet, the winding number is constant on either side of each: k outside of it and k + s inside, s
 * its direction.  By the rule f (odd, or not 0) its signed area then counts s (f(k + s) - f(k)), and the area of the
 * polygon is the weighted sum of those of its rings, whichever way these run.  A ring that turns one way alone, once
 * round, is simple; otherwise edges are met in the order of their upper ends, each compared with those that reach
 * down to it.  All in integers.
 *
 * Based on: M. I. Shamos, D. Hoey, Geometric Intersection Problems, 1976 (the sweep). */
#ifndef TL_POLYGON_SIMPLE_C
#define TL_POLYGON_SIMPLE_C

#include <stdint.h>

#include "lanes/lanes.h"
#include "polygons.h"
#include "polygons/points.c"
#include "polygons/sort_pairs.c"
#include "vertex/fixed.h"

/* Edges that are compared for each one, and some for all: polygons beyond are resolved pixel by pixel. */
#define TL_COMPARED_EDGES 64

TL_INLINE int sign_of_128(tl_int128 a) { return (a > 0) - (a < 0); }

/* On which side of the line from a to b the point c lies: the sign of the area of a, b, c. */
TL_INLINE int side_of(const tl_polygons *p, int is_wide, int64_t a, int64_t b, int64_t c)
{
    const int64_t ax = polygon_x(p, is_wide, a), ay = polygon_y(p, is_wide, a);
    const int64_t bx = polygon_x(p, is_wide, b) - ax, by = polygon_y(p, is_wide, b) - ay;
    const int64_t cx = polygon_x(p, is_wide, c) - ax, cy = polygon_y(p, is_wide, c) - ay;
    if (is_wide)
        return sign_of_128((tl_int128)bx * cy - (tl_int128)by * cx);
    const int64_t area = bx * cy - by * cx;
    return (area > 0) - (area < 0);
}

/* 1 or -1 for a ring that is convex with the interior on its right or left, y down; otherwise 0.  Points may repeat,
 * and lie on a line. */
TL_INLINE int convex_turn(const tl_polygons *p, int is_wide, int64_t first, int64_t end)
{
    int turn = 0, n_extremes = 0, was_down = 0, first_down = 0, has_first = 0;
    int64_t last = end - 1; /* the point before `i` that is another one */
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
                return 0; /* back on itself */
        } else if (turn && side != turn) {
            return 0;
        } else {
            turn = side;
        }
        /* half-planes that directions point into: once round changes between them twice */
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
    tl_int128 high = 0, low = 0; /* of wide products there may be more than 128 bits hold */
    const int64_t x0 = polygon_x(p, is_wide, first), y0 = polygon_y(p, is_wide, first);
    for (int64_t i = first + 1; i + 1 < end; i++) {
        const tl_int128 a = (tl_int128)(polygon_x(p, is_wide, i) - x0) * (polygon_y(p, is_wide, i + 1) - y0);
        const tl_int128 b = (tl_int128)(polygon_y(p, is_wide, i) - y0) * (polygon_x(p, is_wide, i + 1) - x0),
                        area = a - b;
        high += area >> 64, low += (tl_int128)(uint64_t)area;
    }
    high += low >> 64, low = (tl_int128)(uint64_t)low;
    return high ? sign_of_128(high) : low > 0;
}

/* An edge that is no point: its ends from top to bottom, how it runs, and its place in its ring. */
typedef struct {
    int64_t a, b; /* points, in the direction of the ring */
    int32_t ring, place;
} sweep_edge;

typedef struct {
    int64_t x_low, x_high, y_high;
    int64_t i;
} swept;

static int do_edges_meet(const tl_polygons *p, int is_wide, const sweep_edge *e, const sweep_edge *f, int n_in_ring)
{
    if (e->ring == f->ring) {
        const int apart = e->place < f->place ? f->place - e->place : e->place - f->place;
        if (apart == 1 || apart == n_in_ring - 1) { /* they share a point; back along each other they share more */
            const int is_after = apart == 1 ? e->place < f->place : e->place > f->place;
            const sweep_edge *before = is_after ? e : f, *after = is_after ? f : e;
            if (n_in_ring < 3)
                return 1;
            if (side_of(p, is_wide, before->a, before->b, after->b))
                return 0;
            const int64_t dx = polygon_x(p, is_wide, before->b) - polygon_x(p, is_wide, before->a);
            const int64_t dy = polygon_y(p, is_wide, before->b) - polygon_y(p, is_wide, before->a);
            const int64_t ex = polygon_x(p, is_wide, after->b) - polygon_x(p, is_wide, after->a);
            const int64_t ey = polygon_y(p, is_wide, after->b) - polygon_y(p, is_wide, after->a);
            return (dx > 0) != (ex > 0) || (dx < 0) != (ex < 0) || (dy > 0) != (ey > 0) || (dy < 0) != (ey < 0);
        }
    }
    const int s0 = side_of(p, is_wide, e->a, e->b, f->a), s1 = side_of(p, is_wide, e->a, e->b, f->b);
    if (s0 * s1 > 0)
        return 0;
    return side_of(p, is_wide, f->a, f->b, e->a) * side_of(p, is_wide, f->a, f->b, e->b) <= 0;
}

TL_INLINE int rule_holds(const tl_polygons *p, int winding) { return p->is_nonzero ? winding != 0 : winding & 1; }

/* The sweep.  room: TL_CERTIFY_WORDS int64 an edge. */
TL_INLINE int sweep_rings(const tl_polygons *p, int is_wide, int64_t polygon, int8_t *weights, int64_t *room)
{
    const int64_t r0 = p->polygons[polygon], r1 = p->polygons[polygon + 1], n_points = p->rings[r1] - p->rings[r0];
    sweep_edge *edges = (sweep_edge *)room; /* 3 words an edge */
    keyed *pairs = (keyed *)(room + 3 * n_points), *other = pairs + n_points;
    int64_t n = 0;
    for (int64_t ring = r0; ring < r1; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1], start = n;
        weights[ring] = 0;
        for (int64_t i = first; i < end; i++) {
            const int64_t j = i + 1 < end ? i + 1 : first;
            if (polygon_x(p, is_wide, i) == polygon_x(p, is_wide, j) &&
                polygon_y(p, is_wide, i) == polygon_y(p, is_wide, j))
                continue;
            const int64_t ya = polygon_y(p, is_wide, i), yb = polygon_y(p, is_wide, j);
            edges[n] = (sweep_edge){i, j, (int32_t)(ring - r0), (int32_t)(n - start)};
            pairs[n] = (keyed){ya < yb ? ya : yb, n};
            n++;
        }
        if (n > start) /* until the ring is met, the number of its edges stands in the place of its first one */
            edges[start].place = -(int32_t)(n - start);
    }
    pairs = sort_pairs(pairs, other, n);
    /* what reaches down to the edge that is met; where `other` or `pairs` was free: four words an edge more */
    swept *active = (swept *)(room + 7 * n_points);
    int64_t n_active = 0, n_left = TL_COMPARED_EDGES * n + (1 << 16);
    (void)active;
    for (int64_t k = 0; k < n; k++) {
        const sweep_edge *e = edges + pairs[k].i;
        const int64_t first = pairs[k].i - (e->place < 0 ? 0 : e->place);
        const int n_in_ring = -edges[first].place;
        sweep_edge own = *e;
        own.place = own.place < 0 ? 0 : own.place;
        const int64_t xa = polygon_x(p, is_wide, e->a), xb = polygon_x(p, is_wide, e->b);
        const int64_t ya = polygon_y(p, is_wide, e->a), yb = polygon_y(p, is_wide, e->b), y_low = ya < yb ? ya : yb;
        const swept s = {xa < xb ? xa : xb, xa < xb ? xb : xa, ya < yb ? yb : ya, pairs[k].i};
        const int is_first = weights[r0 + e->ring] == 0;
        const int64_t top = ya < yb ? e->a : e->b;
        int64_t n_kept = 0;
        int winding = 0;
        n_left -= n_active;
        if (n_left < 0)
            return 0;
        for (int64_t m = 0; m < n_active; m++) {
            const swept o = active[m];
            if (o.y_high < y_low)
                continue;
            active[n_kept++] = o;
            sweep_edge f = edges[o.i];
            f.place = f.place < 0 ? 0 : f.place;
            if (o.x_low <= s.x_high && o.x_high >= s.x_low && do_edges_meet(p, is_wide, &own, &f, n_in_ring))
                return 0;
            if (is_first) { /* how often the rings that were met wind round the highest point of this one */
                const int64_t fa = polygon_y(p, is_wide, f.a), fb = polygon_y(p, is_wide, f.b);
                const int is_down = fa < fb;
                if ((is_down ? fa : fb) < y_low && y_low <= (is_down ? fb : fa))
                    winding +=
                        side_of(p, is_wide, is_down ? f.a : f.b, is_down ? f.b : f.a, top) < 0 ? (is_down ? 1 : -1) : 0;
            }
        }
        active[n_kept] = s;
        n_active = n_kept + 1;
        if (is_first) { /* 2: the ring counts nothing, 3 and 1: its weight and 2 */
            const int64_t ring = r0 + e->ring;
            const int turn = ring_turn(p, is_wide, p->rings[ring], p->rings[ring + 1]);
            /* y down, positive areas run downwards on the right: inside, one less */
            weights[ring] = (int8_t)(2 + turn * (rule_holds(p, winding - turn) - rule_holds(p, winding)));
        }
    }
    for (int64_t ring = r0; ring < r1; ring++)
        weights[ring] = (int8_t)(weights[ring] ? weights[ring] - 2 : 0);
    return 1;
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
    return sweep_rings(p, is_wide, polygon, weights, room);
}

/* Sets weights and is_simple of polygons [first, end). */
static void certify_polygons(const tl_polygons *p, int64_t first, int64_t end, int8_t *weights, uint8_t *is_simple_out,
                             int64_t *room)
{
    for (int64_t i = first; i < end; i++)
        is_simple_out[i] =
            (uint8_t)(p->is_wide[i] ? is_simple(p, 1, i, weights, room) : is_simple(p, 0, i, weights, room));
}

/* The same of polygons that are known to be valid: the first ring of each is its border, the others are holes. */
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
