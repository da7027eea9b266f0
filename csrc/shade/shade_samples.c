/* Shades and resolves a visibility buffer with several samples a pixel.  A triangle is shaded once in each pixel that
 * it shows in, at the first of its samples; the pixel is the mean of the light at its samples, each clamped to white,
 * as on a display and in the buffers of graphics hardware.
 * In: planes of ids; the instances.  Out: red, green, blue and opacity, uint8. */
#ifndef TL_SHADE_SAMPLES_C
#define TL_SHADE_SAMPLES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "pixels/runs.c"
#include "pixels/shading.h"
#include "shade/shade_pixels.c"
#include "shade/shade.c"
#include "shade/span_list.c"
#include "shade/srgb.c"

/* Sums of light of a span of pixels, and the number of samples in each sum. */
typedef struct {
    float light[3][TL_SPAN_ROOM], n_lit[TL_SPAN_ROOM];
    float n_seen[TL_SPAN_ROOM]; /* the number of samples that show the triangle in `ids` */
    int32_t ids[TL_SPAN_ROOM];  /* the triangles that are shaded at this sample, -1 elsewhere */
} sample_sums;

/* Sets the triangles of n pixels whose first sample is k; returns whether there are any. */
TL_INLINE int find_first_seen(sample_sums *sums, const int32_t *ids, int64_t stride, int sample_bits, int k, int n)
{
    const vi none = vi_set1(-1);
    int any = 0;
    for (int x = 0; x < n; x += TL_LANES) {
        const vm inside = vm_first(n - x);
        const vi own = vi_select(inside, vi_load_masked(inside, ids + k * stride + x), none);
        vm first = vi_gt(own, none);
        for (int before = 0; before < k && vm_any(first); before++)
            first = vm_and_not(first, vi_eq(own, vi_load_masked(inside, ids + before * stride + x)));
        vi_store(sums->ids + x, vi_select(first, own, none));
        if (!vm_any(first))
            continue;
        vi count = vi_set1(1);
        for (int after = k + 1; after < 1 << sample_bits; after++)
            count = vi_add(
                count, vi_select(vi_eq(own, vi_load_masked(inside, ids + after * stride + x)), vi_set1(1), vi_set1(0)));
        vf_store(sums->n_seen + x, vf_from_vi(count));
        any = 1;
    }
    return any;
}

/* Shades n pixels of a span from pixel `first` on, whose runs are set, and adds their light, clamped, times their
 * number of samples. */
TL_INLINE void add_samples(sample_sums *sums, const shade_runs *s, int first, int n, int64_t column, int64_t row,
                           const float *depth)
{
    const vf zero = vf_set1(0.0f), most = vf_set1(s->shading->show == TL_SHOW_NORMALS ? 255.0f : 1.0f);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        if (!s->visible[i])
            continue;
        const vm visible = vm_from_bits(s->visible[i]);
        const int at = first + x;
        vf rgba[4];
        light_pixels(s, i, column, row, depth + x, rgba);
        const vf weight = vf_select(visible, vf_load(sums->n_seen + at), zero);
        for (int c = 0; c < 3; c++) {
            const vf shown = vf_select(visible, vf_min(vf_max(rgba[c], zero), most), zero);
            vf_store(sums->light[c] + at, vf_fma(weight, shown, vf_load(sums->light[c] + at)));
        }
        vf_store(sums->n_lit + at, vf_add(weight, vf_load(sums->n_lit + at)));
    }
}

/* Shades the triangles of sums->ids in n pixels, instance by instance. */
TL_INLINE void add_shaded(sample_sums *sums, shade_runs *s, span_list *list, const int32_t *at_fx, int64_t row,
                          int64_t column, int n, const float *depth)
{
    list_instances(list, sums->ids, n);
    for (int k = 0; k < list->n; k++) {
        const int first = list->parts[k].first, n_own = list->parts[k].end - first;
        set_part(s, list, k, at_fx);
        find_runs(s, sums->ids + first, n_own, column + first);
        set_runs(s, row);
        add_samples(sums, s, first, n_own, column + first, row, depth + first);
    }
}

/* The mean light over the background ("over"), encoded.  Pixels with no sample or all samples on triangles have no
 * rounding error from it. */
TL_INLINE vi finish_lanes(const sample_sums *sums, const tl_shading *shading, int sample_bits, int x)
{
    const vf share = vf_mul(vf_load(sums->n_lit + x), vf_set1(1.0f / (float)(1 << sample_bits)));
    const vf behind = vf_mul(vf_sub(vf_set1(1.0f), share), vf_set1(shading->background[3]));
    const vf opacity = vf_add(share, behind);
    const float *bytes =
        (float[3]){shading->background_bytes[0], shading->background_bytes[1], shading->background_bytes[2]};
    const float *ground = shading->show == TL_SHOW_NORMALS ? bytes : shading->background;
    vi byte[3];
    int32_t background;
    for (int c = 0; c < 3; c++) {
        const vf mean = vf_mul(vf_load(sums->light[c] + x), vf_set1(1.0f / (float)(1 << sample_bits)));
        byte[c] = to_byte(shading->show, vf_div(vf_fma(behind, vf_set1(ground[c]), mean), opacity));
    }
    memcpy(&background, shading->background_bytes, 4);
    const vi word = to_word(byte[0], byte[1], byte[2], vi_nearest(vf_mul(vf_set1(255.0f), opacity)));
    return vi_select(vf_lt(vf_set1(0.0f), share), word, vi_set1(background));
}

static void shade_samples(const tl_shaded_scene *scene, const tl_window *window, const int32_t *samples_fx,
                          int sample_bits, int64_t stride, const int32_t *ids, const float *depth, uint8_t *pixels)
{
    const tl_shading *shading = scene->instances->shading;
    shade_runs s;
    span_list list;
    sample_sums sums;
    start_runs(&s, window, scene->view);
    start_list(&list, scene);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row++) {
        tl_count_work(window, TL_SHADE_PX * window->width);
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            memset(&sums, 0, offsetof(sample_sums, n_seen));
            for (int k = 0; k < 1 << sample_bits; k++)
                if (find_first_seen(&sums, ids + at, stride, sample_bits, k, n))
                    add_shaded(&sums, &s, &list, samples_fx + 2 * k, row, column, n, depth + at + k * stride);
            for (int x = 0; x < n; x += TL_LANES)
                vi_store_masked((int32_t *)pixels + at + x, vm_first(n - x),
                                finish_lanes(&sums, shading, sample_bits, x));
        }
    }
}

#endif
