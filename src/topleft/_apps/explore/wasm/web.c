/* The kernels as a module of WebAssembly, for the page that runs without Python: memory, a scene, and pictures of it.
 * In: arrays that the page has written into memory of `web_room`.  Out: buffers there.  Every picture is drawn by the
 * table of kernels that Python calls; what stands here is what the verbs of topleft._core.raster do between two of its
 * calls.  The module has one scene and one caller; it imports nothing. */
#ifdef __wasm_simd128__
#include "isa_simd128.c"
#define K tl_kernels_simd128
#else
#include "isa_scalar.c"
#define K tl_kernels_scalar
#endif

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
    tl_view view;
    tl_pieces pieces;
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
    const tl_vertex_counts counts = K.snap(&scene.source, 0, n, grid_bits, n_components == 3, vertices, wide);
    mesh->vertices = vertices, mesh->wide = counts.n_wide ? wide : NULL;
    return counts.n_bad ? (int)K.first_bad(vertices, n, triangles, n_triangles) : -1;
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
    tl_exact_counts counts = {0};
    tl_slice slice = {.end = seen.n_triangles, .is_first = 1, .is_last = 1, .counts = &counts};
    K.draw_mesh(&seen, window, &target, &slice);
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
    if (K.draw_area(&scene.snapped, &scene.window, &all, &area) == TL_AREA_OVERFLOW) {
        memset(cells, 0, 8 * n);
        area.is_wide = 1;
        K.draw_area(&scene.snapped, &scene.window, &all, &area);
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
    K.list_edges(&scene.snapped, &scratch, edges, &n_edges);
    const tl_edges lines = {.mesh = scene.snapped.mesh, .edges = (const int32_t *)edges, .n_edges = n_edges};
    const tl_line_target target = {.pixels = pixels, .stride_px = scene.window.width};
    memset(pixels, 0, (size_t)(scene.window.width * scene.window.height));
    K.draw_lines(&lines, &scene.window, &target);
    used = before;
    return 0;
}

/* ---- a mesh ---------------------------------------------------------------------------------------------- */

static struct {
    tl_source source; /* float32 or float64, object space */
    const int32_t *triangles;
    int n_triangles;
    float *normals; /* rows of four: of vertices, then of creased corners */
    int32_t *normal_of_corner;
    float *face_normals;
    uint8_t *is_turned; /* NULL: of no triangle */
    float *colors;      /* (n, 4), or NULL */
    const float *decode;
} mesh;

/* Groups of equal rows of words: the first row of each, in their order, and the group of each row, as coincident of
 * topleft._meshes.model.mesh has them; both NULL where many hashes meet.  Returns how many, or WEB_FULL. */
static int group_equal(const void *rows, int n_words, int n, int32_t **first, int32_t **group)
{
    int table_bits = 4;
    while ((int64_t)1 << table_bits < 2 * (int64_t)n)
        table_bits++;
    int32_t *table = web_room((size_t)4 << table_bits);
    *first = web_room(4 * (size_t)n), *group = web_room(4 * (size_t)n);
    if (!table || !*first || !*group)
        return WEB_FULL;
    memset(table, 0xff, (size_t)4 << table_bits);
    const int64_t n_groups = K.group_rows(rows, n_words, n, table_bits, table, *first, *group);
    if (n_groups >= 0)
        return (int)n_groups;
    *first = *group = NULL;
    return n;
}

/* Makes vertices one that are equal, and whose colours (n, 4) are, if there are any, in their order, and names them in
 * the triangles.  Returns how many are left, or WEB_FULL. */
