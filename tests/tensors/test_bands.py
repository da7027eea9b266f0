"""Bands of pictures: what their threads add up, and the memory that they work on."""

import threading

import numpy as np
import pytest

from topleft._core.base import memory
from topleft._core.gradients.bands import BAND_PX, MAX_SPARE_BYTES, Bands, Room, Sums


class Added:
    """Stands for the sums of a band: writes down that they were added."""

    def __init__(self, order):
        self.order, self.number = order, None

    def add_to(self, outs):
        self.order.append(self.number)


def add_up(monkeypatch, threads, work):
    """Work on four bands; returns the order in which they were added, what `work` returned, and the number of rooms."""
    order, made = [], []

    def make(_):
        made.append([Added(order)])
        return made[-1]

    def work_on(band, sums):
        sums[0].number = band.number
        return work(band.number)

    monkeypatch.setattr(Room, "make", make)
    monkeypatch.setattr(Room, "put_back", lambda *_: None)
    found = Bands(1, 4, 2 * BAND_PX, threads).add_up(Room(2 * BAND_PX, ()), work_on, [()])
    return order, found, len(made)


@pytest.mark.parametrize(
    ("width", "rows"), [(64, 1024), (256, 256), (512, 128), (600, 128), (1920, 68), (65536, 2), (65537, 1), (131072, 1)]
)
def test_bands_of_wide_pictures_have_twice_as_many_pixels_within_128_rows(width, rows):
    assert Bands(1, 5000, width).all[0].end == rows


def test_add_up_by_one_thread_uses_one_room(monkeypatch):
    assert add_up(monkeypatch, 1, lambda i: 10 * i) == ([0, 1, 2, 3], [0, 10, 20, 30], 1)


@pytest.mark.parametrize("last", [1, 2])
def test_add_up_with_a_slow_band_adds_those_after_it_later(monkeypatch, last):
    is_done = threading.Event()

    def work(i):
        if i == last:
            is_done.set()
        if i == 0:
            assert is_done.wait(10)
        return 10 * i

    order, found, n_rooms = add_up(monkeypatch, 2, work)
    assert order == [0, 1, 2, 3]
    assert found == [0, 10, 20, 30]
    assert last < n_rooms <= 4


def test_add_up_with_an_error_keeps_no_memory():
    memory.SPARE.release()
    room = Room(8, (Sums(3, 4, 1),))

    def work(band, sums):
        raise ValueError("of a band")

    with pytest.raises(ValueError, match="of a band"):
        Bands(1, 2, 4, 1).add_up(room, work, [()])
    assert memory.SPARE.take(room) is None


def test_room_put_back_is_made_again_for_equal_needs_alone():
    memory.SPARE.release()
    room, other = (Room(8, (Sums(3, 4, 1),), (((n, 2), np.float32),)) for n in (5, 6))
    made = room.make()
    room.put_back(made)
    assert other.make()[1].shape == (6, 2)
    assert room.make() is made
    assert room.make() is not made


def test_room_beyond_what_is_kept_is_made_anew():
    room = Room(1, (), (((MAX_SPARE_BYTES + 1,), np.uint8),))
    made = room.make()
    room.put_back(made)
    assert room.make() is not made


def test_spare_memory_keeps_the_last_few():
    spare = memory.SpareMemory(2)
    for i in range(3):
        spare.put(i, str(i))
    assert [spare.take(i) for i in (0, 2, 1, 1)] == [None, "2", "1", None]
