/* Mix, uint8: pixels of four bytes, a pixel a lane.
 * In: pixels, a colour, and optionally the coverage of each pixel.  Out: pixels.
 *
 * All of it is integer arithmetic, or float arithmetic on integers that is exact, or rounded once where that cannot
 * change the resulting integer.  A quotient by 255 is at least 1/510 from the middle between two integers. */
#ifndef TL_MIX_U8_C
#define TL_MIX_U8_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "sink/pixel_runs.c"
#include "blend/mix.h"

#define TL_BLOCK (8 * TL_LANES) /* pixels that are unpacked at once where they have one colour */

/* ---- a colour over the whole pixel ------------------------------------------------------------------------------- */

/* Bytes 0 and 2, and bytes 1 and 3, as 16-bit halves; `join_bytes` is the inverse. */
TL_INLINE vi even_bytes(vi a) { return vi_and(a, vi_set1(0x00ff00ff)); }
TL_INLINE vi odd_bytes(vi a) { return vi_upper_bytes(a); }
TL_INLINE vi join_bytes(vi even, vi odd) { return vi_or(even, vi_shift_left(odd, 8)); }
TL_INLINE vi in_both_halves(vi a) { return vi_or(a, vi_shift_left(a, 16)); }
TL_INLINE vi byte_of(vi a, int shift) { return vi_and(vi_shift_right(a, shift), vi_set1(255)); }

/* Halves up to 255^2, divided by 255 and rounded to nearest: floor((x + 128) * 257 / 65536).  With x = 255 q + r, r in
 * -127..127, that is q + (257 r + 32896 - q) / 65536, and the fraction lies between 2 / 65536 and 65535 / 65536. */
TL_INLINE vi divide_by_255(vi x) { return vi_mul_high_halves(vi_add(x, vi_set1(0x00800080)), vi_set1(0x01010101)); }

/* The lanes whose pixel is not opaque. */
TL_INLINE vm translucent(vi pixels) { return vi_gt_unsigned(vi_set1((int32_t)0xff000000), pixels); }

/* (d * (255 - alpha) + s * alpha) / 255, byte by byte. */
TL_INLINE vi over_opaque(vi d, vi s, vi alpha)
{
    const vi a = in_both_halves(alpha), rest = vi_sub(vi_set1(0x00ff00ff), a);
    const vi even = vi_add(vi_mul_halves(even_bytes(d), rest), vi_mul_halves(even_bytes(s), a));
    const vi odd = vi_add(vi_mul_halves(odd_bytes(d), rest), vi_mul_halves(odd_bytes(s), a));
    return join_bytes(divide_by_255(even), divide_by_255(odd));
}

/* The quotient of integers below 2^24, rounded to nearest, ties to even.  The quotient is at most 255, or the divisor
 * is 255 and the quotient at most 65536: then half a unit in the last place of float32, 2^-17 or 2^-9, is less than 1 /
 * (2 * 255^2) or 1 / 510, the least distance from the middle between two integers. */
TL_INLINE vi divide_24_bits(vi a, vi b) { return vi_nearest(vf_div(vf_from_vi(a), vf_from_vi(b))); }

/* Straight alpha over pixels that may be translucent: divides by the resulting alpha. */
static __attribute__((noinline)) vi over_translucent(vi d, vi s)
{
    const vi alpha = byte_of(s, 24), full = vi_set1(255), below = vi_mul(byte_of(d, 24), vi_sub(full, alpha));
    const vi above = vi_mul(alpha, full), sum = vi_add(above, below), divisor = vi_max(sum, vi_set1(1));
    vi out = vi_shift_left(divide_24_bits(sum, full), 24);
    for (int shift = 0; shift < 24; shift += 8) {
        const vi weighted = vi_add(vi_mul(byte_of(s, shift), above), vi_mul(byte_of(d, shift), below));
        out = vi_or(out, vi_shift_left(divide_24_bits(weighted, divisor), shift));
    }
    return vi_select(vi_eq(sum, vi_set1(0)), d, out); /* transparent over transparent */
}

