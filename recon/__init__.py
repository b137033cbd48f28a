"""Point cloud in, trustworthy mesh out: exact weighted alpha shapes (Edelsbrunner 1992) with adaptive weights."""

from importlib import import_module as _import_module

__version__ = "0.1.0"

# Public name -> module that makes it. Loaded on first use (PEP 562), so that `import recon` stays fast.
_PUBLIC = {
    "reconstruct": "pipeline",
    "Reconstruction": "pipeline",
    "Mesh": "mesh",
    "regular_triangulation": "regular",
    "RegularTriangulation": "regular",
    "alpha_complex": "alpha",
    "AlphaComplex": "alpha",
    "Boundary": "alpha",
    "EXTERIOR": "alpha",
    "SINGULAR": "alpha",
    "REGULAR": "alpha",
    "INTERIOR": "alpha",
    "power_diagram": "power",
    "PowerDiagram": "power",
    "space_filling_diagram": "spacefill",
    "SpaceFillingDiagram": "spacefill",
    "alpha_shape": "exposed",
    "measure": "metrics",
    "Metric": "metrics",
    "certify": "certificates",
    "read_points": "io",
    "read_mesh": "io",
    "write_mesh": "io",
    "write_points": "io",
    "PointCloud": "io",
    "ReconError": "contracts",
    "InvalidInput": "contracts",
    "DegenerateInput": "contracts",
    "MissingDependency": "contracts",
    "StageError": "contracts",
    "CertificateError": "contracts",
}
__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> object:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'recon' has no attribute {name!r}")
    value = getattr(_import_module(f".{_PUBLIC[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
