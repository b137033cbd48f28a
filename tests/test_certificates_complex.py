"""Certificates of alpha complexes and reconstructions: one wrong number among all is found."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_certificates import GRID, TILTED, changed, spots

import recon
from recon import CertificateError, Mesh, alpha_complex, certify
from recon.boundary import Boundary
from recon.certificates.complex import ACCURACY, certify_complex
from recon.report import Report

RNG = np.random.default_rng(11)
CLOUD = RNG.normal(size=(25, 3)), RNG.normal(size=25) / 3 + 0.5


class Tampered:
    """A complex with some of its answers replaced: Tampered(complex, rho={2: array}, ...)."""

    def __init__(self, whole, **answers):
        self._whole, self._answers = whole, answers

    def __getattr__(self, name):
        if name not in self._answers:
            return getattr(self._whole, name)
        return lambda k=0.0, *rest: (
            self._answers[name][k] if k in self._answers[name] else getattr(self._whole, name)(k, *rest)
        )


def refused(result, match, check=certify):
    with pytest.raises(CertificateError, match=match):
        check(result)


def tampered(match, whole=None, **answers):
    refused(Tampered(alpha_complex(*CLOUD) if whole is None else whole, **answers), match, certify_complex)


# --- complexes


@pytest.mark.parametrize("d", [1, 2, 3])
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_complexes_pass_however_degenerate(d, data):
    cloud = data.draw(st.lists(st.tuples(spots(d), st.integers(-2, 2)), min_size=1, max_size=9))
    certify(alpha_complex(np.array([p for p, _ in cloud], float), np.array([w for _, w in cloud], float)))


@pytest.mark.parametrize("scale", [2.0**-300, 1.0, 2.0**200])
@pytest.mark.parametrize("cloud", [GRID, TILTED, GRID * 0.1 + 1e6, GRID[[0, 13, 26]], CLOUD[0]])
def test_complexes_pass_at_any_scale(cloud, scale):
    certify(alpha_complex(cloud * scale))


@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_a_wrong_size(k):
    whole = alpha_complex(*CLOUD)
    rho = whole.rho(k)
    slack = ACCURACY * (np.abs(rho) + np.abs(CLOUD[1][whole.simplices(k)]).max(axis=1))
    row = len(rho) // 2
    for factor in (-1.01, 1.01, 1e6):
        wrong = rho[row] + factor * slack[row]
        name = "mu_lower" if k == 3 else "rho"
        tampered(f"{name} of simplex|exceeds that of a coface", rho={k: changed(rho, (row, wrong))})
    tampered("rho|mu_lower", rho={k: changed(rho, (row, np.nan))})


def test_all_bounds_of_a_wrong_cell_agree_and_it_is_still_found():
    """A cell on its own: size and bounds of the cell changed together, and those of its faces with it."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    whole = alpha_complex(corners)
    wrong = changed(whole.rho(3), (0, whole.rho(3)[0] * (1 + 1e-10)))
    tampered(
        "rho of simplex .* off its rational value", whole, rho={3: wrong}, mu_lower={3: wrong}, mu_upper={3: wrong}
    )


def test_a_size_above_that_of_a_coface():
    """By less than the accuracy, so that only monotonicity can tell."""
    square = alpha_complex([[0, 0], [1, 0], [1, 1], [0, 1]])
    diagonal = square.simplices(1).tolist().index([0, 2])
    assert square.rho(1)[diagonal] == square.rho(2)[0]
    tampered("exceeds that of a coface", square, rho={1: changed(square.rho(1), (diagonal, np.nextafter(0.5, 1)))})


