/* Eight lanes, masks as whole vectors of ones. */
#ifndef TL_LANES_AVX2_H
#define TL_LANES_AVX2_H

#include <immintrin.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"

#define TL_LANES 8
#define TL_MM(name) _mm256_##name
#define TL_SI(name) _mm256_##name##_si256
#define TL_FROM_SI(type) _mm256_castsi256_##type

typedef __m256i vi;
typedef __m256 vf;
typedef __m256d wd;
typedef struct {
    wd lo, hi;
} vd;
typedef __m256i vm;

/* Half of the lanes, and one number of 64 bits in all of them. */
typedef __m128i half_vi;
TL_INLINE half_vi lower_half(vi a) { return _mm256_castsi256_si128(a); }
TL_INLINE half_vi upper_half(vi a) { return _mm256_extracti128_si256(a, 1); }
TL_INLINE vi join_halves(half_vi low, half_vi high)
{
    return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}
TL_INLINE vi set1_64(uint64_t a) { return _mm256_set1_epi64x((long long)a); }

TL_INLINE vi vi_load(const int32_t *p) { return _mm256_loadu_si256((const __m256i *)p); }
TL_INLINE void vi_store(int32_t *p, vi a) { _mm256_storeu_si256((__m256i *)p, a); }
TL_INLINE vi vi_iota(void) { return _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7); }
TL_INLINE vm vi_gt(vi a, vi b) { return _mm256_cmpgt_epi32(a, b); }
TL_INLINE vm vi_gt_unsigned(vi a, vi b)
{
    const vi sign = _mm256_set1_epi32(INT32_MIN);
    return _mm256_cmpgt_epi32(_mm256_xor_si256(a, sign), _mm256_xor_si256(b, sign));
}
TL_INLINE vm vi_eq(vi a, vi b) { return _mm256_cmpeq_epi32(a, b); }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return _mm256_blendv_epi8(b, a, m); }
TL_INLINE vi vi_load_masked(vm m, const int32_t *p) { return _mm256_maskload_epi32(p, m); }
TL_INLINE void vi_store_masked(int32_t *p, vm m, vi a) { _mm256_maskstore_epi32(p, m, a); }

TL_INLINE vi vi_prefix_sum(vi a)
{
    a = _mm256_add_epi32(a, _mm256_slli_si256(a, 4));
    a = _mm256_add_epi32(a, _mm256_slli_si256(a, 8));
    return _mm256_add_epi32(a, _mm256_shuffle_epi32(_mm256_permute2x128_si256(a, a, 0x08), 0xff));
}
TL_INLINE vi vi_last(vi a) { return _mm256_permutevar8x32_epi32(a, _mm256_set1_epi32(7)); }
TL_INLINE vi vi_shift_in(vi a, vi before)
{
    const vi back = _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6);
    return _mm256_blend_epi32(_mm256_permutevar8x32_epi32(a, back), _mm256_permutevar8x32_epi32(before, back), 1);
}
/* the upper half scales without loss, so the sum is the only rounding */
TL_INLINE vf vf_from_unsigned(vi a)
{
    const vf high = _mm256_cvtepi32_ps(_mm256_srli_epi32(a, 16));
    const vf low = _mm256_cvtepi32_ps(_mm256_and_si256(a, _mm256_set1_epi32(0xffff)));
    return _mm256_add_ps(_mm256_mul_ps(high, _mm256_set1_ps(65536.0f)), low);
}
/* Loads one by one: hardware gathers are microcode on Zen 1 and 2, and on Intel's cores with the fix for Downfall; Zen
 * 3 draws `photometric_loss` of 70,000 triangles in 0.93 of the time of gathers.  Lanes that are not in m read p[0],
 * as lanes.h says. */
TL_INLINE vi vi_gather(vm m, const int32_t *p, vi i)
{
    if (_mm256_testz_si256(m, m))
        return _mm256_setzero_si256();
    int32_t k[8];
    vi_store(k, _mm256_and_si256(m, i));
    return _mm256_and_si256(m, _mm256_setr_epi32(int32_at(p, k[0]), int32_at(p, k[1]), int32_at(p, k[2]),
                                                 int32_at(p, k[3]), int32_at(p, k[4]), int32_at(p, k[5]),
                                                 int32_at(p, k[6]), int32_at(p, k[7])));
}

