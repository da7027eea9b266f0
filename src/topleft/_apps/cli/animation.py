"""Animations: pictures one after the other, by Pillow, or as a video by an installed ffmpeg.

Input: the files of the pictures. Output: one file, whole or not there.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, cast

from topleft._core.base.whole_file import write_whole
from topleft.errors import ImageError, MissingPackageError

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

VIDEO_SUFFIXES = (".mp4", ".mkv", ".mov", ".webm")
ANIMATION_SUFFIXES = (".gif", ".webp", ".apng", *VIDEO_SUFFIXES)
"""The formats of `save_animation`, by the end of the name."""

PILLOW_OPTIONS: Mapping[str, Mapping[str, Any]] = {
    ".gif": {"format": "GIF", "disposal": 2},
    ".webp": {"format": "WEBP", "lossless": True},
    ".apng": {"format": "PNG", "compress_level": 1},
}


def check_animation(path: Path) -> None:
    """Raise an error, before any work, for a file that could not be written."""
    suffix = path.suffix.lower()
    if suffix not in ANIMATION_SUFFIXES:
        known = " ".join(ANIMATION_SUFFIXES)
        raise ImageError(f"an animation must end in one of {known}, got {str(path)!r}")
    if suffix in VIDEO_SUFFIXES and shutil.which("ffmpeg") is None:
        raise MissingPackageError(
            f"{suffix} needs ffmpeg, which is not installed (https://ffmpeg.org); .gif, .webp and .apng do without"
        )


def save_animation(
    path: Path, files: Sequence[Path], *, fps: float = 20.0, background: tuple[int, int, int] = (255, 255, 255)
) -> None:
    """Write pictures of one size as an animation in a loop, or as a video; `fps` pictures a second.

    GIF (256 colours), WebP and APNG (every bit), or a video, by the end of the name. `background`: sRGB of 0 to 255
    behind transparent pixels in a video, which has no alpha. Errors are those of `check_animation`, of ffmpeg
    (`ImageError`) and of files.
    """
    from PIL import Image

    check_animation(path)
    suffix = path.suffix.lower()

    def read() -> Iterator[Picture]:
        for file in files:
            with Image.open(file) as image:
                yield image.convert("RGBA")

    if suffix in VIDEO_SUFFIXES:
        _save_video(path, read(), fps, background)
        return
    frames = list(read())
    first, *others = _in_palette(frames) if suffix == ".gif" else frames
    options: dict[str, Any] = {"save_all": True, "append_images": others, "loop": 0, "duration": round(1000 / fps)}
    write_whole(path, lambda file: first.save(file, **PILLOW_OPTIONS[suffix], **options))


def _in_palette(frames: Sequence[Picture]) -> list[Picture]:
    """Return pictures with one palette: the 255 colours that suit them best together, and transparent.

    With a palette for each picture, plain surfaces flicker.
    """
    from PIL import Image

    some = frames[:: max(1, len(frames) // 8)]
    strip = Image.new("RGB", (frames[0].width, len(some) * frames[0].height))
    for i, frame in enumerate(some):
        strip.paste(frame.convert("RGB"), (0, i * frame.height))
    palette = strip.quantize(255, Image.Quantize.MEDIANCUT)
    found = []
    for frame in frames:
        flat = frame.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)
        alpha = frame.getchannel("A")
        is_clear = alpha.point([255] * 128 + [0] * 128)
        if is_clear.getbbox():
            flat.paste(255, mask=is_clear)
            flat.info["transparency"] = 255
        found.append(flat)
    return found


def _save_video(path: Path, frames: Iterator[Picture], fps: float, background: tuple[int, int, int]) -> None:
    """Hand the pixels to ffmpeg, which writes beside the target."""
    first = next(frames)
    # yuv420p, which every player knows, wants even sides.
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{first.width}x{first.height}", "-r", f"{fps:g}", "-i", "-"]
    command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p"]
    with tempfile.TemporaryDirectory(prefix=".topleft-", dir=path.parent) as folder:
        part, log = Path(folder, path.name), Path(folder, "log")
        with log.open("wb") as stderr:
            process = subprocess.Popen([*command, str(part)], stdin=subprocess.PIPE, stderr=stderr)
            with process, suppress(BrokenPipeError):  # it has ended: its last words tell why
                for frame in chain([first], frames):
                    cast("IO[bytes]", process.stdin).write(_opaque_pixels(frame, background))
        if process.returncode or not part.is_file():
            lines = log.read_text(errors="replace").strip().splitlines()
            reason = lines[-1] if lines else f"it ended with status {process.returncode}"
            raise ImageError(f"ffmpeg could not write {str(path)!r}: {reason}")
        part.replace(path)


def _opaque_pixels(frame: Picture, background: tuple[int, int, int]) -> bytes:
    from PIL import Image

    return Image.alpha_composite(Image.new("RGBA", frame.size, (*background, 255)), frame).convert("RGB").tobytes()
