"""Checks of options, which are words of `topleft.typing`, and the numbers behind samplings and sinks."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum, StrEnum
from typing import Any, get_args

from topleft._core.base.arrays import as_names
from topleft._core.base.cached import cached_property
from topleft.typing import LayerOption, SamplingOption


class Sampling(StrEnum):
    """Where a pixel is sampled, or which squares count."""

    CENTER = "center"
    MSAA2 = "msaa2"
    MSAA4 = "msaa4"
    MSAA8 = "msaa8"
    MSAA16 = "msaa16"
    AREA = "area"
    OUTER = "outer"
    INNER = "inner"

    @cached_property
    def n_samples(self) -> int:
        """Samples of a pixel, 1 unless there are several."""
        return int(self.removeprefix("msaa")) if self.startswith("msaa") else 1


class Sink(IntEnum):
    """How a covered sample changes the buffers; the numbers are `tl_sink` in ``csrc/topleft.h``."""

    MASK = 0
    COUNT = 1
    LABEL = 2
    PAINT = 3
    NEAREST = 4
    FARTHEST = 5
    SAMPLES = 6


#: Words of other programs, for the words of any option here.
FIRST_GUESSES = {
    "all_touched": ("outer",), "alpha": ("over",), "face": ("triangle",), "faces": ("triangle",),
    "gouraud": ("smooth",), "id": ("triangle", "instance"), "mask": ("silhouette", "coverage"),
    "normal": ("world_normal", "camera_normal", "normals"), "normals": ("world_normal", "camera_normal"),
    "object_id": ("instance",), "phong": ("smooth",), "resolution": ("size",), "rgb": ("color",),
    "segmentation": ("instance",), "sun": ("directional",), "winding": ("nonzero",), "z": ("distance",),
}  # fmt: skip

SAMPLINGS = {sampling.value: sampling for sampling in Sampling}
"""By their words: calling the enum takes five times as long."""


def parse(option: Any, name: str, value: object) -> Any:
    """Return the word that an option has, of the words of its type in `topleft.typing`; else raise a `ValueError`."""
    check_choice(name, value, option.__args__)  # as `get_args`, in a tenth of its time
    return str(value)


def parse_sampling(value: object) -> Sampling:
    """Return the sampling that an option names."""
    return SAMPLINGS[parse(SamplingOption, "sampling", value)]


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise a `ValueError` unless the value is among a few words."""
    if not (isinstance(value, str) and value in choices):
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}{meant(value, choices)}")


def meant(value: object, choices: tuple[str, ...]) -> str:
    """Return the end of a message that names the words that a wrong one may stand for, or nothing."""
    from difflib import get_close_matches  # costs import time, and only errors need it

    word = str(value).casefold()
    guesses = [each for each in FIRST_GUESSES.get(word, ()) if each in choices]
    guesses = guesses or get_close_matches(word, choices, 2)
    return f": {' or '.join(guesses)}?" if isinstance(value, str) and guesses else ""


LAYER_NAMES: tuple[str, ...] = get_args(LayerOption)
"""Names of the layers of a view."""


def check_layers(names: str | Iterable[str]) -> tuple[str, ...]:
    """Return names of layers, each once."""
    checked = tuple(dict.fromkeys(as_names("layers", names)))
    for name in checked:
        if name not in LAYER_NAMES:
            raise ValueError(f"layers must be some of {', '.join(LAYER_NAMES)}, got {name!r}{meant(name, LAYER_NAMES)}")
    return checked
