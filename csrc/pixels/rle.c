/* Run lengths of masks and of ids, down the columns as COCO counts them.
 * In: rows of pixels of one or four bytes.  Out: runs of equal pixels; the counts of each object; the counts as text.
 *
 * A cache line of each row is compared with the row above it, a word at a time.  The rows at which a column changes are
 * listed by column, so that each cache line is read once. */
#ifndef TL_RLE_C
#define TL_RLE_C

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"

#define RLE_WORDS (TL_RLE_LINE / 8)

TL_INLINE int64_t value_at(const tl_run_source *s, int64_t row, int64_t column)
{
    int32_t value;
    const uint8_t *at = s->pixels + row * s->stride + column * s->n_bytes;
    if (s->n_bytes == 1)
        return *at;
    memcpy(&value, at, sizeof value);
    return value;
}

/* Adds `row` to the lists of the columns in which two words differ; `column`: the first column of the words in the
 * line. */
TL_INLINE void note_changes(uint64_t differs, int n_bytes, int64_t column, int64_t height, int32_t row, int32_t *rows,
                            int32_t *n_rows)
{
    const int shift = n_bytes == 1 ? 3 : 5; /* pixels to bits */
    const uint64_t pixel = n_bytes == 1 ? 0xff : 0xffffffff;
    while (differs) {
        const int first = __builtin_ctzll(differs) >> shift; /* in the word */
        rows[(column + first) * height + n_rows[column + first]++] = row;
        differs &= ~(pixel << (first << shift));
    }
}

/* Lists the rows at which each column of a line of n bytes changes: `rows` has `height` a column, `n_rows` their
 * number. */
static void find_changes(const tl_run_source *s, int64_t first_byte, int64_t n, int32_t *rows, int32_t *n_rows)
{
    const int64_t a_word = 8 / s->n_bytes;
    uint64_t above[RLE_WORDS] = {0}, line[RLE_WORDS] = {0};
    const uint8_t *at = s->pixels + first_byte;
    memset(n_rows, 0, TL_RLE_LINE * sizeof *n_rows);
    memcpy(above, at, (size_t)n);
    for (int32_t row = 1; row < s->height; row++) {
        uint64_t any = 0;
        at += s->stride;
        if (n == TL_RLE_LINE)
            memcpy(line, at, TL_RLE_LINE);
        else
            memcpy(line, at, (size_t)n);
        for (int k = 0; k < RLE_WORDS; k++)
            any |= above[k] ^ line[k];
        if (!any)
            continue;
        for (int k = 0; k < RLE_WORDS; k++) {
            note_changes(above[k] ^ line[k], s->n_bytes, k * a_word, s->height, row, rows, n_rows);
            above[k] = line[k];
        }
    }
}

static int list_column_runs(const tl_run_source *s, int32_t *rows, tl_run *runs, int64_t n_room, int64_t *n)
{
    const int64_t a_line = TL_RLE_LINE / s->n_bytes;
    int32_t n_rows[TL_RLE_LINE];
    for (int64_t column = 0; column < s->width;) {
        const int64_t n_columns = s->width - column < a_line ? s->width - column : a_line;
        int64_t most = n_columns;
        find_changes(s, column * s->n_bytes, n_columns * s->n_bytes, rows, n_rows);
        for (int64_t k = 0; k < n_columns; k++)
            most += n_rows[k];
        if (*n + most > n_room)
            return 0;
        for (int64_t k = 0; k < n_columns; k++, column++) {
            const int64_t base = (s->left + column) * s->frame_height + s->top;
            int64_t top = 0;
            for (int32_t i = 0; i <= n_rows[k]; i++) {
                const int64_t bottom = i < n_rows[k] ? rows[k * s->height + i] : s->height;
                const int64_t value = value_at(s, top, column);
                if (value != s->background)
                    runs[(*n)++] = (tl_run){base + top, base + bottom, s->is_mask ? s->key : value};
                top = bottom;
            }
        }
    }
    return 1;
}

static void count_runs(const tl_run *runs, const int32_t *object, int64_t n, const tl_rles *rles)
{
    memset(rles->n_counts, 0, (size_t)rles->n * sizeof *rles->n_counts);
    memset(rles->ends, 0, (size_t)rles->n * sizeof *rles->ends);
    for (int64_t i = 0; i < n; i++) {
        const int32_t k = object[i];
        if (k < 0)
            continue;
        int64_t *next = rles->counts + rles->starts[k] + rles->n_counts[k];
        if (rles->n_counts[k] && runs[i].start == rles->ends[k]) { /* continues at the top of the next column */
            next[-1] += runs[i].end - runs[i].start;
        } else {
            next[0] = runs[i].start - rles->ends[k];
            next[1] = runs[i].end - runs[i].start;
            rles->n_counts[k] += 2;
        }
        rles->ends[k] = runs[i].end;
    }
    for (int64_t k = 0; k < rles->n; k++)
        if (rles->ends[k] < rles->n_pixels || !rles->n_pixels)
            rles->counts[rles->starts[k] + rles->n_counts[k]++] = rles->n_pixels - rles->ends[k];
}

/* Text: five bits a character, the sixth bit is set if more follow.  From the fourth count on the number is the
 * difference from the count two before. */
static void write_counts(const tl_rles *rles, int64_t *text_starts, uint8_t *text)
{
    int64_t at = 0;
    for (int64_t k = 0; k < rles->n; k++) {
        const int64_t *counts = rles->counts + rles->starts[k];
        text_starts[k] = at;
        for (int64_t i = 0; i < rles->n_counts[k]; i++) {
            int64_t x = i > 2 ? counts[i] - counts[i - 2] : counts[i];
            int is_more = 1;
            while (is_more) {
                const int bits = (int)(x & 31);
                x >>= 5;
                is_more = bits & 16 ? x != -1 : x != 0;
                text[at++] = (uint8_t)((is_more ? bits | 32 : bits) + 48);
            }
        }
    }
    text_starts[rles->n] = at;
}

#endif
