"""The picture of a scene by the plainest loop there is: each triangle against every sample of its box, in int64.

In: vertices in fixed point. Out: counts, and ids by each depth test. Nothing is shared with the engine or the exact
reference, nor are its ideas: no tiles, no spans, no half-open boxes, no order of drawing. NumPy runs the loop over
blocks of triangles whose boxes have about the same size.
"""

from dataclasses import dataclass, field

import numpy as np

DEPTH_TESTS = ("less", "greater", None)
BLOCK_SAMPLES = 2**18  # at a time: what the second-level cache holds
NOTHING = np.iinfo(np.int64).max
LIMIT = 2**30  # of doubled coordinates: a product of two differences stays below 2**62


def snap(vertices, bits=8):
    """Fixed point (V, 2) int64 and depth (V,) float64 of vertices in pixels: ties to even."""
    vertices = np.asarray(vertices)
    if vertices.dtype.kind in "iu":
        xy_fx = vertices[:, :2].astype(np.int64) << bits
    else:
        xy_fx = np.rint(vertices[:, :2].astype(np.float64) * 2.0**bits).astype(np.int64)
    z = vertices[:, 2] if vertices.shape[1] > 2 else np.zeros(len(vertices))
    return xy_fx, z.astype(np.float64)


def project(vertices, viewport, bits=8, transform=None):
    """The same for vertices in clip space, or in object space with a transform; all inside the clip planes."""
    vertices = np.asarray(vertices)
    if transform is not None:
        m, (x, y, z) = np.asarray(transform, vertices.dtype), vertices.T
        vertices = np.stack([((m[k, 0] * x + m[k, 1] * y) + m[k, 2] * z) + m[k, 3] for k in range(4)], -1)
    x, y, z, w = vertices.astype(np.float64).T
    assert ((w > 0) & (abs(z) <= w)).all(), "the loop does not clip"
    x_px, y_px = (x / w + 1) * (viewport[0] / 2), (1 - y / w) * (viewport[1] / 2)
    xy_fx = np.rint(np.stack([x_px, y_px], -1) * 2.0**bits).astype(np.int64)
    return xy_fx, (z / w + 1) * 0.5


