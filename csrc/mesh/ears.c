/* Ears: cuts polygons with any number of corners into triangles.
 * In: points in space, and faces as consecutive corners.  Out: triangles.
 *
 * A face is projected along its area vector.  A face without a reflex corner becomes a fan; from other faces ears are
 * cut off: a corner that is not reflex, whose triangle with its neighbours holds no reflex corner.  The next ear is the
 * first ear after the last one; if there is none, the next corner.
 *
 * A corner that is no ear is blocked by a reflex corner in its triangle, and is tested again when that corner stops
 * being reflex or its neighbours change.  If several reflex corners block it, any of them may be stored; only the time
 * depends on it: the search starts at another position for each corner, so that no reflex corner blocks all. Corners
 * that may be ears are bits of a tree of words; reflex corners are leaves of a tree of boxes, in the order of a
 * space-filling curve.
 *
 * Based on: G. H. Meisters, Polygons Have Ears, American Mathematical Monthly 82(6), 1975; Newell's area vector as in
 * I. E. Sutherland, R. F. Sproull, R. A. Schumacker, A Characterization of Ten Hidden-Surface Algorithms, 1974; G. M.
 * Morton, A Computer Oriented Geodetic Data Base, 1966 (the curve). */
#ifndef TL_EARS_C
#define TL_EARS_C

#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "base/sort_pairs.h"
#include "mesh/faces.h"

#define TL_EAR_LEVELS 11 /* of either tree: 8^11 is more than int32 corners */
#define TL_EAR_STEPS_TO_POLL 16384
#define TL_EAR_WIDTH 8 /* children of a box, and corners of a leaf */

/* Relative to the area of a polygon: corners that turn by less count as straight, against rounding. */
#define TL_TURN_TOO_SMALL 1e-12

typedef struct {
    double x0, y0, x1, y1;
    int64_t n; /* reflex corners in it */
} ear_box;

/* A face during the cutting of its ears. */
typedef struct {
    double *x, *y;                        /* to the right and up; the face turns left */
    int32_t *before, *after;              /* neighbours that are not cut off */
    int32_t *first_blocked;               /* the first corner that a reflex corner blocks, or -1 */
    int32_t *blocker;                     /* the reflex corner that blocks a corner, or -1 */
    int32_t *next_blocked, *prev_blocked; /* in the list of its blocker, or -1 */
    int32_t *place;                       /* position of a reflex corner along the curve; -1: not reflex */
    uint64_t *bits[TL_EAR_LEVELS];        /* corners that may be ears; above level 0 a bit for each word below */
    int n_bit_levels;
    keyed *curve; /* the corners that were reflex at first */
    int64_t n_curve;
    ear_box *boxes[TL_EAR_LEVELS];
    int n_box_levels;
    int64_t n_steps;
} ear_face;

static void set_bit(ear_face *f, int64_t i)
{
    for (int level = 0; level < f->n_bit_levels; level++, i >>= 6)
        f->bits[level][i >> 6] |= (uint64_t)1 << (i & 63);
}

static void clear_bit(ear_face *f, int64_t i)
{
    for (int level = 0; level < f->n_bit_levels; level++, i >>= 6)
        if (f->bits[level][i >> 6] &= ~((uint64_t)1 << (i & 63)))
            return;
}

/* The first bit from i on, or -1; there is one bit more after the last, which is 0. */
static int64_t next_bit(const ear_face *f, int64_t i)
{
    for (int level = 0; level < f->n_bit_levels; level++) {
        const uint64_t word = f->bits[level][i >> 6] >> (i & 63);
        if (word) {
            for (i += __builtin_ctzll(word); level > 0; level--)
                i = 64 * i + __builtin_ctzll(f->bits[level - 1][i]);
            return i;
        }
        i = (i >> 6) + 1;
    }
    return -1;
}

