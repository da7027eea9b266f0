"""The words of `topleft.typing` are those that the code takes, and every public option that takes a word has them."""

import inspect
import re
import typing
from typing import get_args

import numpy as np
import pytest

import topleft as tl
import topleft.typing as words
from topleft._apps.tiles import geotiff, zarr_files
from topleft._core.base import options
from topleft._core.raster.view import ViewOptions
from topleft._meshes.plan.plan import OUTPUTS
from topleft._meshes.windows.drawing import KINDS
from topleft.methods import ALIASES, CLASSICS, METHODS

#: What the code takes; the others are read by the code itself, see `test_words_of_the_rest_are_taken_and_no_others`.
TAKEN = {
    "MethodOption": [*METHODS, *ALIASES, *CLASSICS],
    "OutputOption": OUTPUTS,
    "RasterKindOption": KINDS,
    "SamplesOption": [one for one in options.Sampling if one == "center" or one.n_samples > 1],
    "SamplingOption": options.Sampling,
    "TiffCompressionOption": geotiff.COMPRESSIONS,
    "WindingOption": sorted({"either"} | {one.claims.winding for one in CLASSICS.values()}),
    "ZarrCompressionOption": zarr_files.COMPRESSIONS,
}  # fmt: skip

CUBE = tl.Mesh(*tl.scenes.shape("cube"))
SQUARE = tl.Mesh(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]], colors=np.ones((3, 3), np.uint8), uv=[[0, 0], [1, 0], [1, 1]]
)
FLAT = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]], [[0, 1, 2]]

#: Options whose check reads the type: a call of each.
READ = {
    "AlphaModeOption": lambda word: tl.Material(alpha_mode=word),
    "AlphaOption": lambda word: tl.fill(*FLAT, [9], 4, alpha=word),
    "BlendOption": lambda word: tl.fill(*FLAT, [[9, 9]], 4, blend=word),
    "ClipDepthOption": lambda word: tl.coverage(*FLAT, 4, clip_depth=word),
    "CullOption": lambda word: tl.coverage(*FLAT, 4, cull=word),
    "DepthTestOption": lambda word: tl.rasterize(*FLAT, 4, depth_test=word),
    "EncodingOption": lambda word: tl.Texture([[0]], encoding=word),
    "FilterOption": lambda word: tl.Texture([[0]], filter=word),
    "LayerOption": lambda word: tl.render_layers(SQUARE, size=4, layers=word, camera_to=tl.Camera.framing(SQUARE)),
    "LightKindOption": lambda word: tl.Light((0, 0, 1), word, direction=(0, 0, -1) if word == "spot" else None),
    "OnErrorOption": lambda word: tl.render_batch([], on_error=word),
    "OrderOption": lambda word: tl.render_batch([], order=word),
    "PerOption": lambda word: tl.fill(*FLAT, [9] * (3 if word == "vertex" else 1), 4, per=word),
    "PointShapeOption": lambda word: tl.points([[1, 1]], 4, shape=word),
    "PointUnitOption": lambda word: tl.Points([[0, 0, 0]], unit=word),
    "ResolveOption": lambda word: tl.fill(*FLAT, [9], 4, sampling="msaa2", resolve=word),
    "RuleOption": lambda word: tl.polygons([[[0, 0], [2, 0], [0, 2]]], 4, rule=word),
    "ShadingOption": lambda word: tl.render(CUBE, size=4, shading=word, matcap=tl.Texture([[0]])),
    "SpaceOption": lambda word: tl.Light((0, 0, 1), space=word),
    "WrapOption": lambda word: tl.Texture([[0]], wrap=word),
    "EdgesOption": lambda word: tl.rasterize(*FLAT, (4, 4)).antialias(np.ones((4, 4)), edges=word),
    "BakeOption": lambda word: tl.bake(SQUARE, word, 2, source=SQUARE),
    "BakeRuleOption": lambda word: tl.bake(SQUARE, "position", 2, rule=word),
    "FitOption": lambda word: tl.Camera.framing(CUBE, fit=word),
    "SurfaceOption": lambda word: tl.height_map(([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]]), 1.0, surface=word),
    "TakenOption": lambda word: tl.bake(
        SQUARE, [np.zeros((2, 2, 3), np.uint8)], 2, cameras=[tl.Camera.look_at((0, 0, 5))], blend=word
    ),
    "UpOption": lambda word: tl.Camera.framing(CUBE, up=word),
    "VoxelRuleOption": lambda word: tl.voxelize(CUBE, 2, rule=word),
    "YOption": lambda word: tl.Grid((2, 2), (0, 1, 0, 1), y=word),
}


