"""Contestants: who draws a case, and the processes that do."""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.machine import ROOT
from benchmarks.peers import BROKEN, OURS, PEERS, environment_of, load_peer, why_not
from benchmarks.scenes.cases import Case

START_TIMEOUT_S = 300.0
TURN_TIMEOUT_S = 120.0


@dataclass(frozen=True)
class Contestant:
    """A program that draws: topleft with one instruction set, or a peer; a number of threads; a case."""

    peer: str
    threads: int
    case: Case
    isa: str | None = None
    is_beside: bool = False
    way: str | None = None
    """Of several to do the task; see `WAYS` of the peer's file."""

    @property
    def name(self) -> str:
        """Its name in the table."""
        words = [self.peer, *filter(None, (self.isa, self.way))]
        words += [f"{self.threads} threads"] if self.threads > 1 else []
        return " ".join(words + ([f"on {self.case.name}"] if self.is_beside else []))

    def environment(self) -> dict[str, str]:
        """Variables of its process."""
        env = {key: value for key, value in os.environ.items() if not key.startswith("TOPLEFT_")}
        limits = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "MKL_NUM_THREADS")
        env |= dict.fromkeys(limits, str(self.threads))
        if self.isa:
            env["TOPLEFT_ISA"] = self.isa
        return env | dict(environment_of(load_peer(self.peer), self.threads))


def choose(
    case: Case, beside: Case | None, peers: Sequence[str], isas: Sequence[str], threads: Sequence[int]
) -> tuple[list[Contestant], list[dict[str, str]]]:
    """Who takes part in a case, and who does not, with the reason. All are compared with the first one."""
    ways = load_peer(OURS).WAYS.get(case.task, (None,))
    chosen = [Contestant(OURS, n, case, isa, way=way) for n in threads for isa in isas for way in ways]
    if beside is not None:
        chosen += [Contestant(OURS, n, beside, isa, is_beside=True) for n in threads for isa in isas]
    skipped = []
    for peer in peers:
        for n in threads:
            contestant = Contestant(peer, n, case)
            reason = why_not(load_peer(peer), case.task, n)
            if reason is None:
                chosen.append(contestant)
            elif not reason.startswith(("does not do", "runs on one")):
                skipped.append({"name": contestant.name, "reason": reason})
    return chosen, skipped


def known_peers() -> Iterable[str]:
    """Names that `--peer` takes."""
    return [*PEERS, BROKEN]


class SkippedError(Exception):
    """A contestant cannot go on; the message says why."""


@dataclass
class Child:
    """The process of a contestant, and its measurements."""

    contestant: Contestant
    process: subprocess.Popen[bytes]
    log: Path
    facts: dict[str, Any] = field(default_factory=dict)
    turns: list[list[float]] = field(default_factory=list)
    cpu_shares: list[float] = field(default_factory=list)
    _rest: bytes = b""

    @classmethod
    def start(cls, contestant: Contestant, scene: Path, pin: Sequence[int], folder: Path) -> Child:
        """Start it, wait until it is warm."""
        log = Path(tempfile.mkstemp(suffix=".log", dir=folder)[1])
        with log.open("wb") as stderr:
            process = subprocess.Popen(
                [sys.executable, "-m", "benchmarks.harness.worker"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr,
                cwd=ROOT, env=contestant.environment(),
            )  # fmt: skip
        child = cls(contestant, process, log)
        # As many CPUs of the list as there are threads; a program with more threads than that is not pinned.
        cpus = list(pin[: contestant.threads]) if len(pin) >= contestant.threads else []
        order = {"peer": contestant.peer, "threads": contestant.threads, "scene": str(scene), "cpus": cpus,
                 "options": {"way": contestant.way} if contestant.way else {}}  # fmt: skip
        try:
            child.facts = child.ask(START_TIMEOUT_S, **order) | {"pinned_to": cpus}
        except BaseException:
            child.stop()
            raise
        return child

    def ask(self, timeout_s: float, **order: Any) -> dict[str, Any]:
        """Send one order, return the answer."""
        try:
            self.process.stdin.write(json.dumps(order).encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise SkippedError(self._last_words()) from None
        answer = json.loads(self._read_line(timeout_s))
        if "skip" in answer:
            raise SkippedError(answer["skip"])
        return answer

    def take_turn(self, seconds: float) -> None:
        """Draw for that long, remember the milliseconds."""
        answer = self.ask(TURN_TIMEOUT_S + seconds, do="turn", seconds=seconds)
        self.turns.append(answer["times"])
        self.cpu_shares.append(answer["cpu_share"])

    def picture(self, folder: Path) -> dict[str, np.ndarray]:
        """Its result."""
        names = self.ask(TURN_TIMEOUT_S, do="picture", folder=str(folder))["names"]
        return {name: np.load(folder / f"{name}.npy") for name in names}

    def stop(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()

    def _read_line(self, timeout_s: float) -> bytes:
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._rest:
                if not selector.select(timeout_s):
                    self.process.kill()
                    raise SkippedError(f"no answer within {timeout_s:.0f} s")
                data = os.read(self.process.stdout.fileno(), 1 << 16)
                if not data:
                    raise SkippedError(self._last_words())
                self._rest += data
        line, _, self._rest = self._rest.partition(b"\n")
        return line

    def _last_words(self) -> str:
        code = self.process.wait()
        lines = [line for line in self.log.read_text(errors="replace").splitlines() if line.strip()]
        return f"ended with status {code}" + (f": {lines[-1].strip()[:200]}" if lines else "")
