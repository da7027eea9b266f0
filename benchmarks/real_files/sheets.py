"""Contact sheets: the pictures of many files on few, with their names and a mark.

In: the bytes of PNG pictures. Out: files.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

from benchmarks.real_files.drawing import THUMBNAIL

N_COLUMNS, N_ROWS = 8, 6
GAP = 4
CAPTION = 13
N_LETTERS = 29
"""Of a name that fits below a picture."""

PAPER, INK, BOARD = (255, 255, 255), (40, 40, 40), (222, 226, 232)
MARKS = {"R": (196, 62, 28), "C": (150, 0, 150), "W": (178, 122, 0), "B": (196, 62, 28)}


def write_sheets(
    folder: Path, name: str, pictures: Sequence[bytes | None], captions: Sequence[str], marks: Sequence[str]
) -> list[str]:
    """Write as many sheets as it takes, PNG; the name of the sheet of each picture."""
    from PIL import Image, ImageDraw

    folder.mkdir(parents=True, exist_ok=True)
    n_cells = N_COLUMNS * N_ROWS
    names = []
    for first in range(0, len(pictures), n_cells):
        n = min(n_cells, len(pictures) - first)
        step_x, step_y = THUMBNAIL + GAP, THUMBNAIL + GAP + CAPTION
        sheet = Image.new("RGB", (GAP + N_COLUMNS * step_x, GAP + math.ceil(n / N_COLUMNS) * step_y), PAPER)
        pen = ImageDraw.Draw(sheet)
        for i in range(n):
            left, top = GAP + i % N_COLUMNS * step_x, GAP + i // N_COLUMNS * step_y
            content, mark = pictures[first + i], marks[first + i]
            sheet.paste(BOARD, (left, top, left + THUMBNAIL, top + THUMBNAIL))
            if content is not None:
                with Image.open(io.BytesIO(content)) as picture:
                    sheet.paste(picture, (left, top), picture)
            if mark:
                pen.text((left + 3, top + 2), mark, fill=MARKS[mark])
            caption = captions[first + i]
            caption = caption if len(caption) <= N_LETTERS else caption[: N_LETTERS - 11] + "~" + caption[-10:]
            pen.text((left + 1, top + THUMBNAIL), caption.encode("ascii", "replace").decode(), fill=INK)
        path = folder / f"{name}-{first // n_cells}.png"
        sheet.save(path)
        names += [path.name] * n
    return names