@pytest.mark.parametrize("name", ["attached", "on_hull"])
@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_a_wrong_answer(name, k):
    whole = alpha_complex(*CLOUD)
    truth = getattr(whole, name)(k)
    for row in (0, len(truth) // 2, len(truth) - 1):
        tampered(f"{name} of simplex", **{name: {k: changed(truth, (row, not truth[row]))}})


@pytest.mark.parametrize("name", ["mu_lower", "mu_upper"])
@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_a_bound_off_by_the_last_bit(name, k):
    whole = alpha_complex(*CLOUD)
    truth = getattr(whole, name)(k)
    row = np.flatnonzero(np.isfinite(truth))
    row = row[len(row) // 2]
    tampered(f"{name} of simplex", **{name: {k: changed(truth, (row, np.nextafter(truth[row], 9)))}})


@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_simplices_that_are_not_those_of_the_triangulation(k):
    whole = alpha_complex(*CLOUD)
    rows = whole.simplices(k)
    tampered(f"simplices\\({k}\\): .* is there twice", simplices={k: changed(rows, (3, rows[4]))})
    tampered(f"simplices\\({k}\\)", simplices={k: changed(rows, ((3, 0), 99))})
    tampered(f"rho\\({k}\\)", simplices={k: rows[1:]})
    tampered(f"simplices\\({k}\\)", simplices={k: rows.astype(np.int64)})
    tampered(f"simplices\\({k}\\)|rho\\({k}\\)", simplices={k: rows[:0]})


def test_a_wrong_class():
    whole = alpha_complex(*CLOUD)
    for k in range(4):
        classes = whole.classify(k, 0.0)
        wrong = changed(classes, (0, (classes[0] + 1) % 4))

        class Misjudged(Tampered):
            def classify(self, k, alpha, wrong=wrong, at=k):
                return wrong if k == at and alpha == 0 else self._whole.classify(k, alpha)

        refused(Misjudged(whole), "class of .* at alpha 0.0", certify_complex)


def test_a_wrong_boundary():
    whole = alpha_complex(*CLOUD)
    right = whole.boundary(0.0)
    assert right.singular.any() and not right.singular.all()
    regular, singular = np.flatnonzero(~right.singular)[0], np.flatnonzero(right.singular)[0]

    def wrong(facets, flags, match):
        tampered(match, boundary={0.0: Boundary(facets, flags)})

    facets, flags = right.facets, right.singular
    wrong(np.delete(facets, singular, axis=0), np.delete(flags, singular), "has the wrong facets")
    wrong(np.delete(facets, regular, axis=0), np.delete(flags, regular), "do not close")
    wrong(changed(facets, (regular, facets[regular, ::-1])), flags, "do not close, or are not oriented")
    wrong(np.where(flags[:, None], facets, facets[:, ::-1]), flags, "does not face outwards")
    wrong(changed(facets, (singular, facets[regular])), flags, "is there twice")
    wrong(facets, changed(flags, (singular, False)), "do not close|singular for regular")
    wrong(facets, np.ones_like(flags), "takes singular for regular")
    absent = [0, 1, next(i for i in range(2, 25) if [0, 1, i] not in whole.simplices(2).tolist())]
    wrong(changed(facets, (singular, absent)), flags, "is no facet of the triangulation")


def test_a_boundary_alone():
    boundary = alpha_complex(*CLOUD).boundary(0.0)
    certify(boundary)
    left = np.arange(len(boundary)) != np.argmin(boundary.singular)
    refused(Boundary(boundary.facets[left], boundary.singular[left]), "do not close")
    refused(
        Boundary(boundary.facets[[0, *range(len(boundary))]], boundary.singular[[0, *range(len(boundary))]]), "twice"
    )
    refused(Boundary(boundary.facets.astype(np.int64), boundary.singular), "int64")
    flat = alpha_complex(GRID[:9, 1:]).boundary(0.6)
    certify(flat)
    refused(Boundary(flat.facets[:, ::-1] * np.int32(1), changed(flat.singular, (0, True))), "do not close")
    certify(Boundary(np.zeros((0, 3), np.int32), np.zeros(0, bool)))


# --- reconstructions


def torus(n=600):
    u = 2 * np.pi * np.arange(n) / ((1 + 5**0.5) / 2)
    v = 2 * np.pi * (np.arange(n) + 0.5) / n
    r = 2 + np.cos(v)
    return np.column_stack([r * np.cos(u), r * np.sin(u), np.sin(v)])


@pytest.fixture(scope="module")
def closed():
    return recon.reconstruct(torus())


def test_reconstructions_pass(closed):
    certify(closed)
    assert closed.surface == "closed"
    sheet = torus()
    sheet = np.column_stack([sheet[:, :2], 0.1 * sheet[:, 0] ** 2])
    certify(recon.reconstruct(sheet, surface="open"))
    certify(recon.reconstruct(sheet * [1, 1, 0]))
    certify(recon.reconstruct(torus(), surface="complex", clean=False))
    certify(recon.reconstruct(np.vstack([torus(), torus()[:5]])))


def with_mesh(result, **changes):
    parts = {"vertices": result.mesh.vertices, "faces": result.mesh.faces, "vertex_source": result.mesh.vertex_source}
    return replace(result, mesh=Mesh.from_arrays(**{**parts, **changes}))


def with_report(result, **figures):
    return replace(result, report=Report({**result.report.sections, "mesh": {**result.report["mesh"], **figures}}))


def test_a_reconstruction_that_is_not_what_it_says(closed):
    mesh = closed.mesh
    refused(replace(closed, surface="open"), "called open, but no edge is open")
    refused(replace(closed, surface="solid"), "surface: 'solid'")
    refused(replace(closed, confidence=1.5), "confidence")
    refused(replace(closed, weights=closed.weights * 2), "weights: not those")
    refused(with_mesh(closed, vertices=mesh.vertices + 1e-9), "is not where input row")
    refused(with_mesh(closed, vertex_source=mesh.vertex_source[::-1]), "is no triangle|is not where")
    for name in ("vertices", "faces", "chi", "open_edges", "nonmanifold_edges", "nonmanifold_vertices"):
        refused(with_report(closed, **{name: closed.report["mesh"][name] + 2}), f"report: {name}")
    fewer = with_mesh(closed, faces=mesh.faces[1:])
    refused(fewer, "report: faces")
    told = {"faces": len(mesh.faces) - 1, "open_edges": 3, "chi": closed.report["mesh"]["chi"] - 1}
    refused(with_report(fewer, **told), "called closed, but edge")
    inside_out = with_mesh(closed, faces=mesh.faces[:, ::-1])
    refused(inside_out, "does not face outwards")
    turned = with_mesh(closed, faces=changed(mesh.faces, (7, mesh.faces[7, ::-1])))
    refused(turned, "not oriented")
    literal = recon.reconstruct(torus(), surface="complex", clean=False)
    less = {"faces": len(literal.mesh.faces) - 1}
    refused(with_report(with_mesh(literal, faces=literal.mesh.faces[1:]), **less), "not the facets of the boundary")


def test_a_face_that_is_no_triangle_of_the_triangulation(closed):
    far = closed.mesh.faces.copy()
    far[0, 0] = next(v for v in range(600) if v not in closed.mesh.faces[(closed.mesh.faces == far[0, 1]).any(axis=1)])
    refused(with_mesh(closed, faces=far), "is no triangle of the triangulation")
