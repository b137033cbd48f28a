"""What other libraries call colours, in which numbers they keep them, and what is none of their meshes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from ..mesh import Mesh


def unit_colors(colors: NDArray, channels: int) -> NDArray[np.float64]:
    """Give colours as numbers in [0, 1].

    Parameters
    ----------
    colors : (n, 3) or (n, 4) ndarray
        Integers count from 0 to the greatest of their type; floats are taken as they are.
    channels : {3, 4}
        RGB, or RGBA; a missing alpha is 1.

    Returns
    -------
    (n, channels) ndarray of float64
    """
    if colors.ndim != 2 or colors.shape[1] not in (3, 4) or colors.dtype.kind not in "fui":
        raise InvalidInput(f"colors: expected numbers of shape (n, 3) or (n, 4), got {colors.dtype} {colors.shape}")
    values = colors.astype(np.float64)
    if colors.dtype.kind in "ui":
        values /= np.iinfo(colors.dtype).max
    if values.shape[1] < channels:
        values = np.column_stack([values, np.ones(len(values))])
    return np.ascontiguousarray(values[:, :channels])


def byte_colors(colors: NDArray) -> NDArray[np.uint8]:
    """Give colours as (n, 4) bytes."""
    if colors.dtype == np.uint8 and colors.ndim == 2 and colors.shape[1] == 4:
        return colors
    return np.round(np.clip(unit_colors(colors, 4), 0, 1) * 255).astype(np.uint8)


def refuse_other(value: Any, kind: type, name: str) -> None:
    """Raise InvalidInput for what is not of a kind."""
    if not isinstance(value, kind):
        raise InvalidInput(f"mesh: expected a {name}, got {type(value).__name__}")


def doubles(mesh: Mesh, name: str, columns: int) -> NDArray[np.float64] | None:
    """Give an attribute that the other library has a place for, (v, columns); None where there is none.

    Raises
    ------
    InvalidInput
        No numbers, or of another shape.
    """
    values, n = mesh.attributes.get(name), len(mesh.vertices)
    if values is None:
        return None
    if values.dtype.kind not in "fiub" or values.size != n * columns:
        raise InvalidInput(
            f"attribute {name!r}: expected numbers of shape {(n, columns)}, got {values.dtype} {values.shape}"
        )
    return values.astype(np.float64).reshape(n, columns)


def others(attributes: Mapping[str, NDArray], *known: str) -> dict[str, NDArray]:
    """Leave out the attributes that have a place of their own."""
    return {name: value for name, value in attributes.items() if name not in known}


def split_source(attributes: dict[str, NDArray]) -> NDArray | None:
    """Take the input rows out of attributes in which they travelled, maybe as floats and as a column."""
    source = attributes.pop("vertex_source", None)
    return None if source is None else np.asarray(source).reshape(-1)
