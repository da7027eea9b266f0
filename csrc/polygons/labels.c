/* Labels: many polygons, each over those before it.
 * In: rings, and a number for each polygon.  Out: rows of int32, or of bytes.
 *
 * A closed ring crosses each row as often downwards as upwards.  So a polygon of one ring whose downward edges have as
 * many rows as the ring crosses each row once each way: two columns a row, no lists.  Other polygons list the crossings
 * of their rows.  Polygons of many edges, and tests of squares, use bits.  Rows of a picture are far apart in memory:
 * spans may be buffered until their cache lines are prefetched. */
#ifndef TL_POLYGON_LABELS_C
#define TL_POLYGON_LABELS_C

#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"
#include "polygons/crossings.c"
#include "polygons/mask.c"
#include "polygons/polygons.h"
#include "polygons/row_bits.c"
#include "polygons/touched.c"

TL_INLINE void store_span_32(int32_t *out, int64_t n, int32_t value)
{
    const vi v = vi_set1(value);
#if TL_LANES == 16
    for (; n >= TL_LANES; n -= TL_LANES, out += TL_LANES)
        vi_store(out, v);
    vi_store_masked(out, vm_first(n), v);
#elif TL_LANES > 1 /* masked stores cost 20 cycles on AMD: the last whole vector overlaps the vector before it */
    if (n >= TL_LANES) {
        for (int64_t j = 0; j < n - TL_LANES; j += TL_LANES)
            vi_store(out + j, v);
        vi_store(out + n - TL_LANES, v);
    } else if (n >= 4) {
        const v4 four = v4_load((const int32_t[4]){value, value, value, value});
        v4_store(out, four), v4_store(out + n - 4, four);
    } else {
        for (int64_t j = 0; j < n; j++)
            out[j] = value;
    }
#else
    for (int64_t j = 0; j < n; j++)
        vi_store(out + j, v);
#endif
}

TL_INLINE void store_span(int n_bytes, void *out, int64_t n, int32_t value)
{
    if (n_bytes == 1)
        memset(out, value, (size_t)n);
    else
        store_span_32(out, n, value);
}

TL_INLINE void write_waiting(tl_label_scratch *w, int n_bytes, int which)
{
    for (int i = 0; i < w->n_waiting[which]; i++)
        store_span(n_bytes, w->span_at[which][i], w->span_n[which][i], w->span_value[which][i]);
    w->n_waiting[which] = 0;
}

/* Writes the columns [begin, end) of a row, or buffers and prefetches them. */
TL_INLINE void write_span(const tl_label_job *job, int n_bytes, char *row, int64_t begin, int64_t end, int32_t value)
{
    char *at = row + begin * n_bytes;
    if (!job->waits) {
        store_span(n_bytes, at, end - begin, value);
        return;
    }
    tl_label_scratch *w = job->scratch;
    const int now = w->now, i = w->n_waiting[now]++;
    w->span_at[now][i] = at, w->span_n[now][i] = (int32_t)(end - begin), w->span_value[now][i] = value;
    __builtin_prefetch(at, 1), __builtin_prefetch(row + (end - 1) * n_bytes, 1);
    if (i + 1 == TL_SPAN_WAIT) {
        write_waiting(w, n_bytes, !now);
        w->now = !now;
    }
}

/* Stores the edges of a polygon that cross rows; returns how many. */
TL_INLINE int gather_edges(const tl_polygons *p, int64_t polygon, const row_frame *f, tl_label_scratch *w, int *n_down,
                           int *low, int *high)
{
    int n = 0, lo = f->bottom, hi = f->top, down = 0;
    for (int64_t ring = p->polygons[polygon]; ring < p->polygons[polygon + 1]; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1];
        for (int64_t i = first; i < end; i += TL_LANES) {
            vi ax, ay, bx, by;
            crossing_lanes e;
            vm live = load_ring_edges(p, first, end, i, &ax, &ay, &bx, &by);
            live = setup_crossings(f, ax, ay, bx, by, live, &e);
            if (!vm_any(live))
                continue;
            double num[TL_LANES], inv[TL_LANES], step[TL_LANES];
            int32_t row[TL_LANES], count[TL_LANES];
            const unsigned up = vm_bits(e.up);
            vd_store(num, e.num), vd_store(inv, e.inv), vd_store(step, e.step);
            vi_spill(row, e.row), vi_spill(count, e.n);
            for (unsigned lanes = vm_bits(live); lanes; lanes &= lanes - 1, n++) {
                const int j = __builtin_ctz(lanes), is_up = up >> j & 1;
                w->num[n] = num[j], w->inv[n] = inv[j], w->step[n] = step[j];
                w->row[n] = row[j], w->n[n] = count[j], w->up[n] = is_up;
                lo = row[j] < lo ? row[j] : lo, hi = row[j] + count[j] > hi ? row[j] + count[j] : hi;
                down += is_up ? 0 : count[j];
            }
        }
    }
    *n_down = down, *low = lo, *high = hi;
    return n;
}

