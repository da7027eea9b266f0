/* Looks at all that files of pictures are made of: the filters of pixels/png.c for all bytes, the symbols of all lengths,
 * and counts of pixels/rle.c, read back. */
#include <stdio.h>
#include <stdlib.h>

#include "topleft.h"
#include "pixels/png.c"
#include "pixels/rle.c"

static void need(int holds, const char *what)
{
    if (!holds) {
        printf("%s: a value is wrong\n", what);
        exit(1);
    }
}

/* All pixels of one byte with all bytes on the left and above. */
static void look_at_filters(void)
{
    uint8_t above[2], pixels[2], out[3];
    const tl_png_rows rows = {.pixels = pixels, .above = above, .n_rows = 1, .n_bytes = 2, .pixel_bytes = 1};
    for (int a = 0; a < 256; a++)
        for (int b = 0; b < 256; b++)
            for (int c = 0; c < 256; c++) {
                above[0] = (uint8_t)a, above[1] = (uint8_t)b, pixels[0] = (uint8_t)a, pixels[1] = (uint8_t)c;
                filter_row(&rows, 0, FILTER_UP, out);
                need(out[0] == 2 && (uint8_t)(out[1] + a) == a && (uint8_t)(out[2] + b) == c, "the filter up");
                filter_row(&rows, 0, FILTER_AVERAGE, out);
                need(out[0] == 3 && (uint8_t)(out[1] + (0 + a) / 2) == a && (uint8_t)(out[2] + (a + b) / 2) == c,
                     "the filter average");
            }
}

static void look_at_lengths(void)
{
    for (int length = LEAST_MATCH; length <= MOST_MATCH; length++) {
        const int symbol = length_symbol(length), rest = length - LENGTHS[symbol];
        need(symbol >= 0 && symbol < 29 && rest >= 0 && rest < 1 << LENGTH_BITS[symbol], "a length");
    }
}

/* Counts as text, by COCO's rule: five bits a character, the sixth if more follow, the fifth of the last is the sign. */
static void look_at_count(int64_t x)
{
    const int64_t base = x < 0 ? -x : 0;
    int64_t counts[4] = {0, base, 0, base + x}, n_counts = 4, starts = 0, text_starts[2], read = 0;
    uint8_t text[4 * 13];
    const tl_rles rles = {.counts = counts, .n_counts = &n_counts, .starts = &starts, .n = 1};
    write_counts(&rles, text_starts, text);
    int64_t at = text_starts[1];
    for (at--; at > 0 && (text[at - 1] - 48) & 32; at--) /* the first character of the last count */
        ;
    const int64_t n = text_starts[1] - at;
    for (int64_t k = n; k-- > 0;) {
        const int64_t bits = (text[at + k] - 48) & 31;
        read = k == n - 1 ? bits - 2 * (bits & 16) : read * 32 + bits;
    }
    need(n <= 13 && read == x, "a count");
}

int main(void)
{
    look_at_filters(), look_at_lengths();
    for (int64_t x = -(1 << 21); x <= 1 << 21; x++)
        look_at_count(x);
    for (int bits = 21; bits < 62; bits++)
        for (int64_t x = -2; x <= 2; x++)
            look_at_count(((int64_t)1 << bits) + x), look_at_count(x - ((int64_t)1 << bits));
    return 0;
}