@pytest.mark.parametrize("name", TAKEN)
def test_words_are_those_that_the_code_takes(name):
    taken = [str(one) for one in TAKEN[name]]
    assert sorted(get_args(getattr(words, name))) == sorted(taken)


@pytest.mark.parametrize("name", READ)
def test_words_of_the_rest_are_taken_and_no_others(name):
    for word in get_args(getattr(words, name)):
        READ[name](word)
    with pytest.raises(ValueError, match="must be"):
        READ[name]("wrong")


def test_words_of_topleft_torch_are_taken_and_no_others():
    torch = pytest.importorskip("torch")
    dr = pytest.importorskip("topleft.torch")
    uv, level = torch.zeros(1, 1, 1, 2), torch.zeros(1, 1, 1)
    for filter_mode in get_args(words.FilterModeOption):
        dr.texture(torch.zeros(1, 2, 2, 1), uv, mip_level_bias=level, filter_mode=filter_mode)
    for boundary in get_args(words.BoundaryOption):
        cube = boundary == "cube"
        shape = (1, 6, 2, 2, 1) if cube else (1, 2, 2, 1)
        points = torch.ones(1, 1, 1, 3) if cube else uv
        dr.texture(torch.zeros(shape), points, boundary_mode=boundary, filter_mode="linear")
    pos, ones = torch.tensor([[[-1.0, -1, 0, 1], [3, -1, 0, 1], [-1, 3, 0, 1]]]), torch.ones(1, 3, 1)
    given = dr.RasterizeContext(), pos, torch.tensor([[0, 1, 2]]), ones, torch.ones(1, 2, 2, 1)
    for loss in get_args(words.LossOption):
        assert dr.photometric_loss(*given, loss=loss).item() == 0
    with pytest.raises(ValueError, match="must be"):
        dr.photometric_loss(*given, loss="wrong")
    for wrong in ({"filter_mode": "wrong"}, {"boundary_mode": "wrong"}):
        with pytest.raises(ValueError, match="must be"):
            dr.texture(torch.zeros(1, 2, 2, 1), uv, **wrong)


def test_every_type_is_tested():
    assert set(words.__all__) == {*TAKEN, *READ, "BoundaryOption", "FilterModeOption", "LossOption"}


def public_callables():
    """Public functions, constructors and methods, by name."""
    for name in tl.__all__:
        value = getattr(tl, name)
        if inspect.isclass(value):
            if value.__init__ is not object.__init__ and not issubclass(value, BaseException | Warning):
                yield name, value
            for method, member in inspect.getmembers(
                value, lambda one: inspect.isfunction(one) or inspect.ismethod(one)
            ):
                if not method.startswith("_"):
                    yield f"{name}.{method}", member
        elif callable(value):
            yield name, value


#: Options that take other strings: colours, files, names of instances, and layers and outputs, also by a list of str.
FREE = {"color", "background", "edge_color", "path", "name", "names", "layers", "outputs", "destination"}


def test_every_public_option_that_takes_a_word_lists_its_words():
    plain = []
    for name, function in public_callables():
        init = function.__init__ if inspect.isclass(function) else function
        for option, parameter in inspect.signature(init).parameters.items():
            if (
                isinstance(parameter.default, str)
                and option not in FREE
                and re.search(r"\bstr\b", str(parameter.annotation))
            ):
                plain.append(f"{name}({option})")
    values = {"Light", "Material", "Texture", "Environment", "Points", "Grid"}  # kept as words, see their __init__
    assert [one for one in plain if one.partition("(")[0] not in values] == []


def test_options_of_views_list_their_words():
    assert [name for name, kind in typing.get_type_hints(ViewOptions).items() if kind is str] == []


@pytest.mark.parametrize(
    ("option", "guess", "right"),
    [
        ("LayerOption", "normal", "world_normal or camera_normal"),
        ("LayerOption", "position", "world_position"),
        ("SamplingOption", "all_touched", "outer"),
        ("FilterOption", "linear", "bilinear or trilinear"),
        ("CullOption", "backface", "back"),
        ("ShadingOption", "phong", "smooth"),
    ],
)
def test_first_guess_is_answered_with_the_right_word(option, guess, right):
    assert options.meant(guess, get_args(getattr(words, option))) == f": {right}?"


def test_first_guesses_lead_to_words_of_options_or_to_size():
    known = {word for name in words.__all__ for word in get_args(getattr(words, name))} | {"size"}
    assert {word for guesses in options.FIRST_GUESSES.values() for word in guesses} <= known
