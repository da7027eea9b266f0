# Shades pixels and tests their alpha: textures, materials and lights, and the passes that use them.

cdef class Mipmap:
    """`tl_texture`: uint16 texels of linear light, a row (offset, width, height) for each mip level."""

    cdef tl_texture texture
    cdef object texels

    def __init__(self, const uint16_t[:, ::1] texels, const int32_t[:, ::1] levels, int filter_code, int wrap_u,
                 int wrap_v, int uv_set=0, transform: Sequence[Sequence[float]] | None = None,
                 tangent: Sequence[float] = (1, 0), float hand=1):
        cdef int k
        self.texels = texels
        self.texture.texels = &texels[0, 0]
        self.texture.n_levels = levels.shape[0]
        for k in range(levels.shape[0]):
            self.texture.offset[k], self.texture.width[k], self.texture.height[k] = levels[k, 0], levels[k, 1], levels[k, 2]
        for k in range(levels.shape[0], TL_MAX_LEVELS):
            self.texture.offset[k], self.texture.width[k], self.texture.height[k] = 0, 1, 1
        self.texture.filter, self.texture.wrap_u, self.texture.wrap_v = <tl_filter>filter_code, <tl_wrap>wrap_u, <tl_wrap>wrap_v
        self.texture.uv_set, self.texture.has_transform, self.texture.hand = uv_set, transform is not None, hand
        for k in range(2):
            copy_floats(self.texture.transform[k], (0, 0, 0) if transform is None else transform[k], 3)
        copy_floats(self.texture.tangent, tangent, 2)


cdef class Surroundings:
    """`tl_surroundings`: texels (N, 4) of an environment map, a row (offset, size) for each mip level; or None."""

    cdef tl_surroundings surroundings
    cdef object texels

    def __init__(self, const float[:, ::1] texels or None, const int32_t[:, ::1] levels or None, sky: Sequence[float],
                 ground: Sequence[float], float diffuse, from_shading: Sequence[Sequence[float]]):
        cdef tl_surroundings *e = &self.surroundings
        cdef int k
        self.texels = texels
        e.kind, e.texels, e.n_levels, e.diffuse = <tl_surroundings_kind>0, NULL, 0, diffuse
        copy_floats(e.sky, sky, 3)
        copy_floats(e.ground, ground, 3)
        for k in range(3):
            copy_floats(e.from_shading[k], from_shading[k], 3)
        if texels is not None:
            e.kind, e.texels, e.n_levels = <tl_surroundings_kind>1, &texels[0, 0], levels.shape[0]
            for k in range(levels.shape[0]):
                e.offset[k], e.size[k] = levels[k, 0], levels[k, 1]


cdef const tl_texture *texture_of(Mipmap texture) noexcept:
    return &texture.texture if texture is not None else NULL


cdef void copy_floats(float *out, values, int n) except *:
    cdef int k
    for k in range(n):
        out[k] = values[k]


