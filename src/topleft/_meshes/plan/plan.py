"""`plan`: the choices and memory of a draw, with reasons, before the draw.

In: the arguments of a verb. Out: a `Plan`: a table of choices and reasons, which verbs take as `plan=` to save checks.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from types import MappingProxyType
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_count, as_names, as_size, as_triangles
from topleft._core.base.memory import KeptMemory
from topleft._core.base.options import Sampling, parse
from topleft._core.raster.fill import Style, draw_fill
from topleft._core.raster.rasterize import draw_coverage, draw_fragments, draw_overdraw, fragment_options
from topleft._core.raster.static_mesh import draw_static
from topleft._core.raster.view import CULL_CODES, View, ViewOptions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.lod.detail import check_tolerance, choose_detail
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.plan.facts import CLASSES, find_cluster_facts, find_facts, memory_of
from topleft._meshes.plan.stages import Stage, find_stages, plan_detail
from topleft._meshes.plan.table import as_html, as_text
from topleft.methods import METHODS
from topleft.typing import DepthTestOption, OutputOption

#: Which verb gives an output.
OUTPUTS = {
    "coverage": "coverage",
    "overdraw": "overdraw",
    "color": "fill",
    "triangle": "rasterize",
    "depth": "rasterize",
    "mask": "rasterize",
    "barycentric": "rasterize",
    "interpolate": "rasterize",
}

#: Options that a plan fixes; calls may change transform, origin, viewport and the like.
FIXED = ("size", "subpixel_bits", "sampling", "method", "cull")

#: The names of options that a `View` holds as numbers.
CODES: dict[str, dict[Any, str]] = {
    "cull": {code: str(name) for name, code in CULL_CODES.items()},
    "method": {method.code: name for name, method in METHODS.items()},
}


class Clock:
    """The times of the stages of the last call."""

    def __init__(self) -> None:
        self.ns: dict[str, int] = {}
        self._last = 0

    def start(self) -> None:
        """Begin a call."""
        self.ns = {}
        self._last = time.perf_counter_ns()

    def mark(self, stage: str) -> None:
        """End a stage."""
        now = time.perf_counter_ns()
        self.ns[stage] = self.ns.get(stage, 0) + now - self._last
        self._last = now


@dataclass(frozen=True, repr=False, eq=False)
class Plan:
    """How a scene is drawn, stage by stage. Made by `plan`.

    Attributes
    ----------
    verb : str
        "coverage", "overdraw", "fill" or "rasterize".
    outputs : tuple of str
        Results of the draw.
    size : (int, int)
        Width and height of the picture in pixels.
    n_vertices, n_triangles : int
    stages : tuple of Stage
        In the order of the pipeline: name, choice, why, rejected.
    classes : mapping of str to int
        Triangles, or pieces of cut triangles, by the code that draws them.
    scratch_bytes, result_bytes : mapping of str to int
        Memory by name: cached from call to call, and returned.
    threads : int
        How many threads draw.

    Examples
    --------
    >>> import topleft as tl
    >>> plan = tl.plan([(0, 0), (4, 0), (0, 4)], [(0, 1, 2)], (4, 4))
    >>> plan.verb, plan.n_triangles, plan.threads
    ('rasterize', 1, 1)
    """

    verb: str
    outputs: tuple[str, ...]
    size: tuple[int, int]
    n_vertices: int
    n_triangles: int
    stages: tuple[Stage, ...]
    classes: Mapping[str, int]
    scratch_bytes: Mapping[str, int]
    result_bytes: Mapping[str, int]
    threads: int
    _view: View = field(repr=False)
    _triangles: NDArray[np.int32] = field(repr=False)
    _triangles_given: ArrayLike = field(repr=False)
    _arguments: tuple[Any, ...] = field(repr=False)
    _mesh: Mesh | None = field(repr=False, default=None)
    _clock: Clock = field(repr=False, default_factory=Clock)

    @property
    def measured_ms(self) -> Mapping[str, float]:
        """The times of the stages in the last call with this plan, in milliseconds; empty before the first call."""
        return {name: ns / 1e6 for name, ns in self._clock.ns.items()}

    def __repr__(self) -> str:
        width, height = self.size
        return (
            f"<Plan: {self.verb} {width}x{height}, {self.n_triangles:,} triangles, {self.threads} thread"
            f"{'s' * (self.threads > 1)}>"
        )

    def _repr_html_(self) -> str:
        return as_html(self.to_dict())

    def explain(self) -> str:
        """Return a table of the stages: the choice, its reason, rejected alternatives, and the measured time."""
        return as_text(self.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as numbers, strings, lists and dicts: for JSON."""
        measured = self.measured_ms
        stages = [
            asdict(stage) | {"rejected": list(stage.rejected), "measured_ms": measured.get(stage.timed_in)}
            for stage in self.stages
        ]
        return {
            "verb": self.verb,
            "outputs": list(self.outputs),
            "size": list(self.size),
            "n_vertices": self.n_vertices,
            "n_triangles": self.n_triangles,
            "stages": stages,
            "classes": dict(self.classes),
            "scratch_bytes": dict(self.scratch_bytes),
            "result_bytes": dict(self.result_bytes),
            "threads": self.threads,
            "measured_ms": sum(measured.values()) if measured else None,
        }

    def measure(self, n_rounds: int = 5) -> Plan:
        """Draw the scene some times on cached memory, store the times of the fastest, and return the plan.

        `fill` is drawn with a grey of four channels for each triangle.
        """
        n_rounds = as_count("n_rounds", n_rounds)
        memory = KeptMemory()
        best: dict[str, int] = {}
        for _ in range(n_rounds + 1):  # the first round touches the memory
            self._run(memory)
            if not best or sum(self._clock.ns.values()) < sum(best.values()):
                best = self._clock.ns
        self._clock.ns = best
        return self

    def _run(self, memory: KeptMemory) -> None:
        """Draw the scene."""
        vertices, depth_test = self._arguments
        view = self.fitted(self._view)
        if self.verb == "coverage":
            draw_coverage(memory, vertices, self._triangles_given, view, None)
        elif self.verb == "overdraw":
            draw_overdraw(memory, vertices, self._triangles_given, view, None)
        elif self.verb == "rasterize" and self._mesh is not None:
            draw_static(memory, self._mesh, view, fragment_options(view, depth_test, None, None))
        elif self.verb == "rasterize":
            options = fragment_options(view, depth_test, None, None)
            draw_fragments(memory, vertices, self._triangles_given, view, options)
        else:
            colors = np.full((self.n_triangles, 4), 128, np.uint8)
            style = Style("triangle", None, "replace", "straight", "values")
            self._clock.start()
            draw_fill(memory, vertices, self._triangles_given, colors, view, style, None)

    def fitted(self, view: View) -> View:
        """Return the view of a call with this plan.

        Raises
        ------
        ValueError
            If the call asks for another size, sampling, method, side to cull or number of sub-pixel bits.
        """
        view.refuse_classic("plan")
        if view.is_exact != self._view.is_exact:
            wishes = ("exact" if view.is_exact else view.subpixel_bits for view in (self._view, view))
            raise ValueError("plan is for subpixel_bits={!r}, got {!r}: make another with topleft.plan".format(*wishes))
        for name in FIXED:
            wish, fact = getattr(self._view, name), getattr(view, name)
            if wish != fact:
                names = CODES.get(name, {})
                raise ValueError(
                    f"plan is for {name}={names.get(wish, wish)}, got {names.get(fact, fact)}: make another with "
                    "topleft.plan"
                )
        self._clock.start()
        return replace(view, threads=view.threads or self.threads, plan=self)

    def triangles_of(self, triangles: ArrayLike, n_vertices: int) -> NDArray[np.int32]:
        """Return the plan's int32 triangles, whose indices have been checked.

        The array that `plan` was called with is assumed unchanged; any other array is compared.

        Raises
        ------
        ValueError
            If the triangles differ, or there are more or fewer vertices.
        """
        if n_vertices != self.n_vertices:
            raise ValueError(
                f"plan is for {self.n_vertices} vertices, got {n_vertices}: make another with topleft.plan"
            )
        if triangles is not self._triangles_given:
            others = as_triangles(triangles)
            if others.shape != self._triangles.shape:
                raise ValueError(
                    f"plan is for {len(self._triangles)} triangles, got {len(others)}: make another with topleft.plan"
                )
            differs = (others != self._triangles).any(axis=1)
            if differs.any():
                row = int(np.argmax(differs))
                raise ValueError(
                    f"plan is for other triangles: row {row} was {self._triangles[row].tolist()}, "
                    f"got {others[row].tolist()}; make another with topleft.plan"
                )
        return self._triangles

    def mark(self, stage: str) -> None:
        """Store the time at which a stage has ended."""
        self._clock.mark(stage)


