"""Writes docs/api.md: every public name with its signature and the first line of its docstring.

`python docs/make_api.py`, with the package importable; it needs nothing else. `tests/house/test_docs.py` holds the page
to the package. A new public name has to be given a subject here; exceptions find theirs.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import topleft as tl

PAGE = Path(__file__).with_name("api.md")

SUBJECTS: Mapping[str, tuple[str, ...]] = {
    "Triangles to pixels": (
        "coverage", "overdraw", "fill", "rasterize", "Fragments", "FragmentsBatch", "wireframe",
        "Rasterizer", "pixel_grid",
    ),
    "Polygons": ("polygons", "overlap", "Overlap"),
    "Layers of triangles, sorted by depth": ("peel", "DepthLayers", "composite"),
    "Meshes and scenes": ("Mesh", "load", "as_mesh", "Instance", "Scene"),
    "Clouds of points": ("points", "PointFragments", "Points"),
    "Materials and light": ("Material", "Texture", "Light", "Fog", "Environment"),
    "Cameras": ("Camera", "OpenCVLens", "FisheyeLens", "load_cameras", "turntable", "viewpoints"),
    "Pictures": ("render", "render_transparent", "silhouette", "save_image"),
    "Buffers and layers of a mesh": (
        "rasterize_mesh", "SceneFragments", "shade", "render_layers", "ViewLayers", "visible_layers",
        "SceneDepthLayers",
    ),
    "Many pictures": ("render_batch", "Job"),
    "Levels of detail": ("simplify", "Levels", "Level", "choose_detail", "Detail"),
    "Fields and heights on a grid": ("field", "height_map", "Grid"),
    "Huge rasters, many machines": ("tiles", "Tiles", "Window", "merge"),
    "What a draw needs, and why": ("plan", "Plan"),
    "Moved and watched in the browser": ("explore", "Explorer"),
    "Scenes to try things on": ("scenes",),
    "The library itself": ("release_memory", "build_info", "bresenham_line", "__version__"),
}  # fmt: skip
"""In reading order."""

RETURNED = frozenset({
    "DepthLayers", "Detail", "Explorer", "Fragments", "FragmentsBatch", "Overlap", "Plan", "SceneDepthLayers",
    "SceneFragments", "Tiles", "ViewLayers", "Window",
})  # fmt: skip
"""Classes that functions return: nobody calls them."""

MEMBERS: Mapping[str, tuple[str, ...]] = {
    "Fragments": (
        "triangle", "depth", "mask", "barycentric", "interpolate", "samples_triangle", "samples_depth", "sample",
        "distance", "only",
    ),
    "FragmentsBatch": ("mask", "barycentric", "interpolate"),
    "Overlap": ("means", "sums", "totals", "spread", "to_scipy"),
    "DepthLayers": ("triangle", "depth", "count", "layer"),
    "Mesh": ("bounds", "vertex_normals", "corner_normals"),
    "Points": ("bounds",),
    "PointFragments": ("point", "depth", "mask", "interpolate", "sample", "only"),
    "Instance": ("is_mirrored",),
    "Scene": ("n_triangles", "bounds"),
    "Camera": (
        "framing", "look_at", "from_matrix", "from_intrinsics", "perspective", "orthographic", "off_center",
        "clip_from_world", "clip_from_eye", "project", "straightened",
    ),
    "OpenCVLens": ("distort",),
    "FisheyeLens": ("distort",),
    "SceneFragments": ("instance", "triangle", "samples_instance", "samples_triangle"),
    "ViewLayers": ("save",),
    "SceneDepthLayers": ("instance", "triangle"),
    "Job": ("files",),
    "Levels": ("save", "load"),
    "Explorer": ("vertices", "wait", "close"),
    "Tiles": (
        "windows", "read", "grid", "dtype", "shape", "n_windows", "explain", "to_dask", "to_xarray", "to_zarr",
        "to_geotiff", "to_deepzoom",
    ),
    "Window": ("slices",),
    "Grid": ("around", "pixel_size", "x_centers", "y_centers", "to_pixels"),
    "Plan": ("explain", "to_dict", "measure", "estimated_ms", "measured_ms"),
    "scenes": (
        "shape", "cube", "tetrahedron", "octahedron", "icosahedron", "icosphere", "torus", "torus_knot", "blob",
        "large_triangle", "random_triangles", "planar_mesh", "two_triangles", "square_of_four", "tight_fan", "to_clip",
        "to_pixels",
    ),
}  # fmt: skip
"""What is promised of a class beside its signature; others of its members are for the package itself."""

MODULES = ("scenes", "failure_scenes", "errors", "typing", "methods", "methods.reference", "testing", "cli", "torch")
"""Modules that may be imported. All others are private, as the underscore in their path says."""

HEAD = """\
# The public names

