"""`topleft.torch` as operators of PyTorch: compiled, over batches, on any memory, with any number of threads."""

import io
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from engine_cases import ON_EACH_ISA, on, one_by_one

torch = pytest.importorskip("torch")

import topleft as tl  # noqa: E402 (PyTorch may be missing)
import topleft.torch as dr  # noqa: E402
from topleft import scenes  # noqa: E402
from topleft._core.base.arrays import as_checked_triangles  # noqa: E402
from topleft._core.gradients import tensors  # noqa: E402
from topleft._core.gradients.pictures import AttributePictures  # noqa: E402
from topleft._core.gradients.tensors import PixelGrid, as_rule  # noqa: E402
from topleft._core.raster.operations import Call, pictures_of  # noqa: E402
from topleft._torch import operators  # noqa: E402

CTX = dr.RasterizeContext()
EDGES = ("silhouette", "area", "straight-through")


def sphere(n_pictures=1, dtype=torch.float32, level=3):
    """Spheres in clip space, seen from near by, and colours."""
    vertices, triangles = scenes.icosphere(level)
    moved = [vertices + [0.1 * k, 0.05, -2.5] for k in range(n_pictures)]
    pos = np.stack([np.column_stack([1.7 * v[:, :2], -1.2 * v[:, 2] - 2, -v[:, 2]]) for v in moved])
    colours = np.random.default_rng(1).random((len(vertices), 3))
    return (
        torch.tensor(pos, dtype=dtype),
        torch.tensor(triangles, dtype=torch.int32),
        torch.tensor(colours, dtype=dtype),
    )


def picture(pos, tri, colours, tex=None, edges="area", size=(70, 150)):
    """All of the functions on the way to a picture."""
    rast, rast_db = dr.rasterize(CTX, pos, tri, size)
    out, out_da = dr.interpolate(colours, rast, tri, rast_db, [0, 1])
    if tex is not None:
        out = out * dr.texture(tex, out[..., :2], out_da)
    return dr.antialias(out, rast, pos, tri, edges=edges)


def gradients(pos, tri, colours, tex, **options):
    """The gradients of some number that the picture gives."""
    given = [one.clone().requires_grad_() for one in (pos, colours, tex)]
    out = picture(given[0], tri, *given[1:], **options)
    weights = torch.sin(torch.arange(out.numel(), dtype=out.dtype)).reshape(out.shape)
    return out, *torch.autograd.grad((out * weights).sum(), given)


@pytest.fixture
def threads():
    """Sets the number of threads of PyTorch until the test has ended."""
    before = torch.get_num_threads()
    yield torch.set_num_threads
    torch.set_num_threads(before)


def assert_same_on_each_isa(make):
    """Tensors that are made have the same bits on each instruction set."""
    found = []
    for isa in tl.build_info()["isa_available"]:
        with on(isa):
            found.append([one.detach() for one in make()])
    assert all(torch.equal(a, b) for own in found for a, b in zip(own, found[0], strict=True))


@pytest.mark.parametrize("edges", EDGES)
def test_every_number_of_threads_gives_the_same_bits(threads, edges):
    pos, tri, colours = sphere(2)
    tex, found = torch.rand(1, 16, 16, 3, generator=torch.Generator().manual_seed(1)), []
    for n in (1, 2, 5):
        threads(n)
        found.append(gradients(pos, tri, colours, tex, edges=edges, size=(200, 180)))
    for one in found[1:]:
        assert all(torch.equal(a, b) for a, b in zip(one, found[0], strict=True))


@pytest.mark.parametrize("edges", EDGES)
def test_every_instruction_set_gives_the_same_bits(edges):
    pos, tri, colours = sphere()
    assert_same_on_each_isa(
        lambda: gradients(pos, tri, colours, torch.linspace(0, 1, 768).reshape(1, 16, 16, 3), edges=edges)
    )


