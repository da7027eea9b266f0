/* Which meshlets a view may show: sixteen at a time, in float32.
 * In: bounds of meshlets, a view.  Out: those that are not certain to lie outside or to be turned away, and where in
 * the picture they are; apart from them those for which that is not certain in float32, or that near or far may cut.
 *
 * As in cluster_view.c every test has the errors of the vertex stage, of the snap and of float32 on its far side.
 *
 * Based on: S. Kumar, D. Manocha, B. Garrett, M. Lin, Hierarchical Back-Face Computation, 1996. */
#ifndef TL_LIST_C
#define TL_LIST_C

#include <math.h>
#include <stdint.h>

#include "clusters.h"
#include "meshlets.h"
#include "topleft.h"
#include "lanes/halves.h"
#include "lanes/lanes.h"

#if TL_HAS_HALVES

/* A form a * (row of the matrix) + b * w that is not negative inside: how fast it grows, and its error. */
typedef struct {
    float a, b, slope, error;
} lane_form;

#define TL_N_FORMS 6          /* left, right, above, below, near, far */
#define TL_FORM_ERROR 0x1p-19 /* of the vertex stage and of forms in float32, as a share of the terms added up */
#define TL_STAGE_ERROR 0x1p-21
#define TL_LARGEST_W 0x1p60
#define TL_MAX_PX 16000 /* from the window's corner: where 16 bits hold pixels, and sub-pixels are certain */

/* A view in float32.  A matrix of float64 is rounded here, by 2^-24 of each term, and its vertex stage errs by less:
 * together by less than a vertex stage of float32. */
typedef struct {
    float row[4][4];
    lane_form forms[TL_N_FORMS];
    float eye[3], eye_w, eye_factor, eye_error;
    float length[3], terms[4];
    float scale[2], half_px[2], origin_px[2], pixel;
    int is_zero_to_one, is_farthest;
} lane_view;

static double row_length(const double *row) { return sqrt((row[0] * row[0] + row[1] * row[1]) + row[2] * row[2]); }

static lane_form make_form(const tl_cluster_view *v, const double *terms, int i, double a, double b)
{
    double row[3];
    for (int k = 0; k < 3; k++)
        row[k] = a * v->matrix[4 * i + k] + b * v->matrix[12 + k];
    return (lane_form){(float)a, (float)b, (float)(row_length(row) * 1.0001),
                       (float)(TL_FORM_ERROR * (fabs(a) * terms[i] + fabs(b) * terms[3]))};
}

static lane_view place_view(const tl_meshlet_pass *pass)
{
    const tl_cluster_view *v = pass->seen;
    const double *largest = pass->mesh->largest;
    double terms[4];
    lane_view l;
    for (int i = 0; i < 4; i++) {
        terms[i] = fabs(v->matrix[4 * i + 3]);
        for (int k = 0; k < 4; k++)
            l.row[i][k] = (float)v->matrix[4 * i + k];
        for (int k = 0; k < 3; k++)
            terms[i] += fabs(v->matrix[4 * i + k]) * largest[k];
        l.terms[i] = (float)(terms[i] * 1.0001);
    }
    for (int side = 0; side < 4; side++)
        l.forms[side] = make_form(v, terms, side / 2, v->side[side][0], v->side[side][1]);
    l.forms[4] = make_form(v, terms, 2, 1.0, v->zero_to_one ? 0.0 : 1.0);
    l.forms[5] = make_form(v, terms, 2, -1.0, 1.0);
    /* the eye as a point, or, of a view without perspective, the way to it */
    const double w = v->eye[3], sign = v->cull == TL_CULL_BACK ? -1.0 : 1.0;
    const double scale = w != 0.0 ? sign / fabs(w) : sign;
    double error = 0.0;
    for (int k = 0; k < 3; k++) {
        l.eye[k] = (float)(v->eye[k] * scale);
        error += fabs(v->eye[k] * scale) + (w != 0.0 ? largest[k] : 0.0);
    }
    l.eye_w = w == 0.0 ? 0.0f : (float)(w * scale);
    l.eye_factor = w != 0.0 ? (float)(0.999 * fabs(w)) : 0.999f;
    l.eye_error = (float)(error * 0x1p-20);
    for (int i = 0; i < 3; i++)
        l.length[i] = (float)(v->length[i] * 1.0001);
    l.scale[0] = (float)v->scale_x, l.scale[1] = (float)v->scale_y;
    l.half_px[0] = (float)v->half_width_px, l.half_px[1] = (float)v->half_height_px;
    const double pixel = v->half_width_px / v->scale_x; /* a sub-pixel */
    /* a pixel begins half a pixel before its sample, wherever that lies */
    l.origin_px[0] = (float)(v->half_width_px - (double)pass->window->x_px - pixel * (double)pass->sample_x_fx);
    l.origin_px[1] = (float)(v->half_height_px - (double)pass->window->y_px - pixel * (double)pass->sample_y_fx);
    l.pixel = (float)pixel;
    l.is_zero_to_one = v->zero_to_one, l.is_farthest = v->is_farthest;
    return l;
}

