/* Instances: the instance that each pixel shows, the box of pixels of each, and the columns of each in a span.
 * In: ids that count the triangles of all instances.  Out: indices of instances, boxes; for each instance visible in a
 * span the columns from its first to its last pixel.
 *
 * The instances of a span are processed one by one, each in its columns; columns where instances alternate are
 * processed once for each of them. */
#ifndef TL_INSTANCES_C
#define TL_INSTANCES_C

#include <stdint.h>

#include "topleft.h"
#include "lanes/lanes.h"
#include "pixels/runs.c"
#include "pixels/shading.h"

/* The last of n instances with a first id <= `id`, or the first instance; first_ids, or NULL to read `instances`. */
TL_INLINE int64_t last_begun(const int64_t *first_ids, const tl_shaded *instances, int64_t n, int64_t id)
{
    int64_t low = 0, high = n;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if ((first_ids ? first_ids[middle] : instances[middle].first_id) <= id)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void find_instances(const int32_t *ids, int64_t n_rows, int64_t width, const int64_t *first_ids, int64_t n,
                           int32_t *out, int32_t *boxes)
{
    int64_t first = 0, end = -1, found = -1; /* the ids of instance `found` */
    for (int64_t row = 0; row < n_rows; row++, ids += width, out += width)
        for (int64_t col = 0; col < width;) {
            const int64_t begin = col;
            if (ids[col] < 0) {
                while (col < width && ids[col] < 0)
                    out[col++] = -1;
                continue;
            }
            if (ids[col] < first || ids[col] >= end) {
                found = ids[col] < first_ids[n] ? last_begun(first_ids, NULL, n, ids[col]) : n;
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

typedef struct {
    const tl_shaded *instance;
    int first, end; /* columns of the span */
} span_part;

typedef struct {
    const tl_shaded_scene *scene;
    const tl_shaded *last, *set; /* the instance found last; the instance that runs are set for */
    tl_snapped seen;             /* the mesh of `set`, for the sample that is shaded */
    int n;
    span_part parts[TL_SPAN];
} span_list;

static void start_list(span_list *list, const tl_shaded_scene *scene)
{
    list->scene = scene, list->last = scene->instances, list->set = NULL;
}

/* The first column from x on with an id outside [low, high]; n if there is none. */
TL_INLINE int end_of_ids(const int32_t *ids, int x, int n, int32_t low, int32_t high)
{
    for (; x < n; x += TL_LANES) {
        const vm inside = vm_first(n - x);
        const vi id = vi_load_masked(inside, ids + x);
        const vm others = vm_and(inside, vm_or(vi_gt(vi_set1(low), id), vi_gt(id, vi_set1(high))));
        if (vm_any(others))
            return x + __builtin_ctz(vm_bits(others));
    }
    return n;
}

/* Adds columns [first, end) to the part of an instance. */
static void note_part(span_list *list, const tl_shaded *instance, int first, int end)
{
    int k = list->n - 1;
    while (k >= 0 && list->parts[k].instance != instance)
        k--;
    if (k < 0) {
        k = list->n++;
        list->parts[k].instance = instance, list->parts[k].first = first;
    }
    list->parts[k].end = end;
}

/* Lists the instances of n ids. */
TL_ONCE void list_instances(span_list *list, const int32_t *ids, int n)
{
    list->n = 0;
    if (list->scene->n == 1) {
        note_part(list, list->scene->instances, 0, n);
        return;
    }
    for (int x = 0; x < n;) {
        const int32_t id = ids[x];
        const tl_shaded *own = list->last;
        if (id < 0) {
            x = end_of_ids(ids, x, n, INT32_MIN, -1);
            continue;
        }
        if (id < own->first_id || id - own->first_id >= own->snapped->n_triangles)
            list->last = own = list->scene->instances + last_begun(NULL, list->scene->instances, list->scene->n, id);
        const int32_t end = own->first_id + (int32_t)own->snapped->n_triangles - 1;
        const int first = x;
        if (id < own->first_id || id > end) { /* of no instance */
            x++;
            continue;
        }
        x = end_of_ids(ids, x, n, own->first_id, end);
        note_part(list, own, first, x);
    }
}

#endif
