"""What `topleft.torch` should return, in float64 loops over all pixels and triangles: slow, and written for reading."""

import math

import numpy as np


def planes(corners):
    """Rows a_i of a triangle (3, 4) in clip space: a_i . (x, y, 1) is 0 on the edge that corner i is not on."""
    xyw = corners[:, [0, 1, 3]]
    return np.stack([np.cross(xyw[1], xyw[2]), np.cross(xyw[2], xyw[0]), np.cross(xyw[0], xyw[1])])


def weights_at(corners, x, y):
    """Perspective-correct weights (3,) of a triangle at a point of [-1, 1]."""
    areas = planes(corners) @ [x, y, 1]
    return areas / areas.sum()


def center(i, j, height, width):
    """The centre of a pixel, row 0 at the bottom."""
    return (2 * j + 1) / width - 1, (2 * i + 1) / height - 1


def rasterize(pos, tri, height, width):
    """`rast` and `rast_db` of one picture, and where a centre is within 1/64 pixel of the line of an edge."""
    rast, rast_db = np.zeros((2, height, width, 4))
    is_close = np.zeros((height, width), bool)
    size = np.array([width / 2, height / 2])
    edges_of = [planes(pos[row]) for row in tri]
    slopes_of = [np.linalg.norm(edges[:, :2] / size, axis=1) for edges in edges_of]
    for i, j in np.ndindex(height, width):
        x, y = center(i, j, height, width)
        nearest = math.inf
        for k, (row, edges, slopes_px) in enumerate(zip(tri, edges_of, slopes_of, strict=True)):
            corners = pos[row]
            areas = edges @ [x, y, 1]
            is_close[i, j] |= bool((np.abs(areas) < slopes_px / 64).any())
            weights = areas / areas.sum()
            z, w = corners[:, 2:].T @ weights
            if (weights > 0).all() and w > 0 and -w <= z <= w and z / w < nearest:
                nearest = z / w
                rast[i, j] = [*weights[:2], z / w, k + 1]
                h = 1e-4 / width, 1e-4 / height
                by_x = (weights_at(corners, x + h[0], y) - weights_at(corners, x - h[0], y)) / 1e-4
                by_y = (weights_at(corners, x, y + h[1]) - weights_at(corners, x, y - h[1])) / 1e-4
                rast_db[i, j] = [by_x[0], by_y[0], by_x[1], by_y[1]]
    return rast, rast_db, is_close


def interpolate(attr, rast, tri):
    """Attributes (H, W, K) at the pixels of `rast` (H, W, 4)."""
    out = np.zeros((*rast.shape[:2], attr.shape[1]))
    for i, j in np.ndindex(rast.shape[:2]):
        u, v, _, id_plus_1 = rast[i, j]
        if id_plus_1 > 0:
            a, b, c = attr[tri[int(id_plus_1) - 1]]
            out[i, j] = u * a + v * b + (1 - u - v) * c
    return out


def texel(tex, i, j, boundary):
    """One texel (C,), also beyond the texture."""
    height, width = tex.shape[:2]
    if boundary == "wrap":
        return tex[i % height, j % width]
    if boundary == "clamp":
        return tex[min(max(i, 0), height - 1), min(max(j, 0), width - 1)]
    return tex[i, j] if 0 <= i < height and 0 <= j < width else np.zeros(tex.shape[2])


def nearest(tex, u, v, boundary):
    """The texel that a point lies in."""
    return texel(tex, math.floor(v * tex.shape[0]), math.floor(u * tex.shape[1]), boundary)


def linear(tex, u, v, boundary):
    """The mean of four texels by their share of a texel around the point."""
    x, y = u * tex.shape[1] - 0.5, v * tex.shape[0] - 0.5
    j, i = math.floor(x), math.floor(y)
    corners = [((y - i if di else 1 - y + i) * (x - j if dj else 1 - x + j), i + di, j + dj)
               for di in (0, 1) for dj in (0, 1)]  # fmt: skip
    return sum(share * texel(tex, row, column, boundary) for share, row, column in corners)


def halvings(tex):
    """All levels of a texture."""
    levels = [tex]
    while max(tex.shape[:2]) > 1:
        rows, columns = (2 if n > 1 else 1 for n in tex.shape[:2])
        tex = np.mean([tex[a::rows, b::columns] for a in range(rows) for b in range(columns)], axis=0)
        levels.append(tex)
    return levels


