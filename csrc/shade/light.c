/* Light: the light of each colour that a surface reflects to the eye.
 * In: a unit normal, a point of the surface, the direction to the eye.  Out: diffuse light and highlights, linear.
 * Based on: J. H. Lambert, Photometria, 1760; J. F. Blinn, Models of Light Reflection for Computer Synthesized
 * Pictures, 1977; J. Mitchell, G. McTaggart and C. Green, Shading in Valve's Source Engine, 2006 (the wrapped fall-off,
 * there with the power 2); Khronos, glTF extension KHR_lights_punctual, 2018 (the cone of a spot). */
#ifndef TL_LIGHT_C
#define TL_LIGHT_C

#include "lanes/lanes.h"
#include "pixels/shading.h"
#include "shade/texture.c"

typedef struct {
    vf normal[3]; /* unit, towards the viewer */
    vf point[3];  /* read for point lights and spots */
    vf to_eye[3]; /* unit; read when the material has a highlight */
} lit_surface;

TL_INLINE vf dot3(const vf *a, const vf *b) { return vf_fma(a[0], b[0], vf_fma(a[1], b[1], vf_mul(a[2], b[2]))); }

TL_INLINE void normalize3(vf *a)
{
    const vf scale = vf_div(vf_set1(1.0f), vf_sqrt(dot3(a, a)));
    for (int k = 0; k < 3; k++)
        a[k] = vf_mul(a[k], scale);
}

/* 2^a for -126 <= a <= 127, with a relative error of 2^-22; 0 below -126.5. */
TL_INLINE vf vf_exp2(vf a)
{
    const vf low = vf_max(a, vf_set1(-127.0f));
    const vi whole = vi_nearest(low);
    const vf t = vf_sub(low, vf_from_vi(whole));
    vf sum = vf_set1(0x1.5c08dc00p-10f);
    sum = vf_fma(sum, t, vf_set1(0x1.3d0c5200p-7f));
    sum = vf_fma(sum, t, vf_set1(0x1.c6b6e600p-5f));
    sum = vf_fma(sum, t, vf_set1(0x1.ebf91800p-3f));
    sum = vf_fma(sum, t, vf_set1(0x1.62e42800p-1f));
    sum = vf_fma(sum, t, vf_set1(1.0f));
    return vf_mul(sum, vf_of_bits(vi_shift_left(vi_add(whole, vi_set1(127)), 23)));
}

/* cos^shininess of the angle between the normal and the half vector of light and eye. */
TL_INLINE vf highlight(const lit_surface *s, const vf *to_light, vf n_dot_l, float shininess)
{
    vf half[3];
    for (int k = 0; k < 3; k++)
        half[k] = vf_add(to_light[k], s->to_eye[k]);
    const vf zero = vf_set1(0.0f), tiny = vf_set1(0x1p-100f);
    const vf cosine = vf_div(dot3(s->normal, half), vf_sqrt(vf_max(dot3(half, half), tiny)));
    const vf power = vf_exp2(vf_mul(vf_set1(shininess), vf_log2(vf_min(vf_max(cosine, tiny), vf_set1(1.0f)))));
    return vf_select(vf_lt(zero, n_dot_l), power, zero);
}

/* Sets the unit vector to a light; returns its strength at the surface. */
TL_INLINE vf find_light(const lit_surface *s, const tl_light *light, vf *to_light)
{
    if (light->kind != TL_LIGHT_POINT && light->kind != TL_LIGHT_SPOT) {
        for (int k = 0; k < 3; k++)
            to_light[k] = vf_set1(light->at[k]);
        return vf_set1(1.0f);
    }
    for (int k = 0; k < 3; k++)
        to_light[k] = vf_sub(vf_set1(light->at[k]), s->point[k]);
    const vf squared = dot3(to_light, to_light),
             scale = vf_div(vf_set1(1.0f), vf_sqrt(vf_max(squared, vf_set1(0x1p-100f))));
    for (int k = 0; k < 3; k++)
        to_light[k] = vf_mul(to_light[k], scale);
    const vf strength = vf_div(vf_set1(1.0f), vf_fma(vf_set1(light->falloff), squared, vf_set1(1.0f)));
    if (light->kind == TL_LIGHT_POINT)
        return strength;
    const vf away[3] = {vf_set1(-light->axis[0]), vf_set1(-light->axis[1]), vf_set1(-light->axis[2])};
    const vf cone = vf_fma(vf_set1(light->cone_scale), dot3(away, to_light), vf_set1(light->cone_offset));
    const vf share = vf_min(vf_max(cone, vf_set1(0.0f)), vf_set1(1.0f));
    return vf_mul(strength, vf_mul(share, share));
}

/* The share of a light that a matt surface reflects, from n . l. */
TL_INLINE vf diffuse_share(const tl_light *light, vf n_dot_l)
{
    const vf half = vf_set1(0.5f);
    if (light->kind != TL_LIGHT_WRAPPED)
        return vf_max(n_dot_l, vf_set1(0.0f));
    const vf wrapped = vf_fma(half, n_dot_l, half);
    return vf_mul(wrapped, vf_mul(wrapped, wrapped));
}

TL_INLINE void add_light(const lit_surface *s, const tl_light *light, float shininess, vf *diffuse, vf *specular)
{
    vf to_light[3];
    const vf strength = find_light(s, light, to_light), n_dot_l = dot3(s->normal, to_light);
    const vf share = vf_mul(diffuse_share(light, n_dot_l), strength);
    for (int c = 0; c < 3; c++)
        diffuse[c] = vf_fma(share, vf_set1(light->color[c]), diffuse[c]);
    if (shininess > 0.0f) {
        const vf shine = vf_mul(strength, highlight(s, to_light, n_dot_l, shininess));
        for (int c = 0; c < 3; c++)
            specular[c] = vf_fma(shine, vf_set1(light->color[c]), specular[c]);
    }
}

/* The ambient light and the light of all lights. */
TL_INLINE void add_lights(const lit_surface *s, const tl_shading *shading, float shininess, vf *diffuse, vf *specular)
{
    for (int c = 0; c < 3; c++)
        diffuse[c] = vf_set1(shading->ambient[c]), specular[c] = vf_set1(0.0f);
    for (int k = 0; k < shading->n_lights; k++)
        add_light(s, &shading->lights[k], shininess, diffuse, specular);
}

#endif
