/* Runs: the parts of a row that one triangle owns, and its coefficients for the pixels, a vector of runs at a time.
 * In: a row of ids, vertex records, attributes of vertices.  Out: coefficients of runs; pixels read them by a load and
 * a permutation.
 *
 * The weight of corner k at a pixel is E_k * q_k, its edge function times 1/w: a value is sum(E_k q_k a_k) / sum(E_k
 * q_k).  E_k is an exact integer, rounded once to float32, so a value errs by less than 13.01 * 2^-24 of the largest
 * a_k; no result depends on where a run, a window or a thread begins.  Edge functions are positive where the front is
 * visible.  So the sum of the normals of the corners points to the viewer, whichever side is visible.
 *
 * Based on: C. A. Burns and W. A. Hunt, The Visibility Buffer, 2013; J. F. Blinn, Hyperbolic Interpolation, 1992; M.
 * Olano and T. Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997 (clipped triangles). */
#ifndef TL_RUNS_C
#define TL_RUNS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/exact.h"
#include "vertex/project.c"
#include "vertex/setup.c"
#include "exact/sign.c"
#include "pixels/shading.h"

#define TL_SPAN 512 /* pixels of a row that are shaded together */
#define TL_SPAN_ROOM (TL_SPAN + 2 * TL_MAX_LANES)

/* Runs of unsnapped triangles end at columns of the picture that are multiples of it; a power of two. */
#define TL_RUN_BLOCK 32

/* Twice the area of unsnapped triangles, in the units of their integer edge functions. */
#define TL_UNIT_AREA 0x1p24

/* The largest step of an unsnapped edge function to the next column, in these units. */
#define TL_MOST_STEP 0x1p36

/* Edge functions below it stay in int32 all over the box. */
#define TL_INT32_BOX 0x1p30f

/* Shorter interpolated normals have cancelled: they may be rounding errors. */
#define TL_NO_NORMAL 1e-6f

enum {                                /* coefficients of runs, float32 */
       RUN_NORMAL = 0,                /* corner by corner, times q; the face normal in the first three when flat */
       RUN_SHORTEST = RUN_NORMAL + 9, /* the squared length below which normals have cancelled */
       RUN_Q = RUN_SHORTEST + 1,
       RUN_U = RUN_Q + 3, /* times q, as all up to RUN_GRADIENT */
       RUN_V = RUN_U + 3,
       RUN_COLOR = RUN_V + 3,
       RUN_GRADIENT = RUN_COLOR + 9, /* per column and per row: of sum(E q), sum(E q u), sum(E q v) */
       RUN_REST = RUN_GRADIENT + 6,  /* unsnapped: rests of E1 and E2 in the middle of a block, and per column */
       RUN_ALPHA = RUN_REST + 4,     /* from here on for full materials and cut-outs */
       RUN_UV1 = RUN_ALPHA + 3,      /* as RUN_U and RUN_V, of the second set */
       RUN_GRADIENT1 = RUN_UV1 + 6,
       RUN_TANGENT = RUN_GRADIENT1 + 6, /* of both sets: see `set_tangents`; not times q */
       N_TANGENT_FLOATS = 7,
       N_RUN_FLOATS = RUN_TANGENT + 2 * N_TANGENT_FLOATS,
};
enum { RUN_E1, RUN_E2, RUN_STEP1, RUN_STEP2, RUN_SUM, RUN_MATERIAL, RUN_ID, RUN_SPECIAL, RUN_COLUMN, N_RUN_INTS };

/* A triangle with float64 edge functions: E_k = at[k] + step[k] * (x_fx - from[k]) in the row of the run. */
typedef struct {
    double at[3], step[3], from[3];
    float area;
} special_run;

typedef struct {
    const tl_snapped *snapped;
    const tl_window *window;
    const tl_shading *shading;
    const tl_view *view;
    int32_t first_id;                                               /* the id of triangle 0 */
    int needs_q, needs_normal, needs_uv, needs_colors, needs_point; /* whether the shading reads it */
    int needs_alpha, needs_uv1, needs_tangents[2];                  /* whether it reads these; tangents per set of uv */
    int needs_more;                                                 /* alpha, uv1 or tangents */
    /* the light is the grey of srgb.c: line and root per channel */
    int is_grey;
    float grey_line[3], grey_root[3];
    int n_runs, n_special;
    int first_run[TL_SPAN]; /* of each vector: the slot after the runs that begin before it */
    unsigned starts[TL_SPAN], visible[TL_SPAN];
    /* aligned: a vector across two cache lines takes twice as long */
    _Alignas(64) int32_t ints[N_RUN_INTS][TL_SPAN_ROOM];
    _Alignas(64) float floats[N_RUN_FLOATS][TL_SPAN_ROOM];
    _Alignas(64) int32_t corners[3][TL_SPAN_ROOM]; /* see `keep_corners` */
    special_run special[TL_SPAN];
} shade_runs;

/* Lists the runs of n ids from `column` on; run r has slot TL_LANES + r.  Ids outside the mesh count as background.
 * Runs of unsnapped triangles end with a block of columns, and store the column where they begin. */
