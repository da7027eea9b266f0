/* Pieces: the exact share of each pixel that lies in a polygon with rings that may cross, touch or cover each other.
 * In: rings.  Out: a row of shares, float64, at a time.
 *
 * Edges are cut at the rows, and each pixel is resolved from the pieces that reach into it (slabs.c).  Edges left of it
 * count only as winding numbers.  A pixel's share depends on the edges, not on the window: ends of pieces are quotients
 * of integers, each rounded once, relative to the pixel. */
#ifndef TL_POLYGON_PIECES_C
#define TL_POLYGON_PIECES_C

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/sort_pairs.h"
#include "lanes/lanes.h"
#include "vertex/fixed.h"
#include "polygons/points.c"
#include "polygons/polygons.h"
#include "polygons/slabs.c"

/* Cuts edges at the rows [top, bottom); with pieces = NULL only counts the pieces of each row. */
TL_INLINE void cut_edges(const tl_polygons *p, int is_wide, int64_t polygon, int64_t top, int64_t bottom, int64_t *next,
                         tl_edge_piece *pieces)
{
    const int bits = p->bits;
    const int64_t unit = (int64_t)1 << bits;
    const double pixel = 1.0 / (double)unit;
    for (int64_t ring = p->polygons[polygon]; ring < p->polygons[polygon + 1]; ring++) {
        const int64_t first = p->rings[ring], end = p->rings[ring + 1];
        for (int64_t i = first; i < end; i++) {
            const int64_t j = i + 1 < end ? i + 1 : first, ya = polygon_y(p, is_wide, i), yb = polygon_y(p, is_wide, j);
            if (ya == yb)
                continue;
            const int sign = ya < yb ? 1 : -1;
            const int64_t y0 = sign > 0 ? ya : yb, y1 = sign > 0 ? yb : ya;
            int64_t row = y0 >> bits, last = (y1 - 1) >> bits;
            row = row < top ? top : row, last = last >= bottom ? bottom - 1 : last;
            if (!pieces) {
                for (; row <= last; row++)
                    next[row - top]++;
                continue;
            }
            const int64_t x0 = polygon_x(p, is_wide, sign > 0 ? i : j),
                          dx = polygon_x(p, is_wide, sign > 0 ? j : i) - x0, dy = y1 - y0;
            for (; row <= last; row++) {
                tl_edge_piece *out = pieces + next[row - top]++;
                const int64_t t = row * unit - y0, ta = t > 0 ? t : 0, tb = t + unit < dy ? t + unit : dy;
                int64_t column;
                double left, length;
                if (is_wide) {
                    const tl_int128 d = i128_product(dy, unit);
                    tl_int128 q, rest;
                    i128_floor_divide(i128_add(i128_product(x0 & (unit - 1), dy), i128_product(ta, dx)), d, &q, &rest);
                    column = i128_low(q), left = i128_to_f64(rest) / i128_to_f64(d);
                    length = i128_to_f64(i128_product(tb - ta, dx)) / i128_to_f64(d);
                } else {
                    const int64_t d = dy * unit, x = (x0 & (unit - 1)) * dy + ta * dx, q = x / d - (x % d < 0);
                    column = q, left = (double)(x - q * d) / (double)d;
                    length = (double)((tb - ta) * dx) / (double)d;
                }
                out->x = left, out->length = length, out->slope = (double)dx / (double)dy;
                out->col = (x0 >> bits) + column;
                out->ta = (int32_t)(ta - t), out->tb = (int32_t)(tb - t);
                out->ya = (double)out->ta * pixel, out->yb = (double)out->tb * pixel;
                out->sign = sign;
            }
        }
    }
}

/* Adds a change of the winding number left of the pixel at height t. */
static void note_change(piece_row *w, int32_t t, int32_t change)
{
    int k = w->n_changes;
    while (k > 0 && w->at[k - 1] > t)
        k--;
    if (k > 0 && w->at[k - 1] == t) {
        w->change[k - 1] += change;
        if (w->change[k - 1] == 0) {
            memmove(w->at + k - 1, w->at + k, sizeof *w->at * (size_t)(w->n_changes - k));
            memmove(w->change + k - 1, w->change + k, sizeof *w->change * (size_t)(w->n_changes - k));
            w->n_changes--;
        }
        return;
    }
    memmove(w->at + k + 1, w->at + k, sizeof *w->at * (size_t)(w->n_changes - k));
    memmove(w->change + k + 1, w->change + k, sizeof *w->change * (size_t)(w->n_changes - k));
    w->at[k] = t, w->change[k] = change;
    w->n_changes++;
}

