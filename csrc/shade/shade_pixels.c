/* Pixels: the light of a vector of pixels, from the runs they belong to.
 * In: runs with their coefficients.  Out: linear red, green and blue; or a normal as values of 0 to 255. */
#ifndef TL_SHADE_PIXELS_C
#define TL_SHADE_PIXELS_C

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/corners.h"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/full.c"
#include "shade/light.c"
#include "shade/texture.c"

/* Sets the edge functions of the lanes with special runs, run by run. */
static void set_special_edges(shaded_lanes *p)
{
    special_lanes own = start_special(p, pick_int(p, RUN_SPECIAL));
    for (vm lanes; vm_any(lanes = next_special(p, &own));) {
        for (int k = 0; k < 3; k++)
            p->e[k] = vf_select(lanes, vf_from_vd(special_edge(&own, k)), p->e[k]);
        p->area = vf_select(lanes, vf_set1(own.run->area), p->area);
    }
}

/* Sets the lanes of vector i of the span that begins at `column`, and their edge functions as float32, except for
 * special runs. */
TL_INLINE void find_most_pixels(shaded_lanes *p, const shade_runs *s, int i, int64_t column)
{
    vi e[3], sum;
    find_lanes(p, s, i, column, e, &sum);
    p->area = vf_from_vi(sum);
    for (int k = 0; k < 3; k++)
        p->e[k] = vf_from_vi(e[k]);
    if (s->snapped->mesh.exact) {
        vf rest[3];
        find_rests(p, rest);
        for (int k = 0; k < 3; k++)
            p->e[k] = vf_add(p->e[k], rest[k]);
    }
}

/* Sets the lanes of vector i of the span that begins at `column`, and their edge functions. */
TL_INLINE void find_pixels(shaded_lanes *p, const shade_runs *s, int i, int64_t column)
{
    find_most_pixels(p, s, i, column);
    if (s->n_special)
        set_special_edges(p);
}

/* The normal of a face, for lanes whose interpolated normal is 0; 0 if the face has no area. */
static void face_normal(const shade_runs *s, int32_t id, double *n)
{
    const tl_shading *shading = s->shading;
    double p[3][3], squared = 0.0;
    int32_t corners[3];
    read_corners(s->snapped, id, corners);
    for (int k = 0; k < 3; k++)
        for (int axis = 0; axis < 3; axis++) {
            const int64_t at = 3 * (int64_t)corners[k] + axis;
            p[k][axis] = shading->is_f64 ? ((const double *)shading->positions)[at]
                                         : (double)((const float *)shading->positions)[at];
        }
    for (int axis = 0; axis < 3; axis++) {
        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
        n[axis] = (p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) - (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]);
    }
    for (int axis = 0; axis < 3; axis++)
        squared += n[axis] * n[axis];
    const double scale = squared > 0.0 ? 1.0 / sqrt(squared) : 0.0;
    for (int axis = 0; axis < 3; axis++)
        n[axis] *= scale;
}

static void replace_normals(shaded_lanes *p, vm lanes)
{
    float n[3][TL_MAX_LANES], area[TL_MAX_LANES];
    int32_t id[TL_MAX_LANES];
    vi_store(id, pick_int(p, RUN_ID));
    vf_store(area, p->area);
    for (int axis = 0; axis < 3; axis++)
        vf_store(n[axis], p->normal[axis]);
    for (unsigned rest = vm_bits(lanes); rest; rest &= rest - 1) {
        const int lane = __builtin_ctz(rest);
        double own[3];
        face_normal(p->s, id[lane], own);
        for (int axis = 0; axis < 3; axis++)
            n[axis][lane] = (float)(area[lane] < 0.0f ? -own[axis] : own[axis]);
    }
    for (int axis = 0; axis < 3; axis++)
        p->normal[axis] = vf_load(n[axis]);
}

/* Interpolates unit normals towards the viewer; returns the lanes in which the normals of the corners cancel. */
TL_INLINE vm find_normals(shaded_lanes *p)
{
    if (p->s->shading->face_normals) {
        for (int axis = 0; axis < 3; axis++)
            p->normal[axis] = pick(p, RUN_NORMAL + axis);
        return vm_first(0);
    }
    for (int axis = 0; axis < 3; axis++)
        p->normal[axis] = weighed(p, RUN_NORMAL + axis, RUN_NORMAL + 3 + axis, RUN_NORMAL + 6 + axis);
    const vf squared = dot3(p->normal, p->normal), scale = vf_div(vf_set1(1.0f), vf_sqrt(squared));
    for (int axis = 0; axis < 3; axis++)
        p->normal[axis] = vf_mul(p->normal[axis], scale);
    return vm_and(p->visible, vf_ge(pick(p, RUN_SHORTEST), squared));
}

