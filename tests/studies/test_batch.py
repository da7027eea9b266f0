"""The benchmark of many pictures: it runs, and all draw the same thing. Nothing is timed."""

import json

import pytest
from benchmarks.harness.records import forget
from benchmarks.small import batch


@pytest.fixture(scope="module")
def record():
    return batch.run(batch.BatchOptions((), n_triangles=500, n_views=3, frame_px=48, repeats=2), forget)


def test_batch_record_is_json_and_says_where_it_was_made(record):
    assert json.loads(json.dumps(record)) == record
    assert {"date", "machine", "commit", "versions", "isa", "runs", "skipped"} <= set(record)


def test_batch_runs_each_task_with_each_number_of_threads(record):
    found = [(run["task"], run["threads"]) for run in record["runs"]]
    assert found == [("views", 1), ("views", 2), ("views-png", 1), ("views-png", 2)]
    assert all(len(run["turns_s"]) == 2 for run in record["runs"])
    assert all(0 < run["views_per_s"] <= run["best_views_per_s"] for run in record["runs"])


def test_batch_pictures_are_the_same(record):
    assert [run["different_px"] for run in record["runs"]] == [0] * 4


def test_batch_table_has_a_row_for_each_number_of_threads(record):
    rows = [line for line in batch.lines(record) if line.startswith("| topleft")]
    assert [row.split("|")[3].strip() for row in rows] in (["1", "2"], ["2", "1"])
    speeds = [run["views_per_s"] for run in record["runs"]]
    assert all(any(f" {speed:.0f} " in row for row in rows) for speed in speeds)


def test_batch_peer_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr(batch, "why_not", lambda peer, task, threads: f"{peer.DISTRIBUTION} is not installed")
    skipped = []
    assert list(batch._contestants(batch.BatchOptions(peers=("deodr",), threads=(1,)), skipped)) == []
    assert {"name": "deodr views", "reason": "deodr is not installed"} in skipped
