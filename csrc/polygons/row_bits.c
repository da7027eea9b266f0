/* Rows of bits: crossings to the pixels inside, and pixels inside to bytes or spans.
 * In: a bit or a sum for each column with crossings.  Out: a bit for each pixel inside. */
#ifndef TL_POLYGON_ROW_BITS_C
#define TL_POLYGON_ROW_BITS_C

#include <stdint.h>
#include <string.h>

#include "lanes/lanes.h"

/* Bit k of the result is the parity of the bits [0, k]. */
TL_INLINE uint64_t parity_from_left(uint64_t x)
{
    for (int k = 1; k < 64; k *= 2)
        x ^= x << k;
    return x;
}

/* Turns crossings modulo 2 into the pixels inside by the even-odd rule, in place.  Most words have no crossing. */
TL_INLINE void fill_parity(uint64_t *bits, int64_t n_words)
{
    uint64_t carry = 0;
    for (int64_t k = 0; k < n_words; k++) {
        if (bits[k]) {
            bits[k] = parity_from_left(bits[k]) ^ carry;
            carry = (uint64_t)((int64_t)bits[k] >> 63);
        } else {
            bits[k] = carry;
        }
    }
}

/* Turns sums of directions into the pixels with a winding number other than 0; clears the cells, a multiple of 64. */
TL_INLINE void fill_winding(int32_t *cells, int64_t n_cells, uint64_t *bits)
{
    vi carry = vi_set1(0);
    const vi zero = carry;
    for (int64_t c = 0; c < n_cells; c += 64) {
        uint64_t word = 0;
        for (int k = 0; k < 64; k += TL_LANES) {
            const vi v = vi_load(cells + c + k);
            vi sum = carry;
            if (vm_any(vm_and_not(vm_all(), vi_eq(v, zero)))) {
                sum = vi_add(vi_prefix_sum(v), carry);
                carry = vi_last(sum);
                vi_store(cells + c + k, zero);
            }
            word |= (uint64_t)vm_bits(vm_and_not(vm_all(), vi_eq(sum, zero))) << k;
        }
        bits[c >> 6] = word;
    }
}

/* Writes a row of bytes, 0 or 1. */
TL_INLINE void store_bytes(uint8_t *out, int64_t width, const uint64_t *bits)
{
    int64_t c = 0;
    for (; c + 64 <= width; c += 64)
        bytes_from_bits(out + c, bits[c >> 6]);
    if (c < width) {
        uint8_t tail[64];
        bytes_from_bits(tail, bits[c >> 6]);
        memcpy(out + c, tail, (size_t)(width - c));
    }
}

/* Steps to the next run [*begin, *end) of set bits at or after *end and below n; 0 at the end. */
TL_INLINE int next_run(const uint64_t *bits, int64_t n, int64_t *begin, int64_t *end)
{
    int64_t at = *end;
    uint64_t word;
    if (at >= n)
        return 0;
    for (word = bits[at >> 6] & ~(uint64_t)0 << (at & 63); !word; word = bits[at >> 6]) {
        at = (at | 63) + 1;
        if (at >= n)
            return 0;
    }
    at = (at & ~(int64_t)63) + __builtin_ctzll(word);
    if (at >= n)
        return 0;
    *begin = at;
    for (word = ~bits[at >> 6] & ~(uint64_t)0 << (at & 63); !word; word = ~bits[at >> 6]) {
        at = (at | 63) + 1;
        if (at >= n)
            break;
    }
    at = at >= n ? n : (at & ~(int64_t)63) + __builtin_ctzll(word);
    *end = at < n ? at : n;
    return 1;
}

/* Sets the bits [begin, end). */
TL_INLINE void set_bits(uint64_t *bits, int64_t begin, int64_t end)
{
    if (begin >= end)
        return;
    const uint64_t head = ~(uint64_t)0 << (begin & 63), tail = ~(uint64_t)0 >> (63 - ((end - 1) & 63));
    const int64_t a = begin >> 6, b = (end - 1) >> 6;
    if (a == b) {
        bits[a] |= head & tail;
        return;
    }
    bits[a] |= head;
    for (int64_t k = a + 1; k < b; k++)
        bits[k] = ~(uint64_t)0;
    bits[b] |= tail;
}

#endif
