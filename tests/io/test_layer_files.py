"""Layers in files: what a file holds is what its notes say."""

import numpy as np
import pytest
from comparing import assert_same
from PIL import Image

import topleft as tl
from topleft import scenes
from topleft._meshes.io.layer_files import save_layers
from topleft._meshes.picture.view_layers import ViewLayers, render_layers
from topleft.errors import ImageError

SIZE = (64, 48)
KNOT = tl.Mesh(*scenes.shape("torus-knot"))
NAMES = (
    "color", "alpha", "silhouette", "depth", "distance", "triangle", "barycentric", "world_position", "world_normal",
)  # fmt: skip


@pytest.fixture(scope="module")
def layers():
    return render_layers(KNOT, None, SIZE, layers=NAMES, cull="back")


def numbers_of(path):
    """What a PNG says that its values stand for, the size of a step, and where there is nothing."""
    with Image.open(path) as image:
        values = np.asarray(image).astype(float)
        scale, offset = (float(image.text[f"topleft:{name}"]) for name in ("scale", "offset"))
    return offset + scale * values, scale, values == 0


def test_save_layers_npz_keeps_all_of_them(layers, tmp_path):
    assert save_layers(tmp_path / "a.npz", layers, matrix=np.eye(4)) == (tmp_path / "a.npz",)
    with np.load(tmp_path / "a.npz") as arrays:
        assert sorted(arrays) == sorted([*NAMES, "clip_from_world"])
        assert all(np.array_equal(arrays[name], layers[name], equal_nan=name != "color") for name in NAMES)


def test_save_layers_npy_keeps_each(layers, tmp_path):
    for path in save_layers(tmp_path / "{layer}.npy", layers):
        assert np.array_equal(np.load(path), layers[path.stem], equal_nan=path.stem != "color")


@pytest.mark.parametrize("suffix", [".tiff", ".tif"])
def test_save_layers_tiff_keeps_numbers(layers, tmp_path, suffix):
    wanted = {name: layers[name] for name in ("color", "alpha", "depth", "distance", "triangle")}
    for path in save_layers(tmp_path / f"{{layer}}{suffix}", wanted):
        with Image.open(path) as image:
            assert_same(np.asarray(image), layers[path.stem])


