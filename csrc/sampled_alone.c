/* Sampled alone: one triangle by itself, at all samples of a pixel.
 * In: vertex records.  Out: bits of samples.
 *
 * The rows of a large triangle are the same for all samples but for their ends: the pixels between these are stored as whole
 * words, and the few words at each end are put together from the spans of the samples. */
#include "fixed.h"
#include "lanes.h"

/* Marks the spans of all samples in a row, in the words that hold the pixels [from, to); `at` is the pixel of column 0. */
TL_INLINE void cover_ends(const tl_target *target, int64_t at, int64_t from, int64_t to, const int32_t *first, const int32_t *end)
{
    const int sample_bits = target->sample_bits;
    const int64_t per_word = 64 >> sample_bits;
    for (int64_t word = (at + from) << sample_bits >> 6; word * per_word < at + to; word++) {
        const int64_t col = word * per_word - at;
        uint64_t bits = 0;
        for (int sample = 0; sample < 1 << sample_bits; sample++) {
            const int64_t begin = max64(first[sample] - col, 0) << sample_bits, stop = min64(end[sample] - col, per_word) << sample_bits;
            if (begin < stop)
                bits |= (~0ull << begin & ~0ull >> (64 - stop) & sample_pattern(sample_bits)) << sample;
        }
        target->covered[word] |= bits;
    }
}

/* A row of which sample k covers the columns [first[k], end[k]). */
TL_INLINE void cover_row(const tl_target *target, int64_t at, const int32_t *first, const int32_t *end)
{
    int32_t least = INT32_MAX, inner = 0, inner_end = INT32_MAX, most = 0;
    for (int sample = 0; sample < 1 << target->sample_bits; sample++) {
        const int is_empty = first[sample] >= end[sample];
        least = !is_empty && first[sample] < least ? first[sample] : least;
        most = !is_empty && end[sample] > most ? end[sample] : most;
        inner = first[sample] > inner ? first[sample] : inner;
        inner_end = is_empty ? 0 : end[sample] < inner_end ? end[sample] : inner_end;
    }
    if (least >= most)
        return;
    if (inner_end - inner < 64) {
        cover_ends(target, at, least, most, first, end);
        return;
    }
    cover_ends(target, at, least, inner, first, end);
    cover_span(target, (at + inner) << target->sample_bits, (int64_t)(inner_end - inner) << target->sample_bits);
    cover_ends(target, at, inner_end, most, first, end);
}

/* Returns whether the triangle could be drawn so: its row ends must fit float64. */
static int walk_samples(const tl_scene *scene, const int32_t *corners, const tl_window *window, const tl_target *shared)
{
    const tl_target own = *shared, *target = &own; /* a copy that no store can change */
    const int n_samples = 1 << target->sample_bits;
    tl_vertex_set seen = scene->mesh;
    tl_triangle t[TL_MAX_SAMPLES];
    edges_64 e[TL_MAX_SAMPLES];
    int64_t col0 = window->width, row0 = window->height, row1 = 0;
    for (int k = 0; k < n_samples; k++) {
        seen.sample_x_fx = target->samples_fx[2 * k], seen.sample_y_fx = target->samples_fx[2 * k + 1];
        const int sign = load_triangle(&seen, corners, &t[k]);
        if (!rows_fit(&t[k], window, 1))
            return 0;
        if (sign == 0 || (sign > 0 && scene->cull == TL_CULL_BACK) || (sign < 0 && scene->cull == TL_CULL_FRONT))
            return 1;
        if (!clip_box(&t[k], window)) {
            t[k].row0 = t[k].row1 = 0;
            continue;
        }
        col0 = min64(col0, t[k].col0), row0 = min64(row0, t[k].row0), row1 = max64(row1, t[k].row1);
    }
    for (int k = 0; k < n_samples && row0 < row1; k++) { /* all from one pixel, up to a pixel outside an extent */
        tl_triangle moved = t[k];
        moved.col0 = col0, moved.row0 = row0;
        e[k] = setup_edges_64(&moved, window);
    }
    int32_t first[TL_MAX_SAMPLES][TL_MAX_LANES], end[TL_MAX_SAMPLES][TL_MAX_LANES];
    for (int64_t row = row0; row < row1; row += TL_LANES) {
        const vd rows = vd_add(vd_set1((double)(row - row0)), vd_from_vi(vi_iota()));
        for (int k = 0; k < n_samples; k++)
            if (t[k].row0 < t[k].row1)
                find_row_ends(&e[k], rows, (double)(t[k].col0 - col0), (double)(t[k].col1 - col0), first[k], end[k]);
        for (int lane = 0; lane < TL_LANES && row + lane < row1; lane++) {
            int32_t own_first[TL_MAX_SAMPLES], own_end[TL_MAX_SAMPLES];
            for (int k = 0; k < n_samples; k++) {
                const int is_in = row + lane >= t[k].row0 && row + lane < t[k].row1;
                own_first[k] = is_in ? first[k][lane] : 0;
                own_end[k] = is_in ? end[k][lane] : 0;
            }
            cover_row(target, (row + lane) * target->stride_px + col0, own_first, own_end);
        }
    }
    return 1;
}

/* Triangle i by itself. */
static __attribute__((noinline)) void draw_alone_each_sample(const tl_scene *scene, int64_t i, const tl_window *window, const tl_target *target)
{
    const int32_t *corners = scene->triangles + 3 * i;
    tl_scene seen = *scene;
    tl_target one = *target;
    if (scene->method == TL_METHOD_AUTO && !is_clipped(&scene->mesh, corners) && walk_samples(scene, corners, window, target))
        return;
    for (one.sample = 0; one.sample < 1 << target->sample_bits; one.sample++) {
        seen.mesh.sample_x_fx = target->samples_fx[2 * one.sample];
        seen.mesh.sample_y_fx = target->samples_fx[2 * one.sample + 1];
        draw_alone_samples(&seen, i, window, &one);
    }
}