def drawn_rast(**options):
    """Vertices that want a gradient, what they draw, and a picture of it."""
    pos, tri, colours = sphere(level=1)
    pos.requires_grad_()
    rast, _ = dr.rasterize(CTX, pos, tri, (12, 14))
    return pos, rast, lambda: dr.interpolate(colours, rast, tri, **options)[0].sum()


@pytest.fixture
def g_rast():
    """The gradient of `rast` of `drawn_rast`."""
    _, rast, picture = drawn_rast()
    (g,) = torch.autograd.grad(picture(), rast)
    assert g.any()
    return g


def test_gradients_of_pos_and_of_rast_come_in_one_call(g_rast):
    pos, rast, picture = drawn_rast()
    of_pos, of_rast = torch.autograd.grad(picture(), [pos, rast])
    assert of_pos.any()
    assert torch.equal(of_rast, g_rast)


def test_hooks_of_rast_are_called_with_its_gradient(g_rast):
    pos, rast, picture = drawn_rast()
    seen = []
    rast.register_hook(seen.append)
    rast.retain_grad()
    picture().backward()
    assert torch.equal(seen[0], g_rast)
    assert torch.equal(rast.grad, g_rast)
    assert pos.grad.any()


@pytest.mark.parametrize("is_early", [True, False])
def test_hooks_that_stop_the_gradient_of_rast_leave_pos_without(is_early):
    pos, rast, picture = drawn_rast()
    if is_early:
        rast.register_hook(torch.zeros_like)
    with torch.autograd.graph.save_on_cpu():
        out = picture()
    if not is_early:
        rast.grad_fn.register_prehook(lambda given: tuple(one if one is None else 0 * one for one in given))
    out.backward()
    assert not pos.grad.any()


def test_rast_keeps_its_gradient_where_tensors_are_saved_elsewhere(g_rast):
    _, rast, picture = drawn_rast()
    rast.retain_grad()
    with torch.autograd.graph.save_on_cpu():
        out = picture()
    out.backward()
    assert torch.equal(rast.grad, g_rast)


def test_rast_that_was_detached_gives_no_gradient():
    _, rast, picture = drawn_rast()
    rast.detach_()
    assert not picture().requires_grad


def test_rast_that_was_changed_before_backward_is_refused():
    _, rast, picture = drawn_rast()
    out = picture()
    with torch.no_grad():
        rast += 0.1
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        out.backward()


def test_rast_is_copied_and_saved_as_any_tensor():
    _, rast, _ = drawn_rast()
    assert not vars(rast)
    file = io.BytesIO()
    torch.save(rast.detach(), file)
    assert file.tell() < rast.nbytes + 4096
    file.seek(0)
    assert torch.equal(torch.load(file), rast)


@ON_EACH_ISA
@pytest.mark.parametrize("rule", EDGES)
@one_by_one("other", [2**31 - 1, -(2**31), 10**9])
def test_what_lies_across_edges_may_change_once_the_outline_is_known(isa, rule, other):
    pos, tri, colours = (one.numpy() for one in sphere(level=2))
    grid, ids = PixelGrid(tri, 1, 40, 50), [tl.rasterize(pos[0], tri, (50, 40)).triangle]
    rast, _ = tensors.points(grid, pos, [(one, 0) for one in ids], is_flipped=True, with_db=False)
    color, _ = tensors.values(grid, colours[None], rast)
    outline = tensors.outline_of(grid, pos, tensors.halves_across(tri))
    changed = replace(outline, across=np.full_like(tri, other))
    with on(isa):
        out = tensors.smooth(grid, as_rule(rule), changed, pos, rast, color)
    assert np.isfinite(out).all()


@ON_EACH_ISA
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("first", [-1, -(2**30), 2**31 - 1])
def test_ranges_that_changed_since_they_were_checked_show_nothing(isa, dtype, first):
    pos, tri, _ = sphere(dtype=dtype)
    ids = torch.zeros(1, 4, 5, dtype=torch.int32)
    with on(isa):
        rast, _ = operators.rasterize(pos[0], tri, torch.tensor([[first, 1]]), ids, (4, 5, False, 1))
    assert not rast.any()


