"""The labelling kernels against slow, obvious twins."""

import networkx
import numpy as np
import pytest

import recon
import weighting
from recon._kernels import components, energy, forest, sides, umbrellas
from recon.repair import excesses
from recon.repair import repair as mend
from recon.topology import topology

OUTWARD = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]


def cloud(seed: int, n: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Points of an ellipsoid and some inside, with their spacing."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(n, 3))
    x *= np.array([1.0, 0.7, 0.5]) / np.linalg.norm(x, axis=1)[:, None]
    x[: n // 6] *= rng.uniform(0.2, 0.9, (n // 6, 1))
    return x, weighting.spacing(x)


def labelled(seed: int, n: int = 60):
    """All that the kernels make of one cloud."""
    points, spacing = cloud(seed, n)
    weights = spacing**2
    triangulation = recon.regular_triangulation(points, weights)
    m = len(triangulation.cells)
    nodes, links = np.empty((2, m + np.count_nonzero(triangulation.neighbors < 0), 4), np.int32)
    rank, ghosts = np.arange(n, dtype=np.int32), len(nodes) - m
    for part in (0, m // 3), (m // 3, m):  # as on two threads
        sides.number_nodes(triangulation.cells, triangulation.neighbors, rank, *part, nodes, links)
    sides.close_hull(nodes, links, m, n)
    for part in (ghosts // 3, ghosts), (0, ghosts // 3):
        sides.link_ghosts(nodes, links, m, n, *part)
    cells = nodes[:m]
    centers, rho, depth = np.empty((m, 3)), np.empty(m), np.empty(m, np.float32)
    gate, leak = np.empty((m, 4), np.float32), np.empty((m, 4), bool)
    for part in (0, m // 3), (m // 3, m):
        sides.spheres(points, weights, spacing, cells, *part, centers, rho, depth)
    for part in (m // 3, m), (0, m // 3):
        sides.facet_sizes(points, weights, spacing, nodes, links, rho, *part, gate, leak)
    pole, anti, trust, normals = sides.poles(points, nodes, links, centers, rho, depth, m)
    return (
        points,
        weights,
        spacing,
        triangulation,
        nodes,
        links,
        centers,
        rho,
        depth,
        gate,
        leak,
        pole,
        anti,
        trust,
        normals,
    )


@pytest.mark.parametrize("seed", range(5))
def test_nodes_are_linked_across_the_facet_they_share(seed):
    nodes, links = labelled(seed)[4:6]
    for x in range(len(nodes)):
        assert len(set(nodes[x])) == 4
        for k in range(4):
            y = links[x, k]
            assert x in links[y]
            assert set(np.delete(nodes[x], k)) == set(np.delete(nodes[y], list(links[y]).index(x)))


@pytest.mark.parametrize("seed", range(5))
def test_nodes_are_the_cells_and_a_ghost_for_each_hull_facet(seed):
    triangulation, nodes = labelled(seed)[3:5]
    m, n = len(triangulation.cells), len(triangulation.points)
    assert (nodes[:m] == triangulation.cells).all()
    assert (nodes[:m] < n).all() and ((nodes[m:] == n).sum(axis=1) == 1).all()


@pytest.mark.parametrize("seed", range(5))
def test_orthocentres_have_one_power_distance_from_all_corners(seed):
    points, weights, spacing, _, nodes, _, centers, rho, depth, *_ = labelled(seed)
    for c, cell in enumerate(nodes[: len(rho)]):
        power = ((points[cell] - centers[c]) ** 2).sum(axis=1) - weights[cell]
        scale = max(abs(rho[c]), 1.0)
        np.testing.assert_allclose(power, rho[c], atol=1e-9 * scale)
        expected = np.sqrt(max(rho[c] + weights[cell].mean(), 0)) / spacing[cell].mean()
        assert depth[c] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_leaks_are_the_facets_that_enter_above_zero(seed):
    triangulation, nodes = labelled(seed)[3:5]
    leak = labelled(seed)[10]
    complex_ = recon.alpha_complex(triangulation)
    entry = np.where(complex_.attached(2), complex_.mu_lower(2), complex_.rho(2))
    enters = {tuple(facet): value for facet, value in zip(complex_.simplices(2), entry)}
    for c, cell in enumerate(nodes[: len(leak)]):
        for k in range(4):
            assert leak[c, k] == (enters[tuple(sorted(np.delete(cell, k)))] > 0)


@pytest.mark.parametrize("seed", range(3))
def test_antipoles_lie_opposite_to_poles(seed):
    points, *_, centers, rho, depth, gate, leak, pole, anti, trust, normals = labelled(seed)
    m = len(centers)
    for v in range(len(points)):
        if anti[v] >= 0 and pole[v] < m:
            assert (centers[pole[v]] - points[v]) @ (centers[anti[v]] - points[v]) < 0
            assert 0 < trust[v] <= min(depth[pole[v]], depth[anti[v]]) * 1.00001


def forest_twin(links, m, facets, keys, opposite, pole, anti, trust, sealed):
    """The signed forest by breadth-first parity in a plain graph, one piece of evidence at a time."""
    n_nodes = len(links)
    graph = networkx.Graph()
    graph.add_nodes_from(range(n_nodes))
    if sealed:
        for g in range(m + 1, n_nodes):
            graph.add_edge(m, g, odd=0)
    evidence = [
        (-float(key), 1, i, int(f) >> 2, int(links[f >> 2, f & 3]), int(opposite[i]))
        for i, (f, key) in enumerate(zip(facets, keys))
    ]
    evidence += [(-float(t), 2, v, int(pole[v]), int(anti[v]), 1) for v, t in enumerate(trust) if anti[v] >= 0]
    passed = 0
    for _, _, _, a, b, odd in sorted(evidence):
        if networkx.has_path(graph, a, b):
            path = networkx.shortest_path(graph, a, b)
            parity = sum(graph.edges[e]["odd"] for e in zip(path, path[1:])) % 2
            passed += odd == 1 and parity == 0
        else:
            graph.add_edge(a, b, odd=odd)
    side = {m: 0}
    for a, b in networkx.bfs_edges(graph, m):
        side[b] = side[a] ^ graph.edges[a, b]["odd"]
    return np.array([side[x] for x in range(n_nodes)], np.int8), passed


def roots(n_nodes: int, m: int, sealed: bool) -> np.ndarray:
    """The trees to begin with: every node alone, or all ghosts as one."""
    return 2 * np.minimum(np.arange(n_nodes), m if sealed else n_nodes).astype(np.int32)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("sealed", [True, False])
def test_signed_forest_takes_the_strongest_evidence_first(seed, sealed):
    *_, nodes, links, _, _, _, gate, _, pole, anti, trust, normals = labelled(seed, 40)
    m, N = len(gate), len(nodes)
    facets, keys = forest.facet_evidence(links, gate, roots(N, m, False))
    assert len(facets) == np.count_nonzero(links[:m] > np.arange(m)[:, None])
    opposite = (np.random.default_rng(seed).random(len(facets)) < 0.3).astype(np.uint8)
    poles = pole, anti, trust
    got, passed = forest.signed_forest(links, m, np.where(opposite, ~facets, facets), keys, *poles, roots(N, m, sealed))
    order = np.argsort(-keys, kind="stable")
    expected, expected_passed = forest_twin(links, m, facets[order], keys[order], opposite[order], *poles, sealed)
    np.testing.assert_array_equal(got, expected)
    assert passed == expected_passed


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("steps", [0, 3])
def test_first_trees_are_part_of_the_forest(seed, steps):
    """Also where many gates and trusts are equal (`steps`: so many values)."""
    *_, nodes, links, _, _, _, gate, _, pole, anti, trust, _ = labelled(seed, 300)
    if steps:
        gate, trust = np.ceil(gate * steps) / np.float32(steps), np.ceil(trust * steps) / np.float32(steps)
    m, N = len(gate), len(nodes)
    found = []
    for parent in roots(N, m, True), forest.first_trees(links, gate, pole, anti, trust):
        facets, keys = forest.facet_evidence(links, gate, parent)
        found.append((len(facets), *forest.signed_forest(links, m, facets, keys, pole, anti, trust, parent)))
    (all_facets, sides, passed), (few, same, as_many) = found
    np.testing.assert_array_equal(sides, same)
    assert passed == as_many and few < all_facets / 2


def energy_of(points, spacing, nodes, links, side):
    """The energy of a labelling by its definition, and the excess of every sample."""
    n = len(points)
    total = 0.0
    for x in range(len(nodes)):
        for k in range(4):
            y = links[x, k]
            if x < y and side[x] != side[y]:
                total += energy.wall.py_func(points, spacing, *np.delete(nodes[x], k))
    excess = np.zeros(n, int)
    pieces = networkx.Graph()
    pieces.add_nodes_from(range(len(nodes)))
    pieces.add_edges_from((x, y) for x in range(len(nodes)) for y in links[x] if side[x] == side[y])
    faces = []
    for x in range(len(nodes)):
        for k in range(4):
            if side[x] == 1 and side[links[x, k]] == 0:
                face = nodes[x][list(OUTWARD[k])]
                faces.append(face)
    for v in range(n):
        star = [x for x in range(len(nodes)) if v in nodes[x]]
        if not star:
            continue
        graph = networkx.Graph()
        graph.add_nodes_from(star)
        for x in star:
            for k in range(4):
                if nodes[x, k] != v and side[links[x, k]] == side[x]:
                    graph.add_edge(x, links[x, k])
        parts = list(networkx.connected_components(graph))
        seen = {int(side[next(iter(p))]) for p in parts}
        excess[v] = -1 if len(seen) < 2 else len(parts) - 2
        total += energy.BURIED if len(seen) < 2 else energy.PINCH * (len(parts) - 2)
    components = networkx.number_connected_components(pieces)
    chi = topology(np.array(faces)).euler if faces else 0
    return total + energy.TOPOLOGY * (2 * components - chi / 2), excess


@pytest.mark.parametrize("seed", range(6))
def test_repair_never_raises_the_energy_and_says_what_is_left(seed):
    points, _, spacing, _, nodes, links, _, _, _, gate, _, pole, anti, trust, normals = labelled(seed, 80)
    m, n, N = len(gate), len(points), len(nodes)
    parent = forest.first_trees(links, gate, pole, anti, trust)
    facets, keys = forest.facet_evidence(links, gate, parent)
    side, _ = forest.signed_forest(links, m, facets, keys, pole, anti, trust, parent)
    rng = np.random.default_rng(seed)
    side[:m] ^= rng.random(m) < 0.1  # damage to mend
    before, _ = energy_of(points, spacing, nodes, links, side)
    damaged = side.copy()
    parts = np.empty(N, np.int32), np.empty(N + 1, np.int64), np.empty(N, np.int32)
    pieces = components.number_components(links, side, *parts[:2]), *parts
    ground = points, spacing, nodes, links, gate, *umbrellas.star_lists(nodes, n)
    excess = excesses(ground, forest.facets_between(links, side, m, 0, m), np.inf, 1)
    excess, _ = mend(ground, side, (pole, anti, trust), excess, pieces, np.inf, 1 + seed % 2)
    after, expected = energy_of(points, spacing, nodes, links, side)
    np.testing.assert_array_equal(excess, expected)
    assert (side != damaged).any()
    # absorbing islands at the end may bury samples: an energy of their own
    assert after <= before + (excess < 0).sum() * energy.BURIED + 4 * energy.TOPOLOGY
    assert (side[m:] == 0).all()
