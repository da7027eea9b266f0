"""Peers beside the methods: each in a process of its own, told which scene to draw, and timed by its CPU time."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.contestants import START_TIMEOUT_S, TURN_TIMEOUT_S, Child, Contestant, SkippedError
from benchmarks.harness.errors import Picture
from benchmarks.harness.turns import Turn
from benchmarks.peers import load_peer, why_not
from benchmarks.scenes.cases import Case, Scene
from benchmarks.scenes.families import Triangles

MASK_TASKS = ("mask", "labels", "depth-2d")
"""The outputs of a peer that show coverage, the cheapest first."""
SMOOTH_TASKS = ("smooth",)


@dataclass
class Peers:
    """The peers that are taking part, by name, and those that are not, with the reason."""

    folder: Path
    children: dict[str, Child] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)

    def start(self, names: Sequence[str], tasks: Sequence[str], scene: Triangles, frame_px: int) -> None:
        """Start a process for each peer that does one of the tasks."""
        for name in names:
            peer = load_peer(name)
            task = next((task for task in tasks if task in peer.TASKS), None)
            if task is None:
                continue
            try:
                if reason := why_not(peer, task, 1):
                    raise SkippedError(reason)
                case = Case(f"{task} {name}", task, lambda: None)
                contestant = Contestant(name, 1, case)
                folder = self._save(task, scene, frame_px)
                self.children[name] = Child.start(contestant, folder, [], self.folder)
            except SkippedError as reason:
                self.skipped[name] = str(reason)

    def show(self, scene: Triangles, frame_px: int) -> dict[str, Picture]:
        """Return the picture that each draws of another scene, which it then goes on with."""
        pictures = {}
        for name in list(self.children):
            child = self.children[name]
            task = child.contestant.case.task
            try:
                child.ask(START_TIMEOUT_S, do="scene", scene=str(self._save(task, scene, frame_px)))
                pictures[name] = child.picture(self.folder / f"picture-{name}")
            except SkippedError as reason:
                self._lose(name, reason)
        return pictures

    def turns(self) -> dict[str, Turn]:
        """Return the turn of each, on the scene that it was shown last."""

        def turn_of_child(child: Child) -> Turn:
            return lambda seconds: child.ask(TURN_TIMEOUT_S, do="turn", seconds=seconds, clock="cpu")["times"]

        return {name: turn_of_child(child) for name, child in self.children.items()}

    def facts(self) -> dict[str, str]:
        """The outputs of each, with its version."""
        return {
            name: f"{load_peer(name).DISTRIBUTION} {child.facts['version']}, {child.facts['gives']}"
            for name, child in self.children.items()
        }

    def stop(self) -> None:
        """End the processes."""
        for child in self.children.values():
            child.stop()

    def _lose(self, name: str, reason: SkippedError) -> None:
        self.skipped[name] = str(reason)
        self.children.pop(name).stop()

    def _save(self, task: str, scene: Triangles, frame_px: int) -> Path:
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        Scene(task, (frame_px, frame_px), *scene).save(folder)
        return folder


def smooth_coverage(picture: Picture) -> NDArray[np.float64]:
    """How much of each pixel a picture covers, 0 to 1."""
    return picture["smooth"].astype(np.float64) / 255
