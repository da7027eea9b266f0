/* Spans: where a few triangles lie in the rows of a band, a span a row of each triangle and sample.
 * In: triangles of a snapped mesh.  Out: the columns of each that are covered, before anything is drawn. */
#ifndef TL_ROW_SPANS_C
#define TL_ROW_SPANS_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "vertex/clip.c"
#include "vertex/fixed.h"
#include "sink/hooks.h"
#include "raster/single_fixed.c"

/* The covered columns [first, end) of a row, none where they are equal. */
typedef struct {
    int32_t first, end;
} column_span;

/* The spans of a band: those of a row side by side, in the order of the triangles, of each in the order of the
 * samples. */
typedef struct span_table {
    column_span spans[TL_SHAPE_SPANS];
    uint16_t triangles[TL_SHAPE_SLOTS]; /* that the spans of a row belong to */
    int64_t n_in_row, n_slots, n_rows, width;
    column_span *next; /* in the row that begins at sample row_at */
    int64_t row_at;
} span_table;

/* TL_SINK_SPANS.  Walkers go down row by row, and a row of a triangle is one span. */
static void note_span(struct span_table *t, int64_t at, int64_t n)
{
    while (at >= t->row_at + t->width)
        t->row_at += t->width, t->next += t->n_in_row;
    *t->next = (column_span){(int32_t)(at - t->row_at), (int32_t)(at - t->row_at + n)};
}

/* How many spans a row of a mesh may have. */
static int64_t spans_in_row(const tl_snapped *snapped, int n_samples)
{
    return (snapped->n_triangles + (snapped->pieces ? snapped->pieces->n_pieces : 0)) * n_samples;
}

/* Spans of the triangle that stands at `slot`, or of all its pieces; returns the slot behind them. */
static __attribute__((noinline)) int64_t list_triangle(const tl_snapped *snapped, int64_t i, int64_t slot,
                                                       const tl_window *window, const int32_t *samples_fx,
                                                       int n_samples, span_table *t)
{
    tl_target target = {.sink = TL_SINK_SPANS, .pixels = t, .stride_px = window->width};
    int32_t own[3];
    triangle_parts parts = parts_of(snapped, i, own);
    for (int part = 0; part < parts.n; part++)
        for (int s = 0; s < n_samples; s++, slot++) {
            if (samples_fx)
                parts.set.sample_x_fx = samples_fx[2 * s], parts.set.sample_y_fx = samples_fx[2 * s + 1];
            t->next = t->spans + slot, t->row_at = 0;
            t->triangles[slot] = (uint16_t)i;
            draw_triangle(&parts.set, parts.corners + 3 * part, (int32_t)i, snapped, window, &target, TL_SINK_SPANS);
        }
    return slot;
}

/* The spans of a band of at most t->n_rows rows.  `samples_fx` is where the samples lie, x and y of each, or NULL: one,
 * where the mesh says. */
static void list_row_spans(const tl_snapped *snapped, const tl_window *band, const int32_t *samples_fx, int n_samples,
                           span_table *t)
{
    int64_t slot = 0;
    memset(t->spans, 0, sizeof *t->spans * (size_t)(t->n_in_row * band->height));
    for (int64_t i = 0; i < snapped->n_triangles && !tl_is_given_up(band); i++) {
        tl_count_work(band, TL_SETUP_PX);
        slot = list_triangle(snapped, i, slot, band, samples_fx, n_samples, t);
    }
    t->n_slots = slot;
}

/* Rows of a band with spans that fit: as many as stay in the first-level cache, or as are worth setting all up anew. */
static void start_span_table(span_table *t, const tl_snapped *snapped, int n_samples, int64_t width)
{
    const int64_t n = max64(spans_in_row(snapped, n_samples), 1), hot = TL_SHAPE_SPANS / 4 / n;
    t->n_in_row = n, t->width = width;
    t->n_rows = hot >= 64 ? hot : min64(64, TL_SHAPE_SPANS / n);
}

#endif
