/* Project: object space to clip space to vertices in pixels, snapped or not; marks vertices outside a clip plane.
 * In: the caller's vertices, a matrix.  Out: vertex records, or points (x, y, z). */
#ifndef TL_PROJECT_C
#define TL_PROJECT_C

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/exact.h"
#include "vertex/fixed.h"
#include "vertex/snap.c"

/* w, near, far, -x, +x, -y, +y: the order in which polygons are clipped */
#define TL_N_PLANES 7
#define TL_MIN_W 0x1p-500 /* keeps 1/w and x/w from overflowing */
#define TL_MAX_W 0x1p500  /* the largest w that vd_quotients can divide by */

/* Vertex i in clip space.  float32 is transformed in float32, float64 in float64. */
static inline void clip_position(const tl_source *source, int64_t i, double *p)
{
    const float *v32 = (const float *)source->data + i * source->n_components, *m32 = source->matrix;
    const double *v64 = (const double *)source->data + i * source->n_components, *m64 = source->matrix;
    for (int k = 0; k < 4; k++) {
        if (!source->matrix)
            p[k] = source->scalar == TL_F32 ? (double)v32[k] : v64[k];
        else if (source->scalar == TL_F32)
            p[k] =
                (double)(((m32[4 * k] * v32[0] + m32[4 * k + 1] * v32[1]) + m32[4 * k + 2] * v32[2]) + m32[4 * k + 3]);
        else
            p[k] = ((m64[4 * k] * v64[0] + m64[4 * k + 1] * v64[1]) + m64[4 * k + 2] * v64[2]) + m64[4 * k + 3];
    }
}

/* Signed distance from a plane, >= 0 inside. */
static inline double plane_distance(const double *p, int plane, const tl_view *view)
{
    const double x = p[0], y = p[1], z = p[2], w = p[3];
    switch (plane) {
    case 0: return w - TL_MIN_W;
    case 1: return !view->near_clip ? 1.0 : view->zero_to_one ? z : z + w;
    case 2: return !view->far_clip ? 1.0 : w - z;
    case 3: return view->guard_band_x * w + x;
    case 4: return view->guard_band_x * w - x;
    case 5: return view->guard_band_y * w + y;
    default: return view->guard_band_y * w - y;
    }
}

static inline unsigned outside_planes(const double *p, const tl_view *view)
{
    unsigned out = 0;
    for (int plane = 0; plane < TL_N_PLANES; plane++)
        out |= (unsigned)!(plane_distance(p, plane, view) >= 0.0) << plane;
    return out;
}

/* Perspective divide and viewport.  x_px = (x/w + 1) * (width/2), each operation rounded once: so x_px errs by less
 * than 2^-51 of |x_px| + width. */
static inline void set_projected(const double *p, const tl_view *view, int was_cut, double *out)
{
    double z = view->zero_to_one ? p[2] / p[3] : (p[2] / p[3] + 1.0) * 0.5;
    if (was_cut && view->near_clip)
        z = z < 0.0 ? 0.0 : z; /* a cut point lies on its plane up to rounding */
    if (was_cut && view->far_clip)
        z = z > 1.0 ? 1.0 : z;
    out[0] = (p[0] / p[3] + 1.0) * view->half_width_px;
    out[1] = (1.0 - p[1] / p[3]) * view->half_height_px;
    out[2] = z > FLT_MAX ? FLT_MAX : z < -FLT_MAX ? -FLT_MAX : z; /* only without near and far planes */
}

/* Perspective divide and viewport, then rounded to sub-pixels and stored. */
static inline void store_projected(const double *p, const tl_view *view, int64_t i, tl_vertex *out, tl_wide *wide,
                                   int was_cut, tl_vertex_counts *counts)
{
    const double unit = (double)(1 << view->subpixel_bits);
    double at[3];
    set_projected(p, view, was_cut, at);
    store_vertex(rint(at[0] * unit), rint(at[1] * unit), at[2], i, out, wide, counts);
}

static inline void set_placed(double *point, double x, double y, double z, int32_t x_fx, int32_t y_fx)
{
    const int32_t place[2] = {x_fx, y_fx};
    point[0] = x, point[1] = y, point[2] = z;
    memcpy(point + 3, place, sizeof place);
}

/* The nearest multiple of 2^-TL_PLACE_BITS, within the limit. */
static inline int32_t place_of(double v)
{
    const double most = TL_PLACE_LIMIT_PX;
    return (int32_t)rint((v > most ? most : v < -most ? -most : v) * (double)(1 << TL_PLACE_BITS));
}

/* Stores a vertex that cannot be drawn, with the reason. */
static inline void store_special(const tl_projected *out, int64_t i, tl_special what)
{
    double *point = out->points + TL_PLACED * i;
    if (!out->points)
        out->records[i] = (tl_vertex){TL_SPECIAL, what, 0.0};
    else
        set_placed(point, TL_NAN, what, 0.0, TL_SPECIAL, 0);
}