cdef class ShadingTable:
    """`tl_shading`; keeps the arrays that it points to alive."""

    cdef tl_shading shading
    cdef object arrays
    cdef const float[:, ::1] normals
    cdef double[3] center
    cdef int64_t n_vertices
    cdef uint8_t[::1] materials
    cdef uint8_t[::1] lights
    cdef tl_light headlight
    cdef Rays rays

    def __init__(self, const float[:, ::1] normals, center: Sequence[float],
                 const int32_t[:, ::1] normal_of_corner or None, const float[:, ::1] corner_normals or None,
                 const float[:, ::1] face_normals or None, positions: Array, const uint8_t[::1] is_turned or None,
                 const float[:, ::1] uv or None, const float[:, ::1] uv1 or None, const float[:, ::1] colors or None,
                 bint has_alpha, float front_side, const int32_t[::1] material_of or None, const float[::1] decode or None):
        """`center`: the origin of the shading space, in the axes of the mesh."""
        cdef const uint8_t[::1] raw = as_bytes(positions)
        cdef tl_shading *s = &self.shading
        self.arrays = (normals, normal_of_corner, corner_normals, face_normals, raw, is_turned, uv, uv1, colors, material_of, decode)
        self.normals, self.n_vertices = normals, positions.shape[0]
        self.center = center
        s.normals, s.finds_inverse_w = &normals[0, 0] if normals.shape[0] else NULL, False
        s.normal_of_corner = NULL
        if normal_of_corner is not None and normal_of_corner.shape[0]:
            s.normal_of_corner, s.corner_normals = &normal_of_corner[0, 0], &corner_normals[0, 0]
        s.face_normals = &face_normals[0, 0] if face_normals is not None and face_normals.shape[0] else NULL
        s.positions, s.is_f64 = data(raw), positions.dtype == np.float64
        s.is_turned = <const uint8_t *>data(is_turned)
        s.uv = &uv[0, 0] if uv is not None and uv.shape[0] else NULL
        s.uv1 = &uv1[0, 0] if uv1 is not None and uv1.shape[0] else NULL
        s.has_alpha, s.front_side, s.surroundings, s.wants_opacity = has_alpha, front_side, NULL, False
        s.colors = &colors[0, 0] if colors is not None and colors.shape[0] else NULL
        s.material_of = &material_of[0] if material_of is not None and material_of.shape[0] else NULL
        s.decode = &decode[0] if decode is not None else NULL
        s.n_materials = s.n_lights = 0
        s.matcap = NULL

    def set_materials(self, materials: Sequence[tuple[Any, ...]]):
        """Take rows (color, back_color, back_side, specular, shininess, is_unlit, cutoff, texture or None, and None or
        the full material: (is_metallic, metallic, roughness, occlusion, normal_scale, emission, four textures or None))."""
        cdef tl_material *m
        cdef int k
        self.materials = np.zeros(max(1, len(materials)) * sizeof(tl_material), np.uint8)
        m = <tl_material *>&self.materials[0]
        self.arrays += (materials,)
        for k, (color, back_color, back_side, specular, shininess, is_unlit, cutoff, texture, full) in enumerate(materials):
            copy_floats(m[k].color, color, 4)
            copy_floats(m[k].back_color, back_color, 3)
            copy_floats(m[k].specular, specular, 3)
            m[k].back_side, m[k].shininess, m[k].is_unlit, m[k].cutoff = back_side, shininess, is_unlit, cutoff
            m[k].texture = texture_of(texture)
            if full is not None:
                m[k].is_full = True
                m[k].is_metallic, m[k].metallic, m[k].roughness, m[k].occlusion, m[k].normal_scale = full[:5]
                copy_floats(m[k].emission, full[5], 3)
                m[k].metallic_roughness, m[k].occlusion_map = texture_of(full[6]), texture_of(full[7])
                m[k].normal_map, m[k].emission_map = texture_of(full[8]), texture_of(full[9])
        self.shading.materials, self.shading.n_materials = m, len(materials)

    cdef ShadingTable seen(self, const double[:, ::1] clip_from_eye, const double[:, ::1] view, double width, double height):
        """Return the table for a camera and the size of its whole picture; `view`: (4, 4), to eye space."""
        cdef ShadingTable table = ShadingTable.__new__(ShadingTable)
        cdef tl_shading *s = &table.shading
        cdef int i, k
        table.shading, table.materials, table.arrays = self.shading, self.materials, self.arrays
        table.center = self.center
        find_rays(clip_from_eye, view, self.center, width, height, &table.rays)
        s.has_perspective = table.rays.has_perspective
        for k in range(3):
            s.eye[k] = <float>table.rays.rows[0][k]
            for i in range(4):
                s.ray[i][k] = <float>table.rays.rows[1 + i][k]
            for i in range(3):
                s.eye_from[i][k] = <float>table.rays.rows[5 + i][k]
        return table

    @property
    def camera_rays(self) -> tuple[bool, F64, float]:
        """Return `camera_rays` of the table's camera."""
        return self.rays.has_perspective, np.array([[self.rays.rows[i][k] for k in range(3)] for i in range(9)]), self.rays.scale

    cdef void set_headlight(self, const double *at, float color, float ambient) noexcept:
        """Set a wrapped light in a direction of eye space, and ambient light."""
        cdef double total
        cdef int i, k
        for i in range(3):
            total = 0.0
            for k in range(3):
                total = total + self.rays.rows[5 + k][i] * at[k]
            self.headlight.at[i] = <float>total
            self.headlight.color[i], self.shading.ambient[i] = color, ambient
        self.headlight.kind, self.headlight.falloff = <tl_light_kind>2, 0.0
        self.shading.lights, self.shading.n_lights = &self.headlight, 1

    @cython.cdivision(True)  # IEEE: NaN for 0 / 0
    cdef int set_lights(self, const double[:, ::1] lights, const double[:, ::1] world_from_mesh,
                        float ambient, tl_light *light) except -1:
        """Set lights of the world or of eye space, and ambient light.

        Parameters
        ----------
        lights
            Rows (kind, x, y, z, falloff, red, green, blue, direction of a spot (3), cone scale, cone offset, whether it
            is in eye space).
        world_from_mesh
            (4, 4): the pose of the mesh.
        light
            Room for `lights`.
        """
        cdef Py_ssize_t n = lights.shape[0], i, j, k
        cdef double[4][8] rows
        cdef double[3] at, way
        cdef double scale, total
        cdef bint in_eye, is_far
        scale = cube_root(fabs(determinant_of(world_from_mesh)))  # distances are measured in the space of the mesh
        for i in range(4):
            for j in range(4):
                rows[i][j] = world_from_mesh[i, j]
        invert(rows, 4)
        for k in range(n):
            in_eye, is_far = lights[k, 13] != 0.0, lights[k, 0] == 0.0
            for i in range(3):
                at[i], way[i] = lights[k, 1 + i], lights[k, 8 + i]
            if not in_eye:
                for i in range(3):
                    total = 0.0
                    for j in range(3):
                        total = total + rows[i][4 + j] * lights[k, 1 + j]
                    at[i] = total + rows[i][7] * (0.0 if is_far else 1.0)
                    total = 0.0
                    for j in range(3):
                        total = total + rows[i][4 + j] * lights[k, 8 + j]
                    way[i] = total
            if is_far:
                self.direct(at, in_eye)
            elif in_eye:
                for i in range(3):
                    at[i] = at[i] - self.rays.rows[8][i]
                self.from_eye(at)
                for i in range(3):
                    at[i] = at[i] / self.rays.scale
            else:
                for i in range(3):
                    at[i] = at[i] - self.center[i]
            if way[0] != 0.0 or way[1] != 0.0 or way[2] != 0.0:
                self.direct(way, in_eye)
            light[k].kind, light[k].falloff = <tl_light_kind><int>lights[k, 0], <float>(lights[k, 4] * (scale * scale))
            for i in range(3):
                light[k].at[i], light[k].color[i], light[k].axis[i] = <float>at[i], <float>lights[k, 5 + i], <float>way[i]
            light[k].cone_scale, light[k].cone_offset = <float>lights[k, 11], <float>lights[k, 12]
        for i in range(3):
            self.shading.ambient[i] = ambient
        self.shading.lights, self.shading.n_lights = light, <int>n
        return 0

    cdef void from_eye(self, double *way) noexcept:
        """Rotate a vector from eye space to shading space."""
        cdef double[3] vector = [way[0], way[1], way[2]]
        cdef double total
        cdef Py_ssize_t i, j
        for i in range(3):
            total = 0.0
            for j in range(3):
                total = total + self.rays.rows[5 + j][i] * vector[j]
            way[i] = total

    @cython.cdivision(True)
    cdef void direct(self, double *way, bint in_eye) noexcept:
        """Convert a direction of the mesh, or of eye space, to a unit vector of shading space."""
        cdef double total = 0.0
        cdef Py_ssize_t i
        if in_eye:
            self.from_eye(way)
        for i in range(3):
            total = total + way[i] * way[i]
        total = sqrt(total)
        for i in range(3):
            way[i] = way[i] / total

    def set_surroundings(self, Surroundings surroundings):
        """Set the environment light."""
        self.arrays += (surroundings,)
        self.shading.surroundings = &surroundings.surroundings

    def set_picture(self, int show, Mipmap matcap or None, background: Sequence[float], background_bytes: Sequence[int],
                    bint wants_opacity):
        """Set the quantity to show, the background, and whether alpha is the opacity of full materials."""
        cdef tl_shading *s = &self.shading
        cdef int k
        s.show, s.wants_opacity = <tl_show>show, wants_opacity
        s.matcap = &matcap.texture if matcap is not None else NULL
        self.arrays += (matcap,)
        copy_floats(s.background, background, 4)
        for k in range(4):
            s.background_bytes[k] = background_bytes[k]
        self.set_fog((0, 0, 0), 0, 0, 0, 0)

    def set_turn(self, eye_from: Sequence[Sequence[float]]):
        """Set the rows of a matrix (3, 3) from shading space to the space of the written normals."""
        cdef int k
        for k in range(3):
            copy_floats(self.shading.eye_from[k], eye_from[k], 3)

    def set_fog(self, color: Sequence[float], float near, float scale, float distance_start, float distance_scale):
        """Set the depth cue."""
        cdef tl_shading *s = &self.shading
        copy_floats(s.fog_color, color, 3)
        s.fog_near, s.fog_scale, s.distance_start, s.distance_scale = near, scale, distance_start, distance_scale