def test_save_layers_tiff_has_a_page_for_each_channel(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.tif", {"world_position": layers["world_position"]})
    with Image.open(path) as file:
        assert file.n_frames == 3
        for k in range(3):
            file.seek(k)
            assert np.array_equal(np.asarray(file), layers["world_position"][..., k], equal_nan=True)


@pytest.mark.parametrize("suffix", [".tif", ".png"])
def test_save_layers_mask_is_0_and_255(layers, tmp_path, suffix):
    (path,) = save_layers(tmp_path / f"a{suffix}", {"silhouette": layers["silhouette"]})
    with Image.open(path) as image:
        assert_same(np.asarray(image), layers["alpha"])


def test_save_layers_png_ids_are_exact(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.png", {"triangle": layers["triangle"]}, depth_scale=7)
    numbers, _, nothing = numbers_of(path)
    assert np.array_equal(numbers, layers["triangle"])
    assert np.array_equal(nothing, layers["triangle"] < 0)


def test_save_layers_png_depth_is_within_half_a_step(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.png", {"depth": layers["depth"]})
    numbers, scale, nothing = numbers_of(path)
    depth = layers["depth"]
    assert np.array_equal(nothing, ~np.isfinite(depth))
    assert scale == 1 / 65534
    assert abs(numbers - depth)[~nothing].max() <= 0.5 * scale + 1e-12  # rounding to a step, and of float64


def test_save_layers_png_distance_is_in_millimetres(layers, tmp_path):
    distance = layers["distance"]
    (path,) = save_layers(tmp_path / "a.png", {"distance": distance})
    with Image.open(path) as image:
        got = np.asarray(image)
        assert image.text["topleft:scale"] == "0.001"
    assert np.array_equal(got, np.rint(np.where(np.isfinite(distance), distance, 0).astype(float) * 1000))
    assert got.max() > 1000
    save_layers(path, {"distance": distance}, depth_scale=1 / 5000)
    numbers, scale, nothing = numbers_of(path)
    assert scale == 1 / 5000
    assert abs(numbers - distance)[~nothing].max() <= 0.5 * scale + 1e-12


@pytest.mark.parametrize("heat", [[[np.nan, np.nan]], [[0.25, np.nan]], [[-3.5, -3.5]], [[-3.5, 7]]])
def test_save_layers_png_attributes_go_from_the_least_to_the_greatest(heat, tmp_path):
    heat = np.array(heat, np.float32)
    (path,) = save_layers(tmp_path / "a.png", {"heat": heat})
    numbers, _, nothing = numbers_of(path)
    assert np.allclose(np.where(nothing, np.nan, numbers), heat, rtol=0, atol=1e-12, equal_nan=True)  # float64


@pytest.mark.parametrize("name", ["world_normal", "barycentric"])
def test_save_layers_png_of_three_channels_is_within_half_a_step(layers, tmp_path, name):
    (path,) = save_layers(tmp_path / "a.png", {name: layers[name]})
    numbers, scale, _ = numbers_of(path)
    assert abs(numbers - layers[name]).max() <= 0.5 * scale + 1e-6  # rounding to a step, and of float32


def test_save_layers_png_ids_beyond_16_bits_are_refused(tmp_path):
    save_layers(tmp_path / "a.png", {"triangle": np.array([[65534]], np.int32)})
    assert numbers_of(tmp_path / "a.png")[0] == 65534
    with pytest.raises(ImageError, match=r"triangle must lie in 0 to 65535 steps of 1 .*, got 0 to 65536; take .tiff$"):
        save_layers(tmp_path / "b.png", {"triangle": np.array([[65535]], np.int32)})


@pytest.mark.parametrize("distance", [70.0, -1.0])
def test_save_layers_beyond_16_bits_leaves_the_old_file(tmp_path, distance):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    with pytest.raises(ImageError, match=r"must lie in 0 to 65535 steps of 0.001 for a PNG, got .*, or depth_scale=1 "):
        save_layers(path, {"distance": np.array([[0, distance]], np.float32)})
    assert path.read_bytes() == b"old"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("{layer}.jpg", r"'.*depth.jpg': \.jpg cannot hold the layer 'depth', float32 \(48, 64\); take .npz"),
        ("a.png", r"2 layers need \{layer\} in the name, or \.npz, got"),
        ("{layer}.gif", r"format '\.gif' is none of"),
    ],
)
def test_save_layers_impossible_leaves_no_file(layers, tmp_path, name, message):
    with pytest.raises(ImageError, match=message):
        save_layers(tmp_path / name, {"color": layers["color"], "depth": layers["depth"]})
    assert list(tmp_path.iterdir()) == []


def test_save_layers_png_positions_are_refused(layers, tmp_path):
    with pytest.raises(ImageError, match=r"\.png cannot hold the layer 'world_position', float32 \(48, 64, 3\)"):
        save_layers(tmp_path / "a.png", {"world_position": layers["world_position"]})


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_save_layers_without_pixels_is_refused(tmp_path, suffix):
    with pytest.raises(ImageError, match=r"\(3, 0\)"):
        save_layers(tmp_path / f"a{suffix}", {"depth": np.zeros((3, 0), np.float32)})
    assert list(tmp_path.iterdir()) == []


def test_view_layers_save_writes_all_or_one(tmp_path):
    found = ViewLayers({"depth": np.ones((2, 2), np.float32), "alpha": np.ones((2, 2), np.uint8)})
    assert found.save(tmp_path / "a.npz") == (tmp_path / "a.npz",)
    assert [path.name for path in found.save(str(tmp_path / "{layer}.png"))] == ["depth.png", "alpha.png"]
    found.save(tmp_path / "b.npz", "depth")
    with np.load(tmp_path / "b.npz") as file:
        assert list(file) == ["depth"]
    far = ViewLayers({"distance": np.ones((2, 2), np.float32)})
    far.save(tmp_path / "b.png", "distance", depth_scale=0.1)
    assert np.asarray(Image.open(tmp_path / "b.png")).tolist() == [[10, 10], [10, 10]]
    with pytest.raises(ValueError, match="layer must be one of depth, alpha, got 'uv'"):
        found.save(tmp_path / "a.png", "uv")
