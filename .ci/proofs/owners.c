/* Looks at every edge and triangle of small grids, by the code of raster/walk.h and raster/triangles_fixed.c beside the
 * definition: a sample is covered where all edge functions are positive, or zero on an edge that is top or left; a square
 * is met where it has some area in common with the triangle, and held where all of its corners lie in it. */
#include <stdio.h>
#include <stdlib.h>

#include "topleft.h"
#include "raster/single_fixed.c"
#include "raster/triangles_fixed.c"

enum { MOST = 9 }; /* points along an axis */

static void fail(const char *what)
{
    printf("%s: a value is wrong\n", what);
    exit(1);
}

static int64_t edge_at(int64_t ax, int64_t ay, int64_t bx, int64_t by, int64_t px, int64_t py)
{
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax);
}

/* Whether the edge from a to b owns p, all in doubled units. */
static int owns(int64_t ax, int64_t ay, int64_t bx, int64_t by, int64_t px, int64_t py)
{
    const int64_t e = edge_at(ax, ay, bx, by, px, py);
    const int is_left = by < ay, is_top = by == ay && bx > ax;
    return e > 0 || (e == 0 && (is_left || is_top));
}

/* The least signs of the edge functions of a set-up triangle at a pixel, by integers of 64 and 128 bits and by lanes. */
static int is_inside(const tl_triangle *t, const tl_window *window, int64_t col, int64_t row)
{
    const edges_64 e = setup_edges_64(t, window);
    const edges_128 wide = setup_edges_128(t, window);
    const int bits = window->subpixel_bits;
    lane_triangles lanes;
    int inside = 1, inside_wide = 1, inside_lanes = 1;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        lanes.x[k] = vi_set1((int32_t)(2 * t->x_fx[k] - ((2 * (col + window->x_px) + 1) << bits)));
        lanes.y[k] = vi_set1((int32_t)(2 * t->y_fx[k] - ((2 * (row + window->y_px) + 1) << bits)));
        lanes.dx[k] = vi_set1((int32_t)(t->x_fx[next] - t->x_fx[k]));
        lanes.dy[k] = vi_set1((int32_t)(t->y_fx[next] - t->y_fx[k]));
    }
    setup_edges_lanes(&lanes, window, window->test == TL_TEST_SAMPLE ? TL_SINK_LABEL : TL_SINK_MASK);
    for (int k = 0; k < 3; k++) {
        const int64_t x = col - t->col0, y = row - t->row0;
        inside &= e.value[k] - e.dy[k] * x + e.dx[k] * y >= 0;
        inside_wide &= !i128_is_negative(
            i128_add(i128_sub(wide.value[k], i128_times(wide.dy[k], x)), i128_times(wide.dx[k], y)));
        inside_lanes &= !vm_any(vi_gt(vi_set1(0), lanes.e[k]));
    }
    if (inside != inside_wide || inside != inside_lanes)
        fail("integers of 32, 64 and 128 bits");
    return inside;
}

/* The area that a triangle and a square have in common, clipped side by side. */
static double common_area(const tl_triangle *t, const double *low, double side)
{
    double in[16][2], out[16][2], area = 0.0;
    int n = 3;
    for (int k = 0; k < 3; k++)
        in[k][0] = (double)t->x_fx[k], in[k][1] = (double)t->y_fx[k];
    for (int border = 0; border < 4; border++) {
        const int axis = border & 1;
        const double sign = border < 2 ? 1.0 : -1.0, at = border < 2 ? low[axis] : low[axis] + side;
        int m = 0;
        for (int k = 0; k < n; k++) {
            const double *a = in[k], *b = in[(k + 1) % n], da = sign * (a[axis] - at), db = sign * (b[axis] - at);
            if (da >= 0.0)
                out[m][0] = a[0], out[m][1] = a[1], m++;
            if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
                out[m][0] = a[0] + (b[0] - a[0]) * (da / (da - db));
                out[m][1] = a[1] + (b[1] - a[1]) * (da / (da - db)), m++;
            }
        }
        n = m;
        for (int k = 0; k < n; k++)
            in[k][0] = out[k][0], in[k][1] = out[k][1];
    }
    for (int k = 0; k < n; k++)
        area += in[k][0] * in[(k + 1) % n][1] - in[k][1] * in[(k + 1) % n][0];
    return 0.5 * area;
}

