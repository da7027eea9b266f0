"""Batches that write files: whole ones only, and those that are there are left out on request."""

import numpy as np
import pytest
from batch_jobs import BOX, EXECUTORS, SIZE, orbit, pictures
from PIL import Image

import topleft as tl
from topleft.errors import ImageError


@pytest.mark.parametrize("executor", EXECUTORS)
def test_batch_writes_files_and_makes_folders(executor, tmp_path):
    listed = [tl.Job(BOX, camera, SIZE, {}, tmp_path / f"a/b/{i}.png") for i, camera in enumerate(orbit(BOX, 4))]
    results = list(tl.render_batch(listed, executor=executor))
    assert [result.picture for result in results] == [None] * 4
    for i, expected in enumerate(pictures(4)):
        assert np.array_equal(np.asarray(Image.open(tmp_path / f"a/b/{i}.png")), expected)
    assert sorted(path.name for path in (tmp_path / "a/b").iterdir()) == ["0.png", "1.png", "2.png", "3.png"]


def test_batch_writes_a_file_for_each_layer(tmp_path):
    job = tl.Job(BOX, None, SIZE, {}, tmp_path / "{layer}.png", ("color", "triangle"))
    assert tl.render_batch([job]).finish().n_made == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["color.png", "triangle.png"]


def test_batch_resume_leaves_out_what_is_there(tmp_path):
    listed = [tl.Job(BOX, None, SIZE, {}, tmp_path / f"{i}-{{layer}}.png", ("color", "triangle")) for i in range(5)]
    tl.render_batch(listed[:3]).finish()
    (tmp_path / "1-triangle.png").unlink()
    (tmp_path / "0-triangle.png").write_text("another")
    for executor in EXECUTORS:
        results = list(tl.render_batch(listed, executor=executor, resume=True, chunk=2))
        assert [result.index for result in results] == [0, 1, 2, 3, 4]
        expected = [False, False, True, False, False] if executor is None else [True] * 5
        assert [result.is_skipped for result in results] == expected
    assert tl.render_batch(listed, resume=True).finish().n_skipped == 5


def test_batch_resume_draws_what_goes_to_no_file():
    (result,) = tl.render_batch([tl.Job(BOX, None, SIZE)], resume=True)
    assert not result.is_skipped


@pytest.mark.parametrize(
    ("destination", "layers", "message"),
    [
        ("a.gif", (), "format '.gif' is none of"),
        ("a.png", ("color", "triangle"), r"2 layers need {layer} in the name, or \.npz, got '.*a.png'"),
        ("a.png", ("colour",), "layers must be some of color, alpha, .* flow, got 'colour'"),
    ],
)
@pytest.mark.parametrize("resume", [False, True])
def test_batch_impossible_destination_is_an_error_of_the_job(tmp_path, destination, layers, message, resume):
    job = tl.Job(BOX, None, SIZE, {}, tmp_path / destination, layers)
    with pytest.raises((ImageError, ValueError), match=message):
        tl.render_batch([job], resume=resume).finish()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("executor", [None, 2])
def test_batch_interrupted_leaves_whole_files_and_goes_on_with_resume(executor, tmp_path):
    def listed(interrupt_at):
        for i, camera in enumerate(orbit(BOX, 30)):
            if i == interrupt_at:
                raise KeyboardInterrupt
            yield tl.Job(BOX, camera, SIZE, {}, tmp_path / f"{i:02}.png")

    with pytest.raises(KeyboardInterrupt):
        tl.render_batch(listed(20), executor=executor).finish()
    left = sorted(path.name for path in tmp_path.iterdir())
    assert 0 < len(left) <= 20
    for name in left:  # whole, and nothing else
        assert np.asarray(Image.open(tmp_path / name)).shape == (30, 40, 4)
    summary = tl.render_batch(listed(None), executor=executor, resume=True).finish()
    assert (summary.n_made, summary.n_skipped) == (30 - len(left), len(left))
    assert len(list(tmp_path.iterdir())) == 30
