"""Images: pictures and buffers that are whole in their file or not there."""

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from topleft._meshes.io import images, png, tiff
from topleft.errors import ImageError

PICTURE = np.arange(4 * 5 * 4, dtype=np.uint8).reshape(4, 5, 4)


@pytest.mark.parametrize("suffix", [".png", ".webp"])
def test_save_image_lossless_formats_keep_every_bit(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    opaque = PICTURE | np.array([0, 0, 0, 255], dtype=np.uint8)
    images.save_image(path, opaque)
    assert np.array_equal(np.asarray(Image.open(path).convert("RGBA")), opaque)


def test_save_image_png_keeps_alpha(tmp_path):
    images.save_image(tmp_path / "a.png", PICTURE)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), PICTURE)


@pytest.mark.parametrize("suffix", [".jpg", ".jpeg", ".JPG"])
def test_save_image_jpeg_lies_on_the_background(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    images.save_image(path, np.zeros((16, 16, 4), np.uint8), background=(250, 240, 10))
    with Image.open(path) as image:
        assert image.mode == "RGB"
        assert np.asarray(image)[8, 8].astype(int) == pytest.approx([250, 240, 10], abs=3)  # JPEG is lossy


def test_composite_mixes_by_alpha():
    image = np.array([[[200, 0, 0, 0], [200, 0, 0, 255], [200, 0, 0, 128]]], dtype=np.uint8)
    assert images.composite(image, (0, 100, 255)).tolist() == [[[0, 100, 255], [200, 0, 0], [100, 50, 127]]]


def test_save_image_npy_keeps_any_array(tmp_path):
    depth = np.array([[np.inf, 0.5]], dtype=np.float32)
    images.save_image(tmp_path / "a.npy", depth)
    assert np.array_equal(np.load(tmp_path / "a.npy"), depth)
    assert np.load(tmp_path / "a.npy").dtype == np.float32


def test_save_image_npz_keeps_arrays_by_name(tmp_path):
    images.save_image(tmp_path / "a.npz", {"x": np.arange(3), "y": np.eye(2)})
    with np.load(tmp_path / "a.npz") as arrays:
        assert sorted(arrays) == ["x", "y"]
        assert arrays["x"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("limit", [1 << 32, 0], ids=["plain", "big"])
@pytest.mark.parametrize("shape", [(700, 90), (40, 50, 2)], ids=["strips", "pages"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_save_image_tiff_keeps_floats_to_the_bit(tmp_path, monkeypatch, dtype, shape, limit):
    tifffile = pytest.importorskip("tifffile", reason="no tifffile")
    monkeypatch.setattr(tiff, "LIMIT_CLASSIC", limit)  # from so many bytes on offsets have 64 bits
    array = np.random.default_rng(4).standard_normal(shape).astype(dtype)
    array[0, 0], array[1, 0] = np.inf, np.nan
    images.save_image(tmp_path / "a.tif", array)
    with tifffile.TiffFile(tmp_path / "a.tif") as found:
        assert (found.is_bigtiff, len(found.pages)) == (limit == 0, array[0, 0].size)
        channels = array.reshape(*shape[:2], -1)
        for k, page in enumerate(found.pages):
            assert page.asarray().tobytes() == channels[..., k].tobytes()


def test_save_image_tiff_keeps_colours_and_alpha(tmp_path):
    images.save_image(tmp_path / "a.tif", PICTURE)
    with Image.open(tmp_path / "a.tif") as image:
        assert (image.mode, image.n_frames) == ("RGBA", 1)
        assert np.array_equal(np.asarray(image), PICTURE)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int32", "float32"])
def test_save_image_tiff_keeps_numbers(tmp_path, dtype):
    array = np.array([[0, 1, 200], [7, 8, 9]], dtype)
    if dtype == "float32":
        array[0, 0] = np.inf
    if dtype == "int32":
        array[0, :2] = -1, 2**31 - 1
    images.save_image(tmp_path / "a.tiff", array)
    with Image.open(tmp_path / "a.tiff") as image:
        assert np.array_equal(np.asarray(image), array)


def test_save_image_png_keeps_16_bits_and_text(tmp_path):
    array = np.array([[0, 1, 65535]], np.uint16)
    images.save_image(tmp_path / "a.png", array, text={"scale": "2"})
    with Image.open(tmp_path / "a.png") as image:
        assert image.text == {"scale": "2"}
        assert np.array_equal(np.asarray(image), array)


@pytest.mark.parametrize(("dtype", "suffix"), [("u2", ".png"), ("u2", ".tif"), ("i4", ".tif"), ("f4", ".tif")])
def test_save_image_of_the_other_byte_order_is_that_of_the_own(tmp_path, dtype, suffix):
    image, path = np.arange(258, 264, dtype=dtype).reshape(2, 3), tmp_path / f"x{suffix}"
    images.save_image(path, image.astype(image.dtype.newbyteorder()))
    with Image.open(path) as found:
        assert np.array_equal(np.asarray(found), image)


def test_save_image_text_goes_into_png_only(tmp_path):
    with pytest.raises(ImageError, match=r"text goes into \.png only"):
        images.save_image(tmp_path / "a.jpg", PICTURE, text={"scale": "2"})


def test_save_image_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "a.png"
    path.write_text("old")
    images.save_image(path, PICTURE)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


def test_save_image_that_fails_half_way_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_text("old")

    def half_a_picture(image, **_):
        yield b"half a pic"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(png, "pieces", half_a_picture)
    with pytest.raises(OSError, match=r"cannot write: No space left on device: '.*a.png'"):
        images.save_image(path, PICTURE)
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


def test_save_image_permissions_are_those_of_any_new_file(tmp_path):
    images.save_image(tmp_path / "a.png", PICTURE)
    (tmp_path / "other").touch()
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_save_image_into_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"cannot write: No such file or directory: '.*nope/a.png'"):
        images.save_image(tmp_path / "nope" / "a.png", PICTURE)


def test_save_image_over_a_folder_is_refused(tmp_path):
    (tmp_path / "a.png").mkdir()
    with pytest.raises(IsADirectoryError, match="it is a folder"):
        images.save_image(tmp_path / "a.png", PICTURE)


@pytest.mark.parametrize(
    ("name", "image", "message"),
    [
        ("a.gif", PICTURE, "format '.gif' is none of .png .jpg .jpeg .webp .tif .tiff .npy .npz"),
        ("a", PICTURE, "format '' is none of"),
        ("a.png", PICTURE.astype(float), r"cannot write '.*a.png': .png holds uint8 .*; got float64 \(4, 5, 4\)"),
        ("a.jpg", PICTURE[..., :2], r".jpg holds uint8 \(H, W\), .*; got uint8 \(4, 5, 2\)"),
        ("a.tif", PICTURE[0, 0].astype(np.float32), r"holds .*, float64 \(H, W, K\); got float32 \(4,\)"),
        ("a.tif", np.zeros((2, 3), np.int16), r"holds .*; got int16 \(2, 3\); \.npy holds it as it is"),
        ("a.png", PICTURE[:0], r"a picture of shape \(0, 5, 4\) has no pixels"),
        ("a.png", {"x": PICTURE}, "several arrays by name need .npz"),
    ],
)
def test_save_image_impossible_is_refused(tmp_path, name, image, message):
    with pytest.raises(ImageError, match=message):
        images.save_image(tmp_path / name, image)
    assert list(tmp_path.iterdir()) == []


WRITE_UNDER_A_LIMIT = """
import resource, signal, sys
import numpy as np
import topleft as tl
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
noise = np.random.default_rng(0).integers(0, 256, (60, 60, 3), dtype=np.uint8)
for path in sys.argv[1:]:
    try:
        tl.save_image(path, noise)
    except (OSError, tl.ImageError) as error:
        print(path, type(error).__name__)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of files are of POSIX")
def test_save_image_on_a_full_disk_is_an_error_and_leaves_nothing(tmp_path):
    paths = [str(tmp_path / f"a{suffix}") for suffix in (".jpg", ".png", ".webp", ".npy", ".npz", ".tif")]
    done = subprocess.run([sys.executable, "-c", WRITE_UNDER_A_LIMIT, *paths], capture_output=True, text=True)
    assert [line.split()[0] for line in done.stdout.splitlines()] == paths, done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("suffix", "most"), [(".jpg", 65_500), (".jpeg", 65_500), (".webp", 16_383)])
@pytest.mark.parametrize("turned", [False, True])
def test_save_image_of_sides_that_the_format_has_not_is_refused(tmp_path, suffix, most, turned):
    image = np.zeros((1, most + 1), np.uint8)
    with pytest.raises(ImageError, match=f"{suffix} holds sides of at most {most} pixels"):
        images.save_image(tmp_path / f"a{suffix}", image.T if turned else image)
    images.save_image(tmp_path / f"a{suffix}", image[:, :most])
