/* PNG: rows of a picture to the compressed bytes of the file, a block of deflate for each band of rows.
 * In: rows of bytes.  Out: a block that ends at a byte, so that bands are independent.
 *
 * A band uses the filter, up or average, that takes fewer bits for every sixteenth row.  Bytes have Huffman codes;
 * bytes equal to those of the pixel before are one match; other repeats are not searched.  Codes are those of the
 * counts in these rows.  All is integers, so a picture has equal bytes on every machine.
 *
 * Based on: Portable Network Graphics (PNG) Specification, Third Edition, W3C, 2025; P. Deutsch, RFC 1950 and RFC 1951,
 * 1996; D. A. Huffman, A Method for the Construction of Minimum-Redundancy Codes, 1952; J. van Leeuwen, On the
 * Construction of Huffman Trees, 1976 (two queues); R. Geldreich, miniz, 2013 (codes of limited length). */
#ifndef TL_PNG_C
#define TL_PNG_C

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "base/sort_pairs.h"
#include "lanes/inline.h"
#include "vertex/fixed.h"

enum { FILTER_UP = 2, FILTER_AVERAGE = 3 };
enum {
    N_SYMBOLS = 286, /* bytes, the end of a block, 29 lengths */
    END_OF_BLOCK = 256,
    FIRST_LENGTH = 257,
    MOST_BITS = 12, /* of a code: four codes and the rest of the last byte fit a word */
    LEAST_MATCH = 3,
    MOST_MATCH = 258,
    COUNTED_ROWS = 16, /* every 16th row is counted: counting all would take twice as long for 0.1 % fewer bytes */
};

/* The least length of each length symbol, and how many extra bits follow it. */
static const uint16_t LENGTHS[29] = {3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                     31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
static const uint8_t LENGTH_BITS[29] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                        2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};

/* Codes: the number of bits, and from bit 8 on the bits as in the file, the first bit lowest.  Shifts read only the
 * lowest 6 bits of such a number, so it needs no mask. */
typedef struct {
    uint32_t of_symbol[N_SYMBOLS];
    uint32_t of_length[MOST_MATCH + 1]; /* with the extra bits, and the bit of the distance */
} png_codes;

typedef struct {
    uint64_t bits;
    int n_bits;
    uint8_t *out;
} png_writer;

TL_INLINE uint64_t word_at(const uint8_t *p)
{
    uint64_t word;
    memcpy(&word, p, sizeof word);
    return word;
}

TL_INLINE void write_bits(png_writer *w, uint64_t bits, int n_bits)
{
    w->bits |= bits << w->n_bits, w->n_bits += n_bits;
    memcpy(w->out, &w->bits, sizeof w->bits);
    w->out += w->n_bits >> 3, w->bits >>= w->n_bits & ~7, w->n_bits &= 7;
}

TL_INLINE void write_code(png_writer *w, uint32_t code) { write_bits(w, code >> 8, code & 63); }

/* Writes the codes of four bytes. */
TL_INLINE void write_four(png_writer *w, const uint32_t *code, const uint8_t *bytes)
{
    const uint32_t a = code[bytes[0]], b = code[bytes[1]], c = code[bytes[2]], d = code[bytes[3]], ab = a + b;
    const uint64_t front = a >> 8 | (uint64_t)(b >> 8) << (a & 63), back = c >> 8 | (uint64_t)(d >> 8) << (c & 63);
    write_bits(w, front | back << (ab & 63), (ab + c + d) & 63);
}

/* Writes the filter's number and the filtered row. */
static void filter_row(const tl_png_rows *rows, int64_t row, int filter, uint8_t *restrict out)
{
    const uint8_t *own = rows->pixels + row * rows->n_bytes, *above = row ? own - rows->n_bytes : rows->above;
    const int step = rows->pixel_bytes;
    *out++ = (uint8_t)filter;
    if (filter == FILTER_UP) {
        for (int64_t i = 0; i < rows->n_bytes; i++)
            out[i] = (uint8_t)(own[i] - above[i]);
        return;
    }
    for (int i = 0; i < step; i++)
        out[i] = (uint8_t)(own[i] - (above[i] >> 1));
    for (int64_t i = step; i < rows->n_bytes; i++) {
        const uint8_t left = own[i - step];
        out[i] = (uint8_t)(own[i] - ((left & above[i]) + ((left ^ above[i]) >> 1)));
    }
}

/* Adler-32 of n more bytes: 64 sums side by side, over up to 16 lines, and the sums of these sums before each line. */
static uint32_t add_adler(uint32_t adler, const uint8_t *bytes, int64_t n)
{
    uint32_t a = adler & 0xffff, b = adler >> 16;
    while (n >= 64) {
        const uint32_t n_lines = (uint32_t)min64(n / 64, 16);
        uint16_t sums[64] = {0}, before[64] = {0};
        uint32_t sum = 0, weighed = 0;
        for (uint32_t line = 0; line < n_lines; line++, bytes += 64)
            for (int i = 0; i < 64; i++)
                before[i] = (uint16_t)(before[i] + sums[i]), sums[i] = (uint16_t)(sums[i] + bytes[i]);
        for (int i = 0; i < 64; i++)
            sum += sums[i], weighed += (uint32_t)(64 - i) * sums[i] + 64u * before[i];
        b = (b + 64 * n_lines * a + weighed) % 65521, a = (a + sum) % 65521;
        n -= 64 * n_lines;
    }
    for (; n > 0; n--)
        a += *bytes++, b += a;
    return b % 65521 << 16 | a % 65521;
}

