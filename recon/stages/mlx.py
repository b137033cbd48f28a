"""MeshLab's filter scripts (``.mlx``), with our filter among the stock ones: read, checked, written.

MeshLab itself skips without a word what it does not understand: a parameter of another case, a value that is no number, an
enumeration without its list, the old ``<xmlfilter>``. Here each of these is an error, found before anything runs.
"""

from __future__ import annotations

import difflib
import json
import math
import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping
from functools import cache
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from ..contracts import InvalidInput, as_number, shown

FILTER = "Weighted Alpha Shape"
CLEAN_UP = (
    Path(__file__).parent / "clean_up.mlx"
)  # stock filters: duplicates, non-manifold parts, small pieces, small holes

# Parameters of our own filter: MeshLab's type, or the values of an enumeration, and the default.
PARAMETERS: dict[str, tuple[str | list[str], Any]] = {
    "weights": (["Adaptive", "Uniform", "Radius attribute", "Quality"], "Adaptive"),
    "radius": ("RichAbsPerc", 0.0),
    "alpha": ("RichFloat", 0.0),
    "surface": (["Auto", "Closed", "Open", "Complex", "Terrain"], "Auto"),
    "denoise": (["Auto", "Yes", "No"], "Auto"),
    "clean": ("RichBool", True),
    "radiusattribute": ("RichString", "radius"),
    "attributes": ("RichString", ""),
    "threads": ("RichInt", 0),
}
_VECTORS = {"RichPosition": "xyz", "RichDirection": "xyz", "RichColor": "rgba"}
_TEXTS = ("RichString", "RichOpenFile", "RichSaveFile")
_WANTED = {
    "RichAbsPerc": "a length, or a percentage such as '1%'",
    "RichBool": "True or False",
    "RichInt": "a whole number",
    **dict.fromkeys(("RichFloat", "RichDynamicFloat"), "a finite number"),
    **dict.fromkeys(_TEXTS, "text"),
}
_MATRIX = [f"val{i}" for i in range(16)]


class FilterScript:
    """Filters one after the other, each with the parameters that differ from the defaults.

    Parameters
    ----------
    filters : iterable of (str, mapping of str to value)
        Names of filters and of parameters as MeshLab's scripts or as PyMeshLab has them. Values: bool, int, float, str;
        of an enumeration its text or number; a length [L] as a float, or a percentage of the diagonal of the bounding box
        as text (``"1%"``); three numbers for a position, 0 to 255 four times for a colour, 16 for a matrix.

    Attributes
    ----------
    filters : tuple of (str, dict of str to value)
        By MeshLab's names.

    Raises
    ------
    InvalidInput
        No such filter or parameter (the message names the nearest), or a value of another type.

    Examples
    --------
    >>> FilterScript([("Weighted Alpha Shape", {"surface": "Closed"}), ("meshing_remove_unreferenced_vertices", {})])
    FilterScript('Weighted Alpha Shape', 'Remove Unreferenced Vertices')
    """

    def __init__(self, filters: Iterable[tuple[str, Mapping[str, Any]]]):
        self.filters = tuple(_checked(*pair) for pair in _pairs(filters))

    def __repr__(self) -> str:
        return f"FilterScript({', '.join(repr(name) for name, _ in self.filters)})"

    def __len__(self) -> int:
        return len(self.filters)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> FilterScript:
        """Read a script that MeshLab, PyMeshLab or `write` saved.

        Raises
        ------
        InvalidInput
            Missing, malformed, or wrong as the constructor says.
        """
        if not isinstance(path, (str, os.PathLike)):  # of a number, Python would take the file of that number
            raise InvalidInput(f"script: expected a path, got {shown(path)}")
        try:
            root = ElementTree.parse(path).getroot()
        except OSError as error:
            raise InvalidInput(f"{path}: {error.strerror}") from error
        except (ElementTree.ParseError, ValueError) as error:
            raise InvalidInput(f"{path}: not a filter script: {error}") from error
        if root.tag != "FilterScript":
            raise InvalidInput(f"{path}: not a filter script: its root is <{root.tag}>")
        try:
            return cls([_parsed(element) for element in root])
        except InvalidInput as error:
            error.args = (f"{path}: {error}",)
            raise

    def write(self, path: str | os.PathLike[str], *, diagonal: float | None = None) -> None:
        """Write the script in MeshLab's own format.

        Parameters
        ----------
        path : path
        diagonal : float [L], optional
            Of the bounding box: MeshLab writes percentages as lengths, so that a script with percentages needs it.

        Raises
        ------
        InvalidInput
            A percentage without a diagonal.
        """
        from ..io import whole_file

        if not isinstance(path, (str, os.PathLike)):
            raise InvalidInput(f"script: expected a path, got {shown(path)}")
        if diagonal is not None:
            diagonal = as_number(diagonal, "diagonal", "a positive length")
            if not 0 < diagonal < math.inf:
                raise InvalidInput(f"diagonal: expected a positive length, got {diagonal}")
        root = ElementTree.Element("FilterScript")
        for name, parameters in self.filters:
            element = ElementTree.SubElement(root, "filter", name=name)
            for key, value in parameters.items():
                kind = filters()[name]["parameters"][key]
                written = _attributes(kind, value, diagonal, f"{name}: {key}")
                ElementTree.SubElement(element, "Param", {"name": key, **written})
        ElementTree.indent(root, " ")
        text = ElementTree.tostring(root, encoding="unicode", short_empty_elements=True)
        with whole_file(path) as file:
            file.write(f"<!DOCTYPE FilterScript>\n{text}\n".encode())


