"""Plans: what they say is what happens."""

import json
import re
from dataclasses import fields

import numpy as np
import pytest

import topleft as tl
from topleft._core import engine
from topleft._core.engine.isa import build_info
from topleft._core.raster import costs
from topleft._core.raster.view import View
from topleft._meshes.plan.facts import find_facts
from topleft.scenes import random_triangles, shape

SIZE = (320, 200)
EYE = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0.5, 1]])


def boxes(*sizes):
    """Right triangles in boxes of these many pixels, one below the other, and their indices."""
    corners = np.array([[0.0, 0], [1, 0], [0, 1]])
    vertices = np.concatenate([corners * size + [3, 3 + 5 * i] for i, size in enumerate(sizes)])
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)


def stage(plan, name):
    return next(one for one in plan.stages if one.name == name)


def test_classes_are_told_by_the_box():
    found = tl.plan(*boxes(2, 2, 4, 62, 63, 1e4), SIZE, outputs="coverage").classes
    drawn = [(name, n) for name, n in found.items() if n]
    if build_info()["isa"] == "scalar":
        assert drawn == [("tiny", 2), ("small", 1), ("span 64", 3)]
    else:
        assert drawn == [("tiny", 2), ("small", 1), ("rows", 1), ("long", 2)]


def test_classes_of_what_draws_nothing():
    vertices = [[1, 1], [5, 5], [9, 9], [500, 1], [540, 1], [500, 40], [3.6, 3.6], [4.4, 3.6], [3.6, 4.4]]
    triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [3, 5, 4]]
    found = tl.plan(vertices, triangles, SIZE, outputs="coverage", cull="back").classes
    assert {name: n for name, n in found.items() if n} == {"degenerate": 1, "culled": 2, "outside": 1}
    found = tl.plan(vertices, [[6, 8, 7]], SIZE, outputs="coverage", cull="back").classes
    assert {name: n for name, n in found.items() if n} == {"between": 1}


def test_classes_beyond_64_bits():
    vertices, triangles = boxes(40, 40)
    vertices[0] += 2.0**24
    found = tl.plan(vertices, triangles, SIZE).classes
    assert found["edge 128"] + found["span 128"] == 1


@pytest.mark.parametrize("outputs", ["coverage", "overdraw", "color", "triangle"])
@pytest.mark.parametrize("cull", ["none", "back"])
def test_every_triangle_is_of_one_class(outputs, cull):
    rng = np.random.default_rng(8)
    for _ in range(40):
        n = int(rng.integers(1, 100))
        clip = np.concatenate([rng.uniform(-2, 2, (3 * n, 3)), rng.uniform(-0.5, 2, (3 * n, 1))], axis=1)
        plan = tl.plan(clip, np.arange(3 * n).reshape(n, 3), SIZE, outputs=outputs, cull=cull)
        facts = find_facts(clip, np.arange(3 * n).reshape(n, 3), plan._view, plan.verb, (), None)
        assert 0 <= facts.n_beyond <= min(n, facts.n_clipped)
        assert facts.n_cut <= n


@pytest.mark.parametrize("isa", engine.isa_available())
def test_what_covers_is_about_what_is_counted(isa):
    was = engine.isa_in_use()
    engine.use_isa(isa)
    try:
        vertices, triangles, _ = random_triangles(3000, 12, *SIZE)
        facts = find_facts(vertices, triangles, View.parse(SIZE, {}), "overdraw", ("overdraw",), None)
        drawn = tl.overdraw(vertices, triangles, SIZE).sum()
        assert drawn == pytest.approx(facts.covered, rel=0.05)  # areas against samples, and boxes cut by the frame
    finally:
        engine.use_isa(was)


def test_stages_say_what_was_chosen():
    vertices, triangles = boxes(8, 80, 4000, 4000)
    plan = tl.plan(np.rint(vertices), triangles.astype(np.int64), (400, 200))
    assert [one.name for one in plan.stages] == [
        "input", "transform", "clip", "snap", "arithmetic", "cull", "method", "depth", "sampling", "shade", "threads",
    ]  # fmt: skip
    assert stage(plan, "input").choice.endswith("indices made int32, checked on the way")
    assert stage(plan, "depth").choice == "no test, ids alone"
    assert any("0 sub-pixel bits" in text for text in stage(plan, "snap").rejected)
    assert stage(plan, "threads").choice == "1, the caller's own"


