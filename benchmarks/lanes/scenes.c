/* Times the kernels of one table, TL_KERNELS_HERE, on fixed scenes: scenes [SCENE [REPEATS]].  Prints the least
 * milliseconds of each scene and a hash of what it draws.  `study.py` compiles it; no Python, so that it also runs in
 * WebAssembly and under an emulator. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "dispatch.h"

extern const tl_kernels TL_KERNELS_HERE;
static const tl_kernels *const k = &TL_KERNELS_HERE;
enum { W = 1920, H = 1080, N_PX = W * H };

/* milliseconds of this thread, for the machine has other work */
#ifdef __wasm__
int32_t time_of_clock(int32_t id, int64_t precision, uint64_t *ns)
    __attribute__((import_module("wasi_snapshot_preview1"), import_name("clock_time_get")));
static double now(void)
{
    uint64_t ns;
    if (time_of_clock(3, 1, &ns))
        exit(5);
    return 1e-6 * (double)ns;
}
#else
static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}
#endif
static uint64_t state = 20240607;
static double uniform(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(state >> 12) * 0x1p-52);
}
static void *room(size_t n)
{
    void *p = aligned_alloc(64, (n + 8192 + 63) / 64 * 64);
    if (!p)
        exit(2);
    return memset(p, 0, n + 8192);
}
/* what a scene has made, hashed after the clock has stopped */
static struct {
    const void *p;
    size_t n;
} told[4];
static int n_told;
static uint32_t hash_of(const void *p, size_t n)
{
    told[n_told].p = p, told[n_told++].n = n;
    return 0;
}
static uint32_t hash_told(void)
{
    uint32_t hash = 0;
    for (int t = 0; t < n_told; t++) {
        uint32_t h = 2166136261u;
        for (size_t i = 0; i < told[t].n / 4; i++)
            h = (h ^ ((const uint32_t *)told[t].p)[i]) * 16777619u;
        hash ^= h;
    }
    return hash;
}

typedef struct {
    float *v;
    int32_t *t;
    int64_t n_v, n_t;
    tl_vertex *out;
    double *points;
} mesh;

static mesh blob(int n)
{
    const int cols = (int)(sqrt(n) + .5), rows = n / (2 * cols);
    mesh m = {.n_v = (rows + 1) * cols, .n_t = 2 * rows * cols};
    m.v = room(12 * (size_t)m.n_v), m.t = room(12 * (size_t)m.n_t), m.out = room(16 * (size_t)m.n_v);
    const double pi = 3.14159265358979;
    for (int i = 0; i <= rows; i++)
        for (int j = 0; j < cols; j++) {
            const double th = pi * i / rows, ph = 2 * pi * j / cols, r = 1 + .08 * sin(7 * ph) * sin(5 * th);
            const double x = r * sin(th) * cos(ph), y = r * cos(th), z = 3 + r * sin(th) * sin(ph), f = .9 * H;
            float *o = m.v + 3 * (i * cols + j);
            o[0] = (float)(x / z * f + W / 2), o[1] = (float)(y / z * f + H / 2), o[2] = (float)(z / 10);
        }
    int at = 0;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < cols; j++) {
            const int p = i * cols + j, q = i * cols + (j + 1) % cols;
            const int32_t u[6] = {p, q, p + cols, q, q + cols, p + cols};
            memcpy(m.t + at, u, 24), at += 6;
        }
    return m;
}
static mesh triangles_of(int n, double size)
{
    mesh m = {.n_v = 3 * n, .n_t = n};
    m.v = room(12 * (size_t)m.n_v), m.t = room(12 * (size_t)n), m.out = room(16 * (size_t)m.n_v);
    for (int i = 0; i < n; i++) {
        const double x = uniform(0, W), y = uniform(0, H);
        for (int c = 0; c < 3; c++) {
            float *o = m.v + 9 * i + 3 * c;
            const double a = uniform(0, 6.2831853);
            o[0] = (float)(x + size / 2 * cos(a)), o[1] = (float)(y + size / 2 * sin(a)), o[2] = (float)uniform(0, 1);
            m.t[3 * i + c] = 3 * i + c;
        }
    }
    return m;
}

