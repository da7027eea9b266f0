"""Draws the view of a mesh for a page: pictures, layers, the triangle under the pointer, the plan, files.

In: the orbit of the eye, and the look of the mesh. Out: RGBA pixels of the part of the frame that the mesh can cover,
uncompressed, or, while the view turns, as a JPEG, which a browser shows sooner.
"""

from __future__ import annotations

import io
import json
import math
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from topleft import Camera, Light, Mesh, Rasterizer, choose_detail, load, plan, rasterize_mesh, render, render_layers
from topleft._apps.explore.session import Reply, Request, Session
from topleft._core.base.array_types import U8
from topleft._core.base.arrays import as_number
from topleft._core.base.color import Color, as_color
from topleft._core.base.options import check_choice
from topleft.annex.files import png
from topleft.annex.pictures import bounding_sphere, box_corners, ends_to_frame, frame_of_sphere, orbit_view, tangent
from topleft.errors import MeshError
from topleft.scenes import SHAPES, shape
from topleft.typing import CullOption, SamplesOption, UpOption

MAX_SIDE_PX, MAX_PIXELS = 8192, 2**23
"""Limits of a frame: 4K; with 16 samples a pixel, a gigabyte of memory."""

MAX_VERTICES = 20_000_000
"""The most vertices of a file that is dropped on the page: a gigabyte of memory."""

FIRST_SHAPE = "torus-knot"

SHADINGS = ("smooth", "flat", "unlit", "normals", "depth")
LAYERS = (*SHADINGS, "triangle", "cluster", "overdraw", "uv")
"""The layers of a frame: the shadings of `render`, and pictures of numbers."""

LIGHTS: dict[str, tuple[Light, ...] | None] = {
    "headlight": None,
    "sun": (Light((1.0, 2.0, 1.5)),),
    "three": (
        Light((-1.0, 1.0, 1.0), space="eye"),
        Light((1.5, 0.3, 0.5), space="eye", intensity=0.4),
        Light((0.0, 0.8, -1.0), space="eye", intensity=0.6),
    ),
}

AT_REST = "at rest"
"""A sampling: several samples, except while a view moves."""

CONTROLS: dict[str, list[tuple[str, str, list[tuple[Any, str]] | None]]] = {
    "Look": [
        ("layer", "layer", []),
        ("light", "lights", [(name, name) for name in LIGHTS]),
        ("sampling", "sampling", [(AT_REST, "msaa4 at rest")]
         + [(name, name) for name in get_args(SamplesOption)]),
        ("tolerance", "tolerance", [(0, "none: the mesh itself")]
         + [(px, f"{px:g} px: a coarser level") for px in (0.25, 0.5, 1, 2, 4)]),
        ("cull", "cull", [("none", "as materials say"), ("back", "back"), ("front", "front")]),
        ("wireframe", "edges", None),
    ],
    "Camera": [
        ("view angle", "fov", [(40, "40°"), (20, "20°"), (70, "70°"), (0, "no perspective")]),
        ("up", "up", [("file", "as the file says"), ("y", "y"), ("z", "z")]),
        ("turn by itself", "spin", None),
    ],
}  # fmt: skip
"""The controls of a page: label, field of `MeshView`, values and their texts; None is a check box."""

HEAT = np.array([
    (0, 0, 0, 0), (255, 255, 204, 255), (199, 233, 180, 255), (127, 205, 187, 255), (65, 182, 196, 255),
    (29, 145, 192, 255), (34, 94, 168, 255), (37, 52, 148, 255), (8, 29, 88, 255),
], np.uint8)  # fmt: skip
"""Colours of counts 0, 1, 2, 3-4, 5-8, ... and more: light to dark, also for the colour-blind. ColorBrewer's YlGnBu."""

HEAT_STARTS = (1, 2, 3, 5, 9, 17, 33, 65)
HEAT_LABELS = ("1", "2", "3-4", "5-8", "9-16", "17-32", "33-64", "65 and more")


