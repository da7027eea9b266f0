"""Environments: directions, blurred levels against sums over all directions, and their errors."""

import pickle

import numpy as np
import pytest
import shading_reference as reference

import topleft as tl
from topleft._meshes.model import environment as module
from topleft._meshes.model.normals import unit_or_zero

RNG = np.random.default_rng(4)
DIRECTIONS = unit_or_zero(RNG.normal(size=(300, 3)))


def sphere(n=200):
    """Directions all round and their solid angles."""
    height = (2 * np.arange(n) + 1) / n - 1
    around = 2 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    y, turn = (a.ravel() for a in np.meshgrid(height, around, indexing="ij"))
    across = np.sqrt(1 - y * y)
    return np.c_[across * np.cos(turn), y, across * np.sin(turn)], 4 * np.pi / len(y)


def facets(cosine, roughness):
    """How much light a rough surface takes from directions at this angle round the one that it mirrors."""
    alpha2 = roughness**4
    return np.maximum(cosine, 0) * alpha2 / ((1 + cosine) / 2 * (alpha2 - 1) + 1) ** 2


def test_a_constant_stays_constant_on_all_levels():
    texels, rows = tl.Environment(image=np.full((16, 32, 3), 0.25)).levels
    assert len(rows) == module.N_ROUGH + 2
    assert np.abs(texels[:, :3] - 0.25).max() < 1e-6


def test_levels_are_the_mean_over_the_facets():
    image = np.kron(RNG.random((4, 8, 3)), np.ones((16, 16, 1)))
    texels, rows = tl.Environment(image=image).levels
    at, angle = sphere()
    light = module.look_up_sphere(image.astype(np.float32), at.astype(np.float32))
    some = DIRECTIONS[::4]
    for roughness in (0.25, 0.5, 0.75, 1.0):
        weights = facets(some @ at.T, roughness) * angle
        expected = weights @ light / weights.sum(axis=1, keepdims=True)
        got = reference.octahedral(texels, rows[int(roughness * module.N_ROUGH)], some)
        # 64 directions, and texels between which light is linear; a picture of blocks of 22 degrees, light of 0 to 1
        assert np.abs(got - expected).max() < 0.03
        assert np.abs(got - expected).mean() < 0.006


def test_the_matt_level_is_the_mean_by_the_cosine():
    image = RNG.random((24, 48, 3))
    texels, rows = tl.Environment(image=image).levels
    at, angle = sphere()
    light = module.look_up_sphere(image.astype(np.float32), at.astype(np.float32))
    expected = np.maximum(DIRECTIONS @ at.T, 0) @ light * angle / np.pi
    assert np.abs(reference.octahedral(texels, rows[-1], DIRECTIONS) - expected).max() < 0.01


def test_level_of_the_mirror_is_the_picture():
    y, x = np.mgrid[:64, :128]
    image = np.stack([x / 128, y / 64, np.zeros_like(x)], axis=2)  # but for the seam at x = 0
    texels, rows = tl.Environment(image=image).levels
    at = DIRECTIONS[np.abs(np.arctan2(DIRECTIONS[:, 2], DIRECTIONS[:, 0])) < 3]
    got = reference.octahedral(texels, rows[0], at)
    assert np.abs(got - module.look_up_sphere(image.astype(np.float32), at.astype(np.float32))).max() < 0.02


@pytest.mark.parametrize("roughness", [0.05, 0.2, 0.4, 0.6, 0.8, 1.0])
def test_the_blurred_horizon_is_the_mean_over_the_facets(roughness):
    at = np.linspace(-0.98, 0.98, 21)
    # round the mirrored direction: rings of the half sphere, by how much of each lies above the horizon
    ring = (np.arange(40000) + 0.5) / 40000 * np.pi / 2
    cosine, sine = np.cos(ring), np.sin(ring)
    weights = facets(cosine, roughness) * sine
    cut = np.clip(-at[:, None] * cosine / (np.sqrt(1 - at[:, None] ** 2) * sine), -1, 1)
    above = np.arccos(cut) / np.pi
    expected = above @ weights / weights.sum()
    assert np.abs(reference.blurred_sky(at, roughness) - expected).max() < 0.007


UPS = [
    ((0, 1, 0), (0, 1, 0), True),
    ((0, 0, 1), (0, 0, 1), True),
    ((0, -1, 0), (0, 1, 0), False),
    ((1, 1, 0), (-1, -1, 0), False),
]


