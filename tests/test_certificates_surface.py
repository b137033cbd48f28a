"""Certificates of meshes: every corruption is named, and what is right passes."""

from dataclasses import replace

import numpy as np
import pytest
from oracle import orient
from test_metrics import CORNERS, cube, icosphere, joined
from test_topology import CUBE, grid_torus, strip

from recon import CertificateError, Mesh, certify
from recon.certificates.surface import certify_mesh

ROTATION = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def box(faces=CUBE, corners=CORNERS):
    return Mesh.from_arrays(corners, faces)


def refused(mesh, match, **claims):
    with pytest.raises(CertificateError, match=match):
        certify_mesh(mesh, **claims)


def torus(n=12, m=8):
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = 2 + 0.7 * np.cos(v)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), 0.7 * np.sin(v)], axis=-1).reshape(-1, 3)
    return vertices, grid_torus(n, m)


def disc():
    angle = 2 * np.pi * np.arange(6) / 6
    vertices = np.vstack([[0, 0, 0], np.column_stack([np.cos(angle), np.sin(angle), 0.1 * angle])])
    return vertices, np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])


@pytest.mark.parametrize("scale", [2.0**-400, 1.0, 2.0**300])
@pytest.mark.parametrize("turn", [np.eye(3), ROTATION, -ROTATION[:, [1, 0, 2]]])
def test_right_meshes_pass(scale, turn):
    if np.linalg.det(turn) < 0:
        turn = -turn
    for vertices, faces in (cube(), torus(), icosphere(2), cube((1e6, 2e6, 5))):
        certify(Mesh.from_arrays(vertices @ turn.T * scale, faces))
        certify_mesh(Mesh.from_arrays(vertices @ turn.T * scale, faces), closed=True)
    vertices, faces = disc()
    certify_mesh(Mesh.from_arrays(vertices @ turn.T * scale, faces), closed=False)
    certify_mesh(Mesh.from_arrays(vertices @ turn.T * scale, faces[:, ::-1]), closed=False)


def test_nothing_is_a_mesh_too():
    empty = Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    certify(empty)
    refused(empty, "called closed, but has no face", closed=True)
    refused(empty, "called open, but has no face", closed=False)


def test_arrays():
    good = box()
    refused(replace(good, faces=good.faces.astype(np.int64)), "faces: int64")
    refused(replace(good, vertices=good.vertices.astype(np.float32)), "vertices: float32")
    refused(replace(good, vertex_source=good.vertex_source[1:]), "vertex_source")
    refused(replace(good, attributes={"colour": np.zeros(7)}), "colour")
    refused(replace(good, vertices=np.where(good.vertices == 1, np.nan, 0.0)), "vertex 1 is not finite")
    refused(replace(good, faces=good.faces + np.int32(1)), "names a vertex that is not there")


def test_faces_without_area_and_faces_twice():
    refused(box([*CUBE, [0, 1, 1]]), "face 12 .* has no area")
    line = np.vstack([CORNERS, [0.5, 0, 0]])
    refused(box([*CUBE, [0, 1, 8]], line), "face 12 .* has no area")
    refused(box([*CUBE, CUBE[3, [1, 2, 0]]]), "faces 3 .* and 12 .* are on the same vertices")
    refused(box([*CUBE, CUBE[3, ::-1]]), "on the same vertices")


def test_closed_or_open_as_claimed():
    refused(box(CUBE[1:]), "called closed, but edge .* has one face, 3 such", closed=True)
    certify_mesh(box(CUBE[1:]), closed=False)
    refused(box(), "called open, but no edge is open", closed=False)


def test_edges_and_vertices_that_are_not_manifold():
    corners = np.vstack([CORNERS, CORNERS[:6] - [0, 1, 1]])
    number = {tuple(v): i for i, v in enumerate(corners)}
    below = [[number[tuple(CORNERS[v] - [0, 1, 1])] for v in face] for face in CUBE]
    both = box([*CUBE.tolist(), *below], corners)
    refused(both, "not manifold: edge .* has 4 faces", closed=True)
    certify_mesh(both, closed=True, manifold=False)
    pinched = np.vstack([CORNERS, CORNERS[:7] - 1])
    at = box([*CUBE, *np.where(CUBE == 7, 0, CUBE + 8)], pinched)
    refused(at, "not manifold: the faces at vertex 0 form several umbrellas")
    certify_mesh(at, closed=True, manifold=False)
    refused(box([[0, 1, 2], [0, 4, 5]]), "faces at vertex 0 form several")