TL_INLINE void list_runs(shade_runs *s, const int32_t *ids, int n, int64_t column, int is_exact)
{
    const vi first_column = vi_add(vi_iota(), vi_set1((int32_t)column));
    const vi in_block = vi_set1((int32_t)(s->window->x_px & (TL_RUN_BLOCK - 1))), last = vi_set1(TL_RUN_BLOCK - 1);
    const vi none = vi_set1(-1), end = vi_set1((int32_t)s->snapped->n_triangles), first = vi_set1(s->first_id);
    vi before = none;
    int slot = TL_LANES;
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        const vm inside = vm_first(n - x);
        const vi name = n - x >= TL_LANES ? vi_load(ids + x) : vi_select(inside, vi_load_masked(inside, ids + x), none);
        const vi id = vi_sub(name, first);
        const vm visible = vm_and(vi_gt(id, none), vi_gt(end, id));
        vm same = vi_eq(id, vi_shift_in(id, before));
        if (is_exact) {
            const vi own = vi_add(first_column, vi_set1(x));
            same = vm_and_not(same, vi_eq(vi_and(vi_add(own, in_block), last), vi_set1(0)));
            vi_compress(s->ints[RUN_COLUMN] + slot, vm_and_not(visible, same), own);
        }
        const vm starts = vm_and_not(visible, same);
        vi_compress(s->ints[RUN_ID] + slot, starts, id);
        s->first_run[i] = slot;
        s->starts[i] = vm_bits(starts), s->visible[i] = vm_bits(visible);
        slot += __builtin_popcount(vm_bits(starts));
        before = id;
    }
    s->n_runs = slot - TL_LANES;
}
TL_ONCE void find_runs(shade_runs *s, const int32_t *ids, int n, int64_t column)
{
    if (s->snapped->mesh.exact)
        list_runs(s, ids, n, column, 1);
    else
        list_runs(s, ids, n, column, 0);
}

/* Loads three numbers of 32 bits at rows + 3 * i[lane], as columns c[1] to c[3]. */
TL_INLINE void load_triples(const void *rows, const int32_t *i, vi *c)
{
    if (TL_LANES > 1 && !vm_any(vi_eq(vi_load(i), vi_set1(0)))) { /* loads 16 bytes, from 4 before the row on */
        vi_load_records((const char *)rows - 4, 12, i, c);
        return;
    }
    int32_t own[3][TL_MAX_LANES];
    for (int lane = 0; lane < TL_LANES; lane++)
        for (int k = 0; k < 3; k++)
            memcpy(&own[k][lane], (const char *)rows + 12 * (int64_t)i[lane] + 4 * k, 4);
    for (int k = 0; k < 3; k++)
        c[k + 1] = vi_load(own[k]);
}

/* Loads the corners of the triangles of TL_LANES runs, clamped to the vertices.  Returns the runs whose corners were
 * not clamped. */
TL_INLINE vm run_corners(const shade_runs *s, int slot, vi *corners)
{
    const vi last = vi_set1((int32_t)s->snapped->mesh.n_vertices - 1), zero = vi_set1(0);
    vi c[4];
    vm is_there = vm_all();
    load_triples(s->snapped->triangles, s->ints[RUN_ID] + slot, c);
    for (int k = 0; k < 3; k++) {
        corners[k] = vi_max(vi_min(c[k + 1], last), zero);
        is_there = vm_and(is_there, vi_eq(corners[k], c[k + 1]));
    }
    return is_there;
}

TL_INLINE void put(shade_runs *s, int coefficient, int slot, vf a) { vf_store(s->floats[coefficient] + slot, a); }

/* Stores a value times q, corner by corner. */
TL_INLINE void put_three(shade_runs *s, int first, int slot, const vf *q, vf a0, vf a1, vf a2)
{
    put(s, first, slot, vf_mul(q[0], a0));
    put(s, first + 1, slot, vf_mul(q[1], a1));
    put(s, first + 2, slot, vf_mul(q[2], a2));
}

/* Constants of the triangles of TL_LANES runs. */
typedef struct {
    _Alignas(64) int32_t corners[3][TL_MAX_LANES];
    vf q[3], normal[3][3], area, col_step[3], row_step[3];
} run_setup;

/* The derivative of a perspective value along a column or a row: the sum of the steps of the weights times the
 * value. */
TL_INLINE vf gradient_of(const vf *step, const vf *value)
{
    return vf_fma(step[0], value[0], vf_fma(step[1], value[1], vf_mul(step[2], value[2])));
}

/* Stores a set of uv; its coefficients begin at `first`, those of its gradients at `gradient`. */
TL_INLINE void set_uv(shade_runs *s, int slot, const run_setup *r, const float *uv, int first, int gradient)
{
    const vf *q = r->q;
    vf u[3], v[3];
    for (int k = 0; k < 3; k++) {
        vf pair[2];
        vf_load_pairs(uv, r->corners[k], pair);
        u[k] = vf_mul(q[k], pair[0]), v[k] = vf_mul(q[k], pair[1]);
        put(s, first + k, slot, u[k]);
        put(s, first + 3 + k, slot, v[k]);
    }
    const vf *steps[2] = {r->col_step, r->row_step};
    for (int axis = 0; axis < 2; axis++) {
        put(s, gradient + 3 * axis, slot, gradient_of(steps[axis], q));
        put(s, gradient + 3 * axis + 1, slot, gradient_of(steps[axis], u));
        put(s, gradient + 3 * axis + 2, slot, gradient_of(steps[axis], v));
    }
}

TL_INLINE void set_face_normals(shade_runs *s, int slot, vf area)
{
    vi c[4];
    vi_load_records(s->shading->face_normals, 16, s->ints[RUN_ID] + slot, c);
    const vf zero = vf_set1(0.0f);
    const vm is_back = vf_lt(area, zero);
    for (int k = 0; k < 3; k++)
        put(s, RUN_NORMAL + k, slot, vf_select(is_back, vf_sub(zero, vf_of_bits(c[k])), vf_of_bits(c[k])));
}

/* 1, or -1 where the normals of the vertices point to the clockwise side. */
TL_INLINE vf side_of_normals(const shade_runs *s, int slot)
{
    float side[TL_MAX_LANES];
    for (int lane = 0; lane < TL_LANES; lane++)
        side[lane] = s->shading->is_turned[s->ints[RUN_ID][slot + lane]] ? -1.0f : 1.0f;
    return vf_load(side);
}