/* Sets unit normals towards the viewer: interpolated, or that of the face where those of the corners cancel. */
TL_INLINE void set_normals(shaded_lanes *p)
{
    const vm has_none = find_normals(p);
    if (vm_any(has_none))
        replace_normals(p, has_none);
}

TL_INLINE void set_uv_lanes(shaded_lanes *p) { find_uv(p, RUN_U, RUN_GRADIENT, p->uv, p->du, p->dv); }

/* Sets the lanes of vector i of the span that begins at `column`, q and uv. */
TL_INLINE void start_lanes(shaded_lanes *p, const shade_runs *s, int i, int64_t column)
{
    find_pixels(p, s, i, column);
    if (s->needs_q) {
        p->q = weighed(p, RUN_Q, RUN_Q + 1, RUN_Q + 2);
        p->inv_q = vf_div(vf_set1(1.0f), p->q);
    }
    if (s->needs_uv)
        set_uv_lanes(p);
}

/* Sets the colours of the vertices: interpolated as sRGB values, rounded to integers, then decoded; or interpolated as
 * light. */
TL_INLINE void set_colors(shaded_lanes *p)
{
    for (int c = 0; c < 3; c++) {
        const vf value = vf_mul(weighed(p, RUN_COLOR + c, RUN_COLOR + 3 + c, RUN_COLOR + 6 + c), p->inv_q);
        if (!p->s->shading->decode) {
            p->color[c] = vf_max(value, vf_set1(0.0f));
            continue;
        }
        const vi level = vi_max(vi_min(vi_nearest(value), vi_set1(255)), vi_set1(0));
        p->color[c] = vf_of_bits(vi_gather(vm_all(), (const int32_t *)p->s->shading->decode, level));
    }
}

/* Sets the ray of each pixel, and the point of the surface on it. */
TL_INLINE void set_points(shaded_lanes *p, int64_t row, const float *depth)
{
    const tl_shading *shading = p->s->shading;
    const tl_window *window = p->s->window;
    const tl_vertex_set *set = &p->s->snapped->mesh;
    const float unit = (float)(1 << window->subpixel_bits);
    const vf x = vf_add(vf_from_vi(vi_add(p->column, vi_set1((int32_t)window->x_px))),
                        vf_set1(0.5f + (float)set->sample_x_fx / unit));
    const vf y = vf_set1((float)(row + window->y_px) + (0.5f + (float)set->sample_y_fx / unit));
    const vf w = vf_mul(p->area, p->inv_q);
    for (int axis = 0; axis < 3; axis++) {
        p->ray[axis] = vf_fma(y, vf_set1(shading->ray[2][axis]),
                              vf_fma(x, vf_set1(shading->ray[1][axis]), vf_set1(shading->ray[0][axis])));
        if (shading->has_perspective)
            p->point[axis] = vf_fma(w, p->ray[axis], vf_set1(shading->eye[axis]));
        else
            p->point[axis] = vf_fma(vf_load_masked(p->visible, depth), vf_set1(shading->ray[3][axis]), p->ray[axis]);
    }
}

/* The light of one material, computed in all lanes. */
TL_INLINE void shade_material(shaded_lanes *p, const tl_material *m, laid_texture *laid, vf *rgb)
{
    const tl_shading *shading = p->s->shading;
    if (m->is_full) {
        shade_full(p, m, laid, rgb);
        return;
    }
    start_base(p, m, rgb);
    if (m->texture) {
        vf texel[4];
        sample_laid(m->texture, p->uv[0], p->uv[1], p->du, p->dv, laid, texel, 3);
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_mul(rgb[c], texel[c]);
    }
    color_back(p, m, rgb);
    if (m->is_unlit)
        return;
    lit_surface surface;
    vf diffuse[3], specular[3];
    for (int axis = 0; axis < 3; axis++) {
        surface.normal[axis] = p->normal[axis];
        surface.point[axis] = p->point[axis];
        surface.to_eye[axis] =
            shading->has_perspective ? vf_sub(vf_set1(0.0f), p->ray[axis]) : vf_set1(shading->eye[axis]);
    }
    if (m->shininess > 0.0f && shading->has_perspective)
        normalize3(surface.to_eye);
    add_lights(&surface, shading, m->shininess, diffuse, specular);
    for (int c = 0; c < 3; c++)
        rgb[c] = vf_mul(rgb[c], diffuse[c]);
    if (m->shininess > 0.0f)
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_fma(vf_set1(m->specular[c]), specular[c], rgb[c]);
}

