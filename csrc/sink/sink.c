/* Sinks: write covered samples to the buffers.  The walkers do not depend on the sink.
 * In: lanes, spans or lists of samples.  Out: mask, counts, bits of samples, or ids with depth.
 * The result does not depend on the order of triangles: ids decide ties.  `sink` is always a constant, so that each
 * copy of the code has one case. */
#ifndef TL_SINK_C
#define TL_SINK_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/covered.c"
#include "sink/fragments.h"
#include "sink/hooks.h"
#include "sink/peel.c"

/* Samples per call of weights_at. */
#define TL_CHUNK 64

/* Copies of a function, one for each sink of whole samples, as a constant of its inner loops, and a call of the right
 * copy.  Such a function has the sink as its last parameter: TL_SINK_COPIES(f, (declared parameters), parameters ...),
 * TL_SINK_CALL(f, sink, ...).  TL_SINK_SAMPLES, TL_SINK_BLEND and TL_SINK_CENSUS have separate code. */
#define TL_SINK_COPY(f, name, sink, declared, ...) \
    static __attribute__((noinline)) void f##_##name declared { f(__VA_ARGS__, sink); }
#define TL_SINK_COPIES(f, declared, ...)                               \
    TL_SINK_COPY(f, mask, TL_SINK_MASK, declared, __VA_ARGS__)         \
    TL_SINK_COPY(f, count, TL_SINK_COUNT, declared, __VA_ARGS__)       \
    TL_SINK_COPY(f, label, TL_SINK_LABEL, declared, __VA_ARGS__)       \
    TL_SINK_COPY(f, paint, TL_SINK_PAINT, declared, __VA_ARGS__)       \
    TL_SINK_COPY(f, nearest, TL_SINK_NEAREST, declared, __VA_ARGS__)   \
    TL_SINK_COPY(f, farthest, TL_SINK_FARTHEST, declared, __VA_ARGS__) \
    TL_SINK_COPY(f, peel, TL_SINK_PEEL, declared, __VA_ARGS__)
#define TL_SINK_CALL(f, sink, ...)                                            \
    switch (sink) { /* no default: compilers name a sink that is forgotten */ \
    case TL_SINK_MASK: f##_mask(__VA_ARGS__); break;                          \
    case TL_SINK_COUNT: f##_count(__VA_ARGS__); break;                        \
    case TL_SINK_LABEL: f##_label(__VA_ARGS__); break;                        \
    case TL_SINK_PAINT: f##_paint(__VA_ARGS__); break;                        \
    case TL_SINK_NEAREST: f##_nearest(__VA_ARGS__); break;                    \
    case TL_SINK_FARTHEST: f##_farthest(__VA_ARGS__); break;                  \
    case TL_SINK_PEEL: f##_peel(__VA_ARGS__); break;                          \
    case TL_SINK_SAMPLES:                                                     \
    case TL_SINK_BLEND:                                                       \
    case TL_SINK_CENSUS: __builtin_trap();                                    \
    }

/* Code that only lists samples needs fewer copies: a list has places; places and ids; or places, ids and depths.  One
 * sink of each kind stands for all. */
#define TL_LIST_COPIES(f, declared, ...)                         \
    TL_SINK_COPY(f, mask, TL_SINK_MASK, declared, __VA_ARGS__)   \
    TL_SINK_COPY(f, label, TL_SINK_LABEL, declared, __VA_ARGS__) \
    TL_SINK_COPY(f, nearest, TL_SINK_NEAREST, declared, __VA_ARGS__)
#define TL_LIST_CALL(f, sink, ...)                      \
    switch (sink) {                                     \
    case TL_SINK_MASK:                                  \
    case TL_SINK_COUNT: f##_mask(__VA_ARGS__); break;   \
    case TL_SINK_LABEL: f##_label(__VA_ARGS__); break;  \
    case TL_SINK_PAINT:                                 \
    case TL_SINK_NEAREST:                               \
    case TL_SINK_FARTHEST:                              \
    case TL_SINK_PEEL: f##_nearest(__VA_ARGS__); break; \
    case TL_SINK_SAMPLES:                               \
    case TL_SINK_BLEND:                                 \
    case TL_SINK_CENSUS: __builtin_trap();              \
    }

