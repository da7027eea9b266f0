"""External programs that time the same scene themselves and print the figure: run in turn with the contestants."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.scenes.cases import Case

DEFAULT_PATTERN = r"^(?:n=)? *(?P<scene>[\w.-]+):? .*?(?P<ms>\d+(?:\.\d+)?) ms"
UNITS_MS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "ns": 1e-6}
TIMEOUT_S = 600.0


class YardstickError(Exception):
    """The program failed, or printed nothing that the pattern finds."""


@dataclass
class Yardstick:
    """A program, and the pattern that finds its figure.

    Groups of the pattern named s, ms, us or ns, with anything behind an underscore (`ms_clear`), are added up. A group
    `scene` must be the case's name or one of its aliases; without it the first line that matches counts.
    """

    command: str
    pattern: re.Pattern[str]
    folder: Path
    only: str | None = None
    times_ms: list[float] = field(default_factory=list)
    pinned_to: list[int] = field(default_factory=list)

    @classmethod
    def parse(cls, text: str, pattern: str, folder: Path, pin: Sequence[int]) -> Yardstick:
        """`[SCENE=]COMMAND`."""
        scene, equals, command = text.partition("=")
        has_scene = bool(equals) and re.fullmatch(r"[\w.-]+", scene) is not None
        compiled = re.compile(pattern, re.MULTILINE)
        if not any(group.partition("_")[0] in UNITS_MS for group in compiled.groupindex):
            raise ValueError(f"a yardstick pattern needs a group named {', '.join(UNITS_MS)}, got {pattern!r}")
        return cls(command if has_scene else text, compiled, folder, scene if has_scene else None, [], list(pin[:1]))

    def measures(self, case: Case) -> bool:
        """Whether it has to do with a case, as far as that is known before it runs."""
        if self.only is not None:
            return self.only == case.name
        return bool(case.aliases)

    def take_turn(self, case: Case) -> None:
        """Run the program once, remember its figure."""
        self.times_ms.append(self.read(self.run(), case))

    def run(self) -> str:
        """The output of the program."""
        pin = (lambda: os.sched_setaffinity(0, self.pinned_to)) if self.pinned_to else None
        try:
            done = subprocess.run(
                shlex.split(self.command),
                cwd=self.folder, preexec_fn=pin, capture_output=True, text=True, timeout=TIMEOUT_S, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise YardstickError(str(error)) from None
        if done.returncode:
            raise YardstickError(f"ended with status {done.returncode}")
        return done.stdout

    def read(self, text: str, case: Case) -> float:
        """The figure for a case in the output of the program, ms."""
        for found in self.pattern.finditer(text):
            groups = found.groupdict()
            if groups.get("scene") is None or groups["scene"] in (case.name, *case.aliases):
                units = [(UNITS_MS.get(name.partition("_")[0]), value) for name, value in groups.items()]
                return sum(unit * float(value) for unit, value in units if unit is not None and value is not None)
        raise YardstickError(f"printed no figure for {case.name}")
