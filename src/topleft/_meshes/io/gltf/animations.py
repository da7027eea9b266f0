"""The nodes of a glTF file at a time of its animations.

Input: the JSON, unchecked, and a moment. Output: the JSON with the nodes' translations, rotations, scales and
weights of the moment.

Based on: Khronos Group, "glTF 2.0 Specification", 2021, 3.11 and appendix C.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._meshes.io.gltf.accessors import Accessors, Tree, entry
from topleft._meshes.io.references import InputFile, Moment
from topleft.errors import MeshError

ALL_CLIPS = "all"
N_NUMBERS = {"translation": 3, "rotation": 4, "scale": 3}
"""By property; `weights` have a number for each morph target of the mesh."""

N_PARTS = {"STEP": 1, "LINEAR": 1, "CUBICSPLINE": 3}
"""Values of a key: a spline has a tangent before the value and one behind it."""

NEARLY_ONE = 0.9995
"""Rotations with a larger cosine of half their angle are mixed linearly: off by less than 1e-6 of it."""


def posed(tree: Tree, accessors: Accessors, moment: Moment, source: InputFile) -> Tree:
    """The file at a moment: a property has the value of its first key before it, that of its last key after it."""
    rows = tree.get("animations")
    if not rows:
        raise MeshError(f"{str(source.path)!r} has no animations, so it has no time={moment.time:g}")
    count_targets = cache(lambda mesh: n_targets_of(tree, mesh))
    found: dict[tuple[int, str], list[float]] = {}
    for animation in chosen(tree, rows, moment.clip, source):
        for channel in animation["channels"]:
            target = channel["target"]
            if "node" not in target:  # that of an extension
                continue
            node, path = entry(tree, "nodes", target["node"]), target.get("path")
            if path != "weights" and path not in N_NUMBERS:
                raise MeshError(f"an animation moves {path!r} of a node"[:120])
            if "matrix" in node and path != "weights":
                source.notes.add("animations of nodes that have a matrix not played")
            elif (target["node"], path) not in found:
                sampler = entry(animation, "samplers", channel.get("sampler"))
                n_targets = count_targets(node["mesh"]) if "mesh" in node else 0
                n_numbers = n_targets if path == "weights" else N_NUMBERS[path]
                source.budget.spend("max_nodes", 1)
                n_keys, _ = accessors.shape(sampler.get("input"))
                source.budget.spend("max_vertices", n_keys + n_numbers)  # each channel reads all keys of its sampler
                found[target["node"], path] = value_at(sampler, accessors, moment.time, path, n_numbers).tolist()
    nodes = list(tree["nodes"]) if found else []
    for (index, path), value in found.items():
        nodes[index] = {**nodes[index], path: value}
    return {**tree, "nodes": nodes} if found else tree


def n_targets_of(tree: Tree, mesh: Any) -> int:
    """The number of morph targets of a mesh: that of its primitive with the most."""
    return max(
        (len(primitive.get("targets", ())) for primitive in entry(tree, "meshes", mesh)["primitives"]), default=0
    )


def chosen(tree: Tree, rows: list[Any], clip: int | str | None, source: InputFile) -> list[Tree]:
    """The animations that play: that of an index or a name, all of them, or the first, with a note of the others."""
    animations = [entry(tree, "animations", i) for i in range(len(rows))]
    names = [str(row.get("name", i)) for i, row in enumerate(animations)]
    if clip is None:
        for name in names[1:]:
            source.notes.add("animations not played", name)
        return animations[:1]
    if isinstance(clip, str):
        if clip in names:
            return [animations[names.index(clip)]]
        if clip == ALL_CLIPS:
            return animations
    elif 0 <= clip < len(animations):
        return [animations[clip]]
    some = ", ".join(map(repr, names[:10])) + (", ..." if len(names) > 10 else "")
    span = "0" if len(names) == 1 else f"0 to {len(names) - 1}"
    raise MeshError(f"cannot read {str(source.path)!r}: clip must be {span}, or one of {some}, got {clip!r}")


def length_of(animations: list[Tree], accessors: Accessors, source: InputFile) -> float:
    """The seconds from 0 to the last key of a node in animations."""
    last = 0.0
    for animation in animations:
        channels = [channel for channel in animation["channels"] if "node" in channel["target"]]
        for sampler in {channel.get("sampler"): None for channel in channels}:
            row = entry(animation, "samplers", sampler)
            source.budget.spend("max_vertices", accessors.shape(row.get("input"))[0])
            last = max(last, float(keys_of(row, accessors)[-1]))
    return last


def keys_of(sampler: Tree, accessors: Accessors) -> F64:
    """The seconds (N,) of the keys of a sampler, one or more."""
    keys = accessors.array(sampler.get("input")).astype(np.float64).ravel()
    if not len(keys) or not (np.isfinite(keys).all() and (np.diff(keys) >= 0).all()):
        raise MeshError("an animation is broken: its keys do not go up")
    return keys


def value_at(sampler: Tree, accessors: Accessors, time: float, path: str, n_numbers: int) -> F64:
    """The `n_numbers` values (C,) of a sampler at a time; the two keys about it are decoded, and no others."""
    kind = sampler.get("interpolation", "LINEAR")
    if kind not in N_PARTS:
        raise MeshError(f"an animation has the interpolation {kind!r}"[:120])
    keys = keys_of(sampler, accessors)
    n, n_parts = len(keys), N_PARTS[kind]
    n_rows, n_columns = accessors.shape(sampler.get("output"))
    if n_rows * n_columns != n * n_parts * n_numbers or n_rows % n:
        wish = f"{n_numbers} morph targets" if path == "weights" else path
        raise MeshError(f"an animation has {n_rows * n_columns} numbers for {n} keys of {wish}")
    time = float(np.float32(time))  # as the keys are: 0.1 is not before its own key
    i = int(np.searchsorted(keys, time, side="right")) - 1
    start, end = max(i, 0), min(i + 2, n)
    rows = accessors.rows(sampler.get("output"), start * (n_rows // n), end * (n_rows // n))
    of_key = rows.astype(np.float64).reshape(end - start, n_parts, n_numbers)
    value = of_key[:, n_parts // 2]
    if i < 0 or i == n - 1 or kind == "STEP":
        return value[0]
    span = keys[i + 1] - keys[i]
    u = float((time - keys[i]) / span)
    before, behind = value
    if kind == "CUBICSPLINE":
        rise = (3 - 2 * u) * u * u
        leaving, arriving = span * ((u - 2) * u + 1) * u * of_key[0, 2], span * (u - 1) * u * u * of_key[1, 0]
        return (1 - rise) * before + leaving + rise * behind + arriving
    first, second = slerp_weights(before, behind, u) if path == "rotation" else (1 - u, u)
    return first * before + second * behind


def slerp_weights(a: F64, b: F64, u: float) -> tuple[float, float]:
    """The weights of two quaternions in the rotation that goes the short way between them at an even speed.

    Based on: Shoemake, K., "Animating Rotation with Quaternion Curves", SIGGRAPH 1985.
    """
    cosine = float((a * b).sum()) / max(float(np.sqrt((a * a).sum() * (b * b).sum())), 1e-300)
    sign = -1.0 if cosine < 0 else 1.0
    if not abs(cosine) < NEARLY_ONE:
        return 1 - u, sign * u
    angle_deg = 90 - engine.arc_sine(abs(cosine))
    before, behind, whole = (engine.cosine_and_sine(share * angle_deg)[1] for share in (1 - u, u, 1.0))
    return before / whole, sign * behind / whole
