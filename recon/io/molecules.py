"""Molecules as points with radii: atoms of PDB files, XYZR through the text reader, van der Waals radii of Bondi."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput
from .cloud import Content, PointCloud
from .files import display_name, read_bytes

# Van der Waals radii in angstrom: Bondi (1964), "van der Waals volumes and radii"; hydrogen as there, 1.20.
BONDI = {
    "H": 1.20, "D": 1.20, "HE": 1.40, "LI": 1.82, "C": 1.70, "N": 1.55, "O": 1.52, "F": 1.47, "NE": 1.54, "NA": 2.27,
    "MG": 1.73, "SI": 2.10, "P": 1.80, "S": 1.80, "CL": 1.75, "AR": 1.88, "K": 2.75, "NI": 1.63, "CU": 1.40, "ZN": 1.39,
    "GA": 1.87, "AS": 1.85, "SE": 1.90, "BR": 1.85, "KR": 2.02, "PD": 1.63, "AG": 1.72, "CD": 1.58, "IN": 1.93,
    "SN": 2.17, "TE": 2.06, "I": 1.98, "XE": 2.16, "PT": 1.72, "AU": 1.66, "HG": 1.55, "TL": 1.96, "PB": 2.02, "U": 1.86,
}  # fmt: skip

# Element symbols by atomic number, from 1.
SYMBOLS = (
    "H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Kr Rb Sr Y Zr Nb "
    "Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce Pr Nd Pm Sm Eu Gd Tb Dy Ho Er Tm Yb Lu Hf Ta W Re Os Ir Pt Au "
    "Hg Tl Pb Bi Po At Rn Fr Ra Ac Th Pa U Np Pu Am Cm Bk Cf Es Fm Md No Lr Rf Db Sg Bh Hs Mt Ds Rg Cn Nh Fl Mc Lv Ts Og"
).split()
_NUMBERS = {"D": 1, **{symbol.upper(): number for number, symbol in enumerate(SYMBOLS, 1)}}


def read_molecule(
    path: str | os.PathLike[str], *, hetero: bool = False, radii: Mapping[str, float] | None = None
) -> PointCloud:
    """Read the atoms of a PDB or XYZR file as points [angstrom] with the attribute ``"radius"``.

    Of a PDB file these are the atoms of the first model and, of alternate locations, the first; with the attributes
    ``"element"``, the atomic number (uint8, see `SYMBOLS`), and ``"hetero"``, 1 from a HETATM record, else 0, as well.

    Parameters
    ----------
    path : path, or ``"-"`` for standard input
        The extension xyzr tells XYZR from PDB: lines of x y z radius.
    hetero : bool
        Keep HETATM records of a PDB file too: water, ions, ligands.
    radii : mapping of str to float [angstrom], optional
        Radii by element symbol, before those of Bondi.

    Returns
    -------
    PointCloud

    Raises
    ------
    InvalidInput
        Malformed, no atoms, a radius that is negative, or an element that has no radius: the message names it.

    Notes
    -----
    Weights for the space filling diagram are ``(radius + probe)**2``, see `ball_weights`.
    """
    name = display_name(path)
    if os.fspath(path).lower().endswith((".xyzr", ".xyzr.txt")):
        from . import read_points

        cloud = read_points(path, format="xyzr")
        if "radius" not in cloud.attributes:
            raise InvalidInput(f"{name}: expected four columns, x y z radius")
        return cloud
    content = read(read_bytes(path), name, radii)
    from . import _checked

    cloud = _checked(content, name, False)
    kept = np.ones(len(cloud), bool) if hetero else cloud.attributes["hetero"] == 0
    if not kept.any():
        raise InvalidInput(f"{name}: has HETATM records alone, pass hetero=True to keep them")
    arrays = {key: value[kept] for key, value in cloud.attributes.items()}
    points, rows = cloud.points[kept], cloud.rows[kept]
    for array in (points, rows, *arrays.values()):
        array.flags.writeable = False
    return PointCloud(points, arrays, rows)


def ball_weights(radius: NDArray[np.float64], probe: float = 0.0) -> NDArray[np.float64]:
    """Give the weights (n,) [L^2] of balls of these radii (n,) [L], each grown by the radius of a probe [L].

    With the probe of a solvent, 1.4 angstrom for water, the boundary of the union is its accessible surface (Lee and
    Richards 1971); with none it is the van der Waals surface.
    """
    if not (np.isfinite(probe) and probe >= 0):
        raise InvalidInput(f"probe: expected a radius, at least 0, got {probe!r}")
    values = np.asarray(radius, np.float64)
    bad = np.flatnonzero(~(values >= 0))
    if len(bad):
        raise InvalidInput(f"radius: entry {bad[0]} is negative or NaN: {values[bad[0]]}")
    return (values + probe) ** 2


def read(data: bytes, name: str, radii: Mapping[str, float] | None = None) -> Content:
    """Read ATOM and HETATM records of the first model of a PDB file; see `read_molecule`.

    Columns as in the PDB format 3.3: name 13-16, alternate location 17, chain and residue 22-27,
    x 31-38, y 39-46, z 47-54, element 77-78; without an element the name tells.
    """
    table = {key.upper(): float(value) for key, value in {**BONDI, **_upper(radii)}.items()}
    points: list[tuple[float, float, float]] = []
    lines: list[int] = []
    radius: list[float] = []
    elements: list[int] = []
    hetero: list[bool] = []
    first: dict[tuple[str, str], str] = {}  # which alternate location an atom of a residue came with first
    for number, line in enumerate(data.decode("latin-1").splitlines(), 1):
        record = line[:6]
        if record.startswith("ENDMDL") and points:
            break
        if record not in ("ATOM  ", "HETATM"):
            continue
        try:
            place = float(line[30:38]), float(line[38:46]), float(line[46:54])
        except ValueError as error:
            raise InvalidInput(
                f"{name}: line {number}: columns 31 to 54 are no coordinates: {line[30:54]!r}"
            ) from error
        alternate, identity = line[16:17], (line[21:27], line[12:16])
        if alternate.strip() and first.setdefault(identity, alternate) != alternate:
            continue
        element = _element(line)
        if element not in table:
            raise InvalidInput(
                f"{name}: line {number}: no van der Waals radius for element {element or line[12:16]!r}; "
                "give one to read_molecule, radii={...}"
            )
        points.append(place)
        lines.append(number)
        radius.append(table[element])
        elements.append(_NUMBERS[element])
        hetero.append(record == "HETATM")
    attributes: dict[str, NDArray] = {
        "radius": np.array(radius, np.float64),
        "element": np.array(elements, np.uint8),
        "hetero": np.array(hetero, np.uint8),
    }
    return Content(np.array(points).reshape(-1, 3), attributes, line_of=lambda row: lines[row])


def _upper(radii: Mapping[str, float] | None) -> dict[str, float]:
    """Let radii by element through."""
    result = {}
    for key, value in (radii or {}).items():
        if not (np.isfinite(value) and value >= 0):
            raise InvalidInput(f"radii: {key}: expected a radius, at least 0, got {value!r}")
        if key.upper() not in _NUMBERS:
            raise InvalidInput(f"radii: {key!r} is no element")
        result[key.upper()] = float(value)
    return result


def _element(line: str) -> str:
    """Element symbol of an atom, upper case: columns 77-78, else by the alignment of the name (13-14)."""
    said = line[76:78].strip().upper()
    if said and said.isalpha():
        return said
    symbol, name = line[12:14].upper(), line[12:16].strip()
    hydrogen = symbol[:1] == "H" and len(name) == 4  # such as HG21, which has no room for alignment
    if symbol.isalpha() and symbol in _NUMBERS and not hydrogen:
        return symbol
    return next((letter.upper() for letter in line[12:16] if letter.isalpha()), "")
