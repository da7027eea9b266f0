/* Sampled: triangles in lanes, tested at all samples of a pixel at once.
 * In: snapped triangles and queues of boxes, which hold every pixel with a covered sample.  Out: bits of samples.
 *
 * A sample differs from the centre only by 2 (dx * y - dy * x) in each edge function: load, cull, setup and queues are
 * shared.  Ranges are those of squares (triangles_fixed.c).  A box is up to a pixel too large, so where row ends
 * decide, horizontal edges are tested, too. */
#ifndef TL_SAMPLED_C
#define TL_SAMPLED_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "sink/covered.c"
#include "raster/row_edges.h"
#include "raster/rows.c"
#include "raster/state.h"
#include "raster/triangles_fixed.c"

#define TL_MAX_WORDS (TL_MIDDLE_BOX * TL_MAX_SAMPLES / 64) /* in a row of a middle box */

/* The offsets of a sample in the doubled edge functions. */
TL_INLINE vi sample_shift(vi dx, vi dy, const int32_t *sample_fx)
{
    return vi_sub(vi_mul(dx, vi_set1(2 * sample_fx[1])), vi_mul(dy, vi_set1(2 * sample_fx[0])));
}

/* Draws boxes of up to size x size pixels; t->e are doubled edge functions at the centre. */
TL_INLINE void draw_box_of_samples(walk_state *s, const lane_triangles *t, vm live, vi n_cols, vi n_rows, int size)
{
    const int bits = s->window->subpixel_bits, n_samples = 1 << s->target->sample_bits;
    const int32_t stride = (int32_t)s->target->stride_px;
    const vi zero = vi_set1(0), minus_one = vi_set1(-1);
    vi shift[TL_MAX_SAMPLES][3];
    int n = s->fragments.n;
    for (int i = 0; i < n_samples; i++)
        for (int k = 0; k < 3; k++)
            shift[i][k] = sample_shift(t->dx[k], t->dy[k], s->target->samples_fx + 2 * i);
    for (int row = 0; row < size; row++)
        for (int col = 0; col < size; col++) {
            const vm in_box = vm_and(vm_and(live, vi_gt(n_rows, vi_set1(row))), vi_gt(n_cols, vi_set1(col)));
            if (!vm_any(in_box))
                continue;
            vi e[3], samples = zero;
            for (int k = 0; k < 3; k++) {
                const vi moved = vi_sub(vi_mul(t->dx[k], vi_set1(row)), vi_mul(t->dy[k], vi_set1(col)));
                e[k] = vi_add(t->e[k], vi_shift_left(moved, bits + 1));
            }
            for (int i = 0; i < n_samples; i++) {
                const vi all =
                    vi_or(vi_or(vi_add(e[0], shift[i][0]), vi_add(e[1], shift[i][1])), vi_add(e[2], shift[i][2]));
                samples = vi_or(samples, vi_select(vi_gt(all, minus_one), vi_set1(1 << i), zero));
            }
            const vm in = vm_and(in_box, vi_gt(samples, zero));
            if (vm_any(in))
                n = emit(&s->fragments, n, TL_SINK_SAMPLES, in, vi_add(t->sample, vi_set1(row * stride + col)), samples,
                         vf_set1(0.0f));
            n = make_room(s, n);
        }
    s->fragments.n = n;
}

static __attribute__((noinline)) void draw_tiny_of_samples(walk_state *s, const lane_batch *b, vm live)
{
    lane_triangles t;
    vd z[3];
    place_triangles(s, TL_SINK_SAMPLES, &b->c, b->col, b->row, &t, z);
    draw_box_of_samples(s, &t, live, b->n_cols, b->n_rows, 2);
}

static __attribute__((noinline)) void flush_small_of_samples(walk_state *s)
{
    box_queue *q = &s->small;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        vd z[3];
        pop_fixed(s, TL_SINK_SAMPLES, q, i, n, &t, z);
        const vi size = vi_load(q->size + i);
        draw_box_of_samples(s, &t, vm_first(n - i), vi_and(size, vi_set1(0xffff)), vi_shift_right(size, 16),
                            TL_SMALL_BOX);
    }
}

/* The edges of TL_LANES triangles, left, right and third, with the doubled edge functions at the first centre. */
typedef struct {
    vi doubled[3], dx[3], dy[3];
    vf step[3], inverse[3];
    lane_sides sides;
} sampled_edges;

