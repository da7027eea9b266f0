/* Surroundings: light from all directions, as a matt surface gathers it and as a shiny surface mirrors it.
 * In: directions in the shading space, a roughness.  Out: light, linear.
 *
 * A sky over a ground needs no picture.  A matt surface whose normal has height h gets (1 + h) / 2 of the sky.  A rough
 * surface mirrors a blurred horizon: along one axis the slopes of GGX facets have the cumulative distribution (1 + x /
 * sqrt(x^2 + a^2)) / 2, and a facet turns mirrored light by twice its angle, so x is the slope of the mirrored
 * direction and a twice alpha; for large alpha the half circle limits it.  SPREAD_* fit that: within 0.007 of the
 * integral over the facets for every roughness and height, exact for a mirror and for alpha = 1, which gets (1 + h) /
 * 2.
 *
 * Based on: B. Walter et al., Microfacet Models for Refraction through Rough Surfaces, 2007 (the slopes of GGX); B.
 * Karis, Real Shading in Unreal Engine 4, 2013 (blurred levels by roughness); T. Engelhardt and C. Dachsbacher,
 * Octahedron Environment Maps, 2008. */
#ifndef TL_SURROUNDINGS_C
#define TL_SURROUNDINGS_C

#include <stdint.h>

#include "lanes/lanes.h"
#include "pixels/shading.h"
#include "shade/light.c"

#define SPREAD_1 1.6f /* of alpha^2: 4 / (1 + 1.6 alpha + 1.4 alpha^2) */
#define SPREAD_2 1.4f

TL_INLINE vf vf_abs(vf a) { return vf_max(a, vf_sub(vf_set1(0.0f), a)); }

/* Rotates a direction into the space of the surroundings. */
TL_INLINE void turn_around(const tl_surroundings *e, const vf *at, vf *turned)
{
    for (int axis = 0; axis < 3; axis++) {
        const float *m = e->from_shading[axis];
        turned[axis] = vf_fma(vf_set1(m[0]), at[0], vf_fma(vf_set1(m[1]), at[1], vf_mul(vf_set1(m[2]), at[2])));
    }
}

TL_INLINE void mix_sky(const tl_surroundings *e, vf share, vf *light)
{
    for (int c = 0; c < 3; c++)
        light[c] = vf_fma(share, vf_set1(e->sky[c] - e->ground[c]), vf_set1(e->ground[c]));
}

/* The share of the sky around a unit direction of height h, for a surface with alpha. */
TL_INLINE vf share_of_sky(vf h, vf alpha, vf alpha2)
{
    const vf one = vf_set1(1.0f), half = vf_set1(0.5f), squared = vf_mul(h, h);
    const vf bend = vf_fma(vf_set1(SPREAD_2), alpha2, vf_fma(vf_set1(SPREAD_1), alpha, one));
    const vf spread = vf_div(vf_mul(vf_set1(4.0f), alpha2), bend);
    const vf across = vf_mul(spread, vf_max(vf_sub(one, squared), vf_set1(0.0f)));
    const vf length = vf_sqrt(vf_max(vf_add(squared, across), vf_set1(0x1p-100f)));
    return vf_fma(half, vf_div(h, length), half);
}

/* Maps a direction to the unfolded octahedron, 0 to 1. */
TL_INLINE void unfold(const vf *at, vf *x, vf *y)
{
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f), half = vf_set1(0.5f), tiny = vf_set1(0x1p-100f);
    const vf scale = vf_div(one, vf_max(vf_add(vf_abs(at[0]), vf_add(vf_abs(at[1]), vf_abs(at[2]))), tiny));
    const vf a = vf_mul(at[0], scale), b = vf_mul(at[2], scale);
    const vf far_a = vf_sub(one, vf_abs(b)), far_b = vf_sub(one, vf_abs(a));
    const vm is_below = vf_lt(at[1], zero);
    const vf folded_a = vf_select(vf_lt(a, zero), vf_sub(zero, far_a), far_a);
    const vf folded_b = vf_select(vf_lt(b, zero), vf_sub(zero, far_b), far_b);
    *x = vf_fma(half, vf_select(is_below, folded_a, a), half);
    *y = vf_fma(half, vf_select(is_below, folded_b, b), half);
}

