"""`plan`: the choices of a draw, with reasons, before the draw.

In: the arguments of a verb. Out: a `Plan`: a table of choices and reasons.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from types import MappingProxyType
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_count, as_names, as_size
from topleft._core.base.memory import KeptMemory
from topleft._core.base.options import Sampling, parse
from topleft._core.raster.fill import Style, draw_fill
from topleft._core.raster.rasterize import draw_coverage, draw_fragments, draw_overdraw, fragment_options
from topleft._core.raster.static_mesh import draw_static
from topleft._core.raster.view import Clock, View, ViewOptions
from topleft._meshes.camera.camera import Camera
from topleft._meshes.lod.detail import check_tolerance, choose_detail
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.plan.facts import CLASSES, find_cluster_facts, find_facts
from topleft._meshes.plan.stages import Stage, find_stages, plan_detail
from topleft._meshes.plan.table import as_text
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
    threads: int
    _view: View = field(repr=False)
    _arguments: tuple[Any, ...] = field(repr=False)
    _mesh: Mesh | None = field(repr=False, default=None)
    _measured_ns: dict[str, int] = field(repr=False, default_factory=dict)

    @property
    def measured_ms(self) -> Mapping[str, float]:
        """The times of the stages that `measure` has stored, in milliseconds; empty before."""
        return {name: ns / 1e6 for name, ns in self._measured_ns.items()}

    def __repr__(self) -> str:
        width, height = self.size
        return (
            f"<Plan: {self.verb} {width}x{height}, {self.n_triangles:,} triangles, {self.threads} thread"
            f"{'s' * (self.threads > 1)}>"
        )

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.explain())}</pre>"

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
            "threads": self.threads,
            "measured_ms": sum(measured.values()) if measured else None,
        }

    def measure(self, n_rounds: int = 5) -> Plan:
        """Draw the scene some times on cached memory, store the times of the fastest, and return the plan.

        `fill` is drawn with a grey of four channels for each triangle.
        """
        n_rounds = as_count("n_rounds", n_rounds)
        memory = KeptMemory()
        clocks = [self._run(memory) for _ in range(n_rounds + 1)]  # the first round touches the memory
        best = min(clocks, key=lambda clock: sum(clock.ns.values()))
        self._measured_ns.update(best.ns)
        return self

    def _run(self, memory: KeptMemory) -> Clock:
        """Draw the scene; returns its times."""
        vertices, triangles, depth_test = self._arguments
        clock = Clock()
        view = self._view.but(threads=self.threads, clock=clock)
        if self.verb == "coverage":
            draw_coverage(memory, vertices, triangles, view, None)
        elif self.verb == "overdraw":
            draw_overdraw(memory, vertices, triangles, view, None)
        elif self.verb == "rasterize" and self._mesh is not None:
            draw_static(memory, self._mesh, view, fragment_options(view, depth_test, None, None))
        elif self.verb == "rasterize":
            options = fragment_options(view, depth_test, None, None)
            draw_fragments(memory, vertices, triangles, view, options)
        else:
            colors = np.full((self.n_triangles, 4), 128, np.uint8)
            style = Style("triangle", None, "replace", "straight", "values")
            draw_fill(memory, vertices, triangles, colors, view, style, None)
        return clock


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
    them: the plan counts, it does not guess. It takes about as long as a draw. With ``subpixel_bits="exact"`` its
    classes count the triangles with vertices on 2**-8 px.

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
        ``.explain()`` is a table, ``.to_dict()`` the plan for JSON. ``.measure()`` stores the time of each stage.

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
    """
    wanted = as_names("outputs", outputs)
    verb = find_verb(wanted)
    test = None if depth_test is None else parse(DepthTestOption, "depth_test", depth_test)
    options = ViewOptions(**view)
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
    facts = replace(find_facts(vertices, triangles, checked, verb, wanted, test), clusters=cluster_facts)
    return Plan(
        verb=verb,
        outputs=wanted,
        size=checked.size,
        n_vertices=facts.n_vertices,
        n_triangles=facts.n_triangles,
        stages=(*detail, *find_stages(facts)),
        classes=MappingProxyType(dict(zip(CLASSES, (row[0] for row in facts.census), strict=True))),
        threads=max(1, facts.drawing.n_threads),
        _view=checked,
        _arguments=(vertices, triangles, depth_test),
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