static inline double turn_at(const ear_face *f, int32_t i)
{
    const int32_t a = f->before[i], c = f->after[i];
    return (f->x[i] - f->x[a]) * (f->y[c] - f->y[a]) - (f->y[i] - f->y[a]) * (f->x[c] - f->x[a]);
}

/* Sorts the reflex corners along the curve, and sets the boxes. */
static void make_ear_boxes(ear_face *f, int32_t k, keyed *pairs, int64_t *room)
{
    int64_t n = 0;
    for (int32_t i = 0; i < k; i++) {
        f->place[i] = -1;
        if (turn_at(f, i) < 0) { /* coordinates have size 1 */
            const int64_t x = (int64_t)((f->x[i] + 1) * 0x7fff), y = (int64_t)((f->y[i] + 1) * 0x7fff);
            pairs[n++] = (keyed){interleave_zeros(x) | interleave_zeros(y) << 1, i};
        }
    }
    f->curve = sort_pairs(pairs, pairs + k, n), f->n_curve = n;
    f->n_box_levels = 0;
    for (int64_t at = 0; at < n; at++)
        f->place[f->curve[at].i] = (int32_t)at;
    for (int64_t n_below = n; f->n_box_levels == 0 || n_below > 1;) {
        const int level = f->n_box_levels++;
        const int64_t n_here = (n_below + TL_EAR_WIDTH - 1) / TL_EAR_WIDTH;
        ear_box *boxes = f->boxes[level] = (ear_box *)room;
        room += n_here * (int64_t)(sizeof(ear_box) / sizeof(int64_t));
        for (int64_t at = 0; at < n_below; at++) {
            ear_box own, *to = boxes + at / TL_EAR_WIDTH;
            if (level) {
                own = f->boxes[level - 1][at];
            } else {
                const double x = f->x[f->curve[at].i], y = f->y[f->curve[at].i];
                own = (ear_box){x, y, x, y, 1};
            }
            if (at % TL_EAR_WIDTH == 0) {
                *to = own;
                continue;
            }
            to->x0 = own.x0 < to->x0 ? own.x0 : to->x0, to->y0 = own.y0 < to->y0 ? own.y0 : to->y0;
            to->x1 = own.x1 > to->x1 ? own.x1 : to->x1, to->y1 = own.y1 > to->y1 ? own.y1 : to->y1;
            to->n += own.n;
        }
        n_below = n_here;
    }
}

/* Removes a corner from the list of its blocker. */
static void unblock(ear_face *f, int32_t i)
{
    if (f->blocker[i] < 0)
        return;
    const int32_t before = f->prev_blocked[i], next = f->next_blocked[i];
    if (before >= 0)
        f->next_blocked[before] = next;
    else
        f->first_blocked[f->blocker[i]] = next;
    if (next >= 0)
        f->prev_blocked[next] = before;
    f->blocker[i] = -1;
}

static void block(ear_face *f, int32_t i, int32_t blocker)
{
    const int32_t next = f->first_blocked[blocker];
    f->blocker[i] = blocker, f->prev_blocked[i] = -1, f->next_blocked[i] = next;
    if (next >= 0)
        f->prev_blocked[next] = i;
    f->first_blocked[blocker] = i;
}

/* Removes a corner from the reflex corners. */
static void end_reflex(ear_face *f, int32_t i)
{
    int64_t at = f->place[i];
    f->place[i] = -1;
    for (int level = 0; level < f->n_box_levels; level++)
        f->boxes[level][at /= TL_EAR_WIDTH].n--;
    while (f->first_blocked[i] >= 0) {
        const int32_t blocked = f->first_blocked[i];
        unblock(f, blocked);
        set_bit(f, blocked);
    }
}

/* A triangle that may be an ear.  A point is in it when (bx - ax) (y - ay) >= (by - ay) (x - ax) for each side, in
 * float64; products and differences are monotone, so the ends of a box decide for all of its points.  They are off by
 * less than 2^-49 for coordinates of size 1, so a point that counts as inside lies in the triangle's box, widened by
 * the share of its sides that this error is of its area. */
