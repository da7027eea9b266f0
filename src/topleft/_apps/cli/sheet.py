"""Contact sheets: many pictures, reduced, in rows on one.

Input: the files of the pictures. Output: a picture (H, W, 3) uint8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

LONGEST_SIDE = 256
GAP = 8
CAPTION_HEIGHT = 16
LINE_HEIGHT = 13
PAPER, INK, ALARM = (255, 255, 255), (60, 60, 60), (176, 0, 32)


def make_sheet(
    files: Sequence[Sequence[Path]], captions: Sequence[str], reasons: Sequence[str] = (),
    background: tuple[int, int, int, int] | None = None,
) -> npt.NDArray[np.uint8]:  # fmt: skip
    """Return a sheet of the pictures of each mesh; where a picture is missing, its cell says the reason.

    `background`: of cells without a picture; that of the sheet unless given.

    Several pictures of several meshes: a row for each mesh. Otherwise the rows make the sheet about square.
    """
    from PIL import Image, ImageDraw

    n_views = max(map(len, files))
    mesh_of = [i for i, views in enumerate(files) for _ in views]
    if len(files) > 1 and n_views > 1:
        n_columns, cells = n_views, [(row, k, file) for row, views in enumerate(files) for k, file in enumerate(views)]
    else:
        flat = [file for views in files for file in views]
        n_columns = math.ceil(math.sqrt(len(flat)))
        cells = [(i // n_columns, i % n_columns, file) for i, file in enumerate(flat)]
    n_rows = 1 + max(row for row, _, _ in cells)
    pictures, missing = {}, {}
    for i, (row, column, file) in enumerate(cells):
        missing[row, column] = reasons[mesh_of[i]] if reasons else ""
        if file.is_file():
            del missing[row, column]
            with Image.open(file) as image:
                reduced = image.convert("RGBA")
                reduced.thumbnail((LONGEST_SIDE, LONGEST_SIDE), Image.Resampling.HAMMING)
                pictures[row, column] = reduced
    width = max((picture.width for picture in pictures.values()), default=LONGEST_SIDE)
    height = max((picture.height for picture in pictures.values()), default=LONGEST_SIDE)
    step_x, step_y = width + GAP, height + GAP + CAPTION_HEIGHT
    sheet = Image.new("RGB", (GAP + n_columns * step_x, GAP + n_rows * step_y), PAPER)
    pen = ImageDraw.Draw(sheet)
    for (row, column), picture in pictures.items():
        left, top = GAP + column * step_x, GAP + row * step_y
        sheet.paste(picture, (left + (width - picture.width) // 2, top + (height - picture.height) // 2), picture)
    blank = Image.new("RGBA", (width, height), background or (*PAPER, 255))
    for (row, column), reason in missing.items():
        sheet.paste(blank, (GAP + column * step_x, GAP + row * step_y), blank)
        lines = wrapped(reason, width - 4, pen.textlength)[: max(1, height // LINE_HEIGHT)]
        pen.text((GAP + column * step_x + 2, GAP + row * step_y), "\n".join(lines), fill=ALARM, spacing=2)
    for i, caption in enumerate(captions):
        row, column = (i, 0) if n_views > 1 else (i // n_columns, i % n_columns)
        if len(captions) == 1:
            row, column = n_rows - 1, 0
        room = (n_columns if len(captions) == 1 else 1) * step_x - GAP
        while pen.textlength(caption) > room:
            caption = f"..{caption[3:]}"  # names differ at their ends more often
        pen.text((GAP + column * step_x + 2, GAP + row * step_y + height + 2), caption, fill=INK)
    return np.asarray(sheet)


def wrapped(text: str, width: float, length: Callable[[str], float]) -> list[str]:
    """Return the lines of a text that are no longer than the width; words that are longer are cut."""
    lines = [""]
    for word in text.split():
        rest = word
        if lines[-1] and length(f"{lines[-1]} {rest}") <= width:
            lines[-1] += f" {rest}"
            continue
        while rest:
            n = next((n for n in range(len(rest), 1, -1) if length(rest[:n]) <= width), 1)
            lines.append(rest[:n])
            rest = rest[n:]
    return lines[1:]
