/* Vector lanes: one set of names for every instruction set, so that each kernel is written once.
 *
 *   vi  TL_LANES int32      vf  TL_LANES float32      vd  TL_LANES float64      vm  TL_LANES bits
 *
 * Arithmetic is IEEE, rounded to nearest, multiply and add apart: every instruction set gives equal bits.  The
 * scalar lanes (TL_LANES = 1) are the definition.  vd_quotients(a, b, q, are_f32) divides three numbers by one, each
 * correctly rounded.  Loads and stores need no alignment.  Intrinsics live in lanes_*.h alone.
 *
 *   v?_set1 v?_load v?_store v?_iota v?_add v?_sub v?_mul v?_div v?_min v?_max vf_sqrt   as their names say; vi wraps
 *   v?_select(m, a, b)      a where m, else b
 *   v?_load_masked, v?_store_masked    touch only the memory of lanes in m
 *   v?_load_some(m, p, has_room)    the lanes in m; with room for a vector other lanes are read, too, or undefined
 *   v?_store_some(p, m, a, has_room)    the lanes in m; with room for a vector other lanes may be written unchanged
 *   vi_gather(m, p, i)      p[i] in the lanes of m; reads p[0], too, where m has lanes; p may be unaligned
 *   vi_compress(p, m, v)    the lanes in m, packed, at p; writes a whole vector, and returns how many lanes
 *   vm_first(n)             the first n lanes, none for n <= 0, all for n >= TL_LANES
 *   v4_, vi_load_quads, vi_store_quads    four int32; TL_LANES of them as four vectors, lane k in slot vi_quad_slot(k)
 *   vw_zero, vw_load, vw_store, vw_add_range    TL_LANES words of 64 bits
 *   vi_prefix_sum, vi_last  sums of lanes [0, k]; the last lane everywhere
 *   vi_shift_in(a, before)  a one lane up, the last lane of `before` in lane 0
 *   vf_fma(a, b, c)         a * b + c, rounded once
 *   vf_min, vf_max          the second number when one is NaN
 *   vf_min_size(a, b)       the lesser of a >= 0 and |b|, which are not NaN
 *   v?_lookup(table, i)     table[i & 15] of sixteen numbers
 *   v?_pick(p, i)           p[i] of TL_LANES consecutive numbers
 *   vi_prefix_count(bits)   how many of the bits [0, k] are set
 *   vi_spill(p, a)          a store of lanes that are then read one by one
 *   vd_power(a, sum, mask)  the number with bits of `sum` less the bits of a in `mask`
 *   vd_load_records(base, stride, i, c)    four doubles at base + 8 * stride * i[k], as columns
 *   vd_store_quads(p, stride, c)    four columns of doubles as rows of four, at p + stride * k
 *   vd_load_pairs(base, stride, first, x, y)    two doubles at base + 8 * stride * first[3 * k], as columns
 *   vd_load_triples(base, first, x, y, z)    three doubles at base + 24 * first[3 * k], as columns
 *   vd_load_places(base, first, x, y, z, a, b)    three doubles and two int32 at base + 32 * first[3 * k], as columns
 *   vd_store_places(base, x, y, z, a, b)          TL_LANES such rows, consecutive
 *   vi_ceil(vd)             the next integer that is not less
 *   vi_low_bits(vd)         the last 32 bits of each number
 *   vf_off_integer, vd_off_integer    a finite number less the nearest integer; the sign of 0 may be either
 *   vd_off_256th(a)         a number below 2^42 less the nearest multiple of 2^-8; the sign of 0 may be either
 *   vd_or(a, b)             the bits of both: 0 where both are
 *   vf_store_pairs, vf_store_triples    consecutive pixels of two or three numbers
 *   vi_load_records(base, scale, i, c)    16 bytes at base + scale * i[k], as columns; i are unsigned
 *   vf_load_pairs(base, i, c)    8 bytes at base + 8 * i[k], as columns
 *   vi_mul_halves, vi_mul_high_halves    lower and upper halves of the products of unsigned 16-bit halves
 *   vi_scale_halves(a, b)   (a * b + 2^14) >> 15 of signed 16-bit halves; b = -2^15 is -1
 *   vi_add_halves, vi_sub_halves    modulo 2^16
 *   vi_upper_bytes          the upper byte of each half, as its value
 *   vi_add_bytes, vi_max_bytes, vi_min_bytes    unsigned bytes; a sum is at most 255
 *   vf_last_of(a, n)        the last of every n = 2 or 4 lanes, in all of them (scalar: a)
 *   vd_from_vi, vd_from_vf, vf_from_vi, vf_from_vd    conversions
 *   vi_floor(vf), vi_nearest(vf), vi_round(vd)    to integers, INT32_MIN when out of range; the last two to nearest,
 *                           ties to even */