static int merge_vertices(void *vertices, int is_f64, uint8_t *colors, int n, int32_t *triangles, int n_triangles)
{
    const int n_bytes = is_f64 ? 24 : 12, n_words = n_bytes / 4 + (colors != NULL);
    uint8_t *rows = vertices;
    int32_t *first, *group;
    for (int i = 0; i < 3 * n; i++) /* no -0 */
        if (is_f64)
            ((double *)vertices)[i] += 0.0;
        else
            ((float *)vertices)[i] += 0.0f;
    if (colors) {
        if (!(rows = web_room((size_t)n * 4 * (size_t)n_words)))
            return WEB_FULL;
        for (int64_t i = 0; i < n; i++) {
            memcpy(rows + 4 * n_words * i, (uint8_t *)vertices + n_bytes * i, (size_t)n_bytes);
            memcpy(rows + 4 * n_words * i + n_bytes, colors + 4 * i, 4);
        }
    }
    const int n_groups = group_equal(rows, n_words, n, &first, &group);
    if (n_groups < 0 || !first)
        return n_groups;
    for (int64_t i = 0; i < n_groups; i++) {
        memmove((uint8_t *)vertices + n_bytes * i, (uint8_t *)vertices + (int64_t)n_bytes * first[i], (size_t)n_bytes);
        if (colors)
            memmove(colors + 4 * i, colors + 4 * (int64_t)first[i], 4);
    }
    for (int i = 0; i < 3 * n_triangles; i++)
        triangles[i] = group[triangles[i]];
    return n_groups;
}

/* The places of a mesh: its vertices, those that are equal but for their colours as one; and triangles of places. */
typedef struct {
    tl_source points;
    const int32_t *triangles, *of_vertex; /* of_vertex NULL: each vertex is a place */
} web_places;

static int find_places(web_places *places)
{
    const size_t n_bytes = mesh.source.scalar == TL_F64 ? 24 : 12;
    const uint8_t *vertices = mesh.source.data;
    int32_t *first, *group;
    *places = (web_places){mesh.source, mesh.triangles, NULL};
    if (!mesh.colors)
        return 0;
    const int n = group_equal(vertices, (int)n_bytes / 4, (int)mesh.source.n, &first, &group);
    if (n < 0 || !first || n == mesh.source.n)
        return n < 0 ? n : 0;
    uint8_t *points = web_room(n_bytes * (size_t)n);
    int32_t *corners = web_room(12 * (size_t)mesh.n_triangles);
    if (!points || !corners)
        return WEB_FULL;
    for (int i = 0; i < n; i++)
        memcpy(points + n_bytes * (size_t)i, vertices + n_bytes * (size_t)first[i], n_bytes);
    for (int64_t i = 0; i < 3 * (int64_t)mesh.n_triangles; i++)
        corners[i] = group[mesh.triangles[i]];
    places->points.data = points, places->points.n = n;
    places->triangles = corners, places->of_vertex = group;
    return 0;
}

/* The normals of vertices and of corners at edges that bend by more than the crease angle, as creased_normals of
 * topleft._meshes.model.normals has them.  Returns 0 or WEB_FULL. */
