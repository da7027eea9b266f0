"""Layers: each is what the library computes elsewhere, and what a file holds is what its notes say."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import topleft as tl
from topleft import scenes
from topleft.errors import ImageError
from topleft.layer_files import save_layers
from topleft.layers import LAYERS, Shot, check_layers, draw_layers

SIZE = (64, 48)
KNOT = tl.Mesh(*scenes.shape("torus-knot"))
SHOT = Shot(KNOT, None, SIZE, {"cull": "back"})


@pytest.fixture(scope="module")
def layers():
    return draw_layers(LAYERS, SHOT)


def numbers_of(path):
    """What a PNG says that its values stand for, and where there is nothing."""
    with Image.open(path) as image:
        values = np.asarray(image).astype(float)
        scale, offset = (float(image.text[f"topleft:{name}"]) for name in ("scale", "offset"))
    return offset + scale * values, scale, values == 0


# Arrays


def test_layers_are_those_of_the_library(layers):
    frags = tl.rasterize_mesh(KNOT, None, SIZE, cull="back")
    assert np.array_equal(layers["color"], tl.render(KNOT, None, SIZE, cull="back"))
    assert np.array_equal(layers["alpha"], np.where(frags.mask, 255, 0))
    assert np.array_equal(layers["depth"], frags.depth)
    assert np.array_equal(layers["id"], frags.triangle)


def test_layer_normals_have_length_1_and_face_the_viewer(layers):
    normals, mask = layers["normals"], layers["alpha"] > 0
    assert np.linalg.norm(normals[mask], axis=1) == pytest.approx(1, abs=1e-5)  # float32
    assert (normals[mask][:, 2] > -0.3).all()  # interpolated ones may turn away a little at the outline
    assert not normals[~mask].any()


def test_layers_agree_when_the_picture_is_drawn_in_the_same_memory(layers):
    shot = Shot(KNOT, None, SIZE, {"cull": "back"}, tl.Rasterizer(SIZE))
    found = draw_layers(["id", "color", "depth"], shot)
    assert list(found) == ["id", "color", "depth"]
    assert all(np.array_equal(found[name], layers[name]) for name in found)


def test_layers_compute_nothing_else(monkeypatch):
    monkeypatch.setattr("topleft.layers.rasterize_mesh", None)
    assert list(draw_layers(["color"], SHOT)) == ["color"]


def test_layers_unknown_is_refused():
    with pytest.raises(ValueError, match="layers must be some of color, alpha, depth, id, normals, got 'uv'"):
        check_layers(["color", "uv"])


def test_layers_are_taken_once_and_one_may_be_a_word():
    assert check_layers(["id", "color", "id"]) == ("id", "color")
    assert check_layers("depth") == ("depth",)


# Files


def test_save_layers_npz_keeps_all_of_them(layers, tmp_path):
    assert save_layers(tmp_path / "a.npz", layers) == (tmp_path / "a.npz",)
    with np.load(tmp_path / "a.npz") as arrays:
        assert sorted(arrays) == sorted(LAYERS)
        assert all(np.array_equal(arrays[name], layers[name]) for name in LAYERS)


def test_save_layers_npy_keeps_each(layers, tmp_path):
    for path in save_layers(tmp_path / "{layer}.npy", layers):
        assert np.array_equal(np.load(path), layers[path.stem])


@pytest.mark.parametrize("suffix", [".tiff", ".tif"])
def test_save_layers_tiff_keeps_numbers(layers, tmp_path, suffix):
    wanted = {name: layers[name] for name in ("color", "alpha", "depth", "id")}
    for path in save_layers(tmp_path / f"{{layer}}{suffix}", wanted):
        with Image.open(path) as image:
            assert np.array_equal(np.asarray(image), layers[path.stem])


def test_save_layers_png_ids_are_exact(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.png", {"id": layers["id"]})
    numbers, _, nothing = numbers_of(path)
    assert np.array_equal(numbers, layers["id"])
    assert np.array_equal(nothing, layers["id"] < 0)


def test_save_layers_png_depth_is_within_half_a_step(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.png", {"depth": layers["depth"]})
    numbers, scale, nothing = numbers_of(path)
    depth = layers["depth"]
    assert np.array_equal(nothing, ~np.isfinite(depth))
    assert scale == pytest.approx(float(np.ptp(depth[~nothing].astype(float))) / 65534)
    assert abs(numbers - depth)[~nothing].max() <= 0.5 * scale + 1e-12  # rounding to a step, and of float64


@pytest.mark.parametrize("depth", [[[np.inf, np.inf]], [[0.25, np.inf]], [[-3.5, -3.5]]])
def test_save_layers_png_depth_of_one_value_or_none(depth, tmp_path):
    depth = np.array(depth, np.float32)
    (path,) = save_layers(tmp_path / "a.png", {"depth": depth})
    numbers, _, nothing = numbers_of(path)
    assert np.array_equal(np.where(nothing, np.inf, numbers), depth)


def test_save_layers_png_normals_are_within_half_a_step(layers, tmp_path):
    (path,) = save_layers(tmp_path / "a.png", {"normals": layers["normals"]})
    numbers, scale, _ = numbers_of(path)
    assert abs(numbers - layers["normals"]).max() <= 0.5 * scale + 1e-6  # rounding to a step, and of float32


def test_save_layers_png_ids_beyond_16_bits_are_refused(tmp_path):
    save_layers(tmp_path / "a.png", {"id": np.array([[65534]], np.int32)})
    assert numbers_of(tmp_path / "a.png")[0] == 65534
    with pytest.raises(ImageError, match=r"b.png': PNG holds ids below 65535, got 65535; take \.tiff"):
        save_layers(tmp_path / "b.png", {"id": np.array([[65535]], np.int32)})


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("{layer}.jpg", r"cannot write '.*id.jpg': \.jpg cannot hold the layer 'id', int32 \(48, 64\); take .npz or"),
        ("a.png", r"2 layers need \{layer\} in the name, or \.npz, got"),
        ("{layer}.gif", r"format '\.gif' is none of"),
    ],
)
def test_save_layers_impossible_leaves_no_file(layers, tmp_path, name, message):
    with pytest.raises(ImageError, match=message):
        save_layers(tmp_path / name, {"color": layers["color"], "id": layers["id"]})
    assert list(tmp_path.iterdir()) == []


def test_save_layers_tiff_normals_are_refused(layers, tmp_path):
    with pytest.raises(ImageError, match=r"\.tiff cannot hold the layer 'normals', float32 \(48, 64, 3\)"):
        save_layers(tmp_path / "a.tiff", {"normals": layers["normals"]})