TL_INLINE vm vm_and(vm a, vm b) { return _mm256_and_si256(a, b); }
TL_INLINE vm vm_or(vm a, vm b) { return _mm256_or_si256(a, b); }
TL_INLINE vm vm_and_not(vm a, vm b) { return _mm256_andnot_si256(b, a); }
TL_INLINE int vm_any(vm a) { return !_mm256_testz_si256(a, a); }
TL_INLINE unsigned vm_bits(vm a) { return (unsigned)_mm256_movemask_ps(_mm256_castsi256_ps(a)); }
TL_INLINE vm vm_all(void) { return _mm256_set1_epi32(-1); }
TL_INLINE vm vm_first(int64_t n) { return _mm256_cmpgt_epi32(_mm256_set1_epi32(n > 8 ? 8 : (int)n), vi_iota()); }

TL_INLINE vm vm_from_bits(unsigned bits)
{
    const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32((int)bits), lane), lane);
}
/* 64 bytes of 0 or 1 */
TL_INLINE void bytes_from_bits(uint8_t *p, uint64_t bits)
{
    const __m256i spread = _mm256_setr_epi64x(0, 0x0101010101010101, 0x0202020202020202, 0x0303030303030303);
    const __m256i lane = _mm256_set1_epi64x((long long)0x8040201008040201u), one = _mm256_set1_epi8(1);
    for (int k = 0; k < 2; k++) {
        const __m256i bytes = _mm256_shuffle_epi8(_mm256_set1_epi32((int)(bits >> 32 * k)), spread);
        const __m256i on = _mm256_cmpeq_epi8(_mm256_and_si256(bytes, lane), lane);
        _mm256_storeu_si256((__m256i *)(p + 32 * k), _mm256_and_si256(on, one));
    }
}
/* Tables by the bits of a mask, because pdep and pext are microcode on Zen 1 and 2: up to 290 cycles each.  A row has a
 * byte for each lane and is built from the highest lane down: with(row, lane) is the row with a set lane inserted. */
#define TL_ROWS_0(with, row) row, with(row, 0)
#define TL_ROWS_1(with, row) TL_ROWS_0(with, row), TL_ROWS_0(with, with(row, 1))
#define TL_ROWS_2(with, row) TL_ROWS_1(with, row), TL_ROWS_1(with, with(row, 2))
#define TL_ROWS_3(with, row) TL_ROWS_2(with, row), TL_ROWS_2(with, with(row, 3))
#define TL_ROWS_4(with, row) TL_ROWS_3(with, row), TL_ROWS_3(with, with(row, 4))
#define TL_ROWS_5(with, row) TL_ROWS_4(with, row), TL_ROWS_4(with, with(row, 5))
#define TL_ROWS_6(with, row) TL_ROWS_5(with, row), TL_ROWS_5(with, with(row, 6))
#define TL_ROWS_7(with, row) TL_ROWS_6(with, row), TL_ROWS_6(with, with(row, 7))
#define TL_PUT_FIRST(row, lane) ((row) << 8 | (lane))
#define TL_COUNT_FROM(row, lane) ((row) + (UINT64_C(0x0101010101010101) << 8 * (lane)))
static const uint64_t packing_orders[256] = {TL_ROWS_7(TL_PUT_FIRST, UINT64_C(0))};
static const uint64_t prefix_counts[256] = {TL_ROWS_7(TL_COUNT_FROM, UINT64_C(0))};

TL_INLINE vi row_of_bytes(uint64_t row) { return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)row)); }
TL_INLINE void vi_pack(int32_t *p, vm m, vi a)
{
    vi_store(p, _mm256_permutevar8x32_epi32(a, row_of_bytes(packing_orders[vm_bits(m)])));
}

TL_INLINE vf vf_select(vm m, vf a, vf b) { return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(m)); }
TL_INLINE vi vi_floor(vf a) { return _mm256_cvtps_epi32(_mm256_floor_ps(a)); }
TL_INLINE vf vf_load_masked(vm m, const float *p) { return _mm256_maskload_ps(p, m); }
TL_INLINE void vf_store_masked(float *p, vm m, vf a) { _mm256_maskstore_ps(p, m, a); }
TL_INLINE vm vf_lt(vf a, vf b) { return _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LT_OQ)); }
TL_INLINE vm vf_ge(vf a, vf b) { return _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_GE_OQ)); }
TL_INLINE vm vf_eq(vf a, vf b) { return _mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_EQ_OQ)); }

