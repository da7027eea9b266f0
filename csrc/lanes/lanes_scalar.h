/* One lane, plain C: the definition of the results of every other instruction set. */
#ifndef TL_LANES_SCALAR_H
#define TL_LANES_SCALAR_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"

#define TL_LANES 1

typedef int32_t vi;
typedef float vf;
typedef double vd;
typedef unsigned vm; /* 0 or 1 */

TL_INLINE vi vi_set1(int32_t a) { return a; }
/* Pixels of four bytes may lie at any address. */
TL_INLINE vi vi_load(const int32_t *p)
{
    vi a;
    memcpy(&a, p, sizeof a);
    return a;
}
TL_INLINE void vi_store(int32_t *p, vi a) { memcpy(p, &a, sizeof a); }
TL_INLINE vi vi_iota(void) { return 0; }
TL_INLINE vi vi_add(vi a, vi b) { return (vi)((uint32_t)a + (uint32_t)b); }
TL_INLINE vi vi_sub(vi a, vi b) { return (vi)((uint32_t)a - (uint32_t)b); }
TL_INLINE vi vi_mul(vi a, vi b) { return (vi)((uint32_t)a * (uint32_t)b); }
TL_INLINE vi vi_min(vi a, vi b) { return a < b ? a : b; }
TL_INLINE vi vi_max(vi a, vi b) { return a > b ? a : b; }
TL_INLINE vi vi_or(vi a, vi b) { return a | b; }
TL_INLINE vi vi_xor(vi a, vi b) { return a ^ b; }
TL_INLINE vi vi_and(vi a, vi b) { return a & b; }
TL_INLINE vi vi_shift_left(vi a, int n) { return (vi)((uint32_t)a << n); }
TL_INLINE vi vi_shift_right(vi a, int n) { return a >> n; }
TL_INLINE vi vi_mul_halves(vi a, vi b)
{
    const uint32_t low = ((uint32_t)a & 0xffff) * ((uint32_t)b & 0xffff);
    const uint32_t high = ((uint32_t)a >> 16) * ((uint32_t)b >> 16);
    return (vi)(high << 16 | (low & 0xffff));
}
TL_INLINE vi vi_mul_high_halves(vi a, vi b)
{
    const uint32_t low = ((uint32_t)a & 0xffff) * ((uint32_t)b & 0xffff);
    const uint32_t high = ((uint32_t)a >> 16) * ((uint32_t)b >> 16);
    return (vi)((high & 0xffff0000) | low >> 16);
}
TL_INLINE vi vi_scale_halves(vi a, vi b)
{
    const int32_t low = ((int16_t)a * (int16_t)b + (1 << 14)) >> 15, high = ((a >> 16) * (b >> 16) + (1 << 14)) >> 15;
    return (vi)((uint32_t)high << 16 | ((uint32_t)low & 0xffff));
}
TL_INLINE vi vi_add_halves(vi a, vi b)
{
    return (vi)((((uint32_t)a & 0xffff0000) + ((uint32_t)b & 0xffff0000)) | (((uint32_t)a + (uint32_t)b) & 0xffff));
}
TL_INLINE vi vi_sub_halves(vi a, vi b)
{
    return (vi)((((uint32_t)a & 0xffff0000) - ((uint32_t)b & 0xffff0000)) | (((uint32_t)a - (uint32_t)b) & 0xffff));
}
TL_INLINE vi vi_upper_bytes(vi a) { return (vi)((uint32_t)a >> 8 & 0x00ff00ff); }
TL_INLINE vi vi_add_bytes(vi a, vi b)
{
    const uint32_t mask = 0x00ff00ff, even = ((uint32_t)a & mask) + ((uint32_t)b & mask);
    const uint32_t odd = ((uint32_t)a >> 8 & mask) + ((uint32_t)b >> 8 & mask);
    const uint32_t even_over = (even >> 8 & 0x00010001) * 255, odd_over = (odd >> 8 & 0x00010001) * 255;
    return (vi)(((even | even_over) & mask) | ((odd | odd_over) & mask) << 8);
}
TL_INLINE vi vi_max_bytes(vi a, vi b)
{
    uint32_t out = 0;
    for (uint32_t byte = 255; byte; byte <<= 8)
        out |= ((uint32_t)a & byte) > ((uint32_t)b & byte) ? (uint32_t)a & byte : (uint32_t)b & byte;
    return (vi)out;
}
TL_INLINE vi vi_min_bytes(vi a, vi b) { return ~vi_max_bytes(~a, ~b); }
TL_INLINE vm vi_gt(vi a, vi b) { return a > b; }
TL_INLINE vm vi_gt_unsigned(vi a, vi b) { return (uint32_t)a > (uint32_t)b; }
TL_INLINE vm vi_eq(vi a, vi b) { return a == b; }
TL_INLINE vi vi_select(vm m, vi a, vi b) { return m ? a : b; }
TL_INLINE void vi_pack(int32_t *p, vm m, vi a) { (void)m, *p = a; }
TL_INLINE vi vi_load_masked(vm m, const int32_t *p) { return m ? vi_load(p) : 0; }
TL_INLINE void vi_store_masked(int32_t *p, vm m, vi a)
{
    if (m)
        vi_store(p, a);
}