TL_INLINE int sink_has_depth(tl_sink sink)
{
    return sink == TL_SINK_PAINT || sink == TL_SINK_NEAREST || sink == TL_SINK_FARTHEST || sink == TL_SINK_PEEL;
}

/* Writes ids and depths of the lanes in m that win.  Depths of new samples are never NaN or -0.  Ids that are only
 * stored are prefetched first: stores retire in order, and one by one would wait for memory.  AVX-512, 200,000
 * triangles of 8 px in any order: 16 -> 12.6 ms, a mesh of 100,000 3.5 -> 3.1.  On other sets the masked store loads
 * them. */
TL_INLINE void put_buffers(const tl_target *target, tl_sink sink, int64_t at, vm m, vf depth, vi id)
{
    int32_t *ids = (int32_t *)target->pixels + at;
    const int has_room = at + TL_LANES <= target->n_samples;
    vm wins;
    if (TL_LANES == 16)
        __builtin_prefetch(ids, 1);
    if (sink == TL_SINK_PAINT) {
        wins = vm_and(m, vi_gt(id, vi_load_some(m, ids, has_room)));
    } else {
        const vf old = vf_load_some(m, target->depth + at, has_room);
        const vm equal = vm_and(m, vf_eq(depth, old));
        wins = vm_and(m, sink == TL_SINK_NEAREST ? vf_lt(depth, old) : vf_lt(old, depth));
        if (__builtin_expect(vm_any(equal), 0))
            wins = vm_or(wins, vm_and(equal, vi_gt(vi_load_masked(equal, ids), id)));
    }
    vf_store_some(target->depth + at, wins, depth, has_room);
    vi_store_some(ids, wins, id, has_room);
}

/* Writes the lanes in m of a triangle. */
TL_INLINE void put_depths(const tl_target *target, tl_sink sink, int64_t at, vm m, vf depth, int32_t id)
{
    if (sink == TL_SINK_PEEL)
        peel_lanes(target, at, m, depth, id);
    else
        put_buffers(target, sink, at, m, depth, vi_set1(id));
}

/* The value that a sample without depth stores: 1 for counts, the (flipped) id for labels. */
TL_INLINE int32_t stored_value(const tl_target *target, tl_sink sink, int32_t id)
{
    return sink == TL_SINK_COUNT ? 1 : id ^ target->flip;
}

/* Adds to counts, or writes labels, in the lanes in m: `number` of each. */
TL_INLINE void put_numbers(const tl_target *target, tl_sink sink, int64_t at, vm m, vi number)
{
    int32_t *pixels = (int32_t *)target->pixels + at;
    const int has_room = at + TL_LANES <= target->n_samples;
    const vi old = vi_load_some(m, pixels, has_room);
    vi_store_some(pixels, m, sink == TL_SINK_COUNT ? vi_add(old, number) : vi_max(old, number), has_room);
}

/* Writes labels to the samples of a word, when triangles are drawn from the last to the first: samples in `covered` are
 * final. */
TL_INLINE void put_word(const tl_target *target, int64_t word, uint64_t samples, vi name)
{
    const uint64_t fresh = samples & ~target->covered[word];
    if (!fresh)
        return;
    target->covered[word] |= fresh;
    int32_t *const pixels = (int32_t *)target->pixels + (word << 6);
    for (int k = TL_LANES == 1 ? __builtin_ctzll(fresh) : 0; k < 64 && fresh >> k; k += TL_LANES) {
        const vm m = vm_from_bits((unsigned)(fresh >> k) & (unsigned)((1ull << TL_LANES) - 1));
        const int has_room = (word << 6) + k + TL_LANES <= target->n_samples;
        vi_store_some(pixels + k, m, vi_max(vi_load_some(m, pixels + k, has_room), name), has_room);
    }
}
TL_INLINE void put_uncovered(const tl_target *target, int64_t at, int64_t n, int32_t id)
{
    const vi name = vi_set1(id ^ target->flip);
    const int64_t last = (at + n - 1) >> 6;
    uint64_t samples = ~0ull << (at & 63);
    for (int64_t word = at >> 6; word < last; word++, samples = ~0ull)
        put_word(target, word, samples, name);
    put_word(target, last, samples & ~0ull >> (63 - ((at + n - 1) & 63)), name);
}