WORDS = {
    "layer": LAYERS,
    "lights": tuple(LIGHTS),
    "up": ("file", *get_args(UpOption)),
    "cull": get_args(CullOption),
    "sampling": get_args(SamplesOption),
}
"""The values of text fields of `MeshView`; a job file quotes them."""


@dataclass(frozen=True)
class MeshView:
    """A view of a page; lights, edges, sampling, tolerance and cull as for `render`."""

    size: tuple[int, int]  # pixels
    azimuth: float = 35.0  # degrees, as for `Camera.framing`
    elevation: float = 20.0
    zoom: float = 1.0  # 1: the sphere round the mesh just fits
    pan: tuple[float, float] = (0.0, 0.0)  # of the middle of the mesh, in half heights of the frame; right and up
    fov: float = 40.0  # degrees from bottom to top; 0 is without perspective
    up: str = "file"  # or an axis
    layer: str = "smooth"  # one of `LAYERS`
    lights: str = "headlight"  # one of `LIGHTS`
    edges: bool = False
    sampling: str = "center"
    tolerance: float = 0.0
    cull: str = "none"

    @classmethod
    def parse(cls, request: Request) -> MeshView:
        """Return the view of a request, checked."""
        fields = {name: request[name] for name in cls.__dataclass_fields__ if name in request}
        if fields.get("sampling") == AT_REST:
            fields["sampling"] = "center" if "background" in request else "msaa4"
        for name in ("azimuth", "elevation", "zoom", "fov", "tolerance"):
            if name in fields and not math.isfinite(as_number(name, fields[name])):
                raise ValueError(f"{name} must be finite, got {fields[name]}")
        size = tuple(int(n) for n in fields["size"])
        if len(size) != 2 or not 1 <= min(size) <= max(size) <= MAX_SIDE_PX or size[0] * size[1] > MAX_PIXELS:
            raise ValueError(f"size must be two numbers of 1 to {MAX_SIDE_PX}, {MAX_PIXELS} pixels, got {size}")
        pan = tuple(float(x) for x in fields.get("pan", (0.0, 0.0)))
        if len(pan) != 2 or not all(abs(x) < 1e6 for x in pan):
            raise ValueError(f"pan must be two numbers, got {pan}")
        view = cls(**{**fields, "size": size, "pan": pan})
        for name, words in WORDS.items():
            check_choice(name, getattr(view, name), words)
        if not 1e-3 <= view.zoom <= 1e4:
            raise ValueError(f"zoom must lie in 0.001 to 10000, got {view.zoom}")
        if view.fov and not 1 <= view.fov <= 170:
            raise ValueError(f"fov must be 0, or lie in 1 to 170 degrees, got {view.fov}")
        return view

    def camera(self, mesh: Mesh) -> Camera:
        """Return the camera of the view."""
        center, radius = bounding_sphere(ends_to_frame(mesh))
        aspect = self.size[0] / self.size[1]
        fov_y_deg = self.fov or 40.0
        distance, height = (length / self.zoom for length in frame_of_sphere(radius, fov_y_deg, aspect))
        if not self.fov:
            distance = 4 * radius
        up: Any = mesh.up if self.up == "file" else self.up
        matrix = orbit_view(center, distance, self.azimuth, self.elevation, up=up)
        half_px = height / 2 if not self.fov else distance * tangent(fov_y_deg / 2)
        matrix[:2, 3] += np.array(self.pan) * half_px
        reach = 1.01 * radius
        near, far = max(distance - reach, 1e-3 * distance, 1e-4 * radius), distance + reach
        if not self.fov:
            return Camera.orthographic(matrix, near=distance - reach, far=far, height=height)
        return Camera.perspective(matrix, near=near, far=far, fov_y_deg=self.fov)

    def look(self) -> dict[str, Any]:
        """Return the options of `render` for the look of the view."""
        look: dict[str, Any] = {"shading": self.layer} if self.layer in SHADINGS else {}
        if self.lights != "headlight" and self.layer in ("smooth", "flat"):
            look["lights"] = LIGHTS[self.lights]
        if self.edges:
            look["edges"] = True
        if self.sampling != "center":
            look["sampling"] = self.sampling
        return look | self.drawn_options()

    def drawn_options(self) -> dict[str, Any]:
        """Return the options that select triangles."""
        options: dict[str, Any] = {"tolerance": float(self.tolerance)} if self.tolerance else {}
        return options | ({"cull": self.cull} if self.cull != "none" else {})