/* Four int32. */
typedef struct {
    int32_t k[4];
} v4;
TL_INLINE v4 v4_zero(void) { return (v4){{0, 0, 0, 0}}; }
TL_INLINE v4 v4_load(const int32_t *p) { return (v4){{p[0], p[1], p[2], p[3]}}; }
TL_INLINE void v4_store(int32_t *p, v4 a) { memcpy(p, a.k, sizeof a.k); }
TL_INLINE v4 v4_add(v4 a, v4 b)
{
    return (v4){{vi_add(a.k[0], b.k[0]), vi_add(a.k[1], b.k[1]), vi_add(a.k[2], b.k[2]), vi_add(a.k[3], b.k[3])}};
}
TL_INLINE v4 v4_or(v4 a, v4 b) { return (v4){{a.k[0] | b.k[0], a.k[1] | b.k[1], a.k[2] | b.k[2], a.k[3] | b.k[3]}}; }
TL_INLINE void vi_load_quads(const int32_t *p, vi *c)
{
    for (int k = 0; k < 4; k++)
        c[k] = p[k];
}
TL_INLINE void vi_store_quads(int32_t *p, const vi *c)
{
    for (int k = 0; k < 4; k++)
        p[k] = c[k];
}
TL_INLINE vi vi_prefix_sum(vi a) { return a; }
TL_INLINE vi vi_last(vi a) { return a; }
TL_INLINE vi vi_shift_in(vi a, vi before) { return (void)a, before; }
TL_INLINE vf vf_from_unsigned(vi a) { return (float)(uint32_t)a; }
TL_INLINE vi vi_gather(vm m, const int32_t *p, vi i) { return m ? int32_at(p, i) : 0; }

TL_INLINE vm vm_and(vm a, vm b) { return a & b; }
TL_INLINE vm vm_or(vm a, vm b) { return a | b; }
TL_INLINE vm vm_and_not(vm a, vm b) { return a & ~b; }
TL_INLINE int vm_any(vm a) { return a != 0; }
TL_INLINE unsigned vm_bits(vm a) { return a; }
TL_INLINE vm vm_all(void) { return 1; }
TL_INLINE vm vm_first(int64_t n) { return n > 0; }

TL_INLINE vm vm_from_bits(unsigned bits) { return bits & 1; }
/* 64 bytes of 0 or 1 */
TL_INLINE void bytes_from_bits(uint8_t *p, uint64_t bits)
{
    const uint64_t high = 0x7f7f7f7f7f7f7f7fu, ones = 0x0101010101010101u;
    for (int k = 0; k < 64; k += 8) {
        const uint64_t spread = (bits >> k & 0xff) * ones & 0x8040201008040201u; /* bit i of the eight in byte i */
        uint64_t bytes = (spread + high) >> 7 & ones;
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
        bytes = __builtin_bswap64(bytes);
#endif
        memcpy(p + k, &bytes, 8);
    }
}
/* A word of 64 bits; vw_add_range sets the bits [begin, end) that are in the pattern; begin, end >= 0. */
typedef uint64_t vw;
TL_INLINE vw vw_zero(void) { return 0; }
TL_INLINE vw vw_load(const uint64_t *p) { return *p; }
TL_INLINE void vw_store(uint64_t *p, vw a) { *p = a; }
TL_INLINE vw vw_add_range(vw a, vi begin, vi end, uint64_t pattern)
{
    end = end > 64 ? 64 : end;
    return begin < end ? a | (~0ull << begin & ~0ull >> (64 - end) & pattern) : a;
}

TL_INLINE vi vi_bit_ranges(vi begin, vi end) { return begin < 31 ? (vi)(~0u << begin & ~(~0u << end)) : 0; }

