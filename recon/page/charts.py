"""Histograms as SVG, in the colours of the page around them."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

_WIDTH, _HEIGHT, _BINS = 560, 170, 48
_LEFT, _BOTTOM, _TOP = 8, 34, 16


def histogram(values: NDArray[np.float64], label: str, marks: dict[str, float]) -> str:
    """Draw how values are spread, from 0 (or the least, if negative) to past the 99.5th percentile.

    Parameters
    ----------
    values : (n,) ndarray of float64
        Finite.
    label : str
        What they are, with the unit.
    marks : dict of str to float
        Vertical lines, by name.

    Returns
    -------
    str
        An ``svg`` element.
    """
    low = min(0.0, float(values.min()))
    high = max(float(np.percentile(values, 99.5)), *marks.values(), low)
    if not low < high:
        return f"<p>{escape(label)}: all {low:.4g}</p>"
    # In shares of the range: their own edges may be too close together for floating point.
    shares = (np.minimum(values, high) - low) / (high - low)
    counts = np.bincount(np.minimum((_BINS * shares).astype(np.int64), _BINS - 1), minlength=_BINS)
    inner, floor = _WIDTH - 2 * _LEFT, _HEIGHT - _BOTTOM
    step, tall = inner / _BINS, (floor - _TOP) / counts.max()
    bars = "".join(
        f'<rect x="{_LEFT + k * step:.1f}" y="{floor - tall * count:.1f}" width="{step - 1:.1f}" height="{tall * count:.1f}">'
        f"<title>{low + k * (high - low) / _BINS:.3g} to {low + (k + 1) * (high - low) / _BINS:.3g}: "
        f"{count / len(values):.2%}</title></rect>"
        for k, count in enumerate(counts.tolist())
        if count
    )
    lines = []
    for row, (name, value) in enumerate(sorted(marks.items(), key=lambda item: item[1])):
        x = _LEFT + inner * (value - low) / (high - low)
        side, anchor = (4, "start") if x < 0.7 * _WIDTH else (-4, "end")
        lines.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="4" y2="{floor}"/>'
            f'<text x="{x + side:.1f}" y="{14 + 13 * row}" text-anchor="{anchor}">{escape(name)} {value:.3g}</text>'
        )
    ticks = "".join(
        f'<text x="{_LEFT + inner * share:.1f}" y="{floor + 14}" text-anchor="{anchor}">{low + share * (high - low):.3g}</text>'
        for share, anchor in ((0, "start"), (0.5, "middle"), (1, "end"))
    )
    beyond = int((values > high).sum())
    more = f"; {beyond:,} of {len(values):,} beyond stand in the last bar" if beyond else ""
    return (
        f'<svg class="histogram" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{escape(label)}">'
        f'<g class="bars">{bars}</g><line class="floor" x1="{_LEFT}" x2="{_WIDTH - _LEFT}" y1="{floor}" y2="{floor}"/>'
        f'<g class="lines">{"".join(lines)}</g>{ticks}'
        f'<text x="{_WIDTH / 2}" y="{_HEIGHT - 5}" text-anchor="middle">{escape(label + more)}</text></svg>'
    )
