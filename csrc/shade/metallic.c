/* Metallic-rough surfaces, as glTF describes them: microfacets of GGX over a matt base.
 * In: base colour, metallic, roughness; lights and surroundings.  Out: the light reflected to the eye, linear.
 *
 *   f = (1 - F) (1 - metallic) base / pi + F D V,   F = f0 + (1 - f0) (1 - v . h)^5,   f0 = mix(0.04, base, metallic)
 *   D = alpha^2 / (pi ((n . h)^2 (alpha^2 - 1) + 1)^2),   alpha = roughness^2
 *   V = 1 / (2 (n . l sqrt((n . v)^2 (1 - alpha^2) + alpha^2) + n . v sqrt((n . l)^2 (1 - alpha^2) + alpha^2)))
 *
 * A light of intensity 1 makes a white matt surface that faces it white: so its light is pi, which cancels the pi of f.
 * The denominator of D is (n . h)^2 alpha^2 + |n x h|^2: this form does not cancel.  Roughness counts as at least
 * TL_LEAST_ROUGHNESS, so that alpha^4 stays far from the rounding of float32 and a highlight is no smaller than a lamp.
 * The light of the surroundings is their blurred light in the mirrored direction times the share of white surroundings
 * that the surface mirrors (the split sum); the matt base reflects the rest of that share.
 *
 * Based on: Khronos, glTF 2.0 Specification, appendix B (BRDF); B. Walter et al., 2007 (GGX); E. Heitz, Understanding
 * the Masking-Shadowing Function in Microfacet-Based BRDFs, 2014 (V, height-correlated); C. Schlick, An Inexpensive
 * BRDF Model for Physically-based Rendering, 1994 (F); B. Karis, Real Shading in Unreal Engine 4, 2013 (the split sum),
 * and Physically Based Shading on Mobile, 2014 (the analytic share, after D. Lazarov, Getting More Physical in Call of
 * Duty: Black Ops II, 2013). */
#ifndef TL_METALLIC_C
#define TL_METALLIC_C

#include "lanes/lanes.h"
#include "pixels/shading.h"
#include "shade/light.c"
#include "shade/surroundings.c"

#define TL_LEAST_ROUGHNESS 0.045f
#define TL_F0_OF_DIELECTRICS 0.04f

typedef struct {
    lit_surface lit;
    vf roughness, alpha2, n_dot_v;
    vf masked_view;       /* sqrt((n . v)^2 (1 - alpha^2) + alpha^2) */
    vf f0[3], diffuse[3]; /* diffuse: (1 - metallic) base */
} rough_surface;

TL_INLINE vf masked_cosine(vf cosine, vf alpha2)
{
    const vf squared = vf_mul(cosine, cosine);
    return vf_sqrt(vf_fma(alpha2, vf_sub(vf_set1(1.0f), squared), squared));
}

TL_INLINE void set_rough(rough_surface *s, const vf *base, vf metallic, vf roughness)
{
    const vf one = vf_set1(1.0f), zero = vf_set1(0.0f), f0 = vf_set1(TL_F0_OF_DIELECTRICS);
    s->roughness = vf_min(vf_max(roughness, vf_set1(TL_LEAST_ROUGHNESS)), one);
    const vf alpha = vf_mul(s->roughness, s->roughness), matt = vf_sub(one, metallic),
             cosine = dot3(s->lit.normal, s->lit.to_eye);
    s->alpha2 = vf_mul(alpha, alpha);
    s->n_dot_v = vf_min(vf_max(cosine, vf_sub(zero, cosine)), one);
    s->masked_view = masked_cosine(s->n_dot_v, s->alpha2);
    for (int c = 0; c < 3; c++) {
        s->f0[c] = vf_fma(metallic, vf_sub(base[c], f0), f0);
        s->diffuse[c] = vf_mul(matt, base[c]);
    }
}

