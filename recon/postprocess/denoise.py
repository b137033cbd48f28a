"""Taking noise out: samples move to the surface that their surroundings show."""

from __future__ import annotations

from dataclasses import replace
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

import weighting
from weighting import projection

from ..contracts import InvalidInput
from ..mesh import Mesh
from .adjacency import linked
from .embedding import give_way


@overload
def denoise(points: Mesh, *, threads: int | None = None) -> Mesh: ...
@overload
def denoise(points: ArrayLike, *, threads: int | None = None) -> NDArray[np.float64]: ...


def denoise(points: ArrayLike | Mesh, *, threads: int | None = None) -> NDArray[np.float64] | Mesh:
    """Move samples to the local surface, before they are meshed or after.

    Along the normal alone: boundaries of open sheets stay where they are. Creases are not rounded by more than the noise; sheets
    farther apart than two spacings and five standard deviations of it stay apart, where it is less than the spacing. What
    lies off every surface around it stays.

    Parameters
    ----------
    points : (n, 3) array_like of float [L], or Mesh
        Of a mesh the neighbours of a vertex are those that its edges reach, so no sheet sees another.
    threads : int, optional
        All by default. The result does not depend on it.

    Returns
    -------
    (n, 3) ndarray of float64 [L], or Mesh
        Duplicates move together. The mesh has the same faces, and runs into itself nowhere that it did not before.

    Raises
    ------
    InvalidInput
        Malformed points, d other than 3.

    Notes
    -----
    See `weighting.scatter` for the noise, `weighting.projection.onto_surface` for the method: quadrics, each as wide as
    the noise allows, blended. Without noise next to nothing moves: as far as a quadric through a dozen samples misses one.
    O(n log n).

    Examples
    --------
    >>> import datasets_synthetic
    >>> ball = datasets_synthetic.surface("sphere")
    >>> noisy = ball.sample(4000, noise=0.02, rng=0).points
    >>> [float(np.abs(ball.distance(p)).mean().round(3)) for p in (noisy, denoise(noisy))]
    [0.016, 0.002]
    """
    if isinstance(points, Mesh):
        return _mesh(points, threads)
    hood = weighting.neighbors(points, threads=threads)
    if hood.points.shape[1] != 3:
        raise InvalidInput(f"points: expected 3 columns, got {hood.points.shape[1]}")
    return moved(hood, *projection.resolved(projection.Linked.of(hood, threads), threads), threads)


def moved(
    hood: weighting.Neighborhood, cloud: projection.Linked, noise: weighting.Scatter, threads: int | None
) -> NDArray[np.float64]:
    """Every input row where its distinct point goes."""
    return (hood.points + np.nan_to_num(projection.onto_surface(cloud, noise.sigma, threads)))[hood.inverse]


def _mesh(mesh: Mesh, threads: int | None) -> Mesh:
    """Vertices along the edges of the mesh."""
    if len(mesh.faces) == 0:
        return mesh
    cloud, place = linked(mesh, threads)
    move = np.nan_to_num(projection.onto_surface(cloud, projection.level(cloud, threads).sigma, threads))[place]
    return replace(mesh, vertices=give_way(mesh, mesh.vertices, mesh.vertices + move))
