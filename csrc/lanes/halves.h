/* Lanes of 16 and 8 bits, and tables of 64 numbers in registers: for meshlets/, besides the sixteen lanes of
 * lanes_avx512.h.  With AVX-512 VBMI and VBMI2 alone: TL_HAS_HALVES tells.
 *
 *   vi as 32 halves (vh_), vb 32 bytes, vhm 32 bits; unsigned unless their name says signed
 *   v?_pick_of(a, i, b)     a[i], or b[i - n] behind the end of a
 *   vi_pick_64(table, i)    table[i] of 64 int32 that lie aligned in memory */
#ifndef TL_HALVES_H
#define TL_HALVES_H

#include <stdint.h>

#include "lanes/lanes.h"

#if defined(__AVX512VBMI__) && defined(__AVX512VBMI2__) && TL_LANES == 16
#define TL_HAS_HALVES 1

typedef __m256i vb;
typedef __mmask32 vhm;

TL_INLINE vi vi_load_aligned(const void *p) { return _mm512_load_si512(p); }
TL_INLINE void vi_store_aligned(void *p, vi a) { _mm512_store_si512(p, a); }
TL_INLINE vi vi_shift_right_unsigned(vi a, int n) { return _mm512_srli_epi32(a, (unsigned)n); }
TL_INLINE vi vi_or_three(vi a, vi b, vi c) { return _mm512_ternarylogic_epi32(a, b, c, 0xfe); }
TL_INLINE vi vi_bytes_at(const uint8_t *p) { return _mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)p)); }
TL_INLINE vi vi_pick_of(vi a, vi i, vi b) { return _mm512_permutex2var_epi32(a, i, b); }
TL_INLINE vi vi_pick_64(const void *table, vi i)
{
    const char *p = table;
    return _mm512_mask_blend_epi32(
        _mm512_test_epi32_mask(i, _mm512_set1_epi32(32)),
        _mm512_permutex2var_epi32(_mm512_load_si512(p), i, _mm512_load_si512(p + 64)),
        _mm512_permutex2var_epi32(_mm512_load_si512(p + 128), i, _mm512_load_si512(p + 192)));
}
/* the bytes of 128 with numbers in the lowest bytes of the lanes; the other bytes mean nothing */
TL_INLINE vi vi_pick_bytes(const uint8_t *table, vi i)
{
    return _mm512_permutex2var_epi8(_mm512_loadu_si512(table), i, _mm512_loadu_si512(table + 64));
}
TL_INLINE vi vi_select_bytes(uint64_t m, vi a, vi b) { return _mm512_mask_blend_epi8(m, b, a); }
TL_INLINE vi vi_from_halves(vi low, vi high) { return _mm512_mask_blend_epi16(0xaaaaaaaau, low, high); }
TL_INLINE vi vi_signed_low(vi a) { return _mm512_srai_epi32(_mm512_slli_epi32(a, 16), 16); }
TL_INLINE vi vi_signed_high(vi a) { return _mm512_srai_epi32(a, 16); }
/* the halves of (x, y) as (y, -x) */
TL_INLINE vi vi_turn_pairs(vi a)
{
    const vi r = _mm512_rol_epi32(a, 16);
    return _mm512_mask_sub_epi16(r, 0xaaaaaaaau, _mm512_setzero_si512(), r);
}
/* the sum of the products of the signed halves of two lanes */
TL_INLINE vi vi_dot_pairs(vi a, vi b) { return _mm512_madd_epi16(a, b); }
TL_INLINE vi vi_swap_neighbours(vi a) { return _mm512_shuffle_epi32(a, 0xb1); }
TL_INLINE int32_t vi_most(vi a) { return _mm512_reduce_max_epi32(a); }
TL_INLINE vm vi_any_bit(vi a, vi b) { return _mm512_test_epi32_mask(a, b); }
TL_INLINE vm vi_lt_unsigned(vi a, vi b) { return _mm512_cmplt_epu32_mask(a, b); }
/* the lanes in which no number is negative */
TL_INLINE vm vi_none_negative(vi a, vi b, vi c)
{
    return (vm)_mm512_movepi32_mask(_mm512_ternarylogic_epi32(a, b, c, 0x01));
}
TL_INLINE vm vm_first_of_few(int n) { return (vm)_bzhi_u32(0xffff, (unsigned)n); }