/* Loads the rows of the corner normals of TL_LANES triangles. */
TL_INLINE void load_normal_rows(const shade_runs *s, int slot, int32_t rows[3][TL_MAX_LANES])
{
    vi c[4];
    load_triples(s->shading->normal_of_corner, s->ints[RUN_ID] + slot, c);
    for (int k = 0; k < 3; k++)
        vi_spill(rows[k], c[k + 1]);
}

/* Loads positions (x, y, z) of TL_LANES vertices from rows of three float32. */
TL_INLINE void load_positions_f32(const float *positions, const int32_t *vertices, vf *p)
{
    vi bits[4];
    load_triples(positions, vertices, bits);
    for (int axis = 0; axis < 3; axis++)
        p[axis] = vf_of_bits(bits[axis + 1]);
}

/* Loads positions (x, y, z) of TL_LANES vertices, rows of float32 or float64, as float64. */
TL_INLINE void load_positions(const void *positions, int is_f64, const int32_t *vertices, vd *p)
{
    if (!is_f64) {
        vf own[3];
        load_positions_f32(positions, vertices, own);
        for (int axis = 0; axis < 3; axis++)
            p[axis] = vd_from_vf(own[axis]);
        return;
    }
    const double *rows = positions;
    if (TL_LANES > 1 && !vm_any(vi_eq(vi_load(vertices), vi_set1(0)))) { /* see `load_triples` */
        vd row[4];
        vd_load_records(rows - 1, 3, vertices, row);
        for (int axis = 0; axis < 3; axis++)
            p[axis] = row[axis + 1];
        return;
    }
    double lanes[3][TL_MAX_LANES];
    for (int lane = 0; lane < TL_LANES; lane++)
        for (int axis = 0; axis < 3; axis++)
            lanes[axis][lane] = rows[3 * (int64_t)vertices[lane] + axis];
    for (int axis = 0; axis < 3; axis++)
        p[axis] = vd_load(lanes[axis]);
}

/* 1/w of TL_LANES vertices, equal to that of `set_inverse_w`; the source has a matrix. */
TL_INLINE vf find_inverse_w(const tl_source *source, const int32_t *vertices)
{
    if (source->scalar == TL_F32) {
        const float *m = (const float *)source->matrix + 12;
        vf p[3];
        load_positions_f32(source->data, vertices, p);
        const vf sum = vf_add(vf_mul(vf_set1(m[0]), p[0]), vf_mul(vf_set1(m[1]), p[1]));
        return vf_div(vf_set1(1.0f), vf_add(vf_add(sum, vf_mul(vf_set1(m[2]), p[2])), vf_set1(m[3])));
    }
    const double *m = (const double *)source->matrix + 12;
    vd p[3];
    load_positions(source->data, 1, vertices, p);
    const vd sum = vd_add(vd_mul(vd_set1(m[0]), p[0]), vd_mul(vd_set1(m[1]), p[1]));
    return vf_from_vd(vd_div(vd_set1(1.0), vd_add(vd_add(sum, vd_mul(vd_set1(m[2]), p[2])), vd_set1(m[3]))));
}

/* Loads normals and q of the corners. */
TL_INLINE void load_normals(const shade_runs *s, int slot, run_setup *r)
{
    const tl_shading *shading = s->shading;
    _Alignas(64) int32_t rows[3][TL_MAX_LANES];
    if (shading->normal_of_corner)
        load_normal_rows(s, slot, rows);
    for (int k = 0; k < 3; k++) {
        vi c[4], own[4];
        if (shading->normal_of_corner)
            vi_load_records(shading->corner_normals, 16, rows[k], c);
        else
            vi_load_records(shading->normals, 16, r->corners[k], c);
        for (int axis = 0; axis < 3; axis++)
            r->normal[k][axis] = vf_of_bits(c[axis]);
        if (shading->finds_inverse_w) {
            r->q[k] = find_inverse_w(s->snapped->mesh.source, r->corners[k]);
            continue;
        }
        if (shading->normal_of_corner && s->snapped->mesh.n_vertices >> 29) { /* offsets exceed 32 bits */
            vi_load_records(shading->normals, 16, r->corners[k], own);
            c[3] = own[3];
        } else if (shading->normal_of_corner) {
            const vi at = vi_add(vi_shift_left(vi_load(r->corners[k]), 2), vi_set1(3));
            c[3] = vi_gather(vm_all(), (const int32_t *)shading->normals, at);
        }
        r->q[k] = vf_of_bits(c[3]);
    }
}

/* Loads the edges of the triangles of TL_LANES runs from their first corners on, divided by the longest coordinate of
 * each. A float32 difference is equal whether rounded in float32 or first in float64: 53 bits are 2 * 24 + 2. */
TL_INLINE void load_edges(const shade_runs *s, const run_setup *r, vf edge[2][3])
{
    const tl_shading *shading = s->shading;
    const vf zero = vf_set1(0.0f);
    vf longest = vf_set1(0x1p-120f);
    if (shading->is_f64) {
        vd first[3], other[3];
        load_positions(shading->positions, 1, r->corners[0], first);
        for (int k = 0; k < 2; k++) {
            load_positions(shading->positions, 1, r->corners[k + 1], other);
            for (int axis = 0; axis < 3; axis++)
                edge[k][axis] = vf_from_vd(vd_sub(other[axis], first[axis]));
        }
    } else {
        vf first[3], other[3];
        load_positions_f32(shading->positions, r->corners[0], first);
        for (int k = 0; k < 2; k++) {
            load_positions_f32(shading->positions, r->corners[k + 1], other);
            for (int axis = 0; axis < 3; axis++)
                edge[k][axis] = vf_sub(other[axis], first[axis]);
        }
    }
    for (int k = 0; k < 2; k++)
        for (int axis = 0; axis < 3; axis++)
            longest = vf_max(longest, vf_max(edge[k][axis], vf_sub(zero, edge[k][axis])));
    const vf scale = vf_div(vf_set1(1.0f), longest);
    for (int k = 0; k < 2; k++)
        for (int axis = 0; axis < 3; axis++)
            edge[k][axis] = vf_mul(edge[k][axis], scale);
}