@dataclass
class Shown:
    """The mesh of a page, and memory that frames reuse."""

    mesh: Mesh
    name: str
    rasterizer: Rasterizer | None = None
    colors: dict[str, U8] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def rasterizer_of(self, size: tuple[int, int]) -> Rasterizer:
        """Return the rasterizer for pictures of a size."""
        if self.rasterizer is None or self.rasterizer.size != size:
            self.rasterizer = Rasterizer(size)
        return self.rasterizer


def shown_in(session: Session) -> Shown:
    """Return the mesh of a page: a shape of the library where the page has no mesh."""
    shown = session.kept.get("mesh")
    if shown is None:
        mesh, name = session.content.mesh, session.content.name
        if mesh is None:
            mesh, name = Mesh(*shape(FIRST_SHAPE)), FIRST_SHAPE
        shown = session.kept["mesh"] = Shown(mesh, name)
    return shown


def load_bytes(data: bytes | memoryview, name: str) -> tuple[Mesh, list[str]]:
    """Return the mesh in the bytes of a file, and warnings; the suffix of the name is the format."""
    suffix = Path(name).suffix.lower()
    if not suffix[1:].isalnum() or len(suffix) > 12:
        raise MeshError(f"the end of the name must tell the format, as in bunny.ply, got {name[-40:]!r}")
    with tempfile.TemporaryDirectory(prefix="topleft-") as folder:
        path = Path(folder) / f"mesh{suffix}"
        path.write_bytes(data)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                mesh = load(path, max_vertices=MAX_VERTICES if len(data) > MAX_VERTICES else None)
            except MeshError as error:
                raise MeshError(str(error).replace(str(path), Path(name).name)) from None
        lacks = [str(warning.message).replace(str(path), Path(name).name) for warning in caught]
    if not isinstance(mesh, Mesh):
        raise MeshError(f"{Path(name).name!r} holds points and no triangles; topleft.render draws them")
    return mesh, lacks


def draw(shown: Shown, view: MeshView, background: Color = (0, 0, 0, 0)) -> U8:
    """Return the picture (H, W, 4) of a view; `background`: the colour where no triangle is."""
    mesh, camera, size = shown.mesh, view.camera(shown.mesh), view.size
    memory = shown.rasterizer_of(size)
    if view.layer in SHADINGS:
        return render(mesh, camera, size, background=background, rasterizer=memory, **view.look())
    if view.layer == "overdraw":
        level = choose_detail(mesh, camera, size, tolerance=view.tolerance, cull=view.cull).mesh  # type: ignore[arg-type]
        counts = memory.overdraw(
            level.vertices,
            level.triangles,
            transform=camera.clip_from_world(size),
            cull=view.cull,  # type: ignore[arg-type]
        )
        heat = HEAT.copy()
        heat[0] = background
        return heat[heat_classes()[np.minimum(counts, HEAT_STARTS[-1])]]
    if view.layer == "uv":
        layers = render_layers(mesh, camera, size, layers="uv", rasterizer=memory, **view.drawn_options())
        return uv_colors(layers["uv"], background)
    ids = rasterize_mesh(mesh, camera, size, rasterizer=memory, **view.drawn_options()).triangle
    table = table_of(shown, view, len(mesh.triangles))
    table[-1] = np.array(background, np.uint8).view(np.uint32)[0]
    return table.take(ids, mode="wrap").view(np.uint8).reshape(*ids.shape, 4)


def heat_classes() -> U8:
    """The row of HEAT for each count, the last row for all larger counts."""
    return np.searchsorted(HEAT_STARTS, np.arange(HEAT_STARTS[-1] + 1), side="right").astype(np.uint8)