static int crease_normals(double least_cosine)
{
    web_places places;
    if (find_places(&places))
        return WEB_FULL;
    const size_t n = (size_t)mesh.n_triangles, n_places = (size_t)places.points.n;
    double *normals = web_room(24 * n), *angles = web_room(24 * n);
    int32_t *starts = web_room(4 * (n_places + 1)), *corners = web_room(12 * n), *groups = web_room(12 * n);
    int32_t *n_groups = web_room(4 * n_places), *group_starts = web_room(4 * (n_places + 1));
    double *of_places = web_room(24 * n_places);
    float *rows = places.of_vertex ? web_room(16 * n_places) : mesh.normals;
    if (!normals || !angles || !starts || !corners || !groups || !n_groups || !group_starts || !of_places || !rows)
        return WEB_FULL;
    K.face_angles(&places.points, places.triangles, 0, mesh.n_triangles, normals, angles);
    K.list_corners(places.triangles, mesh.n_triangles, places.points.n, starts, corners);
    size_t most = 0;
    for (size_t i = 0; i < n_places; i++)
        if ((size_t)(starts[i + 1] - starts[i]) > most)
            most = (size_t)(starts[i + 1] - starts[i]);
    const tl_fans fans = {places.triangles, starts, corners, normals, angles, least_cosine};
    uint64_t *room = web_room(40 * most);
    if (!room)
        return WEB_FULL;
    K.find_creases(&fans, 0, places.points.n, room, groups, n_groups);
    group_starts[0] = 0;
    for (size_t i = 0; i < n_places; i++)
        group_starts[i + 1] = group_starts[i] + n_groups[i];
    const int32_t n_more = group_starts[n_places];
    double *of_groups = web_room(24 * ((size_t)n_more + 1));
    if (!of_groups)
        return WEB_FULL;
    const tl_creases creases = {.starts = group_starts,
                                .groups = groups,
                                .own_triangles = mesh.triangles,
                                .first_row = mesh.source.n,
                                .of_vertices = of_places,
                                .of_groups = of_groups,
                                .row_of_corner = n_more ? mesh.normal_of_corner : NULL};
    K.sum_creases(&fans, &creases, 0, places.points.n);
    tl_source vectors = {.data = of_places, .scalar = TL_F64, .n_components = 3, .n = places.points.n};
    K.unit_vectors(&vectors, NULL, 0, vectors.n, NULL, rows);
    for (int64_t i = 0; places.of_vertex && i < mesh.source.n; i++)
        memcpy(mesh.normals + 4 * i, rows + 4 * (int64_t)places.of_vertex[i], 16);
    vectors.data = of_groups, vectors.n = n_more;
    K.unit_vectors(&vectors, NULL, 0, vectors.n, NULL, mesh.normals + 4 * mesh.source.n);
    if (!n_more)
        mesh.normal_of_corner = NULL;
    return 0;
}

/* What a file says of vertices: sRGB and opacity, and vectors; NULL where it does not; and the light of sRGB values. */
typedef struct {
    uint8_t *colors;
    const double *normals;
    const float *decode;
} web_attributes;

/* Takes float32 or float64 vertices (n, 3) and triangles whose indices were checked; all are changed where vertices are
 * equal.  With normals, or with a cosine below -1, equal vertices stay apart; with the second, all edges between
 * triangles that share vertices are smooth.  Writes the box round the triangles, low and high.  Returns how many
 * vertices are left, or WEB_FULL. */
WEB_EXPORT(web_take_mesh)
int web_take_mesh(void *vertices, int is_f64, int n, int32_t *triangles, int n_triangles, double least_cosine,
                  const web_attributes *given, double *box)
{
    const size_t t = (size_t)n_triangles, most_rows = (size_t)n + 3 * t;
    memset(&mesh, 0, sizeof mesh);
    mesh.normals = web_room(16 * most_rows), mesh.normal_of_corner = web_room(12 * t);
    mesh.face_normals = web_room(16 * t), mesh.is_turned = web_room(t);
    mesh.colors = given->colors ? web_room(16 * (size_t)n) : NULL, mesh.decode = given->decode;
    const uintptr_t before = used;
    if (!mesh.normals || !mesh.normal_of_corner || !mesh.face_normals || !mesh.is_turned ||
        (given->colors && !mesh.colors))
        return WEB_FULL;
    const int is_kept = given->normals || least_cosine < -1.0;
    const int left = is_kept ? n : merge_vertices(vertices, is_f64, given->colors, n, triangles, n_triangles);
    used = before;
    if (left < 0)
        return left;
    mesh.source = (tl_source){.data = vertices, .scalar = is_f64 ? TL_F64 : TL_F32, .n_components = 3, .n = left};
    mesh.triangles = triangles, mesh.n_triangles = n_triangles;
    if (given->colors)
        K.color_rows(given->colors, 4, 0, left, mesh.colors);
    if (given->normals) {
        const tl_source vectors = {.data = given->normals, .scalar = TL_F64, .n_components = 3, .n = n};
        K.unit_vectors(&vectors, NULL, 0, n, NULL, mesh.normals);
        mesh.normal_of_corner = NULL;
    } else if (crease_normals(least_cosine))
        return WEB_FULL;
    used = before;
    K.face_normals(&mesh.source, triangles, 0, n_triangles, NULL, mesh.face_normals);
    K.find_turned(&mesh.source, triangles, 0, n_triangles, mesh.normals,
                  mesh.normal_of_corner ? mesh.normal_of_corner : triangles, mesh.is_turned);
    int is_any = 0;
    for (size_t i = 0; i < t; i++)
        is_any |= mesh.is_turned[i];
    if (!is_any)
        mesh.is_turned = NULL;
    K.box_of_faces(&mesh.source, triangles, 0, n_triangles, box);
    return left;
}