/* Stores tangents of TL_LANES triangles: the directions in which u and v grow, over the longer length, and the hand (1:
 * right) that they make with the normal towards the viewer.  All are negated where the side that is lit is not that of
 * the mesh's normals, so that bent normals turn as a whole.  0 where uv have no area. */
TL_INLINE void set_tangents(shade_runs *s, int slot, const run_setup *r, const float *uv, vf side, int first)
{
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f), minus = vf_set1(-1.0f);
    vf edge[2][3], pair[3][2], along_u[3], along_v[3], length[2] = {zero, zero};
    load_edges(s, r, edge);
    for (int k = 0; k < 3; k++)
        vf_load_pairs(uv, r->corners[k], pair[k]);
    const vf u1 = vf_sub(pair[1][0], pair[0][0]), v1 = vf_sub(pair[1][1], pair[0][1]);
    const vf u2 = vf_sub(pair[2][0], pair[0][0]), v2 = vf_sub(pair[2][1], pair[0][1]);
    const vf area_uv = vf_sub(vf_mul(u1, v2), vf_mul(u2, v1));
    for (int axis = 0; axis < 3; axis++) {
        along_u[axis] = vf_sub(vf_mul(v2, edge[0][axis]), vf_mul(v1, edge[1][axis]));
        along_v[axis] = vf_sub(vf_mul(u1, edge[1][axis]), vf_mul(u2, edge[0][axis]));
        length[0] = vf_fma(along_u[axis], along_u[axis], length[0]);
        length[1] = vf_fma(along_v[axis], along_v[axis], length[1]);
    }
    const vf longer = vf_max(length[0], length[1]), turn = vf_select(vf_lt(r->area, zero), minus, one);
    const vf hand = vf_select(vf_lt(area_uv, zero), minus, one);
    const vm has_some = vm_and(vf_lt(zero, longer), vm_or(vf_lt(area_uv, zero), vf_lt(zero, area_uv)));
    const vf scale = vf_select(has_some, vf_div(vf_mul(vf_mul(hand, turn), side), vf_sqrt(longer)), zero);
    for (int axis = 0; axis < 3; axis++) {
        put(s, first + axis, slot, vf_select(has_some, vf_mul(along_u[axis], scale), zero));
        put(s, first + 3 + axis, slot, vf_select(has_some, vf_mul(along_v[axis], scale), zero));
    }
    put(s, first + 6, slot, vf_mul(hand, turn));
}

/* Stores attributes of full materials and cut-outs. */
static void set_more_attributes(shade_runs *s, int slot, const run_setup *r)
{
    const tl_shading *shading = s->shading;
    if (s->needs_uv1)
        set_uv(s, slot, r, shading->uv1, RUN_UV1, RUN_GRADIENT1);
    if (s->needs_alpha) {
        vi c[3][4];
        for (int k = 0; k < 3; k++)
            vi_load_records(shading->colors, 16, r->corners[k], c[k]);
        put_three(s, RUN_ALPHA, slot, r->q, vf_of_bits(c[0][3]), vf_of_bits(c[1][3]), vf_of_bits(c[2][3]));
    }
    for (int set = 0; set < 2; set++)
        if (s->needs_tangents[set]) {
            vf side = vf_set1(shading->front_side);
            if (!shading->face_normals)
                side = shading->is_turned ? side_of_normals(s, slot) : vf_set1(1.0f);
            set_tangents(s, slot, r, set ? shading->uv1 : shading->uv, side, RUN_TANGENT + N_TANGENT_FLOATS * set);
        }
}

/* Stores the weighted normals of the corners of TL_LANES runs, and the length below which their sum has cancelled. */
TL_INLINE void put_normals(shade_runs *s, int slot, vf area, const vf *q, const vf (*normal)[3])
{
    const vf most = vf_mul(vf_mul(area, vf_set1(TL_NO_NORMAL)), vf_max(q[0], vf_max(q[1], q[2])));
    const vf side = s->shading->is_turned ? side_of_normals(s, slot) : vf_set1(1.0f);
    put(s, RUN_SHORTEST, slot, vf_mul(most, most));
    for (int k = 0; k < 3; k++) {
        const vf turned = vf_mul(q[k], side), same[3] = {turned, turned, turned};
        put_three(s, RUN_NORMAL + 3 * k, slot, same, normal[k][0], normal[k][1], normal[k][2]);
    }
}

/* Stores all attributes of TL_LANES runs. */
TL_INLINE void set_attributes(shade_runs *s, int slot, const run_setup *r)
{
    const tl_shading *shading = s->shading;
    const vf *q = r->q;
    if (shading->face_normals) {
        set_face_normals(s, slot, r->area);
    } else if (s->needs_normal) {
        put_normals(s, slot, r->area, q, (const vf(*)[3])r->normal);
    }
    if (s->needs_q)
        for (int k = 0; k < 3; k++)
            put(s, RUN_Q + k, slot, q[k]);
    if (s->needs_uv)
        set_uv(s, slot, r, shading->uv, RUN_U, RUN_GRADIENT);
    if (s->needs_colors)
        for (int k = 0; k < 3; k++) {
            vi c[4];
            vi_load_records(shading->colors, 16, r->corners[k], c);
            const vf same[3] = {q[k], q[k], q[k]};
            put_three(s, RUN_COLOR + 3 * k, slot, same, vf_of_bits(c[0]), vf_of_bits(c[1]), vf_of_bits(c[2]));
        }
    if (s->needs_more)
        set_more_attributes(s, slot, r);
}

/* The centre of a pixel in sub-pixels; vertices are relative to the sample. */
static inline double center_fx(int64_t at_px, int bits) { return ((double)at_px + 0.5) * (double)(1 << bits); }

