/* Draws seeded scenes through one kernel table and prints a hash of every buffer: whatever compiles the kernels, for
 * whatever processor, has to print the same lines.  `.ci/portable` compiles and compares.
 *
 * No Python: the program also runs where there is none, in WebAssembly or under an emulator. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dispatch.h"

#ifdef _WIN32 /* where C11's names are not */
#include <malloc.h>
#define aligned_alloc(alignment, n) _aligned_malloc(n, alignment)
#define free _aligned_free
#endif

#ifndef TL_KERNELS
#define TL_KERNELS tl_kernels_scalar
#endif
extern const tl_kernels TL_KERNELS;

enum { WIDTH = 193, HEIGHT = 131, N_PX = WIDTH * HEIGHT, SPARE = 1024, MOST = 3000 };

static const tl_kernels *const k = &TL_KERNELS;

/* ---- numbers that every machine makes alike ------------------------------------------------------------- */

static uint64_t state;

static double uniform(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(state >> 12) * 0x1p-52);
}

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++)
        hash = (hash ^ ((const uint8_t *)bytes)[i]) * 0x100000001b3u;
    return hash;
}

static uint64_t total = 0xcbf29ce484222325u;

static void tell(const char *scene, const char *what, const void *bytes, size_t n)
{
    const uint64_t hash = hash_bytes(0xcbf29ce484222325u, bytes, n);
    total = hash_bytes(total, &hash, sizeof hash);
    printf("%s %s %016" PRIx64 "\n", scene, what, hash);
}

static void *room_for(size_t n)
{
    void *p = aligned_alloc(64, (n + SPARE + 63) / 64 * 64);
    if (!p)
        exit(2);
    return memset(p, 0, n + SPARE);
}

/* ---- buffers, shared by all scenes ---------------------------------------------------------------------- */

static uint8_t *bytes;
static int32_t *ids, *cells;
static int64_t *wide_cells;
static float *depth, *floats;
static uint64_t *covered;

static void make_buffers(void)
{
    const int64_t stride = tl_area_stride(WIDTH), strip = tl_blend_cells(WIDTH);
    bytes = room_for(4 * N_PX), ids = room_for(4 * N_PX), depth = room_for(4 * N_PX), floats = room_for(12 * N_PX);
    covered = room_for(8 * HEIGHT * (size_t)tl_covered_words(WIDTH * 16));
    cells = room_for(4 * (size_t)(stride * HEIGHT > strip ? stride * HEIGHT : strip));
    wide_cells = room_for(8 * (size_t)stride * HEIGHT);
    for (int64_t i = 0; i < (stride * HEIGHT > strip ? stride * HEIGHT : strip); i++)
        cells[i] = TL_CELL_CLEAR;
}

/* ---- what is drawn of a scene --------------------------------------------------------------------------- */

static void draw(const tl_snapped *scene, const tl_window *window, tl_target target, const char *name, const char *what,
                 int with_depth)
{
    tl_slice slice = {.end = scene->n_triangles, .is_first = 1, .is_last = 1};
    const int is_mask = target.sink == TL_SINK_MASK, is_share = target.sink == TL_SINK_SAMPLES;
    target.pixels = is_mask ? (void *)bytes : is_share ? (void *)floats : (void *)ids;
    target.depth = with_depth ? depth : NULL, target.stride_px = WIDTH;
    target.covered = is_mask || is_share ? covered : NULL;
    char row[64];
    if (k->draw_mesh(scene, window, &target, &slice) >= 0)
        exit(3);
    snprintf(row, sizeof row, "%s%s", what, with_depth ? " ids" : "");
    tell(name, row, target.pixels, is_mask ? N_PX : 4 * N_PX);
    if (with_depth) {
        snprintf(row, sizeof row, "%s depth", what);
        tell(name, row, depth, 4 * N_PX);
    }
}

