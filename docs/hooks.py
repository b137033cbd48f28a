"""Hooks of the documentation build: TeX to MathML and a font for it, what the library itself shows, nothing fetched at read time."""

import html
import re
from importlib.util import find_spec
from pathlib import Path

from click.testing import CliRunner
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
    """Add the font, STIX Two Math (OFL), which ziamath carries, and a page made by `recon view`."""
    (package,) = find_spec("ziamath").submodule_search_locations
    font = Path(package) / "fonts" / "STIXTwoMath-Regular.ttf"
    files.append(File.generated(config, "assets/STIXTwoMath-Regular.ttf", abs_src_path=str(font)))
    files.append(File.generated(config, "torus.html", content=torus()))
    return files


def torus():
    """Make the page of the shapes of a torus, its density changing by a factor of 10."""
    import datasets_synthetic
    from recon import reconstruct
    from recon.page import view_page

    truth = datasets_synthetic.surface("torus")
    points = truth.sample(2000, density=10, rng=0).points
    result = reconstruct(points)
    return view_page(points, result.weights, mesh=result.mesh, reference=truth, title="a torus of 2,000 points")


def on_page_markdown(markdown, **_):
    """Put the help of every command where a page asks for it."""
    return markdown.replace("<!-- help of all commands -->", command_help()) if "<!-- help" in markdown else markdown


def command_help():
    """Give what `recon COMMAND --help` prints, one section a command."""
    from recon.cli import main

    sections = []
    for name in main.commands:
        shown = CliRunner().invoke(main, [name, "--help"], prog_name="recon", terminal_width=92)
        sections.append(f"### recon {name}\n\n``` {{ .text }}\n{shown.output}```\n")
    return "\n".join(sections)


def on_page_content(content, page, **_):
    """Put MathML where Arithmatex left TeX; set units and empty descriptions of the reference as they are meant."""
    content = re.sub(r"\[L ?\^ ?(\d|d|l)\]", r"[L<sup>\1</sup>]", content)
    content = re.sub(r"float</(\w+)>\[L", r"float</\1> [L", content)
    content = re.sub(r"\s–\s*(?:<div class=\"doc-md-description\">\s*</div>\s*)?</li>", "</li>", content)
    return _FORMULA.sub(lambda found: mathml(html.unescape(found[2]), found[1] == "div"), content)


def mathml(tex, display):
    """Convert one formula; what browsers space badly is put right."""
    text = convert(tex.strip(), display="block" if display else "inline")
    # A prime of a mathematical font is raised already: as a superscript it would be raised twice.
    prime = r"<msup>(<m[io][^<]*</m[io]>|<mrow/>)<mi>(&#x0203[23];)</mi></msup>"
    text = re.sub(prime, r'<mrow>\1<mo lspace="0" rspace="0">\2</mo></mrow>', text)
    text = re.sub(r"<mo[^>]*>(&#x0007C;|\|)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">|</mo>', text)
    text = re.sub(r"<m[io]>&#x027FA;</m[io]>", '<mo lspace="0.5em" rspace="0.5em">&#x027FA;</mo>', text)
    text = re.sub(r"<m[io]>(det|min|max|log|vol)</m[io]>", r'<mi>\1</mi><mspace width="0.1em"/>', text)
    return text


def on_post_build(config):
    """Refuse a site that fetches anything from elsewhere when it is read."""
    site = Path(config["site_dir"])
    for path in sorted(site.rglob("*")):
        if path.suffix in (".html", ".css") and (found := _FETCHED.search(path.read_text(encoding="utf-8"))):
            raise PluginError(f"{path.relative_to(site)} fetches from the network: {found[0]}")
