"""Long work: progress on the terminal, and Ctrl-C that acts at once even inside compiled code."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Result = TypeVar("Result")

_LARGE = 1_000_000  # points from which on the need for memory is worth a line
_BASE, _PER_POINT = 300e6, 2500.0  # bytes; measured at 50,000 to 500,000 points of closed surfaces


class Progress:
    """A line on stderr with the stage, how far the whole is and the time left; silent unless stderr is a terminal.

    Parameters
    ----------
    quiet : bool
    """

    def __init__(self, quiet: bool) -> None:
        self._shown = not quiet and sys.stderr.isatty()
        self._bar: Any = None

    def __call__(self, stage: str, fraction: float) -> None:
        """Say which stage begins, and how much of the whole is done, 0 to 1."""
        if not self._shown:
            return
        if self._bar is None:
            from tqdm import tqdm

            pattern = "{desc:<14} {percentage:3.0f} % |{bar}| {elapsed}, {remaining} left"
            self._bar = tqdm(total=1.0, bar_format=pattern, leave=False, file=sys.stderr, dynamic_ncols=True)
        self._bar.set_description_str(stage, refresh=False)
        self._bar.update(min(1.0, max(0.0, fraction)) - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        """Take the line away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def interruptible(work: Callable[[], Result]) -> Result:
    """Run `work` in a thread of its own and give its result or raise its error.

    Compiled code does not look for signals, but it runs without the interpreter lock: the main thread stays free to be
    interrupted. The thread is a daemon named ``recon-work``; whoever handles the interruption must not wait for it.
    """
    results: list[Result] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:  # handed to the main thread, nothing is swallowed
            errors.append(error)

    thread = threading.Thread(target=run, name="recon-work", daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)
    if errors:
        raise errors[0]
    return results[0]


def memory_needed(points: int) -> str | None:
    """Say about how much memory a reconstruction takes and how much there is; None for clouds that are not large."""
    need = _BASE + _PER_POINT * points
    free = _memory_available()
    if points < _LARGE and (free is None or need < free):
        return None
    text = f"{points:,} points take about {need / 1e9:.1f} GB of memory"
    if free is None:
        return text
    return f"{text}, {free / 1e9:.1f} GB are free" + ("; this may fail" if need > free else "")


def _memory_available() -> float | None:
    """Bytes that can be had without swapping, where the system tells."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            entries = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(entries["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