/* Writes a span of samples without depth. */
TL_INLINE void put_plain(const tl_target *target, tl_sink sink, int64_t at, int64_t n, int32_t id)
{
    if (sink == TL_SINK_MASK) {
        cover_span(target, at, n);
        return;
    }
    if (sink == TL_SINK_BLEND) {
        mix_run(target->pixels, at, n);
        return;
    }
    if (sink == TL_SINK_SAMPLES) {
        cover_samples(target, at, n);
        return;
    }
    if (sink == TL_SINK_LABEL && target->covered) {
        put_uncovered(target, at, n, id);
        return;
    }
    const vi number = vi_set1(stored_value(target, sink, id));
    for (int64_t k = 0; k < n; k += TL_LANES)
        put_numbers(target, sink, at + k, vm_first(n - k), number);
}

/* The one rounding of depth to float32; + 0 makes -0 a 0. */
TL_INLINE vf sum_depth(vd row, vd col) { return vf_add(vf_from_vd(vd_add(row, col)), vf_set1(0.0f)); }

/* 0, 1, 2, ... times a step. */
TL_INLINE vd ramp(double step) { return vd_mul(vd_from_vi(vi_iota()), vd_set1(step)); }

/* The centre of a pixel in half sub-pixels from a corner of a triangle that covers it: terms may wrap, but not the
 * difference, for a triangle with a depth plane. */
TL_INLINE double half_units(int64_t pixel, int64_t corner_fx, int bits)
{
    return (double)(int64_t)((((uint64_t)pixel * 2 + 1) << bits) - 2 * (uint64_t)corner_fx);
}
TL_INLINE double sample_x(const tl_triangle *t, const tl_window *window, int64_t col)
{
    return half_units(col + window->x_px, t->x_fx[0], window->subpixel_bits);
}
TL_INLINE double sample_y(const tl_triangle *t, const tl_window *window, int64_t row)
{
    return half_units(row + window->y_px, t->y_fx[0], window->subpixel_bits);
}

/* A row of a triangle's plane of depth: z + slope_x * x; x at column 0 of the window, and its step by column. */
typedef struct {
    double z, slope_x, x, step;
    int32_t id;
} plane_row;

/* Depths at columns first, first + apart, ... */
TL_INLINE vf row_depths(const plane_row *r, int64_t first, int64_t apart)
{
    const vd x = vd_add(vd_set1(r->x + (double)first * r->step), ramp((double)apart * r->step));
    return sum_depth(vd_set1(r->z), vd_mul(vd_set1(r->slope_x), x));
}

#define TL_QUAD (4 * TL_LANES)

/* `put_depths` for TL_QUAD columns that are wholly covered; returns 0, and writes nothing, if a depth equals an old
 * one. */
TL_INLINE int put_quad(const tl_target *target, tl_sink sink, int64_t at, const vf *depth, vi id)
{
    float *depths = target->depth + at;
    int32_t *ids = (int32_t *)target->pixels + at;
    vm wins[4], equal[4];
    for (int k = 0; k < 4; k++) {
        const vf old = vf_load(depths + k * TL_LANES);
        equal[k] = vf_eq(depth[k], old);
        wins[k] = sink == TL_SINK_NEAREST ? vf_lt(depth[k], old) : vf_lt(old, depth[k]);
    }
    if (__builtin_expect(vm_any(vm_or(vm_or(equal[0], equal[1]), vm_or(equal[2], equal[3]))), 0))
        return 0;
    for (int k = 0; k < 4; k++) {
        vf_store_some(depths + k * TL_LANES, wins[k], depth[k], 1);
        vi_store_some(ids + k * TL_LANES, wins[k], id, 1);
    }
    return 1;
}

TL_INLINE void put_some_columns(const plane_row *r, const tl_target *target, tl_sink sink, int64_t at, int64_t from,
                                int64_t first, int64_t end)
{
    for (int64_t col = from; col < end; col += TL_LANES) {
        const vm m = vm_and_not(vm_first(end - col), vm_first(first - col));
        put_depths(target, sink, at + col, m, row_depths(r, col, 1), r->id);
    }
}

