/* Shades a visibility buffer: a picture in light, from light to sRGB; or the normals that shading has, as numbers.
 * In: ids, the mesh they were drawn from, materials and lights.  Out: red, green, blue and opacity, uint8; or unit
 * vectors, float32, on the side that is seen, 0 where nothing is. */
#ifndef TL_SHADE_C
#define TL_SHADE_C

#include <stdint.h>
#include <string.h>

#include "shading.h"
#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "pixels/runs.c"
#include "pixels/weights.c"
#include "shade/light.c"
#include "shade/prefetch.c"
#include "shade/shade_pixels.c"
#include "shade/srgb.c"

/* Notes what a full material needs. */
static void note_full(shade_runs *s, const tl_material *m)
{
    const tl_texture *textures[TL_MAX_TEXTURES];
    const int n = textures_of(m, textures);
    for (int k = 0; k < n; k++) {
        s->needs_uv |= textures[k]->uv_set == 0;
        s->needs_uv1 |= textures[k]->uv_set == 1;
    }
    if (m->normal_map && !m->is_unlit)
        s->needs_tangents[m->normal_map->uv_set] = 1;
}

static void start_runs(shade_runs *s, const tl_snapped *snapped, const tl_window *window, const tl_view *view,
                       const tl_shading *shading)
{
    int shines = 0, has_texture = 0, is_lit = 0, has_points = 0;
    const int shows_light = shading->show == TL_SHOW_LIGHT;
    s->snapped = snapped, s->window = window, s->shading = shading, s->view = view;
    s->needs_uv = s->needs_uv1 = s->needs_tangents[0] = s->needs_tangents[1] = 0;
    for (int k = 0; k < shading->n_materials; k++) {
        const tl_material *m = &shading->materials[k];
        has_texture |= m->texture != NULL && !m->is_full;
        is_lit |= !m->is_unlit;
        shines |= !m->is_unlit && (m->shininess > 0.0f || m->is_metallic);
        if (m->is_full && shows_light)
            note_full(s, m);
    }
    for (int k = 0; k < shading->n_lights; k++)
        has_points |= shading->lights[k].kind == TL_LIGHT_POINT;
    s->needs_normal = !shows_light || is_lit;
    s->needs_uv = shading->uv && (s->needs_uv || (shows_light && has_texture));
    s->needs_uv1 &= shading->uv1 != NULL;
    s->needs_tangents[0] &= shading->uv != NULL, s->needs_tangents[1] &= shading->uv1 != NULL;
    s->needs_colors = shows_light && shading->colors;
    s->needs_alpha = s->needs_colors && shading->has_alpha && shading->wants_opacity;
    s->needs_point = shows_light && ((is_lit && has_points) || shines);
    s->needs_more = s->needs_uv1 || s->needs_alpha || s->needs_tangents[0] || s->needs_tangents[1];
    s->needs_q = s->needs_uv || s->needs_more || s->needs_colors || s->needs_point || shading->fog_scale != 0.0f;
    s->is_plain = s->needs_normal && !s->needs_q && !shading->face_normals && !shading->normal_of_corner &&
                  !shading->finds_inverse_w && window->subpixel_bits > 0;
    note_far(s);
    start_grey(s);
    memset(s->ints, 0, sizeof s->ints);
    for (int k = 0; k < N_RUN_FLOATS; k++)
        memset(s->floats[k], 0, TL_MAX_LANES * sizeof(float));
}

/* Prepares the runs of the pixels from `column` on in a row of ids; returns how many pixels. */
TL_INLINE int start_span(shade_runs *s, const int32_t *ids, int64_t row, int64_t column)
{
    const int n = (int)min64(TL_SPAN, s->window->width - column);
    find_runs(s, ids + row * s->window->width + column, n, column);
    set_runs(s, row);
    return n;
}

TL_INLINE vi encode_light(const tl_shading *shading, const vf *rgba)
{
    const vi opacity = shading->wants_opacity ? vi_rint(vf_mul(vf_set1(255.0f), rgba[3])) : vi_set1(255);
    return to_word(to_byte(shading->show, rgba[0]), to_byte(shading->show, rgba[1]), to_byte(shading->show, rgba[2]),
                   opacity);
}

