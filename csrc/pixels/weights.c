/* Weights of the three corners at the pixels of a visibility buffer, in float64, a vector of pixels at a time.
 * In: ids, the mesh they were drawn from.  Out: barycentric weights, or values of the vertices.
 *
 * The bits equal those of `weights_of_pixel`: edge functions are integers below 2^53, exact in float64, and all later
 * operations are equal.  `weights_of_pixel` computes the rest pixel by pixel: triangles that a clip plane cuts,
 * coordinates beyond 2^30, boxes beyond 2^52, and 1/w outside the range of vd_quotients. */
#ifndef TL_WEIGHTS_C
#define TL_WEIGHTS_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/project.c"
#include "vertex/setup.c"
#include "pixels/runs.c"
#include "pixels/weights_exact.c"
#include "pixels/weights_one.c"

#define TL_ALONE -1 /* RUN_SPECIAL of a run that `weights_of_pixel` computes */
#define TL_FLOAT64_BOX 0x1p52
#define TL_MAX_INV_W 0x1p200

typedef struct {
    shade_runs runs;
    resolve_state alone;
    int n_alone;                                      /* runs that `weights_of_pixel` computes */
    int has_w;                                        /* whether w differs from vertex to vertex */
    _Alignas(64) int32_t corners[3][TL_SPAN_ROOM];    /* by run: of vertices that exist */
    _Alignas(64) double q[3][TL_SPAN_ROOM];           /* 1/w of the corners, by run */
    _Alignas(64) double w[3][TL_SPAN + TL_MAX_LANES]; /* the weights of the pixels of the span */
} weighed_span;

/* Starts without a mesh. */
static void start_weights(weighed_span *r, const tl_window *window)
{
    r->runs.window = window, r->runs.shading = NULL;
    memset(r->runs.ints, 0, sizeof r->runs.ints);
    memset(r->q, 0, sizeof r->q);
    memset(r->corners, 0, sizeof r->corners);
}

/* Sets the mesh whose triangles are weighed; the id of triangle 0 is first_id. */
static void weigh_mesh(weighed_span *r, const tl_snapped *snapped, int32_t first_id)
{
    const tl_source *source = snapped->mesh.source;
    r->runs.snapped = snapped, r->runs.first_id = first_id;
    r->alone.id = -1;
    r->has_w = snapped->mesh.inv_w || (source && !(source->matrix && source->is_affine));
}

/* RUN_SPECIAL of a run that does not fit int32: float64 edge functions, or TL_ALONE. */
static int32_t weigh_special(shade_runs *s, const int32_t *corners, int64_t row)
{
    const tl_vertex_set *set = &s->snapped->mesh;
    double x_fx[3], y_fx[3], low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    float row_step[3];
    for (int k = 0; k < 3; k++) {
        if (set->vertices[corners[k]].x_fx == TL_SPECIAL)
            return TL_ALONE;
        const tl_wide v = vertex_fx(set, corners[k]);
        x_fx[k] = (double)v.x_fx, y_fx[k] = (double)v.y_fx;
        low[0] = fmin(low[0], x_fx[k]), high[0] = fmax(high[0], x_fx[k]);
        low[1] = fmin(low[1], y_fx[k]), high[1] = fmax(high[1], y_fx[k]);
    }
    if ((high[0] - low[0]) * (high[1] - low[1]) >= TL_FLOAT64_BOX)
        return TL_ALONE;
    special_run *e = &s->special[s->n_special];
    special_edges(e, x_fx, y_fx, center_fx(row + s->window->y_px, s->window->subpixel_bits), row_step);
    return e->area == 0.0f ? TL_ALONE : s->n_special + 1;
}

