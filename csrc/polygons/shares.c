/* Shares: the exact area of each pixel that lies in a polygon, as sums, mixes of colours, or a table.
 * In: rings, and the weight of the area of each ring.  Out: float32.
 *
 * A polygon is drawn into cells of its box, which stay in the cache (area/ramp.c), and the cells are summed along rows.
 * Sums are integers modulo 2^32, so the result in [0, 2^24] is right however often edges cover each other.  Polygons
 * with rings that meet are resolved pixel by pixel (pieces.c). */
#ifndef TL_POLYGON_SHARES_C
#define TL_POLYGON_SHARES_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "area/area.c"
#include "area/ramp.c"
#include "polygons/crossings.c"
#include "polygons/pieces.c"
#include "polygons/points.c"
#include "polygons/polygons.h"

#define TL_WHOLE (1 << TL_AREA_BITS)

/* Small polygons are drawn several at a time, stacked below each other: vectors of edges are then fuller, which saves a
 * third of the time for 20,000 cells of 28 px.  The areas of an edge do not depend on where it is drawn. */
#define TL_STACK_COLUMNS 64
#define TL_STACK_HEIGHT 128
#define TL_STACK_ROWS 512
#define TL_STACK_BEYOND 8 /* an edge that crosses up to 6 columns a row writes 8 */
#define TL_STACK_MAX 8    /* 4 is slower by 10 percent, 16 by 5 */

typedef struct {
    const tl_share_job *job;
    int64_t polygon, n; /* n: entries of the table so far */
    int is_full;
} share_output;

/* Draws TL_LANES edges of a ring, as `push_edges` in area.c does; long edges one by one. */
TL_INLINE void push_ring_lanes(area_state *s, const tl_polygons *p, int64_t first, int64_t end, int64_t i, int weight,
                               int32_t right_fx, int32_t down_fx)
{
    const vi zero = vi_set1(0), most = vi_set1(s->max_extent), right = vi_set1(right_fx), down = vi_set1(down_fx);
    vi ax, ay, bx, by;
    const vm live = load_ring_edges(p, first, end, i, &ax, &ay, &bx, &by);
    const area_edges e =
        edges_between(&s->plane, vi_add(ax, right), vi_add(ay, down), vi_add(bx, right), vi_add(by, down), live);
    const vm alone = vm_and(e.on, vm_or(vi_gt(e.width, most), vi_gt(e.dy, most)));
    for (unsigned lanes = vm_bits(alone); lanes; lanes &= lanes - 1) {
        const int64_t a = i + __builtin_ctz(lanes), b = a + 1 < end ? a + 1 : first, from = weight > 0 ? a : b,
                      to = weight > 0 ? b : a;
        push_edge(s, p->x_fx[from] + right_fx, p->y_fx[from] + down_fx, p->x_fx[to] + right_fx, p->y_fx[to] + down_fx);
    }
    const vm on = vm_and_not(e.on, alone);
    if (!vm_any(on))
        return;
    const vi negative = vi_sub(zero, e.dy); /* areas right of upward edges are added */
    queue_edges(s, &e, on, weight > 0 ? vi_select(e.is_up, e.dy, negative) : vi_select(e.is_up, negative, e.dy));
}

/* Draws a polygon whose rings do not meet into the cells of the plane, shifted. */
static void push_polygon(area_state *s, const tl_polygons *p, int64_t polygon, int32_t right_fx, int32_t down_fx)
{
    for (int64_t ring = p->polygons[polygon]; ring < p->polygons[polygon + 1]; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1];
        const int weight = p->weights[ring];
        if (weight == 0)
            continue;
        if (!p->is_wide[polygon]) {
            for (int64_t i = first; i < end; i += TL_LANES) {
                push_ring_lanes(s, p, first, end, i, weight, right_fx, down_fx);
                make_room_for_edges(s);
            }
            continue;
        }
        for (int64_t i = first; i < end; i++) {
            const int64_t j = i + 1 < end ? i + 1 : first, from = weight > 0 ? i : j, to = weight > 0 ? j : i;
            push_edge(s, p->wide_fx[2 * from], p->wide_fx[2 * from + 1], p->wide_fx[2 * to], p->wide_fx[2 * to + 1]);
            make_room_for_edges(s);
        }
    }
}

/* Fills the last vector of edges of many rows with edges of fewer rows: their missing rows have no height, and add
 * nothing. */