def table_of(shown: Shown, view: MeshView, n: int) -> NDArray[np.uint32]:
    """Return a colour for each triangle, by its id or its cluster, and a last row for no triangle, as uint32."""
    key = view.layer if not view.tolerance else f"{view.layer}, levels"
    if key not in shown.colors:
        names: NDArray[Any] = np.arange(n)
        if view.layer == "cluster" and not view.tolerance:
            names = shown.mesh.clusters.of_triangles()
        shuffled = (names.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(40)
        table = np.zeros((n + 1, 4), np.uint8)
        for channel in range(3):
            table[:n, channel] = 64 + ((shuffled >> np.uint64(8 * channel)) & np.uint64(0xFF)) * np.uint64(
                3
            ) // np.uint64(4)
        table[:n, 3] = 255
        shown.colors[key] = table
    return shown.colors[key].view(np.uint32).reshape(-1)


def uv_colors(uv: NDArray[np.float32], background: Color) -> U8:
    """Return a checkerboard of eighths, u to the red, v to the blue."""
    is_seen = ~np.isnan(uv[..., 0])
    at = np.where(is_seen[..., None], uv, 0)
    square = (np.floor(8 * at).astype(np.int64).sum(axis=-1) & 1).astype(np.float32)
    part = at - np.floor(at)
    rgb = np.stack([55 + 200 * part[..., 0], 90 + 80 * square, 55 + 200 * part[..., 1], np.full_like(square, 255)], -1)
    return np.where(is_seen[..., None], rgb, np.array(background)).astype(np.uint8)


def box_of(mesh: Mesh, camera: Camera, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return x, y, width and height of the pixels that the mesh can cover: all where it surrounds the eye."""
    corners = box_corners(ends_to_frame(mesh)) @ camera.view[:3, :3].T + camera.view[:3, 3]
    width, height = size
    if camera.projection[3, 2] and corners[:, 2].max() >= -1e-6 * abs(corners[:, 2].min()):
        return 0, 0, width, height
    place = camera.project(box_corners(ends_to_frame(mesh)), size)
    x0, y0 = (max(0, math.floor(place[:, k].min()) - 2) for k in range(2))
    x1, y1 = (min(size[k], math.ceil(place[:, k].max()) + 2) for k in range(2))
    return min(x0, width), min(y0, height), max(0, x1 - x0), max(0, y1 - y0)


def as_jpeg(pixels: U8) -> bytes:
    """Return opaque pixels as a JPEG: 2 to 3 ms for 1280x720."""
    if not pixels.size:
        return b""
    out = io.BytesIO()
    Image.fromarray(pixels[..., :3]).save(out, "JPEG", quality=92)
    return out.getvalue()


# The requests of a page


def answer_open(session: Session, request: Request) -> Reply:
    """Answer the page: the facts of its mesh; a file in the request replaces the mesh first."""
    lacks: list[str] = []
    if request.get("parts"):
        name = str(request.get("name", ""))
        mesh, lacks = load_bytes(request["parts"][0], name)
        session.kept["mesh"] = Shown(mesh, Path(name).name)
    shown = shown_in(session)
    mesh = shown.mesh
    layers = [name for name in LAYERS if name != "uv" or mesh.uv is not None]
    named = {"layer": [(name, name) for name in layers]}
    return Reply({
        "name": shown.name, "n_vertices": len(mesh.vertices), "n_triangles": len(mesh.triangles), "lacks": lacks,
        "layers": layers, "heat": list(zip(HEAT_LABELS, HEAT[1:, :3].tolist(), strict=True)),
        "controls": [(title, [(label, name, named.get(name, options)) for label, name, options in rows])
                     for title, rows in CONTROLS.items()],
    })  # fmt: skip


def answer_draw(session: Session, request: Request) -> Reply:
    """Answer the page: the pixels of a view, the part of the frame that they fill, and how long they took.

    With a `background`, a colour, pixels are encoded as a JPEG: a turning view shows sooner, and at rest the page
    requests it again without.
    """
    shown, view = shown_in(session), MeshView.parse(request)
    background = as_color("background", request["background"], 3) if "background" in request else None
    with shown.lock:
        start = time.perf_counter()
        picture = draw(shown, view, (0, 0, 0, 0) if background is None else (*background, 255))
        drawn = time.perf_counter()
        camera = view.camera(shown.mesh)
        x, y, width, height = box_of(shown.mesh, camera, view.size)
        pixels = np.ascontiguousarray(picture[y : y + height, x : x + width])
        content: NDArray[Any] | bytes = pixels if background is None else as_jpeg(pixels)
        encoded = time.perf_counter()
    header = {
        "box": (x, y, width, height), "size": view.size, "draw_ms": 1e3 * (drawn - start),
        "encode_ms": 1e3 * (encoded - drawn), "n_triangles": len(shown.mesh.triangles),
        "is_jpeg": background is not None,
    }  # fmt: skip
    if view.tolerance:
        detail = choose_detail(shown.mesh, camera, view.size, tolerance=view.tolerance, cull=view.cull)  # type: ignore[arg-type]
        header |= {"level": detail.level, "level_triangles": detail.n_drawn, "why": detail.why}
    return Reply(header, {"pixels": content})


def answer_pick(session: Session, request: Request) -> Reply:
    """Answer the page: the visible triangle of a pixel."""
    shown, view = shown_in(session), MeshView.parse(request)
    x, y = int(request["x"]), int(request["y"])
    mesh, camera = shown.mesh, view.camera(shown.mesh)
    options = {"viewport": view.size, "origin": (x, y), **view.drawn_options()}
    frags = rasterize_mesh(mesh, camera, (1, 1), **options)
    i = int(frags.triangle[0, 0])
    if i < 0:
        return Reply({"triangle": -1, "x": x, "y": y, "rows": [("shows", "nothing")], "corners_px": []})
    level = mesh
    if view.tolerance:
        level = choose_detail(mesh, camera, view.size, tolerance=view.tolerance, cull=view.cull).mesh  # type: ignore[arg-type]
    corners = level.triangles[i].tolist()
    facts: dict[str, Any] = {
        "triangle": i, "x": x, "y": y, "depth": float(frags.depth[0, 0]), "vertices": corners,
        "positions": level.vertices[corners].tolist(), "barycentric": frags.barycentric()[0, 0].tolist(),
        "is_level": level is not mesh, "corners_px": camera.project(level.vertices[corners], view.size)[:, :2].tolist(),
    }  # fmt: skip
    rows = [("triangle of the level" if level is not mesh else "triangle", str(i))]
    rows += [(f"vertex {corner}", numbers(level.vertices[corner])) for corner in corners]
    rows += [("weights", numbers(facts["barycentric"])), ("depth", numbers([facts["depth"]]))]
    if level.uv is not None:
        rows.append(("uv", numbers(frags.interpolate(level.uv)[0, 0])))
    if level.materials:
        k = 0 if level.material_of_triangle is None else int(level.material_of_triangle[i])
        rows.append(("material", f"{k}: {level.materials[k]!r}"[:300]))
    return Reply({**facts, "rows": rows})


def numbers(values: Iterable[float]) -> str:
    """Return numbers to five digits."""
    return ", ".join(f"{float(value):.5g}" for value in values)


def answer_plan(session: Session, request: Request) -> Reply:
    """Answer the page: how the view is drawn, and why."""
    shown, view = shown_in(session), MeshView.parse(request)
    sampling: Any = view.sampling
    view_plan = plan(shown.mesh, view.camera(shown.mesh), view.size, sampling=sampling, **view.drawn_options())
    return Reply({"text": view_plan.explain()})


def answer_save(session: Session, request: Request) -> Reply:
    """Answer the page: the view as a file, "png", "code" (Python) or "job" (for ``topleft render --jobs-file``)."""
    shown, view = shown_in(session), MeshView.parse(request)
    savers: dict[str, Callable[[Shown, MeshView], tuple[str, bytes]]] = {"png": as_png, "code": as_code, "job": as_job}
    if request.get("what") not in savers:
        raise ValueError(f"what must be one of {', '.join(map(repr, savers))}, got {request.get('what')!r}")
    with shown.lock:
        name, data = savers[request["what"]](shown, view)
    return Reply({"name": name}, {"file": data})


def as_png(shown: Shown, view: MeshView) -> tuple[str, bytes]:
    """Return the picture of a view as a PNG."""
    return f"{stem_of(shown)}.png", png.encode(draw(shown, view))


def stem_of(shown: Shown) -> str:
    """Return a name for files of a mesh."""
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in Path(shown.name).stem) or "mesh"


def as_code(shown: Shown, view: MeshView) -> tuple[str, bytes]:
    """Return Python that draws the view, with a camera that is equal to the bit."""
    camera = view.camera(shown.mesh)
    look = {"background": (0, 0, 0, 0), **view.look()}
    lights = look.pop("lights", None)
    words = [f"{name}={value!r}" for name, value in look.items()]
    if lights:
        words.append("lights=[" + ", ".join(light_code(light) for light in lights) + "]")
    mesh = f"tl.Mesh(*tl.scenes.shape({shown.name!r}))" if shown.name in SHAPES else f"tl.load({shown.name!r})"
    lines = [
        '"""A view of the explorer of topleft."""', "", "import topleft as tl", "",
        f"mesh = {mesh}",
        "camera = tl.Camera(",
        f"    view={camera.view.tolist()!r},",
        f"    projection={camera.projection.tolist()!r},",
        f"    aspect={camera.aspect!r},",
        ")",
    ]  # fmt: skip
    size, extra = view.size, "".join(f", {name}={value!r}" for name, value in view.drawn_options().items())
    if view.layer in SHADINGS:
        lines += [f"picture = tl.render(mesh, camera, {size}, {', '.join(words)})"]
        lines += [f'tl.save_image("{stem_of(shown)}.png", picture)']
    elif view.layer == "overdraw":
        where = f"transform=camera.clip_from_world({size})"
        lines += [f"counts = tl.overdraw(mesh.vertices, mesh.triangles, {size}, {where}, cull={view.cull!r})"]
    else:
        name = "uv" if view.layer == "uv" else "triangle"
        lines += [f'{name} = tl.render_layers(mesh, camera, {size}, layers="{name}"{extra})["{name}"]']
    return f"{stem_of(shown)}.py", ("\n".join(lines) + "\n").encode()


def light_code(light: Light) -> str:
    """Return the expression of a light."""
    at = tuple(float(x) for x in light.at)
    return f"tl.Light({at}, space={str(light.space)!r}, intensity={light.intensity!r})"


def as_job(shown: Shown, view: MeshView) -> tuple[str, bytes]:
    """Return a job file of the view; a job fits the mesh in the frame, so zoom and pan are dropped."""
    lines = [
        f"# topleft render --jobs-file {stem_of(shown)}.toml",
        "# A job fits the mesh into the frame: zoom and pan of the explorer are not kept.",
        f"size = [{view.size[0]}, {view.size[1]}]",
        "",
        "[[job]]",
        f"mesh = {json.dumps(''.join(filter(str.isprintable, shown.name)), ensure_ascii=False)}",
        f'out = "{stem_of(shown)}.png"',
        f"azimuth = {view.azimuth % 360:.17g}",
        f"elevation = {view.elevation:.17g}",
        f'up = "{shown.mesh.up if view.up == "file" else view.up}"',
        'background = "transparent"',
        f'sampling = "{view.sampling}"',
        f"tolerance = {float(view.tolerance)!r}",
        f"ortho = {'false' if view.fov else 'true'}",
    ]
    if view.cull != "none":
        lines.append(f'cull = "{view.cull}"')
    if view.fov:
        lines.append(f"fov = {float(view.fov)!r}")
    lines.append(f'shading = "{view.layer if view.layer in SHADINGS else "ids"}"')
    if view.edges and view.layer in SHADINGS:
        lines.append("wireframe = true")
    return f"{stem_of(shown)}.toml", ("\n".join(lines) + "\n").encode()


HANDLERS = {
    "mesh.open": answer_open,
    "mesh.draw": answer_draw,
    "mesh.pick": answer_pick,
    "mesh.plan": answer_plan,
    "mesh.save": answer_save,
}