def see(meshes: Sequence[SnappedMesh], kept: Sequence[ShadingTable], const double[:, ::1] clip_from_eye,
        const double[:, :, ::1] views, bint has_w, bint finds_inverse_w, double width, double height,
        empty: Callable[..., Array]) -> list[ShadingTable]:
    """Return the tables of meshes for a camera and the size of its whole picture.

    `views`: (N, 4, 4), to eye space. `has_w`: with perspective; `finds_inverse_w`: shading computes 1/w of visible
    vertices where a mesh allows it; otherwise 1/w of all vertices is written here, to `empty(shape, dtype)`.
    """
    cdef int64_t i, first = 0, n = 0
    cdef SnappedMesh mesh
    cdef ShadingTable table
    cdef float[:, ::1] rows
    cdef const double[:, ::1] view
    cdef const uint8_t[::1] finds = np.array([finds_inverse_w and (<SnappedMesh>mesh).can_find_inverse_w for mesh in meshes], np.uint8)
    cdef list tables = []
    for i in range(len(meshes)):
        table = kept[i]
        n += 0 if not has_w or finds[i] else table.n_vertices
    if n:
        rows = empty((n, 4), np.float32)
    for i in range(len(meshes)):
        mesh, table = meshes[i], kept[i]
        n = table.n_vertices
        view = views[i]
        table = table.seen(clip_from_eye, view, width, height)
        table.shading.finds_inverse_w = has_w and finds[i]
        if has_w and not finds[i] and n:
            set_inverse_w(mesh, (<ShadingTable>kept[i]).normals[:n], rows[first:first + n])
            table.arrays, table.shading.normals = (table.arrays, rows), &rows[first, 0]
            first += n
        tables.append(table)
    return tables