/* RUN_SPECIAL of a run of unsnapped vertices: float64 if each weight is then within 2^-28, else TL_ALONE. */
static int32_t weigh_exact_run(weighed_span *r, int slot, const int32_t *corners, int64_t row)
{
    shade_runs *s = &r->runs;
    const tl_vertex_set *set = &s->snapped->mesh;
    const double unit = (double)(1 << s->window->subpixel_bits);
    double x_fx[3], y_fx[3], area;
    float row_step[3];
    exact_point p[3];
    if (set->sample_x_fx || set->sample_y_fx) /* it would move vertices by a rounded number */
        return TL_ALONE;
    for (int k = 0; k < 3; k++)
        p[k] = point_of(set->exact, corners[k]);
    if (!has_float_weights(p, &area))
        return TL_ALONE;
    if (r->has_w) {
        const double q0 = r->q[0][slot], q1 = r->q[1][slot], q2 = r->q[2][slot];
        if (!(fmax(q0, fmax(q1, q2)) <= 256.0 * fmin(q0, fmin(q1, q2))))
            return TL_ALONE;
    }
    place_special(set, corners, unit, x_fx, y_fx);
    special_edges(&s->special[s->n_special], x_fx, y_fx, center_fx(row + s->window->y_px, s->window->subpixel_bits),
                  row_step);
    return s->n_special + 1;
}

/* 1/w of TL_LANES vertices. */
TL_INLINE void load_inverse_w(const tl_vertex_set *set, const int32_t *vertices, double *q)
{
    if (set->inv_w)
        for (int lane = 0; lane < TL_LANES; lane++)
            q[lane] = set->inv_w[vertices[lane]];
    else
        for (int lane = 0; lane < TL_LANES; lane++)
            q[lane] = inverse_w(set, vertices[lane]);
}

/* Prefetching saves nothing with fewer triangles; a million at 512x512 take 1.3 times as long without it. */
#define TL_FETCHED_TRIANGLES 500000
#define TL_FETCH_RUNS 32 /* runs ahead for which the rows of the corners are prefetched */

/* Prefetches a row by its address: indices are not checked yet. */
TL_INLINE void fetch_row(const void *rows, uintptr_t n_bytes, int32_t row)
{
    __builtin_prefetch((const void *)((uintptr_t)rows + (uint32_t)row * n_bytes));
}

/* Loads the corners of runs and their 1/w.  This is a pass by itself because a vector load stalls on numbers that were
 * just stored one by one. */
TL_INLINE void load_run_corners(weighed_span *r)
{
    shade_runs *s = &r->runs;
    const int fetches = s->snapped->n_triangles >= TL_FETCHED_TRIANGLES, end = TL_LANES + s->n_runs;
    for (int slot = TL_LANES; slot < end; slot += TL_LANES) {
        vi corners[3];
        for (int ahead = slot + TL_FETCH_RUNS; fetches && ahead < min64(end, slot + TL_FETCH_RUNS + TL_LANES); ahead++)
            fetch_row(s->snapped->triangles, 12, s->ints[RUN_ID][ahead]);
        const vm is_there = run_corners(s, slot, corners);
        vi_store(s->ints[RUN_SPECIAL] + slot, vi_select(is_there, vi_set1(0), vi_set1(TL_ALONE)));
        for (int k = 0; k < 3; k++) {
            int32_t *const own = r->corners[k] + slot;
            vi_spill(own, corners[k]);
            for (int lane = 0; fetches && lane < TL_LANES; lane++)
                fetch_row(s->snapped->mesh.vertices, sizeof(tl_vertex), own[lane]);
            if (r->has_w)
                load_inverse_w(&s->snapped->mesh, own, r->q[k] + slot);
        }
    }
}