Everything that `topleft` promises, with its signature and the first line of its docstring; `help(tl.NAME)` has the
rest. Written by `python docs/make_api.py`; a test holds it to the package.

```python
import topleft as tl
```
"""


def page() -> str:
    """Return docs/api.md.

    Raises
    ------
    ValueError
        If a public name has no subject, or a subject has a name that is not public.
    """
    subjects = {**SUBJECTS, "Errors": tuple(filter(is_error, tl.__all__))}
    listed = [name for names in subjects.values() for name in names]
    if without := set(tl.__all__) - set(listed):
        raise ValueError(f"SUBJECTS in docs/make_api.py must place {', '.join(sorted(without))}")
    if unknown := set(listed) - set(tl.__all__):
        raise ValueError(f"SUBJECTS in docs/make_api.py has names that are not public: {', '.join(sorted(unknown))}")
    parts = [HEAD]
    for subject, names in subjects.items():
        parts.append(f"## {subject}\n")
        parts += (entry(name) for name in names)
    parts.append("## Modules\n\n| module | what it holds |\n|---|---|")
    parts += (f"| `topleft.{name}` | {one_line(docstring_of(f'topleft.{name}'))} |" for name in MODULES)
    return "\n".join(parts) + "\n"


def is_error(name: str) -> bool:
    """Tell whether a public name is an exception."""
    thing = getattr(tl, name)
    return inspect.isclass(thing) and issubclass(thing, BaseException)


def entry(name: str) -> str:
    """Return the part of the page for one name."""
    thing = getattr(tl, name)
    if name == "__version__":
        return f"### `{name}`\n\nThe version, as text.\n"
    lines = [f"### `{name}`", "", summary(thing), ""]
    if callable(thing) and name not in RETURNED and not is_error(name):
        lines += ["```python", f"tl.{name}{signature(thing)}", "```", ""]
    if bases := [base.__name__ for base in getattr(thing, "__mro__", ())[1:] if base.__name__ in tl.__all__]:
        lines += [f"Also a `{bases[0]}`.", ""]
    if rows := list(members(name)):
        lines += ["| | |", "|---|---|", *(f"| `{call}` | {text} |" for call, text in rows), ""]
    return "\n".join(lines)


def members(name: str) -> Iterator[tuple[str, str]]:
    """Yield how to write each member that is promised of a class or module, and what it is."""
    owner = getattr(tl, name)
    for member in MEMBERS.get(name, ()):
        found, kind = getattr(owner, member), inspect.getattr_static(owner, member)
        is_value = isinstance(kind, property | cached_property)
        yield (member, summary(kind)) if is_value else (f"{member}{signature(found)}", summary(found))


def signature(thing: Any) -> str:
    """Return the parameters with their defaults, without types: these are in the docstrings."""
    found = inspect.signature(thing)
    parameters = [one.replace(annotation=one.empty) for one in found.parameters.values() if one.name != "self"]
    return str(found.replace(parameters=parameters, return_annotation=found.empty)).replace("<factory>", "...")


def summary(thing: Any) -> str:
    """Return the first paragraph of the docstring in one line."""
    return one_line(inspect.getdoc(thing) or "")


def docstring_of(module: str) -> str:
    """Return the docstring of a module, which need not be importable: one of them is for PyTorch."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return ast.get_docstring(ast.parse(Path(spec.origin).read_text(encoding="utf-8"))) or ""


def one_line(text: str) -> str:
    """Return the first paragraph in one line, to stand in a table."""
    return " ".join(text.partition("\n\n")[0].split()).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
