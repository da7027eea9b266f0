/* Access to the numbers of tensors, the visible pixels of a band by runs, and sums by row.
 *
 * It is plain C: sums have one order, and every instruction set gives equal bits. */
#ifndef TL_GRAD_PIXELS_H
#define TL_GRAD_PIXELS_H

#include <stdint.h>
#include <string.h>

#include "topleft.h"
#include "lanes/inline.h"
#include "grad/grad.h"

/* Bits of `outline` of a triangle; -1: it does not exist. */
enum {
    TL_SILHOUETTES = 7, /* bit k: the edge opposite to corner k is a silhouette */
    TL_SIDE_SHIFT = 3,
    TL_SIDES = 3 << TL_SIDE_SHIFT, /* 1: front, 2: back, 0: neither */
    TL_IS_AHEAD = 32,              /* all of its corners have w > 0 */
};

#define TL_LAST_EXACT_ID (1 << 24) /* float32 counts exactly up to it; larger ids are stored in its bits */
#define TL_BITS_OF_LAST 0x4B800000

TL_INLINE double get_real(const void *p, int64_t i, int is_f64)
{
    return is_f64 ? ((const double *)p)[i] : (double)((const float *)p)[i];
}

TL_INLINE void put_real(void *p, int64_t i, double value, int is_f64)
{
    if (is_f64)
        ((double *)p)[i] = value;
    else
        ((float *)p)[i] = (float)value;
}

/* A key that is equal for equal triangles: the bits of float32, or a float64 as an integer. */
TL_INLINE int32_t get_label(const void *rast, int64_t pixel, int is_f64)
{
    if (is_f64) {
        const double id = ((const double *)rast)[4 * pixel + 3];
        return id >= 1.0 ? id < 0x1p31 ? (int32_t)id : INT32_MAX : 0;
    }
    int32_t bits;
    memcpy(&bits, (const float *)rast + 4 * pixel + 3, sizeof bits);
    return bits;
}

/* The id of the triangle, -1 for none. */
TL_INLINE int32_t id_of_label(int32_t label, int is_f64)
{
    float id;
    if (is_f64)
        return label - 1;
    memcpy(&id, &label, sizeof id);
    if (!(id >= 1.0f))
        return -1;
    return id <= TL_LAST_EXACT_ID ? (int32_t)id - 1 : label - TL_BITS_OF_LAST + TL_LAST_EXACT_ID - 1;
}

TL_INLINE void put_id(void *rast, int64_t pixel, int32_t id, int is_f64)
{
    if (is_f64 || id < TL_LAST_EXACT_ID) {
        put_real(rast, 4 * pixel + 3, (double)id + 1.0, is_f64);
        return;
    }
    const int32_t bits = id + 1 - TL_LAST_EXACT_ID + TL_BITS_OF_LAST;
    memcpy((float *)rast + 4 * pixel + 3, &bits, sizeof bits);
}

/* Whether a triangle and its corners exist: checked again, because arrays may have changed since the check. */
TL_INLINE int has_corners(const tl_grad_view *view, int64_t n_rows, int32_t id)
{
    if (id < 0 || id >= view->n_triangles)
        return 0;
    const int32_t *c = view->tri + 3 * (int64_t)id;
    const uint64_t n = (uint64_t)n_rows;
    return (uint64_t)(int64_t)c[0] < n && (uint64_t)(int64_t)c[1] < n && (uint64_t)(int64_t)c[2] < n;
}

/* Pixels of a row that show one triangle. */
typedef struct {
    int32_t id;
    int64_t row, column, at, n; /* `at`: the first pixel's number in the picture */
    int64_t bad_id;             /* an id that is no triangle's; -1: none so far */
} pixel_run;

TL_INLINE pixel_run before_shown(const tl_grad_view *view)
{
    return (pixel_run){.id = -1, .row = view->first_row, .bad_id = -1};
}

/* Steps to the next pixels of `rast` whose triangle has rows below n_rows; 0 at the end. */
TL_INLINE int next_shown(const tl_grad_view *view, const void *rast, int64_t n_rows, pixel_run *run, int is_f64)
{
    int64_t column = run->column + run->n, row = run->row;
    for (; row < view->end_row; row++, column = 0) {
        const int64_t first = row * view->width;
        while (column < view->width) {
            const int32_t label = get_label(rast, first + column, is_f64);
            const int64_t begin = column++;
            if (!label)
                continue;
            while (column < view->width && get_label(rast, first + column, is_f64) == label)
                column++;
            const int32_t id = id_of_label(label, is_f64);
            if (id < 0)
                continue;
            if (id == run->id || has_corners(view, n_rows, id)) {
                run->id = id, run->row = row, run->column = begin, run->at = first + begin, run->n = column - begin;
                return 1;
            }
            run->bad_id = id;
        }
    }
    return 0;
}

/* Clears the rows of a band of a tensor with n numbers a pixel. */
TL_INLINE void clear_band(const tl_grad_view *view, void *out, int64_t n)
{
    const size_t size = (size_t)((view->is_f64 ? 8 : 4) * n * view->width);
    if (out)
        memset((char *)out + size * (size_t)view->first_row, 0, size * (size_t)(view->end_row - view->first_row));
}

/* The sums of a row; a new row starts at 0. */
TL_INLINE double *sums_of(tl_grad_sums *sums, int64_t row)
{
    int32_t slot = sums->slot_of[row];
    if (slot < 0) {
        slot = sums->slot_of[row] = (int32_t)sums->n++;
        sums->rows[slot] = (int32_t)row;
        if (sums->n_columns == 4) /* without a call */
            memset(sums->sums + 4 * (int64_t)slot, 0, 4 * sizeof(double));
        else if (sums->n_columns == 8)
            memset(sums->sums + 8 * (int64_t)slot, 0, 8 * sizeof(double));
        else
            memset(sums->sums + slot * sums->n_columns, 0, (size_t)sums->n_columns * sizeof(double));
    }
    return sums->sums + slot * sums->n_columns;
}

/* The sums of the three corners of a triangle. */
TL_INLINE void corner_sums(const tl_grad_view *view, tl_grad_sums *sums, int32_t id, double **out)
{
    for (int k = 0; k < 3; k++)
        out[k] = sums_of(sums, view->tri[3 * (int64_t)id + k]);
}

/* Ends a band: clears slot_of of its rows. */
TL_INLINE void flush_band(tl_grad_sums *sums)
{
    for (int64_t i = 0; i < sums->n; i++)
        sums->slot_of[sums->rows[i]] = -1;
}

/* Ends a band and drops its sums. */
TL_INLINE void reset_band(tl_grad_sums *sums)
{
    flush_band(sums);
    sums->n = 0;
}

TL_INLINE int32_t clamped_to_int(int64_t a) { return a < INT32_MAX ? (int32_t)a : INT32_MAX; }

TL_INLINE double clamped(double a, double low, double high) { return a < low ? low : a > high ? high : a; }

#endif