typedef struct {
    double x[3], y[3], dx[3], dy[3];
    ear_box box;
} ear_triangle;

static ear_triangle ear_of(const ear_face *f, int32_t i)
{
    const int32_t corners[3] = {f->before[i], i, f->after[i]};
    ear_triangle t;
    for (int k = 0; k < 3; k++)
        t.x[k] = f->x[corners[k]], t.y[k] = f->y[corners[k]];
    for (int k = 0; k < 3; k++)
        t.dx[k] = t.x[(k + 1) % 3] - t.x[k], t.dy[k] = t.y[(k + 1) % 3] - t.y[k];
    t.box = (ear_box){fmin(fmin(t.x[0], t.x[1]), t.x[2]), fmin(fmin(t.y[0], t.y[1]), t.y[2]),
                      fmax(fmax(t.x[0], t.x[1]), t.x[2]), fmax(fmax(t.y[0], t.y[1]), t.y[2]), 0};
    const double more =
        0x1p-46 / fabs(turn_at(f, i)); /* infinite for a straight corner: points on its line count as inside */
    const double more_x = more * (t.box.x1 - t.box.x0) + 0x1p-50, more_y = more * (t.box.y1 - t.box.y0) + 0x1p-50;
    t.box.x0 -= more < 1 ? more_x : 8, t.box.x1 += more < 1 ? more_x : 8;
    t.box.y0 -= more < 1 ? more_y : 8, t.box.y1 += more < 1 ? more_y : 8;
    return t;
}

static inline int may_hold(const ear_triangle *t, const ear_box *b)
{
    if (!b->n || b->x0 > t->box.x1 || b->x1 < t->box.x0 || b->y0 > t->box.y1 || b->y1 < t->box.y0)
        return 0;
    for (int k = 0; k < 3; k++) {
        const double y = t->dx[k] >= 0 ? b->y1 : b->y0, x = t->dy[k] >= 0 ? b->x0 : b->x1;
        if (!(t->dx[k] * (y - t->y[k]) >= t->dy[k] * (x - t->x[k])))
            return 0;
    }
    return 1;
}

static inline int is_in_ear(const ear_triangle *t, double x, double y)
{
    for (int k = 0; k < 3; k++)
        if (!(t->dx[k] * (y - t->y[k]) >= t->dy[k] * (x - t->x[k])) || (x == t->x[k] && y == t->y[k]))
            return 0;
    return 1;
}

/* A reflex corner in the triangle or on its border, except its corners; or -1. */
static int32_t find_blocker(ear_face *f, const ear_triangle *t, uint32_t seed)
{
    int64_t stack[TL_EAR_WIDTH * TL_EAR_LEVELS];
    int levels[TL_EAR_WIDTH * TL_EAR_LEVELS], n = 0;
    if (f->n_curve)
        stack[0] = 0, levels[n++] = f->n_box_levels - 1;
    while (n > 0) {
        const int64_t node = stack[--n];
        const int level = levels[n];
        f->n_steps++;
        if (!may_hold(t, f->boxes[level] + node))
            continue;
        seed = seed * 1664525u + 1013904223u;
        const int64_t first = node * TL_EAR_WIDTH;
        const int64_t n_below = level ? ((f->n_curve - 1) >> 3 * level) + 1 : f->n_curve;
        const int64_t n_children = n_below - first < TL_EAR_WIDTH ? n_below - first : TL_EAR_WIDTH;
        for (int64_t k = 0; k < n_children; k++) {
            const int64_t child = first + (k + (seed >> 24)) % n_children;
            if (level) {
                stack[n] = child, levels[n++] = level - 1;
                continue;
            }
            const int32_t i = (int32_t)f->curve[child].i;
            if (f->place[i] >= 0 && is_in_ear(t, f->x[i], f->y[i]))
                return i;
        }
    }
    return -1;
}

