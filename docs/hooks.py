"""Hooks of the documentation build: TeX to MathML, a mathematical font to show it in, and nothing fetched at read time."""

import html
import re
from importlib.util import find_spec
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
# What a browser fetches by itself when it shows a page; a plain link is no such thing.
_FETCHED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio|embed|object)\b[^>]*?\s(?:src|data)=["']?(?:https?:)?//[^"'\s>]+"""
    r"""|<link\b(?=[^>]*rel=["']?(?:stylesheet|icon|preload|preconnect|modulepreload))[^>]*href=["']?(?:https?:)?//[^"'\s>]+"""
    r"""|(?:url\(|@import\s)["']?(?:https?:)?//[^"')\s]+"""
)


def on_files(files, config):
    """Add the font: STIX Two Math (OFL), which ziamath carries."""
    (package,) = find_spec("ziamath").submodule_search_locations
    font = Path(package) / "fonts" / "STIXTwoMath-Regular.ttf"
    files.append(File.generated(config, "assets/STIXTwoMath-Regular.ttf", abs_src_path=str(font)))
    return files


def on_page_content(content, page, **_):
    """Put MathML where Arithmatex left TeX."""
    return _FORMULA.sub(lambda found: mathml(html.unescape(found[2]), found[1] == "div"), content)


def mathml(tex, display):
    """Convert one formula; what browsers space badly is put right."""
    text = convert(tex.strip(), display="block" if display else "inline")
    # A prime of a mathematical font is raised already: as a superscript it would be raised twice.
    prime = r"<msup>(<m[io][^<]*</m[io]>|<mrow/>)<mi>(&#x0203[23];)</mi></msup>"
    text = re.sub(prime, r'<mrow>\1<mo lspace="0" rspace="0">\2</mo></mrow>', text)
    text = re.sub(r"<mo[^>]*>(&#x0007C;|\|)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">|</mo>', text)
    text = re.sub(r"<m[io]>(det|min|max|conv|aff|dom|up|sign)</m[io]>", r'<mi>\1</mi><mspace width="0.1em"/>', text)
    return text


def on_post_build(config):
    """Refuse a site that fetches anything from elsewhere when it is read."""
    site = Path(config["site_dir"])
    for path in sorted(site.rglob("*")):
        if path.suffix in (".html", ".css") and (found := _FETCHED.search(path.read_text(encoding="utf-8"))):
            raise PluginError(f"{path.relative_to(site)} fetches from the network: {found[0]}")
