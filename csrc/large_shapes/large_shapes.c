/* Large shapes: pictures of a few large triangles without depth, written row by row.
 * In: triangles of a snapped mesh.  Out: mask, counts, labels, or shares of covered samples.
 *
 * Where triangles are drawn one after the other, the picture is cleared first, and memory is written twice, or through
 * bits that are expanded at the end.  Here the spans of a row become runs of pixels that hold the same, and each run is
 * written once.  Several samples make more runs, and nothing else: a run is where all of them see the same. */
#ifndef TL_LARGE_SHAPES_C
#define TL_LARGE_SHAPES_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "sink/covered.c"
#include "raster/single_fixed.c"
#include "raster/raster.c"
#include "large_shapes/row_runs.c"
#include "large_shapes/row_spans.c"

/* Whether all that is drawn is a few triangles of a sink that this file knows. */
static int draws_large_shapes(const tl_snapped *snapped, const tl_window *window, const tl_target *target,
                              const tl_slice *slice)
{
    const int is_known = target->sink == TL_SINK_MASK || target->sink == TL_SINK_COUNT ||
                         target->sink == TL_SINK_LABEL || target->sink == TL_SINK_SAMPLES;
    const int is_whole = slice->is_first && slice->is_last && !slice->ids && !slice->clusters && !slice->outside &&
                         slice->first == 0 && slice->end == snapped->n_triangles;
    const int n_samples = target->sink == TL_SINK_SAMPLES ? 1 << target->sample_bits : 1;
    const tl_shape_limit most = target->covered ? TL_SHAPES_OF_BITS : TL_SHAPES_STORED;
    return is_known && is_whole && window->test == TL_TEST_SAMPLE && !snapped->mesh.exact &&
           tl_is_large_shapes(spans_in_row(snapped, 1), n_samples, window->width, window->height, most);
}

/* The pixel value of a run, as it stands in memory. */
TL_INLINE int32_t word_of_key(const tl_target *target, tl_sink sink, uint64_t key)
{
    if (sink != TL_SINK_SAMPLES)
        return (int32_t)key;
    const float share = (float)__builtin_popcountll(key) / (float)(1 << target->sample_bits);
    int32_t word;
    memcpy(&word, &share, sizeof word);
    return word;
}

/* The rows of a band from `at` on; their spans are listed. */
TL_INLINE void put_rows(const tl_snapped *snapped, const tl_window *band, const tl_target *target, const span_table *t,
                        int64_t at, open_run *run, tl_sink sink)
{
    const int n_samples = sink == TL_SINK_SAMPLES ? 1 << target->sample_bits : 1;
    const key_change change = sink == TL_SINK_COUNT ? KEY_COUNT : sink == TL_SINK_LABEL ? KEY_LATER : KEY_REPLACE;
    for (int64_t row = 0; row < band->height; row++, at += target->stride_px) {
        const column_span *spans = t->spans + row * t->n_in_row;
        row_runs r;
        start_row(&r, band->width, sink == TL_SINK_LABEL ? ~0ull : 0);
        for (int64_t slot = 0; slot < t->n_slots; slot++) {
            if (spans[slot].first >= spans[slot].end)
                continue;
            const uint64_t bit = 1ull << (slot & (n_samples - 1));
            const int64_t label =
                sink == TL_SINK_LABEL ? name_of(snapped, t->triangles[slot]) ^ target->flip : (int64_t)bit;
            lay_span(&r, spans[slot].first, spans[slot].end, change, bit, (uint64_t)label);
        }
        for (int k = 0; k < r.n; k++) {
            const int32_t word = word_of_key(target, sink, r.key[k]);
            add_pixels(run, at + r.col[k], at + r.col[k + 1], (const char *)&word, sink == TL_SINK_MASK ? 1 : 4);
        }
    }
}

TL_INLINE void draw_shapes_of(const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_sink sink)
{
    const int n_samples = sink == TL_SINK_SAMPLES ? 1 << target->sample_bits : 1;
    span_table t;
    open_run run = start_pixels(target->pixels, window->width, window->height, target->stride_px);
    start_span_table(&t, snapped, n_samples, window->width);
    for (int64_t row = 0; row < window->height && !tl_is_given_up(window); row += t.n_rows) {
        tl_window band = *window;
        band.y_px += row;
        band.height = min64(t.n_rows, window->height - row);
        list_row_spans(snapped, &band, sink == TL_SINK_SAMPLES ? target->samples_fx : NULL, n_samples, &t);
        put_rows(snapped, &band, target, &t, row * target->stride_px, &run, sink);
    }
    close_run(&run, sink == TL_SINK_MASK ? 1 : 4);
}

#define TL_LARGE_SHAPES_COPY(name, sink)                                                                         \
    TL_SINK_COPY(draw_shapes_of, name, sink,                                                                     \
                 (const tl_snapped *snapped, const tl_window *window, const tl_target *target), snapped, window, \
                 target)
TL_LARGE_SHAPES_COPY(mask, TL_SINK_MASK)
TL_LARGE_SHAPES_COPY(count, TL_SINK_COUNT)
TL_LARGE_SHAPES_COPY(label, TL_SINK_LABEL)
TL_LARGE_SHAPES_COPY(samples, TL_SINK_SAMPLES)

/* Returns as `draw` does. */
static int64_t draw_large_shapes(const tl_snapped *snapped, const tl_window *window, const tl_target *target)
{
    const int64_t bad_row = first_bad_row(snapped->triangles, snapped->n_triangles, snapped->mesh.n_vertices);
    if (bad_row >= 0)
        return bad_row;
    if (target->sink == TL_SINK_MASK)
        draw_shapes_of_mask(snapped, window, target);
    else if (target->sink == TL_SINK_COUNT)
        draw_shapes_of_count(snapped, window, target);
    else if (target->sink == TL_SINK_LABEL)
        draw_shapes_of_label(snapped, window, target);
    else
        draw_shapes_of_samples(snapped, window, target);
    return -1;
}

/* A mesh of either kind. */
static int64_t draw_mesh(const tl_snapped *snapped, const tl_window *window, const tl_target *target, tl_slice *slice)
{
    return draws_large_shapes(snapped, window, target, slice) ? draw_large_shapes(snapped, window, target)
                                                              : draw(snapped, window, target, slice);
}

#endif