TL_INLINE vf vf_set1(float a) { return a; }
TL_INLINE vf vf_add(vf a, vf b) { return a + b; }
TL_INLINE vf vf_sub(vf a, vf b) { return a - b; }
TL_INLINE vf vf_mul(vf a, vf b) { return a * b; }
TL_INLINE vf vf_div(vf a, vf b) { return a / b; }
TL_INLINE vf vf_sqrt(vf a) { return sqrtf(a); }
TL_INLINE vf vf_from_vi(vi a) { return (float)a; }
TL_INLINE vf vf_select(vm m, vf a, vf b) { return m ? a : b; }
TL_INLINE void vf_store(float *p, vf a) { *p = a; }
TL_INLINE vi vi_floor(vf a) { return fabsf(a) < 0x1p31f ? (vi)floorf(a) : INT32_MIN; }
TL_INLINE vi vi_nearest(vf a) { return fabsf(a) < 0x1p31f ? (vi)lrintf(a) : INT32_MIN; }
TL_INLINE vf vf_last_of(vf a, int n) { return (void)n, a; }
TL_INLINE vf vf_load_masked(vm m, const float *p) { return m ? *p : 0.0f; }
TL_INLINE void vf_store_masked(float *p, vm m, vf a)
{
    if (m)
        *p = a;
}
TL_INLINE vm vf_lt(vf a, vf b) { return a < b; }
TL_INLINE vm vf_ge(vf a, vf b) { return a >= b; }
TL_INLINE vm vf_eq(vf a, vf b) { return a == b; }
TL_INLINE vi vi_bits_of_vf(vf a)
{
    vi b;
    memcpy(&b, &a, 4);
    return b;
}

TL_INLINE vd vd_set1(double a) { return a; }
TL_INLINE vd vd_add(vd a, vd b) { return a + b; }
TL_INLINE vd vd_sub(vd a, vd b) { return a - b; }
TL_INLINE vd vd_mul(vd a, vd b) { return a * b; }
TL_INLINE vd vd_div(vd a, vd b) { return a / b; }
TL_INLINE vd vd_from_vi(vi a) { return (double)a; }
TL_INLINE vf vf_from_vd(vd a) { return (float)a; }
TL_INLINE void vd_quotients(const vd *a, vd b, vd *q, int are_f32)
{
    (void)are_f32;
    for (int k = 0; k < 3; k++)
        q[k] = a[k] / b;
}
TL_INLINE vd vd_abs(vd a) { return fabs(a); }
TL_INLINE vd vd_floor(vd a) { return floor(a); }
TL_INLINE vd vd_min(vd a, vd b) { return a < b ? a : b; }
TL_INLINE vd vd_max(vd a, vd b) { return a > b ? a : b; }
TL_INLINE vm vd_ge(vd a, vd b) { return a >= b; }
TL_INLINE vd vd_from_vf(vf a) { return (double)a; }
TL_INLINE vi vi_round(vd a)
{
    const vd nearest = rint(a); /* 2^31 if a is less: out of range */
    return fabs(nearest) < 0x1p31 ? (vi)nearest : INT32_MIN;
}
TL_INLINE vi vi_low_bits(vd a)
{
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    return (vi)(uint32_t)bits;
}
TL_INLINE vd vd_select(vm m, vd a, vd b) { return m ? a : b; }
TL_INLINE void vd_store(double *p, vd a) { *p = a; }

/* Loads the vertices first[step * lane] of TL_LANES pairs or triangles.  z stays in the order of the loads until it is
 * needed. */
typedef double vz;
TL_INLINE void load_vertices_by(int step, const tl_vertex *v, const int32_t *first, vi *x, vi *y, vz *z)
{
    (void)step;
    const tl_vertex a = v[first[0]];
    *x = a.x_fx;
    *y = a.y_fx;
    *z = a.z;
}
TL_INLINE vd vd_from_vz(vz z) { return z; }

/* The first four numbers of TL_LANES rows, as columns; reads up to two numbers past the last row. */
TL_INLINE void load_columns_f32(const float *p, int stride, vf *columns)
{
    (void)stride;
    for (int k = 0; k < 4; k++)
        columns[k] = p[k];
}
TL_INLINE void load_columns_f64(const double *p, int stride, vd *columns)
{
    (void)stride;
    for (int k = 0; k < 4; k++)
        columns[k] = p[k];
}
TL_INLINE void store_vertices(tl_vertex *v, vi x, vi y, vd z) { *v = (tl_vertex){x, y, z}; }

