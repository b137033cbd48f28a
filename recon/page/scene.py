"""What the view draws: points, a mesh and colours, in coordinates that a graphics card can hold."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..contracts import InvalidInput
from ..mesh import Mesh

_SAMPLE = 5000  # points whose neighbours tell how large to draw a point
_TAIL = 1.0  # per cent of the values at either end that a colour scale does not spread over


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Points and, maybe, a mesh on them.

    Attributes
    ----------
    points : (n, 3) ndarray of float64 [L]
    extra : (e, 3) ndarray of float64 [L]
        Vertices of the mesh that are no points.
    source : (e,) ndarray of int64
        The point that each of these came from, -1 for none.
    faces : (f, 3) ndarray of int32 or None
        Rows of points and extra, one after the other.
    """

    points: NDArray[np.float64]
    extra: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    source: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    faces: NDArray[np.int32] | None = None

    @classmethod
    def of(cls, points: NDArray[np.float64], mesh: Mesh | None) -> Scene:
        """Lay a mesh over points (n, d <= 3); its vertices that are points, bit for bit, are not doubled."""
        located = np.zeros((len(points), 3))
        located[:, : points.shape[1]] = points
        if mesh is None:
            return cls(located)
        rows = mesh.vertex_source
        known = (rows >= 0) & (rows < len(points))
        known[known] = (located[rows[known]] == mesh.vertices[known]).all(axis=1)
        place = np.where(known, rows, len(points) + np.cumsum(~known) - 1)
        source = np.where(rows < len(points), rows, -1)[~known]
        return cls(located, mesh.vertices[~known], source, place[mesh.faces].astype(np.int32))

    @property
    def places(self) -> NDArray[np.float64]:
        """All positions (n + e, 3) [L]."""
        return np.concatenate([self.points, self.extra])

    def on_all(self, values: NDArray) -> NDArray:
        """Carry values (n, ...) of the points over to all places; NaN, or 0 for integers, where there is no point."""
        missing = np.nan if values.dtype.kind == "f" else 0
        carried = values[self.source] if len(values) else values
        carried[self.source < 0] = missing
        return np.concatenate([values, carried])

    def parts(self, colours: Sequence[Colour]) -> tuple[dict[str, Any], dict[str, NDArray]]:
        """Give what the scripts want to know, and the arrays they draw.

        Positions are taken around the middle, in units of a power of two near their extent.
        """
        places, exponent = self.places, self._exponent()
        middle = places.min(axis=0) / 2 + places.max(axis=0) / 2
        arrays: dict[str, NDArray] = {"positions": np.ldexp(places - middle, -exponent).astype(np.float32)}
        if self.faces is not None:
            arrays["faces"] = self.faces
        arrays |= {f"colour {colour.name}": colour.array() for colour in colours}
        size = " × ".join(f"{side:.4g}" for side in np.ptp(self.points, axis=0).tolist())
        facts = {
            "points": len(self.points),
            "facts": f"{len(self.points):,} point{'s' * (len(self.points) != 1)}, {size}",
            "spacing": math.ldexp(self._spacing(), -exponent),
            "colours": [colour.facts() for colour in colours],
        }
        return facts, arrays

    def _exponent(self) -> int:
        extent = float(np.ptp(self.places, axis=0).max())
        return math.frexp(extent)[1] if extent > 0 else 0

    def _spacing(self) -> float:
        """Half the median distance to the next point, within what can be seen."""
        extent = float(np.ptp(self.places, axis=0).max()) or 1.0
        distinct = np.unique(self.points, axis=0)
        if len(distinct) < 2:
            return 0.05 * extent
        some = distinct[:: max(1, len(distinct) // _SAMPLE)]
        near = float(np.median(cKDTree(distinct).query(some, 2)[0][:, 1]))
        return min(max(0.35 * near, 0.0015 * extent), 0.03 * extent)


@dataclass(frozen=True, slots=True, eq=False)
class Colour:
    """One thing to colour by.

    Attributes
    ----------
    name : str
        "weight", "error", "own" or "doubtful": what the keys call it.
    label, unit, meaning : str
        For people.
    values : (n + e,) ndarray of float64, or (n + e, 3) ndarray of uint8
        One row a place of the scene; NaN for grey.
    """

    name: str
    label: str
    unit: str
    meaning: str
    values: NDArray

    def facts(self) -> dict[str, Any]:
        """Describe the scale: from the least to the greatest, but for the outermost values; both ways from 0 if signed."""
        known = {"array": f"colour {self.name}", "label": self.label, "unit": self.unit, "meaning": self.meaning}
        if self.values.ndim == 2:
            return {**known, "rgb": True}
        values = self.values[np.isfinite(self.values)]
        signed = self.name == "error" and bool((values < 0).any())
        if signed:
            high = float(np.percentile(np.abs(values), 100 - _TAIL)) or float(np.abs(values).max())
            return {**known, "diverging": True, "low": -high, "high": high}
        low, high = (float(v) for v in np.percentile(values, (_TAIL, 100 - _TAIL))) if len(values) else (0.0, 0.0)
        if self.name == "error":
            low = 0.0
        if low == high and len(values):
            low, high = (0.0 if self.name == "error" else float(values.min())), float(values.max())
        return {**known, "low": low, "high": high}

    def array(self) -> NDArray:
        """Give the values as the page takes them: places 0 .. 254 on the scale, 255 for grey; or red, green and blue."""
        if self.values.ndim == 2:
            return self.values
        facts = self.facts()
        low, high = facts["low"], facts["high"]
        known = np.isfinite(self.values)
        place = (np.where(known, self.values, low) - low) / ((high - low) or 1.0)
        return np.where(known, np.round(254 * np.clip(place, 0, 1)), 255).astype(np.uint8)


def own_colours(attributes: Mapping[str, NDArray], scene: Scene) -> list[Colour]:
    """Give the colours that the cloud carries, if any, in 8 bits."""
    if "colors" not in attributes:
        return []
    colors = np.asarray(attributes["colors"])
    if colors.ndim != 2 or colors.shape[1] < 3 or colors.dtype.kind not in "fiu":
        return []  # something else goes by this name
    if len(colors) != len(scene.points):
        raise InvalidInput(f"attribute 'colors': expected {len(scene.points)} rows, got shape {colors.shape}")
    rgb = colors[:, :3]
    if rgb.dtype.kind == "f":
        eight = np.round(255 * np.clip(rgb, 0, 1))
    else:
        eight = rgb >> (8 * (rgb.dtype.itemsize - 1)) if rgb.dtype.itemsize > 1 and rgb.max(initial=0) > 255 else rgb
    return [Colour("own", "own colours", "", "the colours in the file", scene.on_all(eight.astype(np.uint8)))]