/* Edge functions of a triangle that no clip plane cuts, of any size: exact below 2^53. */
static void special_edges(special_run *e, const double *x_fx, const double *y_fx, double y, float *row_step)
{
    double area = 0.0;
    for (int k = 0; k < 3; k++) {
        const int a = k == 2 ? 0 : k + 1, b = 3 - k - a; /* the other two corners */
        e->at[k] = (x_fx[b] - x_fx[a]) * (y_fx[a] - y);
        e->step[k] = y_fx[b] - y_fx[a];
        e->from[k] = x_fx[a];
        row_step[k] = (float)(x_fx[a] - x_fx[b]);
        area += e->at[k] + e->step[k] * (x_fx[0] - e->from[k]);
    }
    e->area = (float)area;
}

/* Edge functions of a clipped triangle from homogeneous corners, with q included; the area is +-1. */
static void homogeneous_edges(special_run *e, const tl_view *view, const tl_vertex_set *set, const int32_t *corners,
                              double y, double unit, float *row_step)
{
    double h[3][3], step[3], det = 0.0;
    for (int k = 0; k < 3; k++) {
        double p[4];
        clip_position(set->source, corners[k], p);
        h[k][0] = (p[0] + p[3]) * (view->half_width_px * unit) - p[3] * (double)set->sample_x_fx;
        h[k][1] = (p[3] - p[1]) * (view->half_height_px * unit) - p[3] * ((double)set->sample_y_fx + y);
        h[k][2] = p[3];
    }
    for (int k = 0; k < 3; k++) {
        const int a = k == 2 ? 0 : k + 1, b = 3 - k - a;
        e->at[k] = h[b][0] * h[a][1] - h[a][0] * h[b][1];
        e->step[k] = h[a][2] * h[b][1] - h[b][2] * h[a][1];
        e->from[k] = 0.0;
        step[k] = h[a][0] * h[b][2] - h[b][0] * h[a][2];
        det += h[k][2] * e->at[k];
    }
    const double scale = det == 0.0 ? 0.0 : 1.0 / fabs(det);
    for (int k = 0; k < 3; k++) {
        e->at[k] *= scale, e->step[k] *= scale;
        row_step[k] = (float)(step[k] * scale);
    }
    e->area = det < 0.0 ? -1.0f : 1.0f;
}

/* Divides edge functions of unsnapped vertices by the area, beyond the range of float32.  Where a sliver's box is
 * larger than TL_BOX_AREAS areas, float64 has lost the weights: each is then 1/3. */
#define TL_BOX_AREAS 0x1p36
static void normalize_edges(special_run *e, const tl_vertex_set *set, const int32_t *corners, const double *x_fx,
                            const double *y_fx, float *row_step)
{
    const double width = fmax(x_fx[0], fmax(x_fx[1], x_fx[2])) - fmin(x_fx[0], fmin(x_fx[1], x_fx[2]));
    const double height = fmax(y_fx[0], fmax(y_fx[1], y_fx[2])) - fmin(y_fx[0], fmin(y_fx[1], y_fx[2]));
    const double area = (x_fx[2] - x_fx[0]) * (y_fx[1] - y_fx[0]) - (x_fx[1] - x_fx[0]) * (y_fx[2] - y_fx[0]);
    const double box = width * height, scale = 1.0 / fabs(area);
    if (isfinite(box) && isfinite(scale) && box <= fabs(area) * TL_BOX_AREAS) {
        for (int k = 0; k < 3; k++) {
            const int a = k == 2 ? 0 : k + 1, b = 3 - k - a;
            e->at[k] *= scale, e->step[k] *= scale;
            row_step[k] = (float)((x_fx[a] - x_fx[b]) * scale);
        }
        e->area = area < 0.0 ? -1.0f : 1.0f;
        return;
    }
    const int sign = -edge_sign(point_of(set->exact, corners[0]), point_of(set->exact, corners[1]),
                                point_of(set->exact, corners[2]));
    for (int k = 0; k < 3; k++)
        e->at[k] = sign / 3.0, e->step[k] = 0.0, row_step[k] = 0.0f;
    e->area = (float)sign;
}

/* The corners in sub-pixels, relative to the sample. */
static void place_special(const tl_vertex_set *set, const int32_t *corners, double unit, double *x_fx, double *y_fx)
{
    for (int k = 0; k < 3; k++) {
        if (set->exact) {
            const double *p = set->exact->points + (int64_t)corners[k] * set->exact->stride;
            x_fx[k] = p[0] * unit - set->sample_x_fx, y_fx[k] = p[1] * unit - set->sample_y_fx;
            continue;
        }
        const tl_wide v = vertex_fx(set, corners[k]);
        x_fx[k] = (double)v.x_fx, y_fx[k] = (double)v.y_fx;
    }
}

/* Sets up one special run and stores it in its lane. */
static void set_special(shade_runs *s, int slot, int lane, int64_t row, run_setup *r)
{
    const tl_vertex_set *set = &s->snapped->mesh;
    const int32_t corners[3] = {r->corners[0][lane], r->corners[1][lane], r->corners[2][lane]};
    const int bits = s->window->subpixel_bits, is_cut = s->view && is_clipped(set, corners);
    const double y = center_fx(row + s->window->y_px, bits), unit = (double)(1 << bits);
    special_run *e = &s->special[s->n_special];
    float row_step[3], lanes[TL_MAX_LANES];
    if (is_cut) {
        homogeneous_edges(e, s->view, set, corners, y, unit, row_step);
    } else {
        double x_fx[3], y_fx[3];
        place_special(set, corners, unit, x_fx, y_fx);
        special_edges(e, x_fx, y_fx, y, row_step);
        if (set->exact)
            normalize_edges(e, set, corners, x_fx, y_fx, row_step);
    }
    s->ints[RUN_SPECIAL][slot + lane] = ++s->n_special;
    vf *changed[10] = {&r->area,        &r->col_step[0], &r->col_step[1], &r->col_step[2], &r->row_step[0],
                       &r->row_step[1], &r->row_step[2], &r->q[0],        &r->q[1],        &r->q[2]};
    const float values[10] = {e->area,
                              (float)(e->step[0] * unit),
                              (float)(e->step[1] * unit),
                              (float)(e->step[2] * unit),
                              (float)(row_step[0] * unit),
                              (float)(row_step[1] * unit),
                              (float)(row_step[2] * unit),
                              1.0f,
                              1.0f,
                              1.0f};
    for (int k = 0; k < (is_cut ? 10 : 7); k++) {
        vf_store(lanes, *changed[k]);
        lanes[lane] = values[k];
        *changed[k] = vf_load(lanes);
    }
}

