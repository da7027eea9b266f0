"""`topleft.compat.pytorch3d`: what PyTorch3D documents, without it; gradients where PyTorch is installed."""

from types import SimpleNamespace

import numpy as np
import pytest

from topleft.compat import pytorch3d as p3d

SIZE = (9, 12)
"""Height and width: x goes from 4/3 to -4/3, y from 1 to -1."""

# what rasterize_meshes of PyTorch3D returns of two faces, 6x6 pixels, two faces a pixel
FACES = [[0.7, -0.8, 1.5], [-0.9, -0.5, 2.5], [0.1, 0.9, 1.0], [0.9, 0.1, 2.0], [-0.4, -0.9, 0.5], [-0.8, 0.8, 3.0]]
RECORDED_IDS = [
    [[-1, -1], [-1, -1], [-1, -1], [-1, -1], [-1, -1], [-1, -1]],
    [[-1, -1], [-1, -1], [0, -1], [0, 1], [1, -1], [-1, -1]],
    [[-1, -1], [1, -1], [0, 1], [1, 0], [1, -1], [-1, -1]],
    [[-1, -1], [1, -1], [1, 0], [1, 0], [1, 0], [-1, -1]],
    [[-1, -1], [0, -1], [0, -1], [1, 0], [0, -1], [0, -1]],
    [[-1, -1], [-1, -1], [-1, -1], [-1, -1], [-1, -1], [-1, -1]],
]


def random_mesh(seed=0, n=14):
    rng = np.random.default_rng(seed)
    verts = rng.uniform([-1.4, -1.1, 0.5], [1.4, 1.1, 4], (3 * n, 3)).astype(np.float32)
    return verts, np.arange(3 * n).reshape(-1, 3)


def by_hand(verts, faces, size, k, perspective, culls=False):
    """Each pixel and each face: weights from areas, in space by 1 / z; distances to the lines of the edges."""
    height, width = size
    half = max(width / height, 1), max(height / width, 1)
    found = []
    for row in range(height):
        for column in range(width):
            p = np.array([half[0] * (1 - (2 * column + 1) / width), half[1] * (1 - (2 * row + 1) / height)])
            hits = []
            for f, corners in enumerate(verts[faces].astype(float)):
                (a, b, c), z = corners[:, :2], corners[:, 2]
                area = cross(b - a, c - a)
                weights = np.array([cross(b - p, c - p), cross(c - p, a - p), cross(a - p, b - p)]) / area
                if weights.min() <= 0 or (culls and area > 0):
                    continue
                sides = [(a, b), (b, c), (c, a)]
                gap = min(cross(p - s, e - s) ** 2 / ((e - s) ** 2).sum() for s, e in sides)
                weights = weights / z / (weights / z).sum() if perspective else weights
                hits.append((weights @ z, f, weights, -gap))
            found.append((sorted(hits, key=lambda hit: hit[:2]) + [(-1, -1, [-1] * 3, -1)] * k)[:k])
    shape = (1, height, width, k)
    parts = zip(*[hit for hits in found for hit in hits], strict=True)
    zbuf, ids, bary, dists = (np.array(part, float) for part in parts)
    return ids.reshape(shape), zbuf.reshape(shape), bary.reshape(*shape, 3), dists.reshape(shape)


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


class Meshes:
    """What `rasterize_meshes` and `MeshRasterizer` ask of `pytorch3d.structures.Meshes`, of one mesh."""

    def __init__(self, verts, faces):
        self.verts, self.faces = verts, faces

    def __len__(self):
        return 1

    def verts_packed(self):
        return self.verts

    def faces_packed(self):
        return self.faces

    def num_faces_per_mesh(self):
        return np.array([len(self.faces)])

    def verts_padded(self):
        return self.verts[None]

    def update_padded(self, new_verts_padded):
        return Meshes(new_verts_padded[0], self.faces)


