/* Full materials: surfaces with more than a colour, a texture and a highlight.
 * In: a vector of pixels.  Out: their light, linear, and their opacity.
 *
 * The tangent frame of a normal map is that of the triangle: the directions in which u and v grow, by their gradients
 * over it; per-pixel derivatives would give the same frame with more rounding.  The tangent is u's direction less its
 * part along the normal of the pixel; the bitangent is at right angles to both, on the side to which v grows (uv with v
 * up; maps with green up).  Meshes have no tangents.  Where the back is visible the bent normal is turned round as a
 * whole (glTF 2.0, 3.9.5).
 *
 * Based on: C. Schuler, Normal Mapping Without Precomputed Tangents, in ShaderX5, 2007; M. Mikkelsen, Simulation of
 * Wrinkled Surfaces Revisited, 2008 (the bitangent). */
#ifndef TL_FULL_C
#define TL_FULL_C

#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/light.c"
#include "shade/metallic.c"
#include "shade/surroundings.c"
#include "shade/texture.c"

#define TL_MAX_TEXTURES 5 /* of a material */

/* Lists the textures of a material; returns how many. */
TL_INLINE int textures_of(const tl_material *m, const tl_texture **textures)
{
    const tl_texture *const all[TL_MAX_TEXTURES] = {m->texture, m->metallic_roughness, m->occlusion_map, m->normal_map,
                                                    m->emission_map};
    int n = 0;
    for (int k = 0; k < (m->is_full ? TL_MAX_TEXTURES : 1); k++)
        if (all[k])
            textures[n++] = all[k];
    return n;
}

/* Interpolates a set of uv with coefficients from `first` on, and its derivatives from `gradient` on. */
TL_INLINE void find_uv(const shaded_lanes *p, int first, int gradient, vf *uv, vf *du, vf *dv)
{
    const vf u = vf_mul(weighed(p, first, first + 1, first + 2), p->inv_q);
    const vf v = vf_mul(weighed(p, first + 3, first + 4, first + 5), p->inv_q);
    uv[0] = u, uv[1] = v;
    for (int axis = 0; axis < 2; axis++) {
        const vf q = pick(p, gradient + 3 * axis);
        du[axis] = vf_mul(vf_sub(pick(p, gradient + 3 * axis + 1), vf_mul(u, q)), p->inv_q);
        dv[axis] = vf_mul(vf_sub(pick(p, gradient + 3 * axis + 2), vf_mul(v, q)), p->inv_q);
    }
}

/* Interpolates what only full materials and cut-outs read. */
static void set_more(shaded_lanes *p)
{
    if (p->s->needs_uv1)
        find_uv(p, RUN_UV1, RUN_GRADIENT1, p->uv1, p->du1, p->dv1);
    if (p->s->needs_alpha)
        p->alpha = vf_mul(weighed(p, RUN_ALPHA, RUN_ALPHA + 1, RUN_ALPHA + 2), p->inv_q);
}

/* Samples a texture by its set of uv and its transform. */
TL_INLINE void look_up(const shaded_lanes *p, const tl_texture *t, laid_texture *laid, vf *rgba, int n_channels)
{
    const vf *uv = t->uv_set ? p->uv1 : p->uv, *du = t->uv_set ? p->du1 : p->du, *dv = t->uv_set ? p->dv1 : p->dv;
    vf at[2] = {uv[0], uv[1]}, change[2][2] = {{du[0], du[1]}, {dv[0], dv[1]}};
    if (t->has_transform)
        for (int k = 0; k < 2; k++) {
            const vf a = vf_set1(t->transform[k][0]), b = vf_set1(t->transform[k][1]), c = vf_set1(t->transform[k][2]);
            at[k] = vf_fma(a, uv[0], vf_fma(b, uv[1], c));
            for (int axis = 0; axis < 2; axis++)
                change[k][axis] = vf_fma(a, du[axis], vf_mul(b, dv[axis]));
        }
    sample_laid(t, at[0], at[1], change[0], change[1], laid, rgba, n_channels);
}

static void look_up_rgb(const shaded_lanes *p, const tl_texture *t, laid_texture *laid, vf *rgb)
{
    look_up(p, t, laid, rgb, 3);
}