TL_INLINE void setup_sampled(const lane_triangles *t, sampled_edges *r)
{
    r->sides = find_sides(t->dy);
    for (int side = 0; side < 3; side++) {
        const vm is0 = r->sides.is0[side], is1 = r->sides.is1[side];
        r->doubled[side] = vi_select(is0, t->e[0], vi_select(is1, t->e[1], t->e[2]));
        r->dx[side] = vi_select(is0, t->dx[0], vi_select(is1, t->dx[1], t->dx[2]));
        r->dy[side] = vi_select(is0, t->dy[0], vi_select(is1, t->dy[1], t->dy[2]));
        r->step[side] = vf_from_vi(r->dx[side]);
        const vi width = vi_max(r->dy[side], vi_sub(vi_set1(0), r->dy[side]));
        r->inverse[side] = vf_div(vf_set1(1.0f), vf_from_vi(vi_max(width, vi_set1(1))));
    }
}

/* E' + 0.5 of a side at the first pixel's sample. */
TL_INLINE vf sampled_start(const sampled_edges *r, int side, const int32_t *sample_fx, int bits)
{
    const vi doubled = vi_add(r->doubled[side], sample_shift(r->dx[side], r->dy[side], sample_fx));
    return vf_add(vf_from_vi(vi_shift_right(doubled, bits + 1)), vf_set1(0.5f));
}

/* The pixels [begin, end) of rows, from E' + 0.5 of the three sides; counted in bits of samples. */
typedef struct {
    vi begin, end;
} lane_span;

TL_INLINE lane_span sampled_span(const vf *v, const vf *inverse, vm third_is_left, vm third_is_right, vi n_cols,
                                 int sample_bits)
{
    const vi zero = vi_set1(0), minus_one = vi_set1(-1);
    vi quotient[3], left, right;
    for (int side = 0; side < 3; side++)
        quotient[side] = vi_floor(vf_mul(v[side], inverse[side]));
    meet_third(quotient, third_is_left, third_is_right, &left, &right);
    const vm beyond_flat = vm_and_not(vm_and_not(vi_gt(zero, quotient[2]), third_is_left), third_is_right);
    const vi end = vi_min(vi_sub(right, minus_one), n_cols);
    const vi begin = vi_min(vi_max(vi_sub(zero, left), zero), n_cols);
    const vi stop = vi_select(beyond_flat, zero, vi_max(end, zero));
    return (lane_span){vi_shift_left(begin, sample_bits), vi_shift_left(stop, sample_bits)};
}

/* Adds the bits of a sample to the word that begins at a column. */
TL_INLINE vw add_span(vw words, lane_span span, int32_t col, int sample_bits, uint64_t pattern)
{
    const vi zero = vi_set1(0), from = vi_set1(col << sample_bits);
    return vw_add_range(words, vi_max(vi_sub(span.begin, from), zero), vi_max(vi_sub(span.end, from), zero), pattern);
}

static __attribute__((noinline)) void flush_middle_of_samples(walk_state *s)
{
    const tl_target target = *s->target; /* a copy that no store can alias */
    const int bits = s->window->subpixel_bits, sample_bits = target.sample_bits, per_word = 64 >> sample_bits;
    box_queue *q = &s->middle;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        sampled_edges e;
        uint64_t words[TL_MIDDLE_BOX][TL_MAX_WORDS][TL_MAX_LANES];
        int32_t first[TL_MAX_LANES];
        vd z[3];
        const int end = lanes_at(i, n), max_rows = most_rows(q, i, n);
        int max_cols = 0;
        pop_fixed(s, TL_SINK_SAMPLES, q, i, n, &t, z);
        vi_store(first, t.sample);
        setup_sampled(&t, &e);
        for (int k = 0; k < end; k++)
            max_cols = (q->size[i + k] & 0xffff) > max_cols ? q->size[i + k] & 0xffff : max_cols;
        const int n_words = (max_cols + per_word - 1) / per_word;
        const vi n_cols = vi_and(vi_load(q->size + i), vi_set1(0xffff));
        for (int sample = 0; sample < 1 << sample_bits; sample++) {
            const uint64_t pattern = sample_pattern(sample_bits) << sample;
            vf v[3];
            for (int side = 0; side < 3; side++)
                v[side] = sampled_start(&e, side, target.samples_fx + 2 * sample, bits);
            for (int row = 0; row < max_rows; row++) {
                const lane_span span =
                    sampled_span(v, e.inverse, e.sides.third_is_left, e.sides.third_is_right, n_cols, sample_bits);
                for (int word = 0; word < n_words; word++) {
                    uint64_t *const at = words[row][word];
                    vw_store(at,
                             add_span(sample ? vw_load(at) : vw_zero(), span, word * per_word, sample_bits, pattern));
                }
                for (int side = 0; side < 3; side++)
                    v[side] = vf_add(v[side], e.step[side]);
            }
        }
        for (int k = 0; k < end; k++) {
            const int32_t size = q->size[i + k];
            int64_t at = (int64_t)(uint32_t)first[k] << sample_bits;
            for (int row = 0; row < size >> 16; row++, at += target.stride_px << sample_bits)
                for (int word = 0; word < n_words; word++) /* no branch if there is only one */
                    if (n_words == 1 || words[row][word][k])
                        cover(&target, at + 64 * word, words[row][word][k]);
        }
    }
}

