/* Vertices of a meshlet to 16 bits: transformed, divided and snapped, the bits of project.c.
 * In: a meshlet, a view, the pixel window that its vertices are measured from.  Out: pairs of 16 bits, or x and y in 32
 * bits where they do not fit; depths. */
#ifndef TL_SNAP_MESHLET_C
#define TL_SNAP_MESHLET_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "lanes/halves.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "meshlets/batch.h"

#if TL_HAS_HALVES

/* A number below 2^19, 1.5 * 2^20 added: the high word counts from here, the low word is the fraction. */
#define TL_WORDS_OF 0x1.8p20
#define TL_WORD0 0x41380000
/* Fractions of 2^-32 that are too near to a half to tell: 1/w errs by 2^-47, of a float64 w by 2^-46, and x/w is less
 * than 2^23 sub-pixels. */
#define TL_UNCERTAIN 1024

/* The row and column of one vertex as project.c rounds them, in the picture's sub-pixels. */
static void snap_exactly(const meshlet_batch *s, const tl_meshlet *m, int i, double *x, double *y)
{
    double p[4];
    for (int k = 0; k < 4; k++) {
        const float *row = s->matrix + 4 * k;
        const double *row64 = s->matrix64 + 4 * k;
        p[k] = s->is_f64
                   ? ((row64[0] * (double)m->x[i] + row64[1] * (double)m->y[i]) + row64[2] * (double)m->z[i]) + row64[3]
                   : (double)(((row[0] * m->x[i] + row[1] * m->y[i]) + row[2] * m->z[i]) + row[3]);
    }
    *x = rint((p[0] / p[3] + 1.0) * s->scale_x);
    *y = rint((1.0 - p[1] / p[3]) * s->scale_y);
}

TL_INLINE vf clip_row(const float *row, vf x, vf y, vf z)
{
    const vf sum = vf_add(vf_mul(vf_set1(row[0]), x), vf_mul(vf_set1(row[1]), y));
    return vf_add(vf_add(sum, vf_mul(vf_set1(row[2]), z)), vf_set1(row[3]));
}

TL_INLINE vd clip_row_f64(const double *row, vd x, vd y, vd z)
{
    const vd sum = vd_add(vd_mul(vd_set1(row[0]), x), vd_mul(vd_set1(row[1]), y));
    return vd_add(vd_add(sum, vd_mul(vd_set1(row[2]), z)), vd_set1(row[3]));
}

/* Sixteen vertices in clip space, transformed in float32 or in float64; returns w in float32. */
TL_INLINE vf clip_vertices(const meshlet_batch *s, const tl_meshlet *m, int first, int is_f64, vd *p)
{
    const vf x = vf_load(m->x + first), y = vf_load(m->y + first), z = vf_load(m->z + first);
    if (is_f64) {
        for (int k = 0; k < 4; k++)
            p[k] = clip_row_f64(s->matrix64 + 4 * k, vd_from_vf(x), vd_from_vf(y), vd_from_vf(z));
        return vf_from_vd(p[3]);
    }
    const vf w = clip_row(s->matrix + 12, x, y, z);
    for (int k = 0; k < 3; k++)
        p[k] = vd_from_vf(clip_row(s->matrix + 4 * k, x, y, z));
    p[3] = vd_from_vf(w);
    return w;
}

/* z/w, correctly rounded, where 1/w is known to 2^-47: of float32 numbers as one_quotient in lanes_avx512.h. */
TL_INLINE vd depth_quotient(vd z, vd w, vd inverse, int is_f64)
{
    const vd q = vd_mul(z, inverse);
    return is_f64 ? vd_div(z, w) : vd_fma(vd_fnma(q, w, z), inverse, q);
}

/* Snaps the vertices of a slot, as 16-bit pairs or as 32-bit numbers.  Returns the bits of all numbers before they are
 * shifted to the finer grid, which tell whether they fit. */
