"""Independent checkers of every guarantee: exact, sharing no code with what they check."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..contracts import InvalidInput
from ..mesh import Mesh
from ..regular import RegularTriangulation
from .surface import certify_mesh
from .triangulation import certify_triangulation

if TYPE_CHECKING:
    from ..alpha import AlphaComplex
    from ..boundary import Boundary
    from ..pipeline import Reconstruction


def certify(result: RegularTriangulation | AlphaComplex | Boundary | Mesh | Reconstruction) -> None:
    """Check a result with code of its own, exactly, and name the first offender.

    Parameters
    ----------
    result : RegularTriangulation, AlphaComplex, Boundary, Mesh or Reconstruction
        A triangulation is R(S), ties broken by index. A complex has every simplex of R once, exact attachment, sizes
        within 2^-38 of the rational ones, and the intervals, classes and boundaries that follow. The regular facets of a
        boundary close. A mesh is an embedded, oriented manifold, with or without boundary, the outside in front of it
        where closed. A reconstruction keeps all that its surface kind and its report say.

    Raises
    ------
    CertificateError
        A guarantee does not hold: a bug of ours.
    InvalidInput
        Not a result that makes any promise.

    Notes
    -----
    Seconds for 100,000 points: triangulation 2, mesh 10 (its self-intersections), complex 40.

    Examples
    --------
    >>> import recon
    >>> certify(recon.regular_triangulation([[0, 0], [1, 0], [0, 1], [1, 1]]))
    """
    if isinstance(result, RegularTriangulation):
        certify_triangulation(result)
        return
    if isinstance(result, Mesh):
        certify_mesh(result)
        return
    from ..alpha import AlphaComplex  # what a triangulation does not need is not loaded for one
    from ..boundary import Boundary
    from ..pipeline import Reconstruction
    from .complex import certify_boundary, certify_complex
    from .reconstruction import certify_reconstruction

    if isinstance(result, AlphaComplex):
        certify_complex(result)
    elif isinstance(result, Boundary):
        certify_boundary(result)
    elif isinstance(result, Reconstruction):
        certify_reconstruction(result)
    else:
        raise InvalidInput(f"nothing to certify about a {type(result).__name__}")