@pytest.mark.parametrize("size", [SIZE, (12, 9), 8])
@pytest.mark.parametrize("perspective", [False, True])
@pytest.mark.parametrize("k", [1, 3])
def test_arrays_are_those_of_each_pixel_and_face_by_hand(size, perspective, k):
    mesh = random_mesh()
    found = p3d.rasterize_meshes([mesh], size, 0.0, k, perspective_correct=perspective)
    expected = by_hand(*mesh, size if isinstance(size, tuple) else (size, size), k, perspective)
    assert (expected[0] >= 0).sum() > 30
    assert np.array_equal(found[0], expected[0])
    for ours, theirs in zip(found[1:], expected[1:], strict=True):
        assert ours.dtype == np.float32
        assert np.allclose(ours, theirs, rtol=1e-6, atol=1e-7)


def test_ids_are_those_that_pytorch3d_returns():
    ids, *_ = p3d.rasterize_meshes([(FACES, [[0, 1, 2], [3, 4, 5]])], 6, 0.0, 2, perspective_correct=True)
    assert ids.tolist() == [RECORDED_IDS]
    assert ids.dtype == np.int64


def test_culled_faces_are_those_that_run_clockwise():
    mesh = random_mesh(1)
    ids, *_ = p3d.rasterize_meshes([mesh], SIZE, 0.0, 2, cull_backfaces=True)
    expected, *_ = by_hand(*mesh, SIZE, 2, perspective=False, culls=True)
    assert np.array_equal(ids, expected)
    assert (ids >= 0).sum() < (p3d.rasterize_meshes([mesh], SIZE, 0.0, 2)[0] >= 0).sum()


def test_faces_are_counted_through_all_meshes():
    first, second = random_mesh(2), random_mesh(3, 5)
    empty = np.zeros((0, 3)), np.zeros((0, 3), int)
    ids, zbuf, *_ = p3d.rasterize_meshes([first, empty, second], SIZE, 0.0, 1)
    alone = [p3d.rasterize_meshes([mesh], SIZE, 0.0, 1) for mesh in (first, second)]
    assert np.array_equal(ids[0], alone[0][0][0])
    assert (ids[1] == -1).all()
    assert np.array_equal(ids[2], np.where(alone[1][0][0] < 0, -1, alone[1][0][0] + len(first[1])))
    assert np.array_equal(zbuf[2], alone[1][1][0])