@cache
def filters() -> dict[str, dict[str, Any]]:
    """Give MeshLab's filters and ours: name in scripts -> name in Python and types of the parameters."""
    with open(Path(__file__).parent / "meshlab_filters.json", encoding="utf-8") as file:
        table: dict[str, dict[str, Any]] = json.load(file)
    kinds = {name: kind for name, (kind, _) in PARAMETERS.items()}
    return {**table, FILTER: {"filter": "generate_weighted_alpha_shape", "parameters": kinds}}


def python_name(parameter: str) -> str:
    """Give PyMeshLab's name of a parameter."""
    return "lambda_" if parameter == "lambda" else parameter.lower()


def _checked_parameters(name: str, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Give the parameters of a filter, named as in scripts, by MeshLab's names, each of its type; see `FilterScript`."""
    kinds = filters()[name]["parameters"]
    if not isinstance(parameters, Mapping):
        raise InvalidInput(f"filter {name!r}: expected its parameters in a dict, got {shown(parameters)}")
    aliases = {python_name(key): key for key in kinds}
    values: dict[str, Any] = {}
    for given, value in parameters.items():
        if not isinstance(given, str):
            raise InvalidInput(f"filter {name!r}: expected the name of a parameter, got {shown(given)}")
        key = given if given in kinds else aliases.get(given)
        if key is None:
            raise InvalidInput(f"filter {name!r} has no parameter {given!r}{_nearest(given, kinds)}")
        values[key] = _value(kinds[key], value, f"filter {name!r}: {key}")
    return values


def _pairs(filters: Iterable[tuple[str, Mapping[str, Any]]]) -> list[tuple[str, Mapping[str, Any]]]:
    """Let pairs of a name and parameters through."""
    if not isinstance(filters, Iterable) or isinstance(filters, (str, bytes, Mapping, np.ndarray)):
        raise InvalidInput(f"filters: expected pairs of a name and a dict of parameters, got {shown(filters)}")
    pairs = list(filters)
    for place, pair in enumerate(pairs):
        if not (isinstance(pair, (tuple, list)) and len(pair) == 2 and isinstance(pair[0], str)):
            raise InvalidInput(f"filter {place}: expected a name and a dict of parameters, got {shown(pair)}")
    return pairs


def _checked(name: str, parameters: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    if name not in filters():
        mine = {entry["filter"]: key for key, entry in filters().items()}
        if name not in mine:
            raise InvalidInput(f"no filter {name!r}{_nearest(name, [*filters(), *mine])}")
        name = mine[name]
    return name, _checked_parameters(name, parameters)


def _nearest(name: str, names: Iterable[str]) -> str:
    lower = {candidate.lower(): candidate for candidate in names}
    found = difflib.get_close_matches(name.lower(), lower, n=1)
    if found:
        return f"; did you mean {lower[found[0]]!r}?"
    return f"; it has {', '.join(sorted(lower.values()))}" if 0 < len(lower) < 20 else ""


def _parsed(element: ElementTree.Element) -> tuple[str, dict[str, Any]]:
    """Name and parameters of one element of a script; what MeshLab would skip is an error."""
    name = element.get("name")
    if element.tag != "filter":
        hint = ": the form of old versions, which MeshLab skips" if element.tag == "xmlfilter" else ""
        raise InvalidInput(f"<{element.tag} name={name!r}>{hint}; expected <filter>")
    if name is None:
        raise InvalidInput("a <filter> has no name")
    if name not in filters():
        raise InvalidInput(f"no filter {name!r}{_nearest(name, filters())}")
    kinds = filters()[name]["parameters"]
    values: dict[str, Any] = {}
    for parameter in element:
        key, kind = parameter.get("name"), parameter.get("type")
        where = f"filter {name!r}: {key}"
        if parameter.tag != "Param" or key is None:
            raise InvalidInput(f"filter {name!r}: expected <Param name=…>, got <{parameter.tag}>")
        if key not in kinds:
            raise InvalidInput(f"filter {name!r} has no parameter {key!r}{_nearest(key, kinds)}")
        if key in values:
            raise InvalidInput(f"{where}: given twice")
        expected = "RichEnum" if isinstance(kinds[key], list) else kinds[key]
        if kind != expected:
            raise InvalidInput(f"{where}: expected type {expected!r}, got {kind!r}")
        values[key] = _text_value(expected, parameter.attrib, where)
    return name, values


def _text_value(kind: str, attributes: Mapping[str, str], where: str) -> Any:
    """Read the attributes of one <Param>."""
    try:
        if kind in _VECTORS:
            return [float(attributes[axis]) for axis in _VECTORS[kind]]
        if kind == "RichMatrix44f":
            return [float(attributes[entry]) for entry in _MATRIX]
        if kind == "RichShotf":  # which PyMeshLab saves without its value
            return None
        text = attributes["value"]
        if kind == "RichBool":
            return {"true": True, "false": False}[text]
        if kind in ("RichInt", "RichMesh", "RichEnum"):
            return int(text)
        return text if kind in _TEXTS else float(text)
    except KeyError as error:
        raise InvalidInput(f"{where}: no {kind}: {error.args[0]!r} in {dict(attributes)}") from error
    except ValueError as error:
        raise InvalidInput(f"{where}: no {kind}: {error}") from error


def _value(kind: str | list[str], value: Any, where: str) -> Any:
    """Let a value of a MeshLab type through."""
    if isinstance(kind, list):
        if isinstance(value, str) and value in kind:
            return value
        if _is_whole(value) and 0 <= value < len(kind):
            return kind[value]
        raise InvalidInput(f"{where}: expected one of {', '.join(map(repr, kind))}, got {shown(value)}")
    if kind == "RichBool" and isinstance(value, (bool, np.bool_)):
        return bool(value)
    if kind in ("RichInt", "RichMesh") and _is_whole(value):
        return int(value)
    if kind in ("RichFloat", "RichDynamicFloat", "RichAbsPerc") and _is_number(value):
        return float(value)
    if kind in _TEXTS and isinstance(value, str):
        return value
    if kind == "RichAbsPerc" and isinstance(value, str) and value.endswith("%"):
        percentage(value, where)
        return value
    length = 16 if kind == "RichMatrix44f" else len(_VECTORS.get(kind, ""))
    if length:
        numbers = np.asarray(value, object).reshape(-1).tolist() if isinstance(value, (list, tuple, np.ndarray)) else []
        if len(numbers) == length and all(map(_is_number, numbers)):
            return tuple(map(float, numbers))
        raise InvalidInput(f"{where}: expected {length} numbers, got {shown(value)}")
    if kind == "RichShotf":
        raise InvalidInput(f"{where}: a camera cannot be given in a script here; leave it out")
    what = _WANTED.get(kind, f"a {kind[4:].lower()}")
    raise InvalidInput(f"{where}: expected {what}, got {shown(value)}")


def percentage(text: str, where: str) -> float:
    """Read ``"1%"`` as 1.0."""
    try:
        number = float(text[:-1])
    except ValueError as error:
        raise InvalidInput(f"{where}: no percentage: {text!r}") from error
    if not math.isfinite(number):
        raise InvalidInput(f"{where}: no percentage: {text!r}")
    return number


def _is_whole(value: Any) -> bool:
    """Python's or numpy's, and an int of C."""
    return isinstance(value, Integral) and not isinstance(value, bool) and -(2**31) <= int(value) < 2**31


def _is_number(value: Any) -> bool:
    """Python's or numpy's, and a finite double."""
    try:
        return math.isfinite(as_number(value, "value"))
    except InvalidInput:
        return False


def _attributes(kind: str | list[str], value: Any, diagonal: float | None, where: str) -> dict[str, str]:
    """Give the attributes of one <Param>, all those that MeshLab insists on."""
    written = {"description": "", "tooltip": ""}
    if isinstance(kind, list):
        choices = {f"enum_val{i}": choice for i, choice in enumerate(kind)}
        return {
            **written,
            "type": "RichEnum",
            "value": str(kind.index(value)),
            "enum_cardinality": str(len(kind)),
            **choices,
        }
    written["type"] = kind
    if kind in _VECTORS or kind == "RichMatrix44f":
        return {**written, **{key: _number(item) for key, item in zip(_VECTORS.get(kind, _MATRIX), value)}}
    if kind == "RichAbsPerc" and isinstance(value, str):
        if diagonal is None:
            raise InvalidInput(f"{where}: MeshLab keeps {value} as a length: give the diagonal of the bounding box")
        value = percentage(value, where) / 100 * diagonal
    if kind == "RichBool":
        return {**written, "value": "true" if value else "false"}
    if kind == "RichOpenFile":  # without its extensions MeshLab skips it
        written.update(exts_cardinality="1", ext_val0="*")
    if kind == "RichSaveFile":
        written.update(ext="*")
    if kind in ("RichAbsPerc", "RichDynamicFloat"):  # without a range MeshLab skips them
        limit = max(abs(value), diagonal or 0.0)
        written.update(min=_number(-limit if value < 0 else 0.0), max=_number(limit))
    return {**written, "value": value if kind in _TEXTS else _number(value)}


def _number(value: float) -> str:
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