static void fill_vectors(area_state *s, int first_kind)
{
    for (int kind = first_kind + TL_SHORT_ROWS - 1, from = kind - 1; kind > first_kind; kind--) {
        from = from < kind ? from : kind - 1;
        int n_more = -s->n[kind] & (TL_LANES - 1);
        while (n_more > 0 && from >= first_kind) {
            if (s->n[from] == 0) {
                from--;
                continue;
            }
            s->edges[kind][s->n[kind]++] = s->edges[from][--s->n[from]];
            n_more--;
        }
    }
}

static void finish_cells(area_state *s)
{
    fill_vectors(s, 0);
    fill_vectors(s, TL_EDGES_FLAT);
    for (int kind = 0; kind < TL_EDGES_NONE; kind++)
        if (s->n[kind])
            flush_edges(s, kind, 1);
    flush_quads(&s->plane);
}

TL_INLINE vi whole_at_most(vi sums) { return vi_min(vi_max(sums, vi_set1(0)), vi_set1(TL_WHOLE)); }

/* Returns the sums of TL_LANES cells, clamped to [0, TL_WHOLE]; clears the cells, most of which are 0. */
TL_INLINE vi take_cells(int32_t *cells, vi *carry)
{
    const vi bias = vi_set1(TL_CELL_ZERO), v = vi_load(cells);
    vi sums = *carry;
    if (vm_any(vm_and_not(vm_all(), vi_eq(v, bias)))) {
        sums = vi_add(vi_prefix_sum(vi_sub(v, bias)), sums);
        vi_store(cells, bias);
        *carry = vi_last(sums);
    }
    return whole_at_most(sums);
}

TL_INLINE vi begin_cells(int32_t *row)
{
    uint32_t sum = 0;
    for (int k = TL_CELL_PAD - 4; k < TL_CELL_PAD; k++)
        sum += (uint32_t)row[k] - TL_CELL_ZERO, row[k] = TL_CELL_ZERO;
    return vi_set1((int32_t)sum);
}

/* Appends the cells of a row that are not 0 to a table of n entries, and clears them; returns the new n.  Boxes of
 * polygons are small: to search for cells with a value costs more than to add all. */
TL_INLINE int64_t pack_row(int is_long, int32_t *cells, vi carry, int64_t width, int64_t index, void *indices,
                           float *areas, int64_t n)
{
    const vi bias = vi_set1(TL_CELL_ZERO), zero = vi_set1(0);
    vi at = vi_add(vi_set1((int32_t)index), vi_iota());
    for (int64_t c = 0; c < width; c += TL_LANES) {
        const vi all = vi_add(vi_prefix_sum(vi_sub(vi_load(cells + c), bias)), carry), sums = whole_at_most(all);
        const vm on = vm_and(vi_gt(sums, zero), vm_first(width - c));
        const int count = __builtin_popcount(vm_bits(on));
        carry = vi_last(all);
        vi_store(cells + c, bias);
        vi_compress((int32_t *)areas + n, on, vi_bits_of_vf(vf_mul(vf_from_vi(sums), vf_set1(1.0f / TL_WHOLE))));
        if (is_long) {
            int32_t columns[TL_LANES];
            vi_compress(columns, on, vi_iota());
            for (int k = 0; k < count; k++)
                ((int64_t *)indices)[n + k] = index + c + columns[k];
        } else {
            vi_compress((int32_t *)indices + n, on, at);
            at = vi_add(at, vi_set1(TL_LANES));
        }
        n += count;
    }
    return n;
}

static void mix_pixel(const tl_share_job *job, int64_t polygon, int64_t at, float share)
{
    float *pixel = job->pixels + at * job->n_channels;
    const float *color = job->colors + polygon * job->n_channels;
    for (int k = 0; k < job->n_channels; k++)
        pixel[k] += (color[k] - pixel[k]) * share;
}

/* Stores a row of cells as shares.  `n_beyond` cells right of the columns may have values, and so may those left of
 * them, unless is_inside. */