/* n pixels of a span in grey light: first the light of all, then the words, as either alone overlaps with its like. */
TL_ONCE void shade_grey_span(shade_runs *s, int n, int64_t column, int32_t background, int32_t *pixels)
{
    _Alignas(64) float light[TL_SPAN_ROOM];
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++)
        if (s->visible[i])
            light_grey(s, i, column, light + x);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        vi word = vi_set1(background);
        if (s->visible[i])
            word = vi_select(vm_from_bits(s->visible[i]), grey_word(s, vf_load(light + x)), word);
        if (n - x >= TL_LANES)
            vi_store(pixels + x, word);
        else
            vi_store_masked(pixels + x, vm_first(n - x), word);
    }
}

/* The picture of a visibility buffer; rows of window->width. */
static void shade(const tl_snapped *snapped, const tl_window *window, const tl_view *view, const tl_shading *shading,
                  const int32_t *ids, const float *depth, uint8_t *pixels)
{
    shade_runs s;
    started_span span;
    int32_t background;
    memcpy(&background, shading->background_bytes, 4);
    start_runs(&s, snapped, window, view, shading);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row++) {
        tl_count_work(window, TL_SHADE_PX * window->width);
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = start_span(&s, ids, row, column), n_vectors = (n + TL_LANES - 1) / TL_LANES;
            if (s.is_grey) {
                shade_grey_span(&s, n, column, background, (int32_t *)pixels + at);
                continue;
            }
            span.next = 0;
            for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
                vi word = vi_set1(background);
                if (s.visible[i]) {
                    vf rgba[4];
                    light_pixels(&span, &s, i, n_vectors, column, row, depth + at + x, rgba);
                    word = vi_select(vm_from_bits(s.visible[i]), encode_light(shading, rgba), word);
                }
                if (n - x >= TL_LANES)
                    vi_store((int32_t *)pixels + at + x, word);
                else
                    vi_store_masked((int32_t *)pixels + at + x, vm_first(n - x), word);
            }
        }
    }
}

/* Copies rows [first, end) of four numbers, the last of them replaced by 1/w of the vertex. */
static void set_inverse_w(const tl_source *source, const float *rows, int64_t first, int64_t end, float *restrict out)
{
    int64_t i = first;
    for (;
         TL_LANES > 1 && source->scalar == TL_F32 && source->matrix && i + TL_LANES <= end && i + TL_LANES < source->n;
         i += TL_LANES) {
        vf p[4];
        clip_lanes_f32((const float *)source->data + 3 * i, (const float *)source->matrix, 3, p);
        vf_store_fourths(rows + 4 * i, vf_div(vf_set1(1.0f), p[3]), out + 4 * i);
    }
    for (; i < end; i++) {
        double p[4];
        clip_position(source, i, p);
        for (int k = 0; k < 3; k++)
            out[4 * i + k] = rows[4 * i + k];
        out[4 * i + 3] = source->scalar == TL_F32 ? 1.0f / (float)p[3] : (float)(1.0 / p[3]);
    }
}

static void shade_normals(const tl_snapped *snapped, const tl_window *window, const tl_view *view,
                          const tl_shading *shading, const int32_t *ids, float *restrict out)
{
    shade_runs s;
    const vf zero = vf_set1(0.0f);
    start_runs(&s, snapped, window, view, shading);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row++) {
        tl_count_work(window, TL_SHADE_PX * window->width);
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = start_span(&s, ids, row, column);
            for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
                vf normal[3] = {zero, zero, zero};
                if (s.visible[i]) {
                    shaded_lanes p;
                    find_pixels(&p, &s, i, column);
                    set_normals(&p);
                    for (int axis = 0; axis < 3; axis++)
                        normal[axis] = in_eye_space(&p, axis);
                    const vf squared = dot3(normal, normal), scale = vf_div(vf_set1(1.0f), vf_sqrt(squared));
                    const vm has_some = vm_and(p.visible, vf_lt(zero, squared));
                    for (int axis = 0; axis < 3; axis++)
                        normal[axis] = vf_select(has_some, vf_mul(normal[axis], scale), zero);
                }
                store_channels(out + 3 * (at + x), 3, (int)min64(n - x, TL_LANES), normal, 3);
            }
        }
    }
}

#endif