TL_INLINE vf vf_from_vd(vd a)
{
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm256_cvtpd_ps(a.lo)), _mm256_cvtpd_ps(a.hi), 1);
}
TL_INLINE vd vd_abs(vd a)
{
    const __m256d sign = _mm256_set1_pd(-0.0);
    return (vd){_mm256_andnot_pd(sign, a.lo), _mm256_andnot_pd(sign, a.hi)};
}
TL_INLINE vd vd_floor(vd a) { return (vd){_mm256_floor_pd(a.lo), _mm256_floor_pd(a.hi)}; }
/* The even and the odd numbers of the 16 in two vectors; and the inverse. */
TL_INLINE vi evens_of(vd a)
{
    const __m256 packed = _mm256_shuffle_ps(_mm256_castpd_ps(a.lo), _mm256_castpd_ps(a.hi), 0x88); /* 0 1 4 5 2 3 6 7 */
    return _mm256_permute4x64_epi64(_mm256_castps_si256(packed), 0xd8);
}
TL_INLINE vi odds_of(vd a)
{
    const __m256 packed = _mm256_shuffle_ps(_mm256_castpd_ps(a.lo), _mm256_castpd_ps(a.hi), 0xdd);
    return _mm256_permute4x64_epi64(_mm256_castps_si256(packed), 0xd8);
}
TL_INLINE wd front_pairs(wd a, wd b) { return _mm256_permute2f128_pd(a, b, 0x20); }
TL_INLINE wd back_pairs(wd a, wd b) { return _mm256_permute2f128_pd(a, b, 0x31); }
TL_INLINE vd interleave(vi even, vi odd)
{
    const wd a = _mm256_castsi256_pd(_mm256_unpacklo_epi32(even, odd));
    const wd b = _mm256_castsi256_pd(_mm256_unpackhi_epi32(even, odd));
    return (vd){front_pairs(a, b), back_pairs(a, b)};
}
TL_INLINE vm vd_ge(vd a, vd b)
{
    return evens_of((vd){_mm256_cmp_pd(a.lo, b.lo, _CMP_GE_OQ), _mm256_cmp_pd(a.hi, b.hi, _CMP_GE_OQ)});
}
TL_INLINE vd vd_from_vf(vf a)
{
    return (vd){_mm256_cvtps_pd(_mm256_castps256_ps128(a)), _mm256_cvtps_pd(_mm256_extractf128_ps(a, 1))};
}
TL_INLINE vd vd_select(vm m, vd a, vd b)
{
    const __m256d lo = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(lower_half(m)));
    const __m256d hi = _mm256_castsi256_pd(_mm256_cvtepi32_epi64(upper_half(m)));
    return (vd){_mm256_blendv_pd(b.lo, a.lo, lo), _mm256_blendv_pd(b.hi, a.hi, hi)};
}

typedef struct {
    wd even, odd;
} vz; /* z of lanes 0,1,4,5 and of 2,3,6,7 */
TL_INLINE vd vd_from_vz(vz z) { return (vd){front_pairs(z.even, z.odd), back_pairs(z.even, z.odd)}; }
TL_INLINE vi join_quarters(const __m128i *a) { return join_halves(a[0], a[1]); }
TL_INLINE wd join_pairs(const __m128d *a) { return _mm256_insertf128_pd(_mm256_castpd128_pd256(a[0]), a[1], 1); }

/* Loads four numbers of a row: other instruction sets load two rows, TL_LANES / 4 apart; and stores them. */
TL_INLINE wd load_rows_f64(const double *p, const double *other) { return (void)other, _mm256_loadu_pd(p); }
TL_INLINE void store_rows_f64(double *p, double *other, wd row) { (void)other, _mm256_storeu_pd(p, row); }