TL_INLINE vi vh_set1(int a) { return _mm512_set1_epi16((short)a); }
TL_INLINE vi vh_from_bytes(const uint8_t *p) { return _mm512_cvtepu8_epi16(_mm256_loadu_si256((const __m256i *)p)); }
TL_INLINE vi vh_min(vi a, vi b) { return _mm512_min_epu16(a, b); }
TL_INLINE vi vh_max(vi a, vi b) { return _mm512_max_epu16(a, b); }
TL_INLINE vi vh_signed_min(vi a, vi b) { return _mm512_min_epi16(a, b); }
TL_INLINE vi vh_signed_max(vi a, vi b) { return _mm512_max_epi16(a, b); }
TL_INLINE vi vh_shift_left(vi a, int n) { return _mm512_slli_epi16(a, (unsigned)n); }
TL_INLINE vhm vh_signed_gt(vi a, vi b) { return _mm512_cmpgt_epi16_mask(a, b); }
/* of the halves in m */
TL_INLINE vhm vh_signed_gt_in(vhm m, vi a, vi b) { return _mm512_mask_cmpgt_epi16_mask(m, a, b); }
TL_INLINE vhm vh_signed_le_in(vhm m, vi a, vi b) { return _mm512_mask_cmple_epi16_mask(m, a, b); }
TL_INLINE vi vh_pick_of(vi a, vi i, vi b) { return _mm512_permutex2var_epi16(a, i, b); }
/* the low and the high halves of 32 lanes */
TL_INLINE void vh_part(vi a, vi b, vi *low, vi *high)
{
    const vi even = _mm512_set_epi16(62, 60, 58, 56, 54, 52, 50, 48, 46, 44, 42, 40, 38, 36, 34, 32, 30, 28, 26, 24, 22,
                                     20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
    *low = _mm512_permutex2var_epi16(a, even, b);
    *high = _mm512_permutex2var_epi16(a, _mm512_add_epi16(even, _mm512_set1_epi16(1)), b);
}

TL_INLINE vb vb_count_from(int first)
{
    const __m256i iota = _mm256_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21,
                                          22, 23, 24, 25, 26, 27, 28, 29, 30, 31);
    return _mm256_add_epi8(iota, _mm256_set1_epi8((char)first));
}
/* packs those in m at p, writes all 32 bytes, and returns how many they are */
TL_INLINE int vb_compress(uint8_t *p, vhm m, vb a)
{
    _mm256_storeu_si256((__m256i *)p, _mm256_maskz_compress_epi8(m, a));
    return __builtin_popcount(m);
}
TL_INLINE int vf_compress(float *p, vm m, vf a)
{
    _mm512_storeu_ps(p, _mm512_maskz_compress_ps(m, a));
    return __builtin_popcount(m);
}

/* Doubles as two tables of words: 16 of 64 that lie aligned in memory. */
TL_INLINE vd vd_of_words(vi low, vi high)
{
    const vi first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const vi second = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    return (vd){_mm512_castsi512_pd(_mm512_permutex2var_epi32(low, first, high)),
                _mm512_castsi512_pd(_mm512_permutex2var_epi32(low, second, high))};
}
TL_INLINE void vd_part_words(vd a, vi *low, vi *high)
{
    const vi even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    const vi odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    const vi lo = _mm512_castpd_si512(a.lo), hi = _mm512_castpd_si512(a.hi);
    *low = _mm512_permutex2var_epi32(lo, even, hi);
    *high = _mm512_permutex2var_epi32(lo, odd, hi);
}
/* a * b + c and c - a * b, rounded once */
TL_INLINE vd vd_fma(vd a, vd b, vd c)
{
    return (vd){_mm512_fmadd_pd(a.lo, b.lo, c.lo), _mm512_fmadd_pd(a.hi, b.hi, c.hi)};
}
TL_INLINE vd vd_fnma(vd a, vd b, vd c)
{
    return (vd){_mm512_fnmadd_pd(a.lo, b.lo, c.lo), _mm512_fnmadd_pd(a.hi, b.hi, c.hi)};
}
TL_INLINE vf vf_fnma(vf a, vf b, vf c) { return _mm512_fnmadd_ps(a, b, c); }
TL_INLINE vf vf_fms(vf a, vf b, vf c) { return _mm512_fmsub_ps(a, b, c); }
TL_INLINE vf vf_abs(vf a) { return _mm512_abs_ps(a); }
TL_INLINE vm vf_gt(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_GT_OQ); }
/* NaN as well */
TL_INLINE vm vf_not_lt(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_NLT_UQ); }

/* Two rows at a time: in the lanes of m the second. */
TL_INLINE vf vf_sum_two(double first, vd a, double second, vd b, vm m)
{
    const vd row = {_mm512_set1_pd(first), _mm512_set1_pd(first)};
    const vd other = {_mm512_set1_pd(second), _mm512_set1_pd(second)};
    return vf_add(vf_from_vd((vd){_mm512_mask_add_pd(_mm512_add_pd(row.lo, a.lo), (__mmask8)m, other.lo, b.lo),
                                  _mm512_mask_add_pd(_mm512_add_pd(row.hi, a.hi), (__mmask8)(m >> 8), other.hi, b.hi)}),
                  _mm512_setzero_ps());
}
TL_INLINE hf hf_sum_two(double first, vd a, double second, vd b, hm m)
{
    const __m512d sum = _mm512_mask_add_pd(_mm512_add_pd(_mm512_set1_pd(first), a.lo), m, _mm512_set1_pd(second), b.lo);
    return _mm256_add_ps(_mm512_cvtpd_ps(sum), _mm256_setzero_ps());
}
TL_INLINE hi hi_select(hm m, hi a, hi b) { return _mm256_mask_mov_epi32(b, m, a); }

TL_INLINE void prefetch(const void *p) { _mm_prefetch((const char *)p, _MM_HINT_T0); }

/* Up to eight bytes a number: `low` beside 0, 1, ... in the byte above it. */
TL_INLINE void count_pairs(void *p, int low)
{
    const __m128i step = _mm_setr_epi16(0, 1 << 8, 2 << 8, 3 << 8, 4 << 8, 5 << 8, 6 << 8, 7 << 8);
    _mm_storeu_si128((__m128i *)p, _mm_add_epi16(step, _mm_set1_epi16((short)low)));
}

#else
#define TL_HAS_HALVES 0
#endif

#endif