TL_INLINE vi snap_slot(meshlet_batch *s, meshlet_slot *slot, int is_wide, int is_f64)
{
    const tl_meshlet *m = slot->meshlet;
    const double unit = (double)(TL_PX >> s->fine_bits);
    const double left = unit * (double)slot->at.left_px, below = unit * (double)slot->at.below_px;
    const vd scale_x = vd_set1(s->scale_x), scale_y = vd_set1(s->scale_y), one = vd_set1(1.0), half = vd_set1(0.5);
    const vd add_x = vd_set1(s->x_fx - left + 0.5 + TL_WORDS_OF), add_y = vd_set1(below - s->y_fx + 0.5 + TL_WORDS_OF);
    vi any = vi_set1(0);
    uint64_t uncertain = 0;
#pragma GCC unroll 4
    for (int k = 0; k < 4; k++) {
        vd p[4];
        const vf w32 = clip_vertices(s, m, 16 * k, is_f64, p);
        vd inverse = vd_from_vf(vf_div(vf_set1(1.0f), w32));
        inverse = vd_fma(inverse, vd_fnma(p[3], inverse, one), inverse); /* 1/w to 2^-47, of float64 to 2^-46 */
        const vd q = depth_quotient(p[2], p[3], inverse, is_f64);
        vi x_fx, x_rest, y_fx, y_rest, z_low, z_high;
        vd_part_words(vd_fma(vd_mul(p[0], inverse), scale_x, add_x), &x_rest, &x_fx);
        vd_part_words(vd_fma(vd_mul(p[1], inverse), scale_y, add_y), &y_rest, &y_fx);
        vd_part_words(s->is_zero_to_one ? q : vd_mul(vd_add(q, one), half), &z_low, &z_high);
        x_fx = vi_sub(x_fx, vi_set1(TL_WORD0)), y_fx = vi_sub(y_fx, vi_set1(TL_WORD0));
        const vi near_by = vi_set1(TL_UNCERTAIN), range = vi_set1(2 * TL_UNCERTAIN);
        uncertain |= (uint64_t)vm_bits(vm_or(vi_lt_unsigned(vi_add(x_rest, near_by), range),
                                             vi_lt_unsigned(vi_add(y_rest, near_by), range)))
                     << 16 * k;
        any = vi_or_three(any, x_fx, y_fx);
        if (is_wide) { /* within 2^19, shifted: there the words are right, and areas fit */
            const vi reach = vi_set1(1 << 19 >> s->fine_bits), range = vi_set1((1 << 20 >> s->fine_bits) - 1);
            s->is_too_far |=
                vm_any(vm_or(vi_gt_unsigned(vi_add(x_fx, reach), range), vi_gt_unsigned(vi_add(y_fx, reach), range)));
        }
        x_fx = vi_shift_left(x_fx, s->fine_bits), y_fx = vi_shift_left(y_fx, s->fine_bits);
        if (is_wide)
            vi_store_aligned(s->wide_x + 16 * k, x_fx), vi_store_aligned(s->wide_y + 16 * k, y_fx);
        else
            slot->pairs[k] = vi_or(x_fx, vi_shift_left(y_fx, 16));
        vi_store_aligned(slot->z_low + 16 * k, z_low);
        vi_store_aligned(slot->z_high + 16 * k, z_high);
    }
    for (; __builtin_expect(uncertain != 0, 0); uncertain &= uncertain - 1) { /* three vertices in a million */
        const int i = __builtin_ctzll(uncertain);
        double x_exact, y_exact;
        snap_exactly(s, m, i, &x_exact, &y_exact);
        x_exact += s->x_fx - s->scale_x - left, y_exact = below - (s->y_fx - s->scale_y) - y_exact;
        if (!(fabs(x_exact) < 0x1p28 && fabs(y_exact) < 0x1p28))
            continue; /* `any` says so */
        const int32_t x = (int32_t)x_exact, y = (int32_t)y_exact;
        const int32_t x_px = (int32_t)((uint32_t)x << s->fine_bits), y_px = (int32_t)((uint32_t)y << s->fine_bits);
        any = vi_or(any, vi_set1(x | y));
        const uint32_t pair = (uint32_t)x_px | (uint32_t)y_px << 16;
        if (is_wide)
            s->wide_x[i] = x_px, s->wide_y[i] = y_px;
        else /* compilers take int32_t for no part of a vector */
            memcpy((char *)slot->pairs + sizeof pair * (size_t)i, &pair, sizeof pair);
    }
    return any;
}

#endif
#endif
