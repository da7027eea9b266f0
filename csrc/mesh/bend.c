/* Bend: splits triangles into parts with straight sides in the picture of a lens, to within a tolerance.
 * In: points in eye space, their records, triangles.  Out: triangles that are drawn unsplit, triangles outside of the
 * view, and the parts of the others.
 *
 * An edge is straight where its chord, on the sphere of directions, is within the lens's limit at both ends: the
 * largest second derivative of the lens in the rings there, times the square of the chord over 8, is then less than
 * half of the tolerance.  Other edges are tested at a quarter, half and three quarters of their length, and halved
 * where the picture, or its depth, is off by more than the tolerance from that of a straight edge; unless the edge is
 * shorter than a pixel there.  Both tests depend on the edge alone, whichever end is first: triangles that share an
 * edge, by index or by position, split it alike, and no gap opens. */
#ifndef TL_BEND_C
#define TL_BEND_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "mesh/lens.c"
#include "vertex/corners.h"
#include "mesh/lens.h"

/* A corner of a part. */
typedef struct {
    double point[3], direction[3], place_px[2], bent[3], reach;
    float record[4];
    int32_t index; /* a vertex, or TL_NEW_POINT until the part is drawn */
} lens_corner;
#define TL_NEW_POINT -1

typedef struct {
    lens_corner corner[3];
    double weights[3][3];
    int outline; /* bit k: side k lies on a side of the whole triangle */
    int n_halvings;
} bent_part;

#define TL_MOST_WAITING (3 * TL_MAX_HALVINGS + 4)

/* Corners 0, 1, 2 and the middles 3, 4, 5 of sides 0-1, 1-2, 2-0.  For each set of halved sides (bit k: side k) the
 * triangles of the split, in the winding of the whole triangle. */
static const int8_t TL_SPLITS[8][4][3] = {
    {{0, 1, 2}},
    {{0, 3, 2}, {3, 1, 2}},
    {{1, 4, 0}, {4, 2, 0}},
    {{3, 1, 4}, {0, 3, 4}, {0, 4, 2}},
    {{2, 5, 1}, {5, 0, 1}},
    {{5, 0, 3}, {2, 5, 3}, {2, 3, 1}},
    {{4, 2, 5}, {1, 4, 5}, {1, 5, 0}},
    {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}},
};

/* The side of the whole triangle on which a side from corner a to corner b lies, or -1. */
static int side_between(int a, int b)
{
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1, middle = 3 + k;
        if ((a == k || a == middle || a == next) && (b == k || b == middle || b == next))
            return k;
    }
    return -1;
}

/* ---- triangles and edges --------------------------------------------------------------------------------- */

/* Loads the corners of TL_LANES triangles, as the columns of their records. */
TL_INLINE void load_records(const float *records, const int32_t corners[3][TL_MAX_LANES], vf columns[3][4])
{
    for (int k = 0; k < 3; k++) {
        vi c[4];
        vi_load_records(records, 16, corners[k], c);
        for (int i = 0; i < 4; i++)
            columns[k][i] = vf_of_bits(c[i]);
    }
}

/* Loads the corners of TL_LANES triangles from the i-th on, of which n exist. */
TL_INLINE void load_corner_columns(const int32_t *triangles, int64_t i, int64_t n, int32_t corners[3][TL_MAX_LANES])
{
    if (TL_LANES > 1 && i > 0 && n >= TL_LANES) { /* 16 bytes, from the number before each triangle on */
        int32_t steps[TL_MAX_LANES];
        vi c[4];
        vi_store(steps, vi_iota());
        vi_load_records((const char *)(triangles + 3 * i) - 4, 12, steps, c);
        for (int k = 0; k < 3; k++)
            vi_store(corners[k], c[k + 1]);
        return;
    }
    for (int lane = 0; lane < TL_LANES; lane++)
        for (int k = 0; k < 3; k++)
            corners[k][lane] = triangles[3 * (i + (lane < n ? lane : n - 1)) + k];
}

TL_INLINE vf chord_squared(const vf *a, const vf *b)
{
    const vf x = vf_sub(a[0], b[0]), y = vf_sub(a[1], b[1]), z = vf_sub(a[2], b[2]);
    return vf_add(vf_add(vf_mul(x, x), vf_mul(y, y)), vf_mul(z, z));
}

/* The triangles that are certainly outside: their directions lie in a cap around the middle that ends before the
 * picture begins, or all are nearer than the near plane.  1e-5: ten times the error of float32. */