/* Writes columns [first, end) of a row from `at` on, in vectors at multiples of TL_LANES columns. */
TL_INLINE void put_columns(const plane_row *r, const tl_target *target, tl_sink sink, int64_t at, int64_t first,
                           int64_t end)
{
    const int64_t whole0 = (first + TL_LANES - 1) & -(int64_t)TL_LANES;
    const int64_t n_quads = end > whole0 ? (end - whole0) / TL_QUAD : 0, whole1 = whole0 + n_quads * TL_QUAD;
    if (!n_quads) {
        put_some_columns(r, target, sink, at, first & -(int64_t)TL_LANES, first, end);
        return;
    }
    if (whole0 > first)
        put_some_columns(r, target, sink, at, whole0 - TL_LANES, first, whole0);
    const vd z = vd_set1(r->z), slope_x = vd_set1(r->slope_x), step = vd_set1(r->step * TL_LANES);
    const vi id = vi_set1(r->id);
    vd x = vd_add(vd_set1(r->x + (double)whole0 * r->step), ramp(r->step));
    for (int64_t col = whole0; col < whole1; col += TL_QUAD) {
        vf depth[4];
        for (int k = 0; k < 4; k++) {
            depth[k] = sum_depth(z, vd_mul(slope_x, x));
            x = vd_add(x, step); /* whole numbers: exact */
        }
        if (__builtin_expect(!put_quad(target, sink, at + col, depth, id), 0))
            put_some_columns(r, target, sink, at, col, col, col + TL_QUAD);
    }
    put_some_columns(r, target, sink, at, whole1, whole1, end);
}

/* As calls: walkers have many copies, and the loops above need all registers. */
static __attribute__((noinline)) void put_columns_nearest(const plane_row *r, const tl_target *target, int64_t at,
                                                          int64_t first, int64_t end)
{
    put_columns(r, target, TL_SINK_NEAREST, at, first, end);
}
static __attribute__((noinline)) void put_columns_farthest(const plane_row *r, const tl_target *target, int64_t at,
                                                           int64_t first, int64_t end)
{
    put_columns(r, target, TL_SINK_FARTHEST, at, first, end);
}

/* Writes a row of columns except segments where all depths are nearer than the triangle.  Rounded depths along a row
 * are monotonic, so those at the ends of a segment bound the others exactly.  A wholly covered segment gets a bound:
 * later depths only come nearer.  Returns whether any segment was skipped. */
TL_INLINE int put_bounded(const plane_row *r, const tl_target *target, tl_sink sink, int64_t at, float *bounds,
                          int64_t first, int64_t end)
{
    const int64_t size = 1 << TL_SEGMENT_BITS, n_segments = ((end - 1) >> TL_SEGMENT_BITS) + 1;
    const int64_t whole0 = (first + size - 1) >> TL_SEGMENT_BITS, whole1 = end >> TL_SEGMENT_BITS;
    int is_any_behind = 0;
    for (int64_t i = first >> TL_SEGMENT_BITS; i < n_segments; i += TL_LANES) {
        const vm live = vm_first(n_segments - i);
        const vf left = row_depths(r, i * size, size), right = row_depths(r, i * size + size - 1, size);
        const vf low = vf_min(left, right), high = vf_max(left, right), bound = vf_load_masked(live, bounds + i);
        const vm is_behind = sink == TL_SINK_NEAREST ? vf_lt(bound, low) : vf_lt(high, bound);
        const vm whole = vm_and_not(vm_first(whole1 - i), vm_first(whole0 - i));
        unsigned shown = vm_bits(vm_and_not(live, is_behind));
        is_any_behind |= vm_any(vm_and(live, is_behind));
        if (!shown)
            continue;
        vf_store_masked(bounds + i, vm_and(live, whole),
                        sink == TL_SINK_NEAREST ? vf_min(high, bound) : vf_max(low, bound));
        while (shown) { /* a run of segments at a time */
            const int from = __builtin_ctz(shown), n = __builtin_ctz(~(shown >> from));
            const int64_t col0 = max64((i + from) * size, first), col1 = min64((i + from + n) * size, end);
            if (sink == TL_SINK_NEAREST)
                put_columns_nearest(r, target, at, col0, col1);
            else
                put_columns_farthest(r, target, at, col0, col1);
            shown &= ~(((1u << n) - 1) << from);
        }
    }
    return is_any_behind;
}