static void draw_all(tl_snapped *scene, tl_window *window, const char *name)
{
    static const char *const METHODS[] = {"auto", "edge", "scanline"};
    static const int32_t GRID[4][2] = {{-32, -96}, {96, -32}, {-96, 32}, {32, 96}};
    char what[64];
    for (int method = 0; method < 3; method++) {
        scene->method = (tl_method)method;
        for (int sink = TL_SINK_MASK; sink <= TL_SINK_FARTHEST; sink++) {
            snprintf(what, sizeof what, "%s %d", METHODS[method], sink);
            draw(scene, window, (tl_target){.sink = (tl_sink)sink}, name, what, sink >= TL_SINK_PAINT);
        }
    }
    scene->method = TL_METHOD_AUTO;
    draw(scene, window, (tl_target){.sink = TL_SINK_SAMPLES, .sample_bits = 2, .samples_fx = GRID[0]}, name, "samples",
         0);
    for (tl_test test = TL_TEST_OUTER; test <= TL_TEST_INNER; test++) {
        window->test = test;
        draw(scene, window, (tl_target){.sink = TL_SINK_MASK}, name, test == TL_TEST_OUTER ? "outer" : "inner", 0);
    }
    window->test = TL_TEST_SAMPLE;
}

static void draw_values(const tl_snapped *scene, const tl_window *window, const char *name)
{
    const tl_slice whole = {.end = scene->n_triangles, .is_first = 1, .is_last = 1};
    tl_slice slice = whole;
    k->draw_mesh(scene, window, &(tl_target){.sink = TL_SINK_NEAREST, .pixels = ids, .depth = depth, .stride_px = WIDTH},
            &slice);
    k->barycentric(scene, window, ids, floats);
    tell(name, "barycentric", floats, 12 * N_PX);

    tl_area area = {.pixels = floats, .stride_px = WIDTH, .cells = cells};
    int64_t status = k->draw_area(scene, window, &whole, &area);
    if (status == TL_AREA_OVERFLOW) {
        const int64_t n = tl_area_stride(WIDTH) * HEIGHT;
        for (int64_t i = 0; i < n; i++)
            cells[i] = TL_CELL_CLEAR;
        area.cells = wide_cells, area.is_wide = 1, status = k->draw_area(scene, window, &whole, &area);
    }
    if (status < 0)
        tell(name, "area", floats, 4 * N_PX);

    static uint8_t colors[4 * MOST];
    for (size_t i = 0; i < sizeof colors; i++)
        colors[i] = (uint8_t)uniform(0, 255.99);
    static const uint8_t GROUND[4] = {30, 60, 90, 200};
    for (int is_area = 0; is_area < 2; is_area++)
        for (tl_blend blend = TL_BLEND_REPLACE; blend <= TL_BLEND_MIN; blend++) {
            char what[64];
            snprintf(what, sizeof what, "blend %d%s", (int)blend, is_area ? " area" : "");
            const tl_canvas canvas = {.pixels = bytes,
                                      .stride_px = WIDTH,
                                      .colors = colors,
                                      .n_channels = 4,
                                      .is_u8 = 1,
                                      .is_flat = 1,
                                      .blend = blend,
                                      .ground = GROUND,
                                      .is_area = is_area,
                                      .band_rows = 37,
                                      .cells = cells};
            k->blend(scene, window, &canvas);
            tell(name, what, bytes, 4 * N_PX);
        }
}