def test_gradients_are_those_of_one_picture_after_the_other():
    pos, tri, colours = sphere(3)
    tex = torch.rand(1, 8, 8, 3, generator=torch.Generator().manual_seed(2))
    _, g_pos, _, _ = gradients(pos, tri, colours, tex)
    out = picture(pos, tri, colours, tex)
    weights = torch.sin(torch.arange(out.numel(), dtype=out.dtype)).reshape(out.shape)
    for k in range(3):
        own = pos[k : k + 1].clone().requires_grad_()
        (g_own,) = torch.autograd.grad((picture(own, tri, colours, tex) * weights[k : k + 1]).sum(), own)
        assert torch.equal(g_own[0], g_pos[k])


@pytest.mark.parametrize("edges", EDGES[:2])
def test_gradients_of_float64_are_differences(edges):
    pos, tri, colours = sphere(1, torch.float64, level=1)
    tex = torch.rand(1, 8, 8, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
    rast, rast_db = dr.rasterize(CTX, pos, tri, (12, 14))
    given = [one.clone().requires_grad_() for one in (colours, tex)]

    def run(colours, tex):
        out, out_da = dr.interpolate(colours, rast, tri, rast_db, [0, 1])
        return dr.antialias(out * dr.texture(tex, out[..., :2], out_da), rast, pos, tri, edges=edges)

    assert torch.autograd.gradcheck(run, given)


def test_compile_takes_the_whole_graph():
    pos, tri, colours = sphere()
    tex = torch.rand(1, 8, 8, 3, generator=torch.Generator().manual_seed(2))
    compiled = torch.compile(picture, fullgraph=True, backend="aot_eager")
    own, same = pos.clone().requires_grad_(), pos.clone().requires_grad_()
    one, other = picture(own, tri, colours, tex), compiled(same, tri, colours, tex)
    assert torch.equal(one, other)
    one.square().sum().backward()
    other.square().sum().backward()
    assert torch.equal(own.grad, same.grad)


def test_vmap_is_one_sample_after_the_other():
    pos, tri, colours = sphere(3)
    found = torch.vmap(lambda p: picture(p[None], tri, colours))(pos)
    assert torch.equal(found, torch.stack([picture(p[None], tri, colours) for p in pos]))


def test_gradients_of_gradients_are_refused():
    pos, tri, colours = sphere(level=1)
    pos.requires_grad_()
    (g,) = torch.autograd.grad(picture(pos, tri, colours).square().sum(), pos, create_graph=True)
    with pytest.raises(NotImplementedError, match="gradients of its gradients are not computed"):
        g.sum().backward()


def test_hessians_of_a_loss_are_refused():
    pos, tri, colours = sphere(level=1)

    def loss(attr):
        return dr.photometric_loss(CTX, pos, tri, attr, torch.zeros(len(pos), 4, 4, attr.shape[-1]))

    with pytest.raises(NotImplementedError, match="gradients of its gradients are not computed"):
        torch.autograd.functional.hessian(loss, colours)


def test_torch_func_and_tangents_are_refused_by_name():
    pos, tri, colours = sphere(level=1)

    def run(pos):
        return dr.render(CTX, pos, tri, colours, (4, 4)).sum()

    with pytest.raises(
        NotImplementedError, match=r"takes torch\.autograd\.grad and backward\(\), no torch\.func\.grad"
    ):
        torch.func.grad(run)(pos)
    with pytest.raises(NotImplementedError, match=r"pos must have no tangent: .* by backward\(\) alone"):
        torch.func.jvp(run, (pos,), (pos,))
    with torch.autograd.forward_ad.dual_level():
        tex = torch.autograd.forward_ad.make_dual(torch.ones(1, 2, 2, 1), torch.ones(1, 2, 2, 1))
        with pytest.raises(NotImplementedError, match="tex must have no tangent"):
            dr.texture(tex, torch.zeros(1, 2, 2, 2))


@pytest.mark.parametrize(("n", "size"), [(0, (3, 4)), (0, (0, 0)), (2, (0, 4)), (2, (3, 0)), (1, (0, 0))])
@pytest.mark.parametrize("has_mesh", [True, False])
def test_no_pictures_and_no_pixels_have_empty_results_and_no_gradients(n, size, has_mesh):
    pos = torch.zeros(n, 3 if has_mesh else 0, 4, requires_grad=True)
    tri = torch.tensor([[0, 1, 2]] if has_mesh else [], dtype=torch.int64).reshape(-1, 3)
    attr = torch.ones(*pos.shape[:2], 2, requires_grad=True)
    tex, cube = (torch.ones(*shape, 4, 4, 2, requires_grad=True) for shape in ((n,), (1, 6)))
    color = torch.zeros(n, *size, 2, requires_grad=True)
    rast, rast_db = dr.rasterize(CTX, pos, tri, size)
    out, out_da = dr.interpolate(attr, rast, tri, rast_db, "all")
    way = torch.zeros(n, *size, 3)
    found = [
        rast, out, dr.DepthPeeler(CTX, pos, tri, size).rasterize_next_layer()[0], dr.texture(tex, out, out_da),
        dr.texture(cube, way, boundary_mode="cube"), dr.render(CTX, pos, tri, attr, size),
        *(dr.antialias(color, rast, pos, tri, edges=rule) for rule in EDGES),
    ]  # fmt: skip
    assert all(one.shape[:3] == (n, *size) for one in found)
    loss = dr.photometric_loss(CTX, pos, tri, attr, color)
    given = [pos, attr, tex, cube]
    assert not any(one.any() for one in torch.autograd.grad(loss + sum(one.sum() for one in found), given))


def test_memory_may_lie_anyhow():
    pos, tri, colours = sphere(2)
    expected = gradients(pos, tri, colours, torch.ones(1, 2, 2, 3))
    strided = torch.stack([pos, pos], -1)[..., 0]
    columns, colours_too = tri.T.contiguous().T, torch.stack([colours, colours], 1)[:, 1]
    found = gradients(strided, columns.long(), colours_too, torch.ones(1, 1, 1, 1).expand(1, 2, 2, 3))
    assert all(torch.equal(a, b) for a, b in zip(expected, found, strict=True))
    rast, _ = dr.rasterize(CTX, pos, tri, (20, 20))
    colours.requires_grad_()
    out, _ = dr.interpolate(colours, rast, tri)
    out.sum().backward()  # whose gradient is one number, expanded
    covered = (rast[..., 3] > 0).sum()
    torch.testing.assert_close(colours.grad.sum(), 3.0 * covered)


def test_half_precision_is_taken_as_float32():
    pos, tri, colours = sphere()
    rast, _ = dr.rasterize(CTX, pos, tri, (20, 20))
    half = colours.half()
    out, _ = dr.interpolate(half, rast, tri)
    assert torch.equal(out, dr.interpolate(half.float(), rast, tri)[0])
    assert dr.antialias(out.bfloat16(), rast, pos, tri).dtype == torch.bfloat16


def test_triangles_behind_the_eye_and_without_area_get_finite_gradients():
    pos = torch.tensor(
        [[[-1.0, -1, 0, 1], [3, -1, 0, -1], [-1, 3, 0, 1], [0, 0, 0, 1], [0.5, 0.5, 0, 1], [1, 1, 0, 1]]]
    )
    tri = torch.tensor([[0, 1, 2], [3, 4, 5]])
    for edges in EDGES:
        _, *found = gradients(pos, tri, torch.eye(6)[:, :3].contiguous(), torch.ones(1, 2, 2, 3), edges=edges)
        assert all(torch.isfinite(one).all() for one in found)
        assert not found[0][0, 3:].any()


def test_vertices_that_are_not_finite_are_refused():
    pos, tri, _ = sphere(level=1)
    pos[0, 3, 1] = torch.nan
    with pytest.raises(ValueError, match="finite"):
        dr.rasterize(CTX, pos, tri, (8, 8))


@pytest.mark.parametrize("dtype", [torch.int32, torch.int64])
def test_checked_triangles_lie_in_memory_that_no_other_thread_can_write(dtype):
    tri = torch.tensor([[0, 1, 2]], dtype=dtype)
    checked = as_checked_triangles(operators.numpy_of(tri), 3)
    tri[:] = 2**30
    assert (checked == [[0, 1, 2]]).all()
    assert not checked.flags.writeable


def test_rast_of_other_programs_may_hold_anything():
    rast = torch.full((1, 2, 2, 4), torch.nan)
    out, _ = dr.interpolate(torch.ones(3, 1), rast, torch.tensor([[0, 1, 2]]))
    assert not out.any()
    rast[..., 3] = torch.inf
    with pytest.raises(IndexError, match="rast must hold ids of the 1 triangles"):
        dr.interpolate(torch.ones(3, 1), rast, torch.tensor([[0, 1, 2]]))
    assert torch.equal(dr.antialias(torch.ones(1, 2, 2, 1), rast, torch.ones(1, 3, 4), torch.tensor([[0, 1, 2]])),
                       torch.ones(1, 2, 2, 1))  # fmt: skip


def test_dir_shows_public_names_alone():
    assert dir(dr) == sorted(dr.__all__)


def loss_in_one(pos, tri, attr, target, edges="area"):
    """The loss of a picture in one call, and its gradients."""
    given = [one.clone().requires_grad_() for one in (pos, attr)]
    loss = dr.photometric_loss(CTX, given[0], tri, given[1], target, edges=edges)
    return loss.detach(), *torch.autograd.grad(5 * loss, given)


def loss_of_render(pos, tri, attr, target, edges="area"):
    """The same of pictures drawn in one call."""
    given = [one.clone().requires_grad_() for one in (pos, attr)]
    loss = (dr.render(CTX, given[0], tri, given[1], target.shape[1:3], edges=edges) - target).square().mean()
    return loss.detach(), *torch.autograd.grad(5 * loss, given)


def loss_of_parts(pos, tri, attr, target, edges="area"):
    """The same of the functions one after the other."""
    given = [one.clone().requires_grad_() for one in (pos, attr)]
    rast, _ = dr.rasterize(CTX, given[0], tri, target.shape[1:3])
    out, _ = dr.interpolate(given[1], rast, tri)
    loss = (dr.antialias(out, rast, given[0], tri, edges=edges) - target).square().mean()
    return loss.detach(), *torch.autograd.grad(5 * loss, given)


@ON_EACH_ISA
def test_render_of_more_edges_than_are_found_at_once_is_their_exact_area(isa):
    lows = 3 * torch.arange(682.0)[:, None] + torch.tensor([1.25, 2.75, 2.75, 1.25])
    rest = torch.tensor([[-5.0, 0, 1], [-5, 0, 1], [5, 0, 1], [5, 0, 1]]).expand(682, 4, 3)
    pos = torch.cat([(lows / 1024 - 1)[..., None], rest], 2).reshape(1, -1, 4)
    tri = (4 * torch.arange(682)[:, None, None] + torch.tensor([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    with on(isa):
        picture = dr.render(CTX, pos, tri, torch.ones(pos.shape[1], 1), (4, 2048))
    assert torch.equal(picture[0, :, :2046, 0], torch.tensor([0, 0.75, 0.75]).repeat(4, 682))


IN_ONE = pytest.mark.parametrize("in_one", [loss_in_one, loss_of_render])


def check_near(found, wanted, share):
    """Each number is within a share of the largest one."""
    for own, other in zip(found, wanted, strict=True):
        assert other.any()
        assert (own - other).abs().max() <= share * other.abs().max()


@IN_ONE
@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize(("dtype", "channels"), [(torch.float32, 3), (torch.float32, 5), (torch.float64, 1)])
@pytest.mark.parametrize("size", [(93, 70), (600, 300)])
def test_drawing_in_one_has_the_gradients_of_its_parts(in_one, edges, dtype, channels, size):
    pos, tri, _ = sphere(2, dtype)
    generator = torch.Generator().manual_seed(3)
    attr = torch.rand(pos.shape[1], channels, generator=generator, dtype=dtype)
    target = torch.rand(2, *size, channels, generator=generator, dtype=dtype)
    found, parts = (way(pos, tri, attr, target, edges) for way in (in_one, loss_of_parts))
    check_near(found, parts, 1e-14 if dtype == torch.float64 else 1e-6)
    wanted = loss_of_parts(*(one if one is tri else one.double() for one in (pos, tri, attr, target)), edges)
    check_near(found, wanted, 1e-6)


@IN_ONE
@pytest.mark.parametrize("edges", EDGES)
def test_drawing_in_one_has_the_same_bits_on_every_instruction_set(in_one, edges):
    pos, tri, _ = sphere(2)
    for channels in (1, 3, 5):
        attr = torch.sin(torch.arange(pos.shape[1] * channels)).reshape(-1, channels)
        target = torch.zeros(2, 93, 70, channels)
        assert_same_on_each_isa(lambda attr=attr, target=target: in_one(pos, tri, attr, target, edges))


@IN_ONE
@pytest.mark.parametrize("size", [(600, 300), (7, 3), (1, 1)])
def test_drawing_in_one_has_the_same_bits_with_any_number_of_threads(in_one, threads, size):
    pos, tri, colours = sphere()
    target, found = torch.zeros(1, *size, 3), []
    for n in (1, 3):
        threads(n)
        found.append(in_one(pos, tri, colours, target))
    assert all(torch.equal(a, b) for a, b in zip(*found, strict=True))


@IN_ONE
@pytest.mark.parametrize("more", [(0, 3), (3, 0)])
def test_drawing_in_one_with_rows_of_no_triangle_leaves_their_gradients_0(in_one, more):
    pos, tri, colours = sphere()
    target = torch.rand(1, 40, 50, 3, generator=torch.Generator().manual_seed(1))
    _, g_pos, g_attr = in_one(pos, tri, colours, target)
    longer = torch.cat([pos, pos[:, : more[0]]], 1), tri, torch.cat([colours, colours[: more[1]]])
    _, more_pos, more_attr = in_one(*longer, target)
    for one, other, n in ((g_pos[0], more_pos[0], more[0]), (g_attr, more_attr, more[1])):
        assert torch.equal(other, torch.cat([one, torch.zeros_like(one[:n])]))


@IN_ONE
@pytest.mark.parametrize("edges", EDGES)
def test_drawing_in_one_of_triangles_behind_the_eye_and_slivers_has_the_gradients_of_its_parts(in_one, edges):
    pos = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, -1], [-1, 3, 0, 1], [0, 0, 0.5, 1], [0.9, 0.001, 0.5, 1]]])
    pos = torch.cat([pos, torch.tensor([[[0.9, 0.0, 0.5, 1], [-0.5, -0.5, 0.5, 40], [30, -0.5, 0.9, 40]]])], 1)
    tri = torch.tensor([[0, 1, 2], [3, 4, 5], [3, 6, 7], [3, 3, 4]])
    attr = torch.sin(torch.arange(24.0)).reshape(8, 3)
    given = pos, tri, attr, torch.zeros(1, 300, 280, 3)
    check_near(in_one(*given, edges), loss_of_parts(*given, edges), 2e-6)


