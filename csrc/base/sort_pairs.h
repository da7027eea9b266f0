/* A stable sort of keys with numbers, and keys along a curve through the plane. */
#ifndef TL_SORT_PAIRS_H
#define TL_SORT_PAIRS_H

#include <stdint.h>

typedef struct {
    int64_t key, i;
} keyed;

/* Sorts n pairs by key, stable: runs by insertion, then merges between `a` and `room`.  Returns the one of the two that
 * holds the result. */
static keyed *sort_pairs(keyed *a, keyed *room, int64_t n)
{
    const int64_t run = 16;
    for (int64_t first = 0; first < n; first += run)
        for (int64_t i = first + 1; i < n && i < first + run; i++) {
            const keyed x = a[i];
            int64_t j = i;
            for (; j > first && a[j - 1].key > x.key; j--)
                a[j] = a[j - 1];
            a[j] = x;
        }
    for (int64_t size = run; size < n; size *= 2) {
        for (int64_t first = 0; first < n; first += 2 * size) {
            const int64_t middle = first + size < n ? first + size : n,
                          end = first + 2 * size < n ? first + 2 * size : n;
            int64_t i = first, j = middle;
            for (int64_t k = first; k < end; k++)
                room[k] = j >= end || (i < middle && a[i].key <= a[j].key) ? a[i++] : a[j++];
        }
        keyed *const other = a;
        a = room, room = other;
    }
    return a;
}

/* A number below 2^16 with a zero between its bits. */
static inline int64_t interleave_zeros(int64_t a)
{
    a = (a | a << 8) & 0x00ff00ff, a = (a | a << 4) & 0x0f0f0f0f;
    a = (a | a << 2) & 0x33333333, a = (a | a << 1) & 0x55555555;
    return a;
}

#endif