def plan(
    vertices: ArrayLike | MeshLike,
    triangles: ArrayLike | Camera,
    size: int | tuple[int, int],
    *,
    outputs: OutputOption | str | Sequence[OutputOption | str] = ("triangle", "depth"),
    depth_test: DepthTestOption | None = "less",
    tolerance: float = 0.0,
    **view: Unpack[ViewOptions],
) -> Plan:
    """Return the plan of a draw: at each stage the choice, its reason and the rejected alternatives.

    Vertices are transformed, cut and snapped as the verb does it, and triangles are counted in the code that draws
    them: the plan counts, it does not guess. It takes about as long as a draw. With
    ``subpixel_bits="exact"`` the scene is drawn once, so that the plan has the number of samples in doubt and how they
    were decided; its classes count the triangles with vertices on 2**-8 px.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `coverage`; or a mesh and a camera in the place of the first two, as in `rasterize_mesh`.
    outputs : str or sequence of str
        The results: "coverage"; "overdraw"; "color" (`fill`); or any of "triangle", "depth", "mask",
        "barycentric" and "interpolate" (`rasterize`).
    depth_test : "less", "greater" or None
        As in `rasterize`.
    tolerance : float
        Of a mesh and a camera: the largest error of outlines, pixels, as in `render`. The plan is for the level of
        detail that is drawn, and has a stage "detail" with the level and the reason.

    Returns
    -------
    Plan
        ``.explain()`` is a table, ``.to_dict()`` the plan for JSON. As ``plan=`` of the verbs it saves the conversion
        and the check of the triangles, and stores the time of each stage, as ``.measure()`` does.

    Raises
    ------
    ValueError
        For an output that no verb gives, or outputs of several verbs; for a tolerance without a mesh and a camera, or
        a camera with a lens; else as the verb.
    TypeError, IndexError
        As the verb.

    Examples
    --------
    >>> import topleft as tl
    >>> square, halves = [[0, 0], [300, 0], [300, 300], [0, 300]], [[0, 1, 2], [0, 2, 3]]
    >>> flat = tl.plan(square, halves, (300, 300))
    >>> next(stage.choice for stage in flat.stages if stage.name == "depth")
    'no test, ids alone'
    >>> tl.rasterize(square, halves, (300, 300), plan=flat).triangle[1, :4]
    array([1, 0, 0, 0], dtype=int32)
    """
    wanted = as_names("outputs", outputs)
    verb = find_verb(wanted)
    test = None if depth_test is None else parse(DepthTestOption, "depth_test", depth_test)
    options = ViewOptions(**view)
    if options.pop("plan", None) is not None:
        raise TypeError("plan takes no plan=")
    detail: tuple[Stage, ...] = ()
    mesh: Mesh | None = None
    tolerance = check_tolerance(tolerance)
    if isinstance(triangles, Camera):
        mesh, stage = plan_mesh(vertices, triangles, as_size(size), tolerance, options)
        detail, vertices, triangles = (stage,), mesh.vertices, mesh.triangles
    elif tolerance:
        raise ValueError("tolerance needs a mesh and a camera in the place of vertices and triangles")
    checked = View.parse(size, options)
    checked.refuse_classic("plan")
    if checked.sampling in (Sampling.OUTER, Sampling.INNER, Sampling.AREA) and verb == "rasterize":
        raise ValueError(f"sampling {str(checked.sampling)!r} gives no ids: outputs must be 'coverage' or 'overdraw'")
    cluster_facts = None if mesh is None else find_cluster_facts(mesh, checked, verb, test)
    facts, checked_triangles = find_facts(vertices, triangles, checked, verb, wanted, test)
    facts = replace(facts, clusters=cluster_facts)
    scratch, results = memory_of(facts)
    return Plan(
        verb=verb,
        outputs=wanted,
        size=checked.size,
        n_vertices=facts.n_vertices,
        n_triangles=facts.n_triangles,
        stages=(*detail, *find_stages(facts)),
        classes=MappingProxyType(dict(zip(CLASSES, (row[0] for row in facts.census), strict=True))),
        scratch_bytes=MappingProxyType(scratch),
        result_bytes=MappingProxyType(results),
        threads=max(1, facts.drawing.n_threads),
        _view=checked,
        _triangles=checked_triangles,
        _triangles_given=triangles,
        _arguments=(vertices, depth_test),
        _mesh=mesh,
    )