/* Sets up the runs of a row. */
TL_INLINE void set_weighed_runs(weighed_span *r, int64_t row)
{
    shade_runs *s = &r->runs;
    const vd most = vd_set1(TL_MAX_INV_W), least = vd_set1(1.0 / TL_MAX_INV_W);
    s->n_special = r->n_alone = 0;
    if (s->n_runs) /* fills the last vector with a valid triangle */
        vi_store(s->ints[RUN_ID] + TL_LANES + s->n_runs, vi_set1(s->ints[RUN_ID][TL_LANES + s->n_runs - 1]));
    load_run_corners(r);
    for (int slot = TL_LANES; slot < TL_LANES + s->n_runs; slot += TL_LANES) {
        run_setup setup;
        for (int k = 0; k < 3; k++)
            vi_spill(setup.corners[k], vi_load(r->corners[k] + slot));
        const vm is_run = vm_first(TL_LANES + s->n_runs - slot);
        vm is_alone = vi_gt(vi_set1(0), vi_load(s->ints[RUN_SPECIAL] + slot));
        vm is_special = s->snapped->mesh.exact ? vm_all() : set_edges(s, slot, row, &setup);
        is_alone = vm_or(is_alone, vm_and_not(vi_eq(vi_load(s->ints[RUN_SUM] + slot), vi_set1(0)), is_special));
        for (int k = 0; r->has_w && k < 3; k++) {
            const vd q = vd_load(r->q[k] + slot);
            is_alone = vm_or(is_alone, vm_and_not(vm_all(), vm_and(vd_ge(q, least), vd_ge(most, q))));
        }
        is_special = vm_and(vm_or(is_special, is_alone), is_run);
        for (unsigned rest = vm_bits(is_special); rest; rest &= rest - 1) {
            const int lane = __builtin_ctz(rest);
            const int32_t corners[3] = {setup.corners[0][lane], setup.corners[1][lane], setup.corners[2][lane]};
            const int32_t how = vm_bits(is_alone) >> lane & 1 ? TL_ALONE
                                : s->snapped->mesh.exact      ? weigh_exact_run(r, slot + lane, corners, row)
                                                              : weigh_special(s, corners, row);
            s->ints[RUN_SPECIAL][slot + lane] = how;
            s->n_special += how > 0;
            r->n_alone += how < 0;
        }
    }
}

/* Sets the edge functions of the lanes with float64 runs. */
static void set_float64_edges(const shaded_lanes *p, vi special, vd *e, vm *is_back)
{
    const vd zero = vd_set1(0.0);
    special_lanes own = start_special(p, special);
    for (vm lanes; vm_any(lanes = next_special(p, &own));) {
        const int is_negative = own.run->area < 0.0f;
        for (int k = 0; k < 3; k++) {
            const vd value = special_edge(&own, k);
            e[k] = vd_select(lanes, is_negative ? vd_sub(zero, value) : vd_add(zero, value), e[k]); /* never -0 */
        }
        *is_back = is_negative ? vm_or(*is_back, lanes) : vm_and_not(*is_back, lanes);
    }
}

/* Sets the weights of the lanes with TL_ALONE; lanes of a triangle that no longer exists become invisible. */
static void set_lonely_weights(weighed_span *r, const shaded_lanes *p, vi special, int64_t row, int i)
{
    const tl_window *window = r->runs.window;
    int32_t id[TL_MAX_LANES], column[TL_MAX_LANES];
    vi_store(id, pick_int(p, RUN_ID));
    vi_store(column, p->column);
    const vm lanes = vm_and(p->visible, vi_gt(vi_set1(0), special));
    for (unsigned rest = vm_bits(lanes); rest; rest &= rest - 1) {
        const int lane = __builtin_ctz(rest);
        const int64_t x_px = column[lane] + window->x_px, y_px = row + window->y_px;
        double w[3];
        if (!find_triangle(&r->alone, r->runs.snapped, id[lane], x_px, y_px, window->subpixel_bits)) {
            r->runs.visible[i] &= ~(1u << lane);
            continue;
        }
        weights_of_pixel(&r->alone, x_px, y_px, window->subpixel_bits, w);
        for (int k = 0; k < 3; k++)
            r->w[k][i * TL_LANES + lane] = w[k];
    }
}

/* Sets the weights of vector i of a span.  They are summed in the order of corners that makes the area positive, as in
 * `weights_of_pixel`. */