@dataclass
class Loop:
    """A set-up scene and its picture. Corners are doubled, relative to the window's first sample, and turn clockwise
    as seen (y down); `step` is a pixel in their unit."""

    xy: np.ndarray  # (T, 3, 2) int64
    z: np.ndarray  # (T, 3) float64
    id: np.ndarray  # (T,) of triangles that are neither culled nor degenerate
    step: int
    size: tuple[int, int]
    tests: tuple
    counts: np.ndarray = field(init=False)
    ids: dict = field(init=False)

    def __post_init__(self):
        shape = self.size[::-1]
        self.counts = np.zeros(shape, np.int32)
        self.ids, self._keys = {}, {test: np.full(shape, NOTHING) for test in self.tests}
        for i, row0, col0, n_rows, n_cols in self._blocks():
            if len(i) == 1 and np.ptp(self.z[i]) == 0:
                self._put_level_box(i, row0, col0, n_rows, n_cols)
            else:
                self._put_samples(i, row0, col0, n_rows, n_cols)
        for test in self.tests:
            key = self._keys.pop(test)
            ids = -key if test is None else key & 0xFFFFFFFF
            self.ids[test] = np.where(key == NOTHING, -1, ids).astype(np.int32)

    def _put_samples(self, i, row0, col0, n_rows, n_cols):
        """Draw any triangles: a list of the samples that they cover."""
        rows, cols, inside = self._inside(i, row0, col0, n_rows, n_cols)
        k, row, col = np.nonzero(inside)
        rows, cols = rows[k, row], cols[k, col]
        pixels = rows * self.size[0] + cols
        np.add.at(self.counts.reshape(-1), pixels, 1)
        z = self.z[i[k], 0] if (self.z[i] == self.z[i, :1]).all() else self._depth(i[k], rows, cols)
        for test, keys in self._keys.items():
            np.minimum.at(keys.reshape(-1), pixels, sort_key(test, z, self.id[i[k]]))

    def _put_level_box(self, i, row0, col0, n_rows, n_cols):
        """Draw one triangle of one depth."""
        box = slice(row0[0], row0[0] + n_rows), slice(col0[0], col0[0] + n_cols)
        inside = self._inside(i, row0, col0, n_rows, n_cols)[2][0][: self.size[1] - row0[0], : self.size[0] - col0[0]]
        self.counts[box] += inside
        for test, keys in self._keys.items():
            key = sort_key(test, self.z[i, 0], self.id[i])
            np.copyto(keys[box], key, where=inside & (key < keys[box]))

    def _blocks(self):
        """Triangles, the first samples of their boxes in the window, and one size that holds these boxes."""
        width, height = self.size
        low, high = self.xy.min(1), self.xy.max(1)
        first = np.clip(-(-low // self.step), 0, None)
        end = np.minimum(high // self.step + 1, [width, height])  # the last column and row too: E decides, not the box
        cols, rows = (end - first).T
        seen = (cols > 0) & (rows > 0)
        is_small = seen & (cols <= 64) & (rows <= 64)
        ceiling = (2 ** np.ceil(np.log2(np.where(is_small[:, None], end - first, 1)))).astype(np.int64)
        for n_cols, n_rows in np.unique(ceiling[is_small], axis=0).tolist():
            alike = np.flatnonzero(is_small & (ceiling == (n_cols, n_rows)).all(1))
            n = max(1, BLOCK_SAMPLES // (n_cols * n_rows))
            for some in np.split(alike, range(n, len(alike), n)):
                yield some, first[some, 1], first[some, 0], n_rows, n_cols
        for i in np.flatnonzero(seen & ~is_small)[:, None]:
            n_rows = max(1, BLOCK_SAMPLES // int(cols[i[0]]))
            for row in range(int(first[i[0], 1]), int(end[i[0], 1]), n_rows):
                yield i, np.array([row]), first[i, 0], min(n_rows, int(end[i[0], 1]) - row), int(cols[i[0]])

    def _inside(self, i, row0, col0, n_rows, n_cols):
        """Rows (n, n_rows) and columns (n, n_cols) of the boxes, and which of their samples are covered."""
        width, height = self.size
        rows, cols = row0[:, None] + np.arange(n_rows), col0[:, None] + np.arange(n_cols)
        inside = (rows < height)[:, :, None] & (cols < width)[:, None, :]
        corners = self.xy[i]
        for a in range(3):
            along_rows, along_cols, is_top_left = self._edge(corners, a, rows, cols)
            inside &= along_rows[:, :, None] >= (along_cols + ~is_top_left[:, None])[:, None, :]
        return rows, cols, inside

    def _edge(self, corners, a, rows, cols):
        """The edge function from corner a to the next, as a difference of a term of the row and one of the column."""
        start, end = corners[:, a], corners[:, (a + 1) % 3]
        dx, dy = (end - start).T[:, :, None]
        is_top_left = (dy < 0) | ((dy == 0) & (dx > 0))
        return dx * (rows * self.step - start[:, 1:]), dy * (cols * self.step - start[:, :1]), is_top_left[:, 0]

    def _depth(self, i, rows, cols):
        """Depth at samples of triangles, by exact weights in float64; exact when the corners are level."""
        corners, z = self.xy[i], self.z[i]
        weights = []
        for a in range(3):
            along_rows, along_cols, _ = self._edge(corners, a, rows[:, None], cols[:, None])
            weights.append((along_rows - along_cols)[:, 0])
        area = (weights[0] + weights[1] + weights[2]).astype(np.float64)
        slope = weights[2] * (z[:, 1] - z[:, 0]) + weights[0] * (z[:, 2] - z[:, 0])
        return z[:, 0] + slope / area

    def depth(self, ids):
        """Depth in float64 of the triangles `ids` at their pixels, NaN for -1; and the largest |z| of their corners."""
        place = np.zeros(self.id.max(initial=0) + 1, np.int64)
        place[self.id] = np.arange(len(self.id))
        rows, cols = np.nonzero(ids >= 0)
        i = place[ids[rows, cols]]
        depth, largest = np.full(ids.shape, np.nan), np.full(ids.shape, np.nan)
        depth[rows, cols], largest[rows, cols] = self._depth(i, rows, cols), abs(self.z[i]).max(1)
        return depth, largest


def sort_key(test, z, ids):
    """A number that is least for the triangle that wins: by float32 depth, then by id; without a test the last."""
    if test is None:
        return -ids
    nearer = z.astype(np.float32) + np.float32(0)  # -0 and 0 are equal
    bits = (nearer if test == "less" else -nearer + np.float32(0)).view(np.int32)
    ordered = np.where(bits < 0, bits ^ 0x7FFFFFFF, bits).astype(np.int64)
    return ordered << 32 | ids


def draw(xy_fx, z, triangles, size, *, bits=8, origin=(0, 0), cull="none", tests=DEPTH_TESTS):
    """The picture of fixed-point vertices (V, 2) with depths (V,)."""
    triangles = np.asarray(triangles).reshape(-1, 3)
    first_sample = 2 * (np.array(origin, np.int64) << bits) + (1 << bits)
    xy, z = 2 * xy_fx[triangles] - first_sample, z[triangles]
    assert abs(xy).max(initial=0) < LIMIT, "edge functions must fit 63 bits"
    (x0, y0), (x1, y1), (x2, y2) = xy.transpose(1, 2, 0)
    area = (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0)
    kept = np.flatnonzero({"none": area != 0, "back": area < 0, "front": area > 0}[cull])
    order = np.where(area[kept, None] < 0, [0, 2, 1], [0, 1, 2])
    xy, z = np.take_along_axis(xy[kept], order[:, :, None], 1), np.take_along_axis(z[kept], order, 1)
    return Loop(xy, z, kept, 2 << bits, size, tests)


def draw_scene(scene, tests=DEPTH_TESTS):
    """The picture of a `strategies.Scene`, in pixels or in clip space."""
    view = dict(scene.view)
    bits, transform, viewport = view.get("subpixel_bits", 8), view.get("transform"), view.get("viewport", scene.size)
    if transform is not None or scene.vertices.shape[1] == 4:
        xy_fx, z = project(scene.vertices, viewport, bits, transform)
    else:
        xy_fx, z = snap(scene.vertices, bits)
    options = {"origin": view.get("origin", (0, 0)), "cull": view.get("cull", "none"), "tests": tests}
    return draw(xy_fx, z, scene.triangles, scene.size, bits=bits, **options)