/* Projects one vertex of any kind. */
static void project_one(const tl_source *source, int64_t i, const tl_view *view, const tl_projected *out,
                        tl_vertex_counts *counts)
{
    double p[4];
    clip_position(source, i, p);
    if (!(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(p[3]))) {
        store_special(out, i, TL_BAD);
        counts->n_bad++;
    } else if (outside_planes(p, view)) {
        store_special(out, i, TL_CLIPPED);
        counts->n_clipped++;
    } else if (out->points) {
        double at[3];
        set_projected(p, view, 0, at);
        set_placed(out->points + TL_PLACED * i, at[0], at[1], at[2], place_of(at[0]), place_of(at[1]));
    } else {
        store_projected(p, view, i, out->records, out->wide, 0, counts);
    }
}

/* `clip_position` for TL_LANES vertices; matrix may be NULL. */
TL_INLINE void clip_lanes_f32(const float *data, const float *m, int stride, vf *p)
{
    vf v[4];
    load_columns_f32(data, stride, v);
    for (int k = 0; k < 4; k++) {
        vf sum = v[k];
        if (m) {
            sum = vf_add(vf_mul(vf_set1(m[4 * k]), v[0]), vf_mul(vf_set1(m[4 * k + 1]), v[1]));
            sum = vf_add(vf_add(sum, vf_mul(vf_set1(m[4 * k + 2]), v[2])), vf_set1(m[4 * k + 3]));
        }
        p[k] = sum;
    }
}

TL_INLINE void clip_lanes_f64(const double *data, const double *m, int stride, vd *p)
{
    vd v[4];
    load_columns_f64(data, stride, v);
    for (int k = 0; k < 4; k++) {
        p[k] = v[k];
        if (m) {
            p[k] = vd_add(vd_mul(vd_set1(m[4 * k]), v[0]), vd_mul(vd_set1(m[4 * k + 1]), v[1]));
            p[k] = vd_add(vd_add(p[k], vd_mul(vd_set1(m[4 * k + 2]), v[2])), vd_set1(m[4 * k + 3]));
        }
    }
}

static void set_inverse_w(const tl_source *source, const float *rows, int64_t first, int64_t end, float *restrict out)
{
    int64_t i = first;
    for (; TL_LANES > 1 && source->matrix && i + TL_LANES <= end && i + TL_LANES < source->n; i += TL_LANES) {
        vf inv_w;
        if (source->scalar == TL_F32) {
            vf p[4];
            clip_lanes_f32((const float *)source->data + 3 * i, (const float *)source->matrix, 3, p);
            inv_w = vf_div(vf_set1(1.0f), p[3]);
        } else {
            vd p[4];
            clip_lanes_f64((const double *)source->data + 3 * i, (const double *)source->matrix, 3, p);
            inv_w = vf_from_vd(vd_div(vd_set1(1.0), p[3]));
        }
        vf_store_fourths(rows + 4 * i, inv_w, out + 4 * i);
    }
    for (; i < end; i++) {
        double p[4];
        clip_position(source, i, p);
        for (int k = 0; k < 3; k++)
            out[4 * i + k] = rows[4 * i + k];
        out[4 * i + 3] = source->scalar == TL_F32 ? 1.0f / (float)p[3] : (float)(1.0 / p[3]);
    }
}

/* The lanes inside the planes of w, near and far; a sum and its rounding have equal signs, so these are the tests of
 * `plane_distance`.  Any vertex within 2^30 sub-pixels is inside the guard band. */
TL_INLINE vm inside_lanes(const vd *p, const tl_view *view)
{
    const vd z = p[2], w = p[3], zero = vd_set1(0.0);
    vm inside = vm_and(vd_ge(w, vd_set1(TL_MIN_W)), vd_ge(vd_set1(TL_MAX_W), w));
    if (view->near_clip)
        inside = vm_and(inside, vd_ge(z, view->zero_to_one ? zero : vd_sub(zero, w)));
    if (view->far_clip)
        inside = vm_and(inside, vd_ge(w, z));
    return inside;
}

/* The lanes of float32 inside the planes of w, near and far: 0 < w < infinity equals the two tests of w. */
TL_INLINE vm inside_lanes_f32(const vf *p, const tl_view *view)
{
    const vf z = p[2], w = p[3], zero = vf_set1(0.0f);
    vm inside = vm_and(vf_lt(zero, w), vf_lt(w, vf_set1(INFINITY)));
    if (view->near_clip)
        inside = vm_and(inside, vf_ge(z, view->zero_to_one ? zero : vf_sub(zero, w)));
    if (view->far_clip)
        inside = vm_and(inside, vf_ge(w, z));
    return inside;
}

#define TL_SURELY_INSIDE_PX 0x1p50 /* the guard band begins 2^52 px from the middle of the picture */