TL_INLINE void weigh_lanes(weighed_span *r, int i, int64_t column, int64_t row)
{
    const shade_runs *s = &r->runs;
    const vi zero = vi_set1(0);
    shaded_lanes p;
    vi e[3], sum;
    vd part[3], w[3];
    find_lanes(&p, s, i, column, e, &sum);
    vm is_back = vi_gt(zero, sum);
    for (int k = 0; k < 3; k++)
        part[k] = vd_from_vi(vi_select(is_back, vi_sub(zero, e[k]), e[k]));
    const vi special = s->n_special || r->n_alone ? pick_int(&p, RUN_SPECIAL) : zero;
    if (s->n_special)
        set_float64_edges(&p, special, part, &is_back);
    if (r->has_w)
        for (int k = 0; k < 3; k++)
            part[k] = vd_mul(part[k], vd_pick(r->q[k] + p.first, p.run));
    const vd second = vd_select(is_back, part[2], part[1]), third = vd_select(is_back, part[1], part[2]);
    vd_quotients(part, vd_add(vd_add(part[0], second), third), w, 0);
    for (int k = 0; k < 3; k++)
        vd_store(r->w[k] + i * TL_LANES, w[k]);
    if (r->n_alone)
        set_lonely_weights(r, &p, special, row, i);
}

/* Lists the runs of n ids of a row, and sets the weights of their visible pixels. */
TL_ONCE void weigh_span(weighed_span *r, const int32_t *ids, int n, int64_t row, int64_t column)
{
    find_runs(&r->runs, ids, n, column);
    set_weighed_runs(r, row);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++)
        if (r->runs.visible[i])
            weigh_lanes(r, i, column, row);
}

/* Writes n <= TL_LANES pixels: n_channels numbers each, `step` apart from pixel to pixel. */
TL_INLINE void store_channels(float *restrict out, int64_t step, int n, const vf *channels, int n_channels)
{
    if (n == TL_LANES && step == n_channels && n_channels < 4) {
        if (n_channels == 1)
            vf_store(out, channels[0]);
        else if (n_channels == 2)
            vf_store_pairs(out, channels);
        else
            vf_store_triples(out, channels);
        return;
    }
    float lanes[4][TL_MAX_LANES];
    for (int c = 0; c < n_channels; c++)
        vf_store(lanes[c], channels[c]);
    for (int lane = 0; lane < n; lane++)
        for (int c = 0; c < n_channels; c++)
            out[lane * step + c] = lanes[c][lane];
}

static void barycentric(const tl_snapped *snapped, const tl_window *window, const int32_t *ids, float *restrict out)
{
    weighed_span r;
    const vf zero = vf_set1(0.0f);
    start_weights(&r, window);
    weigh_mesh(&r, snapped, 0);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            weigh_span(&r, ids + at, n, row, column);
            for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
                const vm visible = vm_from_bits(r.runs.visible[i]);
                vf w[3] = {zero, zero, zero};
                for (int k = 0; vm_any(visible) && k < 3; k++)
                    w[k] = vf_select(visible, vf_from_vd(vd_load(r.w[k] + x)), zero);
                store_channels(out + 3 * (at + x), 3, (int)min64(n - x, TL_LANES), w, 3);
            }
        }
}

/* The values that `interpolate` reads. */
typedef struct {
    const float *rows; /* (n_vertices, n_values), or (n_triangles, 3, n_values) */
    int n_values, per_corner;
    float background;
} vertex_values;