/* The sinks that keep the nearest or farthest depth, in any order. */
TL_INLINE int sink_keeps_order(tl_sink sink) { return sink == TL_SINK_NEAREST || sink == TL_SINK_FARTHEST; }

/* A triangle with so many columns tests bounds, or uses whole vectors, in rows of TL_LONG_ROW columns or more.  A test
 * takes as long as 40 columns; so shorter rows test only if none of the last TL_UNLOOKED rows has tested without
 * skipping. */
#define TL_LEAST_WIDE 128
#define TL_LONG_ROW 192
#define TL_UNLOOKED 3
TL_INLINE int looks_wide(const tl_target *target, int64_t n, int n_left)
{
    return n >= TL_LONG_ROW || (target->bounds && n_left == 0);
}

/* Writes a row [first, end) that `looks_wide`.  Returns how many shorter rows are not to test bounds. */
#define TL_PUT_WIDE(NAME, SINK, PUT_COLUMNS)                                                                           \
    static __attribute__((noinline)) int NAME(const plane_row *r, const tl_target *target, int64_t row, int64_t first, \
                                              int64_t end)                                                             \
    {                                                                                                                  \
        const int64_t at = row * target->stride_px;                                                                    \
        if (!target->bounds) {                                                                                         \
            PUT_COLUMNS(r, target, at, first, end);                                                                    \
            return 0;                                                                                                  \
        }                                                                                                              \
        float *bounds = target->bounds + row * tl_segments(target->stride_px);                                         \
        return put_bounded(r, target, SINK, at, bounds, first, end) ? 0 : TL_UNLOOKED;                                 \
    }
TL_PUT_WIDE(put_wide_nearest, TL_SINK_NEAREST, put_columns_nearest)
TL_PUT_WIDE(put_wide_farthest, TL_SINK_FARTHEST, put_columns_farthest)

TL_INLINE int put_wide(const plane_row *r, const tl_target *target, tl_sink sink, int64_t row, int64_t first,
                       int64_t end)
{
    return sink == TL_SINK_NEAREST ? put_wide_nearest(r, target, row, first, end)
                                   : put_wide_farthest(r, target, row, first, end);
}

/* Writes a span with depth from the plane: (z0 + slope_y * y) + slope_x * x. */
TL_INLINE void put_plane(const tl_triangle *t, const tl_window *window, const tl_target *target, tl_sink sink,
                         int64_t row, int64_t first, int64_t end)
{
    const double step = (double)((int64_t)2 << window->subpixel_bits), x = sample_x(t, window, first);
    const double z = t->z[0] + t->slope_y * sample_y(t, window, row);
    if (sink_keeps_order(sink) && end - first >= TL_LEAST_WIDE && looks_wide(target, end - first, 0)) {
        const plane_row wide = {z, t->slope_x, sample_x(t, window, 0), step, t->id};
        put_wide(&wide, target, sink, row, first, end);
        return;
    }
    const vd z_row = vd_set1(z), slope_x = vd_set1(t->slope_x);
    const vd steps = ramp(step);
    const int64_t at = row * target->stride_px;
    for (int64_t col = first; col < end; col += TL_LANES) {
        const vd xs = vd_add(vd_set1(x + (double)(col - first) * step), steps);
        put_depths(target, sink, at + col, vm_first(end - col), sum_depth(z_row, vd_mul(slope_x, xs)), t->id);
    }
}

