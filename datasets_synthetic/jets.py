"""Second-order forward differentiation: a formula written once yields its first and second derivatives, exact.

>>> import numpy as np
>>> (t,) = variables(np.array([[0.5]]))
>>> wave = sin(3.0 * t) * t
>>> bool(wave.first[0, 0] == 3.0 * np.cos(1.5) * 0.5 + np.sin(1.5))
True
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Jet:
    """A scalar at m places with its derivatives with respect to k parameters.

    Attributes
    ----------
    value : (m,) ndarray of float64
    first : (k, m) ndarray of float64
    second : (k, k, m) ndarray of float64
    """

    value: Array
    first: Array
    second: Array

    # Arrays and numpy scalars on the left leave the operation to the jet.
    __array_ufunc__ = None

    def __add__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.value + other.value, self.first + other.first, self.second + other.second)
        return Jet(self.value + other, self.first, self.second)

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, self.first * other, self.second * other)
        mixed = self.first[:, None] * other.first[None, :]
        return Jet(
            self.value * other.value,
            self.first * other.value + other.first * self.value,
            self.second * other.value + other.second * self.value + mixed + mixed.swapaxes(0, 1),
        )

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Jet | float) -> Jet:
        return self + other * -1.0

    def __rsub__(self, other: float) -> Jet:
        return self * -1.0 + other

    def __truediv__(self, other: Jet | float) -> Jet:
        return self * (1.0 / other)

    def __rtruediv__(self, other: float) -> Jet:
        inverse = 1.0 / self.value
        return _chain(self, other * inverse, -other * inverse**2, 2.0 * other * inverse**3)

    __radd__ = __add__
    __rmul__ = __mul__


def variables(parameters: Array) -> tuple[Jet, ...]:
    """Make the parameters themselves jets, (m, k) -> k of them."""
    m, k = parameters.shape
    zero = np.zeros((k, k, m))
    return tuple(Jet(parameters[:, i], np.repeat(np.eye(k)[:, i, None], m, axis=1), zero) for i in range(k))


def sin(x: Jet) -> Jet:
    """Give the sine."""
    s, c = np.sin(x.value), np.cos(x.value)
    return _chain(x, s, c, -s)


def cos(x: Jet) -> Jet:
    """Give the cosine."""
    s, c = np.sin(x.value), np.cos(x.value)
    return _chain(x, c, -s, -c)


def sqrt(x: Jet) -> Jet:
    """Give the square root; the value must be above zero."""
    root = np.sqrt(x.value)
    return _chain(x, root, 0.5 / root, -0.25 / (root * x.value))


def _chain(x: Jet, value: Array, first: Array, second: Array) -> Jet:
    """Apply a function of one variable, given by its value and two derivatives there."""
    return Jet(value, first * x.first, first * x.second + second * (x.first[:, None] * x.first[None, :]))