TL_INLINE vi mix_whole_u8(vi d, vi s, vm m, tl_mix mode)
{
    const vi opaque = vi_set1((int32_t)0xff000000);
    if (mode == TL_MIX_OVER_STRAIGHT) {
        if (__builtin_expect(vm_any(vm_and(m, translucent(d))), 0))
            return over_translucent(d, s);
        return over_opaque(d, vi_or(s, opaque), byte_of(s, 24));
    }
    if (mode == TL_MIX_OVER_PREMULTIPLIED) {
        const vi rest = in_both_halves(vi_sub(vi_set1(255), byte_of(s, 24)));
        const vi even = divide_by_255(vi_mul_halves(even_bytes(d), rest));
        const vi odd = divide_by_255(vi_mul_halves(odd_bytes(d), rest));
        return vi_add_bytes(s, join_bytes(even, odd));
    }
    if (mode == TL_MIX_MULTIPLY)
        return join_bytes(divide_by_255(vi_mul_halves(even_bytes(d), even_bytes(s))),
                          divide_by_255(vi_mul_halves(odd_bytes(d), odd_bytes(s))));
    return mode == TL_MIX_ADD   ? vi_add_bytes(d, s)
           : mode == TL_MIX_MAX ? vi_max_bytes(d, s)
           : mode == TL_MIX_MIN ? vi_min_bytes(d, s)
                                : s;
}

/* ---- a colour over a part of the pixel --------------------------------------------------------------------------- */

/* The coverage in 2^-15, ties up. */
TL_INLINE vi coverage_15(vi area) { return vi_shift_right(vi_add(area, vi_set1(256)), 9); }

/* A coverage times alpha, in 2^-15, to nearest. */
TL_INLINE vi weight_15(vi coverage, vi alpha)
{
    if (!vm_any(vm_and_not(vm_all(), vi_eq(alpha, vi_set1(255)))))
        return coverage;
    return divide_24_bits(vi_mul(coverage, alpha), vi_set1(255));
}

/* d + (s - d) * weight / 2^15, byte by byte, ties up.  The weight is negated, because 2^15 is no 16-bit number. */
TL_INLINE vi move_bytes(vi d, vi s, vi weight)
{
    const vi minus = vi_sub_halves(vi_set1(0), in_both_halves(weight)), even = even_bytes(d), odd = odd_bytes(d);
    return join_bytes(vi_add_halves(even, vi_scale_halves(vi_sub_halves(even, even_bytes(s)), minus)),
                      vi_add_halves(odd, vi_scale_halves(vi_sub_halves(odd, odd_bytes(s)), minus)));
}

/* d + (s * gain - d * loss) / 2^15, ties up, at most 255. */
TL_INLINE vi trade_bytes(vi d, vi s, vi gain, vi loss)
{
    vi out = vi_set1(0);
    for (int shift = 0; shift < 32; shift += 8) {
        const vi from = byte_of(d, shift), step = vi_sub(vi_mul(byte_of(s, shift), gain), vi_mul(from, loss));
        const vi sum = vi_shift_right(vi_add(vi_add(vi_shift_left(from, 15), vi_set1(1 << 14)), step), 15);
        out = vi_or(out, vi_shift_left(vi_min(sum, vi_set1(255)), shift));
    }
    return out;
}

/* (a * b + c * d) / divisor, rounded to nearest, ties to even: sums below 2^39, the quotient at most 255 and, with the
 * divisor below 2^31, at least 2^-32 from the middle between two integers unless it is the middle. */
TL_INLINE vi divide_sums(vi color, vd above, vi under, vd below, vd divisor)
{
    return vi_round(vd_div(vd_add(vd_mul(vd_from_vi(color), above), vd_mul(vd_from_vi(under), below)), divisor));
}

/* Straight alpha where the colour or the pixel is translucent: `alpha`, of the colour in this pixel, and `rest`, the
 * remaining share of the pixel, in 1 / (255 * 2^15). */