NO_ATTR = "attr must have shape (V, K), with 1 or 1 before, got "
NO_EDGES = "edges must be 'silhouette', 'area' or 'straight-through', got 'none'"


@pytest.mark.parametrize(
    ("verb", "change", "kind", "message"),
    [
        ("loss", {"target": torch.zeros(2, 4, 4, 3)}, ValueError, "target must have shape (1, H, W, 3), got (2, 4, 4"),
        ("loss", {"target": torch.zeros(1, 4, 4, 2)}, ValueError, "target must have shape (1, H, W, 3), got (1, 4, 4"),
        ("loss", {"attr": torch.zeros(3)}, ValueError, NO_ATTR + "(3,)"),
        ("loss", {"pos": torch.zeros(3, 4)}, ValueError, "pos must have shape (B, V, 4), got (3, 4)"),
        ("loss", {"loss": "l1"}, ValueError, "loss must be 'l2', got 'l1': render() gives the pictures for a loss of"),
        ("loss", {"edges": "none"}, ValueError, NO_EDGES),
        ("loss", {"attr": torch.zeros(2, 3)}, IndexError, "[0, 2)"),
        ("render", {"attr": torch.zeros(2, 3, 1)}, ValueError, NO_ATTR + "(2, 3, 1)"),
        ("render", {"resolution": (4,)}, TypeError, "resolution must be two integers, got (4,)"),
        ("render", {"edges": "none"}, ValueError, NO_EDGES),
        ("render", {"attr": torch.zeros(2, 3)}, IndexError, "[0, 2)"),
        ("render", {"topology_hash": torch.zeros(2, 3)}, ValueError, "topology_hash must have shape (1, 3), got"),
    ],
)
def test_wrong_arguments_of_drawing_in_one_raise(verb, change, kind, message):
    pos, tri = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]]]), torch.tensor([[0, 1, 2]])
    more = {"target": torch.zeros(1, 4, 4, 3)} if verb == "loss" else {"resolution": (4, 4)}
    with pytest.raises(kind, match=re.escape(message)):
        (dr.photometric_loss if verb == "loss" else dr.render)(
            CTX, **{"pos": pos, "tri": tri, "attr": torch.ones(3, 3), **more, **change}
        )