static void look_up_rgba(const shaded_lanes *p, const tl_texture *t, laid_texture *laid, vf *rgba)
{
    look_up(p, t, laid, rgba, 4);
}

/* Replaces the colour where the back is visible and the material has a back colour. */
TL_INLINE void color_back(const shaded_lanes *p, const tl_material *m, vf *rgb)
{
    if (m->back_side == 0.0f)
        return;
    const vm is_back = vf_lt(vf_set1(0.0f), vf_mul(p->area, vf_set1(m->back_side)));
    for (int c = 0; c < 3; c++)
        rgb[c] = vf_select(is_back, vf_set1(m->back_color[c]), rgb[c]);
}

/* The product of the material's colour and the vertices' colour. */
TL_INLINE void start_base(const shaded_lanes *p, const tl_material *m, vf *rgb)
{
    for (int c = 0; c < 3; c++) {
        rgb[c] = vf_set1(m->color[c]);
        if (p->s->needs_colors)
            rgb[c] = vf_mul(rgb[c], p->color[c]);
    }
}

/* Sets the base colour and the opacity of the surface. */
static void find_base(shaded_lanes *p, const tl_material *m, laid_texture *laid, vf *rgb)
{
    vf texel[4], opacity = vf_set1(m->color[3]);
    start_base(p, m, rgb);
    if (p->s->needs_alpha)
        opacity = vf_mul(opacity, p->alpha);
    if (m->texture) {
        if (p->s->shading->wants_opacity) {
            look_up_rgba(p, m->texture, laid, texel);
            opacity = vf_mul(opacity, texel[3]);
        } else {
            look_up_rgb(p, m->texture, laid, texel);
        }
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_mul(rgb[c], texel[c]);
    }
    color_back(p, m, rgb);
    p->opacity = vf_min(vf_max(opacity, vf_set1(0.0f)), vf_set1(1.0f));
}

/* Bends the unit normal `n` by the normal map. */
TL_INLINE void bend_normal(const shaded_lanes *p, const tl_material *m, laid_texture *laid, vf *n)
{
    const tl_texture *t = m->normal_map;
    const int first = RUN_TANGENT + N_TANGENT_FLOATS * t->uv_set;
    const vf zero = vf_set1(0.0f), one = vf_set1(1.0f), two = vf_set1(2.0f), tiny = vf_set1(0x1p-40f),
             scale = vf_set1(m->normal_scale);
    vf texel[4], along[3], tangent[3], bent[3];
    look_up_rgb(p, t, laid, texel);
    const vf x = vf_mul(vf_fma(two, texel[0], vf_set1(-1.0f)), scale),
             y = vf_mul(vf_fma(two, texel[1], vf_set1(-1.0f)), scale);
    const vf z = vf_fma(two, texel[2], vf_set1(-1.0f));
    for (int k = 0; k < 3; k++) {
        along[k] = pick(p, first + k);
        if (t->has_transform)
            along[k] = vf_fma(vf_set1(t->tangent[0]), along[k], vf_mul(vf_set1(t->tangent[1]), pick(p, first + 3 + k)));
    }
    const vf off = dot3(n, along);
    for (int k = 0; k < 3; k++)
        tangent[k] = vf_sub(along[k], vf_mul(off, n[k]));
    const vf squared = dot3(tangent, tangent), hand = vf_mul(pick(p, first + 6), vf_set1(t->hand));
    const vf length = vf_select(vf_lt(tiny, squared), vf_div(one, vf_sqrt(squared)), zero);
    const vf along_x = vf_mul(x, length), along_y = vf_mul(y, vf_mul(length, hand));
    for (int k = 0; k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        const vf bitangent = vf_sub(vf_mul(n[a], tangent[b]), vf_mul(n[b], tangent[a]));
        bent[k] = vf_fma(along_x, tangent[k], vf_fma(along_y, bitangent, vf_mul(z, n[k])));
    }
    const vf rest = dot3(bent, bent), unit = vf_div(one, vf_sqrt(rest));
    const vm has_some = vf_lt(tiny, rest);
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(has_some, vf_mul(bent[k], unit), n[k]);
}