#ifndef TL_LANES_H
#define TL_LANES_H

#include <stdint.h>
#include <string.h>

#include "lanes/inline.h"

/* p[i] of a pointer that may be unaligned. */
TL_INLINE int32_t int32_at(const int32_t *p, int32_t i)
{
    int32_t word;
    memcpy(&word, (const uint8_t *)p + 4 * (int64_t)i, 4);
    return word;
}

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512BW__) && defined(__AVX512VL__)
#include "lanes/lanes_avx512.h"
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#include "lanes/lanes_avx2.h"
#elif defined(TL_USE_SIMD128)
#include "lanes/lanes_simd128.h"
#else
#include "lanes/lanes_scalar.h"
#endif

/* Where memory cannot be masked, a masked load takes a branch a lane.  An AVX2 masked load waits for its mask, and an
 * AVX2 masked store on AMD costs more than five times a load, a blend and a store. */
#define TL_MOVES_WHOLE (TL_LANES == 4 || TL_LANES == 8)
#define TL_SOME(V, M, NUMBER)                                                    \
    TL_INLINE V V##_load_some(M m, const NUMBER *p, int has_room)                \
    {                                                                            \
        return TL_MOVES_WHOLE && has_room ? V##_load(p) : V##_load_masked(m, p); \
    }                                                                            \
    TL_INLINE void V##_store_some(NUMBER *p, M m, V a, int has_room)             \
    {                                                                            \
        if (TL_MOVES_WHOLE && has_room)                                          \
            V##_store(p, V##_select(m, a, V##_load(p)));                         \
        else                                                                     \
            V##_store_masked(p, m, a);                                           \
    }
TL_SOME(vi, vm, int32_t)
TL_SOME(vf, vm, float)

TL_INLINE int vi_compress(int32_t *p, vm m, vi a)
{
    vi_pack(p, m, a);
    return __builtin_popcount(vm_bits(m));
}
TL_INLINE vi vi_low_half(vi a) { return vi_and(a, vi_set1(0xffff)); }
TL_INLINE void load_vertices(const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    load_vertices_by(3, v, first, x, y, z);
}
#if TL_LANES != 16
TL_INLINE vd vd_off_256th(vd a)
{
    const vd shift = vd_set1(0x1.8p44); /* adding it rounds to multiples of 2^-8 */
    return vd_sub(a, vd_sub(vd_add(a, shift), shift));
}
#endif

/* Stores lanes that are then read one by one.  Compilers that see both extract lanes from the vector, one shuffle each,
 * which is slower than memory: the asm hides the store. */
TL_INLINE void vi_spill(int32_t *p, vi a)
{
    vi_store(p, a);
    __asm__("" : "+m"(*(int32_t (*)[TL_LANES])p));
}

/* The slot in which vi_store_quads stores the four numbers of a lane, in units of four. */
TL_INLINE int vi_quad_slot(int lane) { return TL_LANES == 1 ? 0 : (lane & 3) * (TL_LANES / 4) + (lane >> 2); }

#endif