/* The bounds of sixteen meshlets under a view. */
typedef struct {
    vf bound[TL_N_BOUNDS];
    vf clip[4];      /* the middle */
    vf w_min, w_max; /* over the ball */
    vf reach[2];     /* sub-pixels that the picture of a vector of length 1 spans at most */
    vf moved;        /* sub-pixels that the vertex stage and the snap move a corner at most */
} lane_bounds;

TL_INLINE vf set(float a) { return vf_set1(a); }

TL_INLINE vf form_value(const lane_bounds *b, const lane_form *form, int i)
{
    return vf_fma(set(form->a), b->clip[i], vf_mul(set(form->b), b->clip[3]));
}

TL_INLINE int form_row(int form) { return form < 4 ? form / 2 : 2; }

/* The meshlets that are certain to lie outside of a form, and within one. */
TL_INLINE vm beyond(const lane_bounds *b, const lane_form *form, int i)
{
    return vf_lt(vf_fma(b->bound[TL_BOUND_RADIUS], set(form->slope), form_value(b, form, i)), set(-form->error));
}
TL_INLINE vm within(const lane_bounds *b, const lane_form *form, int i)
{
    return vf_gt(vf_fnma(b->bound[TL_BOUND_RADIUS], set(form->slope), form_value(b, form, i)), set(form->error));
}

TL_INLINE void place_bounds(const tl_meshlets *mesh, const lane_view *l, int64_t i, lane_bounds *b)
{
    const int64_t stride = mesh->n_meshlets + TL_MESHLET_TAIL;
    for (int k = 0; k < TL_N_BOUNDS; k++)
        b->bound[k] = vf_load(mesh->bounds + k * stride + i);
    for (int k = 0; k < 4; k++) {
        const float *row = l->row[k];
        b->clip[k] =
            vf_fma(set(row[0]), b->bound[TL_BOUND_X],
                   vf_fma(set(row[1]), b->bound[TL_BOUND_Y], vf_fma(set(row[2]), b->bound[TL_BOUND_Z], set(row[3]))));
    }
    const vf reach_w = vf_mul(b->bound[TL_BOUND_RADIUS], set(l->length[2])), error = set(0x1p-20f * l->terms[3]);
    b->w_min = vf_sub(vf_sub(b->clip[3], reach_w), error);
    b->w_max = vf_add(vf_add(b->clip[3], reach_w), error);
}

TL_INLINE void place_reach(const lane_view *l, vf inverse_w, lane_bounds *b)
{
    vf moved[2];
    for (int k = 0; k < 2; k++) {
        const vf largest = vf_mul(vf_add(vf_fma(b->bound[TL_BOUND_RADIUS], set(l->length[k]), vf_abs(b->clip[k])),
                                         set(0x1p-20f * l->terms[k])),
                                  inverse_w);
        b->reach[k] =
            vf_mul(vf_mul(set(1.001f * l->scale[k]), vf_fma(largest, set(l->length[2]), set(l->length[k]))), inverse_w);
        moved[k] = vf_mul(set((float)TL_STAGE_ERROR * 1.01f * l->scale[k]),
                          vf_fma(largest, set(l->terms[3]), set(l->terms[k])));
    }
    b->moved = vf_fma(vf_max(moved[0], moved[1]), inverse_w, set(0.501f));
}

/* The meshlets that are certain to hold no sample; each sample lies half a pixel from where `at` begins.  Beside
 * moves of corners, `at` has errors: no more than those of the vertex stage for the forms, and 0.013 pixels for the
 * division and the sum, of numbers below 2^15. */
TL_INLINE vm between_samples(const lane_view *l, const lane_bounds *b, const vf at[2])
{
    vm between[2];
    for (int k = 0; k < 2; k++) {
        const vf far = vf_fma(vf_fma(b->reach[k], b->bound[TL_BOUND_RADIUS], vf_mul(b->moved, set(4.0f))),
                              set(l->pixel), set(0.03f));
        const vf middle = vf_sub(at[k], set(0.5f));
        const vf last = vf_from_vi(vi_floor(vf_add(middle, far)));
        between[k] = vf_lt(last, vf_sub(middle, far));
    }
    return vm_or(between[0], between[1]);
}

