"""Areas and volumes agree with the closed forms, each written down here once more and independently."""

import numpy as np
import pytest
from scipy import integrate, special

from datasets_synthetic import surface, surfaces


def steiner(area: float, outline: float, holes: int, radius: float) -> tuple[float, float]:
    """Area and volume of a flat region with holes, swollen by a ball."""
    euler = 1 - holes
    surface_area = 2 * area + np.pi * radius * outline + 4 * np.pi * radius**2 * euler
    return surface_area, 2 * radius * area + np.pi * radius**2 / 2 * outline + 4 / 3 * np.pi * radius**3 * euler


def spiral_length(turns: float, start: float) -> float:
    def primitive(t: float) -> float:
        return 0.5 * (t * np.sqrt(1 + t * t) + np.arcsinh(t))

    return (primitive(2 * np.pi * (start + turns)) - primitive(2 * np.pi * start)) / (2 * np.pi * (start + turns))


def ellipsoid_area(a: float, b: float, c: float) -> float:
    """Legendre's form, a > b > c."""
    phi = np.arccos(c / a)
    k_sq = a**2 * (b**2 - c**2) / (b**2 * (a**2 - c**2))
    mixed = special.ellipeinc(phi, k_sq) * np.sin(phi) ** 2 + special.ellipkinc(phi, k_sq) * np.cos(phi) ** 2
    return 2 * np.pi * (c**2 + a * b / np.sin(phi) * mixed)


def trefoil_length() -> float:
    def speed(t: float) -> float:
        return np.hypot(np.hypot(np.cos(t) + 4 * np.cos(2 * t), -np.sin(t) + 4 * np.sin(2 * t)), 3 * np.cos(3 * t))

    return 0.32 * integrate.quad(speed, 0, 2 * np.pi, epsabs=0, epsrel=1e-12, limit=200)[0]


PI = np.pi
FIGURES = {
    "sphere": (4 * PI, 4 / 3 * PI),
    "ellipsoid": (ellipsoid_area(1, 0.75, 0.5), 4 / 3 * PI * 0.375),
    "torus": (4 * PI**2 * 0.21, 2 * PI**2 * 0.7 * 0.09),
    "capsule": (4 * PI * 0.16 + 2 * PI * 0.4 * 1.2, 4 / 3 * PI * 0.064 + PI * 0.16 * 1.2),
    "box": (2 * (1.2 + 0.96 + 0.8), 0.96),
    "rounded_box": (
        2 * (1.1 * 0.8 + 1.1 * 0.5 + 0.8 * 0.5) + 2 * PI * 0.15 * 2.4 + 4 * PI * 0.15**2,
        1.1 * 0.8 * 0.5 + 2 * (1.1 * 0.8 + 1.1 * 0.5 + 0.8 * 0.5) * 0.15 + PI * 0.15**2 * 2.4 + 4 / 3 * PI * 0.15**3,
    ),
    "cylinder": (2 * PI * 0.36 + 2 * PI * 0.6 * 1.4, PI * 0.36 * 1.4),
    "cone_frustum": (
        PI * (0.64 + 0.1225) + PI * 1.15 * np.hypot(0.45, 1.2),
        PI * 1.2 / 3 * (0.64 + 0.8 * 0.35 + 0.1225),
    ),
    "genus_2": steiner(0.8 * 0.9 + PI * 0.2025 - 2 * PI * 0.27**2, 1.6 + 2 * PI * 0.45 + 4 * PI * 0.27, 2, 0.15),
    "genus_3": steiner(PI * 0.87**2 - 3 * PI * 0.24**2, 2 * PI * 0.87 + 6 * PI * 0.24, 3, 0.13),
    "trefoil": (2 * PI * 0.11 * trefoil_length(), PI * 0.11**2 * trefoil_length()),
    "linked_tori": (8 * PI**2 * 0.55 * 0.18, 4 * PI**2 * 0.55 * 0.18**2),
    "nested_spheres": (4 * PI * 1.36, 4 / 3 * PI * (1 - 0.216)),
    "thin_plate": (2 * (1.92 + 2.8 * 0.04), 1.92 * 0.04),
    "csg_part": (
        2 * (2.09 - 2 * PI * 0.17**2) + 6 * 0.4 + 4 * PI * 0.17 * 0.4 + 2 * PI * 0.38 * 0.35 + 2 * PI * 0.2 * 0.55,
        (2.09 - 2 * PI * 0.17**2) * 0.4 + PI * 0.38**2 * 0.35 - PI * 0.04 * 0.55,
    ),
    "hemisphere": (2 * PI, np.nan),
    "disk": (PI, np.nan),
    "paraboloid": (PI / (6 * 0.64) * ((1 + 4 * 0.64) ** 1.5 - 1), np.nan),
    "swiss_roll": (spiral_length(1.5, 0.75), np.nan),
    "circle": (2 * PI, PI),
    "ellipse": (4 * special.ellipe(0.75), PI / 2),
    "annulus": (3 * PI, 0.75 * PI),
    "square": (5.6, 1.96),
    "spiral": (spiral_length(1.5, 0.75), np.nan),
    # Area of an oval of Cassini (Gauss's integral, b > a): a^2 + ... = b^2 E((a / b)^4).
    "neck": (None, 2 * 0.52 * special.ellipe((0.48 / 0.52) ** 2)),
}


@pytest.mark.parametrize("name", FIGURES)
def test_area_and_volume_are_those_of_the_closed_forms(name):
    area, volume = FIGURES[name]
    if area is not None:
        assert surface(name).area == pytest.approx(area, rel=1e-10)
    assert surface(name).volume == pytest.approx(volume, rel=1e-10, nan_ok=True)


@pytest.mark.parametrize("name", surfaces())
def test_the_quadrature_has_converged(name):
    shape = surface(name)
    finer = [piece.rule(150) for piece in shape.pieces]
    assert shape.area == pytest.approx(sum(weights.sum() for _, weights in finer), rel=1e-10)
    if shape.closed:
        supports = (weights @ np.einsum("md,md->m", foot.points, foot.normals) for foot, weights in finer)
        assert shape.volume == pytest.approx(sum(supports) / shape.dimension, rel=1e-10)
