"""Meshes go to other libraries and come back as they were."""

import sys

import numpy as np
import pytest

import recon
from recon.stages import convert

pytestmark = pytest.mark.peers


def ball():
    points = np.random.default_rng(1).normal(size=(300, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def mesh():
    points = ball()
    attributes = {
        "colors": np.column_stack([np.arange(301) % 256, np.full(301, 9), np.full(301, 200), np.full(301, 255)]).astype(
            np.uint8
        ),
        "time": np.arange(301) * 1e6 + 0.1,
        "label": np.arange(301, dtype=np.uint16),
        "beam": np.arange(903.0).reshape(-1, 3),
    }
    cloud = np.concatenate([points[:1], points]) * 0.01 + [500_000.123, 4_649_776.25, 87.0]
    return recon.reconstruct(cloud, attributes=attributes, surface="closed").mesh


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "open3d"])
def test_everything_comes_back(library):
    pytest.importorskip(library)
    original = mesh()
    assert original.vertex_source[-1] == 300 and len(original.vertices) == 300
    options = {"tensor": True} if library == "open3d" else {}
    there = getattr(original, f"to_{library}")(**options)
    assert type(there).__module__.split(".")[0] == library
    back = getattr(recon.Mesh, f"from_{library}")(there)
    assert np.array_equal(back.vertices, original.vertices) and back.vertices.dtype == np.float64
    assert np.array_equal(back.faces, original.faces)
    assert np.array_equal(back.vertex_source, original.vertex_source)
    assert set(back.attributes) == set(original.attributes)
    for name, values in original.attributes.items():
        assert np.array_equal(back.attributes[name].reshape(values.shape), values)
        assert back.attributes[name].dtype == values.dtype


def test_meshlab_gives_back_what_it_can_hold():
    pytest.importorskip("pymeshlab")
    original = mesh()
    back = recon.Mesh.from_pymeshlab(original.to_pymeshlab(), ("time", "label", "beam"))
    assert np.array_equal(back.vertices, original.vertices) and np.array_equal(back.faces, original.faces)
    assert np.array_equal(back.vertex_source, original.vertex_source)
    assert set(back.attributes) == set(original.attributes)
    for name, values in original.attributes.items():
        assert np.array_equal(back.attributes[name], values), name


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "open3d", "pymeshlab"])
def test_a_reconstruction_goes_there_as_its_mesh_does(library):
    pytest.importorskip(library)
    result = recon.reconstruct(ball(), surface="closed")
    there = getattr(result, f"to_{library}")()
    assert type(there) is type(getattr(result.mesh, f"to_{library}")())
    back = getattr(recon.Mesh, f"from_{library}")(there)
    assert np.array_equal(back.vertices, result.mesh.vertices) and np.array_equal(back.faces, result.mesh.faces)


@pytest.mark.parametrize("library, extra", [("trimesh", "convert"), ("pyvista", "view"), ("meshio", "convert"), ("open3d", "open3d"), ("pymeshlab", "meshlab")])  # fmt: skip
def test_a_missing_library_is_named_in_one_line(library, extra, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    said = rf"^{library} is not installed; get it with: pip install 'weighted-alpha-recon\[{extra}\]'$"
    triangle = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]])
    for move in (getattr(triangle, f"to_{library}"), lambda: getattr(recon.Mesh, f"from_{library}")(object())):
        with pytest.raises(recon.MissingDependency, match=said):
            move()


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio"])
def test_the_other_side_owns_its_arrays(library):
    pytest.importorskip(library)
    original = mesh()
    there = getattr(convert, f"to_{library}")(original)
    before = original.vertices.copy()
    if library == "trimesh":
        there.vertices += 1
        assert there.is_watertight and there.is_winding_consistent and there.volume > 0
    else:
        there.points[:] += 1
    assert np.array_equal(original.vertices, before)


def test_what_is_no_triangle_mesh_is_refused():
    vista, meshio = pytest.importorskip("pyvista"), pytest.importorskip("meshio")
    with pytest.raises(recon.InvalidInput, match="other than triangles"):
        convert.from_pyvista(vista.Cube())
    with pytest.raises(recon.InvalidInput, match="quad"):
        convert.from_meshio(meshio.Mesh(np.zeros((4, 3)), [("quad", [[0, 1, 2, 3]])]))
    with pytest.raises(recon.InvalidInput, match="TriangleMesh"):
        convert.from_open3d(vista.Cube())
    for library in ("trimesh", "pyvista", "meshio"):
        with pytest.raises(recon.InvalidInput, match=rf"expected a {library}\.\w+, got ndarray"):
            getattr(convert, f"from_{library}")(np.zeros((3, 3)))


def test_points_and_lines_beside_the_triangles_are_left_behind():
    vista = pytest.importorskip("pyvista")
    corners = np.eye(4)[:, :3]
    other = vista.PolyData(corners, verts=[1, 0], lines=[2, 0, 1], faces=[3, 0, 1, 2, 3, 1, 3, 2])
    assert convert.from_pyvista(other).faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert len(convert.from_pyvista(vista.PolyData(corners)).faces) == 0


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "open3d", "pymeshlab"])
def test_a_mesh_of_nothing_stays_one_or_is_refused(library):
    pytest.importorskip(library)
    nothing = recon.Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    if library == "pymeshlab":
        with pytest.raises(recon.InvalidInput, match="no vertices"):
            nothing.to_pymeshlab()
        return
    back = getattr(recon.Mesh, f"from_{library}")(getattr(nothing, f"to_{library}")())
    assert back.vertices.shape == (0, 3) and back.faces.shape == (0, 3)


@pytest.mark.parametrize(
    "colors",
    [np.uint8([[255, 0, 51]]), np.uint16([[65535, 0, 13107]]), np.array([[1, 0, 0.2]]), np.float32([[1, 0, 0.2, 1]])],
)
def test_colours_mean_the_same_in_every_type(colors):
    pytest.importorskip("trimesh")
    triangle = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {"colors": np.repeat(colors, 3, axis=0)})
    assert np.array_equal(convert.to_trimesh(triangle).visual.vertex_colors, [[255, 0, 51, 255]] * 3)


def test_colours_that_are_none_are_refused():
    pytest.importorskip("trimesh")
    triangle = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {"colors": np.zeros(3)})
    with pytest.raises(recon.InvalidInput, match="colors"):
        convert.to_trimesh(triangle)


@pytest.mark.parametrize("library, options", [("open3d", {"tensor": True}), ("pymeshlab", {})])
def test_words_are_refused_where_only_numbers_fit(library, options):
    pytest.importorskip(library)
    triangle = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {"name": ["a", "b", "c"]})
    with pytest.raises(recon.InvalidInput, match=r"attribute 'name': .* holds numbers"):
        getattr(triangle, f"to_{library}")(**options)