/* Cuts faces with any number of corners into triangles, as rows of `corners`.  Returns how many faces are finished, or
 * WEB_FULL. */
WEB_EXPORT(web_cut)
int web_cut(const double *points, const int64_t *corners, const int64_t *n_corners, int n_faces, int most_corners,
            double most_steps, int64_t *triangles)
{
    const uintptr_t before = used;
    int64_t *room = web_room(8 * (size_t)tl_ear_words(most_corners));
    if (!room)
        return WEB_FULL;
    const tl_faces faces = {points, corners, n_corners, n_faces, (int64_t)most_steps, NULL};
    const int n_cut = (int)K.cut_faces(&faces, triangles, room);
    used = before;
    return n_cut;
}

/* Takes the mesh to the scene by a matrix, clip from object space, row by row, of the type of its vertices, seen in a
 * picture of this size.  Returns 0 or WEB_FULL. */
WEB_EXPORT(web_view_mesh) int web_view_mesh(const void *matrix, int is_affine, int width, int height, int cull)
{
    take(mesh.triangles, mesh.n_triangles, cull, TL_METHOD_AUTO);
    scene.window = (tl_window){.width = width, .height = height, .subpixel_bits = 8};
    scene.source = mesh.source, scene.source.matrix = matrix, scene.source.is_affine = is_affine;
    scene.view = (tl_view){.half_width_px = width / 2.,
                           .half_height_px = height / 2.,
                           .guard_band_x = 0x1p60 / (width / 2. * 256),
                           .guard_band_y = 0x1p60 / (height / 2. * 256),
                           .subpixel_bits = 8,
                           .near_clip = 1,
                           .far_clip = 1};
    const size_t n = (size_t)mesh.source.n;
    tl_vertex *vertices = web_room(n * sizeof *vertices);
    if (!vertices)
        return WEB_FULL;
    tl_projected projected = {.records = vertices};
    const tl_vertex_counts counts = K.project(&scene.source, 0, mesh.source.n, &scene.view, &projected);
    tl_wide *wide = NULL;
    if (counts.n_wide) {
        if (!(wide = cleared_room(n * sizeof *wide)))
            return WEB_FULL;
        projected.wide = wide;
        K.project(&scene.source, 0, mesh.source.n, &scene.view, &projected);
    }
    scene.snapped.mesh =
        (tl_vertex_set){.vertices = vertices, .wide = wide, .source = &scene.source, .n_vertices = mesh.source.n};
    if (!counts.n_clipped)
        return 0;
    tl_pieces *p = &scene.pieces;
    K.clip(&scene.source, &projected, mesh.triangles, NULL, mesh.n_triangles, &scene.view, p);
    if (!p->n_pieces)
        return 0;
    const size_t v = (size_t)p->n_vertices, t = (size_t)p->n_pieces;
    p->vertices = web_room(v * sizeof *p->vertices), p->wide = web_room(v * sizeof *p->wide);
    p->inv_w = web_room(8 * v), p->weights = web_room(24 * v);
    p->triangles = web_room(12 * t), p->source = web_room(4 * t);
    if (!p->vertices || !p->wide || !p->inv_w || !p->weights || !p->triangles || !p->source)
        return WEB_FULL;
    K.clip(&scene.source, &projected, mesh.triangles, NULL, mesh.n_triangles, &scene.view, p);
    scene.snapped.pieces = p;
    return 0;
}