/* Adds the light of one lamp. */
TL_INLINE void add_rough_light(const rough_surface *s, const tl_light *light, vf *rgb)
{
    vf to_light[3], half[3], squared_cross = vf_set1(0.0f);
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f), tiny = vf_set1(0x1p-60f);
    const vf *n = s->lit.normal, strength = find_light(&s->lit, light, to_light), n_dot_l = dot3(n, to_light);
    for (int k = 0; k < 3; k++)
        half[k] = vf_add(to_light[k], s->lit.to_eye[k]);
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        const vf cross = vf_sub(vf_mul(n[a], half[b]), vf_mul(n[b], half[a]));
        squared_cross = vf_fma(cross, cross, squared_cross);
    }
    const vf squared = vf_max(dot3(half, half), tiny), n_dot_h = dot3(n, half);
    const vf steep = vf_fma(s->alpha2, vf_mul(n_dot_h, n_dot_h), squared_cross); /* times |h|^2 */
    const vf cosine = vf_min(vf_max(n_dot_l, zero), one), masked_light = masked_cosine(cosine, s->alpha2);
    const vf masking = vf_fma(cosine, s->masked_view, vf_mul(s->n_dot_v, masked_light));
    const vf above = vf_mul(vf_mul(s->alpha2, vf_set1(0.5f)), vf_mul(cosine, vf_mul(squared, squared)));
    const vf below = vf_mul(vf_mul(steep, steep), vf_max(masking, tiny));
    const vm is_lit = vm_and(vf_lt(zero, n_dot_l), vf_lt(zero, n_dot_h));
    const vf shine = vf_select(is_lit, vf_mul(strength, vf_div(above, below)), zero);
    const vf share = vf_mul(strength, diffuse_share(light, n_dot_l));
    const vf v_dot_h = vf_min(vf_mul(vf_set1(0.5f), vf_sqrt(squared)), one), rest = vf_sub(one, v_dot_h);
    const vf rest2 = vf_mul(rest, rest), grazing = vf_mul(vf_mul(rest2, rest2), rest);
    for (int c = 0; c < 3; c++) {
        const vf fresnel = vf_fma(grazing, vf_sub(one, s->f0[c]), s->f0[c]);
        const vf matt = vf_mul(vf_mul(share, vf_sub(one, fresnel)), s->diffuse[c]);
        rgb[c] = vf_fma(vf_fma(shine, fresnel, matt), vf_set1(light->color[c]), rgb[c]);
    }
}

/* The share of white surroundings that is mirrored: f0 * share[0] + share[1]. */
TL_INLINE void mirrored_share(vf roughness, vf n_dot_v, vf *share)
{
    const vf one = vf_set1(1.0f), smooth = vf_sub(one, roughness);
    const vf offset = vf_fma(vf_set1(-0.0275f), roughness, vf_set1(0.0425f));
    const vf slope = vf_min(vf_mul(smooth, smooth), vf_exp2(vf_mul(vf_set1(-9.28f), n_dot_v)));
    const vf a = vf_fma(slope, smooth, offset);
    share[0] = vf_fma(vf_set1(-1.04f), a, vf_fma(vf_set1(-0.572f), roughness, vf_set1(1.04f)));
    share[1] = vf_fma(vf_set1(1.04f), a, vf_fma(vf_set1(0.022f), roughness, vf_set1(-0.04f)));
}

/* Adds ambient light, equal from all directions, and the light of the surroundings. */
TL_INLINE void add_rough_surroundings(const rough_surface *s, const tl_shading *shading, vf occlusion, vf *rgb)
{
    vf share[2], mirrored[3], gathered[3], direction[3];
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f), *n = s->lit.normal;
    mirrored_share(s->roughness, s->n_dot_v, share);
    for (int c = 0; c < 3; c++)
        mirrored[c] = gathered[c] = vf_set1(shading->ambient[c]);
    if (shading->surroundings) {
        const vf twice = vf_mul(vf_set1(2.0f), dot3(n, s->lit.to_eye));
        vf light[3];
        for (int k = 0; k < 3; k++)
            direction[k] = vf_sub(vf_mul(twice, n[k]), s->lit.to_eye[k]);
        mirror_light(shading->surroundings, direction, s->roughness, light);
        for (int c = 0; c < 3; c++)
            mirrored[c] = vf_add(mirrored[c], light[c]);
        if (shading->surroundings->diffuse != 0.0f) {
            gather_light(shading->surroundings, n, light);
            for (int c = 0; c < 3; c++)
                gathered[c] = vf_add(gathered[c], light[c]);
        }
    }
    for (int c = 0; c < 3; c++) {
        const vf mirrors = vf_max(vf_fma(s->f0[c], share[0], share[1]), zero),
                 rest = vf_max(vf_sub(one, mirrors), zero);
        const vf matt = vf_mul(vf_mul(s->diffuse[c], rest), gathered[c]);
        rgb[c] = vf_fma(occlusion, vf_fma(mirrors, mirrored[c], matt), rgb[c]);
    }
}

#endif