def drawn_gradients(pos, tri, attr, **options):
    """A picture drawn in one, and gradients of some number that it gives."""
    given = [one.clone().requires_grad_() for one in (pos, attr)]
    out = dr.render(CTX, given[0], tri, given[1], (93, 70), **options)
    weights = torch.sin(torch.arange(out.numel(), dtype=out.dtype)).reshape(out.shape)
    return out.detach(), *torch.autograd.grad((out * weights).sum(), given)


@pytest.mark.parametrize("edges", EDGES)
def test_render_is_the_picture_of_its_parts(edges):
    pos, tri, colours = sphere(2)
    parts = picture(pos, tri, colours, edges=edges, size=(93, 70))
    assert (dr.render(CTX, pos, tri, colours, (93, 70), edges=edges) - parts).abs().max() < 1e-6


def never(*_):
    """A picture that is drawn though it need not be."""
    raise AssertionError("drawn again")


def test_render_twice_backward_gives_the_same_bits_by_what_was_kept(monkeypatch):
    pos, tri, colours = sphere(2)
    pos.requires_grad_()
    out = dr.render(CTX, pos, tri, colours, (93, 70))
    monkeypatch.setattr(AttributePictures, "picture", never)
    first, second = (torch.autograd.grad(out.sum(), pos, retain_graph=True)[0] for _ in range(2))
    assert torch.equal(first, second)


