"""Long work: progress on the terminal, and the memory that it needs."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Mapping
from typing import Any

from .front import complain

_LARGE = 1_000_000  # points from which on the need for memory is worth a line
# Bytes, and bytes a point: lines through the greatest size of the process, measured at 100,000 and at 1,000,000 points on a torus of
# density ratio 10 (pages: 700,000), which were 0.38 and 1.82 GB, 0.53 and 3.77 GB, 0.74 and 4.85 GB.
_NEED = {"mesh": (220e6, 1600.0), "family": (170e6, 3600.0), "page": (60e6, 6850.0)}
# Of the time that `recon.reconstruct` takes, by stage; between those measured at 60,000 and at 1,000,000 points.
SHARES = {"samples": 0.2, "weights": 0.02, "triangulation": 0.08, "surface": 0.4, "clean": 0.22, "report": 0.08}


class Progress:
    """A line on stderr with the stage, how far the whole is and the time left; silent unless stderr is a terminal.

    What is left is told from the time that the stages before have taken, by the shares that stages usually have. A
    context: the line is gone at the end of it.

    Parameters
    ----------
    quiet : bool
    shares : mapping of str to float, optional
        Of the whole time, by stage, in their order; of other stages the fraction that they begin at is what is known.
    """

    def __init__(self, quiet: bool, shares: Mapping[str, float] = SHARES) -> None:
        self._shares = dict(shares)
        self._shown = not quiet and sys.stderr.isatty()
        self._bar: Any = None
        self._begin = self._entered = time.monotonic()
        self._before, self._share = 0.0, 0.0
        self._lock = threading.Lock()
        self._over = threading.Event()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __call__(self, stage: str, fraction: float) -> None:
        """Say which stage begins, and how much of the whole is done, 0 to 1."""
        if not self._shown:
            return
        if self._bar is None:
            from tqdm import tqdm

            pattern = "{desc:<14} {percentage:3.0f} % |{bar}| {elapsed}{postfix}"
            self._bar = tqdm(
                total=1.0, desc=stage, bar_format=pattern, leave=False, file=sys.stderr, dynamic_ncols=True
            )
            threading.Thread(target=self._keep_ticking, daemon=True).start()
        stages = list(self._shares)
        with self._lock:
            known = stage in stages
            self._before = sum(self._shares[name] for name in stages[: stages.index(stage)]) if known else fraction
            self._share = self._shares.get(stage, 0.0)
            self._entered = time.monotonic()
            self._bar.set_description_str(stage, refresh=False)
        self.tick()

    def tick(self) -> None:
        """Bring the line up to date."""
        with self._lock:
            if self._bar is not None:
                self._draw()

    def close(self) -> None:
        """Take the line away."""
        self._over.set()
        with self._lock:
            if self._bar is not None:
                self._bar.close()
                self._bar = None

    def _keep_ticking(self) -> None:
        while not self._over.wait(0.2):
            self.tick()

    def _draw(self) -> None:
        inside = time.monotonic() - self._entered
        done, left = self._before, ""
        if self._before > 0.0:
            whole = (self._entered - self._begin) / self._before
            expected = self._share * whole
            done += self._share * (1.0 - math.exp(-inside / expected)) if expected > 0.0 else 0.0
            left = f"about {_clock(whole * (1.0 - done))} left"
        self._bar.n = min(1.0, max(0.0, done))
        self._bar.set_postfix_str(left, refresh=False)
        self._bar.refresh()


def mesh_and(stage: str, share: float) -> dict[str, float]:
    """Give the shares of a work that makes a mesh first, by one stage more with its own."""
    return {**{name: (1.0 - share) * part for name, part in SHARES.items()}, stage: share}


def note_memory(source: str, points: int, quiet: bool, work: str = "mesh") -> None:
    """Say about how much memory the work takes and how much there is; nothing for clouds that are not large.

    The work is a mesh, the whole family of shapes, or a page with all of it.
    """
    note = memory_needed(points, work)
    if note and not quiet:
        complain(f"{source}: {note}")


def memory_needed(points: int, work: str) -> str | None:
    """Give the words of `note_memory`."""
    base, per_point = _NEED[work]
    need = base + per_point * points
    free = _memory_available()
    if points < _LARGE and (free is None or need < free):
        return None
    text = f"{points:,} points take about {need / 1e9:.1f} GB of memory"
    if free is None:
        return text
    return f"{text}, {free / 1e9:.1f} GB are free" + ("; this may fail" if need > free else "")


def _clock(seconds: float) -> str:
    """Give a duration as 0:07, 2:10 or 1:00:00."""
    whole = round(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def _memory_available() -> float | None:
    """Bytes that can be had without swapping, where the system tells."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            entries = dict(line.split(":", 1) for line in file)
        return 1024.0 * int(entries["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
