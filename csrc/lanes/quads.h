/* Quads: four float32 that belong together, those of a pixel or of a corner; four quads, of four pixels; and four
 * float64.
 *
 * Equal bits on every instruction set: nothing is fused, and each sum has one order.
 *
 *   vq_set1 vq_load vq_store    as their names say; + - * / are those of the compiler
 *   vq_load_some(p, n)          the first n of four numbers, zeros beyond
 *   vqd_load vqd_store vqd_set1 vqd_add vqd_mul vqd_from_vq vq_from_vqd    of float64, as their names say
 *   vqd_above_zero(a, b)        bit k: number k of both is above 0
 *   vq4_set1(a) vq4_all(a)      a number everywhere; a quad, four times
 *   vq4_add vq4_sub vq4_mul     as their names say
 *   TL_VQ4_PERMUTE(a, i, j, k, l)      the lanes i, j, k, l of each quad
 *   TL_VQ4_BLEND(a, b, bits)    lane k of each quad from b where bit k is set
 *   vq4_pixels()                0, 1, 2, 3: each in all lanes of its quad
 *   vq4_spread(a)               the numbers of a quad: each in all lanes of its quad
 *   vq4_first(a, n)             the first n quads, zeros beyond
 *   vq4_fold(a)                 the sum of the four: the first and the third, the second and the fourth, both
 *   vq4_load(p, n, columns)     n rows of so many numbers, at most four, zeros beyond; and vq4_store.  n = TL_VQ4_ROOM
 *                               loads four rows where a row more can be read */
#ifndef TL_QUADS_H
#define TL_QUADS_H

#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"

#define TL_VQ4_ROOM 5

typedef float vq __attribute__((vector_size(16)));
typedef float vq_there __attribute__((vector_size(16), aligned(4), may_alias));

TL_INLINE vq vq_set1(float a) { return (vq){a, a, a, a}; }
TL_INLINE vq vq_load(const float *p) { return *(const vq_there *)p; }
TL_INLINE void vq_store(float *p, vq a) { *(vq_there *)p = a; }
TL_INLINE vq vq_load_some(const float *p, int n)
{
    return n > 3 ? vq_load(p) : (vq){p[0], n > 1 ? p[1] : 0.0f, n > 2 ? p[2] : 0.0f, 0.0f};
}

