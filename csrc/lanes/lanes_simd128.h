/* Four lanes in 128 bits, masks as whole vectors of ones: NEON of aarch64, SIMD128 of WebAssembly, SSE4.1.
 *
 * Arithmetic, comparisons and shuffles are vectors of gcc and clang, one text for all three; intrinsics are used where
 * the three differ: minima, masks to bits, tables of bytes, roundings and conversions. */
#ifndef TL_LANES_SIMD128_H
#define TL_LANES_SIMD128_H

#include <stdint.h>
#include <string.h>
#if defined(__aarch64__)
#include <arm_neon.h>
#define TL_ON_NEON 1
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#define TL_ON_WASM 1
#else
#include <smmintrin.h>
#define TL_ON_SSE 1
#endif

#include "topleft.h"
#include "lanes/inline.h"

#define TL_LANES 4

typedef int32_t vi __attribute__((vector_size(16)));
typedef float vf __attribute__((vector_size(16)));
typedef vi vm;
typedef double v2d __attribute__((vector_size(16)));
typedef struct {
    v2d lo, hi;
} vd;
typedef uint32_t v4u __attribute__((vector_size(16)));
typedef uint16_t v8u __attribute__((vector_size(16)));
typedef uint8_t v16u __attribute__((vector_size(16)));
typedef int64_t v2l __attribute__((vector_size(16)));
typedef uint64_t v2u __attribute__((vector_size(16)));
/* in memory, at any address */
typedef int32_t vi_there __attribute__((vector_size(16), aligned(1), may_alias));
typedef float vf_there __attribute__((vector_size(16), aligned(1), may_alias));
typedef double v2d_there __attribute__((vector_size(16), aligned(1), may_alias));
typedef uint64_t v2u_there __attribute__((vector_size(16), aligned(1), may_alias));

#ifdef __clang__
#define TL_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#define TL_SHUFFLE_64 TL_SHUFFLE
#else
#define TL_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (vi){__VA_ARGS__})
#define TL_SHUFFLE_64(a, b, ...) __builtin_shuffle(a, b, (v2l){__VA_ARGS__})
#endif

TL_INLINE vi vi_set1(int32_t a) { return (vi){a, a, a, a}; }
TL_INLINE vi vi_load(const int32_t *p) { return *(const vi_there *)p; }
TL_INLINE void vi_store(int32_t *p, vi a) { *(vi_there *)p = a; }
TL_INLINE vi vi_iota(void) { return (vi){0, 1, 2, 3}; }
TL_INLINE vi vi_add(vi a, vi b) { return (vi)((v4u)a + (v4u)b); }
TL_INLINE vi vi_sub(vi a, vi b) { return (vi)((v4u)a - (v4u)b); }
TL_INLINE vi vi_mul(vi a, vi b) { return (vi)((v4u)a * (v4u)b); }
TL_INLINE vi vi_or(vi a, vi b) { return a | b; }
TL_INLINE vi vi_xor(vi a, vi b) { return a ^ b; }
TL_INLINE vi vi_and(vi a, vi b) { return a & b; }
TL_INLINE vi vi_add_halves(vi a, vi b) { return (vi)((v8u)a + (v8u)b); }
TL_INLINE vi vi_sub_halves(vi a, vi b) { return (vi)((v8u)a - (v8u)b); }
TL_INLINE vi vi_mul_halves(vi a, vi b) { return (vi)((v8u)a * (v8u)b); }
TL_INLINE vm vi_gt(vi a, vi b) { return (vm)(a > b); }
TL_INLINE vm vi_gt_unsigned(vi a, vi b) { return (vm)((v4u)a > (v4u)b); }
TL_INLINE vm vi_eq(vi a, vi b) { return (vm)(a == b); }
TL_INLINE vm vm_and(vm a, vm b) { return a & b; }
TL_INLINE vm vm_or(vm a, vm b) { return a | b; }
TL_INLINE vm vm_and_not(vm a, vm b) { return a & ~b; }
TL_INLINE vm vm_all(void) { return vi_set1(-1); }
TL_INLINE vf vf_set1(float a) { return (vf){a, a, a, a}; }
TL_INLINE vf vf_load(const float *p) { return *(const vf_there *)p; }
TL_INLINE void vf_store(float *p, vf a) { *(vf_there *)p = a; }
TL_INLINE vf vf_add(vf a, vf b) { return a + b; }
TL_INLINE vf vf_sub(vf a, vf b) { return a - b; }
TL_INLINE vf vf_mul(vf a, vf b) { return a * b; }
TL_INLINE vf vf_div(vf a, vf b) { return a / b; }
TL_INLINE vm vf_lt(vf a, vf b) { return (vm)(a < b); }
TL_INLINE vm vf_ge(vf a, vf b) { return (vm)(a >= b); }
TL_INLINE vm vf_eq(vf a, vf b) { return (vm)(a == b); }
TL_INLINE vi vi_bits_of_vf(vf a) { return (vi)a; }
TL_INLINE vf vf_of_bits(vi a) { return (vf)a; }
TL_INLINE vd vd_set1(double a) { return (vd){{a, a}, {a, a}}; }
TL_INLINE vd vd_add(vd a, vd b) { return (vd){a.lo + b.lo, a.hi + b.hi}; }
TL_INLINE vd vd_sub(vd a, vd b) { return (vd){a.lo - b.lo, a.hi - b.hi}; }
TL_INLINE vd vd_mul(vd a, vd b) { return (vd){a.lo * b.lo, a.hi * b.hi}; }
TL_INLINE vd vd_div(vd a, vd b) { return (vd){a.lo / b.lo, a.hi / b.hi}; }
TL_INLINE v2d v2d_load(const double *p) { return *(const v2d_there *)p; }
TL_INLINE void v2d_store(double *p, v2d a) { *(v2d_there *)p = a; }
TL_INLINE vd vd_load(const double *p) { return (vd){v2d_load(p), v2d_load(p + 2)}; }
TL_INLINE void vd_store(double *p, vd a) { v2d_store(p, a.lo), v2d_store(p + 2, a.hi); }