def test_render_keeps_nothing_where_no_gradient_is_wanted(monkeypatch):
    pos, tri, colours = sphere(2)
    monkeypatch.setattr(AttributePictures, "pack", never)
    with torch.no_grad():
        out = dr.render(CTX, pos.clone().requires_grad_(), tri, colours, (93, 70))
    assert torch.equal(out, dr.render(CTX, pos, tri, colours, (93, 70)))


def test_render_takes_what_was_kept_from_wherever_it_was_saved(monkeypatch):
    pos, tri, colours = sphere(2)
    expected = drawn_gradients(pos, tri, colours)
    pos.requires_grad_(), colours.requires_grad_()
    with torch.autograd.graph.saved_tensors_hooks(torch.clone, torch.clone):
        out = dr.render(CTX, pos, tri, colours, (93, 70))
    monkeypatch.setattr(AttributePictures, "picture", never)
    weights = torch.sin(torch.arange(out.numel(), dtype=out.dtype)).reshape(out.shape)
    found = torch.autograd.grad((out * weights).sum(), [pos, colours])
    assert all(torch.equal(a, b) for a, b in zip(found, expected[1:], strict=True))


@pytest.mark.parametrize("has_wrong_ids", [False, True])
@pytest.mark.parametrize("change", [torch.zeros_like, lambda one: one + 1, lambda one: one ^ 3 << 29])
def test_render_draws_again_where_what_it_kept_was_changed(change, has_wrong_ids):
    pos, tri, colours = sphere(2)

    def pack(tensor):
        is_ids = tensor.dtype == torch.int32 and tensor.ndim == 3
        return change(tensor) if tensor.dtype == torch.int64 or (is_ids and has_wrong_ids) else tensor

    expected = drawn_gradients(pos, tri, colours)
    with torch.autograd.graph.saved_tensors_hooks(pack, lambda tensor: tensor):
        found = drawn_gradients(pos, tri, colours)
    assert has_wrong_ids or all(torch.equal(a, b) for a, b in zip(found, expected, strict=True))