def light_all(tables: Sequence[ShadingTable], const double[:, ::1] lights or None, to_headlight: Any, float ambient,
              const double[:, :, ::1] places):
    """Set the lights of tables, rows as in `ShadingTable.set_lights`, or a headlight; and ambient light.

    `places`: (N, 4, 4), the poses of the meshes.
    """
    cdef double[3] at = to_headlight
    cdef int64_t i, n = lights.shape[0] if lights is not None else 0
    cdef uint8_t[::1] room = np.zeros(max(1, n * len(tables)) * sizeof(tl_light), np.uint8)
    cdef ShadingTable table
    for i in range(len(tables)):
        table = tables[i]
        if lights is None:
            table.set_headlight(at, max(0.0, 1.0 - ambient), ambient)
        else:
            table.lights = room
            table.set_lights(lights, places[i], ambient, <tl_light *>&room[0] + i * n)


cdef int set_inverse_w(SnappedMesh mesh, const float[:, ::1] rows, float[:, ::1] out) except -1:
    """Copy rows of four numbers, a row a vertex, and write 1/w over the fourth, for all snapped vertices.

    `UnprojectedMesh` writes its rows when it is drawn.
    """
    cdef int64_t i = 0, end, n = rows.shape[0], n_blocks
    if isinstance(mesh, UnprojectedMesh):
        (<UnprojectedMesh>mesh).projected.rows, (<UnprojectedMesh>mesh).projected.seen_rows = &rows[0, 0], &out[0, 0]
        mesh.arrays = mesh.arrays, rows, out
        return 0
    if mesh.is_used is None:
        if n < HELD_VERTICES:
            K.set_inverse_w(mesh.snapped.mesh.source, &rows[0, 0], 0, n, &out[0, 0])
        else:
            with nogil:
                K.set_inverse_w(mesh.snapped.mesh.source, &rows[0, 0], 0, n, &out[0, 0])
        return 0
    n_blocks = mesh.is_used.shape[0]
    with nogil:
        while i < n_blocks:
            end = i
            while end < n_blocks and mesh.is_used[end]:
                end += 1
            if end > i:
                K.set_inverse_w(mesh.snapped.mesh.source, &rows[0, 0], i * VERTEX_BLOCK, min(end * VERTEX_BLOCK, n), &out[0, 0])
            i = end + 1
    return 0