/* ---- different names in the three -------------------------------------------------------------------------------- */

#if defined(TL_ON_NEON)
TL_INLINE vi vi_min(vi a, vi b) { return (vi)vminq_s32((int32x4_t)a, (int32x4_t)b); }
TL_INLINE vi vi_max(vi a, vi b) { return (vi)vmaxq_s32((int32x4_t)a, (int32x4_t)b); }
TL_INLINE vi vi_shift_left(vi a, int n) { return (vi)vshlq_s32((int32x4_t)a, vdupq_n_s32(n)); }
TL_INLINE vi vi_shift_right(vi a, int n) { return (vi)vshlq_s32((int32x4_t)a, vdupq_n_s32(-n)); }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return (vi)vbslq_s32((uint32x4_t)m, (int32x4_t)a, (int32x4_t)b); }
TL_INLINE v2d v2d_select(v2l m, v2d a, v2d b) { return (v2d)vbslq_f64((uint64x2_t)m, (float64x2_t)a, (float64x2_t)b); }
TL_INLINE int vm_any(vm a) { return vmaxvq_u32((uint32x4_t)a) != 0; }
TL_INLINE unsigned vm_bits(vm a) { return vaddvq_u32((uint32x4_t)(a & (vi){1, 2, 4, 8})); }
TL_INLINE v16u v16_swizzle(v16u table, v16u i) { return (v16u)vqtbl1q_u8((uint8x16_t)table, (uint8x16_t)i); }
TL_INLINE vi vi_mul_high_halves(vi a, vi b)
{
    const uint16x8_t x = (uint16x8_t)a, y = (uint16x8_t)b;
    const uint32x4_t low = vmull_u16(vget_low_u16(x), vget_low_u16(y)), high = vmull_high_u16(x, y);
    return (vi)vuzp2q_u16(vreinterpretq_u16_u32(low), vreinterpretq_u16_u32(high));
}
/* (-2^15)^2 would saturate, but a is a difference of bytes */
TL_INLINE vi vi_scale_halves(vi a, vi b) { return (vi)vqrdmulhq_s16((int16x8_t)a, (int16x8_t)b); }
TL_INLINE vi vi_add_bytes(vi a, vi b) { return (vi)vqaddq_u8((uint8x16_t)a, (uint8x16_t)b); }
TL_INLINE vi vi_max_bytes(vi a, vi b) { return (vi)vmaxq_u8((uint8x16_t)a, (uint8x16_t)b); }
TL_INLINE vi vi_min_bytes(vi a, vi b) { return (vi)vminq_u8((uint8x16_t)a, (uint8x16_t)b); }
TL_INLINE vf vf_sqrt(vf a) { return (vf)vsqrtq_f32((float32x4_t)a); }
TL_INLINE v2d v2d_sqrt(v2d a) { return (v2d)vsqrtq_f64((float64x2_t)a); }
TL_INLINE v2d v2d_floor(v2d a) { return (v2d)vrndmq_f64((float64x2_t)a); }
TL_INLINE v2d v2d_nearest(v2d a) { return (v2d)vrndnq_f64((float64x2_t)a); }
TL_INLINE vf vf_nearest(vf a) { return (vf)vrndnq_f32((float32x4_t)a); }
/* the first number if it is less: fmin and fmax differ for NaN */
TL_INLINE vf vf_min(vf a, vf b) { return (vf)vbslq_f32((uint32x4_t)vf_lt(a, b), (float32x4_t)a, (float32x4_t)b); }
TL_INLINE vf vf_max(vf a, vf b) { return (vf)vbslq_f32((uint32x4_t)vf_lt(b, a), (float32x4_t)a, (float32x4_t)b); }
TL_INLINE v2d v2d_min(v2d a, v2d b) { return v2d_select((v2l)(a < b), a, b); }
TL_INLINE v2d v2d_max(v2d a, v2d b) { return v2d_select((v2l)(a > b), a, b); }
TL_INLINE vf vf_from_vi(vi a) { return (vf)vcvtq_f32_s32((int32x4_t)a); }
TL_INLINE vf vf_from_unsigned(vi a) { return (vf)vcvtq_f32_u32((uint32x4_t)a); }
TL_INLINE vd vd_from_vi(vi a)
{
    return (vd){(v2d)vcvtq_f64_s64(vmovl_s32(vget_low_s32((int32x4_t)a))),
                (v2d)vcvtq_f64_s64(vmovl_high_s32((int32x4_t)a))};
}
TL_INLINE vd vd_from_vf(vf a)
{
    return (vd){(v2d)vcvt_f64_f32(vget_low_f32((float32x4_t)a)), (v2d)vcvt_high_f64_f32((float32x4_t)a)};
}
TL_INLINE vf vf_from_vd(vd a) { return (vf)vcvt_high_f32_f64(vcvt_f32_f64((float64x2_t)a.lo), (float64x2_t)a.hi); }
/* conversions saturate: numbers out of range, and NaN, become INT32_MIN here */
TL_INLINE vi vi_in_range(vf a, int32x4_t b)
{
    return (vi)vbslq_s32(vcaltq_f32((float32x4_t)a, vdupq_n_f32(0x1p31f)), b, vdupq_n_s32(INT32_MIN));
}
TL_INLINE vi vi_in_range_64(vd a, int64x2_t lo, int64x2_t hi)
{
    const float64x2_t most = vdupq_n_f64(0x1p31);
    const uint32x4_t in = vuzp1q_u32(vreinterpretq_u32_u64(vcaltq_f64((float64x2_t)a.lo, most)),
                                     vreinterpretq_u32_u64(vcaltq_f64((float64x2_t)a.hi, most)));
    const int32x4_t b = vuzp1q_s32(vreinterpretq_s32_s64(lo), vreinterpretq_s32_s64(hi));
    return (vi)vbslq_s32(in, b, vdupq_n_s32(INT32_MIN));
}
TL_INLINE vi vi_floor(vf a) { return vi_in_range(a, vcvtmq_s32_f32((float32x4_t)a)); }
TL_INLINE vi vi_nearest(vf a) { return vi_in_range(a, vcvtnq_s32_f32((float32x4_t)a)); }
TL_INLINE vi vi_round(vd a)
{
    return vi_in_range_64(a, vcvtnq_s64_f64((float64x2_t)a.lo), vcvtnq_s64_f64((float64x2_t)a.hi));
}
TL_INLINE vi vi_ceil(vd a)
{
    return vi_in_range_64(a, vcvtpq_s64_f64((float64x2_t)a.lo), vcvtpq_s64_f64((float64x2_t)a.hi));
}
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return (vf)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b); }