/* Sets edge functions of TL_LANES runs in a row, from their corners, at column 0 of the row: sums that wrap there are
 * right at the pixel.  Returns the runs that are special; RUN_SUM is the area. */
TL_INLINE vm find_edges(shade_runs *s, int slot, int64_t row, vi *x, vi *y, vf *col_step, vf *row_step)
{
    const tl_vertex_set *set = &s->snapped->mesh;
    const int bits = s->window->subpixel_bits;
    const int32_t half = (1 << bits) >> 1;
    const vi x_fx = vi_set1((int32_t)((uint32_t)s->window->x_px << bits) + half + set->sample_x_fx);
    const vi y_fx = vi_set1((int32_t)((uint32_t)(row + s->window->y_px) << bits) + half + set->sample_y_fx);
    vm is_special = bits == 0 ? vm_all() : vm_first(0);
    for (int k = 0; k < 3; k++)
        is_special = vm_or(is_special, vi_eq(x[k], vi_set1(TL_SPECIAL)));
    const vf width = vf_from_vi(vi_sub(vi_max(x[0], vi_max(x[1], x[2])), vi_min(x[0], vi_min(x[1], x[2]))));
    const vf height = vf_from_vi(vi_sub(vi_max(y[0], vi_max(y[1], y[2])), vi_min(y[0], vi_min(y[1], y[2]))));
    is_special = vm_or(is_special, vf_ge(vf_mul(width, height), vf_set1(TL_INT32_BOX)));
    for (int k = 0; k < 3; k++)
        x[k] = vi_sub(x[k], x_fx), y[k] = vi_sub(y[k], y_fx);
    vi sum = vi_set1(0);
    for (int k = 0; k < 3; k++) {
        const int a = k == 2 ? 0 : k + 1, b = 3 - k - a;
        const vi e = vi_sub(vi_mul(x[b], y[a]), vi_mul(x[a], y[b])), step = vi_shift_left(vi_sub(y[b], y[a]), bits);
        col_step[k] = vf_from_vi(step);
        row_step[k] = vf_from_vi(vi_shift_left(vi_sub(x[a], x[b]), bits));
        sum = vi_add(sum, e);
        if (k) {
            vi_store(s->ints[RUN_E1 + k - 1] + slot, e);
            vi_store(s->ints[RUN_STEP1 + k - 1] + slot, step);
        }
    }
    vi_store(s->ints[RUN_SUM] + slot, sum);
    return is_special;
}

/* Loads corners of TL_LANES runs in pixels. */
TL_INLINE void load_exact_corners(const tl_exact_points *points, const int32_t *corners, vd *x, vd *y)
{
    if (points->stride == TL_PLACED) {
        vd c[4];
        vd_load_records(points->points, TL_PLACED, corners, c);
        *x = c[0], *y = c[1];
        return;
    }
    double lanes[2][TL_MAX_LANES];
    for (int lane = 0; lane < TL_LANES; lane++)
        for (int axis = 0; axis < 2; axis++)
            lanes[axis][lane] = points->points[(int64_t)corners[lane] * points->stride + axis];
    *x = vd_load(lanes[0]), *y = vd_load(lanes[1]);
}

/* Stores edge function k from its value near column `near` and its step, in units: the nearest integers modulo 2^32,
 * and the rests. */
TL_INLINE void put_exact_edge(shade_runs *s, int slot, int k, vd e, vd step, vi near, vd to_middle)
{
    const vd integers = vd_set1(0x1.8p52); /* added to it, a number is rounded to an integer in the last bits */
    const vd rounded = vd_add(e, integers), rounded_step = vd_add(step, integers);
    const vd rest = vd_sub(e, vd_sub(rounded, integers)), rest_step = vd_sub(step, vd_sub(rounded_step, integers));
    const vi whole_step = vi_low_bits(rounded_step);
    vi_store(s->ints[RUN_E1 + k - 1] + slot, vi_sub(vi_low_bits(rounded), vi_mul(near, whole_step)));
    vi_store(s->ints[RUN_STEP1 + k - 1] + slot, whole_step);
    put(s, RUN_REST + 2 * k - 2, slot, vf_from_vd(vd_add(rest, vd_mul(rest_step, to_middle))));
    put(s, RUN_REST + 2 * k - 1, slot, vf_from_vd(rest_step));
}

/* Like `find_edges`, for corners x and y in pixels that are not snapped; sets the area, too.
 *
 * Edge functions are counted in 2^-24 of twice the area: an integer, exact modulo 2^32 at every column, and a rest,
 * float32, which stays below 17 and errs by less than 2^-19.  The sum of both is rounded once.  Both are computed in
 * float64 at the column of the block that is nearest to corner 0, and rests from the middle of the block.  So E / area
 * errs by 2^-24 of itself, 2^-43, and the error of float64: less than 2^-48 boxes, at least a pixel wide, over areas.
 * No result depends on the window: columns and rows are those of the picture. */
