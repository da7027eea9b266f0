/* The kernels as a module of WebAssembly, for the page that runs without Python: memory, a scene, and pictures of it.
 * In: arrays that the page has written into memory of `web_room`.  Out: buffers there.  Every picture is drawn by the
 * kernels that Python calls; what stands here is what the verbs of topleft._core.raster do between two calls.  All of
 * them are in one unit: no other is compiled.  The module has one scene and one caller; it imports nothing. */
#define TL_USE_SIMD128
#define TL_UNIT raster
#define TL_ISA web
#include "unit_raster.c"

#define WEB_EXPORT(name) __attribute__((export_name(#name)))
#define WEB_FULL -2 /* no memory is left */
#define WEB_PAGE 65536

/* ---- memory ---------------------------------------------------------------------------------------------- */

extern unsigned char __heap_base;
static uintptr_t used; /* where what is free begins */

/* Memory of n bytes, aligned to 64, with room behind it that kernels may read; NULL where there is none left. */
WEB_EXPORT(web_room) void *web_room(size_t n)
{
    if (!used)
        used = ((uintptr_t)&__heap_base + 63) & ~(uintptr_t)63;
    const uint64_t start = used, end = start + n + 64, held = (uint64_t)__builtin_wasm_memory_size(0) * WEB_PAGE;
    if (end + 1024 > UINT32_MAX)
        return NULL;
    if (end + 1024 > held &&
        __builtin_wasm_memory_grow(0, (size_t)((end + 1024 - held + WEB_PAGE - 1) / WEB_PAGE)) == SIZE_MAX)
        return NULL;
    used = (uintptr_t)((end + 63) & ~(uint64_t)63);
    return (void *)(uintptr_t)start;
}

/* How much is taken, and that all behind it is free again. */
WEB_EXPORT(web_used) uintptr_t web_used(void) { return used; }
WEB_EXPORT(web_release) void web_release(uintptr_t end) { used = end; }

static void *cleared_room(size_t n)
{
    void *room = web_room(n);
    return room ? memset(room, 0, n) : NULL;
}

/* ---- the scene ------------------------------------------------------------------------------------------- */

static struct {
    tl_source source;
    tl_snapped snapped;
    tl_exact_points exact;
    tl_window window;
} scene;

static void take(const int32_t *triangles, int n_triangles, int cull, int method)
{
    memset(&scene, 0, sizeof scene);
    scene.snapped.triangles = triangles, scene.snapped.n_triangles = n_triangles;
    scene.snapped.cull = (tl_cull)cull, scene.snapped.method = (tl_method)method;
}

/* Takes float64 vertices (n, n_components) in pixels, snapped to 2^-bits px or, with bits < 0, as they are.  Samples lie
 * on a grid of 2^-grid_bits px.  Returns -1, the lowest vertex that a triangle uses and nothing can draw, or WEB_FULL. */
WEB_EXPORT(web_take_pixels)
int web_take_pixels(double *points, int n_components, int n, const int32_t *triangles, int n_triangles, int bits,
                    int grid_bits, int cull, int method)
{
    take(triangles, n_triangles, cull, method);
    scene.window.subpixel_bits = grid_bits;
    tl_vertex_set *mesh = &scene.snapped.mesh;
    mesh->n_vertices = n;
    if (bits < 0) {
        scene.exact = (tl_exact_points){.points = points,
                                        .stride = n_components,
                                        .n_points = n,
                                        .triangles = triangles,
                                        .n_triangles = n_triangles,
                                        .band = 1};
        mesh->exact = &scene.exact;
        return -1;
    }
    if (bits < grid_bits) /* the snap, and then that to the finer grid of the samples, which changes nothing */
        for (int i = 0; i < n * n_components; i++)
            if (i % n_components < 2)
                points[i] = __builtin_rint(points[i] * (double)(1 << bits)) / (double)(1 << bits);
    scene.source = (tl_source){.data = points, .scalar = TL_F64, .n_components = n_components, .n = n};
    tl_vertex *vertices = web_room((size_t)n * sizeof *vertices);
    tl_wide *wide = cleared_room((size_t)n * sizeof *wide);
    if (!vertices || !wide)
        return WEB_FULL;
    const tl_vertex_counts counts = snap(&scene.source, 0, n, grid_bits, n_components == 3, vertices, wide);
    mesh->vertices = vertices, mesh->wide = counts.n_wide ? wide : NULL;
    return counts.n_bad ? (int)first_bad(vertices, n, triangles, n_triangles) : -1;
}