TL_INLINE vm find_outside(const tl_lens *lens, const vf corner[3][4])
{
    const vf one = vf_set1(1.0f), half = vf_set1(0.5f);
    vf middle[4] = {one, one, one, one};
    for (int k = 0; k < 3; k++)
        middle[k] = vf_add(vf_add(corner[0][k], corner[1][k]), corner[2][k]);
    const vf squared =
        vf_add(vf_add(vf_mul(middle[0], middle[0]), vf_mul(middle[1], middle[1])), vf_mul(middle[2], middle[2]));
    const vf inverse = vf_div(one, vf_sqrt(squared));
    for (int k = 0; k < 3; k++)
        middle[k] = vf_mul(middle[k], inverse);
    vf widest = vf_set1(0.0f);
    vm is_near = vm_all();
    for (int k = 0; k < 3; k++) {
        widest = vf_max(widest, chord_squared(corner[k], middle));
        is_near = vm_and(is_near, vf_eq(corner[k][3], vf_set1(TL_TOO_NEAR)));
    }
    const vf cosine = vf_sub(one, vf_mul(half, widest));
    const vf least = vf_sub(vf_mul(vf_set1((float)lens->cap_cosine), cosine),
                            vf_mul(vf_set1((float)lens->cap_sine), vf_sqrt(widest)));
    const vm is_cap = vm_and(vf_lt(widest, vf_set1(0.06f)), vf_ge(squared, vf_set1(1.0f)));
    const vm is_outside = vm_and(is_cap, vf_lt(middle[2], vf_sub(least, vf_set1(1e-5f))));
    return vm_or(is_near, is_outside);
}

static int64_t find_bent(const tl_lens *lens, const float *records, int64_t n_vertices, const int32_t *triangles,
                         int64_t first, int64_t end, int32_t *bent, int32_t *outside, int64_t *n_outside)
{
    const int32_t last = (int32_t)n_vertices - 1;
    int64_t n_bent = 0;
    *n_outside = 0;
    for (int64_t i = first; i < end; i += TL_LANES) {
        int32_t corners[3][TL_MAX_LANES];
        vf corner[3][4];
        const int64_t n = end - i;
        load_corner_columns(triangles, i, n, corners);
        for (int k = 0; k < 3; k++)
            vi_spill(corners[k], vi_max(vi_min(vi_load(corners[k]), vi_set1(last)), vi_set1(0)));
        load_records(records, (const int32_t (*)[TL_MAX_LANES])corners, corner);
        vm is_plain = vm_first(n);
        for (int k = 0; k < 3; k++) {
            const vf *a = corner[k], *b = corner[k == 2 ? 0 : k + 1];
            is_plain = vm_and(is_plain, vf_ge(vf_min(a[3], b[3]), chord_squared(a, b)));
        }
        const vm rest = vm_and_not(vm_first(n), is_plain);
        if (__builtin_expect(!vm_any(rest), 1))
            continue;
        const vi ids = vi_add(vi_set1((int32_t)i), vi_iota());
        const vm out = vm_and(rest, find_outside(lens, (const vf(*)[4])corner)), may = vm_and_not(rest, out);
        *n_outside += vi_compress(outside + *n_outside, out, ids);
        n_bent += vi_compress(bent + n_bent, may, ids);
    }
    return n_bent;
}

/* ---- triangle by triangle ------------------------------------------------------------------------------- */

