"""The gate of this package: what callers hand in is checked here and nowhere else."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Beyond this a square no longer fits into float64 with room to spare.
MAX_COORDINATE = 1e100

Seed = int | np.integer | np.random.Generator | np.random.SeedSequence


def as_positions(x: ArrayLike, dimension: int, name: str = "x") -> NDArray[np.float64]:
    """Validate positions.

    Parameters
    ----------
    x : (m, d) array_like of float [L]
        m may be zero.
    dimension : int
        The d that is asked for.
    name : str
        What the error message calls the array.

    Returns
    -------
    (m, d) ndarray of float64

    Raises
    ------
    ValueError
        Not numbers, wrong shape, NaN, infinite or absurdly large rows.
    """
    try:
        array = np.asarray(x)
    except ValueError as error:
        raise ValueError(f"{name}: not a rectangular array ({error})") from error
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name}: expected numbers, got dtype {array.dtype}")
    if array.ndim != 2 or array.shape[1] != dimension:
        raise ValueError(f"{name}: expected shape (m, {dimension}), got {array.shape}")
    array = np.ascontiguousarray(array, dtype=np.float64)
    bad = np.flatnonzero(~(np.abs(array) <= MAX_COORDINATE).all(axis=1))
    if len(bad):
        raise ValueError(f"{name}: row {bad[0]} is not finite or beyond {MAX_COORDINATE:g}: {array[bad[0]]}")
    return array


def as_generator(rng: Seed) -> np.random.Generator:
    """Give the generator itself, or a new one from a seed; never the global state.

    Parameters
    ----------
    rng : numpy.random.Generator, int >= 0 or numpy.random.SeedSequence

    Returns
    -------
    numpy.random.Generator

    Raises
    ------
    ValueError
        Anything else, None included: every sample must be reproducible.
    """
    seeds = (int, np.integer, np.random.Generator, np.random.SeedSequence)
    if isinstance(rng, bool) or not isinstance(rng, seeds):
        raise ValueError(f"rng: expected a numpy.random.Generator or an integer seed, got {rng!r}")
    if isinstance(rng, (int, np.integer)) and rng < 0:
        raise ValueError(f"rng: a seed is not negative, got {rng}")
    return np.random.default_rng(rng)


def count(value: int, name: str, least: int = 1) -> int:
    """Validate a count; raises ValueError where it is no integer or below `least`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{name}: expected an integer of at least {least}, got {value!r}")
    return int(value)


def not_negative(**values: float) -> None:
    """Validate finite numbers, zero or more; raises ValueError naming the first that is not."""
    for name, value in values.items():
        if not (_is_real(value) and 0 <= value < np.inf):
            raise ValueError(f"{name}: expected a finite number, zero or more, got {value!r}")


def positive(**values: float) -> None:
    """Validate finite numbers above zero; raises ValueError naming the first that is not."""
    for name, value in values.items():
        if not (_is_real(value) and 0 < value < np.inf):
            raise ValueError(f"{name}: expected a finite number above zero, got {value!r}")


def at_most(limit: float, **values: float) -> None:
    """Validate numbers from zero to the limit; raises ValueError naming the first that is not."""
    not_negative(**values)
    for name, value in values.items():
        if value > limit:
            raise ValueError(f"{name}: expected at most {limit:.6g}, got {value!r}")


def below(**values: tuple[float, float]) -> None:
    """Validate `value < limit` for name=(value, limit); raises ValueError naming the first that is not."""
    for name, (value, limit) in values.items():
        if not value < limit:
            raise ValueError(f"{name}: must stay below {limit:.6g}, or the surface meets itself; got {value!r}")


def _is_real(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