/* How the mesh looks: vectors of the shading space, whose origin is in the middle of the box, and light. */
typedef struct {
    float eye[3], ray[4][3], eye_from[3][3];
    float to_light[3], light, ambient;
    float color[3], specular, shininess, background[4];
    int32_t has_perspective, is_flat, is_unlit, shows_normals;
    uint8_t background_bytes[4];
} web_look;

static void set_look(const web_look *look, tl_shading *s, tl_material *material, tl_light *light)
{
    *material = (tl_material){.shininess = look->shininess, .is_unlit = look->is_unlit};
    *light = (tl_light){.kind = TL_LIGHT_WRAPPED};
    *s = (tl_shading){.normals = mesh.normals,
                      .finds_inverse_w = look->has_perspective,
                      .normal_of_corner = mesh.normal_of_corner,
                      .corner_normals = mesh.normals,
                      .face_normals = look->is_flat ? mesh.face_normals : NULL,
                      .positions = mesh.source.data,
                      .is_f64 = mesh.source.scalar == TL_F64,
                      .is_turned = look->is_flat ? NULL : mesh.is_turned,
                      .colors = mesh.colors,
                      .decode = mesh.decode,
                      .front_side = 1,
                      .materials = material,
                      .n_materials = 1,
                      .lights = light,
                      .n_lights = 1,
                      .show = look->shows_normals ? TL_SHOW_NORMALS : TL_SHOW_LIGHT,
                      .has_perspective = look->has_perspective};
    for (int k = 0; k < 3; k++) {
        material->color[k] = look->color[k], material->specular[k] = look->specular;
        light->at[k] = look->to_light[k], light->color[k] = look->light;
        s->ambient[k] = look->ambient, s->eye[k] = look->eye[k];
        for (int i = 0; i < 3; i++)
            s->eye_from[i][k] = look->eye_from[i][k];
        for (int i = 0; i < 4; i++)
            s->ray[i][k] = look->ray[i][k];
    }
    material->color[3] = 1;
    memcpy(s->background, look->background, sizeof s->background);
    memcpy(s->background_bytes, look->background_bytes, sizeof s->background_bytes);
}

/* Draws the scene that is in view and shades it: pixels (height, width, 4) uint8, of 2^sample_bits samples that lie at
 * `samples_fx`, in 2^-8 px from the centre.  Returns 0 or WEB_FULL. */
WEB_EXPORT(web_render) int web_render(const web_look *look, int sample_bits, const int32_t *samples_fx, uint8_t *pixels)
{
    const uintptr_t before = used;
    const tl_window *window = &scene.window;
    const size_t n = (size_t)(window->width * window->height);
    int32_t *ids = web_room((4 * n) << sample_bits);
    float *depth = web_room((4 * n) << sample_bits);
    float *bounds = web_room(4 * (size_t)(tl_segments(window->width) * window->height));
    if (!ids || !depth || !bounds)
        return WEB_FULL;
    for (int k = 0; k < 1 << sample_bits; k++) {
        tl_snapped seen = scene.snapped;
        seen.mesh.sample_x_fx = samples_fx[2 * k], seen.mesh.sample_y_fx = samples_fx[2 * k + 1];
        const tl_target target = {.sink = TL_SINK_NEAREST,
                                  .pixels = ids + n * (size_t)k,
                                  .depth = depth + n * (size_t)k,
                                  .stride_px = window->width,
                                  .bounds = bounds};
        tl_slice slice = {.end = seen.n_triangles, .is_first = 1, .is_last = 1};
        K.draw_mesh(&seen, window, &target, &slice);
    }
    tl_shading shading;
    tl_material material;
    tl_light light;
    set_look(look, &shading, &material, &light);
    const tl_shaded shaded = {.snapped = &scene.snapped, .shading = &shading};
    const tl_shaded_scene shown = {.instances = &shaded, .n = 1, .view = &scene.view};
    if (sample_bits)
        K.shade_samples(&shown, window, samples_fx, sample_bits, (int64_t)n, ids, depth, NULL, pixels);
    else
        K.shade(&shown, window, NULL, ids, depth, pixels);
    used = before;
    return 0;
}