/* Draws one triangle of the queue, TL_LANES rows at a time: computes the spans of all samples, then stores word by
 * word. */
TL_INLINE void draw_sampled_rows(const tl_target *target, const float (*starts)[3][TL_MAX_LANES],
                                 const float (*steps)[TL_MAX_LANES], const float (*inverses)[TL_MAX_LANES], int k,
                                 vm third_is_left, vm third_is_right, int32_t first, int32_t size)
{
    const int sample_bits = target->sample_bits, per_word = 64 >> sample_bits, n_cols = size & 0xffff;
    const int n_rows = size >> 16;
    const vf inverse[3] = {vf_set1(inverses[0][k]), vf_set1(inverses[1][k]), vf_set1(inverses[2][k])};
    lane_span spans[TL_MAX_SAMPLES];
    uint64_t words[TL_MAX_LANES];
    for (int row0 = 0; row0 < n_rows; row0 += TL_LANES) {
        const vf rows = vf_from_vi(vi_add(vi_iota(), vi_set1(row0)));
        const int n = n_rows - row0 < TL_LANES ? n_rows - row0 : TL_LANES;
        for (int sample = 0; sample < 1 << sample_bits; sample++) {
            vf v[3];
            for (int side = 0; side < 3; side++)
                v[side] = vf_add(vf_set1(starts[sample][side][k]), vf_mul(vf_set1(steps[side][k]), rows));
            spans[sample] = sampled_span(v, inverse, third_is_left, third_is_right, vi_set1(n_cols), sample_bits);
        }
        for (int col = 0; col < n_cols; col += per_word) {
            vw all = vw_zero();
            for (int sample = 0; sample < 1 << sample_bits; sample++)
                all = add_span(all, spans[sample], col, sample_bits, sample_pattern(sample_bits) << sample);
            vw_store(words, all);
            int64_t at = ((int64_t)(uint32_t)first + row0 * target->stride_px + col) << sample_bits;
            for (int row = 0; row < n; row++, at += target->stride_px << sample_bits)
                if (words[row])
                    cover(target, at, words[row]);
        }
    }
}

static __attribute__((noinline)) void flush_rows_of_samples(walk_state *s)
{
    const tl_target target = *s->target; /* a copy that no store can alias */
    const int bits = s->window->subpixel_bits;
    box_queue *q = &s->rows;
    const int n = q->n;
    q->n = 0;
    for (int i = 0; i < n; i += TL_LANES) {
        lane_triangles t;
        sampled_edges e;
        float starts[TL_MAX_SAMPLES][3][TL_MAX_LANES], steps[3][TL_MAX_LANES], inverses[3][TL_MAX_LANES];
        int32_t first[TL_MAX_LANES];
        vd z[3];
        pop_fixed(s, TL_SINK_SAMPLES, q, i, n, &t, z);
        vi_store(first, t.sample);
        setup_sampled(&t, &e);
        for (int side = 0; side < 3; side++) {
            vf_store(steps[side], e.step[side]);
            vf_store(inverses[side], e.inverse[side]);
            for (int sample = 0; sample < 1 << target.sample_bits; sample++)
                vf_store(starts[sample][side], sampled_start(&e, side, target.samples_fx + 2 * sample, bits));
        }
        const unsigned lefts = vm_bits(e.sides.third_is_left), rights = vm_bits(e.sides.third_is_right);
        const int end = lanes_at(i, n);
        for (int k = 0; k < end; k++) {
            const vm third_is_left = vm_first(lefts >> k & 1 ? TL_LANES : 0);
            const vm third_is_right = vm_first(rights >> k & 1 ? TL_LANES : 0);
            draw_sampled_rows(&target, starts, steps, inverses, k, third_is_left, third_is_right, first[k],
                              q->size[i + k]);
        }
    }
}

/* The largest distance of a sample from the centre, in x or y. */
static int32_t sample_reach(const tl_target *target)
{
    int32_t reach = 0;
    for (int k = 0; k < 2 << target->sample_bits; k++) {
        const int32_t away = target->samples_fx[k] < 0 ? -target->samples_fx[k] : target->samples_fx[k];
        reach = away > reach ? away : reach;
    }
    return reach;
}

#endif