/* The material of a number; the first material for a number outside of the materials. */
TL_INLINE const tl_material *material_at(const tl_shading *shading, int32_t number)
{
    return &shading->materials[number < 0 || number >= shading->n_materials ? 0 : number];
}

/* Shades each lane by its material. */
static void shade_materials(shaded_lanes *p, laid_texture *laid, vf *rgb)
{
    vf opacity = vf_set1(1.0f);
    const tl_shading *shading = p->s->shading;
    const vi material = pick_int(p, RUN_MATERIAL);
    int32_t number[TL_MAX_LANES];
    vi_store(number, material);
    for (vm rest = p->visible; vm_any(rest);) {
        const int32_t own = number[__builtin_ctz(vm_bits(rest))];
        const vm lanes = vm_and(rest, vi_eq(material, vi_set1(own)));
        vf light[3];
        shade_material(p, material_at(shading, own), laid, light);
        for (int c = 0; c < 3; c++)
            rgb[c] = vf_select(lanes, light[c], rgb[c]);
        if (shading->wants_opacity)
            opacity = vf_select(lanes, p->opacity, opacity);
        rest = vm_and_not(rest, lanes);
    }
    p->opacity = opacity;
}

TL_INLINE void fade(const shaded_lanes *p, const float *depth, vf *rgb)
{
    const tl_shading *shading = p->s->shading;
    const vf way = shading->has_perspective ? vf_mul(p->area, p->inv_q) : vf_load_masked(p->visible, depth);
    const vf distance = vf_fma(way, vf_set1(shading->distance_scale), vf_set1(shading->distance_start));
    vf share = vf_mul(vf_sub(distance, vf_set1(shading->fog_near)), vf_set1(shading->fog_scale));
    share = vf_min(vf_max(share, vf_set1(0.0f)), vf_set1(1.0f));
    for (int c = 0; c < 3; c++)
        rgb[c] = vf_fma(share, vf_sub(vf_set1(shading->fog_color[c]), rgb[c]), rgb[c]);
}

TL_INLINE vf in_eye_space(const shaded_lanes *p, int axis)
{
    const float *m = p->s->shading->eye_from[axis];
    const vf row[3] = {vf_set1(m[0]), vf_set1(m[1]), vf_set1(m[2])};
    return dot3(row, p->normal);
}

/* The light and the opacity of vector i of the span that begins at `column`; some pixel of it is visible.  `depth`
 * points to its first pixel; it is read only without perspective. */
TL_INLINE void light_pixels(const shade_runs *s, int i, int64_t column, int64_t row, const float *depth, vf *rgba)
{
    const tl_shading *shading = s->shading;
    const vf zero = vf_set1(0.0f), half = vf_set1(0.5f);
    shaded_lanes p;
    laid_texture laid;
    start_lanes(&p, s, i, column);
    laid.as = NULL;
    p.opacity = vf_set1(1.0f);
    if (s->needs_normal)
        set_normals(&p);
    if (shading->show == TL_SHOW_NORMALS) {
        for (int axis = 0; axis < 3; axis++)
            rgba[axis] = vf_fma(vf_set1(127.5f), in_eye_space(&p, axis), vf_set1(127.5f));
        rgba[3] = p.opacity;
        return;
    }
    for (int c = 0; c < 3; c++)
        rgba[c] = zero;
    if (shading->show == TL_SHOW_MATCAP) {
        vf texel[4];
        const vf none[2] = {zero, zero};
        const vf u = vf_fma(half, in_eye_space(&p, 0), half), v = vf_fma(half, in_eye_space(&p, 1), half);
        sample_texture(shading->matcap, u, v, none, none, texel, 3);
        for (int c = 0; c < 3; c++)
            rgba[c] = texel[c];
    } else {
        if (s->needs_colors)
            set_colors(&p);
        if (s->needs_point)
            set_points(&p, row, depth);
        if (shading->material_of)
            shade_materials(&p, &laid, rgba);
        else
            shade_material(&p, shading->materials, &laid, rgba);
    }
    if (shading->fog_scale != 0.0f)
        fade(&p, depth, rgba);
    rgba[3] = p.opacity;
}

#endif
