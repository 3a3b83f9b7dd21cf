"""Slices of work: every item once, results in order, whatever the number of threads."""

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingersplit.threads import LARGEST, in_threads


@given(count=st.integers(0, 500), least=st.integers(1, 40), threads=st.integers(1, 3))
def test_every_item_is_worked_on_once_and_results_keep_their_order(count: int, least: int, threads: int) -> None:
    shares: list[float] = []
    results = in_threads(lambda part: list(range(count)[part]), count, least, threads, shares.append)
    assert [item for result in results for item in result] == list(range(count))
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    if threads == 1:
        assert shares[-1] == (1.0 if count else 0.0)
    assert all(least <= len(result) <= LARGEST * least for result in results[:-1])


def test_slices_shrink_so_that_threads_end_together() -> None:
    sizes = in_threads(lambda part: part.stop - part.start, 1_000, 4, 2)
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] == LARGEST * 4
    assert sizes[-2] == 4


def test_two_threads_work_at_the_same_time() -> None:
    meeting = threading.Barrier(2, timeout=10)
    in_threads(lambda _part: meeting.wait(), 2, 1, 2)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_exception_of_a_slice_reaches_the_caller(threads: int) -> None:
    def fail(part: slice) -> None:
        raise ValueError(f"slice at {part.start}")

    with pytest.raises(ValueError, match=r"slice at \d"):
        in_threads(fail, 8, 2, threads)