#elif defined(TL_ON_WASM)
TL_INLINE vi vi_min(vi a, vi b) { return (vi)wasm_i32x4_min((v128_t)a, (v128_t)b); }
TL_INLINE vi vi_max(vi a, vi b) { return (vi)wasm_i32x4_max((v128_t)a, (v128_t)b); }
TL_INLINE vi vi_shift_left(vi a, int n) { return (vi)wasm_i32x4_shl((v128_t)a, (uint32_t)n); }
TL_INLINE vi vi_shift_right(vi a, int n) { return (vi)wasm_i32x4_shr((v128_t)a, (uint32_t)n); }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return (vi)wasm_v128_bitselect((v128_t)a, (v128_t)b, (v128_t)m); }
TL_INLINE v2d v2d_select(v2l m, v2d a, v2d b) { return (v2d)wasm_v128_bitselect((v128_t)a, (v128_t)b, (v128_t)m); }
TL_INLINE int vm_any(vm a) { return wasm_v128_any_true((v128_t)a); }
TL_INLINE unsigned vm_bits(vm a) { return (unsigned)wasm_i32x4_bitmask((v128_t)a); }
TL_INLINE v16u v16_swizzle(v16u table, v16u i) { return (v16u)wasm_i8x16_swizzle((v128_t)table, (v128_t)i); }
TL_INLINE vi vi_mul_high_halves(vi a, vi b)
{
    const v128_t low = wasm_u32x4_extmul_low_u16x8((v128_t)a, (v128_t)b);
    const v128_t high = wasm_u32x4_extmul_high_u16x8((v128_t)a, (v128_t)b);
    return (vi)wasm_i16x8_shuffle(low, high, 1, 3, 5, 7, 9, 11, 13, 15);
}
TL_INLINE vi vi_scale_halves(vi a, vi b) { return (vi)wasm_i16x8_q15mulr_sat((v128_t)a, (v128_t)b); }
TL_INLINE vi vi_add_bytes(vi a, vi b) { return (vi)wasm_u8x16_add_sat((v128_t)a, (v128_t)b); }
TL_INLINE vi vi_max_bytes(vi a, vi b) { return (vi)wasm_u8x16_max((v128_t)a, (v128_t)b); }
TL_INLINE vi vi_min_bytes(vi a, vi b) { return (vi)wasm_u8x16_min((v128_t)a, (v128_t)b); }
TL_INLINE vf vf_sqrt(vf a) { return (vf)wasm_f32x4_sqrt((v128_t)a); }
TL_INLINE v2d v2d_sqrt(v2d a) { return (v2d)wasm_f64x2_sqrt((v128_t)a); }
TL_INLINE v2d v2d_floor(v2d a) { return (v2d)wasm_f64x2_floor((v128_t)a); }
TL_INLINE v2d v2d_nearest(v2d a) { return (v2d)wasm_f64x2_nearest((v128_t)a); }
TL_INLINE vf vf_nearest(vf a) { return (vf)wasm_f32x4_nearest((v128_t)a); }
/* pmin(x, y) is y < x ? y : x */
TL_INLINE vf vf_min(vf a, vf b) { return (vf)wasm_f32x4_pmin((v128_t)b, (v128_t)a); }
TL_INLINE vf vf_max(vf a, vf b) { return (vf)wasm_f32x4_pmax((v128_t)b, (v128_t)a); }
TL_INLINE v2d v2d_min(v2d a, v2d b) { return (v2d)wasm_f64x2_pmin((v128_t)b, (v128_t)a); }
TL_INLINE v2d v2d_max(v2d a, v2d b) { return (v2d)wasm_f64x2_pmax((v128_t)b, (v128_t)a); }
TL_INLINE vf vf_from_vi(vi a) { return (vf)wasm_f32x4_convert_i32x4((v128_t)a); }
TL_INLINE vf vf_from_unsigned(vi a) { return (vf)wasm_f32x4_convert_u32x4((v128_t)a); }
TL_INLINE vd vd_from_vi(vi a)
{
    return (vd){(v2d)wasm_f64x2_convert_low_i32x4((v128_t)a),
                (v2d)wasm_f64x2_convert_low_i32x4((v128_t)TL_SHUFFLE(a, a, 2, 3, 2, 3))};
}
TL_INLINE vd vd_from_vf(vf a)
{
    return (vd){(v2d)wasm_f64x2_promote_low_f32x4((v128_t)a),
                (v2d)wasm_f64x2_promote_low_f32x4((v128_t)TL_SHUFFLE(a, a, 2, 3, 2, 3))};
}
TL_INLINE vf vf_from_vd(vd a)
{
    const vf lo = (vf)wasm_f32x4_demote_f64x2_zero((v128_t)a.lo), hi = (vf)wasm_f32x4_demote_f64x2_zero((v128_t)a.hi);
    return TL_SHUFFLE(lo, hi, 0, 1, 4, 5);
}
TL_INLINE vi vi_in_range(vf a)
{
    const v128_t in = wasm_f32x4_lt(wasm_f32x4_abs((v128_t)a), wasm_f32x4_splat(0x1p31f));
    return vi_select((vm)in, (vi)wasm_i32x4_trunc_sat_f32x4((v128_t)a), vi_set1(INT32_MIN));
}
TL_INLINE vi vi_floor(vf a) { return vi_in_range((vf)wasm_f32x4_floor((v128_t)a)); }
TL_INLINE vi vi_nearest(vf a) { return vi_in_range(vf_nearest(a)); }
/* The bits of 0x1.8p52 + n, |n| < 2^31, are 0x43380000 << 32, and n as 64 bits, added. */
TL_INLINE vi vi_round(vd a)
{
    const vi lo = (vi)(a.lo + 0x1.8p52), hi = (vi)(a.hi + 0x1.8p52);
    const vi n = TL_SHUFFLE(lo, hi, 0, 2, 4, 6), sign = TL_SHUFFLE(lo, hi, 1, 3, 5, 7);
    return vi_select((vm)(sign == (n >> 31) + 0x43380000), n, vi_set1(INT32_MIN));
}
TL_INLINE vi vi_ceil(vd a)
{
    return vi_round((vd){(v2d)wasm_f64x2_ceil((v128_t)a.lo), (v2d)wasm_f64x2_ceil((v128_t)a.hi)});
}