/* Labels a polygon that crosses each row once down and once up. */
TL_INLINE void label_simply(const tl_label_job *job, int n_bytes, int n_edges, int low, int high, int32_t value)
{
    tl_label_scratch *w = job->scratch;
    const vd iota = vd_from_vi(vi_iota());
    const vi width = vi_set1((int32_t)job->width);
    for (int i = 0; i < n_edges; i++) {
        int32_t *side = (w->up[i] ? w->right : w->left) + (w->row[i] - low);
        const vd inv = vd_set1(w->inv[i]), step = vd_set1(TL_LANES * w->step[i]);
        vd at = vd_add(vd_mul(iota, vd_set1(w->step[i])), vd_set1(w->num[i]));
        for (int k = 0; k < w->n[i]; k += TL_LANES) {
            vi_store_masked(side + k, vm_first(w->n[i] - k), crossing_columns(at, inv, width));
            at = vd_add(at, step);
        }
    }
    char *row = (char *)job->pixels + (int64_t)low * job->width * n_bytes;
    for (int r = 0; r < high - low; r++, row += job->width * n_bytes) {
        const int32_t a = w->left[r], b = w->right[r], begin = a < b ? a : b, end = a < b ? b : a;
        if (begin < end)
            write_span(job, n_bytes, row, begin, end, value);
    }
}

TL_INLINE void label_by_lists(const tl_label_job *job, int n_bytes, int is_nonzero, int n_edges, int low, int high,
                              int32_t value)
{
    tl_label_scratch *w = job->scratch;
    const vd iota = vd_from_vi(vi_iota());
    const vi width = vi_set1((int32_t)job->width);
    memset(w->count, 0, sizeof(int32_t) * (size_t)(high - low));
    for (int i = 0; i < n_edges; i++) {
        int32_t columns[TL_LANES];
        const vd inv = vd_set1(w->inv[i]), step = vd_set1(TL_LANES * w->step[i]);
        vd at = vd_add(vd_mul(iota, vd_set1(w->step[i])), vd_set1(w->num[i]));
        for (int k = 0; k < w->n[i]; k += TL_LANES) {
            vi_spill(columns, crossing_columns(at, inv, width));
            const int m = w->n[i] - k < TL_LANES ? w->n[i] - k : TL_LANES;
            for (int l = 0; l < m; l++) {
                const int r = w->row[i] - low + k + l;
                w->list[r * n_edges + w->count[r]++] = 2 * columns[l] + w->up[i];
            }
            at = vd_add(at, step);
        }
    }
    char *row = (char *)job->pixels + (int64_t)low * job->width * n_bytes;
    for (int r = 0; r < high - low; r++, row += job->width * n_bytes) {
        int32_t *v = w->list + r * n_edges, begin, end;
        int i = 0;
        sort_crossings(v, w->count[r]);
        while (next_span(v, w->count[r], is_nonzero, &i, &begin, &end))
            write_span(job, n_bytes, row, begin, end, value);
    }
}