/* The number of bytes from i on that equal those of the pixel before. */
TL_INLINE int64_t match_length(const uint8_t *row, int64_t i, int64_t end, int step)
{
    int64_t k = i;
    for (; k + 8 <= end; k += 8) {
        const uint64_t differs = word_at(row + k) ^ word_at(row + k - step);
        if (differs)
            return k - i + (__builtin_ctzll(differs) >> 3);
    }
    while (k < end && row[k] == row[k - step])
        k++;
    return k - i;
}

/* The symbol of a length, of 29. */
TL_INLINE int length_symbol(int64_t length)
{
    const int over = (int)length - LEAST_MATCH, high = over < 8 ? 0 : 29 - __builtin_clz((unsigned)over);
    return length == MOST_MATCH ? 28 : 4 * high + (over >> high);
}

/* Counts a symbol, or writes its code. */
TL_INLINE void code_symbol(int symbol, uint32_t *counts, const png_codes *codes, png_writer *w)
{
    if (counts)
        counts[symbol]++;
    else
        write_code(w, codes->of_symbol[symbol]);
}

/* Counts a match, or writes its code, but not a rest too short for a symbol; returns how many bytes are coded. */
TL_INLINE int64_t code_match(int64_t length, uint32_t *counts, const png_codes *codes, png_writer *w)
{
    int64_t rest = length;
    for (int64_t part; rest >= LEAST_MATCH; rest -= part) {
        part = min64(rest, MOST_MATCH);
        if (counts)
            counts[FIRST_LENGTH + length_symbol(part)]++;
        else
            write_code(w, codes->of_length[part]);
    }
    return length - rest;
}

/* Counts the symbols of a filtered row of n bytes, or writes their codes. */
TL_INLINE void code_row(const uint8_t *row, int64_t n, int step, uint32_t *counts, const png_codes *codes,
                        png_writer *w)
{
    /* With filter up a single equal pixel makes a match: this saves 3 to 8 % of a picture of ids.  With filter average
     * such matches are chance. */
    const uint64_t matched = row[0] == FILTER_UP ? 0xffffffff : UINT64_MAX;
    int64_t i = 0;
    for (; i < n && i <= step; i++)
        code_symbol(row[i], counts, codes, w);
    while (i + 8 <= n) {
        if (!((word_at(row + i) ^ word_at(row + i - step)) & matched)) {
            i += code_match(match_length(row, i, n, step), counts, codes, w);
            continue;
        }
        if (counts)
            counts[row[i]]++, counts[row[i + 1]]++, counts[row[i + 2]]++, counts[row[i + 3]]++;
        else
            write_four(w, codes->of_symbol, row + i);
        i += 4;
    }
    for (; i < n; i++)
        code_symbol(row[i], counts, codes, w);
}

TL_ONCE void count_row(const uint8_t *row, int64_t n, int step, uint32_t *counts)
{
    code_row(row, n, step, counts, NULL, NULL);
}

TL_ONCE void write_row(const uint8_t *row, int64_t n, int step, const png_codes *codes, png_writer *w)
{
    png_writer own = *w; /* a copy, to be kept in registers */
    code_row(row, n, step, NULL, codes, &own);
    *w = own;
}

/* Sets the lengths of Huffman codes, MOST_BITS at most; every symbol has a count > 0. */
static void find_code_bits(const uint32_t *counts, uint8_t *n_bits)
{
    keyed pairs[2 * N_SYMBOLS];
    int64_t weight[2 * N_SYMBOLS];
    int above[2 * N_SYMBOLS], depth[2 * N_SYMBOLS], n_of[MOST_BITS + 1] = {0};
    for (int i = 0; i < N_SYMBOLS; i++)
        pairs[i] = (keyed){counts[i], i};
    const keyed *sorted = sort_pairs(pairs, pairs + N_SYMBOLS, N_SYMBOLS);
    for (int i = 0; i < N_SYMBOLS; i++)
        weight[i] = sorted[i].key;
    /* leaves ascend, and so do inner nodes: the two lightest are at the heads of two queues */
    for (int leaf = 0, node = N_SYMBOLS, made = N_SYMBOLS; made < 2 * N_SYMBOLS - 1; made++) {
        weight[made] = 0;
        for (int k = 0; k < 2; k++) {
            const int takes_leaf = leaf < N_SYMBOLS && (node == made || weight[leaf] <= weight[node]);
            const int own = takes_leaf ? leaf++ : node++;
            weight[made] += weight[own], above[own] = made;
        }
    }
    depth[2 * N_SYMBOLS - 2] = 0;
    for (int i = 2 * N_SYMBOLS - 3; i >= 0; i--) {
        depth[i] = depth[above[i]] + 1;
        if (i < N_SYMBOLS)
            n_of[min64(depth[i], MOST_BITS)]++;
    }
    int32_t taken = -(1 << MOST_BITS); /* how many codes of MOST_BITS bits exceed the room */
    for (int bits = 1; bits <= MOST_BITS; bits++)
        taken += n_of[bits] << (MOST_BITS - bits);
    for (; taken > 0; taken--) {
        int bits = MOST_BITS - 1;
        while (!n_of[bits])
            bits--;
        n_of[MOST_BITS]--, n_of[bits]--, n_of[bits + 1] += 2;
    }
    for (int bits = MOST_BITS, i = 0; bits > 0; bits--)
        for (int k = 0; k < n_of[bits]; k++)
            n_bits[sorted[i++].i] = (uint8_t)bits;
}