TL_INLINE void store_half(tl_vertex *v, wd xy, wd z)
{
    const wd even = _mm256_unpacklo_pd(xy, z), odd = _mm256_unpackhi_pd(xy, z);
    _mm256_storeu_pd((double *)v, front_pairs(even, odd));
    _mm256_storeu_pd((double *)(v + 2), back_pairs(even, odd));
}
TL_INLINE vf vf_min_size(vf a, vf b) { return _mm256_min_ps(a, _mm256_andnot_ps(_mm256_set1_ps(-0.0f), b)); }
TL_INLINE vf vf_lookup(const float *table, vi i)
{
    const vf low = _mm256_permutevar8x32_ps(_mm256_loadu_ps(table), i);
    const vf high = _mm256_permutevar8x32_ps(_mm256_loadu_ps(table + 8), i);
    return _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32(i, 28)));
}
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return _mm256_castps_si256(vf_lookup((const float *)table, i)); }
TL_INLINE vf vf_pick(const float *p, vi i) { return _mm256_permutevar8x32_ps(_mm256_loadu_ps(p), i); }
TL_INLINE __m256d pick_half(const float *p, __m128i twice)
{
    const __m256i even = _mm256_cvtepu32_epi64(twice);
    const __m256i at =
        _mm256_or_si256(_mm256_or_si256(even, _mm256_slli_epi64(even, 32)), _mm256_set1_epi64x(INT64_C(1) << 32));
    const __m256d low = _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_loadu_ps(p), at));
    const __m256d high = _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_loadu_ps(p + 8), at));
    return _mm256_blendv_pd(low, high, _mm256_castsi256_pd(_mm256_slli_epi64(even, 60)));
}
TL_INLINE vd vd_pick(const double *p, vi i)
{
    const vi twice = _mm256_add_epi32(i, i);
    return (vd){pick_half((const float *)p, lower_half(twice)), pick_half((const float *)p, upper_half(twice))};
}
TL_INLINE vi vi_pick(const int32_t *p, vi i)
{
    return _mm256_permutevar8x32_epi32(_mm256_loadu_si256((const __m256i *)p), i);
}
TL_INLINE vi vi_prefix_count(unsigned bits) { return row_of_bytes(prefix_counts[bits]); }

/* Writes TL_LANES rows of four with the fourth column replaced. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 4; k++) {
        const vi at = _mm256_add_epi32(_mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1), _mm256_set1_epi32(2 * k));
        _mm256_storeu_ps(out + 8 * k,
                         _mm256_blend_ps(_mm256_loadu_ps(rows + 8 * k), _mm256_permutevar8x32_ps(fourth, at), 0x88));
    }
}
/* Stores consecutive pixels of three numbers. */
TL_INLINE void vf_store_triples(float *p, const vf *c)
{
    static const int32_t from[24] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 7, 7, 7};
    vf turned[3][3];
    for (int k = 0; k < 3; k++)
        for (int channel = 0; channel < 3; channel++)
            turned[k][channel] =
                _mm256_permutevar8x32_ps(c[channel], _mm256_loadu_si256((const __m256i *)(from + 8 * k)));
    _mm256_storeu_ps(p, _mm256_blend_ps(_mm256_blend_ps(turned[0][0], turned[0][1], 0x92), turned[0][2], 0x24));
    _mm256_storeu_ps(p + 8, _mm256_blend_ps(_mm256_blend_ps(turned[1][0], turned[1][1], 0x24), turned[1][2], 0x49));
    _mm256_storeu_ps(p + 16, _mm256_blend_ps(_mm256_blend_ps(turned[2][0], turned[2][1], 0x49), turned[2][2], 0x92));
}

#include "lanes/lanes_x86.h"

TL_INLINE vi vi_ceil(vd a) { return vi_round((vd){_mm256_ceil_pd(a.lo), _mm256_ceil_pd(a.hi)}); }
/* a minus the nearest integer */
TL_INLINE vf vf_off_integer(vf a)
{
    return _mm256_sub_ps(a, _mm256_round_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC));
}
TL_INLINE vd vd_off_integer(vd a)
{
    enum { nearest = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }; /* clang needs a constant expression */
    return vd_sub(a, (vd){_mm256_round_pd(a.lo, nearest), _mm256_round_pd(a.hi, nearest)});
}
TL_INLINE void load_columns_f32(const float *p, int stride, vf *columns) { columns_of_rows_f32(p, stride, columns); }
TL_INLINE __m256d load_four_thirds(const double *base, const int32_t *first)
{
    __m128d third[2];
    for (int k = 0; k < 2; k++)
        third[k] =
            _mm_loadh_pd(_mm_load_sd(base + (int64_t)first[6 * k] * 3 + 2), base + (int64_t)first[6 * k + 3] * 3 + 2);
    return join_pairs(third);
}
/* Two loads a row: a masked load of 32 bytes takes longer. */
TL_INLINE void vd_load_triples(const double *base, const int32_t *first, vd *x, vd *y, vd *z)
{
    vd_load_pairs(base, 3, first, x, y);
    *z = (vd){load_four_thirds(base, first), load_four_thirds(base, first + 12)};
}

#endif