static int32_t *ids, *cells;
static float *depth, *floats;
static uint8_t *bytes;
static uint64_t *covered;
static const tl_window WINDOW = {.width = W, .height = H, .subpixel_bits = 8};

static void snap_mesh(mesh *m)
{
    const tl_source s = {.data = m->v, .scalar = TL_F32, .n_components = 3, .n = m->n_v};
    k->snap(&s, 0, m->n_v, 8, 1, m->out, NULL);
}
static tl_snapped scene_of(const mesh *m)
{
    return (tl_snapped){.mesh = {.vertices = m->out, .n_vertices = m->n_v}, .triangles = m->t, .n_triangles = m->n_t};
}
static void draw(const tl_snapped *s, tl_target g)
{
    tl_slice slice = {.end = s->n_triangles, .is_first = 1, .is_last = 1};
    g.stride_px = W;
    if (k->draw_mesh(s, &WINDOW, &g, &slice) >= 0)
        exit(3);
}
static mesh the_mesh;
static void make_10k(void) { the_mesh = blob(10000); }
static void make_100k(void) { the_mesh = blob(100000); }
static void make_1m(void) { the_mesh = blob(1000000); }
static void make_fill(void) { the_mesh = triangles_of(20000, 40); }
static void make_tiny(void) { the_mesh = triangles_of(200000, 4); }
static uint32_t run_nearest(void)
{
    snap_mesh(&the_mesh);
    const tl_snapped s = scene_of(&the_mesh);
    draw(&s, (tl_target){.sink = TL_SINK_NEAREST, .pixels = ids, .depth = depth});
    return hash_of(ids, 4 * N_PX) ^ hash_of(depth, 4 * N_PX);
}
static uint32_t run_snap(void)
{
    snap_mesh(&the_mesh);
    return hash_of(the_mesh.out, 16 * (size_t)the_mesh.n_v);
}
static uint32_t run_mask(void)
{
    snap_mesh(&the_mesh);
    const tl_snapped s = scene_of(&the_mesh);
    draw(&s, (tl_target){.sink = TL_SINK_MASK, .pixels = bytes, .covered = covered});
    return hash_of(bytes, N_PX);
}
static uint32_t run_samples(void)
{
    static const int32_t GRID[4][2] = {{-32, -96}, {96, -32}, {-96, 32}, {32, 96}};
    snap_mesh(&the_mesh);
    const tl_snapped s = scene_of(&the_mesh);
    draw(&s,
         (tl_target){
             .sink = TL_SINK_SAMPLES, .pixels = floats, .covered = covered, .sample_bits = 2, .samples_fx = GRID[0]});
    return hash_of(floats, 4 * N_PX);
}
static uint32_t blend(tl_blend mode, int is_area)
{
    static uint8_t colors[4 * 200000];
    static const uint8_t GROUND[4] = {30, 60, 90, 255};
    if (!colors[0])
        for (size_t i = 0; i < sizeof colors; i++)
            colors[i] = (uint8_t)(1 + ((uint64_t)i * 40503 >> 6) % 255);
    snap_mesh(&the_mesh);
    const tl_snapped s = scene_of(&the_mesh);
    const tl_canvas canvas = {.pixels = bytes,
                              .stride_px = W,
                              .colors = colors,
                              .n_channels = 4,
                              .is_u8 = 1,
                              .is_flat = 1,
                              .blend = mode,
                              .ground = GROUND,
                              .is_area = is_area,
                              .band_rows = 270,
                              .cells = cells};
    k->blend(&s, &WINDOW, &canvas);
    return hash_of(bytes, 4 * N_PX);
}
static uint32_t run_fill(void) { return blend(TL_BLEND_REPLACE, 0); }
static uint32_t run_over(void) { return blend(TL_BLEND_OVER, 0); }
static uint32_t run_area_blend(void) { return blend(TL_BLEND_OVER, 1); }
static uint32_t run_area(void)
{
    snap_mesh(&the_mesh);
    const tl_snapped s = scene_of(&the_mesh);
    const tl_area area = {.pixels = floats, .stride_px = W, .cells = cells};
    if (k->draw_area(&s, &WINDOW, &(tl_slice){.end = s.n_triangles}, &area) >= 0)
        exit(4);
    return hash_of(floats, 4 * N_PX);
}
static uint32_t run_barycentric(void)
{
    static int is_drawn;
    if (!is_drawn)
        run_nearest(), is_drawn = 1;
    const tl_snapped s = scene_of(&the_mesh);
    k->barycentric(&s, &WINDOW, ids, floats);
    return hash_of(floats, 12 * N_PX);
}
static double *points;
static uint32_t run_exact(void)
{
    if (!points)
        points = room(24 * (size_t)the_mesh.n_v);
    const tl_source src = {.data = the_mesh.v, .scalar = TL_F32, .n_components = 3, .n = the_mesh.n_v};
    k->take_points(&src, 0, the_mesh.n_v, -1, points);
    const tl_exact_points exact = {.points = points,
                                   .stride = 3,
                                   .n_points = the_mesh.n_v,
                                   .triangles = the_mesh.t,
                                   .n_triangles = the_mesh.n_t,
                                   .band = 1};
    const tl_snapped s = {
        .mesh = {.n_vertices = the_mesh.n_v, .exact = &exact}, .triangles = the_mesh.t, .n_triangles = the_mesh.n_t};
    draw(&s, (tl_target){.sink = TL_SINK_NEAREST, .pixels = ids, .depth = depth});
    return hash_of(ids, 4 * N_PX) ^ hash_of(depth, 4 * N_PX);
}
static uint32_t run_project(void)
{
    static const float M[16] = {1.1f, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1.2f, 8, 0, 0, -1, 9};
    static float *object;
    if (!object) {
        object = room(12 * (size_t)the_mesh.n_v);
        for (int64_t i = 0; i < 3 * the_mesh.n_v; i++)
            object[i] = (float)uniform(-1, 1);
    }
    const tl_source src = {.data = object, .scalar = TL_F32, .n_components = 3, .n = the_mesh.n_v, .matrix = M};
    const tl_view view = {.half_width_px = W / 2.,
                          .half_height_px = H / 2.,
                          .guard_band_x = 0x1p60 / (W / 2. * 256),
                          .guard_band_y = 0x1p60 / (H / 2. * 256),
                          .subpixel_bits = 8,
                          .near_clip = 1,
                          .far_clip = 1};
    k->project(&src, 0, the_mesh.n_v, &view, &(tl_projected){.records = the_mesh.out});
    return hash_of(the_mesh.out, 16 * (size_t)the_mesh.n_v);
}
static uint32_t run_shade(void)
{
    static float *face, decode[256];
    static float *rows;
    static const tl_light LIGHT = {.kind = TL_LIGHT_DIRECTION, .at = {.36f, .48f, .8f}, .color = {.8f, .8f, .8f}};
    static const tl_material MATERIAL = {.color = {.8f, .6f, .4f, 1}, .specular = {.3f, .3f, .3f}, .shininess = 40};
    if (!face) {
        run_nearest();
        face = room(16 * (size_t)the_mesh.n_t), rows = room(16 * (size_t)the_mesh.n_v);
        for (int i = 0; i < 256; i++)
            decode[i] = (float)i / 255;
        for (int64_t i = 0; i < the_mesh.n_v; i++) {
            double n[3] = {uniform(-.5, .5), uniform(-.5, .5), -1};
            const double l = sqrt(n[0] * n[0] + n[1] * n[1] + 1);
            for (int c = 0; c < 3; c++)
                rows[4 * i + c] = (float)(n[c] / l);
            rows[4 * i + 3] = 1;
        }
        for (int64_t i = 0; i < 4 * the_mesh.n_t; i++)
            face[i] = i % 4 == 2 ? -1.f : i % 4 == 3;
    }
    const tl_snapped s = scene_of(&the_mesh);
    const tl_shading sh = {.normals = rows,
                           .front_side = 1,
                           .materials = &MATERIAL,
                           .n_materials = 1,
                           .lights = &LIGHT,
                           .n_lights = 1,
                           .ambient = {.1f, .1f, .1f},
                           .decode = decode,
                           .positions = the_mesh.v,
                           .eye = {0, 0, -3},
                           .ray = {{-1, -1, 0}, {.001f, 0, 0}, {0, .001f, 0}, {0, 0, 1}}};
    const tl_shaded one = {&s, &sh, 0};
    const tl_shaded_scene all = {&one, 1, NULL};
    k->shade(&all, &WINDOW, NULL, ids, depth, bytes);
    return hash_of(bytes, 4 * N_PX);
}