TL_INLINE void put_cells(share_output *out, int32_t *cells, int64_t row, int64_t left, int64_t right, int is_inside,
                         int64_t n_beyond)
{
    const tl_share_job *job = out->job;
    const int64_t index = row * job->width + left, width = right - left;
    vi carry = is_inside ? vi_set1(0) : begin_cells(cells);
    cells += TL_CELL_PAD;
    if (job->starts) {
        out->n = job->is_long ? pack_row(1, cells, carry, width, index, job->indices, job->areas, out->n)
                              : pack_row(0, cells, carry, width, index, job->indices, job->areas, out->n);
    } else if (job->colors) {
        int32_t sums[TL_LANES];
        for (int64_t c = 0; c < width; c += TL_LANES) {
            vi_spill(sums, take_cells(cells + c, &carry));
            for (int k = 0; k < TL_LANES && c + k < width; k++)
                if (sums[k])
                    mix_pixel(job, out->polygon, index + c + k, (float)sums[k] * (1.0f / TL_WHOLE));
        }
    } else if (job->is_alone) {
        float *to = job->pixels + index;
        for (int64_t c = 0; c < width; c += TL_LANES) {
            const vf share = vf_mul(vf_from_vi(take_cells(cells + c, &carry)), vf_set1(1.0f / TL_WHOLE));
            if (width - c >= TL_LANES)
                vf_store(to + c, share);
            else
                vf_store_masked(to + c, vm_first(width - c), share);
        }
    } else {
        for (int64_t c = 0; c < width; c += TL_LANES) {
            const vm inside = vm_first(width - c);
            float *to = job->pixels + index + c;
            const vf share = vf_mul(vf_from_vi(take_cells(cells + c, &carry)), vf_set1(1.0f / TL_WHOLE));
            const vf sum = vf_add(vf_load_some(inside, to, width - c >= TL_LANES), share), one = vf_set1(1.0f);
            vf_store_some(to, inside, vf_select(vf_lt(one, sum), one, sum), width - c >= TL_LANES);
        }
    }
    for (int64_t c = (width + TL_LANES - 1) / TL_LANES * TL_LANES; c < width + n_beyond; c += TL_LANES)
        vi_store(cells + c, vi_set1(TL_CELL_ZERO));
}

/* Stores a row of shares of a resolved polygon. */
static void put_shares(void *to, int64_t row, int64_t left, int64_t right, const double *shares)
{
    share_output *out = to;
    const tl_share_job *job = out->job;
    const int64_t index = row * job->width;
    if (job->starts && out->n + right - left > job->n_room) {
        out->is_full = 1;
        return;
    }
    for (int64_t c = left; c < right; c++) {
        const int32_t units = (int32_t)rint(shares[c - left] * TL_WHOLE);
        const float share = (float)(units > TL_WHOLE ? TL_WHOLE : units) * (1.0f / TL_WHOLE);
        if (units <= 0)
            continue;
        if (job->starts) {
            job->areas[out->n] = share;
            if (job->is_long)
                ((int64_t *)job->indices)[out->n] = index + c;
            else
                ((int32_t *)job->indices)[out->n] = (int32_t)(index + c);
            out->n++;
        } else if (job->colors) {
            mix_pixel(job, out->polygon, index + c, share);
        } else {
            const float sum = job->pixels[index + c] + share;
            job->pixels[index + c] = sum > 1.0f ? 1.0f : sum;
        }
    }
}

/* Draws rows [top, bottom) of a polygon whose rings do not meet. */
static void share_simply(area_state *s, const tl_polygons *p, share_output *out, const tl_polygon_box *box, int64_t top,
                         int64_t bottom)
{
    const tl_share_job *job = out->job;
    const int64_t width = box->right - box->left, stride = tl_area_stride(width);
    const int64_t n_at_once = job->n_cells / stride;
    for (int64_t first = top; first < bottom; first += n_at_once) {
        const int64_t end = first + n_at_once < bottom ? first + n_at_once : bottom;
        const tl_window window = {
            .x_px = box->left, .y_px = first, .width = width, .height = end - first, .subpixel_bits = p->bits};
        const tl_area target = {.cells = job->cells};
        if (job->starts && out->n + (end - first) * width > job->n_room) {
            out->is_full = 1;
            return;
        }
        place_plane(&window, &target, &s->plane);
        push_polygon(s, p, out->polygon, 0, 0);
        finish_cells(s);
        for (int64_t row = first; row < end; row++)
            put_cells(out, job->cells + (row - first) * stride, row, box->left, box->right, 0,
                      stride - TL_CELL_PAD - width);
    }
}

/* Whether a polygon can be stacked: small, and within the rows. */
static inline int fits_stack(const tl_polygons *p, const tl_share_job *job, int64_t polygon)
{
    const tl_polygon_box *box = job->boxes + polygon;
    return p->is_simple[polygon] && !p->is_wide[polygon] && box->left > 0 && box->right < job->width &&
           box->top > job->top && box->bottom < job->bottom && box->right - box->left <= TL_STACK_COLUMNS &&
           box->bottom - box->top <= TL_STACK_HEIGHT;
}

