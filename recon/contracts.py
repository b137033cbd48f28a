"""The one gate: input is validated here, once, and nowhere else; and the errors the project raises."""

from __future__ import annotations

import importlib
import math
import reprlib
from numbers import Integral, Real
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Admitted range: squares and their differences stay finite in float64.
MAX_COORDINATE = 1e100
MAX_WEIGHT = 1e200


class ReconError(Exception):
    """Base of every error this project raises on purpose."""


class InvalidInput(ReconError, ValueError):
    """The input is malformed: the message says what, where, and what was found."""


class DegenerateInput(ReconError, ValueError):
    """The input is well formed but has no answer: the message says why and what would help."""


class MissingDependency(ReconError, ImportError):
    """An optional package is missing: the message names the extra to install."""


class StageError(ReconError, RuntimeError):
    """An external stage (Open3D, MeshLab, …) failed; the original error is chained."""


class CertificateError(ReconError, AssertionError):
    """A guarantee does not hold: a bug of ours. The message names the first offender."""


def as_points(points: ArrayLike, dimension: int | None = None, name: str = "points") -> NDArray[np.float64]:
    """Validate points and give them as a C-contiguous float64 array.

    Parameters
    ----------
    points : (n, d) array_like of float [L]
    dimension : int, optional
        The d that is asked for; any d >= 1 by default.
    name : str
        What the error message calls the array.

    Returns
    -------
    (n, d) ndarray of float64
        The array itself where it already has this form (never written to), else a copy.

    Raises
    ------
    InvalidInput
        Not numeric, not two-dimensional, wrong d, no rows, NaN or infinite rows, beyond the admitted range.
    """
    array = as_floats(points, name)
    if array.ndim != 2:
        raise InvalidInput(f"{name}: expected a two-dimensional array (n, d), got shape {array.shape}")
    if array.shape[1] < 1 or (dimension is not None and array.shape[1] != dimension):
        wanted = "at least 1" if dimension is None else dimension
        raise InvalidInput(f"{name}: expected {wanted} columns, got {array.shape[1]}")
    if len(array) == 0:
        raise InvalidInput(f"{name}: empty, expected at least one row")
    if not (np.abs(array) <= MAX_COORDINATE).all():
        bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
        if len(bad):
            raise InvalidInput(
                f"{name}: row {bad[0]} is not finite ({shown(array[bad[0]].tolist())}), {len(bad)} such row(s) in all"
            )
        row = np.flatnonzero((np.abs(array) > MAX_COORDINATE).any(axis=1))[0]
        raise InvalidInput(
            f"{name}: row {row} has a coordinate beyond {MAX_COORDINATE:g}: {shown(array[row].tolist())}"
        )
    return array


def as_weights(weights: ArrayLike | None, n: int, name: str = "weights") -> NDArray[np.float64]:
    """Validate one weight a point and give them as a C-contiguous float64 array.

    Parameters
    ----------
    weights : (n,) array_like of float [L^2] or None
        None means all zero.
    n : int
        The number of points.
    name : str
        What the error message calls the array.

    Returns
    -------
    (n,) ndarray of float64

    Raises
    ------
    InvalidInput
        Not numeric, wrong shape, NaN or infinite, beyond the admitted range.
    """
    if weights is None:
        return np.zeros(n)
    array = as_floats(weights, name)
    if array.shape != (n,):
        raise InvalidInput(f"{name}: expected shape ({n},), one a point, got {array.shape}")
    bad = np.flatnonzero(~(np.abs(array) <= MAX_WEIGHT))
    if len(bad):
        raise InvalidInput(f"{name}: entry {bad[0]} is not finite or beyond {MAX_WEIGHT:g}: {array[bad[0]]}")
    return array


def as_floats(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """Validate numbers in any shape and give them as float64, C order; a numeric cast only, never a parse.

    Raises
    ------
    InvalidInput
        Not numeric, not a rectangular array.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise InvalidInput(f"{name}: not a rectangular array ({error})") from error
    if array.dtype.kind not in "fiub":
        raise InvalidInput(f"{name}: expected numbers, got dtype {array.dtype}")
    return np.asarray(array, dtype=np.float64, order="C")


def as_number(value: Any, name: str, wanted: str = "a number") -> float:
    """Validate one number, Python's or numpy's, and give it as a float; its range is for the caller to check.

    Raises
    ------
    InvalidInput
        Text, a flag, None, an array, complex, or a whole number beyond float64.
    """
    number = _scalar(value)
    if isinstance(number, Real) and not isinstance(number, bool):
        try:
            return float(number)
        except OverflowError:  # a whole number of more than 308 digits
            pass
    raise InvalidInput(f"{name}: expected {wanted}, got {shown(value)}")


def as_whole(value: Any, name: str, least: int, most: float = math.inf) -> int:
    """Validate one whole number, Python's or numpy's, and give it as an int.

    Raises
    ------
    InvalidInput
        Anything else, a flag or a float too; less than `least`, more than `most`.
    """
    number = _scalar(value)
    if isinstance(number, Integral) and not isinstance(number, bool) and least <= int(number) <= most:
        return int(number)
    wanted = f"at least {least}" if most == math.inf else f"{least} to {most:,}"
    raise InvalidInput(f"{name}: expected a whole number, {wanted}, got {shown(value)}")


def as_alpha(alpha: float) -> float:
    """Let one alpha through: any number, infinite too."""
    alphas = as_alphas(alpha)
    if alphas.ndim:
        raise InvalidInput(f"alpha: expected one number, got shape {alphas.shape}")
    return float(alphas)


def as_alphas(alpha: ArrayLike) -> NDArray[np.float64]:
    """Let one or several alphas through."""
    alphas = as_floats(alpha, "alpha")
    if np.asarray(alpha).dtype == bool or np.isnan(alphas).any():
        raise InvalidInput(f"alpha: expected numbers, got {shown(alpha)}")
    return alphas


def as_flag(value: Any, name: str, wanted: str = "True or False") -> bool:
    """Validate True or False, Python's or numpy's; nothing else has a truth here.

    Raises
    ------
    InvalidInput
        Anything else.
    """
    flag = _scalar(value)
    if isinstance(flag, (bool, np.bool_)):
        return bool(flag)
    raise InvalidInput(f"{name}: expected {wanted}, got {shown(value)}")


def check_kind(value: Any, name: str, kind: type | tuple[type, ...], wanted: str) -> None:
    """Raise InvalidInput for what is of another kind."""
    if not isinstance(value, kind):
        raise InvalidInput(f"{name}: expected {wanted}, got {shown(value)}")


def shown(value: Any) -> str:
    """Give a value as a message shows it: in one line, and not longer than that."""
    try:
        return " ".join(reprlib.repr(value).split())
    except ValueError:  # of a whole number with more digits than Python prints
        return f"{type(value).__name__} too long to show"


def require(module: str, extra: str) -> ModuleType:
    """Import an optional module, or say in one line which extra brings it.

    Parameters
    ----------
    module : str
        What to import, such as ``"open3d"``.
    extra : str
        The extra of this package that installs it.

    Returns
    -------
    module

    Raises
    ------
    MissingDependency
        When the module is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != module.split(".")[0]:
            raise
        raise MissingDependency(
            f"{module} is not installed; get it with: pip install 'weighted-alpha-recon[{extra}]'"
        ) from error


def _scalar(value: Any) -> Any:
    """An array without dimensions counts as what it holds."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