def test_words_of_render_are_read_from_memory_that_no_other_thread_can_write():
    pos, tri, colours = map(operators.numpy_of, sphere())
    pictures = pictures_of(Call((), 1), (1, 70, 93), 0, pos, tri, colours[None], None)
    words = pictures.pack(pictures.picture()[1])
    seen = pictures.unpack(words)
    words[:] = -1
    assert all((one.faces[:, : one.counts[2]] >= 0).all() for one in seen)  # room behind them has any values


@pytest.mark.parametrize("change", [torch.Tensor.half, lambda one: one[:, :2], lambda one: one[:0]])
@pytest.mark.parametrize("draw", [picture, lambda *given: dr.render(CTX, *given, (20, 20))])
def test_tensors_that_hooks_return_in_other_shapes_or_dtypes_are_refused(draw, change):
    pos, tri, colours = sphere()
    with torch.autograd.graph.saved_tensors_hooks(lambda one: change(one) if one.ndim > 2 else one, torch.clone):
        out = draw(pos.requires_grad_(), tri, colours)
    with pytest.raises(RuntimeError, match="must come back from hooks of saved tensors as they were saved"):
        out.sum().backward()


def test_render_of_many_pictures_at_once_mixes_none_of_them():
    pos, tri, colours = sphere(8)
    expected = [drawn_gradients(one[None], tri, colours)[1:] for one in pos]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(3):
            found = list(pool.map(lambda one: drawn_gradients(one[None], tri, colours)[1:], pos))
            assert all(torch.equal(a, b) for one, other in zip(found, expected, strict=True)
                       for a, b in zip(one, other, strict=True))  # fmt: skip