static __attribute__((noinline)) vi cover_translucent(vi d, vi s, vi alpha, vi rest)
{
    const vi under = byte_of(d, 24), zero = vi_set1(0);
    const vd above = vd_mul(vd_from_vi(alpha), vd_set1(255.0)), below = vd_mul(vd_from_vi(under), vd_from_vi(rest));
    const vd sum = vd_add(above, below), divisor = vd_max(sum, vd_set1(1.0));
    vi out = vi_shift_left(vi_round(vd_div(sum, vd_set1(255.0 * 0x1p15))), 24);
    for (int shift = 0; shift < 24; shift += 8)
        out =
            vi_or(out, vi_shift_left(divide_sums(byte_of(s, shift), above, byte_of(d, shift), below, divisor), shift));
    const vm nothing_under = vm_or(vi_eq(under, zero), vi_eq(rest, zero));
    return vi_select(vm_and(vi_eq(alpha, zero), nothing_under), d, out);
}

/* Mixes a colour into a part of each pixel. */
TL_INLINE vi mix_part_u8(vi d, vi s, vi area, vm m, tl_mix mode)
{
    const vi opaque = vi_set1((int32_t)0xff000000), coverage = coverage_15(area), alpha = byte_of(s, 24);
    if (mode == TL_MIX_OVER_STRAIGHT || mode == TL_MIX_REPLACE_STRAIGHT) {
        const vi weight = weight_15(coverage, alpha);
        const vm under = translucent(d), either = mode == TL_MIX_OVER_STRAIGHT ? under : vm_or(under, translucent(s));
        const vi moved = move_bytes(d, vi_or(s, opaque), weight);
        if (__builtin_expect(!vm_any(vm_and(m, either)), 1))
            return moved;
        const vi fine = vi_mul(weight, vi_set1(255));
        const vi gone = mode == TL_MIX_OVER_STRAIGHT ? fine : vi_mul(coverage, vi_set1(255));
        return vi_select(either, cover_translucent(d, s, fine, vi_sub(vi_set1(255 << 15), gone)), moved);
    }
    if (mode == TL_MIX_OVER_PREMULTIPLIED)
        return trade_bytes(d, s, coverage, weight_15(coverage, alpha));
    return move_bytes(d, mode == TL_MIX_REPLACE ? s : mix_whole_u8(d, s, m, mode), coverage);
}

/* Mixes a part of each pixel, exactly where the part is the whole pixel: a weight in 2^-15 is too coarse for an alpha
 * below 255. */
TL_INLINE vi mix_area_u8(vi d, vi s, vi area, vm m, tl_mix mode, tl_mix whole_mode)
{
    const vi part = mix_part_u8(d, s, area, m, mode);
    const vm whole = vm_and(m, vi_eq(area, vi_set1(TL_WHOLE)));
    if (!reads_alpha(mode) || whole_mode == TL_MIX_REPLACE || !vm_any(whole))
        return mode == TL_MIX_REPLACE_STRAIGHT ? vi_select(whole, s, part) : part;
    return vi_select(whole, mix_whole_u8(d, s, m, mode), part);
}

/* ---- pixels of the canvas ---------------------------------------------------------------------------------------- */

TL_INLINE void store_u8(blend_state *b, int64_t at, vm m, vi pixels)
{
    vi_store_some(b->packed + at, m, pixels, at >= 0 && at + TL_LANES <= b->n_samples);
}
TL_INLINE vi load_u8(const blend_state *b, int64_t at, vm m)
{
    return vi_load_some(m, b->packed + at, at >= 0 && at + TL_LANES <= b->n_samples);
}

/* Fills rows below end_row with the ground, if they are not filled yet. */
static void lay_ground(blend_state *b, int64_t end_row)
{
    const int64_t width = b->window->width;
    for (; b->n_laid < end_row; b->n_laid++)
        if (b->packed)
            put_words(b->packed + b->n_laid * b->stride, width, b->ground, 0);
        else
            put_run((char *)(b->floats + b->n_laid * b->stride * b->n_channels), width, b->canvas->ground,
                    4 * b->n_channels, 0);
}

/* Mixes n_rows runs of pixels that the triangle covers wholly: n[k * step] pixels from first[k * step] on, none where n
 * <= 0. */
TL_INLINE void mix_runs_u8(blend_state *b, const int32_t *first, const int32_t *n, int step, int n_rows, tl_mix mode)
{
    const vi color = vi_set1(b->color);
    for (int k = 0; k < n_rows; k++) {
        const int64_t at = (uint32_t)first[k * step];
        for (int64_t i = 0; i < n[k * step]; i += TL_LANES) {
            const vm m = vm_first(n[k * step] - i);
            vi d = vi_set1(0);
            if (mode != TL_MIX_REPLACE)
                d = load_u8(b, at + i, m);
            store_u8(b, at + i, m, mix_whole_u8(d, color, m, mode));
        }
    }
}

