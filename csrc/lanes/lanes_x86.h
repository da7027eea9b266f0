/* Lanes that AVX2 and AVX-512 share: TL_MM(add_ps) is the intrinsic of the width at hand.
 * In: lanes_avx2.h or lanes_avx512.h, which include this file.  Out: the names of lanes.h that they do not have. */
#ifndef TL_LANES_X86_H
#define TL_LANES_X86_H

#ifdef TL_MM /* else it is read by itself */

TL_INLINE vi vi_set1(int32_t a) { return TL_MM(set1_epi32)(a); }
TL_INLINE vi vi_add(vi a, vi b) { return TL_MM(add_epi32)(a, b); }
TL_INLINE vi vi_sub(vi a, vi b) { return TL_MM(sub_epi32)(a, b); }
TL_INLINE vi vi_mul(vi a, vi b) { return TL_MM(mullo_epi32)(a, b); }
TL_INLINE vi vi_min(vi a, vi b) { return TL_MM(min_epi32)(a, b); }
TL_INLINE vi vi_max(vi a, vi b) { return TL_MM(max_epi32)(a, b); }
TL_INLINE vi vi_or(vi a, vi b) { return TL_SI(or)(a, b); }
TL_INLINE vi vi_xor(vi a, vi b) { return TL_SI(xor)(a, b); }
TL_INLINE vi vi_and(vi a, vi b) { return TL_SI (and)(a, b); }
TL_INLINE vi vi_shift_left(vi a, int n) { return TL_MM(sll_epi32)(a, _mm_cvtsi32_si128(n)); }
TL_INLINE vi vi_shift_right(vi a, int n) { return TL_MM(sra_epi32)(a, _mm_cvtsi32_si128(n)); }
TL_INLINE vi vi_mul_halves(vi a, vi b) { return TL_MM(mullo_epi16)(a, b); }
TL_INLINE vi vi_mul_high_halves(vi a, vi b) { return TL_MM(mulhi_epu16)(a, b); }
TL_INLINE vi vi_scale_halves(vi a, vi b) { return TL_MM(mulhrs_epi16)(a, b); }
TL_INLINE vi vi_add_halves(vi a, vi b) { return TL_MM(add_epi16)(a, b); }
TL_INLINE vi vi_sub_halves(vi a, vi b) { return TL_MM(sub_epi16)(a, b); }
TL_INLINE vi vi_upper_bytes(vi a) { return TL_MM(srli_epi16)(a, 8); }
TL_INLINE vi vi_add_bytes(vi a, vi b) { return TL_MM(adds_epu8)(a, b); }
TL_INLINE vi vi_max_bytes(vi a, vi b) { return TL_MM(max_epu8)(a, b); }
TL_INLINE vi vi_min_bytes(vi a, vi b) { return TL_MM(min_epu8)(a, b); }
TL_INLINE void vi_stream(int32_t *p, vi a) { TL_SI(stream)((void *)p, a); }
TL_INLINE void end_stream(void) { _mm_sfence(); }
/* Four int32. */
typedef __m128i v4;
TL_INLINE v4 v4_zero(void) { return _mm_setzero_si128(); }
TL_INLINE v4 v4_load(const int32_t *p) { return _mm_loadu_si128((const __m128i *)p); }
TL_INLINE void v4_store(int32_t *p, v4 a) { _mm_storeu_si128((__m128i *)p, a); }
TL_INLINE v4 v4_add(v4 a, v4 b) { return _mm_add_epi32(a, b); }
TL_INLINE v4 v4_or(v4 a, v4 b) { return _mm_or_si128(a, b); }
/* the 4x4 transposes within each 128 bits, their own inverse */
TL_INLINE void transpose_quads(const vi *a, vi *b)
{
    const vi low01 = TL_MM(unpacklo_epi32)(a[0], a[1]), high01 = TL_MM(unpackhi_epi32)(a[0], a[1]);
    const vi low23 = TL_MM(unpacklo_epi32)(a[2], a[3]), high23 = TL_MM(unpackhi_epi32)(a[2], a[3]);
    b[0] = TL_MM(unpacklo_epi64)(low01, low23);
    b[1] = TL_MM(unpackhi_epi64)(low01, low23);
    b[2] = TL_MM(unpacklo_epi64)(high01, high23);
    b[3] = TL_MM(unpackhi_epi64)(high01, high23);
}
TL_INLINE void vi_load_quads(const int32_t *p, vi *c)
{
    const vi rows[4] = {vi_load(p), vi_load(p + TL_LANES), vi_load(p + 2 * TL_LANES), vi_load(p + 3 * TL_LANES)};
    transpose_quads(rows, c);
}
TL_INLINE void vi_store_quads(int32_t *p, const vi *c)
{
    vi rows[4];
    transpose_quads(c, rows);
    for (int k = 0; k < 4; k++)
        vi_store(p + TL_LANES * k, rows[k]);
}
TL_INLINE vw vw_zero(void) { return (vw){TL_SI(setzero)(), TL_SI(setzero)()}; }
/* Numbers with bits [begin, end) set, none where begin >= end; begin >= 0, end in 0..31. */
TL_INLINE vi vi_bit_ranges(vi begin, vi end)
{
    const vi ones = TL_MM(set1_epi32)(-1);
    return TL_SI(andnot)(TL_MM(sllv_epi32)(ones, end), TL_MM(sllv_epi32)(ones, begin));
}
TL_INLINE vf vf_set1(float a) { return TL_MM(set1_ps)(a); }
TL_INLINE vf vf_add(vf a, vf b) { return TL_MM(add_ps)(a, b); }
TL_INLINE vf vf_sub(vf a, vf b) { return TL_MM(sub_ps)(a, b); }
TL_INLINE vf vf_mul(vf a, vf b) { return TL_MM(mul_ps)(a, b); }
TL_INLINE vf vf_div(vf a, vf b) { return TL_MM(div_ps)(a, b); }
TL_INLINE vf vf_sqrt(vf a) { return TL_MM(sqrt_ps)(a); }
TL_INLINE vf vf_from_vi(vi a) { return TL_MM(cvtepi32_ps)(a); }
TL_INLINE void vf_store(float *p, vf a) { TL_MM(storeu_ps)(p, a); }
TL_INLINE vi vi_nearest(vf a) { return TL_MM(cvtps_epi32)(a); }
TL_INLINE vf vf_last_of(vf a, int n) { return n == 4 ? TL_MM(permute_ps)(a, 0xff) : TL_MM(movehdup_ps)(a); }
TL_INLINE vi vi_bits_of_vf(vf a) { return TL_SI(castps)(a); }
TL_INLINE vd vd_set1(double a) { return (vd){TL_MM(set1_pd)(a), TL_MM(set1_pd)(a)}; }
TL_INLINE vd vd_add(vd a, vd b) { return (vd){TL_MM(add_pd)(a.lo, b.lo), TL_MM(add_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_sub(vd a, vd b) { return (vd){TL_MM(sub_pd)(a.lo, b.lo), TL_MM(sub_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_mul(vd a, vd b) { return (vd){TL_MM(mul_pd)(a.lo, b.lo), TL_MM(mul_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_div(vd a, vd b) { return (vd){TL_MM(div_pd)(a.lo, b.lo), TL_MM(div_pd)(a.hi, b.hi)}; }
/* a[k] / b for three a, each correctly rounded, for |b| and |a / b| within 2^+-500: one division.  The first step makes
 * the quotient faithful, the second correct.  Of float32 numbers one step is enough: it errs by less than 2^-100 of the
 * quotient, which is no nearer than 2^-77 to the middle of two float64.  Based on: P. Markstein, Computation of
 * elementary functions on the IBM RISC System/6000 processor, 1990. */
TL_INLINE wd one_quotient(wd a, wd b, wd inverse, int are_f32)
{
    wd q = TL_MM(mul_pd)(a, inverse);
    if (!are_f32)
        q = TL_MM(fmadd_pd)(TL_MM(fnmadd_pd)(q, b, a), inverse, q);
    return TL_MM(fmadd_pd)(TL_MM(fnmadd_pd)(q, b, a), inverse, q);
}
TL_INLINE void vd_quotients(const vd *a, vd b, vd *q, int are_f32)
{
    const vd inverse = vd_div(vd_set1(1.0), b);
    for (int k = 0; k < 3; k++)
        q[k] = (vd){one_quotient(a[k].lo, b.lo, inverse.lo, are_f32), one_quotient(a[k].hi, b.hi, inverse.hi, are_f32)};
}
TL_INLINE vd vd_min(vd a, vd b) { return (vd){TL_MM(min_pd)(a.lo, b.lo), TL_MM(min_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_max(vd a, vd b) { return (vd){TL_MM(max_pd)(a.lo, b.lo), TL_MM(max_pd)(a.hi, b.hi)}; }
TL_INLINE void load_vertices_by(int step, const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    const vi a = load_quarter(step, v, first), b = load_quarter(step, v, first + step);
    const vi c = load_quarter(step, v, first + 2 * step), d = load_quarter(step, v, first + 3 * step);
    const vi ab = TL_MM(unpacklo_epi32)(a, b), cd = TL_MM(unpacklo_epi32)(c, d);
    *x = TL_MM(unpacklo_epi64)(ab, cd);
    *y = TL_MM(unpackhi_epi64)(ab, cd);
    z->even = TL_FROM_SI(pd)(TL_MM(unpackhi_epi64)(a, b));
    z->odd = TL_FROM_SI(pd)(TL_MM(unpackhi_epi64)(c, d));
}
TL_INLINE void load_vertices(const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    load_vertices_by(3, v, first, x, y, z);
}
TL_INLINE void load_columns_f64(const double *p, int stride, vd *columns)
{
    wd low[4], high[4];
    half_columns_f64(p, stride, low);
    half_columns_f64(p + TL_LANES / 2 * stride, stride, high);
    for (int k = 0; k < 4; k++)
        columns[k] = (vd){low[k], high[k]};
}
/* For shading. */
TL_INLINE vf vf_load(const float *p) { return TL_MM(loadu_ps)(p); }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return TL_MM(fmadd_ps)(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return TL_MM(min_ps)(a, b); }
TL_INLINE vf vf_max(vf a, vf b) { return TL_MM(max_ps)(a, b); }
TL_INLINE vi vi_rint(vf a) { return TL_MM(cvtps_epi32)(a); }
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask)
{
    return (vd){bits_minus(a.lo, sum, mask), bits_minus(a.hi, sum, mask)};
}
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    const vi rows[4] = {load_part_of_records(base, scale, i), load_part_of_records(base, scale, i + 1),
                        load_part_of_records(base, scale, i + 2), load_part_of_records(base, scale, i + 3)};
    transpose_quads(rows, c);
}
TL_INLINE void vi_load_rows(const void *base, const int32_t *i, vi *c)
{
    const vi rows[4] = {load_part_of_rows(base, i), load_part_of_rows(base, i + 1), load_part_of_rows(base, i + 2),
                        load_part_of_rows(base, i + 3)};
    transpose_quads(rows, c);
}
TL_INLINE vd vd_or(vd a, vd b) { return (vd){TL_MM(or_pd)(a.lo, b.lo), TL_MM(or_pd)(a.hi, b.hi)}; }

#endif
#endif
