/* Sampled single: one triangle by itself, at all samples of a pixel.
 * In: vertex records.  Out: bits of samples.
 *
 * In a row of a large triangle only the ends differ between samples: the pixels between the ends are stored as whole
 * words, and two words at each end are built from the spans of the samples, a vector of rows at a time.  Rows with ends
 * more than two words wide, or that some samples miss, are built word by word. */
#ifndef TL_SAMPLED_SINGLE_C
#define TL_SAMPLED_SINGLE_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "vertex/clip.c"
#include "vertex/corners.h"
#include "vertex/fixed.h"
#include "vertex/setup.c"
#include "sink/covered.c"
#include "raster/single_fixed.c"

/* Sets the bits of all samples in a row, in the words that hold the pixels [from, to); `at` is the pixel of column
 * 0. */
TL_INLINE void cover_ends(const tl_target *target, int64_t at, int64_t from, int64_t to, const int32_t *first,
                          const int32_t *end)
{
    const int sample_bits = target->sample_bits;
    const int64_t per_word = 64 >> sample_bits;
    for (int64_t word = (at + from) << sample_bits >> 6; word * per_word < at + to; word++) {
        const int64_t col = word * per_word - at;
        uint64_t bits = 0;
        for (int sample = 0; sample < 1 << sample_bits; sample++) {
            const int64_t begin = max64(first[sample] - col, 0) << sample_bits;
            const int64_t stop = max64(min64(end[sample] - col, per_word), 0) << sample_bits;
            if (begin < stop)
                bits |= (~0ull << begin & ~0ull >> (64 - stop) & sample_pattern(sample_bits)) << sample;
        }
        target->covered[word] |= bits;
    }
}

/* Sets the bits of a row in which sample k covers the columns [first[k], end[k]). */
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

/* A triangle for each sample, with one origin for all, which may lie a pixel outside an extent. */
typedef struct {
    tl_triangle t[TL_MAX_SAMPLES]; /* with an empty box if it covers no such sample */
    edges_64 e[TL_MAX_SAMPLES];
    int64_t col0, row0, row1;
} sampled_triangle;

/* Sets the triangle up for all samples; returns whether its row ends fit float64. */
static int setup_sampled_triangle(const tl_snapped *snapped, const int32_t *corners, const tl_window *window,
                                  const tl_target *target, sampled_triangle *s)
{
    const int n_samples = 1 << target->sample_bits;
    tl_vertex_set seen = snapped->mesh;
    s->col0 = window->width, s->row0 = window->height, s->row1 = 0;
    for (int k = 0; k < n_samples; k++) {
        tl_triangle *t = &s->t[k];
        seen.sample_x_fx = target->samples_fx[2 * k], seen.sample_y_fx = target->samples_fx[2 * k + 1];
        const int sign = load_triangle(&seen, corners, t);
        if (!rows_fit(t, window, 1))
            return 0;
        if (is_culled(sign, snapped->cull))
            return 1;
        if (!clip_box(t, window)) {
            t->row0 = t->row1 = 0;
            continue;
        }
        s->col0 = min64(s->col0, t->col0), s->row0 = min64(s->row0, t->row0), s->row1 = max64(s->row1, t->row1);
    }
    for (int k = 0; k < n_samples && s->row0 < s->row1; k++) {
        tl_triangle moved = s->t[k];
        moved.col0 = s->col0, moved.row0 = s->row0;
        s->e[k] = setup_edges_64(&moved, window);
    }
    return 1;
}

/* The columns [first, end) of sample k in TL_LANES rows at [k], relative to col0. */
typedef struct {
    int32_t first[TL_MAX_SAMPLES][TL_MAX_LANES], end[TL_MAX_SAMPLES][TL_MAX_LANES];
} sampled_ends;

static void find_sampled_ends(const sampled_triangle *s, int n_samples, int64_t row, sampled_ends *ends)
{
    const vd rows = vd_add(vd_set1((double)(row - s->row0)), vd_from_vi(vi_iota()));
    for (int k = 0; k < n_samples; k++) {
        const tl_triangle *t = &s->t[k];
        if (t->row0 < t->row1)
            find_row_ends(&s->e[k], rows, (double)(t->col0 - s->col0), (double)(t->col1 - s->col0), ends->first[k],
                          ends->end[k]);
        for (int lane = 0; lane < TL_LANES; lane++)
            if (row + lane < t->row0 || row + lane >= t->row1)
                ends->first[k][lane] = ends->end[k][lane] = 0;
    }
}

/* The words of up to TL_LANES rows: two from `left` on, and two from `right` on; all bits of the words between are
 * set. */
typedef struct {
    uint64_t left_words[2][TL_MAX_LANES], right_words[2][TL_MAX_LANES];
    int32_t left[TL_MAX_LANES], right[TL_MAX_LANES]; /* words from the word that holds column 0 */
} word_rows;

/* Sets the words of rows; returns the lanes whose ends fit two words.  `skip`: pixels of the first word before column
 * 0. */