/* Mixes a run of at most TL_CHUNK pixels with the colours in `source`. */
TL_INLINE void mix_source_u8(blend_state *b, int64_t at, int n, tl_mix mode)
{
    for (int i = 0; i < n; i += TL_LANES) {
        const vm m = vm_first(n - i);
        store_u8(b, at + i, m, mix_whole_u8(load_u8(b, at + i, m), vi_load(b->source + i), m, mode));
    }
}

/* Mixes the pixels in m of TL_LANES pixels from `at` on. */
TL_INLINE void mix_block_u8(blend_state *b, int64_t at, vm m, vi area, tl_mix mode)
{
    const vi d = load_u8(b, at, m), s = b->is_flat ? vi_set1(b->color) : vi_load(b->source);
    store_u8(b, at, m, mix_area_u8(d, s, area, m, mode, b->whole_mode));
}

/* ---- fewer channels ---------------------------------------------------------------------------------------------- */

/* Packs n pixels of 1 to 3 channels to four bytes; `unpack_u8` is the inverse. */
static void pack_u8(const uint8_t *pixels, int64_t n, int n_channels, int32_t *restrict out)
{
    if (n_channels == 1)
        for (int64_t k = 0; k < n; k++)
            out[k] = (int32_t)(0xff000000u | pixels[k]);
    else if (n_channels == 2)
        for (int64_t k = 0; k < n; k++)
            out[k] = (int32_t)((uint32_t)pixels[2 * k + 1] << 24 | pixels[2 * k]);
    else
        for (int64_t k = 0; k < n; k++)
            out[k] = (int32_t)(0xff000000u | (uint32_t)pixels[3 * k + 2] << 16 | (uint32_t)pixels[3 * k + 1] << 8 |
                               pixels[3 * k]);
}

static void unpack_each_u8(const int32_t *packed, int64_t n, int n_channels, uint8_t *restrict pixels)
{
    for (int64_t k = 0; k < n; k++) {
        const uint32_t p = (uint32_t)packed[k];
        pixels[n_channels * k] = (uint8_t)p;
        if (n_channels == 2)
            pixels[2 * k + 1] = (uint8_t)(p >> 24);
        if (n_channels == 3)
            pixels[3 * k + 1] = (uint8_t)(p >> 8), pixels[3 * k + 2] = (uint8_t)(p >> 16);
    }
}

/* Whether TL_BLOCK pixels have one colour. */
TL_INLINE int is_block_of(const int32_t *packed, vi color)
{
    vi differs = vi_set1(0);
    for (int k = 0; k < TL_BLOCK; k += TL_LANES)
        differs = vi_or(differs, vi_xor(vi_load(packed + k), color));
    return !vm_any(vi_gt_unsigned(differs, vi_set1(0)));
}

/* Blocks of one colour are written as one run, by vectors. */
static void unpack_u8(const int32_t *packed, int64_t n, int n_channels, uint8_t *pixels)
{
    uint8_t color[4];
    for (int64_t k = 0, end; k < n; k = end) {
        const vi first = vi_set1(packed[k]);
        for (end = k; end + TL_BLOCK <= n && is_block_of(packed + end, first);)
            end += TL_BLOCK;
        if (end > k) {
            unpack_each_u8(packed + k, 1, n_channels, color);
            put_run((char *)pixels + n_channels * k, end - k, (const char *)color, n_channels, 0);
        } else {
            end = min64(k + TL_BLOCK, n);
            unpack_each_u8(packed + k, end - k, n_channels, pixels + n_channels * k);
        }
    }
}

/* One colour as four bytes. */
TL_INLINE int32_t packed_color(const uint8_t *color, int n_channels)
{
    int32_t packed;
    if (n_channels == 4)
        return (int32_t)((uint32_t)color[3] << 24 | (uint32_t)color[2] << 16 | (uint32_t)color[1] << 8 | color[0]);
    pack_u8(color, 1, n_channels, &packed);
    return packed;
}

#endif
