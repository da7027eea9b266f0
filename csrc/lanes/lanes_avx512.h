/* Sixteen lanes, masks in mask registers. */
#ifndef TL_LANES_AVX512_H
#define TL_LANES_AVX512_H

#include <immintrin.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"

#define TL_LANES 16
#define TL_MM(name) _mm512_##name
#define TL_SI(name) _mm512_##name##_si512
#define TL_FROM_SI(type) _mm512_castsi512_##type

typedef __m512i vi;
typedef __m512 vf;
typedef __m512d wd;
typedef struct {
    wd lo, hi;
} vd;
typedef __mmask16 vm;

/* Half of the lanes, and one number of 64 bits in all of them. */
typedef __m256i half_vi;
TL_INLINE half_vi lower_half(vi a) { return _mm512_castsi512_si256(a); }
TL_INLINE half_vi upper_half(vi a) { return _mm512_extracti64x4_epi64(a, 1); }
TL_INLINE vi join_halves(half_vi low, half_vi high) { return _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1); }
TL_INLINE vi set1_64(uint64_t a) { return _mm512_set1_epi64((long long)a); }

TL_INLINE vi vi_load(const int32_t *p) { return _mm512_loadu_si512(p); }
TL_INLINE void vi_store(int32_t *p, vi a) { _mm512_storeu_si512(p, a); }
TL_INLINE vi vi_iota(void) { return _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }
TL_INLINE vm vi_gt(vi a, vi b) { return _mm512_cmpgt_epi32_mask(a, b); }
TL_INLINE vm vi_gt_unsigned(vi a, vi b) { return _mm512_cmpgt_epu32_mask(a, b); }
TL_INLINE vm vi_eq(vi a, vi b) { return _mm512_cmpeq_epi32_mask(a, b); }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return _mm512_mask_mov_epi32(b, m, a); }
/* compress in registers and store whole: a compress-store to memory is three times as slow */
TL_INLINE void vi_pack(int32_t *p, vm m, vi a) { _mm512_storeu_si512(p, _mm512_maskz_compress_epi32(m, a)); }
TL_INLINE vi vi_load_masked(vm m, const int32_t *p) { return _mm512_maskz_loadu_epi32(m, p); }
TL_INLINE void vi_store_masked(int32_t *p, vm m, vi a) { _mm512_mask_storeu_epi32(p, m, a); }
TL_INLINE vi vi_prefix_sum(vi a)
{
    const vi zero = _mm512_setzero_si512();
    a = _mm512_add_epi32(a, _mm512_alignr_epi32(a, zero, 15));
    a = _mm512_add_epi32(a, _mm512_alignr_epi32(a, zero, 14));
    a = _mm512_add_epi32(a, _mm512_alignr_epi32(a, zero, 12));
    return _mm512_add_epi32(a, _mm512_alignr_epi32(a, zero, 8));
}
TL_INLINE vi vi_last(vi a) { return _mm512_permutexvar_epi32(_mm512_set1_epi32(15), a); }
TL_INLINE vi vi_shift_in(vi a, vi before) { return _mm512_alignr_epi32(a, before, 15); }
TL_INLINE vf vf_from_unsigned(vi a) { return _mm512_cvtepu32_ps(a); }
TL_INLINE vi vi_gather(vm m, const int32_t *p, vi i)
{
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, i, p, 4);
}