cdef enum:
    PROJECTED_BLOCK = 1 << 12  # vertices that are projected between two tests for clipped vertices


cdef class UnprojectedMesh(SnappedMesh):
    """A mesh with room for its snapped vertices, which `ShadedScene.draw` fills."""

    cdef tl_projected projected

    cdef bint project(self) noexcept nogil:
        """Project the vertices and their 1/w; returns False where a vertex is bad, wide or clipped."""
        cdef const tl_source *source = self.snapped.mesh.source
        cdef tl_vertex_counts counts
        cdef int64_t i
        self.projected.records = <tl_vertex *>self.snapped.mesh.vertices
        for i from 0 <= i < source.n by PROJECTED_BLOCK:
            counts = K.project(source, i, min(i + PROJECTED_BLOCK, source.n), self.clip_view(), &self.projected)
            if counts.n_bad or counts.n_wide or counts.n_clipped:
                return False
        return True


cdef class ShadedScene:
    """`tl_shaded_scene` of the instances of a picture; keeps their arrays alive."""

    cdef tl_shaded_scene scene
    cdef SnappedMesh mesh  # the first: all have its window
    cdef uint8_t[::1] rows
    cdef object arrays

    def __init__(self, meshes: Sequence[SnappedMesh], tables: Sequence[ShadingTable], first_ids: Sequence[int]):
        """Take at least one mesh, as many shading tables, and the id of triangle 0 of each."""
        cdef int64_t i, n = len(meshes)
        cdef SnappedMesh mesh
        cdef ShadingTable table
        cdef tl_shaded *instances
        self.arrays, self.mesh = (meshes, tables), meshes[0]
        self.rows = np.empty(n * sizeof(tl_shaded), np.uint8)
        instances = <tl_shaded *>&self.rows[0]
        for i in range(n):
            mesh, table = meshes[i], tables[i]
            instances[i].snapped, instances[i].shading, instances[i].first_id = &mesh.snapped, &table.shading, first_ids[i]
        self.scene.instances, self.scene.n, self.scene.view = instances, n, self.mesh.clip_view()

    def draw(self, Target target, uint8_t[:, :, ::1] pixels) -> bool:
        """Project, draw and shade the only mesh, a `UnprojectedMesh`, in one call: ids, depth and the picture (H, W, 4).

        Returns False where a vertex or a triangle cannot be drawn as it is; there may be no picture then.
        """
        cdef UnprojectedMesh mesh = self.mesh
        cdef tl_target rows = target.rows(0)
        cdef tl_window window = mesh.window(0, target.height, target.width)
        cdef uint8_t *picture = &pixels[0, 0, 0]
        cdef bint is_drawn
        if mesh.snapped.mesh.n_vertices < HELD_VERTICES and target.height * target.width <= HELD_PX:
            is_drawn = self.draw_unprojected(mesh, &window, &rows, picture)
        else:
            with nogil:
                is_drawn = self.draw_unprojected(mesh, &window, &rows, picture)
        raise_if_given_up()
        return is_drawn

    cdef bint draw_unprojected(self, UnprojectedMesh mesh, const tl_window *window, const tl_target *rows, uint8_t *pixels) noexcept nogil:
        cdef tl_slice slice = no_slice()
        slice.end, slice.is_first, slice.is_last = mesh.snapped.n_triangles, True, True
        if not mesh.project() or K.draw_mesh(&mesh.snapped, window, rows, &slice) >= 0:
            return False
        K.shade(&self.scene, window, NULL, <const int32_t *>rows.pixels, rows.depth, pixels)
        return True

    def shade(self, const int32_t[:, ::1] ids, const float[:, ::1] depth, uint8_t[:, :, ::1] pixels, int64_t first_row,
              int64_t n_rows, const int32_t[::1] at=None):
        """The kernel `shade`."""
        cdef tl_window window = self.mesh.window(first_row, n_rows, ids.shape[1])
        cdef const int32_t *at_fx = &at[0] if at is not None else NULL
        if n_rows and ids.shape[1]:
            if n_rows == ids.shape[0] and n_rows * ids.shape[1] <= HELD_PX:
                K.shade(&self.scene, &window, at_fx, &ids[first_row, 0], &depth[first_row, 0], &pixels[first_row, 0, 0])
            else:
                with nogil:
                    K.shade(&self.scene, &window, at_fx, &ids[first_row, 0], &depth[first_row, 0], &pixels[first_row, 0, 0])
            raise_if_given_up()

    def shade_samples(self, const int32_t[:, ::1] positions, const int32_t[:, :, ::1] ids, const float[:, :, ::1] depth,
                      uint8_t[:, :, ::1] pixels, int64_t first_row, int64_t n_rows):
        """The kernel `shade_samples`. `ids` and `depth`: (S, H, W)."""
        cdef tl_window window = self.mesh.window(first_row, n_rows, ids.shape[2])
        cdef int sample_bits = int(positions.shape[0]).bit_length() - 1
        cdef int64_t stride = ids.shape[1] * ids.shape[2]
        if n_rows and ids.shape[2]:
            with nogil:
                K.shade_samples(&self.scene, &window, &positions[0, 0], sample_bits, stride, &ids[0, first_row, 0], &depth[0, first_row, 0],
                                &pixels[first_row, 0, 0])
            raise_if_given_up()

    def shade_normals(self, const int32_t[:, ::1] ids, float[:, :, ::1] out, int64_t first_row, int64_t n_rows):
        """The kernel `shade_normals`."""
        cdef tl_window window = self.mesh.window(first_row, n_rows, ids.shape[1])
        if n_rows and ids.shape[1]:
            with nogil:
                K.shade_normals(&self.scene, &window, &ids[first_row, 0], &out[first_row, 0, 0])
            raise_if_given_up()