#ifdef __AVX2__
typedef __m256d vqd;
TL_INLINE vqd vqd_set1(double a) { return _mm256_set1_pd(a); }
TL_INLINE vqd vqd_load(const double *p) { return _mm256_loadu_pd(p); }
TL_INLINE void vqd_store(double *p, vqd a) { _mm256_storeu_pd(p, a); }
TL_INLINE vqd vqd_add(vqd a, vqd b) { return _mm256_add_pd(a, b); }
TL_INLINE vqd vqd_mul(vqd a, vqd b) { return _mm256_mul_pd(a, b); }
TL_INLINE vqd vqd_from_vq(vq a) { return _mm256_cvtps_pd((__m128)a); }
TL_INLINE vq vq_from_vqd(vqd a) { return (vq)_mm256_cvtpd_ps(a); }
TL_INLINE unsigned vqd_above_zero(vqd a, vqd b)
{
    const __m256d zero = _mm256_setzero_pd();
    return (unsigned)_mm256_movemask_pd(
        _mm256_and_pd(_mm256_cmp_pd(a, zero, _CMP_GT_OQ), _mm256_cmp_pd(b, zero, _CMP_GT_OQ)));
}
#else
typedef double vq_halves __attribute__((vector_size(16)));
typedef double vq_halves_there __attribute__((vector_size(16), aligned(8), may_alias));
typedef struct {
    vq_halves of[2];
} vqd;
TL_INLINE vqd vqd_set1(double a) { return (vqd){{{a, a}, {a, a}}}; }
TL_INLINE vqd vqd_load(const double *p)
{
    return (vqd){{*(const vq_halves_there *)p, *(const vq_halves_there *)(p + 2)}};
}
TL_INLINE void vqd_store(double *p, vqd a) { *(vq_halves_there *)p = a.of[0], *(vq_halves_there *)(p + 2) = a.of[1]; }
TL_INLINE vqd vqd_add(vqd a, vqd b) { return (vqd){{a.of[0] + b.of[0], a.of[1] + b.of[1]}}; }
TL_INLINE vqd vqd_mul(vqd a, vqd b) { return (vqd){{a.of[0] * b.of[0], a.of[1] * b.of[1]}}; }
TL_INLINE vqd vqd_from_vq(vq a) { return (vqd){{{(double)a[0], (double)a[1]}, {(double)a[2], (double)a[3]}}}; }
TL_INLINE vq vq_from_vqd(vqd a)
{
    return (vq){(float)a.of[0][0], (float)a.of[0][1], (float)a.of[1][0], (float)a.of[1][1]};
}
TL_INLINE unsigned vqd_above_zero(vqd a, vqd b)
{
    unsigned bits = 0;
    for (int k = 0; k < 4; k++)
        bits |= (unsigned)(a.of[k / 2][k % 2] > 0.0 && b.of[k / 2][k % 2] > 0.0) << k;
    return bits;
}
#endif

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512BW__) && defined(__AVX512VL__)
typedef __m512 vq4;
TL_INLINE vq4 vq4_set1(float a) { return _mm512_set1_ps(a); }
TL_INLINE vq4 vq4_all(vq a) { return _mm512_broadcast_f32x4((__m128)a); }
TL_INLINE vq4 vq4_add(vq4 a, vq4 b) { return _mm512_add_ps(a, b); }
TL_INLINE vq4 vq4_sub(vq4 a, vq4 b) { return _mm512_sub_ps(a, b); }
TL_INLINE vq4 vq4_mul(vq4 a, vq4 b) { return _mm512_mul_ps(a, b); }
#define TL_VQ4_PERMUTE(a, i, j, k, l) _mm512_permute_ps(a, (i) | (j) << 2 | (k) << 4 | (l) << 6)
#define TL_VQ4_BLEND(a, b, bits) _mm512_mask_blend_ps((__mmask16)((bits) * 0x1111), a, b)
TL_INLINE vq4 vq4_pixels(void) { return _mm512_setr_ps(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3); }
TL_INLINE vq4 vq4_spread(vq a)
{
    const __m512i number = _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
    return _mm512_permutexvar_ps(number, _mm512_castps128_ps512((__m128)a));
}
TL_INLINE __mmask16 vq4_mask(int64_t n, int columns)
{
    return (__mmask16)_bzhi_u32((1u << 4 * columns) - 1, (unsigned)columns * (n < 4 ? (unsigned)n : 4));
}
TL_INLINE vq4 vq4_first(vq4 a, int64_t n) { return _mm512_maskz_mov_ps(vq4_mask(n, 4), a); }
TL_INLINE vq vq4_fold(vq4 a)
{
    const __m256 half = _mm256_add_ps(_mm512_castps512_ps256(a), _mm512_extractf32x8_ps(a, 1));
    return (vq)_mm_add_ps(_mm256_castps256_ps128(half), _mm256_extractf128_ps(half, 1));
}
/* The index of the number in each lane, and the lanes that have a number. */
TL_INLINE __m512i vq4_order(int columns)
{
    const int c = columns;
    return _mm512_setr_epi32(0, 1, 2, 3, c, c + 1, c + 2, c + 3, 2 * c, 2 * c + 1, 2 * c + 2, 2 * c + 3, 3 * c,
                             3 * c + 1, 3 * c + 2, 3 * c + 3);
}
TL_INLINE vq4 vq4_load(const float *p, int64_t n, int columns)
{
    const vq4 a = _mm512_maskz_loadu_ps(vq4_mask(n, columns), p);
    if (columns == 4)
        return a;
    return _mm512_maskz_permutexvar_ps((__mmask16)(((1 << columns) - 1) * 0x1111), vq4_order(columns), a);
}
TL_INLINE void vq4_store(float *p, vq4 a, int64_t n, int columns)
{
    const __m512i three = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0, 0, 0, 0);
    const __m512i two = _mm512_setr_epi32(0, 1, 4, 5, 8, 9, 12, 13, 0, 0, 0, 0, 0, 0, 0, 0);
    const __m512i one = _mm512_setr_epi32(0, 4, 8, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    if (columns < 4)
        a = _mm512_permutexvar_ps(columns == 3 ? three : columns == 2 ? two : one, a);
    _mm512_mask_storeu_ps(p, vq4_mask(n, columns), a);
}
#elif defined(__AVX2__)
typedef struct {
    __m256 of[2];
} vq4;
TL_INLINE __m256 two_quads(__m128 a, __m128 b) { return _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1); }
TL_INLINE vq4 vq4_set1(float a) { return (vq4){{_mm256_set1_ps(a), _mm256_set1_ps(a)}}; }
TL_INLINE vq4 vq4_all(vq a) { return (vq4){{two_quads((__m128)a, (__m128)a), two_quads((__m128)a, (__m128)a)}}; }
#define TL_VQ4_EACH(a, b, of_two) ((vq4){{of_two((a).of[0], (b).of[0]), of_two((a).of[1], (b).of[1])}})
TL_INLINE vq4 vq4_add(vq4 a, vq4 b) { return TL_VQ4_EACH(a, b, _mm256_add_ps); }
TL_INLINE vq4 vq4_sub(vq4 a, vq4 b) { return TL_VQ4_EACH(a, b, _mm256_sub_ps); }
TL_INLINE vq4 vq4_mul(vq4 a, vq4 b) { return TL_VQ4_EACH(a, b, _mm256_mul_ps); }
#define TL_VQ4_PERMUTE(a, i, j, k, l)                                           \
    ((vq4){{_mm256_permute_ps((a).of[0], (i) | (j) << 2 | (k) << 4 | (l) << 6), \
            _mm256_permute_ps((a).of[1], (i) | (j) << 2 | (k) << 4 | (l) << 6)}})