TL_INLINE vm find_exact_edges(shade_runs *s, int slot, int64_t row, const vd *x, const vd *y, vf *col_step,
                              vf *row_step, vf *area)
{
    const tl_vertex_set *set = &s->snapped->mesh;
    const tl_window *window = s->window;
    const double unit = 1.0 / (double)(1 << window->subpixel_bits);
    const double sample_x = 0.5 + set->sample_x_fx * unit, sample_y = 0.5 + set->sample_y_fx * unit;
    const vi in_block = vi_set1((int32_t)(window->x_px & (TL_RUN_BLOCK - 1))), last = vi_set1(TL_RUN_BLOCK - 1);
    const vi column = vi_load(s->ints[RUN_COLUMN] + slot);
    const vi block = vi_sub(column, vi_and(vi_add(column, in_block), last));
    const vd origin = vd_set1((double)window->x_px), zero = vd_set1(0.0);
    const vd block_px = vd_add(vd_from_vi(block), origin);
    const vd near = vd_min(vd_max(vd_floor(x[0]), block_px), vd_add(block_px, vd_set1(TL_RUN_BLOCK - 1)));
    const vd u = vd_sub(vd_add(near, vd_set1(sample_x)), x[0]);
    const vd v = vd_sub(y[0], vd_set1((double)(row + window->y_px) + sample_y));
    const vd x1 = vd_sub(x[1], x[0]), y1 = vd_sub(y[1], y[0]), x2 = vd_sub(x[2], x[0]), y2 = vd_sub(y[2], y[0]);
    const vd twice_area = vd_sub(vd_mul(x2, y1), vd_mul(x1, y2)), size = vd_abs(twice_area);
    const vd scale = vd_div(vd_set1(TL_UNIT_AREA), size);
    const vd step1 = vd_mul(vd_sub(zero, y2), scale), step2 = vd_mul(y1, scale);
    const vd down1 = vd_mul(x2, scale), down2 = vd_mul(vd_sub(zero, x1), scale);
    const vd e1 = vd_mul(vd_add(vd_mul(x2, v), vd_mul(y2, u)), vd_sub(zero, scale));
    const vd e2 = vd_mul(vd_add(vd_mul(x1, v), vd_mul(y1, u)), scale);
    const vi near_column = vi_round(vd_sub(near, origin));
    const vd to_middle = vd_from_vi(vi_sub(vi_add(block, vi_set1(TL_RUN_BLOCK / 2)), near_column));
    const vm is_back = vd_ge(zero, twice_area);
    const vi whole = vi_set1((int32_t)TL_UNIT_AREA), sum = vi_select(is_back, vi_sub(vi_set1(0), whole), whole);
    put_exact_edge(s, slot, 1, e1, step1, near_column, to_middle);
    put_exact_edge(s, slot, 2, e2, step2, near_column, to_middle);
    vi_store(s->ints[RUN_SUM] + slot, sum);
    *area = vf_from_vi(sum);
    col_step[1] = vf_from_vd(step1), col_step[2] = vf_from_vd(step2);
    col_step[0] = vf_from_vd(vd_sub(vd_sub(zero, step1), step2));
    row_step[1] = vf_from_vd(down1), row_step[2] = vf_from_vd(down2);
    row_step[0] = vf_from_vd(vd_sub(vd_sub(zero, down1), down2));
    const vd width = vd_sub(vd_max(vd_max(x1, x2), zero), vd_min(vd_min(x1, x2), zero));
    const vd height = vd_sub(vd_max(vd_max(y1, y2), zero), vd_min(vd_min(y1, y2), zero));
    const vd box = vd_mul(width, height), most = vd_set1(TL_MOST_STEP);
    const vm has_weights = vm_and(vd_ge(vd_mul(size, vd_set1(TL_BOX_AREAS)), box), vd_ge(vd_set1(0x1p900), box));
    return vm_and_not(vm_all(), vm_and(has_weights, vd_ge(most, vd_add(vd_abs(step1), vd_abs(step2)))));
}

/* Loads the corners of TL_LANES runs and sets their edge functions. */
TL_INLINE vm set_edges(shade_runs *s, int slot, int64_t row, run_setup *r)
{
    const tl_vertex_set *set = &s->snapped->mesh;
    vi x[3], y[3];
    if (set->exact) {
        vd x_px[3], y_px[3];
        for (int k = 0; k < 3; k++)
            load_exact_corners(set->exact, r->corners[k], &x_px[k], &y_px[k]);
        return find_exact_edges(s, slot, row, x_px, y_px, r->col_step, r->row_step, &r->area);
    }
    for (int k = 0; k < 3; k++) {
        vz z;
        load_vertices_by(1, set->vertices, r->corners[k], &x[k], &y[k], &z);
    }
    const vm is_special = find_edges(s, slot, row, x, y, r->col_step, r->row_step);
    r->area = vf_from_vi(vi_load(s->ints[RUN_SUM] + slot));
    return is_special;
}

/* Stores the corners of all runs.  This is a pass by itself because a vector load stalls on numbers that were just
 * stored one by one. */
TL_INLINE void keep_corners(shade_runs *s)
{
    for (int slot = TL_LANES; slot < TL_LANES + s->n_runs; slot += TL_LANES) {
        vi corners[3];
        run_corners(s, slot, corners);
        for (int k = 0; k < 3; k++)
            vi_store(s->corners[k] + slot, corners[k]);
    }
}