/* 4000 polygons of 60 corners, 30 px across; and a comb of 20000 corners */
static tl_polygons the_polygons;
static tl_polygon_box *boxes;
static tl_label_scratch *scratch;
static int32_t *row_cells;
static void make_polygons_of(int n, int corners, double radius)
{
    const int64_t n_points = (int64_t)n * corners;
    double *p = room(16 * (size_t)n_points);
    int64_t *rings = room(8 * (size_t)(n + 1)), *polygons = room(8 * (size_t)(n + 1));
    for (int i = 0; i < n; i++) {
        const double x = n == 1 ? W / 2 : uniform(20, W - 20), y = n == 1 ? H / 2 : uniform(20, H - 20);
        for (int c = 0; c < corners; c++) {
            const double a = 6.283185307 * c / corners, r = radius * (c % 2 ? .6 : 1);
            p[2 * ((int64_t)i * corners + c)] = x + r * cos(a), p[2 * ((int64_t)i * corners + c) + 1] = y + r * sin(a);
        }
        rings[i + 1] = (int64_t)(i + 1) * corners, polygons[i + 1] = i + 1;
    }
    int32_t *x_fx = room(4 * (size_t)n_points + 128), *y_fx = room(4 * (size_t)n_points + 128);
    const int64_t corner[2] = {0, 0};
    const tl_source s = {.data = p, .scalar = TL_F64, .n_components = 2, .n = n_points};
    k->snap_points(&s, 0, n_points, 8, 8, corner, x_fx, y_fx, NULL);
    uint8_t *wide = room((size_t)n + 1), *simple = room((size_t)n + 1);
    int8_t *weights = room((size_t)n + 1);
    the_polygons = (tl_polygons){.x_fx = x_fx,
                                 .y_fx = y_fx,
                                 .rings = rings,
                                 .polygons = polygons,
                                 .is_wide = wide,
                                 .weights = weights,
                                 .is_simple = simple,
                                 .n_polygons = n,
                                 .bits = 8};
    boxes = room(sizeof *boxes * (size_t)(n + 1));
    k->bound_polygons(&the_polygons, 0, n, W, H, wide, boxes);
    k->trust_polygons(&the_polygons, 0, n, weights, simple);
    scratch = room(sizeof *scratch), row_cells = room(4 * TL_CELL_ROWS * (size_t)tl_polygon_stride(W));
}
static void make_polygons(void) { make_polygons_of(4000, 60, 15); }
static void make_comb(void) { make_polygons_of(1, 20000, 500); }
static uint32_t run_labels(void)
{
    const tl_label_job job = {.end = the_polygons.n_polygons,
                              .boxes = boxes,
                              .width = W,
                              .bottom = H,
                              .n_bytes = 4,
                              .background = -1,
                              .pixels = ids,
                              .cells = row_cells,
                              .scratch = scratch};
    k->label_polygons(&the_polygons, &job);
    return hash_of(ids, 4 * N_PX);
}
static uint32_t run_shares(void)
{
    static int64_t work[8 * 65536];
    static tl_edge_piece *pieces;
    static int64_t row_starts[H + 2];
    static double shares[W + 16];
    if (!pieces)
        pieces = room(65536 * sizeof *pieces);
    tl_piece_scratch at = {pieces, work, 65536, row_starts, shares};
    memset(floats, 0, 4 * N_PX);
    const tl_share_job job = {.end = the_polygons.n_polygons,
                              .boxes = boxes,
                              .width = W,
                              .bottom = H,
                              .cells = cells,
                              .n_cells = tl_area_stride(W) * H,
                              .pieces = &at,
                              .pixels = floats,
                              .n_channels = 1};
    k->share_polygons(&the_polygons, &job);
    return hash_of(floats, 4 * N_PX);
}
static uint32_t run_even_odd(void)
{
    static uint64_t bits[(W / 64 + 4) * (H + 1)];
    k->mask_even_odd(&the_polygons, 0, W, 0, H, bits, bytes);
    return hash_of(bytes, N_PX);
}
static uint32_t run_certify(void)
{
    static int64_t *words;
    if (!words)
        words = room(8 * 4000000);
    k->certify_polygons(&the_polygons, 0, the_polygons.n_polygons, (int8_t *)the_polygons.weights,
                        (uint8_t *)the_polygons.is_simple, words);
    return hash_of(the_polygons.is_simple, (size_t)the_polygons.n_polygons);
}

