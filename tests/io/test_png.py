"""PNG files: what Pillow decodes is what was encoded, and each chunk is as the standard says."""

import io
import struct
import zlib

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on, one_by_one
from PIL import Image

import topleft as tl
from topleft import scenes
from topleft._core import engine
from topleft._meshes.io import png
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.picture.render import render
from topleft.errors import ImageError


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


@ON_EACH_ISA
@pytest.mark.parametrize(("channels", "mode"), [((), "L"), ((2,), "LA"), ((3,), "RGB"), ((4,), "RGBA")])
@one_by_one("size", [(1, 1), (1, 300), (300, 1), (37, 53)])
def test_encode_bytes_come_back(isa, channels, mode, size):
    image = np.random.default_rng(1).integers(0, 256, (*size, *channels), dtype=np.uint8)
    with on(isa):
        array, found = decoded(png.encode(image))
    assert found == mode
    assert np.array_equal(array, image)


def test_encode_grey_of_16_bits_comes_back():
    image = np.arange(0, 65533, 13, dtype=np.uint16).reshape(71, 71)
    array, mode = decoded(png.encode(image))
    assert mode in ("I;16", "I")  # "I" by Pillow 10
    assert np.array_equal(array, image)


@pytest.mark.parametrize("channels", [(), (2,), (3,), (4,)])
def test_encode_repeats_of_each_length_come_back(channels):
    image = np.zeros((700, 700, *channels), np.uint8)
    image[np.arange(700) > np.arange(700)[:, None]] = 7  # runs of 0 to 700 pixels, and as many up to the end of the row
    assert np.array_equal(decoded(png.encode(image))[0], image)


def test_encode_bytes_of_very_unequal_counts_come_back():
    n_of = [1, 1]
    while len(n_of) < 24:  # numbers of Fibonacci make the longest codes: 23 bits
        n_of.append(n_of[-1] + n_of[-2])
    differences = np.random.default_rng(4).permutation(np.repeat(np.arange(24, dtype=np.uint8), n_of))
    image = np.cumsum(differences[:120_000].reshape(-1, 60), axis=0, dtype=np.uint8)
    assert np.array_equal(decoded(png.encode(image))[0], image)


def test_encode_rows_unlike_those_that_are_counted_come_back():
    image = np.random.default_rng(5).integers(0, 256, (600, 900), dtype=np.uint8)
    image[7::16] = image[8::16] = 9  # rows 8, 24, 40 ... are counted: no differences
    data = png.encode(image)
    assert np.array_equal(decoded(data)[0], image)
    assert len(data) < engine.png_room(*image.shape)


def test_encode_on_each_isa_gives_the_same_bytes():
    picture = render(Mesh(*scenes.shape("torus-knot")), size=(200, 150), background=(0, 0, 0, 0))
    files = set()
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            files.add(png.encode(picture))
    assert len(files) == 1
    assert np.array_equal(decoded(files.pop())[0], picture)


@pytest.mark.parametrize("height", [7, 8, 9, 16, 17, 100])
def test_encode_bands_meet_without_a_seam(height, monkeypatch):
    monkeypatch.setattr(png, "BAND_BYTES", 8 * 4 * 50)  # 8 rows
    image = np.random.default_rng(height).integers(0, 256, (height, 50, 4), dtype=np.uint8)
    assert np.array_equal(decoded(png.encode(image))[0], image)


def test_encode_row_longer_than_a_band_comes_back(monkeypatch):
    monkeypatch.setattr(png, "BAND_BYTES", 10)
    image = np.arange(3 * 40, dtype=np.uint8).reshape(3, 40)
    assert np.array_equal(decoded(png.encode(image))[0], image)


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


def test_encode_takes_the_filter_of_fewer_bits():
    y, x = np.mgrid[:64, :64]
    smooth = (128 + 60 * np.sin(x / 7.3 + y / 5.1) + 40 * np.cos(x / 11 - y / 3.7)).astype(np.uint8)
    edges = np.where((x // 9 + y // 16) % 2, np.uint8(200), np.uint8(10))
    assert [filters_of(image) for image in (smooth, edges)] == [{3}, {2}]


def filters_of(image):
    rows = zlib.decompress(dict(chunks_of(png.encode(image)))[b"IDAT"])
    return set(rows[:: 1 + image.shape[1]])


def test_encode_lit_picture_is_at_most_an_eighth_larger_than_by_zlib():
    picture = render(Mesh(*scenes.shape("torus-knot")), size=(400, 300))
    rows = picture.reshape(300, -1)
    differences = np.diff(rows, axis=0, prepend=np.zeros((1, 1600), np.uint8))
    assert 8 * len(png.encode(picture)) < 9 * len(zlib.compress(differences, 1))


def test_encode_text_is_read_by_others():
    with Image.open(io.BytesIO(png.encode(np.zeros((1, 1), np.uint8), text={"scale": "0.5"}))) as image:
        assert image.text == {"scale": "0.5"}


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
