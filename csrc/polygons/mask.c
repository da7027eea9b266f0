/* Mask: the pixels with a sample inside of one polygon.
 * In: rings.  Out: bytes, 0 or 1.
 *
 * Even-odd: a bit a pixel; crossings cancel in pairs, then the parity from the left is computed for 64 pixels at a
 * time. Nonzero: a first pass over the ends of edges counts the crossings of each row, a second pass lists them; rows
 * of few crossings are sorted, rows of many become sums by column. */
#ifndef TL_POLYGON_MASK_C
#define TL_POLYGON_MASK_C

#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"
#include "polygons/crossings.c"
#include "polygons/polygons.h"
#include "polygons/row_bits.c"

#define TL_SORTED_CROSSINGS 8 /* in a row; with more, sums by column are faster: a star of a million corners */

/* Rows of `out` have `width` bytes.  `bits` has (bottom - top) * tl_polygon_stride(width) bits, all 0, and they end as
 * 0. */
static void mask_even_odd(const tl_polygons *p, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
                          uint64_t *bits, uint8_t *out)
{
    const row_frame f = place_rows(p, top, bottom, width);
    const crossing_sink s = {.stride = tl_polygon_stride(width), .bits = bits};
    walk_to_bits(p, polygon, &f, &s);
    for (int64_t row = top; row < bottom; row++, bits += s.stride >> 6) {
        uint8_t *to = out + row * width;
        uint64_t carry = 0;
        int64_t c = 0, k = 0;
        for (; c + 64 <= width; c += 64, k++) {
            uint64_t inside = carry;
            if (bits[k]) {
                inside ^= parity_from_left(bits[k]);
                carry = (uint64_t)((int64_t)inside >> 63);
                bits[k] = 0;
            }
            bytes_from_bits(to + c, inside);
        }
        if (c < width) {
            uint8_t tail[64];
            bytes_from_bits(tail, parity_from_left(bits[k]) ^ carry);
            memcpy(to + c, tail, (size_t)(width - c));
        }
        bits[k] = 0;
    }
}

TL_INLINE void sort_crossings(int32_t *v, int n)
{
    for (int i = 1; i < n; i++) {
        const int32_t x = v[i];
        int j = i;
        for (; j > 0 && v[j - 1] > x; j--)
            v[j] = v[j - 1];
        v[j] = x;
    }
}

/* Steps to the next span of sorted crossings v[*i, n): columns [*begin, *end). */
TL_INLINE int next_span(const int32_t *v, int n, int is_nonzero, int *i, int32_t *begin, int32_t *end)
{
    while (*i + 1 < n) {
        *begin = v[*i] >> 1;
        if (is_nonzero) {
            int winding = 1 - 2 * (v[*i] & 1);
            for (++*i; *i < n && winding; ++*i)
                winding += 1 - 2 * (v[*i] & 1);
            *end = v[*i - 1] >> 1;
        } else {
            *end = v[*i + 1] >> 1;
            *i += 2;
        }
        if (*begin < *end)
            return 1;
    }
    return 0;
}

static void mask_listed_row(int32_t *v, int n, int64_t width, uint8_t *out)
{
    int i = 0;
    int32_t begin, end, at = 0;
    sort_crossings(v, n);
    while (next_span(v, n, 1, &i, &begin, &end)) {
        memset(out + at, 0, (size_t)(begin - at));
        memset(out + begin, 1, (size_t)(end - begin));
        at = end;
    }
    memset(out + at, 0, (size_t)(width - at));
}

/* `at` has bottom - top + 1 numbers; `list` has room for n_list, at least the edges of the polygon; `cells` has
 * tl_polygon_stride(width) numbers, all 0, and they end as 0; `bits` has a bit for each cell. */
static void mask_nonzero(const tl_polygons *p, int64_t polygon, int64_t width, int64_t top, int64_t bottom,
                         uint32_t *at, int32_t *list, int64_t n_list, int32_t *cells, uint64_t *bits, uint8_t *out)
{
    const int64_t stride = tl_polygon_stride(width);
    row_frame f = place_rows(p, top, bottom, width);
    crossing_sink s = {.at = at, .list = list};
    memset(at, 0, sizeof *at * (size_t)(bottom - top + 1));
    walk_polygon(p, polygon, &f, &s, TO_COUNTS);
    if (is_polygon_given_up(p, 1)) /* counts may be incomplete */
        return;
    for (int64_t k = 1; k < bottom - top; k++) /* counts from their differences */
        at[k] += at[k - 1];
    for (int64_t first = top, end = top; first < bottom; first = end) {
        int64_t n = 0;
        uint32_t *starts = at + (first - top); /* becomes the begin of each row, then its end */
        for (; end < bottom && n + at[end - top] <= n_list; end++) {
            const uint32_t count = at[end - top];
            at[end - top] = (uint32_t)n;
            n += count;
        }
        f = place_rows(p, first, end, width);
        s.at = starts;
        walk_polygon(p, polygon, &f, &s, TO_LISTS);
        if (is_polygon_given_up(p, 1))
            return;
        int64_t begin = 0;
        for (int64_t row = first; row < end; row++) {
            const int m = (int)(starts[row - first] - begin);
            uint8_t *to = out + row * width;
            if (m <= TL_SORTED_CROSSINGS) {
                mask_listed_row(list + begin, m, width, to);
            } else {
                for (int i = 0; i < m; i++)
                    cells[list[begin + i] >> 1] += 1 - 2 * (list[begin + i] & 1);
                fill_winding(cells, stride, bits);
                store_bytes(to, width, bits);
            }
            begin = starts[row - first];
        }
    }
}

#endif