/* The first ear from a corner on; if there is none, the next corner. */
static int32_t find_ear(ear_face *f, int32_t from)
{
    for (;;) {
        int64_t i = next_bit(f, from);
        i = i < 0 ? next_bit(f, 0) : i;
        if (i < 0)
            return f->after[from];
        const int32_t corner = (int32_t)i;
        f->n_steps++;
        if (turn_at(f, corner) >= 0) {
            const ear_triangle t = ear_of(f, corner);
            const int32_t blocker = find_blocker(f, &t, (uint32_t)f->n_steps * 2654435761u);
            if (blocker < 0)
                return corner;
            block(f, corner, blocker);
        }
        clear_bit(f, corner);
    }
}

/* Cuts a corner off, and tests its neighbours again. */
static void cut_off(ear_face *f, int32_t i)
{
    const int32_t sides[2] = {f->before[i], f->after[i]};
    f->after[sides[0]] = sides[1], f->before[sides[1]] = sides[0];
    clear_bit(f, i);
    unblock(f, i);
    if (f->place[i] >= 0)
        end_reflex(f, i);
    for (int k = 0; k < 2; k++) {
        const int32_t other = sides[k];
        if (f->place[other] >= 0 && turn_at(f, other) >= 0)
            end_reflex(f, other);
        if (f->place[other] < 0) {
            unblock(f, other);
            set_bit(f, other);
        }
    }
}

/* Sets up the arrays of a face of k corners; x and y are to be filled in. */
static void open_ears(ear_face *f, int32_t k, int64_t *room)
{
    f->x = (double *)room, f->y = f->x + k, room += 2 * (int64_t)k;
    f->before = (int32_t *)room, f->after = f->before + k, room += k;
    f->first_blocked = (int32_t *)room, f->blocker = f->first_blocked + k, room += k;
    f->next_blocked = (int32_t *)room, f->prev_blocked = f->next_blocked + k, room += k;
    f->place = (int32_t *)room, room += k;
}

static void link_ears(ear_face *f, int32_t k)
{
    int64_t *room = (int64_t *)f->place + k;
    for (int32_t i = 0; i < k; i++) {
        f->before[i] = i ? i - 1 : k - 1, f->after[i] = i + 1 < k ? i + 1 : 0;
        f->first_blocked[i] = f->blocker[i] = -1;
    }
    f->n_bit_levels = 0;
    for (int64_t n = k; f->n_bit_levels == 0 || n > 1;) {
        uint64_t *words = f->bits[f->n_bit_levels++] = (uint64_t *)room;
        n = (n >> 6) + 1;
        for (int64_t w = 0; w < n; w++)
            words[w] = 0;
        room += n;
    }
    keyed *pairs = (keyed *)room;
    make_ear_boxes(f, k, pairs, room + 4 * (int64_t)k);
    for (int32_t i = 0; i < k; i++)
        if (f->place[i] < 0)
            set_bit(f, i);
}

