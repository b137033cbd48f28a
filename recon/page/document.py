"""A page as one file: template, styles, scripts and arrays, put together; nothing is fetched from anywhere."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from numpy.typing import NDArray

from .. import __version__
from ..contracts import InvalidInput
from .pack import pack

SCRIPTS = ("three.min.js", "family.js", "scene.js", "chart.js", "keys.js", "viewer.js")
LARGEST = 250_000_000  # characters; browsers stop at about twice that
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
_PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="$policy">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="weighted-alpha-recon $version">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
$styles</style>
</head>
<body>
$body
<script type="application/json" id="recon-meta">$meta</script>
<script type="text/plain" id="recon-data">$data</script>
$scripts
</body>
</html>
""")


def resource(name: str) -> str:
    """Read a file of this folder."""
    return files(__package__).joinpath(name).read_text("utf-8")


def viewer(embedded: bool = False) -> str:
    """Give the markup of the view, which the scripts fill: the whole window, or a part of a longer page."""
    return Template(resource("viewer.html")).substitute(kind=" embedded" if embedded else "")


def document(title: str, body: str, scene: Mapping[str, Any], arrays: Mapping[str, NDArray], styles: str = "") -> str:
    """Put a page together.

    Parameters
    ----------
    title : str
        Plain text.
    body : str
        Markup, with that of `viewer` in it once.
    scene : mapping
        What the scripts need to know, as JSON takes it.
    arrays : mapping of str to ndarray
        See `pack`.
    styles : str
        Beside those of the view.

    Returns
    -------
    str

    Raises
    ------
    InvalidInput
        The page would be larger than browsers can open.
    """
    table, data = pack(arrays)
    if len(data) > LARGEST:
        raise InvalidInput(
            f"{title}: the page would take {len(data) / 1e6:,.0f} MB, which browsers do not open (limit "
            f"{LARGEST / 1e6:,.0f} MB); take fewer points"
        )
    meta = json.dumps({**scene, "arrays": table}, allow_nan=False, separators=(",", ":"))
    return _PAGE.substitute(
        policy=escape(_POLICY),
        version=__version__,
        title=escape(title),
        styles=resource("viewer.css") + styles,
        body=body,
        meta=meta.replace("<", "\\u003c"),
        data=data,
        scripts="\n".join(f"<script>\n{resource(name)}</script>" for name in SCRIPTS),
    )