/* Stores TL_LANES points without a snap; returns those that surely lie inside the guard band. */
TL_INLINE vm store_points(double *out, vd x, vd y, vd z)
{
    const vd farthest = vd_set1(TL_SURELY_INSIDE_PX), scale = vd_set1((double)(1 << TL_PLACE_BITS));
    const vd most = vd_set1(TL_PLACE_LIMIT_PX), least = vd_set1(-TL_PLACE_LIMIT_PX);
    vd_store_places(out, x, y, z, vi_round(vd_mul(vd_max(vd_min(x, most), least), scale)),
                    vi_round(vd_mul(vd_max(vd_min(y, most), least), scale)));
    return vm_and(vd_ge(farthest, vd_abs(x)), vd_ge(farthest, vd_abs(y)));
}

/* `scalar` and the flags after it are constants: a copy for each keeps the matrix in registers. */
TL_INLINE int64_t project_lanes(const tl_source *source, int64_t first, int64_t end, const tl_view *view,
                                const tl_projected *out, tl_vertex_counts *counts, tl_scalar scalar, int has_matrix,
                                int is_snapped)
{
    const double unit = is_snapped ? (double)(1 << view->subpixel_bits) : 1.0;
    const vd one = vd_set1(1.0), half = vd_set1(0.5), largest = vd_set1(FLT_MAX);
    const vd scale_x = vd_set1(view->half_width_px * unit), scale_y = vd_set1(view->half_height_px * unit);
    const int stride = has_matrix ? 3 : 4;
    double m64[16];
    float m32[16];
    if (has_matrix)
        memcpy(scalar == TL_F32 ? (void *)m32 : (void *)m64, source->matrix,
               scalar == TL_F32 ? sizeof m32 : sizeof m64);
    int64_t i = first;
    /* loads read two numbers past the last row */
    for (; i + TL_LANES <= end && i + TL_LANES < source->n; i += TL_LANES) {
        vd p[4], ndc[3];
        vm good;
        if (scalar == TL_F32) {
            vf p32[4];
            clip_lanes_f32((const float *)source->data + i * stride, has_matrix ? m32 : NULL, stride, p32);
            good = inside_lanes_f32(p32, view);
            for (int k = 0; k < 4; k++)
                p[k] = vd_from_vf(p32[k]);
        } else {
            clip_lanes_f64((const double *)source->data + i * stride, has_matrix ? m64 : NULL, stride, p);
            good = inside_lanes(p, view);
        }
        if (out->rows) /* vd_quotients computes the inverse of float64, too */
            vf_store_fourths(out->rows + 4 * i,
                             scalar == TL_F32 ? vf_div(vf_set1(1.0f), vf_from_vd(p[3]))
                                              : vf_from_vd(vd_div(vd_set1(1.0), p[3])),
                             out->seen_rows + 4 * i);
        vd_quotients(p, p[3], ndc, scalar == TL_F32);
        const vd x = vd_mul(vd_add(ndc[0], one), scale_x), y = vd_mul(vd_sub(one, ndc[1]), scale_y);
        const vd z = view->zero_to_one ? ndc[2] : vd_mul(vd_add(ndc[2], one), half);
        if (!(view->near_clip && view->far_clip))
            good = vm_and(good, vd_ge(largest, vd_abs(z)));
        if (is_snapped) {
            const vi x_fx = vi_round(x), y_fx = vi_round(y);
            good = vm_and(good, vm_and(is_narrow_lanes(x_fx), is_narrow_lanes(y_fx)));
            store_vertices(out->records + i, x_fx, y_fx, z);
        } else {
            good = vm_and(good, store_points(out->points + TL_PLACED * i, x, y, z));
        }
        for (unsigned rest = vm_bits(vm_and_not(vm_all(), good)); rest; rest &= rest - 1)
            project_one(source, i + __builtin_ctz(rest), view, out, counts);
    }
    return i;
}

TL_INLINE tl_vertex_counts project_all(const tl_source *source, int64_t first, int64_t end, const tl_view *view,
                                       const tl_projected *out, int is_snapped)
{
    tl_vertex_counts counts = {0, 0, 0};
    int64_t i = first;
    if (TL_LANES > 1 && source->scalar == TL_F32)
        i = source->matrix ? project_lanes(source, first, end, view, out, &counts, TL_F32, 1, is_snapped)
                           : project_lanes(source, first, end, view, out, &counts, TL_F32, 0, is_snapped);
    else if (TL_LANES > 1)
        i = source->matrix ? project_lanes(source, first, end, view, out, &counts, TL_F64, 1, is_snapped)
                           : project_lanes(source, first, end, view, out, &counts, TL_F64, 0, is_snapped);
    if (out->rows)
        set_inverse_w(source, out->rows, i, end, out->seen_rows);
    for (; i < end; i++)
        project_one(source, i, view, out, &counts);
    return counts;
}

static tl_vertex_counts project(const tl_source *source, int64_t first, int64_t end, const tl_view *view,
                                const tl_projected *out)
{
    return out->points ? project_all(source, first, end, view, out, 0) : project_all(source, first, end, view, out, 1);
}

#endif