TL_INLINE vm vm_and(vm a, vm b) { return a & b; }
TL_INLINE vm vm_or(vm a, vm b) { return a | b; }
TL_INLINE vm vm_and_not(vm a, vm b) { return a & (vm)~b; }
TL_INLINE int vm_any(vm a) { return a != 0; }
TL_INLINE unsigned vm_bits(vm a) { return a; }
TL_INLINE vm vm_all(void) { return 0xffff; }
TL_INLINE vm vm_first(int64_t n) { return n >= 16 ? 0xffff : n <= 0 ? 0 : (vm)((1u << n) - 1); }
TL_INLINE vm vm_from_bits(unsigned bits) { return (vm)bits; }
/* 64 bytes of 0 or 1 */
TL_INLINE void bytes_from_bits(uint8_t *p, uint64_t bits) { _mm512_storeu_si512(p, _mm512_maskz_set1_epi8(bits, 1)); }
TL_INLINE vf vf_select(vm m, vf a, vf b) { return _mm512_mask_mov_ps(b, m, a); }
TL_INLINE vi vi_floor(vf a) { return _mm512_cvt_roundps_epi32(a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
TL_INLINE vf vf_load_masked(vm m, const float *p) { return _mm512_maskz_loadu_ps(m, p); }
TL_INLINE void vf_store_masked(float *p, vm m, vf a) { _mm512_mask_storeu_ps(p, m, a); }
TL_INLINE vm vf_lt(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
TL_INLINE vm vf_ge(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_GE_OQ); }
TL_INLINE vm vf_eq(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ); }

TL_INLINE vf vf_from_vd(vd a)
{
    return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(a.lo)), _mm512_cvtpd_ps(a.hi), 1);
}
TL_INLINE vd vd_abs(vd a) { return (vd){_mm512_abs_pd(a.lo), _mm512_abs_pd(a.hi)}; }
TL_INLINE vd vd_floor(vd a) { return (vd){_mm512_roundscale_pd(a.lo, 1), _mm512_roundscale_pd(a.hi, 1)}; }
TL_INLINE vm vd_ge(vd a, vd b)
{
    return (vm)(_mm512_cmp_pd_mask(a.lo, b.lo, _CMP_GE_OQ) | _mm512_cmp_pd_mask(a.hi, b.hi, _CMP_GE_OQ) << 8);
}
TL_INLINE vd vd_from_vf(vf a)
{
    return (vd){_mm512_cvtps_pd(_mm512_castps512_ps256(a)), _mm512_cvtps_pd(_mm512_extractf32x8_ps(a, 1))};
}
/* The even and the odd numbers of the 32 in two vectors; and the inverse. */
TL_INLINE vi evens_of(vd a)
{
    const vi even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    return _mm512_permutex2var_epi32(_mm512_castpd_si512(a.lo), even, _mm512_castpd_si512(a.hi));
}
TL_INLINE vi odds_of(vd a)
{
    const vi odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    return _mm512_permutex2var_epi32(_mm512_castpd_si512(a.lo), odd, _mm512_castpd_si512(a.hi));
}
TL_INLINE vd interleave(vi even, vi odd)
{
    const vi low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const vi high = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    return (vd){_mm512_castsi512_pd(_mm512_permutex2var_epi32(even, low, odd)),
                _mm512_castsi512_pd(_mm512_permutex2var_epi32(even, high, odd))};
}
TL_INLINE vd vd_select(vm m, vd a, vd b)
{
    return (vd){_mm512_mask_mov_pd(b.lo, (__mmask8)m, a.lo), _mm512_mask_mov_pd(b.hi, (__mmask8)(m >> 8), a.hi)};
}

typedef struct {
    wd even, odd;
} vz; /* z of lanes 0,1,4,5,8,9,12,13 and of 2,3,6,7,10,11,14,15 */
TL_INLINE vd vd_from_vz(vz z)
{
    const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
    const __m512i high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
    return (vd){_mm512_permutex2var_pd(z.even, low, z.odd), _mm512_permutex2var_pd(z.even, high, z.odd)};
}
TL_INLINE vi join_quarters(const __m128i *a)
{
    const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(a[0]), a[1], 1);
    const __m256i high = _mm256_inserti128_si256(_mm256_castsi128_si256(a[2]), a[3], 1);
    return join_halves(low, high);
}

/* Loads four numbers of each of two rows, TL_LANES / 4 rows apart; and stores them. */
TL_INLINE wd load_rows_f64(const double *p, const double *other)
{
    return _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(p)), _mm256_loadu_pd(other), 1);
}
TL_INLINE void store_rows_f64(double *p, double *other, wd rows)
{
    _mm256_storeu_pd(p, _mm512_castpd512_pd256(rows));
    _mm256_storeu_pd(other, _mm512_extractf64x4_pd(rows, 1));
}
TL_INLINE wd front_pairs(wd a, wd b)
{
    return _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), b);
}
TL_INLINE wd back_pairs(wd a, wd b)
{
    return _mm512_permutex2var_pd(a, _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15), b);
}

TL_INLINE void store_half(tl_vertex *v, wd xy, wd z)
{
    const __m512i front = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
    const __m512i back = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
    _mm512_storeu_pd(v, _mm512_permutex2var_pd(xy, front, z));
    _mm512_storeu_pd(v + 4, _mm512_permutex2var_pd(xy, back, z));
}
TL_INLINE vf vf_min_size(vf a, vf b) { return _mm512_range_ps(a, b, 10); } /* the lesser, without its sign */
TL_INLINE vf vf_lookup(const float *table, vi i) { return _mm512_permutexvar_ps(i, _mm512_loadu_ps(table)); }
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return _mm512_permutexvar_epi32(i, _mm512_loadu_si512(table)); }
TL_INLINE vf vf_pick(const float *p, vi i) { return _mm512_permutexvar_ps(i, _mm512_loadu_ps(p)); }
TL_INLINE vd vd_pick(const double *p, vi i)
{
    const __m512d low = _mm512_loadu_pd(p), high = _mm512_loadu_pd(p + 8);
    return (vd){_mm512_permutex2var_pd(low, _mm512_cvtepi32_epi64(lower_half(i)), high),
                _mm512_permutex2var_pd(low, _mm512_cvtepi32_epi64(upper_half(i)), high)};
}
TL_INLINE vi vi_pick(const int32_t *p, vi i) { return _mm512_permutexvar_epi32(i, _mm512_loadu_si512(p)); }
TL_INLINE vi vi_prefix_count(unsigned bits)
{
    const uint64_t ones = 0x0101010101010101u;
    const uint64_t low = _pdep_u64(bits, ones) * ones, high = _pdep_u64(bits >> 8, ones) * ones + (low >> 56) * ones;
    return _mm512_cvtepu8_epi32(_mm_set_epi64x((long long)high, (long long)low));
}

