"""Independent checkers of every guarantee: exact, sharing no code with what they check."""

from __future__ import annotations

from ..contracts import InvalidInput
from ..regular import RegularTriangulation
from .triangulation import certify_triangulation


def certify(result: RegularTriangulation) -> None:
    """Check a result with code of its own, exactly, and name the first offender.

    Parameters
    ----------
    result : RegularTriangulation

    Raises
    ------
    CertificateError
        A guarantee does not hold: a bug of ours.
    InvalidInput
        Not a result that makes any promise.
    """
    if isinstance(result, RegularTriangulation):
        certify_triangulation(result)
    else:
        raise InvalidInput(f"nothing to certify about a {type(result).__name__}")