/* The eye as the middle of a meshlet sees it: along the axis of its cone, and across. */
typedef struct {
    vf along, across, length;
} lane_eye;

TL_INLINE lane_eye place_eye(const lane_view *l, const lane_bounds *b)
{
    const vf zero = set(0.0f);
    vf squares = zero, along = zero;
    for (int k = 0; k < 3; k++) {
        const vf g = vf_fnma(set(l->eye_w), b->bound[TL_BOUND_X + k], set(l->eye[k]));
        squares = vf_fma(g, g, squares);
        along = vf_fma(g, b->bound[TL_BOUND_AXIS_X + k], along);
    }
    const vf across = vf_sqrt(vf_max(vf_fma(set(1e-5f), squares, vf_fnma(along, along, squares)), zero));
    return (lane_eye){along, across, vf_sqrt(squares)};
}

/* The meshlets with all triangles certain to be turned one way after the snap: with `along` as it is the one that
 * is culled (of a view that culls nothing: the front shows), with `along` negated the other one.
 *
 * Twice the area of a triangle in the picture is n . g(a) times a factor, as is_turned_away in cluster_view.c has it.
 * Corners that move by d change it by less than 2 d (|x| + |y|) for each of two sides (x, y), and 8 d^2. */
TL_INLINE vm all_turned(const lane_view *l, const lane_bounds *b, const lane_eye *eye, vf along)
{
    const vf radius = vf_mul(b->bound[TL_BOUND_RADIUS], set(l->eye_w == 0.0f ? 0.0f : 1.0001f));
    vf least = vf_sub(vf_fms(along, b->bound[TL_BOUND_COS], vf_mul(eye->across, b->bound[TL_BOUND_SIN])), radius);
    least = vf_sub(vf_fnma(set(1e-5f), eye->length, least), set(2.0f * l->eye_error));
    const vf w_cubed = vf_mul(b->w_max, vf_mul(b->w_max, b->w_max));
    const vf factor = vf_mul(vf_mul(least, set(l->eye_factor)), vf_div(set(l->scale[0] * l->scale[1]), w_cubed));
    const vf sides = vf_mul(set(4.0f), vf_add(b->reach[0], b->reach[1]));
    const vf corners = vf_div(vf_mul(set(8.0f), b->moved), b->bound[TL_BOUND_SIDE]);
    const vf changed = vf_mul(vf_mul(set(1.002f), b->moved), vf_add(sides, corners));
    return vf_gt(vf_mul(b->bound[TL_BOUND_HEIGHT], factor), changed);
}

/* The depth that no sample of a meshlet is nearer than, or farther than: z/w of the middle is q, and elsewhere differs
 * from it by (z - q w) / w, a form that is small in the middle.  Any q will do. */
TL_INLINE vf depth_bound(const lane_view *l, const lane_bounds *b, vf q, vf inverse_least)
{
    vf squares = set(0.0f);
    for (int k = 0; k < 3; k++) {
        const vf slope = vf_fnma(q, set(l->row[3][k]), set(l->row[2][k]));
        squares = vf_fma(slope, slope, squares);
    }
    const vf error = vf_mul(set(2.0f * (float)TL_FORM_ERROR), vf_fma(vf_abs(q), set(l->terms[3]), set(l->terms[2])));
    const vf middle = vf_add(vf_abs(vf_fnma(q, b->clip[3], b->clip[2])), error);
    const vf reach = vf_mul(vf_fma(vf_mul(b->bound[TL_BOUND_RADIUS], set(1.0001f)), vf_sqrt(squares), middle),
                            vf_mul(inverse_least, set(1.0001f)));
    const vf ndc = l->is_farthest ? vf_add(q, reach) : vf_sub(q, reach);
    const vf depth = l->is_zero_to_one ? ndc : vf_fma(ndc, set(0.5f), set(0.5f));
    return vf_add(depth, set(l->is_farthest ? 0x1p-21f : -0x1p-21f)); /* drawn depths lie in [0, 1] */
}

/* Lists meshlets [first, end) that the window may show in `seen`, and others for draw_fallback in `fallback`; returns
 * how many of the first there are. */
