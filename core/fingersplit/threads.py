"""Work on many items in threads, for kernels that run without the GIL."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["Progress", "in_threads"]

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, 0..1."""

Result = TypeVar("Result")

LARGEST = 16
"""Times the least size that a slice may have, so that progress is seen."""


def in_threads(
    task: Callable[[slice], Result],
    count: int,
    least: int,
    threads: int,
    done: Callable[[float], None] = lambda _share: None,
) -> list[Result]:
    """Run ``task`` on consecutive slices of ``count`` items: large ones first, small ones so that all end together.

    Args:
        task: Called with a slice; with several threads, in any order. How items are sliced depends on ``threads``.
        count: Number of items.
        least: Items in the smallest slices.
        threads: How many slices are worked on at a time, one of them always in the caller's own thread.
        done: Called with the share of slices that are done, 0..1, in the caller's thread.

    Returns:
        What ``task`` returned, in the order of the slices.
    """
    parts = list(_slices(count, least, threads))
    waiting, ended = iter(range(len(parts))), dict[int, Result]()

    def work(report: Callable[[], None]) -> None:
        for number in waiting:
            ended[number] = task(parts[number])
            report()

    done(0.0)
    with ThreadPoolExecutor(threads) as pool:
        others = [pool.submit(work, lambda: None) for _ in range(threads - 1)]
        work(lambda: done(len(ended) / len(parts)))
        for other in others:
            other.result()
    return [ended[number] for number in range(len(parts))]


def _slices(count: int, least: int, threads: int) -> Iterator[slice]:
    first = 0
    while first < count:
        size = min(max((count - first) // (2 * threads), least), LARGEST * least)
        yield slice(first, min(first + size, count))
        first += size
