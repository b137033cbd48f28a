"""Analytic surfaces and planar curves: exact distance, normal, curvature, area, volume, topology, and samples of them.

>>> import datasets_synthetic
>>> torus = datasets_synthetic.surface("torus", minor=0.2)
>>> torus
Surface('torus', 3-D, closed, euler 0, area 5.52698)
>>> torus.distance([[0.7, 0.0, 0.0], [0.0, 0.0, 0.0]]).round(12).tolist()
[-0.2, 0.5]
>>> torus.sample(2000, density=10, spacing="blue", noise=0.002, outliers=0.05, rng=0)
Sample(2000 points in 3-D, 100 outliers, 1 scan(s))
"""

from __future__ import annotations

from collections.abc import Callable

from . import curves, sheets, solids
from .piece import Foot
from .sample import Sample
from .surface import Surface

__all__ = ["Foot", "Sample", "Surface", "surface", "surfaces"]

_MAKERS: dict[str, Callable[..., Surface]] = {
    maker.__name__: maker
    for maker in (
        solids.sphere,
        solids.ellipsoid,
        solids.torus,
        solids.capsule,
        solids.box,
        solids.rounded_box,
        solids.cylinder,
        solids.cone_frustum,
        solids.bumpy_sphere,
        solids.genus_2,
        solids.genus_3,
        solids.trefoil,
        solids.linked_tori,
        solids.nested_spheres,
        solids.thin_plate,
        solids.csg_part,
        sheets.hemisphere,
        sheets.disk,
        sheets.paraboloid,
        sheets.swiss_roll,
        sheets.wavy_sheet,
        sheets.mobius_band,
        curves.circle,
        curves.ellipse,
        curves.annulus,
        curves.square,
        curves.neck,
        curves.spiral,
    )
}


def surfaces(dimension: int | None = None, *, closed: bool | None = None) -> tuple[str, ...]:
    """Give the names of the catalogue, in its order: solids, sheets, planar curves.

    Parameters
    ----------
    dimension : {2, 3}, optional
        Planar curves or surfaces in space only.
    closed : bool, optional
        Closed or open ones only.

    Returns
    -------
    tuple of str
    """
    if dimension not in (None, 2, 3):
        raise ValueError(f"dimension: expected 2 or 3, got {dimension!r}")
    made = ((name, maker()) for name, maker in _MAKERS.items())
    return tuple(
        name
        for name, shape in made
        if dimension in (None, shape.dimension) and (closed is None or closed == shape.closed)
    )


def surface(name: str, **params: float | tuple[float, ...]) -> Surface:
    """Make a surface of the catalogue.

    Parameters
    ----------
    name : str
        One of `surfaces()`.
    **params
        Sizes [L] and shape parameters of that surface; see its function in `solids`, `sheets` or `curves`.

    Returns
    -------
    Surface

    Raises
    ------
    KeyError
        There is no such surface.
    ValueError
        A parameter that the surface does not have, or with which it would meet itself.
    """
    if name not in _MAKERS:
        raise KeyError(f"no surface {name!r}; there are {', '.join(_MAKERS)}")
    maker = _MAKERS[name]
    known = maker.__code__.co_varnames[: maker.__code__.co_argcount]
    for param in params:
        if param not in known:
            raise ValueError(f"{name} has no parameter {param!r}; it has {', '.join(known) or 'none'}")
    return maker(**params)