/* The number of polygons to stack, from the i-th of the job on; sets the largest width. */
static int64_t plan_stack(const tl_polygons *p, const share_output *out, int64_t i, int64_t *width)
{
    const tl_share_job *job = out->job;
    int64_t n = 0, n_rows = 0, n_entries = 0;
    *width = 0;
    for (; n < TL_STACK_MAX && i + n < job->end; n++) {
        const int64_t polygon = job->listed ? job->listed[i + n] : i + n;
        const tl_polygon_box *box = job->boxes + polygon;
        const int32_t height = box->bottom - box->top, columns = box->right - box->left;
        n_rows += height, n_entries += (int64_t)height * columns;
        if (!fits_stack(p, job, polygon) || n_rows > TL_STACK_ROWS || (job->starts && out->n + n_entries > job->n_room))
            break;
        *width = columns > *width ? columns : *width;
    }
    return n;
}

/* Draws a stack of polygons from the i-th of the job on; returns how many. */
static int64_t share_stack(area_state *s, const tl_polygons *p, share_output *out, int64_t i)
{
    const tl_share_job *job = out->job;
    int64_t width, n_rows = 0;
    const int64_t n = plan_stack(p, out, i, &width);
    const tl_window window = {.width = width, .height = TL_STACK_ROWS, .subpixel_bits = p->bits};
    const tl_area target = {.cells = job->cells};
    place_plane(&window, &target, &s->plane);
    /* no cells left of a polygon: rows close together stay in the first-level cache */
    s->plane.stride = (int32_t)(width + TL_STACK_BEYOND + 15) / 16 * 16;
    for (int64_t k = 0; k < n; k++) {
        const int64_t polygon = job->listed ? job->listed[i + k] : i + k;
        const tl_polygon_box *box = job->boxes + polygon;
        push_polygon(s, p, polygon, -box->left * (1 << p->bits), ((int32_t)n_rows - box->top) * (1 << p->bits));
        n_rows += box->bottom - box->top;
    }
    finish_cells(s);
    int32_t *cells = job->cells;
    for (int64_t k = 0; k < n; k++) {
        out->polygon = job->listed ? job->listed[i + k] : i + k;
        const tl_polygon_box *box = job->boxes + out->polygon;
        for (int64_t row = box->top; row < box->bottom; row++, cells += s->plane.stride)
            put_cells(out, cells, row, box->left, box->right, 1, TL_STACK_BEYOND);
        if (job->starts)
            job->starts[i + k + 1] = out->n;
    }
    return n;
}

/* Clears the rows of a job except the box, if that is written later. */
static void clear_beside(const tl_share_job *job, const tl_polygon_box *box, int is_written)
{
    for (int64_t row = job->top; row < job->bottom; row++) {
        float *to = job->pixels + row * job->width;
        const int meets = is_written && row >= box->top && row < box->bottom && box->left < box->right;
        memset(to, 0, sizeof *to * (size_t)(meets ? box->left : job->width));
        if (meets)
            memset(to + box->right, 0, sizeof *to * (size_t)(job->width - box->right));
    }
}

static int64_t share_polygons(const tl_polygons *p, const tl_share_job *job)
{
    area_state s;
    share_output out = {.job = job, .n = job->starts ? job->starts[job->first] : 0};
    s.snapped = NULL, s.bad_row = -1;
    s.max_extent = max_edge_extent(p->bits);
    const tl_window whole = {.width = job->width, .height = job->bottom - job->top};
    s.window = &whole; /* only its size is read, to count work */
    memset(s.n, 0, sizeof s.n);
    for (int64_t i = job->first; i < job->end; i++) {
        const int64_t polygon = job->listed ? job->listed[i] : i;
        const tl_polygon_box *box = job->boxes + polygon;
        const int64_t top = box->top > job->top ? box->top : job->top,
                      bottom = box->bottom < job->bottom ? box->bottom : job->bottom;
        out.polygon = polygon;
        if (is_polygon_given_up(p, (int64_t)(box->bottom - box->top) * (box->right - box->left)))
            return i - job->first;
        if (!job->is_alone && fits_stack(p, job, polygon)) {
            const int64_t n = share_stack(&s, p, &out, i);
            if (n == 0)
                return i - job->first;
            i += n - 1;
            continue;
        }
        if (job->is_alone)
            clear_beside(job, box, p->is_simple[polygon]);
        if (top < bottom && box->left < box->right) {
            if (p->is_simple[polygon])
                share_simply(&s, p, &out, box, top, bottom);
            else
                resolve_polygon(p, polygon, box, top, bottom, job->pieces, put_shares, &out);
            if (out.is_full)
                return i - job->first;
        }
        if (job->starts)
            job->starts[i + 1] = out.n;
    }
    return job->end - job->first;
}

#endif