def trilinear(levels, u, v, uv_da, bias, boundary):
    """The two levels next to log2 of the longer axis of the footprint in texels."""
    height, width = levels[0].shape[:2]
    axes = np.linalg.svd(np.reshape(uv_da, (2, 2)) * [[width], [height]], compute_uv=False)
    level = min(max((math.log2(axes[0]) if axes[0] else -math.inf) + bias, 0), len(levels) - 1)
    k = min(int(level), len(levels) - 2) if len(levels) > 1 else 0
    low = linear(levels[k], u, v, boundary)
    return low if len(levels) == 1 else low + (level - k) * (linear(levels[k + 1], u, v, boundary) - low)


def is_silhouette(pos, tri, k, i):
    """Whether no triangle lies on the other side of the edge of triangle k that its corner i is not on."""
    a, b = tri[k][(i + 1) % 3], tri[k][(i + 2) % 3]
    own = np.linalg.det(pos[[a, b, tri[k][i]]][:, [0, 1, 3]])
    for other, row in enumerate(tri):
        if other != k and {a, b} <= set(row.tolist()):
            (across,) = set(row.tolist()) - {a, b}
            if np.linalg.det(pos[[a, b, across]][:, [0, 1, 3]]) * own <= 0:
                return False
    return True


def antialias(color, rast, pos, tri):
    """The picture (H, W, C), blended across silhouettes."""
    height, width = rast.shape[:2]
    out = color.copy()
    px = (pos[:, :2] / pos[:, 3:] + 1) * [width / 2, height / 2]
    for i, j in np.ndindex(height, width):
        for di, dj in ((0, 1), (1, 0)):
            if i + di == height or j + dj == width or rast[i, j, 3] == rast[i + di, j + dj, 3]:
                continue
            sides = sorted([(rast[p][3] == 0, rast[p][2], p) for p in ((i, j), (i + di, j + dj))])
            near, far = sides[0][2], sides[1][2]
            axis = 0 if dj else 1
            start, sign = np.array([near[1], near[0]]) + 0.5, 1 if far > near else -1
            k = int(rast[near][3]) - 1
            crossings = []
            for corner in range(3):
                p, q = px[tri[k][(corner + 1) % 3]] - start, px[tri[k][(corner + 2) % 3]] - start
                rise, run = q[1 - axis] - p[1 - axis], q[axis] - p[axis]
                if (p[1 - axis] <= 0) != (q[1 - axis] <= 0) and abs(rise) > abs(run) and is_silhouette(
                    pos, tri, k, corner
                ):  # fmt: skip
                    crossings.append(sign * (p[axis] - p[1 - axis] * run / rise))
            t = max(crossings, default=-1)
            if -1 / 16 < t < 17 / 16:
                t = min(max(t, 0), 1)
                if t > 0.5:
                    out[far] += (t - 0.5) * (color[near] - color[far])
                else:
                    out[near] += (0.5 - t) * (color[far] - color[near])
    return out


def straight_through(color, grad, rast, pos, tri):
    """The gradient of `pos` (V, 4) by S. Pidhorskyi et al., Rasterized Edge Gradients, 2024; no two triangles cut."""
    ids, made, size = rast[..., 3].astype(int) - 1, np.zeros_like(pos), np.array(color.shape[1::-1])
    place = (pos[:, :2] / pos[:, 3:] / 2 + 0.5) * size - 0.5

    def hangs_over(pixel, beside):
        """Whether the triangle of a pixel hides that of the pixel beside it, or nothing, and ends before it."""
        if min(ids[pixel], ids[beside]) < 0:
            return ids[pixel] >= 0
        return is_inside(ids[beside], pixel) and not is_inside(ids[pixel], beside)

    def is_inside(triangle, pixel):
        a, b, c = place[tri[triangle]] - pixel[::-1]
        turns = [p[0] * q[1] - p[1] * q[0] for p, q in ((a, b), (b, c), (c, a))]
        return min(turns) > 0 or max(turns) < 0

    for axis, step in ((0, (0, 1)), (1, (1, 0))):
        for y, x in np.ndindex(color.shape[0] - step[0], color.shape[1] - step[1]):
            one, other = (y, x), (y + step[0], x + step[1])
            if ids[one] == ids[other]:
                continue
            amount = ((color[one] - color[other]) * (grad[one] + grad[other])).sum() / 2
            for pixel, beside in ((one, other), (other, one)):
                if hangs_over(pixel, beside):
                    u, v = rast[pixel][:2]
                    for corner, weight in zip(tri[ids[pixel]], (u, v, 1 - u - v), strict=True):
                        by_axis = amount * weight * size[axis] / 2 / pos[corner, 3]
                        made[corner, axis] += by_axis
                        made[corner, 3] -= by_axis * pos[corner, axis] / pos[corner, 3]
    return made