TL_INLINE unsigned find_words(const sampled_ends *ends, int sample_bits, vi skip, word_rows *w)
{
    const int word_shift = 6 - sample_bits;
    const vi zero = vi_set1(0), per_word = vi_set1(1 << word_shift);
    vi least = vi_load(ends->first[0]), inner = least, inner_end = vi_load(ends->end[0]), most = inner_end;
    vm fits = vi_gt(inner_end, least);
    for (int k = 1; k < 1 << sample_bits; k++) {
        const vi first = vi_load(ends->first[k]), end = vi_load(ends->end[k]);
        least = vi_min(least, first), inner = vi_max(inner, first);
        inner_end = vi_min(inner_end, end), most = vi_max(most, end);
        fits = vm_and(fits, vi_gt(end, first));
    }
    const vi left = vi_shift_right(vi_add(least, skip), word_shift);
    const vi right = vi_shift_right(vi_add(inner_end, skip), word_shift);
    const vi from_left = vi_sub(skip, vi_shift_left(left, word_shift));
    const vi from_right = vi_sub(skip, vi_shift_left(right, word_shift));
    const vi two_words = vi_add(per_word, per_word);
    fits =
        vm_and_not(fits, vm_or(vi_gt(vi_add(inner, from_left), two_words), vi_gt(vi_add(most, from_right), two_words)));
    vi_store(w->left, left);
    vi_store(w->right, right);
    for (int k = 0; k < 4; k++) {
        vi from = k < 2 ? from_left : from_right;
        vw words = vw_zero();
        if (k & 1)
            from = vi_sub(from, per_word);
        for (int sample = 0; sample < 1 << sample_bits; sample++) {
            const vi begin = vi_max(vi_add(vi_load(ends->first[sample]), from), zero);
            const vi stop = vi_max(vi_add(vi_load(ends->end[sample]), from), zero);
            words = vw_add_range(words, vi_shift_left(begin, sample_bits), vi_shift_left(stop, sample_bits),
                                 sample_pattern(sample_bits) << sample);
        }
        vw_store(k < 2 ? w->left_words[k] : w->right_words[k - 2], words);
    }
    return vm_bits(fits);
}

/* Stores n rows; `at` is the pixel of the first row at column 0. */
TL_INLINE void cover_rows(const tl_target *target, int64_t at, int n, const sampled_ends *ends, int sample_bits)
{
    const int64_t per_word = 64 >> sample_bits;
    const vi pixels = vi_add(vi_set1((int32_t)at), vi_mul(vi_set1((int32_t)target->stride_px), vi_iota()));
    word_rows w;
    const unsigned fits = find_words(ends, sample_bits, vi_and(pixels, vi_set1((int32_t)per_word - 1)), &w);
    for (int lane = 0; lane < n; lane++, at += target->stride_px) {
        if (!(fits >> lane & 1)) {
            int32_t first[TL_MAX_SAMPLES], end[TL_MAX_SAMPLES];
            for (int k = 0; k < 1 << sample_bits; k++)
                first[k] = ends->first[k][lane], end[k] = ends->end[k][lane];
            cover_row(target, at, first, end);
            continue;
        }
        uint64_t *const left = target->covered + at / per_word + w.left[lane], *const right = target->covered +
                                                                                              at / per_word +
                                                                                              w.right[lane];
        left[0] |= w.left_words[0][lane];
        left[1] |= w.left_words[1][lane];
        for (uint64_t *word = left + 2; word < right; word++)
            *word = ~0ull;
        right[0] |= w.right_words[0][lane];
        right[1] |= w.right_words[1][lane];
    }
}

/* Draws a triangle by its words; returns 0, and draws nothing, if its row ends do not fit float64. */
static int walk_samples(const tl_snapped *snapped, const int32_t *corners, const tl_window *window,
                        const tl_target *shared)
{
    const tl_target own = *shared, *target = &own; /* a copy that no store can alias */
    sampled_triangle s;
    sampled_ends ends = {{{0}}, {{0}}}; /* for compilers, which cannot prove that there is a sample */
    if (!setup_sampled_triangle(snapped, corners, window, target, &s))
        return 0;
    tl_count_work(window, max64(s.row1 - s.row0, 0)
                              << (target->sample_bits + 4)); /* a row end of a sample counts as 16 pixels */
    for (int64_t row = s.row0; row < s.row1; row += TL_LANES) {
        const int n = s.row1 - row < TL_LANES ? (int)(s.row1 - row) : TL_LANES;
        const int64_t at = row * target->stride_px + s.col0;
        find_sampled_ends(&s, 1 << target->sample_bits, row, &ends);
        switch (target->sample_bits) { /* constants keep the words in registers */
        case 1: cover_rows(target, at, n, &ends, 1); break;
        case 2: cover_rows(target, at, n, &ends, 2); break;
        case 3: cover_rows(target, at, n, &ends, 3); break;
        default: cover_rows(target, at, n, &ends, 4); break;
        }
    }
    return 1;
}

/* Draws triangle i by itself. */
static __attribute__((noinline)) void draw_single_each_sample(const tl_snapped *snapped, int64_t i,
                                                              const tl_window *window, const tl_target *target)
{
    tl_snapped seen = *snapped;
    tl_target one = *target;
    int32_t corners[3];
    read_corners(snapped, i, corners);
    if (snapped->method == TL_METHOD_AUTO && !is_clipped(&snapped->mesh, corners) &&
        walk_samples(snapped, corners, window, target))
        return;
    for (one.sample = 0; one.sample < 1 << target->sample_bits; one.sample++) {
        seen.mesh.sample_x_fx = target->samples_fx[2 * one.sample];
        seen.mesh.sample_y_fx = target->samples_fx[2 * one.sample + 1];
        draw_single_fixed_samples(&seen, i, window, &one);
    }
}

#endif