/* The part of the picture that is drawn, and which test covers a pixel. */
WEB_EXPORT(web_window) void web_window(int64_t x, int64_t y, int width, int height, int test)
{
    scene.window.x_px = x, scene.window.y_px = y, scene.window.width = width;
    scene.window.height = height, scene.window.test = (tl_test)test;
}

/* ---- pictures -------------------------------------------------------------------------------------------- */

/* Draws masks (uint8), counts or ids (int32), with the depth (float32) where the sink has one, as the sample sees it
 * that lies (x, y) sixteenths of a pixel from the centre.  Returns 0 or WEB_FULL. */
WEB_EXPORT(web_draw) int web_draw(int sink, int x, int y, void *pixels, float *depth)
{
    const uintptr_t before = used;
    const tl_window *window = &scene.window;
    tl_target target = {.sink = (tl_sink)sink, .pixels = pixels, .depth = depth, .stride_px = window->width};
    if (target.sink == TL_SINK_MASK) {
        target.covered = web_room(8 * (size_t)tl_covered_words(window->width * window->height));
        if (!target.covered)
            return WEB_FULL;
    }
    tl_snapped seen = scene.snapped;
    if (x || y) /* off the centre the grid is that of the samples, or a finer one */
        seen.mesh.sample_x_fx = x * (1 << (window->subpixel_bits - 4)),
        seen.mesh.sample_y_fx = y * (1 << (window->subpixel_bits - 4));
    tl_slice slice = {.end = seen.n_triangles, .is_first = 1, .is_last = 1};
    draw_mesh(&seen, window, &target, &slice);
    used = before;
    return 0;
}

/* The area (float32) that triangles cover of each pixel, their sum, or at most 1 of it.  Returns 0 or WEB_FULL. */
WEB_EXPORT(web_area) int web_area(float *pixels, int is_clamped)
{
    const uintptr_t before = used;
    const size_t n = (size_t)(tl_area_stride(scene.window.width) * scene.window.height);
    int64_t *cells = web_room(8 * n);
    if (!cells)
        return WEB_FULL;
    for (size_t i = 0; i < n; i++)
        ((int32_t *)cells)[i] = TL_CELL_CLEAR;
    const tl_slice all = {.end = scene.snapped.n_triangles};
    tl_area area = {.pixels = pixels, .stride_px = scene.window.width, .cells = cells, .is_clamped = is_clamped};
    if (draw_area(&scene.snapped, &scene.window, &all, &area) == TL_AREA_OVERFLOW) {
        memset(cells, 0, 8 * n);
        area.is_wide = 1;
        draw_area(&scene.snapped, &scene.window, &all, &area);
    }
    used = before;
    return 0;
}

/* The edges of all triangles, each once, as lines of pixels (uint8).  Returns 0 or WEB_FULL. */
WEB_EXPORT(web_wireframe) int web_wireframe(uint8_t *pixels)
{
    const uintptr_t before = used;
    const size_t n = (size_t)scene.snapped.n_triangles, n_vertices = (size_t)scene.snapped.mesh.n_vertices;
    const tl_edge_scratch scratch = {
        .starts = web_room(8 * (n_vertices + 1)), .last_low = web_room(4 * n_vertices), .highs = web_room(12 * n)};
    uint64_t *edges = web_room(24 * n);
    if (!scratch.starts || !scratch.last_low || !scratch.highs || !edges)
        return WEB_FULL;
    int64_t n_edges = 0;
    list_edges(&scene.snapped, &scratch, edges, &n_edges);
    const tl_edges lines = {.mesh = scene.snapped.mesh, .edges = (const int32_t *)edges, .n_edges = n_edges};
    const tl_line_target target = {.pixels = pixels, .stride_px = scene.window.width};
    memset(pixels, 0, (size_t)(scene.window.width * scene.window.height));
    draw_lines(&lines, &scene.window, &target);
    used = before;
    return 0;
}
