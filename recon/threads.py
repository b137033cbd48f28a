"""Row ranges worked on at the same time; kernels hold no interpreter lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from .contracts import as_whole

T = TypeVar("T")
SMALL = 4096  # rows of little work that are not worth a thread
_MOST = 1024  # threads; more are not started, whatever is asked for


def workers(threads: int | None) -> int:
    """Number of threads: one for each processor that the process may use, where none is asked for."""
    if threads is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(as_whole(threads, "threads", 1), _MOST)


def over_ranges(work: Callable[[int, int], T], n: int, threads: int | None, worth: int = SMALL) -> list[T]:
    """Call work(start, stop) on as many equal ranges of n rows as there are threads; results in order of the ranges.

    `worth`: rows that are worth a thread.
    """
    parts = min(workers(threads), 8, n // worth + 1)
    bounds = [n * i // parts for i in range(parts + 1)]
    if parts == 1:
        return [work(0, n)]
    with ThreadPoolExecutor(parts) as pool:
        return list(pool.map(work, bounds[:-1], bounds[1:]))


def together(threads: int | None, *works: Callable[[], Any]) -> list[Any]:
    """Call several functions at the same time, if there is more than one thread; results in their order."""
    if workers(threads) == 1:
        return [work() for work in works]
    with ThreadPoolExecutor(len(works)) as pool:
        return [running.result() for running in [pool.submit(work) for work in works]]
