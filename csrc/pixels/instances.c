/* Instances: which instance each pixel shows, and the rectangle of pixels round each.
 * In: ids that count the triangles of all instances.  Out: indices of instances, boxes. */
#ifndef TL_INSTANCES_C
#define TL_INSTANCES_C

#include <stdint.h>

#include "topleft.h"

/* The last of n instances with a first id not above `id`; n where no instance has it. */
static int64_t instance_of(const int64_t *first_ids, int64_t n, int64_t id)
{
    int64_t low = 0, high = n;
    if (id >= first_ids[n])
        return n;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (first_ids[middle] <= id)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Writes the instance of each of n_rows of `width` ids, -1 where an id is below 0; instance i has the ids from
 * first_ids[i] on to first_ids[i + 1].  With boxes, (n, 4): left, top, right, bottom, those of instances that show are
 * widened to hold their pixels. */
static void find_instances(const int32_t *ids, int64_t n_rows, int64_t width, const int64_t *first_ids, int64_t n,
                           int32_t *out, int32_t *boxes)
{
    int64_t first = 0, end = -1, found = -1; /* the ids of the last instance found */
    for (int64_t row = 0; row < n_rows; row++, ids += width, out += width)
        for (int64_t col = 0; col < width;) {
            const int64_t begin = col;
            if (ids[col] < 0) {
                while (col < width && ids[col] < 0)
                    out[col++] = -1;
                continue;
            }
            if (ids[col] < first || ids[col] >= end) {
                found = instance_of(first_ids, n, ids[col]);
                first = first_ids[found], end = found < n ? first_ids[found + 1] : (int64_t)1 << 31;
            }
            while (col < width && ids[col] >= first && ids[col] < end)
                out[col++] = (int32_t)found;
            if (!boxes || found == n)
                continue;
            int32_t *box = boxes + 4 * found;
            box[0] = begin < box[0] ? (int32_t)begin : box[0];
            box[1] = row < box[1] ? (int32_t)row : box[1];
            box[2] = col > box[2] ? (int32_t)col : box[2];
            box[3] = row + 1 > box[3] ? (int32_t)row + 1 : box[3];
        }
}

#endif
