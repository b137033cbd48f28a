"""Independent checkers of every guarantee: exact, sharing no code with what they check."""

from __future__ import annotations

from ..contracts import InvalidInput
from ..mesh import Mesh
from ..regular import RegularTriangulation
from .surface import certify_mesh
from .triangulation import certify_triangulation


def certify(result: RegularTriangulation | Mesh) -> None:
    """Check a result with code of its own, exactly, and name the first offender.

    Parameters
    ----------
    result : RegularTriangulation or Mesh
        A triangulation must be R(S), ties broken by index. A mesh must be an embedded, oriented manifold, with or without
        boundary, the outside in front of it where it is closed.

    Raises
    ------
    CertificateError
        A guarantee does not hold: a bug of ours.
    InvalidInput
        Not a result that makes any promise.

    Examples
    --------
    >>> import recon
    >>> certify(recon.regular_triangulation([[0, 0], [1, 0], [0, 1], [1, 1]]))
    """
    if isinstance(result, RegularTriangulation):
        certify_triangulation(result)
    elif isinstance(result, Mesh):
        certify_mesh(result)
    else:
        raise InvalidInput(f"nothing to certify about a {type(result).__name__}")