static double dot_rows(const double *a, const double *b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

static void to_px(const tl_lens *lens, const double *place, double *px)
{
    const double *m = lens->px_from_plane;
    for (int axis = 0; axis < 2; axis++)
        px[axis] = m[3 * axis] * place[0] + m[3 * axis + 1] * place[1] + m[3 * axis + 2];
}

/* Sets up a corner from its point in camera axes. */
static void set_corner(const tl_lens *lens, lens_corner *c)
{
    lens_lanes l;
    double lanes[6][TL_MAX_LANES];
    float numbers[4][TL_MAX_LANES];
    vf record[4];
    for (int k = 0; k < 3; k++)
        l.p[k] = vd_set1(c->point[k]);
    see_lanes(lens, &l);
    make_records(lens, l.p, record);
    vd_store(lanes[0], l.place[0]), vd_store(lanes[1], l.place[1]), vd_store(lanes[2], l.reach);
    for (int k = 0; k < 3; k++)
        vd_store(lanes[3 + k], l.direction[k]);
    for (int k = 0; k < 4; k++)
        vf_store(numbers[k], record[k]), c->record[k] = numbers[k][0];
    const double place[2] = {lanes[0][0], lanes[1][0]};
    c->reach = lanes[2][0];
    to_px(lens, place, c->place_px);
    c->bent[0] = place[0] * c->reach, c->bent[1] = -place[1] * c->reach, c->bent[2] = -c->reach;
    for (int k = 0; k < 3; k++)
        c->direction[k] = lanes[3 + k][0];
    c->index = TL_NEW_POINT;
}

/* Whether a point of a part may be in the picture.  If not, its directions lie in a cap around their middle that holds
 * the corners (caps below 90 degrees are convex). */
static int may_show(const tl_lens *lens, const bent_part *part)
{
    const lens_corner *c = part->corner;
    double middle[3], cosine = 1.0;
    for (int k = 0; k < 3; k++)
        middle[k] = (c[0].direction[k] + c[1].direction[k]) + c[2].direction[k];
    const double length = sqrt(dot_rows(middle, middle));
    for (int k = 0; k < 3; k++)
        cosine = fmin(cosine, dot_rows(c[k].direction, middle) / fmax(length, 1e-300));
    const double sine = sqrt(fmax(0.0, (1.0 - cosine) * (1.0 + cosine)));
    const double least = lens->cap_cosine * cosine - lens->cap_sine * sine; /* cosine of the sum of both angles */
    const int is_below_180 = lens->cap_sine * cosine + lens->cap_cosine * sine > 0.0;
    const int is_outside = length > 1e-6 && cosine > 1e-6 && is_below_180 && middle[2] < least * length;
    return !is_outside && !(c[0].reach < lens->near && c[1].reach < lens->near && c[2].reach < lens->near);
}

/* The larger component of a step. */
static double largest_step(const double *a, const double *b) { return fmax(fabs(a[0] - b[0]), fabs(a[1] - b[1])); }

/* Whether an edge is to be halved. */
static int is_edge_bent(const tl_lens *lens, const lens_corner *a, const lens_corner *b)
{
    const float x = a->record[0] - b->record[0], y = a->record[1] - b->record[1], z = a->record[2] - b->record[2];
    const float chord = (x * x + y * y) + z * z;
    if (a->record[3] >= chord && b->record[3] >= chord)
        return 0;
    if (dot_rows(a->direction, b->direction) < TL_LEAST_EDGE_COSINE)
        return 1;
    const double middle[2] = {(a->place_px[0] + b->place_px[0]) / 2, (a->place_px[1] + b->place_px[1]) / 2};
    double spread = fmax(largest_step(a->place_px, middle), largest_step(b->place_px, middle)), off = 0.0;
    double shares[TL_MAX_LANES < 4 ? 4 : TL_MAX_LANES];
    for (int k = 0; k < (TL_MAX_LANES < 4 ? 4 : TL_MAX_LANES); k++)
        shares[k] = 0.25 * (1 + k % 3);
    for (int first = 0; first < 3; first += TL_LANES) {
        const vd share = vd_load(shares + first), other = vd_sub(vd_set1(1.0), share);
        lens_lanes l;
        double lanes[3][TL_MAX_LANES];
        for (int k = 0; k < 3; k++)
            l.p[k] = vd_add(vd_mul(other, vd_set1(a->point[k])), vd_mul(share, vd_set1(b->point[k])));
        see_lanes(lens, &l);
        vd_store(lanes[0], l.place[0]), vd_store(lanes[1], l.place[1]), vd_store(lanes[2], l.reach);
        for (int lane = 0; lane < TL_LANES && first + lane < 3; lane++) {
            const double weight_a = (1.0 - shares[first + lane]) * a->reach, weight_b = shares[first + lane] * b->reach;
            const double mean = weight_a + weight_b, place[2] = {lanes[0][lane], lanes[1][lane]};
            double px[2], straight[2];
            to_px(lens, place, px);
            for (int axis = 0; axis < 2; axis++)
                straight[axis] = (weight_a * a->place_px[axis] + weight_b * b->place_px[axis]) / mean;
            spread = fmax(spread, largest_step(px, middle));
            off = fmax(off, largest_step(px, straight) / lens->tolerance_px);
            if (lens->is_fisheye)
                off = fmax(off, fabs(lanes[2][lane] - mean) / (TL_MAX_RANGE_ERROR * mean));
        }
    }
    return off > 1.0 && spread > TL_SHORT_PX;
}

/* Gives a corner a new point. */
static void add_point(tl_bent_parts *parts, lens_corner *c)
{
    if (parts->points)
        memcpy(parts->points + 3 * parts->n_points, c->bent, sizeof c->bent);
    c->index = parts->first_point + (int32_t)parts->n_points++;
}

static void add_part(tl_bent_parts *parts, const bent_part *part, int32_t source)
{
    if (parts->triangles) {
        for (int k = 0; k < 3; k++) {
            parts->triangles[3 * parts->n_parts + k] = part->corner[k].index;
            parts->is_outline[3 * parts->n_parts + k] = part->outline >> k & 1;
        }
        memcpy(parts->weights + 9 * parts->n_parts, part->weights, sizeof part->weights);
        parts->source[parts->n_parts] = source;
    }
    parts->n_parts++;
}

/* Pushes the pieces of a part on the stack, the first on top; bit k of `halved`: side k.  Returns the new height. */
static int split_part(const tl_lens *lens, const bent_part *whole, int halved, tl_bent_parts *parts, bent_part *stack,
                      int height)
{
    lens_corner six[6];
    double weights[6][3];
    memcpy(six, whole->corner, sizeof whole->corner);
    memcpy(weights, whole->weights, sizeof whole->weights);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        if (!(halved >> k & 1))
            continue;
        for (int axis = 0; axis < 3; axis++) {
            six[3 + k].point[axis] = (six[k].point[axis] + six[next].point[axis]) / 2;
            weights[3 + k][axis] = (weights[k][axis] + weights[next][axis]) / 2;
        }
        set_corner(lens, &six[3 + k]);
        add_point(parts, &six[3 + k]);
    }
    const int n = 1 + (halved & 1) + (halved >> 1 & 1) + (halved >> 2 & 1);
    for (int i = n; i--;) {
        const int8_t *piece = TL_SPLITS[halved][i];
        bent_part *part = &stack[height++];
        part->outline = 0, part->n_halvings = whole->n_halvings + 1;
        for (int k = 0; k < 3; k++) {
            const int side = side_between(piece[k], piece[k == 2 ? 0 : k + 1]);
            part->corner[k] = six[piece[k]];
            memcpy(part->weights[k], weights[piece[k]], sizeof weights[0]);
            part->outline |= side >= 0 ? (whole->outline >> side & 1) << k : 0;
        }
    }
    return height;
}