static void draw_scene(const char *name, const tl_source *source, const tl_view *view, int n_triangles)
{
    static int32_t triangles[3 * MOST];
    tl_vertex *vertices = room_for((size_t)source->n * sizeof *vertices);
    tl_wide *wide = room_for((size_t)source->n * sizeof *wide);
    tl_pieces pieces = {0};
    for (int i = 0; i < 3 * n_triangles; i++)
        triangles[i] = i;
    const tl_projected projected = {.records = vertices, .wide = wide};
    const tl_vertex_counts counts = view ? k->project(source, 0, source->n, view, &projected)
                                         : k->snap(source, 0, source->n, 8, 1, vertices, wide);
    if (counts.n_clipped)
        k->clip(source, &projected, triangles, NULL, n_triangles, view, &pieces);
    if (pieces.n_pieces) {
        pieces.vertices = room_for((size_t)pieces.n_vertices * sizeof *pieces.vertices);
        pieces.wide = room_for((size_t)pieces.n_vertices * sizeof *pieces.wide);
        pieces.inv_w = room_for((size_t)pieces.n_vertices * sizeof *pieces.inv_w);
        pieces.weights = room_for((size_t)pieces.n_vertices * 3 * sizeof *pieces.weights);
        pieces.triangles = room_for((size_t)pieces.n_pieces * 3 * sizeof *pieces.triangles);
        pieces.source = room_for((size_t)pieces.n_pieces * sizeof *pieces.source);
        k->clip(source, &projected, triangles, NULL, n_triangles, view, &pieces);
        tell(name, "weights of pieces", pieces.weights, (size_t)pieces.n_vertices * 3 * sizeof *pieces.weights);
    }
    tell(name, "vertices", vertices, (size_t)source->n * sizeof *vertices);

    tl_snapped scene = {
        .mesh = {.vertices = vertices, .wide = wide, .source = view ? source : NULL, .n_vertices = source->n},
        .triangles = triangles,
        .n_triangles = n_triangles,
        .pieces = pieces.n_pieces ? &pieces : NULL};
    tl_window window = {.width = WIDTH, .height = HEIGHT, .subpixel_bits = 8};
    draw_all(&scene, &window, name);
    draw_values(&scene, &window, name);
    free(vertices), free(wide), free(pieces.vertices), free(pieces.wide), free(pieces.inv_w), free(pieces.weights);
    free(pieces.triangles), free(pieces.source);
}

int main(void)
{
    static double numbers[3 * MOST * 4];
    static float single[3 * MOST * 4];
    static const struct {
        const char *name;
        double extent;
        int n;
    } SCENES[] = {{"small", 4, MOST}, {"large", 90, 200}, {"huge", 1e5, 60}, {"wide", 1e12, 40}};
    make_buffers();
    state = 20240607;
    for (size_t s = 0; s < sizeof SCENES / sizeof *SCENES; s++) {
        char name[32];
        for (int i = 0; i < SCENES[s].n; i++) {
            const double x = uniform(0, WIDTH), y = uniform(0, HEIGHT), z = uniform(0, 1), extent = SCENES[s].extent;
            for (int j = 0; j < 3; j++) {
                double *v = numbers + 3 * (3 * i + j);
                v[0] = x + uniform(-extent, extent), v[1] = y + uniform(-extent, extent), v[2] = z + uniform(-.1, .1);
            }
        }
        for (int i = 0; i < 9 * SCENES[s].n; i++)
            single[i] = (float)numbers[i];
        snprintf(name, sizeof name, "%s64", SCENES[s].name);
        draw_scene(name, &(tl_source){.data = numbers, .scalar = TL_F64, .n_components = 3, .n = 3 * SCENES[s].n}, NULL,
                   SCENES[s].n);
        snprintf(name, sizeof name, "%s32", SCENES[s].name);
        draw_scene(name, &(tl_source){.data = single, .scalar = TL_F32, .n_components = 3, .n = 3 * SCENES[s].n}, NULL,
                   SCENES[s].n);
    }
    for (int i = 0; i < 600 * 4; i++)
        numbers[i] = uniform(-2, 2) * (i % 4 == 3 ? 0.7 : 1) + (i % 4 == 3 ? 0.4 : 0);
    const double guard_x = 0x1p60 / (WIDTH / 2. * 256), guard_y = 0x1p60 / (HEIGHT / 2. * 256);
    const tl_view view = {.half_width_px = WIDTH / 2.,
                          .half_height_px = HEIGHT / 2.,
                          .guard_band_x = guard_x,
                          .guard_band_y = guard_y,
                          .subpixel_bits = 8,
                          .near_clip = 1,
                          .far_clip = 1};
    draw_scene("clip64", &(tl_source){.data = numbers, .scalar = TL_F64, .n_components = 4, .n = 600}, &view, 200);
    printf("total %016" PRIx64 "\n", total);
    return 0;
}
