/* Shades a visibility buffer: a picture in linear light, encoded as sRGB; or the normals of shading, as numbers.
 * In: ids, the mesh they were drawn from, materials and lights.  Out: red, green, blue and opacity, uint8; or unit
 * vectors, float32, on the visible side, 0 for the background. */
#ifndef TL_SHADE_C
#define TL_SHADE_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "pixels/weights.c"
#include "shade/light.c"
#include "shade/shade_pixels.c"
#include "shade/span_list.c"
#include "shade/srgb.c"

TL_INLINE vi encode_light(const tl_shading *shading, const vf *rgba)
{
    const vi opacity = shading->wants_opacity ? vi_nearest(vf_mul(vf_set1(255.0f), rgba[3])) : vi_set1(255);
    return to_word(to_byte(shading->show, rgba[0]), to_byte(shading->show, rgba[1]), to_byte(shading->show, rgba[2]),
                   opacity);
}

/* Writes the words of the visible pixels of a vector; n pixels are left in the span. */
TL_INLINE void put_shaded(int32_t *pixels, unsigned visible, int n, vi word)
{
    const vm lanes = vm_from_bits(visible);
    if (n >= TL_LANES)
        vi_store(pixels, vi_select(lanes, word, vi_load(pixels)));
    else
        vi_store_masked(pixels, lanes, word);
}

/* Shades n pixels of a span in grey light: first all light, then all words, because each loop by itself overlaps
 * better. */
TL_ONCE void shade_grey(const shade_runs *s, int n, int64_t column, int32_t *pixels)
{
    _Alignas(64) float light[TL_SPAN_ROOM];
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++)
        if (s->visible[i])
            light_grey(s, i, column, light + x);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++)
        if (s->visible[i])
            put_shaded(pixels + x, s->visible[i], n - x, grey_word(s, vf_load(light + x)));
}

/* Fills a span with the background, and prefetches the ids and the pixels of the row below. */
TL_INLINE void start_span(int32_t *pixels, int32_t word, int n, const int32_t *ids, int64_t to_next)
{
    for (int x = 0; to_next && x < n; x += 16) {
        __builtin_prefetch(ids + to_next + x);
        __builtin_prefetch(pixels + to_next + x, 1);
    }
    for (int x = 0; x < n; x += TL_LANES)
        if (n - x >= TL_LANES)
            vi_store(pixels + x, vi_set1(word));
        else
            vi_store_masked(pixels + x, vm_first(n - x), vi_set1(word));
}

/* Shades n pixels of a span from `column` on, whose runs are set; `depth` points to the first pixel. */
TL_INLINE void shade_runs_of(const shade_runs *s, int n, int64_t column, int64_t row, const float *depth,
                             int32_t *pixels)
{
    if (s->is_grey) {
        shade_grey(s, n, column, pixels);
        return;
    }
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        vf rgba[4];
        if (!s->visible[i])
            continue;
        light_pixels(s, i, column, row, depth + x, rgba);
        put_shaded(pixels + x, s->visible[i], n - x, encode_light(s->shading, rgba));
    }
}

/* Sets the unit normals of n pixels of a span from `column` on, whose runs are set: a plane an axis. */
TL_INLINE void find_unit_normals(const shade_runs *s, int n, int64_t column, float (*planes)[TL_SPAN_ROOM], int first)
{
    const vf zero = vf_set1(0.0f);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        shaded_lanes p;
        vf normal[3];
        if (!s->visible[i])
            continue;
        find_pixels(&p, s, i, column);
        set_normals(&p);
        for (int axis = 0; axis < 3; axis++)
            normal[axis] = in_eye_space(&p, axis);
        const vf squared = dot3(normal, normal), scale = vf_div(vf_set1(1.0f), vf_sqrt(squared));
        const vm has_some = vm_and(p.visible, vf_lt(zero, squared));
        for (int axis = 0; axis < 3; axis++) {
            float *own = planes[axis] + first + x;
            vf_store(own, vf_select(has_some, vf_mul(normal[axis], scale), vf_load(own)));
        }
    }
}

/* Stores the normals of n pixels. */
TL_INLINE void store_normals(const float (*planes)[TL_SPAN_ROOM], int n, float *restrict out)
{
    for (int x = 0; x < n; x += TL_LANES) {
        const vf normal[3] = {vf_load(planes[0] + x), vf_load(planes[1] + x), vf_load(planes[2] + x)};
        store_channels(out + 3 * x, 3, (int)min64(n - x, TL_LANES), normal, 3);
    }
}

/* Shades a visibility buffer, or writes its normals; rows of window->width. */
static void shade_buffer(const tl_shaded_scene *scene, const tl_window *window, const int32_t *at_fx,
                         const int32_t *ids, const float *depth, uint8_t *pixels, float *restrict normals)
{
    shade_runs s;
    span_list list;
    int32_t background;
    float planes[3][TL_SPAN_ROOM];
    memcpy(&background, scene->instances->shading->background_bytes, 4);
    start_runs(&s, window, scene->view);
    start_list(&list, scene);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row++) {
        tl_count_work(window, TL_SHADE_PX * window->width);
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            int32_t *const own = normals ? NULL : (int32_t *)pixels + at;
            if (normals)
                memset(planes, 0, sizeof planes);
            else
                start_span(own, background, n, ids + at, row + 1 < window->height ? window->width : 0);
            list_instances(&list, ids + at, n);
            for (int k = 0; k < list.n; k++) {
                const int first = list.parts[k].first, n_own = list.parts[k].end - first;
                set_part(&s, &list, k, at_fx);
                find_runs(&s, ids + at + first, n_own, column + first);
                set_runs(&s, row);
                if (normals)
                    find_unit_normals(&s, n_own, column + first, planes, first);
                else
                    shade_runs_of(&s, n_own, column + first, row, depth + at + first, own + first);
            }
            if (normals)
                store_normals((const float (*)[TL_SPAN_ROOM])planes, n, normals + 3 * at);
        }
    }
}

static void shade(const tl_shaded_scene *scene, const tl_window *window, const int32_t *at_fx, const int32_t *ids,
                  const float *depth, uint8_t *pixels)
{
    shade_buffer(scene, window, at_fx, ids, depth, pixels, NULL);
}
static void shade_normals(const tl_shaded_scene *scene, const tl_window *window, const int32_t *ids, float *out)
{
    shade_buffer(scene, window, NULL, ids, NULL, NULL, out);
}

#endif