def cut_out(SnappedMesh mesh, ShadingTable shading, const int32_t[::1] triangles, int32_t[:, :, ::1] ids,
            float[:, :, ::1] depth, bint is_peeled, int64_t first_row, int64_t n_rows):
    """The kernel `cut_out`. The target is (1, H, W), or layers (K, H, W)."""
    cdef int64_t height = ids.shape[1], width = ids.shape[2]
    cdef tl_window window = mesh.window(first_row, n_rows, width)
    cdef tl_target target
    cdef tl_peeled peeled
    if n_rows == 0 or width == 0 or triangles.shape[0] == 0:
        return
    memset(&target, 0, sizeof(target))
    memset(&peeled, 0, sizeof(peeled))
    peeled.n_layers, peeled.is_farthest, peeled.plane_px = ids.shape[0], False, height * width
    peeled.ids, peeled.depth = &ids[0, first_row, 0], &depth[0, first_row, 0]
    target.sink, target.stride_px, target.n_samples = <tl_sink>(TL_SINK_PEEL if is_peeled else 4), width, n_rows * width  # 4: nearest
    target.pixels, target.depth, target.peeled = peeled.ids, peeled.depth, &peeled
    with nogil:
        K.cut_out(&mesh.snapped, &window, mesh.clip_view(), &shading.shading, &triangles[0], triangles.shape[0], &target)
    raise_if_given_up()