/* Reverses the lowest n bits. */
TL_INLINE uint32_t reversed(uint32_t bits, int n)
{
    uint32_t other = 0;
    for (int k = 0; k < n; k++)
        other |= (bits >> k & 1) << (n - 1 - k);
    return other;
}

static void set_codes(png_codes *codes, const uint8_t *n_bits)
{
    uint32_t next = 0;
    for (int bits = 1; bits <= MOST_BITS; bits++, next <<= 1)
        for (int i = 0; i < N_SYMBOLS; i++)
            if (n_bits[i] == bits)
                codes->of_symbol[i] = reversed(next++, bits) << 8 | (uint32_t)bits;
    for (int length = LEAST_MATCH; length <= MOST_MATCH; length++) {
        const int symbol = length_symbol(length), n_own = n_bits[FIRST_LENGTH + symbol];
        const uint32_t own = codes->of_symbol[FIRST_LENGTH + symbol] & ~255u,
                       rest = (uint32_t)(length - LENGTHS[symbol]);
        /* the distance has one code: a bit 0 */
        codes->of_length[length] = own | rest << (8 + n_own) | (uint32_t)(n_own + LENGTH_BITS[symbol] + 1);
    }
}

/* Sets the code lengths of a filter for the counted rows; returns the bits that these rows take. */
static int64_t try_filter(const tl_png_rows *rows, int filter, uint8_t *row, uint8_t *n_bits)
{
    uint32_t counts[N_SYMBOLS];
    int64_t sum = 0;
    for (int i = 0; i < N_SYMBOLS; i++)
        counts[i] = 1;
    for (int64_t k = rows->n_rows < 2 * COUNTED_ROWS ? 0 : COUNTED_ROWS / 2; k < rows->n_rows;
         k += rows->n_rows < 2 * COUNTED_ROWS ? 1 : COUNTED_ROWS) {
        filter_row(rows, k, filter, row);
        count_row(row, 1 + rows->n_bytes, rows->pixel_bytes, counts);
    }
    find_code_bits(counts, n_bits);
    for (int i = 0; i < N_SYMBOLS; i++)
        sum += (int64_t)counts[i] * (n_bits[i] + (i < FIRST_LENGTH ? 0 : 1 + LENGTH_BITS[i - FIRST_LENGTH]));
    return sum;
}

/* Writes the head of a block that is not the last: the lengths of its codes, four bits each, and one distance, a
 * pixel. */
static void write_head(png_writer *w, int step, const uint8_t *n_bits)
{
    const int n_lengths = N_SYMBOLS + step;
    write_bits(w, 4 | (N_SYMBOLS - 257) << 3 | (step - 1) << 8 | 15 << 13, 17);
    write_bits(w, 0, 9); /* symbols 16, 17 and 18 are not used */
    for (int i = 0; i < 16; i++)
        write_bits(w, 4, 3);
    for (int i = 0; i < n_lengths; i++)
        write_bits(w, reversed(i < N_SYMBOLS ? n_bits[i] : i == n_lengths - 1, 4), 4);
}

static int64_t encode_rows(const tl_png_rows *rows, uint8_t *row, uint32_t *adler, uint8_t *out)
{
    png_codes codes;
    png_writer w = {0, 0, out};
    uint8_t up[N_SYMBOLS], average[N_SYMBOLS];
    const int is_up = try_filter(rows, FILTER_UP, row, up) <= try_filter(rows, FILTER_AVERAGE, row, average);
    write_head(&w, rows->pixel_bytes, is_up ? up : average);
    set_codes(&codes, is_up ? up : average);
    for (int64_t k = 0; k < rows->n_rows; k++) {
        filter_row(rows, k, is_up ? FILTER_UP : FILTER_AVERAGE, row);
        *adler = add_adler(*adler, row, 1 + rows->n_bytes);
        write_row(row, 1 + rows->n_bytes, rows->pixel_bytes, &codes, &w);
    }
    write_code(&w, codes.of_symbol[END_OF_BLOCK]);
    write_bits(&w, 0, 3 + (-(w.n_bits + 3) & 7)); /* an empty stored block ends at a byte */
    write_bits(&w, 0xffff0000, 32);
    return w.out - out;
}

#endif