/* Labels rows [top, bottom), at most TL_CELL_ROWS, by a bit a pixel. */
static void label_by_bits(const tl_polygons *p, int64_t polygon, const tl_label_job *job, int64_t top, int64_t bottom,
                          int32_t value)
{
    const row_frame f = place_rows(p, top, bottom, job->width);
    const int64_t stride = tl_polygon_stride(job->width), n_words = stride >> 6, n_rows = bottom - top;
    uint64_t *bits = (uint64_t *)job->cells;
    if (p->is_nonzero[polygon]) { /* the bits of a row overwrite its sums */
        const crossing_sink s = {.stride = stride, .cells = job->cells};
        walk_to_cells(p, polygon, &f, &s);
        for (int64_t r = 0; r < n_rows; r++)
            fill_winding(job->cells + r * stride, stride, bits + r * stride / 2);
    } else {
        const crossing_sink s = {.stride = 32 * stride, .bits = bits};
        walk_to_bits(p, polygon, &f, &s);
        for (int64_t r = 0; r < n_rows; r++)
            fill_parity(bits + r * stride / 2, n_words);
    }
    if (job->test != TL_POLYGON_CENTER)
        test_squares(p, polygon, job->boxes + polygon, job->test, job->width, top, bottom, bits, stride / 2,
                     job->pieces);
    for (int64_t r = 0; r < n_rows; r++) {
        char *row = (char *)job->pixels + (top + r) * job->width * job->n_bytes;
        int64_t begin, end = 0;
        while (next_run(bits + r * stride / 2, job->width, &begin, &end))
            store_span(job->n_bytes, row + begin * job->n_bytes, end - begin, value);
        memset(bits + r * stride / 2, 0, sizeof *bits * (size_t)n_words);
    }
}

TL_INLINE void write_all_waiting(const tl_label_job *job, int n_bytes)
{
    const int now = job->scratch->now;
    write_waiting(job->scratch, n_bytes, !now);
    write_waiting(job->scratch, n_bytes, now);
}

TL_INLINE void label_polygon(const tl_polygons *p, int64_t polygon, const tl_label_job *job, int n_bytes)
{
    const tl_polygon_box *box = job->boxes + polygon;
    const int64_t n_points = p->rings[p->polygons[polygon + 1]] - p->rings[p->polygons[polygon]];
    const int64_t top = box->top > job->top ? box->top : job->top,
                  bottom = box->bottom < job->bottom ? box->bottom : job->bottom;
    const int32_t value = job->values ? job->values[polygon] : (int32_t)polygon;
    if (top >= bottom || box->left >= box->right || is_polygon_given_up(p, (bottom - top) * (16 + n_points)))
        return;
    const int is_small = !p->is_wide[polygon] && n_points <= TL_LABEL_EDGES && job->test == TL_POLYGON_CENTER;
    if (is_small && bottom - top <= TL_LABEL_ROWS) {
        int n_down, low, high;
        const row_frame f = place_rows(p, top, bottom, job->width);
        const int n = gather_edges(p, polygon, &f, job->scratch, &n_down, &low, &high);
        if (low >= high)
            return;
        if (p->polygons[polygon + 1] - p->polygons[polygon] == 1 && n_down == high - low) {
            label_simply(job, n_bytes, n, low, high, value);
            return;
        }
        if ((int64_t)n * (high - low) <= TL_LABEL_ROOM) {
            label_by_lists(job, n_bytes, p->is_nonzero[polygon], n, low, high, value);
            return;
        }
    }
    write_all_waiting(job, n_bytes); /* spans below are not buffered */
    for (int64_t row = top; row < bottom && !is_polygon_given_up(p, TL_CELL_ROWS * job->width); row += TL_CELL_ROWS)
        label_by_bits(p, polygon, job, row, row + TL_CELL_ROWS < bottom ? row + TL_CELL_ROWS : bottom, value);
}

static __attribute__((noinline)) void label_bytes(const tl_polygons *p, const tl_label_job *job)
{
    for (int64_t i = job->first; i < job->end; i++)
        label_polygon(p, job->listed ? job->listed[i] : i, job, 1);
    write_all_waiting(job, 1);
}

static __attribute__((noinline)) void label_words(const tl_polygons *p, const tl_label_job *job)
{
    for (int64_t i = job->first; i < job->end; i++)
        label_polygon(p, job->listed ? job->listed[i] : i, job, 4);
    write_all_waiting(job, 4);
}

static void label_polygons(const tl_polygons *p, const tl_label_job *job)
{
    tl_label_scratch *w = job->scratch;
    w->n_waiting[0] = w->n_waiting[1] = w->now = 0;
    store_span(job->n_bytes, (char *)job->pixels + job->top * job->width * job->n_bytes,
               (job->bottom - job->top) * job->width, job->background);
    if (job->n_bytes == 1)
        label_bytes(p, job);
    else
        label_words(p, job);
}

#endif
