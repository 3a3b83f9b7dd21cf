"""Work on many items in threads, for kernels that run without the GIL."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

__all__ = ["Progress", "in_threads"]

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, 0..1."""


def in_threads(
    task: Callable[[slice], None], count: int, size: int, threads: int, done: Callable[[float], None]
) -> None:
    """Run ``task`` on consecutive slices of ``count`` items, ``size`` in each.

    Args:
        task: Called with a slice; with several threads, in any order.
        count: Number of items.
        size: Items in a slice.
        threads: How many slices are worked on at a time; one works in the caller's own thread.
        done: Called with the share that is done, 0..1, in the caller's thread.
    """
    parts = [slice(first, min(first + size, count)) for first in range(0, count, size)]
    done(0.0)
    if threads == 1:
        for part in parts:
            task(part)
            done(part.stop / count)
        return
    with ThreadPoolExecutor(threads) as pool:
        for part, _ in zip(parts, pool.map(task, parts), strict=True):
            done(part.stop / count)
