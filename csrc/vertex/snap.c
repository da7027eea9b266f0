/* Snap: pixel coordinates to fixed point, once, ties to even.  In: vertices in pixels.  Out: vertex records. */
#ifndef TL_SNAP_C
#define TL_SNAP_C

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "vertex/fixed.h"

/* float32 widens to float64 without loss, and a power of two scales without loss: rint is the only rounding. */
static void snap_float(const tl_source *source, int64_t i, double scale, int with_depth, tl_vertex *out, tl_wide *wide,
                       tl_vertex_counts *counts)
{
    const int64_t at = i * source->n_components;
    const float *v32 = (const float *)source->data + at;
    const double *v64 = (const double *)source->data + at;
    const int is32 = source->scalar == TL_F32;
    const double x_px = is32 ? (double)v32[0] : v64[0], y_px = is32 ? (double)v32[1] : v64[1];
    const double z = !with_depth ? 0.0 : is32 ? (double)v32[2] : v64[2];
    store_vertex(rint(x_px * scale), rint(y_px * scale), z, i, out, wide, counts);
}

/* Integer pixels are shifted as integers: a float64 would lose the last bits beyond 2^53. */
static void snap_integer(const tl_source *source, int64_t i, int subpixel_bits, int with_depth, tl_vertex *out,
                         tl_wide *wide, tl_vertex_counts *counts)
{
    const int64_t *v = (const int64_t *)source->data + i * source->n_components;
    const int64_t narrow = ((int64_t)1 << 30 >> subpixel_bits) - 1, limit = ((int64_t)1 << 62 >> subpixel_bits) - 1;
    const int64_t x = v[0], y = v[1], unit = (int64_t)1 << subpixel_bits;
    const double z = with_depth ? (double)v[2] : 0.0;
    if (x >= -narrow && x <= narrow && y >= -narrow && y <= narrow) {
        out[i] = (tl_vertex){(int32_t)(x * unit), (int32_t)(y * unit), z};
    } else if (x >= -limit && x <= limit && y >= -limit && y <= limit) {
        out[i] = (tl_vertex){TL_SPECIAL, TL_WIDE, z};
        counts->n_wide++;
        if (wide)
            wide[i] = (tl_wide){x * unit, y * unit};
    } else {
        out[i] = (tl_vertex){TL_SPECIAL, TL_BAD, z};
        counts->n_bad++;
    }
}

/* Whether |a| < 2^30; false for INT32_MIN. */
TL_INLINE vm is_narrow_lanes(vi a)
{
    const vi limit = vi_set1((1 << 30) - 1);
    return vm_and_not(vm_all(), vi_gt_unsigned(vi_add(a, limit), vi_add(limit, limit)));
}

/* Loads x, y and z of TL_LANES float vertices. */
TL_INLINE void pixel_lanes(const tl_source *source, int64_t i, vd *v)
{
    const int stride = source->n_components;
    if (source->scalar == TL_F64) {
        load_columns_f64((const double *)source->data + i * stride, stride, v);
        return;
    }
    vf v32[4];
    load_columns_f32((const float *)source->data + i * stride, stride, v32);
    for (int k = 0; k < 3; k++)
        v[k] = vd_from_vf(v32[k]);
}

static tl_vertex_counts snap(const tl_source *source, int64_t first, int64_t end, int subpixel_bits, int with_depth,
                             tl_vertex *out, tl_wide *wide)
{
    tl_vertex_counts counts = {0, 0, 0};
    const double scale = (double)(1 << subpixel_bits);
    int64_t i = first;
    with_depth = with_depth && source->n_components > 2;
    /* loads read two numbers past the last row */
    for (; TL_LANES > 1 && source->scalar != TL_I64 && i + TL_LANES <= end && i + TL_LANES < source->n; i += TL_LANES) {
        vd v[4];
        pixel_lanes(source, i, v);
        const vd z = with_depth ? v[2] : vd_set1(0.0);
        const vi x = vi_round(vd_mul(v[0], vd_set1(scale))), y = vi_round(vd_mul(v[1], vd_set1(scale)));
        const vm good = vm_and(vd_ge(vd_set1(FLT_MAX), vd_abs(z)), vm_and(is_narrow_lanes(x), is_narrow_lanes(y)));
        store_vertices(out + i, x, y, z);
        for (unsigned rest = vm_bits(vm_and_not(vm_all(), good)); rest; rest &= rest - 1)
            snap_float(source, i + __builtin_ctz(rest), scale, with_depth, out, wide, &counts);
    }
    for (; i < end; i++) {
        if (source->scalar == TL_I64)
            snap_integer(source, i, subpixel_bits, with_depth, out, wide, &counts);
        else
            snap_float(source, i, scale, with_depth, out, wide, &counts);
    }
    return counts;
}

static int64_t first_bad_row(const int32_t *triangles, int64_t n_triangles, int64_t n_vertices)
{
    const uint32_t n = (uint32_t)n_vertices;
    const int64_t chunk = 3 * 1024;
    for (int64_t first = 0; first < 3 * n_triangles; first += chunk) {
        const int64_t end = first + chunk < 3 * n_triangles ? first + chunk : 3 * n_triangles;
        uint32_t bad = 0; /* no branch inside, so that the compiler vectorises */
        for (int64_t i = first; i < end; i++)
            bad |= (uint32_t)((uint32_t)triangles[i] >= n);
        for (int64_t i = first; bad && i < end; i++)
            if ((uint32_t)triangles[i] >= n)
                return i / 3;
    }
    return -1;
}

static int64_t narrow_triangles(const int64_t *restrict triangles, int64_t n_triangles, int64_t n_vertices,
                                int32_t *restrict out)
{
    const uint64_t n = (uint64_t)n_vertices;
    const int64_t chunk = 3 * 1024;
    for (int64_t first = 0; first < 3 * n_triangles; first += chunk) {
        const int64_t end = first + chunk < 3 * n_triangles ? first + chunk : 3 * n_triangles;
        uint64_t bad = 0; /* no branch inside, so that the compiler vectorises */
        for (int64_t i = first; i < end; i++) {
            bad |= (uint64_t)((uint64_t)triangles[i] >= n);
            out[i] = (int32_t)triangles[i];
        }
        for (int64_t i = first; bad && i < end; i++)
            if ((uint64_t)triangles[i] >= n)
                return i / 3;
        if (bad) /* another thread has changed the index since it was written to `out` */
            return first / 3;
    }
    return -1;
}

static int64_t first_bad(const tl_vertex *vertices, int64_t n_vertices, const int32_t *triangles, int64_t n_triangles)
{
    int64_t first = -1;
    for (int64_t i = 0; i < 3 * n_triangles; i++) {
        const int32_t corner = corner_within(triangles[i], n_vertices);
        const tl_vertex v = vertices[corner];
        if (v.x_fx == TL_SPECIAL && v.y_fx == TL_BAD && (first < 0 || corner < first))
            first = corner;
    }
    return first;
}

#endif