def plan_mesh(
    mesh: Any, camera: Camera, size: tuple[int, int], tolerance: float, options: ViewOptions
) -> tuple[Mesh, Stage]:
    """Return the level to draw, and its stage; sets the transform."""
    if "transform" in options:
        raise ValueError("transform is that of the camera: give either")
    viewport = options.get("viewport")
    options["transform"] = camera.drawn_from_world(viewport or size)
    options.update(cast(ViewOptions, camera.depth_options))
    detail = choose_detail(
        mesh, camera, size, tolerance=tolerance, cull=options.get("cull"), viewport=viewport,
        origin=options.get("origin", (0, 0)),
    )  # fmt: skip
    return detail.mesh, plan_detail(detail)


def find_verb(outputs: tuple[str, ...]) -> str:
    """Return the verb that gives all outputs."""
    unknown = [name for name in outputs if name not in OUTPUTS]
    if unknown or not outputs:
        choices = ", ".join(map(repr, OUTPUTS))
        raise ValueError(f"outputs must be some of {choices}, got {(unknown[0] if unknown else outputs)!r}")
    verbs = list(dict.fromkeys(OUTPUTS[name] for name in outputs))
    if len(verbs) > 1:
        raise ValueError(f"outputs must come from one verb, got {' and '.join(verbs)}: make a plan for each")
    return verbs[0]