static void note_left(piece_row *w, const tl_edge_piece *e)
{
    note_change(w, e->ta, e->sign);
    note_change(w, e->tb, -e->sign);
}

/* Sets the shares of the columns of a polygon's box in a row from its n pieces: shares[column - box->left]. */
static void resolve_row(const tl_polygons *p, int64_t polygon, const tl_edge_piece *pieces, int64_t n,
                        const tl_polygon_box *box, const tl_piece_scratch *scratch, double *shares)
{
    const int64_t left = box->left, right = box->right;
    int64_t *room = scratch->room;
    const int64_t n_room = scratch->n_pieces;
    keyed *pairs = (keyed *)room, *other = pairs + n_room;
    piece_row w = {.p = p, .pieces = pieces, .pixel = 1.0 / (double)((int64_t)1 << p->bits)};
    w.is_nonzero = p->is_nonzero[polygon];
    room += 4 * n_room;
    w.events = (keyed *)room, w.spare = w.events + 3 * n_room, room += 12 * n_room;
    w.edges = (slab_edge *)room, w.moved = w.edges + n_room, room += 8 * n_room;
    w.crossings = (double *)room, room += 4 * n_room;
    w.at = (int32_t *)room, w.change = w.at + 2 * n_room, room += 2 * n_room;
    w.active = (int32_t *)room;
    for (int64_t k = 0; k < n; k++) {
        const double low = pieces[k].length < 0 ? pieces[k].x + pieces[k].length : pieces[k].x;
        pairs[k] = (keyed){pieces[k].col + (int64_t)floor(low), k};
    }
    pairs = sort_pairs(pairs, other, n);
    int64_t taken = 0;
    for (int64_t col = left; col < right && !w.is_given_up;) {
        int n_kept = 0;
        for (; taken < n && pairs[taken].key <= col; taken++)
            w.active[w.n_active++] = (int32_t)pairs[taken].i;
        for (int k = 0; k < w.n_active; k++) {
            const tl_edge_piece *e = pieces + w.active[k];
            const double high = e->length < 0 ? e->x : e->x + e->length;
            if (e->col + (int64_t)ceil(high) <= col)
                note_left(&w, e);
            else
                w.active[n_kept++] = w.active[k];
        }
        w.n_active = n_kept;
        if (w.n_active) {
            shares[col - left] = resolve_pixel(&w, col);
            col++;
            continue;
        }
        /* only level edges until the next piece: winding numbers decide */
        const int64_t end = taken < n && pairs[taken].key < right ? pairs[taken].key : right;
        const double share = resolve_pixel(&w, col);
        for (; col < end; col++)
            shares[col - left] = share;
    }
    count_crossings(&w);
}

/* Receives a row of shares of the columns [left, right). */
typedef void (*take_shares)(void *to, int64_t row, int64_t left, int64_t right, const double *shares);

/* Resolves the rows [top, bottom) of a polygon within its box. */
static void resolve_polygon(const tl_polygons *p, int64_t polygon, const tl_polygon_box *box, int64_t top,
                            int64_t bottom, const tl_piece_scratch *scratch, take_shares take, void *to)
{
    int64_t *starts = scratch->row_starts;
    for (int64_t k = 0; k < bottom - top; k++)
        starts[k] = 0;
    if (p->is_wide[polygon])
        cut_edges(p, 1, polygon, top, bottom, starts, NULL);
    else
        cut_edges(p, 0, polygon, top, bottom, starts, NULL);
    for (int64_t first = top, end = top; first < bottom; first = end) { /* as many rows as their pieces have room */
        int64_t n = 0;
        for (; end < bottom && n + starts[end - top] <= scratch->n_pieces; end++) {
            const int64_t count = starts[end - top];
            starts[end - top] = n;
            n += count;
        }
        if (p->is_wide[polygon])
            cut_edges(p, 1, polygon, first, end, starts + (first - top), scratch->pieces);
        else
            cut_edges(p, 0, polygon, first, end, starts + (first - top), scratch->pieces);
        int64_t begin = 0;
        for (int64_t row = first; row < end; row++) {
            const int64_t row_end = starts[row - top];
            if (is_polygon_given_up(p, 16 * (row_end - begin) + box->right - box->left) || cross_too_often(p))
                return;
            resolve_row(p, polygon, scratch->pieces + begin, row_end - begin, box, scratch, scratch->shares);
            take(to, row, box->left, box->right, scratch->shares);
            begin = row_end;
        }
    }
}

#endif