/* Loads the values of the corners of runs, n_channels from `first` on, into the coefficients 3 c + k. */
TL_INLINE void load_values(weighed_span *r, const vertex_values *values, int first, int n_channels)
{
    shade_runs *s = &r->runs;
    for (int slot = TL_LANES; slot < TL_LANES + s->n_runs; slot += TL_LANES)
        for (int k = 0; k < 3; k++) {
            const int32_t *corners = r->corners[k] + slot;
            vi c[4];
            if (n_channels == 3 && values->n_values == 3 && !values->per_corner) {
                load_triples(values->rows, corners, c);
                for (int channel = 0; channel < 3; channel++)
                    vf_store(s->floats[3 * channel + k] + slot, vf_of_bits(c[channel + 1]));
                continue;
            }
            for (int lane = 0; lane < TL_LANES; lane++) {
                const int64_t at = values->per_corner ? 3 * (int64_t)s->ints[RUN_ID][slot + lane] + k : corners[lane];
                for (int channel = 0; channel < n_channels; channel++)
                    s->floats[3 * channel + k][slot + lane] = values->rows[values->n_values * at + first + channel];
            }
        }
}

/* Interpolates n_channels at the pixels of a span. */
TL_INLINE void interpolate_span(weighed_span *r, const vertex_values *values, int first, int n_channels, int n,
                                float *out)
{
    const shade_runs *s = &r->runs;
    const vf background = vf_set1(values->background);
    load_values(r, values, first, n_channels);
    for (int x = 0, i = 0; x < n; x += TL_LANES, i++) {
        const vm visible = vm_from_bits(s->visible[i]);
        vf sums[4];
        for (int c = 0; c < n_channels; c++)
            sums[c] = background;
        if (vm_any(visible)) {
            shaded_lanes p;
            vi e[3], sum;
            vd w[3];
            find_lanes(&p, s, i, 0, e, &sum);
            for (int k = 0; k < 3; k++)
                w[k] = vd_load(r->w[k] + x);
            for (int c = 0; c < n_channels; c++) {
                vd part[3];
                for (int k = 0; k < 3; k++)
                    part[k] = vd_mul(w[k], vd_from_vf(pick(&p, 3 * c + k)));
                sums[c] = vf_select(visible, vf_from_vd(vd_add(vd_add(part[0], part[1]), part[2])), background);
            }
        }
        store_channels(out + (int64_t)x * values->n_values + first, values->n_values, (int)min64(n - x, TL_LANES), sums,
                       n_channels);
    }
}

static void interpolate(const tl_snapped *snapped, const tl_window *window, const int32_t *ids, const float *values,
                        int n_values, int per_corner, float background, float *restrict out)
{
    const vertex_values read = {values, n_values, per_corner, background};
    weighed_span r;
    start_weights(&r, window);
    weigh_mesh(&r, snapped, 0);
    for (int64_t row = 0; row < window->height; row++)
        for (int64_t column = 0; column < window->width; column += TL_SPAN) {
            const int64_t at = row * window->width + column;
            const int n = (int)min64(TL_SPAN, window->width - column);
            weigh_span(&r, ids + at, n, row, column);
            for (int first = 0; first < n_values; first += 4)
                switch (n_values - first) {
                case 1: interpolate_span(&r, &read, first, 1, n, out + at * n_values); break;
                case 2: interpolate_span(&r, &read, first, 2, n, out + at * n_values); break;
                case 3: interpolate_span(&r, &read, first, 3, n, out + at * n_values); break;
                default: interpolate_span(&r, &read, first, 4, n, out + at * n_values);
                }
        }
}

/* The bits equal those of `inverse_w`. */
static void inverse_ws(const tl_source *source, int64_t first, int64_t end, double *restrict out)
{
    int64_t i = first;
    const int stride = source->n_components;
    for (; TL_LANES > 1 && i + TL_LANES < min64(end, source->n); i += TL_LANES) {
        vd w;
        if (source->scalar == TL_F32) {
            vf p[4];
            clip_lanes_f32((const float *)source->data + stride * i, (const float *)source->matrix, stride, p);
            w = vd_from_vf(p[3]);
        } else {
            vd p[4];
            clip_lanes_f64((const double *)source->data + stride * i, (const double *)source->matrix, stride, p);
            w = p[3];
        }
        vd_store(out + i, vd_div(vd_set1(1.0), w));
    }
    for (; i < end; i++) {
        double p[4];
        clip_position(source, i, p);
        out[i] = 1.0 / p[3];
    }
}

#endif
