/* Mix, float32: a channel a lane, pixels in place.
 * In: pixels, a colour, and optionally the coverage of each pixel.  Out: pixels.
 *
 * Every operation rounds once, in the order written: equal bits in every build.  A vector starts with the first channel
 * of a pixel, except with three channels, which have no alpha to read. */
#ifndef TL_MIX_F32_C
#define TL_MIX_F32_C

#include <stddef.h>
#include <stdint.h>

#include "lanes/lanes.h"
#include "blend/mix.h"

/* The alpha of each lane's pixel: `a` was loaded from p, channel i of a run in its first lane. */
TL_INLINE vf alpha_f32(vf a, const float *p, int64_t i, int n_channels)
{
    return TL_LANES == 1 ? vf_set1(p[n_channels - 1 - i % n_channels]) : vf_last_of(a, n_channels);
}

TL_INLINE vm is_alpha(int64_t i, int n_channels)
{
    return vm_from_bits(TL_LANES == 1 ? i % n_channels == n_channels - 1 : n_channels == 4 ? 0x8888 : 0xaaaa);
}

/* Values of a pixel that lanes of all its channels read. */
typedef struct {
    vf s_alpha, d_alpha;
    vm is_alpha;
} f32_alphas;

/* (s * above + d * below) / (above + below), and that sum as alpha. */
TL_INLINE vf weigh_f32(vf d, vf s, vf above, vf below, vm alpha_lanes)
{
    const vf sum = vf_add(above, below), weighted = vf_add(vf_mul(s, above), vf_mul(d, below));
    const int is_opaque = !vm_any(vm_and_not(vm_all(), vf_eq(sum, vf_set1(1.0f)))); /* then x / 1 is x */
    const vf mean = is_opaque ? weighted : vf_div(weighted, sum);
    return vf_select(alpha_lanes, sum, vf_select(vf_eq(sum, vf_set1(0.0f)), d, mean));
}

TL_INLINE vf mix_whole_f32(vf d, vf s, const f32_alphas *a, tl_mix mode)
{
    const vf one = vf_set1(1.0f);
    switch (mode) {
    case TL_MIX_OVER_STRAIGHT:
        return weigh_f32(d, s, a->s_alpha, vf_mul(a->d_alpha, vf_sub(one, a->s_alpha)), a->is_alpha);
    case TL_MIX_OVER_PREMULTIPLIED: return vf_add(s, vf_mul(d, vf_sub(one, a->s_alpha)));
    case TL_MIX_ADD: return vf_add(d, s);
    case TL_MIX_MULTIPLY: return vf_mul(d, s);
    case TL_MIX_MAX: return vf_select(vf_lt(d, s), s, d);
    case TL_MIX_MIN: return vf_select(vf_lt(s, d), s, d);
    default: return s;
    }
}

/* Mixes with coverage 0 < c < 1. */
TL_INLINE vf mix_partial_f32(vf d, vf s, vf c, const f32_alphas *a, tl_mix mode)
{
    const vf one = vf_set1(1.0f);
    if (mode == TL_MIX_OVER_PREMULTIPLIED)
        return vf_add(vf_mul(s, c), vf_mul(d, vf_sub(one, vf_mul(a->s_alpha, c))));
    if (mode == TL_MIX_OVER_STRAIGHT || mode == TL_MIX_REPLACE_STRAIGHT) {
        const vf above = vf_mul(a->s_alpha, c), gone = mode == TL_MIX_OVER_STRAIGHT ? above : c;
        const vf mean = weigh_f32(d, s, above, vf_mul(a->d_alpha, vf_sub(one, gone)), a->is_alpha);
        return mean;
    }
    return vf_add(vf_mul(mix_whole_f32(d, s, a, mode), c), vf_mul(d, vf_sub(one, c)));
}

/* Mixes with coverage 0 < c <= 1.  A pixel with c = 1 uses the formula without c: the general formula gives another
 * result for infinities and signs of zeros, and the result must not depend on which pixels share a vector. */
TL_INLINE vf mix_part_f32(vf d, vf s, vf c, const f32_alphas *a, tl_mix mode)
{
    const vm whole = vf_eq(c, vf_set1(1.0f));
    const vf part = mix_partial_f32(d, s, c, a, mode);
    return vm_any(whole) ? vf_select(whole, mix_whole_f32(d, s, a, mode), part) : part;
}

/* Mixes channels i to i + TL_LANES of a run that begins at `p`; c: their coverage, or NULL for 1. */
TL_INLINE void mix_lanes_f32(blend_state *b, float *p, int64_t i, vm m, const float *source, const float *c,
                             tl_mix mode)
{
    const int n_channels = b->n_channels;
    const float *from = source ? source + i : b->pattern + (n_channels == 3 || TL_LANES == 1 ? i % n_channels : 0);
    const int has_room = p >= b->floats && p + i + TL_LANES <= b->floats + b->n_samples * n_channels;
    const vf d = vf_load_some(m, p + i, has_room), s = vf_load(from);
    f32_alphas a = {s, s, vm_all()};
    if (reads_alpha(mode)) {
        a.s_alpha = source ? alpha_f32(s, from, i, n_channels) : vf_set1(b->pattern[n_channels - 1]);
        a.d_alpha = alpha_f32(d, p + i, i, n_channels);
        a.is_alpha = is_alpha(i, n_channels);
    }
    const vf out = c ? mix_part_f32(d, s, vf_load(c + i), &a, mode) : mix_whole_f32(d, s, &a, mode);
    vf_store_some(p + i, m, out, has_room);
}

/* `mix_runs_u8` for float32. */
TL_INLINE void mix_runs_f32(blend_state *b, const int32_t *first, const int32_t *n, int step, int n_rows, tl_mix mode)
{
    for (int k = 0; k < n_rows; k++) {
        const int64_t end = (int64_t)n[k * step] * b->n_channels;
        float *p = b->floats + (int64_t)(uint32_t)first[k * step] * b->n_channels;
        for (int64_t i = 0; i < end; i += TL_LANES)
            mix_lanes_f32(b, p, i, vm_first(end - i), NULL, NULL, mode);
    }
}

TL_INLINE void mix_source_f32(blend_state *b, int64_t at, int n, tl_mix mode)
{
    const int64_t end = (int64_t)n * b->n_channels;
    for (int64_t i = 0; i < end; i += TL_LANES)
        mix_lanes_f32(b, b->floats + at * b->n_channels, i, vm_first(end - i), b->source_f32, NULL, mode);
}

/* `mix_block_u8` for float32. */
TL_INLINE void mix_block_f32(blend_state *b, int64_t at, vm m, vi area, tl_mix mode)
{
    const int n_channels = b->n_channels;
    int32_t units[TL_MAX_LANES];
    float coverage[4 * TL_MAX_LANES];
    vi_store(units, vi_select(m, area, vi_set1(0)));
    for (int k = 0; k < TL_LANES; k++)
        for (int c = 0; c < n_channels; c++)
            coverage[k * n_channels + c] = (float)units[k] * (1.0f / TL_WHOLE);
    const int64_t end = (int64_t)TL_LANES * n_channels;
    for (int64_t i = 0; i < end; i += TL_LANES) {
        const vm on = vf_lt(vf_set1(0.0f), vf_load(coverage + i));
        if (vm_any(on))
            mix_lanes_f32(b, b->floats + at * n_channels, i, on, b->is_flat ? NULL : b->source_f32, coverage, mode);
    }
}

#endif
