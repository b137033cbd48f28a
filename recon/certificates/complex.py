"""Is this the weighted alpha complex of this triangulation: simplices, sizes, attachment, intervals and classes?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..contracts import CertificateError
from ..exact import Cloud, determinant, dot
from .triangulation import certify_triangulation, flat_cloud

if TYPE_CHECKING:
    from ..alpha import AlphaComplex
    from ..boundary import Boundary

ACCURACY = 2.0**-38  # of a size, in units of |rho| + max |w| over its vertices


def certify_complex(alpha_complex: AlphaComplex) -> None:
    """Check the triangulation, and then everything that the complex says of each of its simplices.

    Every simplex of R is there once. Attachment is exact: a face is attached if and only if the vertex of some coface of
    one dimension more conflicts with its orthosphere (paper, 5.2 and below). Sizes are within `ACCURACY` of the rational
    values, each one checked, and monotone as they stand. Interval bounds follow from them by rule 5.3 to the last bit, and
    classes at a few alphas by table 5.1; so do the facets of the boundaries there, the inside behind the regular ones.

    Parameters
    ----------
    alpha_complex : AlphaComplex

    Raises
    ------
    CertificateError
        Naming the first offender.
    """
    triangulation = alpha_complex.triangulation
    certify_triangulation(triangulation)
    dimension = triangulation.cells.shape[1] - 1
    upper = _cells(alpha_complex, dimension)
    for k in range(dimension - 1, -1, -1):
        upper = _faces(alpha_complex, k, upper)
    sizes = np.sort(np.concatenate([alpha_complex.rho(k) for k in range(dimension + 1)]))
    for alpha in [np.nextafter(sizes[0], -np.inf), 0.0, *sizes[[0, len(sizes) // 3, 2 * len(sizes) // 3, -1]]]:
        _classes(alpha_complex, dimension, float(alpha))
        if dimension > 0:
            _boundary(alpha_complex, dimension, float(alpha))


def certify_boundary(boundary: Boundary) -> None:
    """Check that a boundary alone can be one: no facet twice, and the regular ones together have no boundary.

    Parameters
    ----------
    boundary : Boundary

    Raises
    ------
    CertificateError
        Naming the first offender.
    """
    facets, singular = boundary.facets, boundary.singular
    if facets.ndim != 2 or facets.dtype != np.int32 or singular.shape != (len(facets),) or singular.dtype != bool:
        raise CertificateError(f"facets: {facets.dtype} {facets.shape}, singular: {singular.dtype} {singular.shape}")
    if facets.size == 0:
        return
    rows = np.sort(facets, axis=1)
    order = np.lexsort(rows.T[::-1])
    bad = np.flatnonzero((np.diff(rows[order], axis=0) == 0).all(axis=1))
    if len(bad):
        raise CertificateError(f"facet {facets[order[bad[0]]]} is there twice")
    if facets.shape[1] < 2:
        return
    regular = facets[~singular]
    ridges = np.concatenate([np.delete(regular, slot, axis=1) for slot in range(regular.shape[1])])
    way = np.repeat(np.where(np.arange(regular.shape[1]) % 2, -1, 1), len(regular))
    for a in range(ridges.shape[1]):
        for b in range(a):
            way = np.where(ridges[:, b] > ridges[:, a], -way, way)
    rows, inverse = np.unique(np.sort(ridges, axis=1), axis=0, return_inverse=True)
    bad = np.flatnonzero(np.bincount(inverse.ravel(), way, minlength=len(rows)))
    if len(bad):
        raise CertificateError(f"the regular facets do not close, or are not oriented, at {rows[bad[0]]}")


class _Level:
    """What the complex says of its k-simplices, by row."""

    def __init__(self, alpha_complex: AlphaComplex, k: int):
        self.k = k
        self.rows = np.asarray(alpha_complex.simplices(k))
        m = len(self.rows)
        if self.rows.shape != (m, k + 1) or self.rows.dtype != np.int32:
            raise CertificateError(
                f"simplices({k}): {self.rows.dtype} {self.rows.shape}, promised int32 ({m}, {k + 1})"
            )
        for name, dtype in (
            ("rho", np.float64), ("mu_lower", np.float64), ("mu_upper", np.float64), ("attached", bool), ("on_hull", bool),
        ):  # fmt: skip
            array = np.asarray(getattr(alpha_complex, name)(k))
            if array.shape != (m,) or array.dtype != dtype:
                raise CertificateError(f"{name}({k}): {array.dtype} {array.shape}, promised {np.dtype(dtype)} ({m},)")
            setattr(self, name, array)
        self.sorted = np.sort(self.rows, axis=1)

    rho: NDArray[np.float64]
    mu_lower: NDArray[np.float64]
    mu_upper: NDArray[np.float64]
    attached: NDArray[np.bool_]
    on_hull: NDArray[np.bool_]

    def expect(self, name: str, expected: NDArray[Any]) -> None:
        """Compare what the complex says with what follows, to the last bit."""
        found = getattr(self, name)
        bad = np.flatnonzero(found != expected)
        if len(bad):
            i = bad[0]
            raise CertificateError(f"{name} of simplex {self.rows[i]} is {found[i]}, not {expected[i]}")


def _cells(alpha_complex: AlphaComplex, dimension: int) -> _Level:
    """The top level: the cells, unattached, with their own size as bounds."""
    level = _Level(alpha_complex, dimension)
    _every_simplex_once(level, np.sort(alpha_complex.triangulation.cells, axis=1))
    m = len(level.rows)
    level.expect("attached", np.zeros(m, bool))
    level.expect("on_hull", np.zeros(m, bool))
    level.expect("mu_lower", level.rho)
    level.expect("mu_upper", level.rho)
    _sizes(alpha_complex, level)
    return level


def _faces(alpha_complex: AlphaComplex, k: int, upper: _Level) -> _Level:
    """A lower level, from the one above: rule 5.3."""
    level = _Level(alpha_complex, k)
    width = k + 2
    below = np.concatenate([np.delete(upper.sorted, slot, axis=1) for slot in range(width)])
    apex = upper.sorted.T.ravel()
    coface = np.tile(np.arange(len(upper.rows)), width)
    face = _every_simplex_once(level, below)
    m = len(level.rows)

    conflict = np.zeros(m, bool)
    cloud = Cloud(alpha_complex.triangulation.points, alpha_complex.triangulation.weights)
    conflict[face[cloud.sign(cloud.attachment, *below.T, apex) < 0]] = True
    level.expect("attached", conflict)

    cells_level = upper.k == alpha_complex.triangulation.cells.shape[1] - 1
    touched = (
        np.bincount(face, minlength=m) == 1
        if cells_level
        else np.bincount(face[upper.on_hull[coface]], minlength=m) > 0
    )
    level.expect("on_hull", touched)

    enter = np.where(upper.attached, upper.mu_lower, upper.rho)
    lower, highest, smallest = np.full(m, np.inf), np.full(m, -np.inf), np.full(m, np.inf)
    np.minimum.at(lower, face, enter[coface])
    np.maximum.at(highest, face, upper.mu_upper[coface])
    np.minimum.at(smallest, face, upper.rho[coface])
    level.expect("mu_lower", lower)
    level.expect("mu_upper", np.where(touched, np.inf, highest))
    bad = np.flatnonzero(level.rho > smallest)
    if len(bad):
        i = bad[0]
        raise CertificateError(
            f"size {level.rho[i]} of simplex {level.rows[i]} exceeds that of a coface, {smallest[i]}"
        )
    _sizes(alpha_complex, level)
    return level


def _every_simplex_once(level: _Level, expected: NDArray[np.int32]) -> NDArray[np.int64]:
    """The rows of a level are the expected ones, each once; gives the row of each expected one."""
    if len(level.rows) == 0 or level.sorted.min() < 0:
        raise CertificateError(f"simplices({level.k}): none, or a row is negative")
    order = np.lexsort(level.sorted.T)
    twice = np.flatnonzero((np.diff(level.sorted[order], axis=0) == 0).all(axis=1))
    if len(twice):
        raise CertificateError(f"simplices({level.k}): {level.rows[order[twice[0]]]} is there twice")
    row = _match(expected, level.sorted)
    bad = np.flatnonzero(row < 0)
    if len(bad):
        raise CertificateError(f"simplices({level.k}): {expected[bad[0]]} is missing")
    known = np.zeros(len(level.rows), bool)
    known[row] = True
    if not known.all():
        raise CertificateError(f"simplices({level.k}): {level.rows[np.argmin(known)]} is none of the triangulation")
    return row


def _excess(*spots: Any) -> Any:
    """Weight of the last spot minus the size of the simplex of the others, up to a positive factor.

    rho = L' G^-1 L / 4 - w_0, with the Gram matrix G of the edges from the first vertex and their lifts L; and by Cramer
    L' G^-1 L det G is the sum of L_i det(G with row i replaced by L).
    """
    *corners, claim = spots
    first, *others = corners
    total = claim.weight + first.weight
    if not others:
        return total
    edges = [first.edge(c) for c in others]
    lifts = [first.lift(e, c) for e, c in zip(edges, others)]
    gram = [[dot(a, b) for b in edges] for a in edges]
    cramer = [determinant([*gram[:i], lifts, *gram[i + 1 :]]) for i in range(len(edges))]
    twice = total + total
    return (twice + twice) * determinant(gram) - dot(lifts, cramer)


def _sizes(alpha_complex: AlphaComplex, level: _Level) -> None:
    """Each size against its rational value: of a vertex exact, else above it and below it within the accuracy."""
    triangulation = alpha_complex.triangulation
    if level.k == 0:
        level.expect("rho", -triangulation.weights[level.rows[:, 0]])
        return
    n, m = len(triangulation.points), len(level.rows)
    bad = np.flatnonzero(~np.isfinite(level.rho))
    if len(bad):
        raise CertificateError(f"rho of simplex {level.rows[bad[0]]} is {level.rho[bad[0]]}")
    slack = ACCURACY * (np.abs(level.rho) + np.abs(triangulation.weights[level.rows]).max(axis=1))
    claims = np.concatenate([level.rho - slack, level.rho + slack])
    # The claims become weights of further spots, whose places do not matter.
    places = np.concatenate(
        [triangulation.points, np.broadcast_to(triangulation.points[:1], (2 * m, triangulation.points.shape[1]))]
    )
    cloud = Cloud(places, np.concatenate([triangulation.weights, claims]))
    for shift, side in ((0, 1), (m, -1)):
        sign = cloud.sign(_excess, *level.rows.T, n + shift + np.arange(m)) * side
        bad = np.flatnonzero(sign > 0)
        if len(bad):
            i = bad[0]
            raise CertificateError(
                f"rho of simplex {level.rows[i]} is {level.rho[i]}, off its rational value by more than {slack[i]}"
            )


def _classes(alpha_complex: AlphaComplex, dimension: int, alpha: float) -> None:
    """Classes at one alpha by table 5.1, with equality in."""
    from ..alpha import EXTERIOR, INTERIOR, REGULAR, SINGULAR

    for k in range(dimension + 1):
        unattached = ~alpha_complex.attached(k)
        expected = np.full(len(unattached), EXTERIOR, np.int8)
        expected[unattached & (alpha_complex.rho(k) <= alpha)] = SINGULAR
        expected[alpha_complex.mu_lower(k) <= alpha] = REGULAR
        expected[alpha_complex.mu_upper(k) <= alpha] = INTERIOR
        found = np.asarray(alpha_complex.classify(k, alpha))
        bad = np.flatnonzero(found != expected)
        if len(bad):
            simplex = alpha_complex.simplices(k)[bad[0]]
            raise CertificateError(f"class of {simplex} at alpha {alpha} is {found[bad[0]]}, not {expected[bad[0]]}")


def _boundary(alpha_complex: AlphaComplex, dimension: int, alpha: float) -> None:
    """The facets of one boundary: the exposed ones, singular where they are, the cell in K_alpha behind the regular ones."""
    boundary = alpha_complex.boundary(alpha)
    certify_boundary(boundary)
    k, triangulation = dimension - 1, alpha_complex.triangulation
    rows = np.sort(alpha_complex.simplices(k), axis=1)
    lower, interior = alpha_complex.mu_lower(k) <= alpha, alpha_complex.mu_upper(k) <= alpha
    singular = ~lower & ~alpha_complex.attached(k) & (alpha_complex.rho(k) <= alpha)
    place = _match(np.sort(boundary.facets, axis=1), rows)
    bad = np.flatnonzero(place < 0)
    if len(bad):
        raise CertificateError(f"boundary at alpha {alpha}: {boundary.facets[bad[0]]} is no facet of the triangulation")
    there = np.zeros(len(rows), bool)
    there[place] = True
    for wrong, verdict in (
        ((there != (lower & ~interior | singular)), "has the wrong facets"),
        (
            there & (singular != _scattered(place, boundary.singular, len(rows))),
            "takes singular for regular",
        ),
    ):
        if wrong.any():
            raise CertificateError(f"boundary at alpha {alpha} {verdict}: {rows[np.argmax(wrong)]}")
    if dimension == 1:
        return
    cells = alpha_complex.simplices(dimension)[alpha_complex.rho(dimension) <= alpha]
    below = np.concatenate([np.delete(np.sort(cells, axis=1), slot, axis=1) for slot in range(dimension + 1)])
    apex = np.full(len(rows), -1)
    apex[_match(below, rows)] = np.sort(cells, axis=1).T.ravel()
    regular = ~boundary.singular
    cloud = flat_cloud(triangulation)
    turned = cloud.sign(cloud.orient, *triangulation.cells[:1].T)[0]
    side = cloud.sign(cloud.orient, *boundary.facets[regular].T, apex[place[regular]])
    bad = np.flatnonzero(side != turned * (-1) ** dimension)
    if len(bad):
        raise CertificateError(f"boundary at alpha {alpha}: {boundary.facets[regular][bad[0]]} does not face outwards")


def _scattered(place: NDArray[np.int64], values: NDArray[np.bool_], n: int) -> NDArray[np.bool_]:
    result = np.zeros(n, bool)
    result[place] = values
    return result


def _match(rows: NDArray[np.int32], known: NDArray[np.int32]) -> NDArray[np.int64]:
    """Where each row is among distinct known ones; -1 where it is not."""
    both = np.concatenate([known, rows])
    key = both[:, 0].astype(np.int64)
    for column in both.T[1:]:
        key = np.unique(key, return_inverse=True)[1].ravel() * (int(both.max()) + 1) + column
    order = np.argsort(key[: len(known)])
    sorted_keys = key[: len(known)][order]
    at = np.minimum(np.searchsorted(sorted_keys, key[len(known) :]), len(known) - 1)
    return np.where(sorted_keys[at] == key[len(known) :], order[at], -1)