def test_centre_on_an_edge_does_not_belong_to_the_face():
    """Of 4x4 pixels the diagonal of a square runs through centres; what lies behind shows there, and both at k = 2."""
    square = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]
    behind = [[9, -9, 3], [-9, -9, 3], [0, 9, 3]]
    mesh = [*square, *behind], [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    ids, zbuf, *_ = p3d.rasterize_meshes([mesh], 4, 0.0, 1)
    upper = np.triu(np.ones((4, 4)), 1)
    assert np.array_equal(ids[0, ..., 0], np.where(upper, 0, 1) + np.eye(4))
    assert zbuf[0, 2, 2, 0] == 3
    ids, *_ = p3d.rasterize_meshes([mesh], 4, 0.0, 2)
    assert ids[0, 1, 1].tolist() == [2, -1]
    assert ids[0, 1, 2].tolist() == [0, 2]


@pytest.mark.parametrize("perspective", [False, True])
def test_faces_behind_the_eye_are_not_seen(perspective):
    verts, faces = random_mesh()
    ids, zbuf, bary, dists = p3d.rasterize_meshes(
        [(verts - np.float32([0, 0, 9]), faces)], SIZE, 0.0, 2, perspective_correct=perspective
    )
    assert all((part == -1).all() for part in (ids, zbuf, bary, dists))


def test_face_that_reaches_behind_the_eye_is_cut_at_the_value():
    """A wall 1 to the left, from 2 behind the eye to 6 before it: x = 1 / z on the screen."""
    space = np.array([[1, -9, -2], [1, -9, 6], [1, 9, 6], [1, 9, -2.0]])
    verts = np.column_stack([space[:, :2] / space[:, 2:], space[:, 2]]).astype(np.float32)
    mesh = verts, [[0, 1, 2], [0, 2, 3]]
    _, zbuf, bary, _ = p3d.rasterize_meshes([mesh], 16, 0.0, 1, perspective_correct=True, z_clip_value=1.5)
    x = 1 - (2 * np.arange(16) + 1) / 16
    expected = np.where((x > 1 / 6) & (x < 1 / 1.5), 1 / x, -1)
    assert np.allclose(zbuf[0, ..., 0], expected, rtol=1e-5)
    assert np.allclose(bary[0, :, 4].sum(axis=-1), 1)


def test_rasterizer_takes_places_and_perspective_from_cameras():
    """Cameras that halve what they see and stand 1 behind: near 4.4 cuts at 2.2, and options of the call come first."""
    world, faces = random_mesh(4)
    moved = world + np.float32([0, 0, 1])
    camera = SimpleNamespace(
        transform_points_ndc=lambda points, eps=None: points / np.float32([2, 2, 1]),
        get_world_to_view_transform=lambda: SimpleNamespace(transform_points=lambda points, eps: points + [0, 0, 1]),
        is_perspective=lambda: True,
        get_znear=lambda: 4.4,
    )
    cameras = type("Cameras", (SimpleNamespace,), {"__len__": lambda self: 1})(**vars(camera))
    settings = p3d.RasterizationSettings(image_size=SIZE, faces_per_pixel=2)
    frags = p3d.MeshRasterizer(cameras, settings)(Meshes(world.copy(), faces))
    verts = np.column_stack([world[:, :2] / 2, moved[:, 2]])
    expected = p3d.rasterize_meshes([(verts, faces)], SIZE, 0.0, 2, perspective_correct=True, z_clip_value=2.2)
    for name, part in zip(("pix_to_face", "zbuf", "bary_coords", "dists"), expected, strict=True):
        assert np.array_equal(getattr(frags, name), part)
    assert (frags.zbuf[frags.zbuf >= 0] >= 2.2).all()
    flat = p3d.RasterizationSettings(image_size=12, perspective_correct=False, z_clip_value=0.5)
    other = p3d.MeshRasterizer(cameras, settings)(Meshes(world.copy(), faces), raster_settings=flat)
    assert other.zbuf.shape == (1, 12, 12, 1)
    assert other.zbuf[other.zbuf >= 0].min() < 2.2


def test_rasterizer_without_cameras_is_refused():
    with pytest.raises(ValueError, match="cameras must be given to the rasterizer or to the call, got None"):
        p3d.MeshRasterizer()(Meshes(*random_mesh()))
    with pytest.raises(ValueError, match="cameras must be 1, or 1 as the meshes, got 3"):
        p3d.MeshRasterizer(cameras=[1, 2, 3])(Meshes(*random_mesh()))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"blur_radius": 0.1}, "blur_radius must be 0, got 0.1"),
        ({"faces_per_pixel": 17}, "faces_per_pixel must lie in 1 to 16, got 17"),
        ({"faces_per_pixel": 0}, "faces_per_pixel must lie in 1 to 16, got 0"),
    ],
)
def test_what_is_not_drawn_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        p3d.rasterize_meshes([random_mesh()], 8, **options)


@pytest.mark.parametrize("perspective", [False, True])
def test_tensors_have_the_gradients_of_finite_differences(perspective):
    torch = pytest.importorskip("torch")
    verts, faces = random_mesh(5, 4)
    generator = np.random.default_rng(0)
    of_z, of_bary, of_dists = (
        generator.normal(size=shape) for shape in ((1, *SIZE, 2), (1, *SIZE, 2, 3), (1, *SIZE, 2))
    )

    def loss(points):
        mesh = Meshes(points, torch.tensor(faces))
        ids, zbuf, bary, dists = p3d.rasterize_meshes(mesh, SIZE, 0.0, 2, perspective_correct=perspective)
        assert ids.dtype == torch.int64
        parts = zip((zbuf, bary, dists), (of_z, of_bary, of_dists), strict=True)
        return sum((part.double() * torch.tensor(by)).sum() for part, by in parts), ids

    tensor = torch.tensor(verts, requires_grad=True)
    value, ids = loss(tensor)
    value.backward()
    step = 1e-4
    for i, column in ((0, 0), (4, 1), (7, 2), (10, 0)):
        moved = [torch.tensor(verts), torch.tensor(verts)]
        for own, sign in zip(moved, (1, -1), strict=True):
            own[i, column] += sign * step
        (high, ids_high), (low, ids_low) = (loss(own) for own in moved)
        assert (ids == ids_high).all()
        assert (ids == ids_low).all()
        width = float(moved[0][i, column] - moved[1][i, column])
        assert float(tensor.grad[i, column]) == pytest.approx(float(high - low) / width, rel=2e-2, abs=2e-2)
