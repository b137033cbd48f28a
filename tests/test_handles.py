"""Thin handles: the loops around them, and what is cut."""

import re

import numpy as np
import pytest
from click.testing import CliRunner

import datasets_synthetic
import recon
import weighting
from recon._kernels import energy
from recon._kernels.least_walls import least_walls
from recon.cli import main
from recon.handles import EDGES, _beyond_disks, _loops, cut_thin_handles
from recon.repair import excesses
from recon.surface import _Evidence
from recon.topology import topology


def torus_faces(a: int, b: int) -> np.ndarray:
    """Triangles of a grid of a by b vertices, joined at its ends."""
    i, j = np.divmod(np.arange(a * b), b)
    right, up = (i + 1) % a * b + j, i * b + (j + 1) % b
    both = (i + 1) % a * b + (j + 1) % b
    here = np.arange(a * b)
    return np.r_[np.stack([here, right, both]).T, np.stack([here, both, up]).T]


def parts_after_cutting(faces: np.ndarray, loop: np.ndarray) -> int:
    """Pieces of a surface that no edge of a loop joins any more."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    on_loop = {tuple(sorted(pair)) for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)}
    assert on_loop <= set(map(tuple, edges.tolist()))
    joins = [k for k in range(0, len(edges), 2) if tuple(edges[k]) not in on_loop]
    links = coo_matrix((np.ones(len(joins)), (owner[joins], owner[np.array(joins) + 1])), shape=(len(faces),) * 2)
    return connected_components(links, directed=False)[0]


@pytest.mark.parametrize(("a", "b"), [(30, 5), (5, 30), (7, 5), (6, 6), (20, 8), (20, 9)])
def test_loops_are_the_shortest_through_their_vertices(a, b):
    """Around the tube b edges, along it a: one loop of each class that is shortest somewhere."""
    faces = torus_faces(a, b)
    loops = _loops(faces, np.ones(a * b, bool))
    assert bool(loops) == (min(a, b) <= EDGES)
    for loop in loops:
        assert len(loop) == min(a, b)
        assert len(set(loop.tolist())) == len(loop)
        assert parts_after_cutting(faces, loop) == 1


@pytest.mark.parametrize(("width", "around"), [(1, True), (3, True), (3, False)])
def test_loops_among_some_vertices_know_the_whole_surface(width, around):
    """A strip once around the tube of a torus has one class of loops; with the torus cut open and closed by two disks, none."""
    a, b = 12, 6
    faces = torus_faces(a, b)
    among = np.arange(a * b) < width * b
    if not around:  # without the rings 8 to 10, whose neighbours get a vertex each in their place
        faces = faces[~((faces >= 8 * b) & (faces < 11 * b)).any(axis=1)]
        for ring, top in ((np.arange(7 * b, 8 * b), a * b), (np.arange(11 * b, 12 * b)[::-1], a * b + 1)):
            faces = np.r_[faces, np.stack([ring, np.roll(ring, -1), np.full(b, top)]).T]
        among = np.append(among, [False, False])
    t = topology(faces)
    assert t.closed and t.euler == (0 if around else 2)
    loops = _loops(faces, among)
    assert [len(loop) for loop in loops] == ([b] if around else [])
    assert all(among[loop].all() for loop in loops)


def test_a_sphere_has_no_loops_however_thin_its_neck():
    """A tube of three edges around, closed at both ends: every loop parts it."""
    ring = np.arange(30).reshape(10, 3)
    walls = [[ring[k, j], ring[k, (j + 1) % 3], ring[k + 1, j]] for k in range(9) for j in range(3)]
    walls += [[ring[k + 1, j], ring[k, (j + 1) % 3], ring[k + 1, (j + 1) % 3]] for k in range(9) for j in range(3)]
    faces = np.array([*walls, ring[0][::-1], ring[-1]])
    assert topology(faces).euler == 2
    assert _loops(faces, np.ones(30, bool)) == []
    assert _beyond_disks(faces, np.ones(30, bool)).all()
    assert not _beyond_disks(faces, np.arange(30) < 2).any()


def test_an_annulus_on_a_torus_is_no_disk():
    faces = torus_faces(12, 6)
    assert (_beyond_disks(faces, np.arange(72) < 6) == (np.arange(72) < 6)).all()  # once around the tube
    assert not _beyond_disks(faces, np.arange(72) < 5).any()


def test_thin_handles_between_parts_that_pass_close_by_are_cut():
    truth, right = datasets_synthetic.surface("csg_part"), 0
    for seed in range(6):
        result = recon.reconstruct(truth.sample(2000, rng=seed).points, surface="closed", denoise=False)
        t = topology(result.mesh.faces)
        assert t.closed and t.manifold and t.oriented
        right += t.euler == truth.euler
    assert right >= 5


def bowl(samples: int, thick: float, seed: int) -> np.ndarray:
    """A hemisphere with a wall so many spacings thick, and a flat rim."""
    h = np.sqrt(2 * np.pi / samples)
    inner = 1 - thick * h
    parts = []
    for radius, stream in ((1.0, seed), (inner, seed + 100)):
        ball = datasets_synthetic.surface("sphere").sample(int(2 * samples * radius**2), spacing="blue", rng=stream)
        parts.append(radius * ball.points[ball.points[:, 2] < 0])
    rng = np.random.default_rng(seed)
    rim = rng.uniform(inner**2, 1, int(np.pi * (1 - inner**2) / h**2)) ** 0.5
    turn = rng.uniform(0, 2 * np.pi, len(rim))
    return np.concatenate([*parts, np.c_[rim * np.cos(turn), rim * np.sin(turn), 0 * rim]])


def test_tunnels_through_a_thin_wall_are_closed():
    """Gaps between samples are as wide as the wall is thick, and make two tunnels or three."""
    right = 0
    for seed in range(6):
        mesh = recon.reconstruct(bowl(3000, 1.6, seed), surface="closed").mesh
        right += topology(mesh.faces).euler == 2
    assert right >= 5


def test_what_is_left_of_tunnels_is_told():
    wrong = 0
    for seed in range(6):
        result = recon.reconstruct(bowl(3000, 1.2, seed), surface="closed")
        genus = 1 - topology(result.mesh.faces).euler // 2
        wrong += genus > 0
        assert genus <= len(result.thin_loops) == result.report["surface"]["thin_loops"]
    assert wrong > 0


@pytest.mark.parametrize(("hole", "told"), [(0.1, 1), (0.4, 0)])
def test_a_narrow_bore_is_told_and_a_wide_one_is_not(hole, told):
    """A bore of 0.1 is some three spacings wide."""
    truth = datasets_synthetic.surface("torus", major=0.5 + hole / 2, minor=0.5 - hole / 2)
    points = truth.sample(3000, rng=0).points
    result = recon.reconstruct(points)
    assert topology(result.mesh.faces).euler == 0
    assert len(result.thin_loops) == told
    for loop in result.thin_loops:
        around = points[loop][:, :2]
        np.testing.assert_allclose(np.linalg.norm(around, axis=1), hole, atol=0.02)  # next to the bore at its narrowest
        turns = np.angle((around @ [1, 1j]) / (np.roll(around, 1, axis=0) @ [1, 1j])).sum() / (2 * np.pi)
        assert abs(turns) == pytest.approx(1)


def test_the_command_line_says_where(tmp_path):
    np.savetxt(tmp_path / "bowl.xyz", bowl(3000, 1.2, 0))
    run = CliRunner().invoke(
        main, ["reconstruct", str(tmp_path / "bowl.xyz"), str(tmp_path / "bowl.ply"), "--surface", "closed"]
    )
    assert run.exit_code == 0, run.output
    line = next(line for line in run.output.splitlines() if "doubtful" in line)
    places = np.array([[float(x) for x in place.split(",")] for place in re.findall(r"\(([^)]*)\)", line)])
    assert len(places) and ((places[:, 2] < 0.1) & (np.linalg.norm(places, axis=1) > 0.8)).all()  # in the wall


@pytest.mark.parametrize("surface", ["open", "complex"])
def test_of_other_surfaces_no_loops_are_told(surface):
    assert recon.reconstruct(bowl(1000, 1.2, 0), surface=surface).thin_loops == ()


@pytest.mark.parametrize("name", ["torus", "genus_2", "genus_3", "linked_tori"])
def test_handles_that_samples_show_stay(name):
    truth = datasets_synthetic.surface(name)
    result = recon.reconstruct(truth.sample(1500, rng=2).points, surface="closed")
    assert topology(result.mesh.faces).euler == truth.euler


def test_cutting_keeps_the_books():
    """Samples pinched and buried are counted along; what is not cut stays as it was."""
    points = np.random.default_rng(3).normal(size=(800, 3))  # nothing but thin handles
    points /= 1 + 0.05 * np.linalg.norm(points, axis=1)[:, None]
    evidence = _Evidence(recon.regular_triangulation(points), weighting.spacing(points), True, 1)
    sides, _ = evidence.closed_sides()
    ground = evidence.ground
    excess = excesses(ground, evidence.between(sides), np.inf, 1)
    before, given = sides.copy(), excess.copy()
    grown, _ = cut_thin_handles(ground, sides, evidence.poles, excess, 1)
    assert (excess == excesses(ground, evidence.between(sides), np.inf, 1)).all()
    assert (excess < 0).sum() + excess[excess > 0].sum() <= (given < 0).sum() + given[given > 0].sum()
    assert grown > 0
    assert (before != sides).any()


@pytest.mark.parametrize("seed", range(12))
def test_least_walls_are_those_of_all_ways_to_choose(seed):
    """Ten cells next to each other, two of them held, some tied: 256 ways, of which the best is unique."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(60, 3))
    evidence = _Evidence(recon.regular_triangulation(points), weighting.spacing(points), True, 1)
    nodes, links, m = evidence.nodes, evidence.links, len(evidence.cells)
    sides = (rng.random(len(nodes)) < 0.5).astype(np.int8)
    near = [int(rng.integers(m))]
    while len(near) < 10:
        beside = [y for y in links[near[rng.integers(len(near))]] if y < m and y not in near]
        near += [int(beside[0])] if beside else []
    ties = np.where(np.arange(10) < 2, np.inf, rng.choice([0.0, 0.1, 0.3], 10))
    number = np.full(len(nodes), -1)
    number[near] = np.arange(10)

    def walls(labels: np.ndarray) -> float:
        facets = evidence.between(labels)
        return sum(energy.wall(evidence.points, evidence.spacing, *face) for face in evidence.faces(facets))

    costs = {}
    for choice in range(256):
        labels = sides.copy()
        labels[np.array(near)[2:]] = choice >> np.arange(8) & 1
        costs[choice] = walls(labels) + ties[labels[near] != sides[near]].sum()
    labels = sides.copy()
    for x in least_walls(evidence.ground, sides, number, np.array(near), ties):
        labels[x] ^= 1
    np.testing.assert_array_equal(labels[near[:2]], sides[near[:2]])
    assert walls(labels) + ties[labels[near] != sides[near]].sum() == pytest.approx(min(costs.values()), rel=1e-12)