#else
TL_INLINE vi vi_min(vi a, vi b) { return (vi)_mm_min_epi32((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_max(vi a, vi b) { return (vi)_mm_max_epi32((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_shift_left(vi a, int n) { return (vi)_mm_sll_epi32((__m128i)a, _mm_cvtsi32_si128(n)); }
TL_INLINE vi vi_shift_right(vi a, int n) { return (vi)_mm_sra_epi32((__m128i)a, _mm_cvtsi32_si128(n)); }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return (vi)_mm_blendv_epi8((__m128i)b, (__m128i)a, (__m128i)m); }
TL_INLINE v2d v2d_select(v2l m, v2d a, v2d b) { return (v2d)_mm_blendv_pd((__m128d)b, (__m128d)a, (__m128d)m); }
TL_INLINE int vm_any(vm a) { return !_mm_testz_si128((__m128i)a, (__m128i)a); }
TL_INLINE unsigned vm_bits(vm a) { return (unsigned)_mm_movemask_ps((__m128)a); }
TL_INLINE v16u v16_swizzle(v16u table, v16u i) { return (v16u)_mm_shuffle_epi8((__m128i)table, (__m128i)i); }
TL_INLINE vi vi_mul_high_halves(vi a, vi b) { return (vi)_mm_mulhi_epu16((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_scale_halves(vi a, vi b) { return (vi)_mm_mulhrs_epi16((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_add_bytes(vi a, vi b) { return (vi)_mm_adds_epu8((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_max_bytes(vi a, vi b) { return (vi)_mm_max_epu8((__m128i)a, (__m128i)b); }
TL_INLINE vi vi_min_bytes(vi a, vi b) { return (vi)_mm_min_epu8((__m128i)a, (__m128i)b); }
TL_INLINE vf vf_sqrt(vf a) { return (vf)_mm_sqrt_ps((__m128)a); }
TL_INLINE v2d v2d_sqrt(v2d a) { return (v2d)_mm_sqrt_pd((__m128d)a); }
TL_INLINE v2d v2d_floor(v2d a) { return (v2d)_mm_floor_pd((__m128d)a); }
enum { TL_NEAREST = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }; /* clang needs a constant expression */
TL_INLINE v2d v2d_nearest(v2d a) { return (v2d)_mm_round_pd((__m128d)a, TL_NEAREST); }
TL_INLINE vf vf_nearest(vf a) { return (vf)_mm_round_ps((__m128)a, TL_NEAREST); }
TL_INLINE vf vf_min(vf a, vf b) { return (vf)_mm_min_ps((__m128)a, (__m128)b); }
TL_INLINE vf vf_max(vf a, vf b) { return (vf)_mm_max_ps((__m128)a, (__m128)b); }
TL_INLINE v2d v2d_min(v2d a, v2d b) { return (v2d)_mm_min_pd((__m128d)a, (__m128d)b); }
TL_INLINE v2d v2d_max(v2d a, v2d b) { return (v2d)_mm_max_pd((__m128d)a, (__m128d)b); }
TL_INLINE vf vf_from_vi(vi a) { return (vf)_mm_cvtepi32_ps((__m128i)a); }
/* the upper half scales without loss, so the sum is the only rounding */
TL_INLINE vf vf_from_unsigned(vi a) { return vf_from_vi((vi)((v4u)a >> 16)) * 65536.0f + vf_from_vi(a & 0xffff); }
TL_INLINE vd vd_from_vi(vi a)
{
    return (vd){(v2d)_mm_cvtepi32_pd((__m128i)a), (v2d)_mm_cvtepi32_pd(_mm_shuffle_epi32((__m128i)a, 0xee))};
}
TL_INLINE vd vd_from_vf(vf a)
{
    return (vd){(v2d)_mm_cvtps_pd((__m128)a), (v2d)_mm_cvtps_pd(_mm_movehl_ps((__m128)a, (__m128)a))};
}
TL_INLINE vf vf_from_vd(vd a) { return (vf)_mm_movelh_ps(_mm_cvtpd_ps((__m128d)a.lo), _mm_cvtpd_ps((__m128d)a.hi)); }
TL_INLINE vi vi_floor(vf a) { return (vi)_mm_cvtps_epi32(_mm_floor_ps((__m128)a)); }
TL_INLINE vi vi_nearest(vf a) { return (vi)_mm_cvtps_epi32((__m128)a); }
TL_INLINE vi vi_round(vd a)
{
    return (vi)_mm_unpacklo_epi64(_mm_cvtpd_epi32((__m128d)a.lo), _mm_cvtpd_epi32((__m128d)a.hi));
}
TL_INLINE vi vi_ceil(vd a) { return vi_round((vd){(v2d)_mm_ceil_pd((__m128d)a.lo), (v2d)_mm_ceil_pd((__m128d)a.hi)}); }
#endif

/* ---- numbers and masks ------------------------------------------------------------------------------------------- */

TL_INLINE vi vi_upper_bytes(vi a) { return (vi)((v8u)a >> 8); }
TL_INLINE vi vi_high_half(vi a) { return (vi)((v4u)a >> 16); }
TL_INLINE vf vf_select(vm m, vf a, vf b) { return (vf)vi_select(m, (vi)a, (vi)b); }
TL_INLINE vm vm_first(int64_t n) { return (vm)(vi_set1(n > 4 ? 4 : (int)n) > vi_iota()); }
TL_INLINE vm vm_from_bits(unsigned bits)
{
    const vi lane = {1, 2, 4, 8};
    return (vm)((vi_set1((int)bits) & lane) == lane);
}

/* Masked loads and stores touch no more than their lanes. */
TL_INLINE vi vi_load_masked(vm m, const int32_t *p)
{
    const unsigned bits = vm_bits(m);
    if (bits == 15)
        return vi_load(p);
    int32_t a[4] = {0, 0, 0, 0};
    for (int k = 0; k < 4; k++)
        if (bits >> k & 1)
            memcpy(a + k, p + k, sizeof *a);
    return (vi){a[0], a[1], a[2], a[3]};
}
TL_INLINE void vi_store_masked(int32_t *p, vm m, vi a)
{
    const unsigned bits = vm_bits(m);
    if (bits == 15) {
        vi_store(p, a);
        return;
    }
    for (int k = 0; k < 4; k++) {
        const int32_t one = a[k];
        if (bits >> k & 1)
            memcpy(p + k, &one, sizeof one);
    }
}
TL_INLINE vf vf_load_masked(vm m, const float *p) { return (vf)vi_load_masked(m, (const int32_t *)p); }
TL_INLINE void vf_store_masked(float *p, vm m, vf a) { vi_store_masked((int32_t *)p, m, (vi)a); }
TL_INLINE vi vi_gather(vm m, const int32_t *p, vi i)
{
    const unsigned bits = vm_bits(m);
    int32_t a[4] = {0, 0, 0, 0};
    for (int k = 0; k < 4; k++)
        if (bits >> k & 1)
            a[k] = int32_at(p, i[k]);
    return (vi){a[0], a[1], a[2], a[3]};
}
static const uint8_t compress_order[16][16] __attribute__((aligned(16))) = {
    {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},       {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},
    {4, 5, 6, 7, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},       {0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 0, 1, 2, 3},
    {8, 9, 10, 11, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},     {0, 1, 2, 3, 8, 9, 10, 11, 0, 1, 2, 3, 0, 1, 2, 3},
    {4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 0, 1, 2, 3},     {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3},
    {12, 13, 14, 15, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},   {0, 1, 2, 3, 12, 13, 14, 15, 0, 1, 2, 3, 0, 1, 2, 3},
    {4, 5, 6, 7, 12, 13, 14, 15, 0, 1, 2, 3, 0, 1, 2, 3},   {0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15, 0, 1, 2, 3},
    {8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 0, 1, 2, 3}, {0, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3},
    {4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
};
TL_INLINE void vi_pack(int32_t *p, vm m, vi a)
{
    v16u order;
    memcpy(&order, compress_order[vm_bits(m)], sizeof order);
    vi_store(p, (vi)v16_swizzle((v16u)a, order));
}

/* Four int32. */
typedef vi v4;
TL_INLINE v4 v4_zero(void) { return vi_set1(0); }
TL_INLINE v4 v4_load(const int32_t *p) { return vi_load(p); }
TL_INLINE void v4_store(int32_t *p, v4 a) { vi_store(p, a); }
TL_INLINE v4 v4_add(v4 a, v4 b) { return vi_add(a, b); }
TL_INLINE v4 v4_or(v4 a, v4 b) { return a | b; }
TL_INLINE void transpose_quads(const vi *a, vi *b)
{
    const v2l low01 = (v2l)TL_SHUFFLE(a[0], a[1], 0, 4, 1, 5), high01 = (v2l)TL_SHUFFLE(a[0], a[1], 2, 6, 3, 7);
    const v2l low23 = (v2l)TL_SHUFFLE(a[2], a[3], 0, 4, 1, 5), high23 = (v2l)TL_SHUFFLE(a[2], a[3], 2, 6, 3, 7);
    b[0] = (vi)TL_SHUFFLE_64(low01, low23, 0, 2);
    b[1] = (vi)TL_SHUFFLE_64(low01, low23, 1, 3);
    b[2] = (vi)TL_SHUFFLE_64(high01, high23, 0, 2);
    b[3] = (vi)TL_SHUFFLE_64(high01, high23, 1, 3);
}
TL_INLINE void vi_load_quads(const int32_t *p, vi *c)
{
    const vi rows[4] = {vi_load(p), vi_load(p + 4), vi_load(p + 8), vi_load(p + 12)};
    transpose_quads(rows, c);
}
TL_INLINE void vi_store_quads(int32_t *p, const vi *c)
{
    vi rows[4];
    transpose_quads(c, rows);
    for (int k = 0; k < 4; k++)
        vi_store(p + 4 * k, rows[k]);
}
TL_INLINE vi vi_prefix_sum(vi a)
{
    const vi zero = vi_set1(0);
    a = vi_add(a, TL_SHUFFLE(zero, a, 3, 4, 5, 6));
    return vi_add(a, TL_SHUFFLE(zero, a, 2, 3, 4, 5));
}
TL_INLINE vi vi_last(vi a) { return TL_SHUFFLE(a, a, 3, 3, 3, 3); }
TL_INLINE vi vi_shift_in(vi a, vi before) { return TL_SHUFFLE(before, a, 3, 4, 5, 6); }
TL_INLINE vi vi_prefix_count(unsigned bits) { return vi_prefix_sum(vi_sub(vi_set1(0), vm_from_bits(bits))); }

/* 64 bytes of 0 or 1 */
TL_INLINE void bytes_from_bits(uint8_t *p, uint64_t bits)
{
    const v16u lane = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    const v16u spread = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
    for (int k = 0; k < 4; k++) {
        const v16u bytes = v16_swizzle((v16u)vi_set1((int)(bits >> 16 * k & 0xffff)), spread);
        const v16u out = (v16u)((bytes & lane) == lane) & 1;
        memcpy(p + 16 * k, &out, sizeof out);
    }
}

/* TL_LANES words of 64 bits; vw_add_range sets the bits [begin, end) that are in the pattern; begin, end >= 0. */
typedef struct {
    v2u lo, hi;
} vw;
TL_INLINE vw vw_zero(void) { return (vw){{0, 0}, {0, 0}}; }
TL_INLINE vw vw_load(const uint64_t *p) { return (vw){*(const v2u_there *)p, *(const v2u_there *)(p + 2)}; }
TL_INLINE void vw_store(uint64_t *p, vw a) { *(v2u_there *)p = a.lo, *(v2u_there *)(p + 2) = a.hi; }
#ifdef TL_ON_NEON
TL_INLINE v2u ones_from_bit(int32x2_t n) { return (v2u)vshlq_u64(vdupq_n_u64(~0ull), vmovl_s32(n)); }
TL_INLINE vw vw_add_range(vw a, vi begin, vi end, uint64_t pattern)
{
    const int32x4_t most = vdupq_n_s32(64), b = vminq_s32((int32x4_t)begin, most), e = vminq_s32((int32x4_t)end, most);
    const v2u lo = ones_from_bit(vget_low_s32(b)) & ~ones_from_bit(vget_low_s32(e));
    const v2u hi = ones_from_bit(vget_high_s32(b)) & ~ones_from_bit(vget_high_s32(e));
    return (vw){a.lo | (lo & pattern), a.hi | (hi & pattern)};
}
#else
TL_INLINE uint64_t bit_range_64(int32_t begin, int32_t end)
{
    return begin < end && begin < 64 ? ~0ull << begin & ~0ull >> (end < 64 ? 64 - end : 0) : 0;
}
TL_INLINE vw vw_add_range(vw a, vi begin, vi end, uint64_t pattern)
{
    const v2u lo = {bit_range_64(begin[0], end[0]), bit_range_64(begin[1], end[1])};
    const v2u hi = {bit_range_64(begin[2], end[2]), bit_range_64(begin[3], end[3])};
    return (vw){a.lo | (lo & pattern), a.hi | (hi & pattern)};
}
#endif

/* Numbers with bits [begin, end) set, none where begin >= end; begin >= 0, end in 0..31. */
#if defined(TL_ON_NEON)
TL_INLINE vi vi_bit_ranges(vi begin, vi end)
{
    const uint32x4_t ones = vdupq_n_u32(~0u);
    return (vi)vbicq_u32(vshlq_u32(ones, vminq_s32((int32x4_t)begin, vdupq_n_s32(32))),
                         vshlq_u32(ones, (int32x4_t)end));
}
#else
#if defined(TL_ON_WASM) /* the one byte that has bit n */
TL_INLINE vi power_of_two(vi n)
{
    const v16u every =
        (v16u)wasm_i8x16_shuffle((v128_t)n, (v128_t)n, 0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
    const v16u table = {1, 2, 4, 8, 16, 32, 64, 128}, before = {0, 8, 16, 24, 0, 8, 16, 24, 0, 8, 16, 24, 0, 8, 16, 24};
    return (vi)v16_swizzle(table, every - before);
}
#else                   /* as a float: 2^31, out of range, becomes INT32_MIN, with the same bits */
TL_INLINE vi power_of_two(vi n) { return (vi)_mm_cvttps_epi32((__m128)((n + 127) << 23)); }
#endif
TL_INLINE vi vi_bit_ranges(vi begin, vi end)
{
    return vi_sub(power_of_two(end), power_of_two(begin)) & (vi)(end > begin);
}
#endif

TL_INLINE vf vf_last_of(vf a, int n) { return n == 4 ? TL_SHUFFLE(a, a, 3, 3, 3, 3) : TL_SHUFFLE(a, a, 1, 1, 3, 3); }
TL_INLINE vf vf_min_size(vf a, vf b) { return vf_min(a, (vf)((vi)b & INT32_MAX)); }
TL_INLINE vf vf_off_integer(vf a) { return a - vf_nearest(a); }

/* ---- float64 ----------------------------------------------------------------------------------------------------- */

TL_INLINE v2d v2d_abs(v2d a) { return (v2d)((v2l)a & INT64_MAX); }
TL_INLINE vd vd_abs(vd a) { return (vd){v2d_abs(a.lo), v2d_abs(a.hi)}; }
TL_INLINE vd vd_floor(vd a) { return (vd){v2d_floor(a.lo), v2d_floor(a.hi)}; }
TL_INLINE vd vd_sqrt(vd a) { return (vd){v2d_sqrt(a.lo), v2d_sqrt(a.hi)}; }
TL_INLINE vd vd_min(vd a, vd b) { return (vd){v2d_min(a.lo, b.lo), v2d_min(a.hi, b.hi)}; }
TL_INLINE vd vd_max(vd a, vd b) { return (vd){v2d_max(a.lo, b.lo), v2d_max(a.hi, b.hi)}; }
TL_INLINE vi vi_low_bits(vd a) { return TL_SHUFFLE((vi)a.lo, (vi)a.hi, 0, 2, 4, 6); }
TL_INLINE vm vd_ge(vd a, vd b) { return vi_low_bits((vd){(v2d)(a.lo >= b.lo), (v2d)(a.hi >= b.hi)}); }
TL_INLINE vd vd_select(vm m, vd a, vd b)
{
    const v2l lo = (v2l)TL_SHUFFLE(m, m, 0, 0, 1, 1), hi = (v2l)TL_SHUFFLE(m, m, 2, 2, 3, 3);
    return (vd){v2d_select(lo, a.lo, b.lo), v2d_select(hi, a.hi, b.hi)};
}
#ifdef TL_ON_NEON
/* a[k] / b for three a, each correctly rounded, for |b| and |a / b| within 2^+-500: one division; see lanes_avx2.h. */
TL_INLINE v2d one_quotient(v2d a, v2d b, v2d inverse, int are_f32)
{
    const float64x2_t x = (float64x2_t)a, y = (float64x2_t)b, r = (float64x2_t)inverse;
    float64x2_t q = vmulq_f64(x, r);
    if (!are_f32)
        q = vfmaq_f64(q, vfmsq_f64(x, q, y), r);
    return (v2d)vfmaq_f64(q, vfmsq_f64(x, q, y), r);
}
TL_INLINE void vd_quotients(const vd *a, vd b, vd *q, int are_f32)
{
    const vd inverse = vd_div(vd_set1(1.0), b);
    for (int k = 0; k < 3; k++)
        q[k] = (vd){one_quotient(a[k].lo, b.lo, inverse.lo, are_f32), one_quotient(a[k].hi, b.hi, inverse.hi, are_f32)};
}
#else
TL_INLINE void vd_quotients(const vd *a, vd b, vd *q, int are_f32)
{
    (void)are_f32;
    for (int k = 0; k < 3; k++)
        q[k] = vd_div(a[k], b);
}
#endif
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask)
{
    return (vd){(v2d)(sum - ((v2u)a.lo & mask)), (v2d)(sum - ((v2u)a.hi & mask))};
}
TL_INLINE vd vd_or(vd a, vd b) { return (vd){(v2d)((v2l)a.lo | (v2l)b.lo), (v2d)((v2l)a.hi | (v2l)b.hi)}; }
TL_INLINE vd vd_off_integer(vd a) { return (vd){a.lo - v2d_nearest(a.lo), a.hi - v2d_nearest(a.hi)}; }

#ifndef TL_ON_NEON
/* The double nearest to the sum of a product, which float64 holds, and a number, but odd if it is not exact: then
 * rounding it to float32 rounds the exact sum.  Based on: S. Boldo, G. Melquiond, Emulation of a FMA and correctly
 * rounded sums: proved algorithms using rounding to odd, 2008. */
TL_INLINE v2d sum_to_odd(v2d a, v2d b)
{
    const v2d sum = a + b, rest = sum - a, error = (a - (sum - rest)) + (b - rest);
    const v2u bits = (v2u)sum, away = (((v2u)error ^ bits) >> 63) * 2; /* 0: the exact sum is farther from zero */
    const v2u is_odd = (v2u)((v2l)(error < 0) | (v2l)(error > 0)) & ((bits & 1) - 1); /* NaN for infinities */
    return (v2d)(bits + ((1 - away) & is_odd));
}
/* Once in 2^29 the sum in float64 is the middle between two float32; below 2^-126 other sums are middles. */
TL_INLINE vf vf_fma(vf a, vf b, vf c)
{
    const vd product = vd_mul(vd_from_vf(a), vd_from_vf(b)), addend = vd_from_vf(c);
    vd sum = vd_add(product, addend);
    const vi low = TL_SHUFFLE((vi)sum.lo, (vi)sum.hi, 0, 2, 4, 6);
    const v4u high = (v4u)TL_SHUFFLE((vi)sum.lo, (vi)sum.hi, 1, 3, 5, 7);
    const vm is_middle = (vm)((low & 0x1fffffff) == 0x10000000);
    const vm is_tiny = (vm)((vi)(high + high + INT32_MAX) < INT32_MIN + 0x701fffff); /* 0 < 2 * high < 0x70200000 */
    if (__builtin_expect(vm_any(is_middle | is_tiny), 0))
        sum = (vd){sum_to_odd(product.lo, addend.lo), sum_to_odd(product.hi, addend.hi)};
    return vf_from_vd(sum);
}
#endif

/* ---- tables and memory ------------------------------------------------------------------------------------------- */

#define TL_PICK(NAME, V, NUMBER, LAST)                  \
    TL_INLINE V NAME(const NUMBER *p, vi i)             \
    {                                                   \
        i &= LAST;                                      \
        return (V){p[i[0]], p[i[1]], p[i[2]], p[i[3]]}; \
    }
TL_PICK(vi_lookup, vi, int32_t, 15)
TL_PICK(vf_lookup, vf, float, 15)
TL_PICK(vf_pick, vf, float, 3)
TL_PICK(vi_pick, vi, int32_t, 3)
TL_INLINE vd vd_pick(const double *p, vi i)
{
    i &= 3;
    return (vd){{p[i[0]], p[i[1]]}, {p[i[2]], p[i[3]]}};
}

TL_INLINE v2d low_two(v2d a, v2d b) { return TL_SHUFFLE_64(a, b, 0, 2); }
TL_INLINE v2d high_two(v2d a, v2d b) { return TL_SHUFFLE_64(a, b, 1, 3); }

/* Loads the vertices first[step * lane] of TL_LANES pairs or triangles. */
typedef vd vz;
TL_INLINE void load_vertices_by(int step, const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    const vi_there *rows = (const vi_there *)v;
    const vi a = rows[first[0]], b = rows[first[step]], c = rows[first[2 * step]], d = rows[first[3 * step]];
    const v2d ab = (v2d)TL_SHUFFLE(a, b, 0, 4, 1, 5), cd = (v2d)TL_SHUFFLE(c, d, 0, 4, 1, 5);
    *x = (vi)low_two(ab, cd);
    *y = (vi)high_two(ab, cd);
    *z = (vz){high_two((v2d)a, (v2d)b), high_two((v2d)c, (v2d)d)};
}
TL_INLINE vd vd_from_vz(vz z) { return z; }
TL_INLINE void store_vertices(tl_vertex *v, vi x, vi y, vd z)
{
    const v2d low = (v2d)TL_SHUFFLE(x, y, 0, 4, 1, 5), high = (v2d)TL_SHUFFLE(x, y, 2, 6, 3, 7);
    const v2d rows[4] = {low_two(low, z.lo), high_two(low, z.lo), low_two(high, z.hi), high_two(high, z.hi)};
    for (int k = 0; k < 4; k++)
        v2d_store((double *)(v + k), rows[k]);
}

/* The first four numbers of TL_LANES rows, as columns; reads up to two numbers past the last row. */
TL_INLINE void load_columns_f32(const float *p, int stride, vf *columns)
{
    const vi rows[4] = {(vi)vf_load(p), (vi)vf_load(p + stride), (vi)vf_load(p + 2 * stride),
                        (vi)vf_load(p + 3 * stride)};
    vi c[4];
    transpose_quads(rows, c);
    for (int k = 0; k < 4; k++)
        columns[k] = (vf)c[k];
}
/* Four rows of four as columns. */
TL_INLINE void columns_of_rows(const double *const *row, vd *c)
{
    for (int k = 0; k < 4; k += 2) {
        const v2d a = v2d_load(row[0] + k), b = v2d_load(row[1] + k), d = v2d_load(row[2] + k),
                  e = v2d_load(row[3] + k);
        c[k] = (vd){low_two(a, b), low_two(d, e)}, c[k + 1] = (vd){high_two(a, b), high_two(d, e)};
    }
}
TL_INLINE void load_columns_f64(const double *p, int stride, vd *columns)
{
    const double *const rows[4] = {p, p + stride, p + 2 * stride, p + 3 * stride};
    columns_of_rows(rows, columns);
}

TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    vi rows[4];
    for (int k = 0; k < 4; k++)
        rows[k] = *(const vi_there *)((const char *)base + (uint64_t)(uint32_t)i[k] * (uint64_t)scale);
    transpose_quads(rows, c);
}
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c)
{
    double pair[4];
    for (int k = 0; k < 4; k++)
        memcpy(pair + k, (const char *)base + (int64_t)i[k] * 8, 8);
    const vf low = (vf)(v2d){pair[0], pair[1]}, high = (vf)(v2d){pair[2], pair[3]};
    c[0] = TL_SHUFFLE(low, high, 0, 2, 4, 6), c[1] = TL_SHUFFLE(low, high, 1, 3, 5, 7);
}
/* Writes TL_LANES rows of four with the fourth column replaced. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    vf_store(out, TL_SHUFFLE(vf_load(rows), fourth, 0, 1, 2, 4));
    vf_store(out + 4, TL_SHUFFLE(vf_load(rows + 4), fourth, 0, 1, 2, 5));
    vf_store(out + 8, TL_SHUFFLE(vf_load(rows + 8), fourth, 0, 1, 2, 6));
    vf_store(out + 12, TL_SHUFFLE(vf_load(rows + 12), fourth, 0, 1, 2, 7));
}
/* Stores consecutive pixels of two and of three numbers. */
TL_INLINE void vf_store_pairs(float *p, const vf *c)
{
    vf_store(p, TL_SHUFFLE(c[0], c[1], 0, 4, 1, 5)), vf_store(p + 4, TL_SHUFFLE(c[0], c[1], 2, 6, 3, 7));
}
TL_INLINE void vf_store_triples(float *p, const vf *c)
{
#ifdef TL_ON_NEON
    vst3q_f32(p, ((float32x4x3_t){{(float32x4_t)c[0], (float32x4_t)c[1], (float32x4_t)c[2]}}));
#else
    const vf xy0 = TL_SHUFFLE(c[0], c[1], 0, 4, 1, 5), zx = TL_SHUFFLE(c[2], c[0], 0, 5, 2, 7);
    const vf yz = TL_SHUFFLE(c[1], c[2], 1, 5, 3, 7), xy2 = TL_SHUFFLE(c[0], c[1], 2, 6, 3, 7);
    vf_store(p, TL_SHUFFLE(xy0, zx, 0, 1, 4, 5));
    vf_store(p + 4, TL_SHUFFLE(yz, xy2, 0, 1, 4, 5));
    vf_store(p + 8, TL_SHUFFLE(zx, yz, 2, 3, 6, 7));
#endif
}
/* Four doubles at base + 8 * stride * i[k], as columns. */
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c)
{
    const double *rows[4];
    for (int k = 0; k < 4; k++)
        rows[k] = base + (int64_t)i[k] * stride;
    columns_of_rows(rows, c);
}
/* Pairs, and rows of three, at base + 8 * stride * first[3 * lane]. */
TL_INLINE void vd_load_pairs(const double *base, int stride, const int32_t *first, vd *x, vd *y)
{
    v2d row[4];
    for (int k = 0; k < 4; k++)
        row[k] = v2d_load(base + (int64_t)first[3 * k] * stride);
    *x = (vd){low_two(row[0], row[1]), low_two(row[2], row[3])};
    *y = (vd){high_two(row[0], row[1]), high_two(row[2], row[3])};
}
TL_INLINE void vd_load_triples(const double *base, const int32_t *first, vd *x, vd *y, vd *z)
{
    vd_load_pairs(base, 3, first, x, y);
    double third[4];
    for (int k = 0; k < 4; k++)
        third[k] = base[(int64_t)first[3 * k] * 3 + 2];
    *z = (vd){{third[0], third[1]}, {third[2], third[3]}};
}
TL_INLINE void vd_load_places(const double *base, const int32_t *first, vd *x, vd *y, vd *z, vi *a, vi *b)
{
    const double *rows[4];
    vd c[4];
    for (int k = 0; k < 4; k++)
        rows[k] = base + (int64_t)first[3 * k] * 4;
    columns_of_rows(rows, c);
    *x = c[0], *y = c[1], *z = c[2];
    *a = TL_SHUFFLE((vi)c[3].lo, (vi)c[3].hi, 0, 2, 4, 6);
    *b = TL_SHUFFLE((vi)c[3].lo, (vi)c[3].hi, 1, 3, 5, 7);
}
TL_INLINE void vd_store_quads(double *p, int64_t stride, const vd *c)
{
    for (int k = 0; k < 4; k += 2) {
        v2d_store(p + k, low_two(c[k].lo, c[k + 1].lo)), v2d_store(p + stride + k, high_two(c[k].lo, c[k + 1].lo));
        v2d_store(p + 2 * stride + k, low_two(c[k].hi, c[k + 1].hi));
        v2d_store(p + 3 * stride + k, high_two(c[k].hi, c[k + 1].hi));
    }
}
TL_INLINE void vd_store_places(double *p, vd x, vd y, vd z, vi a, vi b)
{
    const vd ab = {(v2d)TL_SHUFFLE(a, b, 0, 4, 1, 5), (v2d)TL_SHUFFLE(a, b, 2, 6, 3, 7)};
    vd_store_quads(p, 4, (const vd[]){x, y, z, ab});
}

#endif