/* Splits one triangle. */
static void bend_triangle(const tl_lens *lens, const double *points, const float *records, int64_t n_vertices,
                          const int32_t *triangle, int32_t source, tl_bent_parts *parts)
{
    bent_part stack[TL_MOST_WAITING];
    int height = 1;
    memset(&stack[0], 0, sizeof stack[0]);
    stack[0].outline = 7;
    for (int k = 0; k < 3; k++) {
        const int32_t corner = corner_within(triangle[k], n_vertices);
        const double *p = points + 3 * (int64_t)corner;
        stack[0].corner[k].point[0] = p[0], stack[0].corner[k].point[1] = -p[1], stack[0].corner[k].point[2] = -p[2];
        set_corner(lens, &stack[0].corner[k]);
        if (records[4 * (int64_t)corner + 3] >= 0.0f) /* `bend_vertices` has bent it */
            stack[0].corner[k].index = corner;
        stack[0].weights[k][k] = 1.0;
    }
    while (height && parts->n_parts <= parts->most) {
        bent_part part = stack[--height];
        int halved = 0;
        if (!may_show(lens, &part))
            continue;
        for (int k = 0; k < 3 && part.n_halvings < TL_MAX_HALVINGS; k++)
            halved |= is_edge_bent(lens, &part.corner[k], &part.corner[k == 2 ? 0 : k + 1]) << k;
        if (halved) {
            height = split_part(lens, &part, halved, parts, stack, height);
            continue;
        }
        for (int k = 0; k < 3; k++)
            if (part.corner[k].index == TL_NEW_POINT)
                add_point(parts, &part.corner[k]);
        add_part(parts, &part, source);
    }
}

static void split_bent(const tl_lens *lens, const double *points, const float *records, int64_t n_vertices,
                       const int32_t *triangles, const int32_t *ids, int64_t n, tl_bent_parts *parts)
{
    for (int64_t i = 0; i < n && parts->n_parts <= parts->most; i++)
        bend_triangle(lens, points, records, n_vertices, triangles + 3 * (int64_t)ids[i], ids[i], parts);
}

#endif