static const struct {
    const char *name;
    void (*make)(void);
    uint32_t (*run)(void);
} SCENES[] = {
    {"blob10k", make_10k, run_nearest},
    {"blob100k", make_100k, run_nearest},
    {"blob1M", make_1m, run_nearest},
    {"tiny200k", make_tiny, run_nearest},
    {"random20k", make_fill, run_nearest},
    {"mask100k", make_100k, run_mask},
    {"mask20kx40", make_fill, run_mask},
    {"samples4x", make_100k, run_samples},
    {"fill20kx40", make_fill, run_fill},
    {"over20kx40", make_fill, run_over},
    {"overarea20k", make_fill, run_area_blend},
    {"area20kx40", make_fill, run_area},
    {"area100k", make_100k, run_area},
    {"bary100k", make_100k, run_barycentric},
    {"shade100k", make_100k, run_shade},
    {"exact100k", make_100k, run_exact},
    {"snap1M", make_1m, run_snap},
    {"project1M", make_1m, run_project},
    {"labels4000", make_polygons, run_labels},
    {"shares4000", make_polygons, run_shares},
    {"certify4000", make_polygons, run_certify},
    {"comb20k", make_comb, run_even_odd},
};

int main(int argc, char **argv)
{
    const char *only = argc > 1 ? argv[1] : "all";
    const int repeats = argc > 2 ? atoi(argv[2]) : 7;
    bytes = room(4 * N_PX), ids = room(4 * N_PX), depth = room(4 * N_PX), floats = room(12 * N_PX);
    covered = room(8 * (size_t)tl_covered_words((int64_t)N_PX * 16));
    const int64_t n_cells = tl_area_stride(W) * H > tl_blend_cells(W) ? tl_area_stride(W) * H : tl_blend_cells(W);
    cells = room(4 * (size_t)n_cells);
    for (int64_t i = 0; i < n_cells; i++)
        cells[i] = TL_CELL_CLEAR;
    for (size_t s = 0; s < sizeof SCENES / sizeof *SCENES; s++) {
        if (strcmp(only, "all") && strcmp(only, SCENES[s].name))
            continue;
        state = 20240607;
        SCENES[s].make();
        double best = 1e9;
        uint32_t hash = 0;
        for (int r = 0; r < repeats; r++) {
            const double t = now();
            n_told = 0;
            SCENES[s].run();
            const double took = now() - t;
            best = took < best ? took : best;
        }
        hash = hash_told();
        printf("%-12s %9.3f %08x\n", SCENES[s].name, best, hash);
        fflush(stdout);
    }
    return 0;
}