#define TL_VQ4_BLEND(a, b, bits) \
    ((vq4){                      \
        {_mm256_blend_ps((a).of[0], (b).of[0], (bits) * 0x11), _mm256_blend_ps((a).of[1], (b).of[1], (bits) * 0x11)}})
TL_INLINE vq4 vq4_pixels(void)
{
    return (vq4){{_mm256_setr_ps(0, 0, 0, 0, 1, 1, 1, 1), _mm256_setr_ps(2, 2, 2, 2, 3, 3, 3, 3)}};
}
TL_INLINE vq4 vq4_spread(vq a)
{
    const __m256 both = two_quads((__m128)a, (__m128)a);
    return (vq4){{_mm256_permutevar_ps(both, _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1)),
                  _mm256_permutevar_ps(both, _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3))}};
}
TL_INLINE vq4 vq4_first(vq4 a, int64_t n)
{
    const __m256 end = _mm256_set1_ps((float)n);
    const vq4 pixels = vq4_pixels();
    for (int k = 0; k < 2; k++)
        a.of[k] = _mm256_and_ps(a.of[k], _mm256_cmp_ps(pixels.of[k], end, _CMP_LT_OQ));
    return a;
}
TL_INLINE vq vq4_fold(vq4 a)
{
    const __m256 both = _mm256_add_ps(a.of[0], a.of[1]);
    return (vq)_mm_add_ps(_mm256_castps256_ps128(both), _mm256_extractf128_ps(both, 1));
}
TL_INLINE vq4 vq4_load(const float *p, int64_t n, int columns)
{
    vq a[4];
    for (int k = 0; k < 4; k++)
        a[k] = k < n - 1 && columns > 2 ? vq_load(p + columns * k)
               : k < n                  ? vq_load_some(p + columns * k, columns)
                                        : vq_set1(0.0f);
    vq4 all = {{two_quads((__m128)a[0], (__m128)a[1]), two_quads((__m128)a[2], (__m128)a[3])}};
    return columns == 3 ? TL_VQ4_BLEND(all, vq4_set1(0.0f), 8) : all;
}
TL_INLINE vq vq4_at(vq4 a, int k)
{
    return (vq)(k & 1 ? _mm256_extractf128_ps(a.of[k / 2], 1) : _mm256_castps256_ps128(a.of[k / 2]));
}
#define TL_VQ4_HAS_NO_STORE
#else
#ifdef __clang__
#define TL_VQ_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
typedef int32_t vq_lanes __attribute__((vector_size(16)));
#define TL_VQ_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (vq_lanes){__VA_ARGS__})
#endif
typedef struct {
    vq of[4];
} vq4;
TL_INLINE vq4 vq4_all(vq a) { return (vq4){{a, a, a, a}}; }
TL_INLINE vq4 vq4_set1(float a) { return vq4_all(vq_set1(a)); }
#define TL_VQ4_EACH(name, a, b, done) \
    TL_INLINE vq4 name(vq4 a, vq4 b)  \
    {                                 \
        vq4 c;                        \
        for (int k = 0; k < 4; k++)   \
            c.of[k] = done;           \
        return c;                     \
    }