def test_render_refuses_vertices_that_were_changed_before_backward():
    pos, tri, colours = sphere()
    colours.requires_grad_()
    out = dr.render(CTX, pos, tri, colours, (20, 20))
    pos += 0.1
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        out.sum().backward()


def test_render_is_compiled_and_taken_over_batches():
    pos, tri, colours = sphere(2)

    def run(pos):
        return dr.render(CTX, pos, tri, colours, (93, 70)).square().sum()

    found = []
    for step in (run, torch.compile(run, fullgraph=True, backend="aot_eager")):
        own = pos.clone().requires_grad_()
        step(own).backward()
        found.append(own.grad)
    assert torch.equal(*found)
    each = torch.vmap(lambda p: dr.render(CTX, p[None], tri, colours, (93, 70))[0])(pos)
    assert torch.equal(each, dr.render(CTX, pos, tri, colours, (93, 70)))


@pytest.mark.parametrize("n", [0, 1])
def test_render_of_no_triangles_or_no_channels_has_no_gradient(n):
    pos, tri, _ = sphere(level=1)
    out, g_pos, g_attr = drawn_gradients(pos, tri[: 0 if n else None], torch.ones(pos.shape[1], n))
    assert out.shape == (1, 93, 70, n)
    assert not out.any()
    assert not g_pos.any()
    assert not g_attr.any()