/* Sets the point of the surface, its normal, and the direction to the eye. */
TL_INLINE void find_surface(const shaded_lanes *p, const tl_material *m, laid_texture *laid, lit_surface *s)
{
    const tl_shading *shading = p->s->shading;
    for (int axis = 0; axis < 3; axis++) {
        s->normal[axis] = p->normal[axis];
        s->point[axis] = p->point[axis];
        s->to_eye[axis] = shading->has_perspective ? vf_sub(vf_set1(0.0f), p->ray[axis]) : vf_set1(shading->eye[axis]);
    }
    if (shading->has_perspective && p->s->needs_point)
        normalize3(s->to_eye);
    if (m->normal_map)
        bend_normal(p, m, laid, s->normal);
}

/* Light of a surface with diffuse colour and Blinn's highlight: lights, ambient light and surroundings. */
static void light_plain(const shaded_lanes *p, const tl_material *m, laid_texture *laid, vf occlusion, vf *rgb)
{
    const tl_shading *shading = p->s->shading;
    lit_surface s;
    vf diffuse[3], specular[3];
    find_surface(p, m, laid, &s);
    for (int c = 0; c < 3; c++)
        diffuse[c] = vf_set1(shading->ambient[c]), specular[c] = vf_set1(0.0f);
    if (shading->surroundings && shading->surroundings->diffuse != 0.0f) {
        vf gathered[3];
        gather_light(shading->surroundings, s.normal, gathered);
        for (int c = 0; c < 3; c++)
            diffuse[c] = vf_add(diffuse[c], gathered[c]);
    }
    for (int c = 0; c < 3; c++)
        diffuse[c] = vf_mul(diffuse[c], occlusion);
    for (int k = 0; k < shading->n_lights; k++)
        add_light(&s, &shading->lights[k], m->shininess, diffuse, specular);
    for (int c = 0; c < 3; c++)
        rgb[c] = vf_mul(rgb[c], diffuse[c]);
    if (m->shininess > 0.0f)
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_fma(vf_set1(m->specular[c]), specular[c], rgb[c]);
}

static void light_rough(const shaded_lanes *p, const tl_material *m, const vf *found, laid_texture *laid, vf occlusion,
                        vf *rgb)
{
    const tl_shading *shading = p->s->shading;
    vf metallic = vf_set1(m->metallic), roughness = vf_set1(m->roughness), base[3];
    rough_surface s;
    find_surface(p, m, laid, &s.lit);
    if (m->metallic_roughness)
        roughness = vf_mul(roughness, found[1]), metallic = vf_mul(metallic, found[2]);
    for (int c = 0; c < 3; c++)
        base[c] = rgb[c], rgb[c] = vf_set1(0.0f);
    set_rough(&s, base, metallic, roughness);
    add_rough_surroundings(&s, shading, occlusion, rgb);
    for (int k = 0; k < shading->n_lights; k++)
        add_rough_light(&s, &shading->lights[k], rgb);
}

/* The light of a full material, computed in all lanes. */
static void shade_full(shaded_lanes *p, const tl_material *m, laid_texture *laid, vf *rgb)
{
    vf found[4], occlusion = vf_set1(1.0f);
    if (p->s->needs_more)
        set_more(p);
    find_base(p, m, laid, rgb);
    if (m->is_unlit)
        return;
    if (m->metallic_roughness)
        look_up_rgb(p, m->metallic_roughness, laid, found);
    if (m->occlusion_map) {
        vf texel[4];
        if (m->occlusion_map == m->metallic_roughness)
            texel[0] = found[0];
        else
            look_up_rgb(p, m->occlusion_map, laid, texel);
        occlusion = vf_fma(vf_set1(m->occlusion), vf_sub(texel[0], vf_set1(1.0f)), vf_set1(1.0f));
    }
    if (m->is_metallic)
        light_rough(p, m, found, laid, occlusion, rgb);
    else
        light_plain(p, m, laid, occlusion, rgb);
    if (m->emission_map) {
        vf texel[4];
        look_up_rgb(p, m->emission_map, laid, texel);
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_fma(vf_set1(m->emission[c]), texel[c], rgb[c]);
    } else {
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_add(vf_set1(m->emission[c]), rgb[c]);
    }
}

#endif