static int expected(const tl_triangle *t, const tl_window *window, int64_t col, int64_t row)
{
    const int64_t unit = (int64_t)1 << window->subpixel_bits;
    if (window->test == TL_TEST_OUTER) /* areas are multiples of a fraction whose denominator is small */
        return common_area(t, (const double[2]){(double)(col * unit), (double)(row * unit)}, (double)unit) > 1e-6;
    int all = 1;
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        const int64_t ax = 2 * t->x_fx[k], ay = 2 * t->y_fx[k], bx = 2 * t->x_fx[next], by = 2 * t->y_fx[next];
        if (window->test == TL_TEST_SAMPLE)
            all &= owns(ax, ay, bx, by, (2 * col + 1) * unit, (2 * row + 1) * unit);
        else
            for (int corner = 0; corner < 4; corner++)
                all &= edge_at(ax, ay, bx, by, 2 * (col + (corner & 1)) * unit, 2 * (row + (corner >> 1)) * unit) >= 0;
    }
    return all;
}

/* All triangles of n x n points, 2^-bits px apart. */
static void look_at_triangles(int n, int bits, tl_test test)
{
    const int n_px = (n >> bits) + 1;
    const tl_window window = {.width = n_px, .height = n_px, .subpixel_bits = bits, .test = test};
    const int n_points = n * n;
    for (int i = 0; i < n_points * n_points * n_points; i++) {
        const int corner[3] = {i % n_points, i / n_points % n_points, i / n_points / n_points};
        tl_triangle t = {.is_narrow = 1};
        for (int k = 0; k < 3; k++)
            t.x_fx[k] = corner[k] % n, t.y_fx[k] = corner[k] / n;
        if (area_sign(&t) <= 0)
            continue;
        const int has_box = clip_box(&t, &window);
        for (int64_t row = 0; row < n_px; row++)
            for (int64_t col = 0; col < n_px; col++) {
                const int in_box = has_box && col >= t.col0 && col < t.col1 && row >= t.row0 && row < t.row1;
                if ((in_box && is_inside(&t, &window, col, row)) != expected(&t, &window, col, row))
                    fail(test == TL_TEST_SAMPLE ? "samples" : "squares");
            }
    }
}

/* All pairs of directions from a hub on a sample: a full turn of three triangles has one owner of it. */
static void look_at_hubs(int reach)
{
    const tl_window window = {.width = 1, .height = 1, .subpixel_bits = 1, .test = TL_TEST_SAMPLE};
    const int n = 2 * reach + 1, n_points = n * n;
    for (int i = 0; i < n_points * n_points * n_points; i++) {
        const int end[3] = {i % n_points, i / n_points % n_points, i / n_points / n_points};
        int n_owners = 0, is_fan = 1;
        for (int k = 0; k < 3 && is_fan; k++) {
            const int a = end[k], b = end[k == 2 ? 0 : k + 1];
            tl_triangle t = {.is_narrow = 1, .x_fx = {1, 1 + a % n - reach, 1 + b % n - reach},
                             .y_fx = {1, 1 + a / n - reach, 1 + b / n - reach}};
            is_fan = area_sign(&t) > 0;
            n_owners += is_fan && is_inside(&t, &window, 0, 0);
        }
        if (is_fan && n_owners != 1)
            fail("owners of a hub");
    }
}

int main(void)
{
    for (int test = TL_TEST_SAMPLE; test <= TL_TEST_INNER; test++) {
        look_at_triangles(5, 0, (tl_test)test);
        look_at_triangles(6, 1, (tl_test)test);
        look_at_triangles(MOST, 2, (tl_test)test);
    }
    look_at_hubs(3);
    return 0;
}