def test_a_fin():
    corners = np.vstack([CORNERS, [2, 2, 2]])
    fin = box([*CUBE, [5, 7, 8]], corners)
    refused(fin, "has 3 faces")
    certify_mesh(fin, manifold=False)


def test_orientation():
    for i in range(12):
        turned = CUBE.copy()
        turned[i] = turned[i, ::-1]
        refused(box(turned), "not oriented: edge")
        certify_mesh(box(turned), closed=True, oriented=False)
    band = strip(7, twisted=True)
    angle = 2 * np.pi * (np.arange(14) // 2) / 7
    width = np.where(np.arange(14) % 2, 0.3, -0.3)
    half = angle / 2
    moebius = np.column_stack(
        [
            (2 + width * np.cos(half)) * np.cos(angle),
            (2 + width * np.cos(half)) * np.sin(angle),
            width * np.sin(half),
        ]
    )
    refused(Mesh.from_arrays(moebius, band), "not oriented")
    certify_mesh(Mesh.from_arrays(moebius, band), oriented=False, closed=False)


@pytest.mark.parametrize(
    ("parts", "right"),
    [
        ([cube(flip=True)], False),
        ([cube(), cube((3, 0, 0))], True),
        ([cube(size=3), cube((9, 0, 0), flip=True)], False),
        ([cube(size=3), cube((1, 1, 1), flip=True)], True),
        ([cube(size=3), cube((1, 1, 1))], False),
        ([cube(size=5), cube((1, 1, 1), 3, flip=True), cube((2, 2, 2))], True),
        ([cube(size=5), cube((1, 1, 1), 3, flip=True), cube((2, 2, 2), flip=True)], False),
        ([cube((2, 0.5, 0.5)), cube(), cube((-2, 0.5, 0.5))], True),
        # The ray from the middle of the first face of the cavity meets the diagonal of the wall beyond.
        ([cube(size=9), cube((2, 3, 5), 3, flip=True)], True),
        ([cube(size=9), cube((2, 3, 5), 3)], False),
    ],
)
def test_the_outside_is_in_front(parts, right):
    mesh = joined(*parts)
    if right:
        certify_mesh(mesh, closed=True)
    else:
        refused(mesh, "does not face outwards")


def test_a_sliver_of_a_solid_faces_outwards_to_the_last_bit():
    """Tetrahedra of a volume whose sign floats get wrong."""
    rng = np.random.default_rng(0)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    lost = 0
    for _ in range(20):
        flat = rng.normal(size=(4, 3))
        flat[3] = (flat[0] + flat[1] + flat[2]) / 3
        side = orient(*flat)
        lost += side != np.sign(np.linalg.det(flat[1:] - flat[0]))
        if side:
            certify(Mesh.from_arrays(flat, faces[:, ::side]))
            refused(Mesh.from_arrays(flat, faces[:, ::-side]), "does not face outwards")
    assert lost > 0


def test_embedding():
    refused(joined(cube(), cube((0.5, 0.5, 0.5))), "faces .* intersect", closed=True)
    certify_mesh(joined(cube(), cube((0.5, 0.5, 0.5))), closed=True, embedded=False)
    vertices, faces = torus()
    vertices[0] *= -0.75
    refused(Mesh.from_arrays(vertices, faces), "intersect", closed=True)


def test_vertices_are_input_points():
    points = np.vstack([[9, 9, 9], CORNERS])
    mesh = Mesh.from_arrays(CORNERS, CUBE, vertex_source=np.arange(1, 9))
    certify_mesh(mesh, points=points)
    made = Mesh.from_arrays(CORNERS, CUBE, vertex_source=[-1, *range(2, 9)])
    certify_mesh(made, points=points)
    refused(replace(mesh, vertex_source=np.arange(8)), "vertex 0 is not where input row 0 is", points=points)
    refused(replace(mesh, vertex_source=np.arange(2, 10)), "row 9 of 9", points=points)
    refused(replace(mesh, vertex_source=np.arange(8) - 2), "row -2", points=points)