/* Writes TL_LANES rows of four with the fourth column replaced. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 4; k++) {
        const vi at = _mm512_add_epi32(_mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3),
                                       _mm512_set1_epi32(4 * k));
        _mm512_storeu_ps(out + 16 * k, _mm512_mask_permutexvar_ps(_mm512_loadu_ps(rows + 16 * k), 0x8888, at, fourth));
    }
}
/* Stores consecutive pixels of three numbers. */
TL_INLINE void vf_store_triples(float *p, const vf *c)
{
    static const int32_t from[48] = {0,  16, 0,  1,  17, 1,  2,  18, 2,  3,  19, 3,  4,  20, 4,  5,
                                     21, 5,  6,  22, 6,  7,  23, 7,  8,  24, 8,  9,  25, 9,  10, 26,
                                     10, 11, 27, 11, 12, 28, 12, 13, 29, 13, 14, 30, 14, 15, 31, 15};
    static const __mmask16 is_third[3] = {0x4924, 0x2492, 0x9249};
    for (int k = 0; k < 3; k++) {
        const vi at = _mm512_loadu_si512(from + 16 * k);
        _mm512_storeu_ps(p + 16 * k,
                         _mm512_mask_permutexvar_ps(_mm512_permutex2var_ps(c[0], at, c[1]), is_third[k], at, c[2]));
    }
}
TL_INLINE __m256i ceil_eight(__m512d a)
{
    return _mm512_cvt_roundpd_epi32(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
}
TL_INLINE wd join_pairs(const __m128d *a)
{
    const __m256d low = _mm256_insertf128_pd(_mm256_castpd128_pd256(a[0]), a[1], 1);
    const __m256d high = _mm256_insertf128_pd(_mm256_castpd128_pd256(a[2]), a[3], 1);
    return _mm512_insertf64x4(_mm512_castpd256_pd512(low), high, 1);
}
TL_INLINE vi vi_ceil(vd a) { return join_halves(ceil_eight(a.lo), ceil_eight(a.hi)); }
/* a minus the nearest integer */
TL_INLINE vf vf_off_integer(vf a) { return _mm512_reduce_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
TL_INLINE vd vd_off_integer(vd a)
{
    enum { nearest = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }; /* clang needs a constant expression */
    return (vd){_mm512_reduce_pd(a.lo, nearest), _mm512_reduce_pd(a.hi, nearest)};
}
TL_INLINE vd vd_off_256th(vd a)
{
    enum { nearest = 8 << 4 | _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC };
    return (vd){_mm512_reduce_pd(a.lo, nearest), _mm512_reduce_pd(a.hi, nearest)};
}

#include "lanes/lanes_x86.h"

/* The first four numbers of TL_LANES rows, as columns; reads up to two numbers past the last row. */
TL_INLINE void load_columns_f32(const float *p, int stride, vf *columns)
{
    if (stride != 3) {
        columns_of_rows_f32(p, stride, columns);
        return;
    }
    /* three whole loads, two permutations a column; a fourth number does not exist */
    const __m512 a = _mm512_loadu_ps(p), b = _mm512_loadu_ps(p + 16), c = _mm512_loadu_ps(p + 32);
    const __m512i x0 = _mm512_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0);
    const __m512i x1 = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29);
    const __m512i y0 = _mm512_setr_epi32(1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0);
    const __m512i y1 = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30);
    const __m512i z0 = _mm512_setr_epi32(2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0);
    const __m512i z1 = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31);
    columns[0] = _mm512_permutex2var_ps(_mm512_permutex2var_ps(a, x0, b), x1, c);
    columns[1] = _mm512_permutex2var_ps(_mm512_permutex2var_ps(a, y0, b), y1, c);
    columns[2] = _mm512_permutex2var_ps(_mm512_permutex2var_ps(a, z0, b), z1, c);
    columns[3] = _mm512_setzero_ps();
}
TL_INLINE void load_eight_triples(const double *base, const int32_t *first, wd *c)
{
    wd row[4];
    for (int k = 0; k < 4; k++) {
        const __m256d low = _mm256_maskz_loadu_pd(7, base + (int64_t)first[3 * k] * 3);
        row[k] = _mm512_insertf64x4(_mm512_castpd256_pd512(low),
                                    _mm256_maskz_loadu_pd(7, base + (int64_t)first[3 * k + 12] * 3), 1);
    }
    transpose_rows(row, c);
}
TL_INLINE void vd_load_triples(const double *base, const int32_t *first, vd *x, vd *y, vd *z)
{
    wd front[4], back[4];
    load_eight_triples(base, first, front);
    load_eight_triples(base, first + 24, back);
    *x = (vd){front[0], back[0]}, *y = (vd){front[1], back[1]}, *z = (vd){front[2], back[2]};
}

#endif