/* For shading. */
TL_INLINE vf vf_load(const float *p) { return *p; }
TL_INLINE vf vf_fma(vf a, vf b, vf c) { return fmaf(a, b, c); }
TL_INLINE vf vf_min(vf a, vf b) { return a < b ? a : b; } /* b when one is NaN */
TL_INLINE vf vf_max(vf a, vf b) { return a > b ? a : b; }
TL_INLINE vf vf_min_size(vf a, vf b) { return vf_min(a, fabsf(b)); }
TL_INLINE vf vf_of_bits(vi a)
{
    vf b;
    memcpy(&b, &a, 4);
    return b;
}
TL_INLINE vi vi_high_half(vi a) { return (vi)((uint32_t)a >> 16); }
TL_INLINE vf vf_lookup(const float *table, vi i) { return table[i & 15]; }
TL_INLINE vi vi_lookup(const int32_t *table, vi i) { return table[i & 15]; }
TL_INLINE vf vf_pick(const float *p, vi i) { return (void)i, *p; }
TL_INLINE vd vd_load(const double *p) { return *p; }
TL_INLINE vd vd_sqrt(vd a) { return sqrt(a); }
TL_INLINE vd vd_power(vd a, uint64_t sum, uint64_t mask)
{
    uint64_t b;
    memcpy(&b, &a, 8);
    b = sum - (b & mask);
    memcpy(&a, &b, 8);
    return a;
}
TL_INLINE vd vd_pick(const double *p, vi i) { return (void)i, *p; }
TL_INLINE vi vi_pick(const int32_t *p, vi i) { return (void)i, *p; }
TL_INLINE vi vi_prefix_count(unsigned bits) { return (vi)(bits & 1); }
TL_INLINE void vi_load_records(const void *base, int scale, const int32_t *i, vi *c)
{
    memcpy(c, (const char *)base + (int64_t)*i * scale, 16);
}
TL_INLINE void vf_load_pairs(const void *base, const int32_t *i, vf *c)
{
    memcpy(c, (const char *)base + (int64_t)*i * 8, 8);
}
/* Writes TL_LANES rows of four with the fourth column replaced. */
TL_INLINE void vf_store_fourths(const float *rows, vf fourth, float *out)
{
    for (int k = 0; k < 3; k++)
        out[k] = rows[k];
    out[3] = fourth;
}
/* Stores consecutive pixels of two and of three numbers. */
TL_INLINE void vf_store_pairs(float *p, const vf *c) { p[0] = c[0], p[1] = c[1]; }
TL_INLINE void vf_store_triples(float *p, const vf *c) { p[0] = c[0], p[1] = c[1], p[2] = c[2]; }
/* Four doubles at base + 8 * stride * i[k], as columns. */
TL_INLINE void vd_load_records(const double *base, int stride, const int32_t *i, vd *c)
{
    memcpy(c, base + (int64_t)*i * stride, 32);
}

/* Pairs, and rows of three, at base + 8 * stride * first[3 * lane]. */
TL_INLINE void vd_load_pairs(const double *base, int stride, const int32_t *first, vd *x, vd *y)
{
    *x = base[(int64_t)*first * stride];
    *y = base[(int64_t)*first * stride + 1];
}
TL_INLINE void vd_load_triples(const double *base, const int32_t *first, vd *x, vd *y, vd *z)
{
    const double *row = base + (int64_t)*first * 3;
    *x = row[0], *y = row[1], *z = row[2];
}
TL_INLINE void vd_load_places(const double *base, const int32_t *first, vd *x, vd *y, vd *z, vi *a, vi *b)
{
    const double *row = base + (int64_t)*first * 4;
    *x = row[0], *y = row[1], *z = row[2];
    memcpy(a, row + 3, sizeof *a), memcpy(b, (const char *)(row + 3) + sizeof *a, sizeof *b);
}
TL_INLINE void vd_store_quads(double *p, int64_t stride, const vd *c)
{
    (void)stride;
    memcpy(p, c, 32);
}
TL_INLINE void vd_store_places(double *row, vd x, vd y, vd z, vi a, vi b)
{
    row[0] = x, row[1] = y, row[2] = z;
    memcpy(row + 3, &a, sizeof a), memcpy((char *)(row + 3) + sizeof a, &b, sizeof b);
}
/* ceil() is a call on the scalar set */
TL_INLINE vi vi_ceil(vd a) { return fabs(a) < 0x1p31 ? (vi)((uint32_t)(vi)a + ((double)(vi)a < a)) : INT32_MIN; }
/* a minus the nearest integer */
TL_INLINE vf vf_off_integer(vf a) { return a - rintf(a); }
TL_INLINE vd vd_or(vd a, vd b)
{
    uint64_t bits_a, bits_b;
    memcpy(&bits_a, &a, sizeof a), memcpy(&bits_b, &b, sizeof b);
    bits_a |= bits_b;
    memcpy(&a, &bits_a, sizeof a);
    return a;
}
TL_INLINE vd vd_off_integer(vd a) { return fabs(a) < 0x1p51 ? a - ((a + 0x1.8p52) - 0x1.8p52) : 0.0; }

#endif