def test_transform_says_its_precision():
    plan = tl.plan(*shape("cube"), SIZE, transform=EYE)
    assert stage(plan, "transform").choice == "matrix and divide by w in float64"


def test_clip_counts_the_triangles_that_are_cut():
    clip = [[-1, -1, 0, 1], [1, -1, 0, 1], [0, 1, -3, 1], [0, 0, 0, 1], [1, 0, 0, 1], [0, 1, 0, 1]]
    plan = tl.plan(clip, [[0, 1, 2], [3, 4, 5]], SIZE)
    assert stage(plan, "clip").choice == "1 triangle cut into 2 pieces"
    assert stage(tl.plan(clip, [[3, 4, 5]], SIZE, near_clip=False), "clip").choice == "none"


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"outputs": "colour"}, ValueError, "outputs must be some of 'coverage', .*, got 'colour'"),
        ({"outputs": ()}, ValueError, r"outputs must be some of .*, got \(\)"),
        ({"outputs": ("color", "depth")}, ValueError, "outputs must come from one verb, got fill and rasterize"),
        ({"sampling": "area"}, ValueError, "sampling 'area' gives no ids: outputs must be 'coverage' or 'overdraw'"),
        ({"method": "lerp_scanline"}, ValueError, "method 'lerp_scanline' has no plan"),
        ({"depth_test": "lest"}, ValueError, "depth_test must be one of 'less', 'greater', got 'lest'"),
    ],
)
def test_plan_refuses_what_no_verb_does(options, error, message):
    with pytest.raises(error, match=message):
        tl.plan(*boxes(8), SIZE, **options)


def test_plan_checks_indices():
    with pytest.raises(IndexError, match=r"triangles must hold indices in \[0, 3\)"):
        tl.plan(boxes(8)[0], [[0, 1, 3]], SIZE)


@pytest.mark.parametrize(
    ("size", "triangles"), [((0, 5), [[0, 1, 2]]), ((7, 0), [[0, 1, 2]]), (SIZE, np.empty((0, 3), np.int32))]
)
@pytest.mark.parametrize("outputs", ["coverage", "color", "depth"])
def test_plan_without_triangles_or_pixels_explains_itself(size, triangles, outputs):
    plan = tl.plan(boxes(8)[0], triangles, size, outputs=outputs).measure(1)
    assert plan.explain().startswith(plan.verb)


@pytest.mark.parametrize("sampling", ["center", "msaa4", "area"])
@pytest.mark.parametrize("outputs", ["coverage", "overdraw", "color", ("triangle", "interpolate")])
def test_measured_times_stand_beside_choices(outputs, sampling):
    vertices, triangles, _ = random_triangles(500, 20, *SIZE)
    if sampling == "area" and "triangle" in outputs:
        sampling = "msaa2"
    plan = tl.plan(vertices, triangles, SIZE, outputs=outputs, sampling=sampling)
    assert plan.to_dict()["measured_ms"] is None
    told = plan.measure(2).to_dict()
    measured = {one["name"] for one in told["stages"] if one["measured_ms"] is not None}
    assert {"input", "snap", "method"} <= measured
    assert told["measured_ms"] == pytest.approx(sum(plan.measured_ms.values()))
    assert json.loads(json.dumps(told)) == told


def test_explain_is_a_table():
    plan = tl.plan(*boxes(8, 9), SIZE)
    lines = plan.explain().splitlines()
    assert lines[0] == "rasterize -> triangle, depth: 320x200 pixels, 2 triangles, 6 vertices, 1 thread"
    assert lines[2].split() == ["stage", "choice", "measured"]
    assert max(map(len, lines)) <= 110
    for one in plan.stages:
        assert any(line.startswith(one.name) for line in lines)


def test_repr_is_short_and_html_is_escaped():
    plan = tl.plan(*boxes(8, 9), SIZE)
    assert repr(plan) == "<Plan: rasterize 320x200, 2 triangles, 1 thread>"
    assert plan._repr_html_().startswith("<pre>rasterize -&gt; triangle, depth")


