"""Numbers of the objects in a file of polygons, which `topleft mask` and `topleft raster` write.

Input: a picture of polygons and the name of a property. Output: a number for each object. An object without a number
loses its polygons and is told, and so is an object with the number of the background.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._apps.cli.arguments import UsageError
from topleft._core.base.notes import Notes, tell
from topleft.annex.files import NO_RINGS, PolygonPicture

Numbers = npt.NDArray[Any]
"""(objects,) int32, int64 or float64."""


def words_of(picture: PolygonPicture, name: str, file: str) -> tuple[Numbers, dict[int, str]] | None:
    """Return numbers from 1 on for the words of a property, and the word of each; None where a value is no word."""
    values = picture.values(name)
    words = {i: value for i, value in values.items() if isinstance(value, str)}
    if not words or any(not isinstance(value, str | None) for value in values.values()):
        return None
    _leave_out(picture, name, file, {i: value for i, value in values.items() if i not in words})
    known, which = np.unique(np.array(list(words.values())), return_inverse=True)
    labels = np.zeros(len(picture.objects), np.int32)
    labels[list(words)] = which + 1
    return labels, dict(enumerate(known.tolist(), 1))


def numbers_of(
    picture: PolygonPicture, option: str, name: str, file: str, background: float, *, is_whole: bool
) -> Numbers:
    """Return a property of each object with all digits; `is_whole`: floats must be whole numbers.

    The dtype holds the background as well, if it is a whole number.
    """
    values = picture.values(name)
    numbers = {i: value for i, value in values.items() if _is_number(value, is_whole=is_whole)}
    if values and not numbers:
        known = ", ".join(sorted({str(own) for i in values for own in picture.objects[i]})) or "none"
        first = next(iter(values))
        wish = "whole number of 64 bits" if is_whole else "number of 64 bits"
        raise UsageError(
            f"{option} {name}: no object of {file} has a {wish} of this name, {picture.name_of(first)} has "
            f"{values[first]!r}; names are {known}"
        )
    _leave_out(picture, name, file, {i: value for i, value in values.items() if i not in numbers})
    if is_whole or all(isinstance(value, int) for value in numbers.values()):
        whole = np.zeros(len(picture.objects), np.int64)
        whole[list(numbers)] = [int(value) for value in numbers.values()]
        ends = [*(whole.min(initial=0), whole.max(initial=0)), *([background] if isinstance(background, int) else [])]
        return whole.astype(np.int32) if -(2**31) <= min(ends) and max(ends) < 2**31 else whole
    return np.array([float(numbers.get(i, 0)) for i in range(len(picture.objects))])


def tell_of_background(picture: PolygonPicture, numbers: Numbers, background: float, file: str) -> None:
    """Tell of objects that cannot be told from the background."""
    notes = Notes(file)
    for i in np.flatnonzero(numbers == background).tolist():
        if len(picture.parts[i].counts):
            notes.add(
                f"objects lost in the background, which is {background} as well: see --nodata", picture.name_of(i)
            )
    tell(notes.lines, stacklevel=2)


def whole_or_float(text: str) -> int | float:
    """A number; a whole number keeps all digits."""
    try:
        return int(text)
    except ValueError:
        try:
            return float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"must be a number, got {text!r}") from None


def _is_number(value: Any, *, is_whole: bool) -> bool:
    if not isinstance(value, int | float) or value != value:  # NaN stands for a null
        return False
    if isinstance(value, float) and not is_whole:
        return True
    return -(2**63) <= value < 2**63 and value == int(value)


def _leave_out(picture: PolygonPicture, name: str, file: str, lacking: dict[int, Any]) -> None:
    notes = Notes(file)
    for i, value in lacking.items():
        picture.parts[i] = NO_RINGS
        notes.add("objects left out", f"{picture.name_of(i)} has {value!r} as {name}")
    tell(notes.lines, stacklevel=3)