/* Writes a span with depth from the exact weights. */
TL_ONCE void put_weighted(const tl_triangle *t, const tl_window *window, const tl_target *target, tl_sink sink,
                          int64_t row, int64_t first, int64_t end)
{
    double w1[TL_CHUNK], w2[TL_CHUNK];
    float z[TL_CHUNK];
    const double z0 = t->z[0], slope1 = (t->z[1] - z0) / t->w_sum, slope2 = (t->z[2] - z0) / t->w_sum;
    for (int64_t col = first; col < end; col += TL_CHUNK) {
        const int n = (int)min64(end - col, TL_CHUNK);
        weights_at(t, window, row, col, n, w1, w2);
        for (int k = 0; k < n; k++)
            z[k] = (float)(z0 + (w1[k] * slope1 + w2[k] * slope2)) + 0.0f;
        for (int k = 0; k < n; k += TL_LANES) {
            const vm m = vm_first(n - k);
            put_depths(target, sink, row * target->stride_px + col + k, m, vf_load_some(m, z + k, 1), t->id);
        }
    }
}

/* Sets what a triangle needs for depth: the plane, or the weights. */
TL_INLINE void setup_sink(tl_triangle *t, const tl_window *window, tl_sink sink)
{
    if (!sink_has_depth(sink))
        return;
    setup_plane(t);
    if (!t->has_plane)
        setup_weights(t, window);
}

/* Writes the samples [first, end) of a row; columns and rows of the window. */
TL_INLINE void put_span(const tl_triangle *t, const tl_window *window, const tl_target *target, tl_sink sink,
                        int64_t row, int64_t first, int64_t end)
{
    if (!sink_has_depth(sink))
        put_plain(target, sink, row * target->stride_px + first, end - first, t->id);
    else if (t->has_plane)
        put_plane(t, window, target, sink, row, first, end);
    else
        put_weighted(t, window, target, sink, row, first, end);
}

/* Writes a list of n samples, one by one, without branches on who wins. */
TL_INLINE void write_list(const tl_target *target, const fragment_list *f, int n, tl_sink sink)
{
    if (sink == TL_SINK_PEEL) {
        peel_fragments(target->peeled, f, n);
        return;
    }
    int32_t *const pixels = target->pixels;
    float *const depths = target->depth;
    const int32_t flip = target->flip;
    for (int k = 0; k < n; k++) {
        const int64_t at = (uint32_t)f->sample[k];
        if (sink_has_depth(sink)) { /* 6 % of a million-triangle mesh; no gain for sinks of one plane */
            __builtin_prefetch(pixels + f->sample[k + TL_PREFETCH], 1);
            __builtin_prefetch(depths + f->sample[k + TL_PREFETCH], 1);
        }
        if (sink == TL_SINK_MASK) {
            target->covered[at >> 6] |= 1ull << (at & 63);
        } else if (sink == TL_SINK_SAMPLES) {
            const int64_t bit = at << target->sample_bits;
            target->covered[bit >> 6] |= (uint64_t)(uint32_t)f->id[k] << (bit & 63); /* a bit a sample */
        } else if (sink == TL_SINK_COUNT) {
            pixels[at]++;
        } else if (sink == TL_SINK_LABEL) {
            const int32_t id = f->id[k] ^ flip;
            pixels[at] = id > pixels[at] ? id : pixels[at];
        } else if (sink == TL_SINK_PAINT) {
            const int wins = f->id[k] > pixels[at];
            pixels[at] = wins ? f->id[k] : pixels[at];
            depths[at] = wins ? f->depth[k] : depths[at];
        } else {
            const int32_t turn = sink == TL_SINK_FARTHEST ? -1 : 0;
            const int64_t key = sample_key(f->depth[k], f->id[k], turn), old = sample_key(depths[at], pixels[at], turn);
            const int64_t least = key < old ? key : old;
            pixels[at] = (int32_t)least;
            depths[at] = key_depth(least, turn);
        }
    }
}

TL_SINK_COPY(write_list, samples, TL_SINK_SAMPLES, (const tl_target *target, const fragment_list *f, int n), target, f,
             n)
TL_SINK_COPIES(write_list, (const tl_target *target, const fragment_list *f, int n), target, f, n)

/* Flushes a list of n samples. */
static void flush_fragments(const tl_target *target, const fragment_list *f, int n)
{
    if (target->sink == TL_SINK_SAMPLES)
        write_list_samples(target, f, n);
    else if (n > 0)
        TL_SINK_CALL(write_list, target->sink, target, f, n)
}

#endif