/* Samples a level of the picture; each lane has its level. */
TL_INLINE void sample_level(const tl_surroundings *e, vi level, vf x, vf y, vf *light)
{
    const vi size = vi_lookup(e->size, level), stride = vi_add(size, vi_set1(2)), zero = vi_set1(0), one = vi_set1(1);
    const vf length = vf_from_vi(size), half = vf_set1(0.5f);
    const vf at_x = vf_fma(x, length, half), at_y = vf_fma(y, length, half); /* - 0.5, + 1 for the border */
    const vi column = vi_max(vi_min(vi_floor(at_x), size), zero), row = vi_max(vi_min(vi_floor(at_y), size), zero);
    const vf share_x = vf_sub(at_x, vf_from_vi(column)), share_y = vf_sub(at_y, vf_from_vi(row));
    const vi first = vi_add(vi_lookup(e->offset, level), vi_add(vi_mul(row, stride), column));
    const vi corner[4] = {first, vi_add(first, one), vi_add(first, stride), vi_add(vi_add(first, stride), one)};
    vi texel[4][4];
    for (int k = 0; k < 4; k++) {
        _Alignas(64) int32_t at[TL_MAX_LANES];
        vi_spill(at, corner[k]);
        vi_load_records(e->texels, 16, at, texel[k]);
    }
    for (int c = 0; c < 3; c++) {
        vf value[4];
        for (int k = 0; k < 4; k++)
            value[k] = vf_of_bits(texel[k][c]);
        const vf upper = vf_fma(share_x, vf_sub(value[1], value[0]), value[0]);
        const vf lower = vf_fma(share_x, vf_sub(value[3], value[2]), value[2]);
        light[c] = vf_fma(share_y, vf_sub(lower, upper), upper);
    }
}

/* The light that a matt surface gathers, over pi. */
static void gather_light(const tl_surroundings *e, const vf *normal, vf *light)
{
    vf at[3], x, y;
    turn_around(e, normal, at);
    if (e->kind == TL_SURROUNDINGS_SKY) {
        mix_sky(e, vf_fma(vf_set1(0.5f), at[1], vf_set1(0.5f)), light);
    } else {
        unfold(at, &x, &y);
        sample_level(e, vi_set1(e->n_levels - 1), x, y, light);
    }
    for (int c = 0; c < 3; c++)
        light[c] = vf_mul(light[c], vf_set1(e->diffuse));
}

/* The light that a surface mirrors from a unit direction. */
static void mirror_light(const tl_surroundings *e, const vf *direction, vf roughness, vf *light)
{
    vf at[3], x, y;
    turn_around(e, direction, at);
    if (e->kind == TL_SURROUNDINGS_SKY) {
        const vf alpha = vf_mul(roughness, roughness);
        mix_sky(e, share_of_sky(at[1], alpha, vf_mul(alpha, alpha)), light);
        return;
    }
    const int last = e->n_levels - 2;
    const vf lod = vf_min(vf_max(vf_mul(roughness, vf_set1((float)last)), vf_set1(0.0f)), vf_set1((float)last));
    const vi level = vi_floor(lod);
    const vf share = vf_sub(lod, vf_from_vi(level));
    unfold(at, &x, &y);
    sample_level(e, level, x, y, light);
    if (vm_any(vf_lt(vf_set1(0.0f), share))) {
        vf rougher[3];
        sample_level(e, vi_min(vi_add(level, vi_set1(1)), vi_set1(last)), x, y, rougher);
        for (int c = 0; c < 3; c++)
            light[c] = vf_fma(share, vf_sub(rougher[c], light[c]), light[c]);
    }
}

#endif