TL_VQ4_EACH(vq4_add, a, b, a.of[k] + b.of[k])
TL_VQ4_EACH(vq4_sub, a, b, a.of[k] - b.of[k])
TL_VQ4_EACH(vq4_mul, a, b, a.of[k] * b.of[k])
#define TL_VQ4_SHUFFLE(a, b, ...)                                                                               \
    ((vq4){{TL_VQ_SHUFFLE((a).of[0], (b).of[0], __VA_ARGS__), TL_VQ_SHUFFLE((a).of[1], (b).of[1], __VA_ARGS__), \
            TL_VQ_SHUFFLE((a).of[2], (b).of[2], __VA_ARGS__), TL_VQ_SHUFFLE((a).of[3], (b).of[3], __VA_ARGS__)}})
#define TL_VQ4_PERMUTE(a, i, j, k, l) TL_VQ4_SHUFFLE(a, a, i, j, k, l)
#define TL_VQ4_BLEND(a, b, bits) \
    TL_VQ4_SHUFFLE(a, b, (bits) & 1 ? 4 : 0, (bits) & 2 ? 5 : 1, (bits) & 4 ? 6 : 2, (bits) & 8 ? 7 : 3)
TL_INLINE vq4 vq4_pixels(void) { return (vq4){{vq_set1(0), vq_set1(1), vq_set1(2), vq_set1(3)}}; }
TL_INLINE vq4 vq4_spread(vq a) { return (vq4){{vq_set1(a[0]), vq_set1(a[1]), vq_set1(a[2]), vq_set1(a[3])}}; }
TL_INLINE vq4 vq4_first(vq4 a, int64_t n)
{
    for (int k = 0; k < 4; k++)
        a.of[k] = k < n ? a.of[k] : vq_set1(0);
    return a;
}
TL_INLINE vq vq4_fold(vq4 a) { return (a.of[0] + a.of[2]) + (a.of[1] + a.of[3]); }
TL_INLINE vq4 vq4_load(const float *p, int64_t n, int columns)
{
    vq4 a = vq4_set1(0.0f);
    for (int k = 0; k < 4 && k < n; k++)
        a.of[k] = columns == 3 && k < n - 1 ? TL_VQ_SHUFFLE(vq_load(p + 3 * k), vq_set1(0), 0, 1, 2, 4)
                                            : vq_load_some(p + columns * k, columns);
    return a;
}
TL_INLINE vq vq4_at(vq4 a, int k) { return a.of[k]; }
#define TL_VQ4_HAS_NO_STORE
#endif

#ifdef TL_VQ4_HAS_NO_STORE
/* Three numbers are stored as four: the next pixel overwrites the last number. */
TL_INLINE void vq4_store(float *p, vq4 a, int64_t n, int columns)
{
    for (int k = 0; k < 4 && k < n; k++) {
        const vq at = vq4_at(a, k);
        if (columns == 4 || (columns == 3 && k < n - 1 && k < 3))
            vq_store(p + columns * k, at);
        else
            memcpy(p + columns * k, &at, (size_t)columns * sizeof *p);
    }
}
#endif

/* The sum of each quad in all of its lanes: first + third, second + fourth, then both. */
TL_INLINE vq4 vq4_sum(vq4 a)
{
    a = vq4_add(a, TL_VQ4_PERMUTE(a, 2, 3, 0, 1));
    return vq4_add(a, TL_VQ4_PERMUTE(a, 1, 0, 3, 2));
}
#endif