/* Sets edge functions and attributes of the runs of a row, a vector of runs at a time. */
TL_ONCE void set_runs(shade_runs *s, int64_t row)
{
    const tl_shading *shading = s->shading;
    const int end = TL_LANES + s->n_runs;
    s->n_special = 0;
    if (!s->n_runs)
        return;
    /* fills the last vector with a valid triangle */
    vi_store(s->ints[RUN_ID] + end, vi_set1(s->ints[RUN_ID][end - 1]));
    keep_corners(s);
    for (int slot = TL_LANES; slot < end; slot += TL_LANES) {
        run_setup r;
        for (int k = 0; k < 3; k++)
            vi_spill(r.corners[k], vi_load(s->corners[k] + slot));
        vi_store(s->ints[RUN_SPECIAL] + slot, vi_set1(0));
        const vm is_special = vm_and(set_edges(s, slot, row, &r), vm_first(end - slot));
        load_normals(s, slot, &r);
        for (unsigned rest = vm_bits(is_special); rest; rest &= rest - 1)
            set_special(s, slot, __builtin_ctz(rest), row, &r);
        set_attributes(s, slot, &r);
    }
    if (shading->material_of)
        for (int slot = TL_LANES; slot < end; slot++)
            s->ints[RUN_MATERIAL][slot] = shading->material_of[s->ints[RUN_ID][slot]];
}

/* A vector of pixels: the runs of its lanes, and the interpolated attributes. */
typedef struct {
    const shade_runs *s;
    int first;  /* the slot of lane 0's run; of the next run if lane 0 has none */
    vi run;     /* of each lane, from `first` on */
    vm visible; /* lanes that show a triangle */
    vi column;  /* in the window */
    vf e[3];    /* edge functions */
    vf area, q, inv_q;
    vf normal[3];
    vf color[3]; /* of the vertices */
    vf uv[2], du[2], dv[2];
    vf ray[3], point[3];
    /* of full materials and cut-outs: */
    vf alpha; /* of the vertices */
    vf uv1[2], du1[2], dv1[2];
    vf opacity; /* of the surface */
} shaded_lanes;

TL_INLINE vf pick(const shaded_lanes *p, int coefficient)
{
    return vf_pick(p->s->floats[coefficient] + p->first, p->run);
}
TL_INLINE vi pick_int(const shaded_lanes *p, int coefficient)
{
    return vi_pick(p->s->ints[coefficient] + p->first, p->run);
}

/* The sum of a value at the corners, weighted by the edge functions. */
TL_INLINE vf weighed(const shaded_lanes *p, int c0, int c1, int c2)
{
    return vf_fma(p->e[0], pick(p, c0), vf_fma(p->e[1], pick(p, c1), vf_mul(p->e[2], pick(p, c2))));
}

/* Sets the runs and the edge functions of vector i of the span that begins at `column`; not those of special runs. */
TL_INLINE void find_lanes(shaded_lanes *p, const shade_runs *s, int i, int64_t column, vi *e, vi *sum)
{
    const unsigned starts = s->starts[i];
    const int begins = (int)(starts & 1);
    p->s = s;
    p->first = s->first_run[i] - 1 + begins;
    p->run = vi_sub(vi_prefix_count(starts), vi_set1(begins));
    p->visible = vm_from_bits(s->visible[i]);
    p->column = vi_add(vi_iota(), vi_set1((int32_t)column + i * TL_LANES));
    e[1] = vi_add(pick_int(p, RUN_E1), vi_mul(p->column, pick_int(p, RUN_STEP1)));
    e[2] = vi_add(pick_int(p, RUN_E2), vi_mul(p->column, pick_int(p, RUN_STEP2)));
    *sum = pick_int(p, RUN_SUM);
    e[0] = vi_sub(vi_sub(*sum, e[1]), e[2]);
}

/* Sets the rests of edge functions of vertices that are not snapped. */
TL_INLINE void find_rests(const shaded_lanes *p, vf *rest)
{
    const vi in_block = vi_set1((int32_t)(p->s->window->x_px & (TL_RUN_BLOCK - 1))), last = vi_set1(TL_RUN_BLOCK - 1);
    const vi from_middle = vi_sub(vi_and(vi_add(p->column, in_block), last), vi_set1(TL_RUN_BLOCK / 2));
    const vf column = vf_from_vi(from_middle);
    rest[1] = vf_fma(pick(p, RUN_REST + 1), column, pick(p, RUN_REST));
    rest[2] = vf_fma(pick(p, RUN_REST + 3), column, pick(p, RUN_REST + 2));
    rest[0] = vf_sub(vf_sub(vf_set1(0.0f), rest[1]), rest[2]);
}

/* The lanes of a vector of pixels that belong to special runs, run by run. */
typedef struct {
    vd x_fx; /* of the pixels */
    vi special;
    int32_t number[TL_MAX_LANES]; /* `special`, lane by lane */
    vm rest;                      /* lanes whose runs are not processed yet */
    const special_run *run;
} special_lanes;

TL_INLINE special_lanes start_special(const shaded_lanes *p, vi special)
{
    const tl_window *window = p->s->window;
    const vd x_px = vd_add(vd_from_vi(p->column), vd_set1((double)window->x_px + 0.5));
    special_lanes own = {.x_fx = vd_mul(x_px, vd_set1((double)(1 << window->subpixel_bits))), .special = special};
    vi_store(own.number, special);
    own.rest = vm_and(p->visible, vi_gt(special, vi_set1(0)));
    return own;
}

/* Steps to the next special run; returns its lanes, none after the last run. */
TL_INLINE vm next_special(const shaded_lanes *p, special_lanes *own)
{
    if (!vm_any(own->rest))
        return own->rest;
    const int32_t number = own->number[__builtin_ctz(vm_bits(own->rest))];
    const vm lanes = vm_and(own->rest, vi_eq(own->special, vi_set1(number)));
    own->run = &p->s->special[number - 1];
    own->rest = vm_and_not(own->rest, lanes);
    return lanes;
}

TL_INLINE vd special_edge(const special_lanes *own, int k)
{
    const special_run *e = own->run;
    return vd_add(vd_set1(e->at[k]), vd_mul(vd_set1(e->step[k]), vd_sub(own->x_fx, vd_set1(e->from[k]))));
}

#endif