@pytest.mark.parametrize(("up", "at", "is_up"), UPS)
def test_up_is_where_the_sky_is(up, at, is_up):
    environment = tl.Environment((255, 255, 255), ground=(0, 0, 0), up=up)
    light = reference.environment_light(environment, np.array([at], float), None)
    assert light[0, 0] == pytest.approx(float(is_up), abs=1e-12)


def test_a_picture_is_laid_round_the_world():
    # middle column: +x, a quarter to its left -z, row 0 on top; turned by 90 degrees the middle looks along -z
    image = np.zeros((32, 64, 3))
    image[14:18, 30:34, 0] = 1
    image[14:18, 14:18, 1] = 1
    image[:3, :, 2] = 1

    def brightest(environment, channel):
        texels, row = environment.levels[0], environment.levels[1][0]
        return reference.octahedral(texels, row, DIRECTIONS_OF_AXES @ environment.axes.T)[:, channel].argmax()

    axes = ["+x", "-x", "+y", "-y", "+z", "-z"]
    DIRECTIONS_OF_AXES = np.kron(np.eye(3), [[1], [-1]])
    straight, turned = tl.Environment(image=image), tl.Environment(image=image, turn=90)
    assert [axes[brightest(straight, c)] for c in range(3)] == ["+x", "-z", "+y"]
    assert [axes[brightest(turned, c)] for c in range(3)] == ["-z", "-x", "+y"]


def test_space_eye_moves_with_the_camera():
    mesh = tl.Mesh(*tl.scenes.shape("sphere"))
    sky = tl.Environment((255, 255, 255), ground=(0, 0, 0), space="eye")
    pictures = [tl.render(mesh, tl.Camera.look_at(eye, up=up), (64, 64), environment=sky)
                for eye, up in (((0, 0, 4), (0, 1, 0)), ((0, 4, 0), (1, 0, 0)))]  # fmt: skip
    assert np.abs(pictures[0].astype(int) - pictures[1]).mean() < 2  # the sphere is made of triangles
    assert pictures[0][10, 32, 0] > pictures[0][54, 32, 0] + 50


def test_bytes_are_srgb_and_floats_are_light():
    assert tl.Environment(image=np.full((2, 4, 3), 188, np.uint8)).image[0, 0, 0] == pytest.approx(0.503, abs=1e-3)
    assert tl.Environment(image=np.full((2, 4, 3), 7.0)).image[0, 0, 0] == 7


def test_environment_goes_to_another_process():
    environment = tl.Environment(image=RNG.random((8, 16, 3)), turn=10)
    levels = environment.levels
    again = pickle.loads(pickle.dumps(environment))
    assert np.array_equal(again.levels[0], levels[0])


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: tl.Environment((1, 2)), ValueError, "sky must be 3 numbers of 0 to 255, got"),
        (lambda: tl.Environment(ground=(1, 2, 300)), ValueError, "ground must be 3 numbers of 0 to 255, got"),
        (lambda: tl.Environment(up=(0, 0, 0)), ValueError, r"up must be a direction, got \(0.0, 0.0, 0.0\)"),
        (lambda: tl.Environment(turn=np.nan), ValueError, "turn must be finite, got nan"),
        (lambda: tl.Environment(intensity=-1), ValueError, "intensity must be finite and not negative, got -1"),
        (lambda: tl.Environment(space="room"), ValueError, "space must be one of 'world', 'eye', got 'room'"),
        (lambda: tl.Environment(image=np.ones((4, 4))), ValueError, r"image must have shape \(H, W, 3\) and pixels"),
        (lambda: tl.Environment(image=np.ones((0, 4, 3))), ValueError, r"image must have shape \(H, W, 3\) and pixels"),
        (lambda: tl.Environment(image=-np.ones((4, 4, 3))), ValueError, "image must hold finite light"),
        (lambda: tl.Environment(image=np.ones((4, 4, 3), int)), TypeError, "image must be uint8 or float, got int64"),
        (lambda: tl.render(tl.Mesh(*tl.scenes.shape("cube")), environment=(1, 2, 3)), TypeError,
         "environment must be an Environment, got tuple"),
    ],
)  # fmt: skip
def test_wrong_environments_are_named(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_environment_is_white_unless_told():
    assert repr(tl.Environment()) == repr(tl.Environment((255, 255, 255), intensity=1.0, up=(0.0, 1.0, 0.0), turn=0.0))
