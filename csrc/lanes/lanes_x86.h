/* Lanes that AVX2 and AVX-512 share: TL_MM(add_ps) is the intrinsic of the included width.
 * In: lanes_avx2.h or lanes_avx512.h, which include this file.  Out: the names of lanes.h that they lack. */
#ifndef TL_LANES_X86_H
#define TL_LANES_X86_H

#ifdef TL_MM /* if not, an editor reads this file alone */

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
TL_INLINE vi vi_high_half(vi a) { return TL_MM(srli_epi32)(a, 16); }
TL_INLINE vi vi_upper_bytes(vi a) { return TL_MM(srli_epi16)(a, 8); }
TL_INLINE vi vi_add_bytes(vi a, vi b) { return TL_MM(adds_epu8)(a, b); }
TL_INLINE vi vi_max_bytes(vi a, vi b) { return TL_MM(max_epu8)(a, b); }
TL_INLINE vi vi_min_bytes(vi a, vi b) { return TL_MM(min_epu8)(a, b); }
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
/* TL_LANES words of 64 bits; vw_add_range sets the bits [begin, end) that are in the pattern; begin, end >= 0. */
typedef struct {
    vi lo, hi;
} vw;
TL_INLINE vw vw_load(const uint64_t *p)
{
    return (vw){vi_load((const int32_t *)p), vi_load((const int32_t *)(p + TL_LANES / 2))};
}
TL_INLINE void vw_store(uint64_t *p, vw a)
{
    vi_store((int32_t *)p, a.lo), vi_store((int32_t *)(p + TL_LANES / 2), a.hi);
}
TL_INLINE vi bit_range_64(half_vi begin, half_vi end)
{
    const vi ones = TL_MM(set1_epi32)(-1);
    return TL_SI(andnot)(TL_MM(sllv_epi64)(ones, TL_MM(cvtepu32_epi64)(end)),
                         TL_MM(sllv_epi64)(ones, TL_MM(cvtepu32_epi64)(begin)));
}
TL_INLINE vw vw_add_range(vw a, vi begin, vi end, uint64_t pattern)
{
    const vi every = set1_64(pattern), lo = bit_range_64(lower_half(begin), lower_half(end));
    const vi hi = bit_range_64(upper_half(begin), upper_half(end));
    return (vw){vi_or(a.lo, vi_and(lo, every)), vi_or(a.hi, vi_and(hi, every))};
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
TL_INLINE vi vi_low_bits(vd a) { return evens_of(a); }
TL_INLINE vi vi_nearest(vf a) { return TL_MM(cvtps_epi32)(a); }
TL_INLINE vf vf_last_of(vf a, int n) { return n == 4 ? TL_MM(permute_ps)(a, 0xff) : TL_MM(movehdup_ps)(a); }
TL_INLINE vf vf_of_bits(vi a) { return TL_FROM_SI(ps)(a); }
TL_INLINE vi vi_bits_of_vf(vf a) { return TL_SI(castps)(a); }
TL_INLINE vi vi_round(vd a) { return join_halves(TL_MM(cvtpd_epi32)(a.lo), TL_MM(cvtpd_epi32)(a.hi)); }
TL_INLINE vd vd_from_vi(vi a) { return (vd){TL_MM(cvtepi32_pd)(lower_half(a)), TL_MM(cvtepi32_pd)(upper_half(a))}; }
TL_INLINE vd vd_load(const double *p) { return (vd){TL_MM(loadu_pd)(p), TL_MM(loadu_pd)(p + TL_LANES / 2)}; }
TL_INLINE void vd_store(double *p, vd a) { TL_MM(storeu_pd)(p, a.lo), TL_MM(storeu_pd)(p + TL_LANES / 2, a.hi); }
TL_INLINE vd vd_set1(double a) { return (vd){TL_MM(set1_pd)(a), TL_MM(set1_pd)(a)}; }
TL_INLINE vd vd_add(vd a, vd b) { return (vd){TL_MM(add_pd)(a.lo, b.lo), TL_MM(add_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_sub(vd a, vd b) { return (vd){TL_MM(sub_pd)(a.lo, b.lo), TL_MM(sub_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_mul(vd a, vd b) { return (vd){TL_MM(mul_pd)(a.lo, b.lo), TL_MM(mul_pd)(a.hi, b.hi)}; }
TL_INLINE vd vd_sqrt(vd a) { return (vd){TL_MM(sqrt_pd)(a.lo), TL_MM(sqrt_pd)(a.hi)}; }
TL_INLINE vd vd_div(vd a, vd b) { return (vd){TL_MM(div_pd)(a.lo, b.lo), TL_MM(div_pd)(a.hi, b.hi)}; }
/* a[k] / b for three a, each correctly rounded, for |b| and |a / b| within 2^+-500: one division.  The first step makes
 * the quotient faithful, the second correct.  For float32 numbers one step suffices: it errs by less than 2^-100 of the
 * quotient, which is at least 2^-77 from the middle of two float64.  Based on: P. Markstein, Computation of elementary
 * functions on the IBM RISC System/6000 processor, 1990. */
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

/* Rows of memory as columns: plain loads of rows and transposes in registers, for hardware gathers are three times as
 * slow.  Indices are unsigned. */

/* Loads 16 bytes at base + scale * i[step * lane], of every fourth lane. */
TL_INLINE vi load_quarter(const void *base, int scale, int step, const int32_t *i)
{
    __m128i rows[TL_LANES / 4];
    for (int k = 0; k < TL_LANES / 4; k++) {
        uint64_t at = (uint32_t)i[4 * step * k];
        __asm__("" : "+r"(at)); /* else GCC loads it into a vector and extracts it from there */
        rows[k] = _mm_loadu_si128((const __m128i *)((const char *)base + at * (uint64_t)scale));
    }
    return join_quarters(rows);
}
TL_INLINE void load_four_quarters(const void *base, int scale, int step, const int32_t *i, vi *rows)
{
    for (int k = 0; k < 4; k++)
        rows[k] = load_quarter(base, scale, step, i + step * k);
}
TL_INLINE void load_vertices_by(int step, const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    vi row[4];
    load_four_quarters(v, sizeof *v, step, first, row);
    const vi ab = TL_MM(unpacklo_epi32)(row[0], row[1]), cd = TL_MM(unpacklo_epi32)(row[2], row[3]);
    *x = TL_MM(unpacklo_epi64)(ab, cd);
    *y = TL_MM(unpackhi_epi64)(ab, cd);
    z->even = TL_FROM_SI(pd)(TL_MM(unpackhi_epi64)(row[0], row[1]));
    z->odd = TL_FROM_SI(pd)(TL_MM(unpackhi_epi64)(row[2], row[3]));
}
TL_INLINE void store_vertices(tl_vertex *v, vi x, vi y, vd z)
{
    const vd xy = interleave(x, y);
    store_half(v, xy.lo, z.lo);
    store_half(v + TL_LANES / 2, xy.hi, z.hi);
}
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    vi rows[4];
    load_four_quarters(base, scale, 1, i, rows);
    transpose_quads(rows, c);
}
TL_INLINE void columns_of_rows_f32(const float *p, int stride, vf *columns)
{
    vi rows[4], c[4];
    for (int k = 0; k < 4; k++) {
        __m128i quarters[TL_LANES / 4];
        for (int j = 0; j < TL_LANES / 4; j++)
            quarters[j] = _mm_loadu_si128((const __m128i *)(p + (k + 4 * j) * stride));
        rows[k] = join_quarters(quarters);
    }
    transpose_quads(rows, c);
    for (int k = 0; k < 4; k++)
        columns[k] = vf_of_bits(c[k]);
}
#define TL_ROWS_APART (TL_LANES / 2 - 4) /* between the two rows of load_rows_f64 */
/* Turns TL_LANES / 2 rows of four into columns, or back. */
TL_INLINE void transpose_rows(const wd *row, wd *c)
{
    for (int k = 0; k < 2; k++) {
        const wd even = k ? TL_MM(unpackhi_pd)(row[0], row[1]) : TL_MM(unpacklo_pd)(row[0], row[1]);
        const wd odd = k ? TL_MM(unpackhi_pd)(row[2], row[3]) : TL_MM(unpacklo_pd)(row[2], row[3]);
        c[k] = front_pairs(even, odd);
        c[k + 2] = back_pairs(even, odd);
    }
}
TL_INLINE void vd_load_records_by(int step, const double *base, int64_t stride, const int32_t *i, vd *c)
{
    wd half[2][4];
    for (int part = 0; part < 2; part++, i += step * TL_LANES / 2) {
        wd row[4];
        for (int k = 0; k < 4; k++)
            row[k] = load_rows_f64(base + i[step * k] * stride, base + i[step * (k + TL_ROWS_APART)] * stride);
        transpose_rows(row, half[part]);
    }
    for (int k = 0; k < 4; k++)
        c[k] = (vd){half[0][k], half[1][k]};
}
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c)
{
    vd_load_records_by(1, base, stride, i, c);
}
TL_INLINE void vd_load_places(const double *base, const int32_t *first, vd *x, vd *y, vd *z, vi *a, vi *b)
{
    vd c[4];
    vd_load_records_by(3, base, 4, first, c);
    *x = c[0], *y = c[1], *z = c[2], *a = evens_of(c[3]), *b = odds_of(c[3]);
}
TL_INLINE void load_columns_f64(const double *p, int stride, vd *columns)
{
    static const int32_t rows[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    vd_load_records_by(1, p, stride, rows, columns);
}
TL_INLINE void vd_store_quads(double *p, int64_t stride, const vd *c)
{
    for (int part = 0; part < 2; part++, p += TL_LANES / 2 * stride) {
        wd half[4], row[4];
        for (int k = 0; k < 4; k++)
            half[k] = part ? c[k].hi : c[k].lo;
        transpose_rows(half, row);
        for (int k = 0; k < 4; k++)
            store_rows_f64(p + k * stride, p + (k + TL_ROWS_APART) * stride, row[k]);
    }
}
TL_INLINE void vd_store_places(double *p, vd x, vd y, vd z, vi a, vi b)
{
    vd_store_quads(p, 4, (const vd[]){x, y, z, interleave(a, b)});
}
/* Pairs of doubles at base + 8 * stride * first[3 * lane], of every other lane. */
TL_INLINE wd load_every_other_pair(const double *base, int stride, const int32_t *first)
{
    __m128d pairs[TL_LANES / 4];
    for (int k = 0; k < TL_LANES / 4; k++)
        pairs[k] = _mm_loadu_pd(base + (int64_t)first[6 * k] * stride);
    return join_pairs(pairs);
}
TL_INLINE void vd_load_pairs(const double *base, int stride, const int32_t *first, vd *x, vd *y)
{
    const int32_t *const back = first + 3 * TL_LANES / 2;
    const wd even = load_every_other_pair(base, stride, first), odd = load_every_other_pair(base, stride, first + 3);
    const wd even2 = load_every_other_pair(base, stride, back), odd2 = load_every_other_pair(base, stride, back + 3);
    *x = (vd){TL_MM(unpacklo_pd)(even, odd), TL_MM(unpacklo_pd)(even2, odd2)};
    *y = (vd){TL_MM(unpackhi_pd)(even, odd), TL_MM(unpackhi_pd)(even2, odd2)};
}
/* Loads pairs of float32 at base + 8 * i[lane]; and stores those of TL_LANES consecutive pixels. */
TL_INLINE wd load_half_pairs(const char *base, const int32_t *i)
{
    __m128d pairs[TL_LANES / 4];
    for (int k = 0; k < TL_LANES / 4; k++)
        pairs[k] = _mm_loadh_pd(_mm_load_sd((const double *)(base + (int64_t)i[2 * k] * 8)),
                                (const double *)(base + (int64_t)i[2 * k + 1] * 8));
    return join_pairs(pairs);
}
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c)
{
    const vd pairs = {load_half_pairs(base, i), load_half_pairs(base, i + TL_LANES / 2)};
    c[0] = vf_of_bits(evens_of(pairs)), c[1] = vf_of_bits(odds_of(pairs));
}
TL_INLINE void vf_store_pairs(float *p, const vf *c)
{
    const vd pairs = interleave(vi_bits_of_vf(c[0]), vi_bits_of_vf(c[1]));
    TL_MM(storeu_pd)((double *)p, pairs.lo), TL_MM(storeu_pd)((double *)p + TL_LANES / 2, pairs.hi);
}
/* For shading. */
TL_INLINE vf vf_load(const float *p) { return TL_MM(loadu_ps)(p); }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return TL_MM(fmadd_ps)(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return TL_MM(min_ps)(a, b); }
TL_INLINE vf vf_max(vf a, vf b) { return TL_MM(max_ps)(a, b); }
TL_INLINE wd bits_minus(wd a, uint64_t sum, uint64_t mask)
{
    const vi b = vi_and(TL_SI(castpd)(a), set1_64(mask));
    return TL_FROM_SI(pd)(TL_MM(sub_epi64)(set1_64(sum), b));
}
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask)
{
    return (vd){bits_minus(a.lo, sum, mask), bits_minus(a.hi, sum, mask)};
}
TL_INLINE vd vd_or(vd a, vd b) { return (vd){TL_MM(or_pd)(a.lo, b.lo), TL_MM(or_pd)(a.hi, b.hi)}; }

#endif
#endif
