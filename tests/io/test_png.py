"""PNG files: what Pillow decodes is what was encoded, whatever compresses, and each chunk is as the standard says."""

from __future__ import annotations

import io
import struct
import sys
import zlib

import numpy as np
import pytest
from PIL import Image

from topleft import scenes
from topleft._meshes.io import png
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import render
from topleft.errors import ImageError

try:
    import isal  # noqa: F401

    COMPRESSORS = ["zlib", "isal"]
except ImportError:
    COMPRESSORS = ["zlib"]


def decoded(data):
    with Image.open(io.BytesIO(data)) as image:
        image.load()
        return np.asarray(image), image.mode


def chunks_of(data):
    """Names and contents of the chunks, each with its checksum verified."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, found = 8, []
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        name, content = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(name + content)
        found.append((name, content))
        at += 12 + length
    return found


@pytest.fixture
def without_isal(monkeypatch):
    monkeypatch.setitem(sys.modules, "isal", None)
    png._isal.cache_clear()
    yield
    png._isal.cache_clear()


@pytest.mark.parametrize("compressor", COMPRESSORS)
@pytest.mark.parametrize(("channels", "mode"), [((), "L"), ((2,), "LA"), ((3,), "RGB"), ((4,), "RGBA")])
@pytest.mark.parametrize("size", [(1, 1), (1, 300), (300, 1), (37, 53)])
def test_encode_bytes_come_back(compressor, channels, mode, size):
    image = np.random.default_rng(1).integers(0, 256, (*size, *channels), dtype=np.uint8)
    array, found = decoded(png.encode(image, compressor=compressor))
    assert found == mode
    assert np.array_equal(array, image)


@pytest.mark.parametrize("compressor", COMPRESSORS)
def test_encode_grey_of_16_bits_comes_back(compressor):
    image = np.arange(0, 65533, 13, dtype=np.uint16).reshape(71, 71)
    array, mode = decoded(png.encode(image, compressor=compressor))
    assert mode in ("I;16", "I")  # "I" by Pillow 10
    assert np.array_equal(array, image)


@pytest.mark.parametrize("compressor", COMPRESSORS)
@pytest.mark.parametrize("height", [7, 8, 9, 16, 17, 100])
def test_encode_bands_meet_without_a_seam(compressor, height, monkeypatch):
    monkeypatch.setattr(png, "BAND_BYTES", 8 * (1 + 4 * 50))  # 8 rows
    image = np.random.default_rng(height).integers(0, 256, (height, 50, 4), dtype=np.uint8)
    assert np.array_equal(decoded(png.encode(image, compressor=compressor))[0], image)


def test_encode_row_longer_than_a_band_comes_back(monkeypatch):
    monkeypatch.setattr(png, "BAND_BYTES", 10)
    image = np.arange(3 * 40, dtype=np.uint8).reshape(3, 40)
    assert np.array_equal(decoded(png.encode(image))[0], image)


@pytest.mark.parametrize("compressor", COMPRESSORS)
def test_encode_rendered_picture_comes_back(compressor):
    picture = render(Mesh(*scenes.shape("torus-knot")), size=(200, 150), background=(0, 0, 0, 0))
    assert np.array_equal(decoded(png.encode(picture, compressor=compressor))[0], picture)


@pytest.mark.parametrize("view", [np.s_[::-1], np.s_[:, ::2], np.s_[..., :3], np.s_[..., ::-1], np.s_[3:, 5:]])
def test_encode_takes_any_layout(view):
    image = np.random.default_rng(2).integers(0, 256, (20, 30, 4), dtype=np.uint8)[view]
    assert np.array_equal(decoded(png.encode(image))[0], image)


def test_encode_leaves_the_picture_alone():
    image = np.random.default_rng(3).integers(0, 256, (20, 30, 4), dtype=np.uint8)
    before = image.copy()
    image.flags.writeable = False
    png.encode(image)
    assert np.array_equal(image, before)


def test_encode_chunks_are_those_of_the_standard():
    found = chunks_of(png.encode(np.zeros((2, 3, 4), np.uint8), text={"Title": "a", "Author": "Jörg"}))
    assert [name for name, _ in found] == [b"IHDR", b"tEXt", b"tEXt", b"IDAT", b"IEND"]
    assert struct.unpack(">IIBBBBB", found[0][1]) == (3, 2, 8, 6, 0, 0, 0)
    assert [content for _, content in found[1:3]] == [b"Title\0a", "Author\0Jörg".encode("latin-1")]


def test_encode_filter_is_up_in_each_row():
    found = dict(chunks_of(png.encode(np.array([[1, 2], [5, 1]], np.uint8))))
    rows = zlib.decompress(found[b"IDAT"])
    assert rows == bytes([2, 1, 2, 2, 4, 255])


def test_encode_text_is_read_by_others():
    with Image.open(io.BytesIO(png.encode(np.zeros((1, 1), np.uint8), text={"scale": "0.5"}))) as image:
        assert image.text == {"scale": "0.5"}


def test_encode_without_isal_takes_zlib(without_isal):
    image = np.zeros((9, 9), np.uint8)
    assert png.encode(image) == png.encode(image, compressor="zlib")
    with pytest.raises(ValueError, match=r"needs the package isal: pip install isal"):
        png.encode(image, compressor="isal")


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((2, 2, 5), np.uint8), r"PNG holds uint8 of shape .* got uint8 of shape \(2, 2, 5\)"),
        (np.zeros((2, 2, 3), np.uint16), r"uint16 of shape \(H, W\), got uint16 of shape \(2, 2, 3\)"),
        (np.zeros(4, np.uint8), r"got uint8 of shape \(4,\)"),
        (np.zeros((2, 2), np.float32), r"got float32 of shape \(2, 2\)"),
        (np.zeros((0, 2), np.uint8), r"a picture of shape \(0, 2\) has no pixels"),
    ],
)
def test_encode_impossible_is_refused(image, message):
    with pytest.raises(ImageError, match=message):
        png.encode(image)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ({"a": "Ω"}, "text of a PNG must be Latin-1, got 'a': 'Ω'"),
        ({"": "a"}, "a keyword of a PNG has 1 to 79 characters"),
        ({"k" * 80: "a"}, "a keyword of a PNG has 1 to 79 characters"),
        ({"a": "b\0c"}, "no text has a NUL"),
    ],
)
def test_encode_impossible_text_is_refused(text, message):
    with pytest.raises(ImageError, match=message):
        png.encode(np.zeros((1, 1), np.uint8), text=text)


def test_encode_unknown_compressor_is_refused():
    with pytest.raises(ValueError, match="compressor must be one of auto, isal, zlib, got 'lzma'"):
        png.encode(np.zeros((1, 1), np.uint8), compressor="lzma")


@pytest.mark.parametrize("compressor", COMPRESSORS)
def test_encode_chunks_of_a_plain_picture_are_not_tiny(compressor, monkeypatch):
    monkeypatch.setattr(png, "BAND_BYTES", 1000)
    image = np.zeros((300, 300), np.uint8)  # 91 bands, which compress to less than a chunk
    data = png.encode(image, compressor=compressor)
    assert [name for name, _ in chunks_of(data)] == [b"IHDR", b"IDAT", b"IEND"]
    assert np.array_equal(decoded(data)[0], image)