static int64_t list_seen(const tl_meshlet_pass *pass, int64_t first, int64_t end, tl_seen_meshlet *seen,
                         int32_t *fallback, int64_t *n_fallback)
{
    const lane_view l = place_view(pass);
    const tl_meshlets *mesh = pass->mesh;
    const tl_cull cull = pass->seen->cull;
    int64_t n = 0;
    *n_fallback = 0;
    for (int64_t i = first; i < end; i += TL_LANES) {
        lane_bounds b;
        vm live = vm_first(end - i);
        place_bounds(mesh, &l, i, &b);
        for (int k = 0; k < TL_N_FORMS; k++)
            live = vm_and_not(live, beyond(&b, l.forms + k, form_row(k)));
        if (!vm_any(live))
            continue;
        vm plain = vm_and(within(&b, l.forms + 4, 2), within(&b, l.forms + 5, 2));
        plain = vm_and(plain, vf_gt(b.w_min, vf_max(vf_mul(b.clip[3], set(1e-3f)), set((float)(1.0 / TL_LARGEST_W)))));
        plain = vm_and(plain, vf_lt(b.w_max, set((float)TL_LARGEST_W)));
        const vf inverse = vf_div(set(1.0f), b.clip[3]), inverse_least = vf_div(set(1.0f), b.w_min);
        place_reach(&l, inverse_least, &b);
        const lane_eye eye = place_eye(&l, &b);
        const vm turned = vm_and(all_turned(&l, &b, &eye, eye.along), plain);
        unsigned is_back = cull == TL_CULL_FRONT ? ~0u : 0, is_both = 0;
        if (cull != TL_CULL_NONE) {
            live = vm_and_not(live, turned);
        } else {
            const vf other_way = vf_sub(set(0.0f), eye.along);
            is_back = vm_bits(vf_gt(other_way, set(0.0f)));
            is_both = ~vm_bits(vm_or(all_turned(&l, &b, &eye, other_way), turned));
        }
        if (!vm_any(live))
            continue;
        vf at[2], reach[2];
        at[0] = vf_fma(vf_mul(b.clip[0], inverse), set(l.half_px[0]), set(l.origin_px[0]));
        at[1] = vf_fnma(vf_mul(b.clip[1], inverse), set(l.half_px[1]), set(l.origin_px[1]));
        for (int k = 0; k < 2; k++)
            reach[k] =
                vf_fma(vf_fma(b.reach[k], b.bound[TL_BOUND_RADIUS], vf_add(b.moved, b.moved)), set(l.pixel), set(2.0f));
        const vf farthest = vf_max(vf_max(vf_abs(at[0]), vf_abs(at[1])), vf_max(reach[0], reach[1]));
        /* NaN, too; a maximum with NaN is the other number, so each is compared */
        vm is_far = vf_not_lt(farthest, set(TL_MAX_PX));
        for (int k = 0; k < 2; k++)
            is_far =
                vm_or(is_far, vm_or(vf_not_lt(vf_abs(at[k]), set(TL_MAX_PX)), vf_not_lt(reach[k], set(TL_MAX_PX))));
        live = vm_and_not(live, vm_and(between_samples(&l, &b, at), vm_and_not(plain, is_far)));
        const vm needs_fallback = vm_and(live, vm_or(vm_and_not(vm_all(), plain), is_far));
        for (unsigned rest = vm_bits(needs_fallback); rest; rest &= rest - 1)
            fallback[(*n_fallback)++] = (int32_t)(i + __builtin_ctz(rest));
        int32_t left[TL_LANES], below[TL_LANES], cols[TL_LANES], rows[TL_LANES];
        float depth[TL_LANES];
        vi_store(left, vi_sub(vi_nearest(at[0]), vi_set1(TL_SLOT_PX / 2)));
        vi_store(below, vi_add(vi_nearest(at[1]), vi_set1(TL_SLOT_PX / 2)));
        vi_store(cols, vi_nearest(reach[0]));
        vi_store(rows, vi_nearest(reach[1]));
        vf_store(depth, depth_bound(&l, &b, vf_mul(b.clip[2], inverse), inverse_least));
        for (unsigned rest = vm_bits(vm_and_not(live, needs_fallback)); rest; rest &= rest - 1) {
            const int k = __builtin_ctz(rest);
            seen[n++] = (tl_seen_meshlet){
                .meshlet = (int32_t)(i + k),
                .left_px = (int16_t)left[k],
                .below_px = (int16_t)below[k],
                .reach_x = (int16_t)cols[k],
                .reach_y = (int16_t)rows[k],
                .n_triangles = mesh->n_triangles[i + k],
                .side = (int16_t)((is_back >> k & 1 ? TL_SIDE_BACK : 0) | (is_both >> k & 1 ? TL_SIDE_BOTH : 0)),
                .depth = depth[k],
            };
        }
    }
    return n;
}

#endif
#endif
