"""Arrows point down only, and what is optional is imported where it is needed."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("recon", "weighting", "datasets_synthetic")
# From the top: a module may import what stands below it.
ORDER = [
    "cli", "stages", "page", "pipeline", "report", "metrics", "postprocess", "surface", "alpha", "regular", "_kernels", "threads", "contracts",
]  # fmt: skip
# Weights that are judged by the complex that they make stand beside the pipeline.
ABOVE_SURFACE = {"weighting.enforce", "weighting.closing"}
OPTIONAL = {"open3d", "pymeshlab", "trimesh", "laspy", "gudhi", "pyvista", "networkx", "matplotlib"}


def imports(path: Path, top_level_only: bool = False) -> set[str]:
    """Absolute names of the modules that a file imports."""
    tree = ast.parse(path.read_text())
    package = path.relative_to(ROOT).parent.parts
    nodes = tree.body if top_level_only else ast.walk(tree)
    found = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            name = ".".join([*base, *([node.module] if node.module else [])])
            found |= {name} | {f"{name}.{alias.name}" for alias in node.names}
    return found


def modules() -> list[Path]:
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def layer(name: str) -> int | None:
    parts = name.split(".")
    return ORDER.index(parts[1]) if parts[0] == "recon" and len(parts) > 1 and parts[1] in ORDER else None


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_point_down(path):
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    mine = layer(name)
    for other in imports(path):
        theirs = layer(other)
        if mine is not None and theirs is not None:
            assert theirs >= mine, f"{name} imports {other}"
        if name.startswith("recon._kernels"):
            assert not other.startswith("recon.") or other.startswith(("recon._kernels", "recon.__version__")), other
        if name.startswith("datasets_synthetic"):
            assert not other.startswith(("recon", "weighting")), f"{name} imports {other}"
        if name in ABOVE_SURFACE:
            assert theirs is None or theirs >= ORDER.index("surface"), f"{name} imports {other}"
        elif name.startswith("weighting"):
            assert not other.startswith("recon.") or other.startswith(
                ("recon.contracts", "recon.threads", "recon._kernels")
            ), other
        if name.startswith("recon.certificates"):
            assert not other.startswith("recon._kernels"), f"{name} imports {other}"


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_nothing_optional_is_imported_at_module_level(path):
    assert not {name.split(".")[0] for name in imports(path, top_level_only=True)} & OPTIONAL


def test_importing_recon_loads_neither_numba_nor_scipy():
    code = "import sys, recon; print([m for m in ('numba', 'scipy', 'sklearn', 'numpy') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"


def test_every_public_name_is_there():
    import recon

    for name in recon.__all__:
        assert getattr(recon, name) is not None
    with pytest.raises(AttributeError, match="no attribute"):
        _ = recon.nothing_of_the_kind