def test_plan_of_a_mesh_counts_its_clusters():
    mesh = tl.Mesh(*tl.scenes.blob(60_000))
    near = tl.Camera.look_at((0, 0, 2.5), fov_y_deg=15)
    plan = tl.plan(mesh, near, (320, 240), threads=1)
    row, n = stage(plan, "clusters"), len(mesh.clusters)
    drawn, whole = (int(number.replace(",", "")) for number in re.findall(r"[0-9][0-9,]*", row.choice)[:2])
    left_out = [int(number) for number in re.findall(r"([0-9]+) (?:outside|turned|hidden)", row.why)]
    assert whole == n == drawn + sum(left_out)
    assert len(left_out) == 2
    assert 0 < drawn < n / 2


@pytest.mark.parametrize(
    ("n_triangles", "options", "why"),
    [
        (500, {}, "done before sorting"),
        (60_000, {"sampling": "msaa4", "subpixel_bits": 2}, "finer grid"),
        (60_000, {"depth_test": None}, "order of the triangles"),
        (60_000, {"cull": "back"}, "most of the mesh shows"),
        (60_000, {"outputs": "coverage"}, "arrays, which may change"),
    ],
)
def test_plan_of_a_mesh_tells_why_it_is_drawn_whole(n_triangles, options, why):
    mesh = tl.Mesh(*tl.scenes.blob(n_triangles))
    row = stage(tl.plan(mesh, tl.Camera.framing(mesh), (320, 240), **options), "clusters")
    assert (row.choice, why in row.why) == ("none", True)


def test_plan_of_several_samples_tells_of_a_plane_of_each():
    mesh = tl.Mesh(*tl.scenes.blob(150_000))
    camera = tl.Camera.look_at((0, 0, 3), near=0.01, far=100.0)
    two, eight = (tl.plan(mesh, camera, (320, 240), sampling=f"msaa{n}", threads=1) for n in (2, 8))
    assert stage(eight, "clusters").choice == stage(two, "clusters").choice != "none"
    assert stage(eight, "sampling").choice == "8 samples a pixel, a picture of each"
    whole = tl.plan(mesh, camera, (1920, 1080), sampling="msaa8", cull="back")
    assert stage(whole, "clusters").choice == "none"


def test_rows_tell_their_units_and_scenes():
    for row in fields(costs.Costs):
        assert row.metadata["prices"]
        assert row.metadata["scene"]
        assert row.metadata["unit"] or isinstance(row.default, str)


def test_cli_explains(capsys):
    from topleft import cli

    assert cli.main(["explain", "torus", "--size", "64x48", "--measure"]) == 0
    assert capsys.readouterr().out.startswith("rasterize -> triangle, depth: 64x48 pixels")
    assert cli.main(["explain", "cube", "--verb", "fill", "--json", "--ortho"]) == 0
    assert json.loads(capsys.readouterr().out)["verb"] == "fill"
    assert cli.main(["explain", "cube", "--subpixel-bits", "exact"]) == 0
    assert "vertices stay where they are" in capsys.readouterr().out


def test_page_has_the_plan_of_its_mesh():
    from benchmarks.choices import planner_page

    words = " ".join(planner_page.PAGE.read_text(encoding="utf-8").split())
    found = planner_page.make_plan()
    assert found.explain().splitlines()[0] in words
    for name in ("transform", "clip", "snap", "depth"):
        assert " ".join(stage(found, name).why.split()) in words


def test_plan_of_large_triangles_in_the_largest_picture():
    """All together they have more than 2^63 pixels, which overflowed a count: UBSan says so (.ci/sanitize)."""
    rng = np.random.default_rng(0)
    corners = np.hstack([rng.uniform(-2, 2, (48, 3)), rng.uniform(0.001, 1, (48, 1))])
    size, origin = (2**31 - 1, 2**31 - 1), (-(2**31), -(2**31))
    plan = tl.plan(corners, rng.integers(0, 48, (64, 3)), size, outputs="coverage", subpixel_bits=0, origin=origin)
    assert "64 triangles" in plan.explain()