/* Sets the area vector of a face; returns whether it has a reflex corner (of four corners the second or the last). */
static int measure_face(const tl_faces *faces, const int64_t *corners, int64_t k, double *area)
{
    const double *origin = faces->points + 3 * corners[0];
    area[0] = area[1] = area[2] = 0.0;
    for (int64_t i = 0; i < k; i++) {
        const double *p = faces->points + 3 * corners[i], *q = faces->points + 3 * corners[i + 1 < k ? i + 1 : 0];
        const double a[3] = {p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]},
                     b[3] = {q[0] - origin[0], q[1] - origin[1], q[2] - origin[2]};
        area[0] += a[1] * b[2] - a[2] * b[1];
        area[1] += a[2] * b[0] - a[0] * b[2];
        area[2] += a[0] * b[1] - a[1] * b[0];
    }
    const double least = -TL_TURN_TOO_SMALL * (area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
    for (int64_t i = k == 4; i < k; i += k == 4 ? 2 : 1) {
        const double *p = faces->points + 3 * corners[i ? i - 1 : k - 1], *q = faces->points + 3 * corners[i],
                     *r = faces->points + 3 * corners[i + 1 < k ? i + 1 : 0];
        const double a[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, b[3] = {r[0] - q[0], r[1] - q[1], r[2] - q[2]};
        const double turn = (a[1] * b[2] - a[2] * b[1]) * area[0] + (a[2] * b[0] - a[0] * b[2]) * area[1] +
                            (a[0] * b[1] - a[1] * b[0]) * area[2];
        if (turn < least)
            return 1;
    }
    return 0;
}

/* Projects the corners along the area vector: x to the right, y up, scaled so that the farthest is 1 from the first. */
static void flatten_face(ear_face *f, const tl_faces *faces, const int64_t *corners, int64_t k, const double *area)
{
    int axis = 0;
    for (int j = 1; j < 3; j++)
        axis = fabs(area[j]) > fabs(area[axis]) ? j : axis;
    const int low = axis == 0, high = axis == 2 ? 1 : 2, is_turned = (area[axis] < 0) != (axis == 1);
    const double *origin = faces->points + 3 * corners[0];
    double size = 1e-300;
    for (int64_t i = 0; i < k; i++)
        for (int j = 0; j < 3; j++)
            size = fmax(size, fabs(faces->points[3 * corners[i] + j] - origin[j]));
    for (int64_t i = 0; i < k; i++) {
        const double *p = faces->points + 3 * corners[i];
        const double a = (p[low] - origin[low]) / size, b = (p[high] - origin[high]) / size;
        f->x[i] = is_turned ? b : a, f->y[i] = is_turned ? a : b;
    }
}

static int64_t *put_ear(int64_t *triangles, int64_t start, int64_t a, int64_t b, int64_t c)
{
    triangles[0] = start + a, triangles[1] = start + b, triangles[2] = start + c;
    return triangles + 3;
}

/* Triangles keep the winding and the order of the faces.  Fewer faces than all are finished when they exceed
 * most_steps, or the call is given up. */
static int64_t cut_faces(const tl_faces *faces, int64_t *triangles, int64_t *room)
{
    int64_t start = 0, n_polled = 0;
    ear_face f = {.n_steps = 0};
    for (int64_t face = 0; face < faces->n_faces; start += faces->n_corners[face++]) {
        const int64_t k = faces->n_corners[face], *corners = faces->corners + start;
        double area[3];
        if (k < 3)
            continue;
        const int has_reflex = k > 3 && measure_face(faces, corners, k, area);
        f.n_steps += k;
        if (!has_reflex || k == 4) {
            for (int64_t i = 1; i + 1 < k; i++)
                triangles = has_reflex ? put_ear(triangles, start, 1, i + 1, i == 1 ? 3 : 0)
                                       : put_ear(triangles, start, 0, i, i + 1);
            continue;
        }
        open_ears(&f, (int32_t)k, room);
        flatten_face(&f, faces, corners, k, area);
        link_ears(&f, (int32_t)k);
        int32_t from = 0;
        for (int64_t left = k; left > 3; left--) {
            const int32_t ear = find_ear(&f, from);
            triangles = put_ear(triangles, start, f.before[ear], ear, f.after[ear]);
            from = f.after[ear];
            cut_off(&f, ear);
            if (f.n_steps > faces->most_steps)
                return face;
            if (f.n_steps - n_polled > TL_EAR_STEPS_TO_POLL && faces->pause) {
                faces->pause->left_px -= 4 * (f.n_steps - n_polled);
                n_polled = f.n_steps;
                if (faces->pause->left_px < 0 && faces->pause->poll(faces->pause))
                    return face;
            }
        }
        triangles = put_ear(triangles, start, f.before[from], from, f.after[from]);
    }
    return faces->n_faces;
}

#endif
