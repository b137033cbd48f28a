"""Whatever is given to a stage, the answer is a result or one line of ours; numbers of numpy's are numbers."""

import math
from fractions import Fraction

import numpy as np
import pytest

import datasets_synthetic
import recon
from recon.contracts import ReconError

pytestmark = pytest.mark.peers

GARBAGE = {
    "text": "0.5",
    "bytes": b"1",
    "none": None,
    "flag": True,
    "numpy flag": np.bool_(True),
    "nan": math.nan,
    "infinite": -math.inf,
    "negative": -1,
    "huge": 10**400,
    "large": 1e300,
    "complex": 1j,
    "array": np.ones(3),
    "square": np.ones((2, 2)),
    "objects": np.array([object()]),
    "date": np.datetime64("2020-01-01"),
    "list": [0.5],
    "dict": {},
    "set": {1},
    "object": object(),
    "type": int,
}
NUMBERS = [
    0.25,
    np.float64(0.25),
    np.float32(0.25),
    np.float16(0.25),
    np.longdouble(0.25),
    np.array(0.25),
    Fraction(1, 4),
]
WHOLES = [2, np.int64(2), np.uint8(2), np.array(2)]


@pytest.fixture(scope="module")
def points():
    return datasets_synthetic.surface("sphere").sample(60, rng=0).points.copy()


@pytest.fixture
def pcd(points):
    o3d = pytest.importorskip("open3d")
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


@pytest.fixture
def mesh_set(points):
    meshlab = pytest.importorskip("pymeshlab")
    meshes = meshlab.MeshSet(verbose=False)
    meshes.add_mesh(meshlab.Mesh(points))
    return meshes


def assert_refused_in_a_line(call, *values):
    """Some of it may be taken; nothing else than an error of ours may come of the rest."""
    refused = 0
    for value in values or GARBAGE.values():
        try:
            call(value)
        except ReconError as error:
            assert 0 < len(str(error)) < 400 and "\n" not in str(error), str(error)
            refused += 1
    assert refused > len(values or GARBAGE) // 2


@pytest.mark.filterwarnings("ignore:no triangle at alpha")
@pytest.mark.parametrize("parameter", ["pcd", "alpha"])
def test_the_twin_of_open3ds_function_refuses_garbage(pcd, parameter):
    from recon.stages.open3d import create_from_point_cloud_alpha_shape as shape

    assert_refused_in_a_line(lambda value: shape(**{"pcd": pcd, "alpha": 0.5, parameter: value}))
    for value in ("0.5", None, True, np.ones(3), [0.5]):
        with pytest.raises(recon.InvalidInput, match=r"^alpha: expected a non-negative radius, got "):
            shape(pcd, value)


@pytest.mark.parametrize("parameter", ["pcd", "weights", "alpha", "surface", "clean", "denoise", "threads", "progress"])
def test_the_open3d_stage_refuses_garbage(pcd, parameter):
    from recon.stages.open3d import create_from_point_cloud_weighted_alpha_shape as stage

    values = [v for k, v in GARBAGE.items() if parameter != "progress" or k != "type"]  # a type can be called
    assert_refused_in_a_line(lambda value: stage(**{"pcd": pcd, parameter: value}), *values)


def test_the_rest_of_the_open3d_door_refuses_garbage(pcd, points):
    from recon.stages import open3d, open3d_slider

    mesh = recon.Mesh.from_arrays(points, [[0, 1, 2]])
    shapes = open3d_slider.alpha_shapes(pcd, steps=3)
    for call in (
        open3d.from_point_cloud,
        open3d.to_open3d,
        open3d.from_open3d,
        lambda value: open3d.to_open3d(mesh, tensor=value),
        lambda value: open3d.Step(value)(pcd),
        lambda value: open3d.Pipeline(open3d.Step("voxel_down_sample", 0.1))(value),
        lambda value: open3d.Pipeline(open3d.Step("voxel_down_sample", value))(pcd),
        open3d_slider.alpha_shapes,
        lambda value: open3d_slider.alpha_shapes(pcd, value),
        lambda value: open3d_slider.alpha_shapes(pcd, steps=value),
        shapes.parts,
    ):
        assert_refused_in_a_line(call, *[v for k, v in GARBAGE.items() if k != "large"])
    assert_refused_in_a_line(open3d.Pipeline, *[v for k, v in GARBAGE.items() if k != "type"])


def test_the_meshlab_filter_refuses_garbage(mesh_set):
    from recon.stages.meshlab import generate_weighted_alpha_shape
    from recon.stages.mlx import PARAMETERS

    for parameter in PARAMETERS:
        assert_refused_in_a_line(
            lambda value, name=parameter: (
                generate_weighted_alpha_shape(mesh_set, surface="Open", **{name: value})
                if name != "surface"
                else generate_weighted_alpha_shape(mesh_set, surface=value)
            )
        )
    assert_refused_in_a_line(generate_weighted_alpha_shape)


def test_filter_scripts_refuse_garbage(mesh_set, tmp_path):
    from recon.stages.meshlab import CLEAN_UP, FilterScript, from_pymeshlab, run_filter_script, to_pymeshlab
    from recon.stages.mlx import FILTER, filters

    percent = FilterScript([(FILTER, {"radius": "1%"})])
    for call in (
        FilterScript,
        lambda value: FilterScript([value]),
        lambda value: FilterScript([(value, {})]),
        lambda value: FilterScript([(FILTER, value)]),
        FilterScript.read,
        lambda value: percent.write(tmp_path / "script.mlx", diagonal=value),
        lambda value: run_filter_script(value, CLEAN_UP),
        lambda value: run_filter_script(mesh_set, value),
        to_pymeshlab,
        from_pymeshlab,
        lambda value: from_pymeshlab(mesh_set.current_mesh(), value),
    ):
        assert_refused_in_a_line(call)
    assert_refused_in_a_line(
        lambda value: percent.write(value), *[v for v in GARBAGE.values() if not isinstance(v, str)]
    )
    first = {str(kind): (name, key) for name, entry in filters().items() for key, kind in entry["parameters"].items()}
    for name, key in first.values():
        assert_refused_in_a_line(lambda value, name=name, key=key: FilterScript([(name, {key: value})]))


@pytest.mark.parametrize("library", ["trimesh", "pyvista", "meshio", "open3d", "pymeshlab"])
def test_converters_refuse_garbage_and_attributes_that_do_not_fit(library):
    from recon.stages import convert

    pytest.importorskip(library)
    assert_refused_in_a_line(getattr(convert, f"to_{library}"))
    assert_refused_in_a_line(getattr(convert, f"from_{library}"))
    for name in ("colors", "normals", "quality", "other"):
        for values in (
            np.ones((3, 0)), np.ones((3, 2)), np.ones((3, 3, 3)), np.ones(3, np.float16), np.ones(3, np.longdouble), np.ones(3) * 1j,
            np.array(["a"] * 3), np.array([object()] * 3), np.array(["2020-01-01"] * 3, "M8[D]"), np.zeros(3, [("a", "f4")]),
        ):  # fmt: skip
            mesh = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {name: values})
            try:
                getattr(mesh, f"to_{library}")()
            except ReconError as error:
                assert "\n" not in str(error) and name.rstrip("s") in str(error)


def test_arrays_of_a_mesh_refuse_garbage():
    for call in (
        lambda value: recon.Mesh.from_arrays(value, [[0, 1, 2]]),
        lambda value: recon.Mesh.from_arrays(np.eye(3), value),
        lambda value: recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, value),
        lambda value: recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {"a": value}),
        lambda value: recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], [value] * 3),
    ):
        assert_refused_in_a_line(call)


def test_names_of_attributes_are_text():
    with pytest.raises(recon.InvalidInput, match="attributes: expected text as name, got 3"):
        recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]], None, {3: [1, 2, 3]})


def test_no_open_file_is_taken_for_a_path(tmp_path):
    from recon.stages.mlx import FilterScript

    with open(tmp_path / "some", "w+") as file:
        for number in (file.fileno(), np.int64(file.fileno())):
            with pytest.raises(recon.InvalidInput, match="expected a path"):
                FilterScript.read(number)
        file.write("still open")


def test_numbers_of_numpys_are_numbers(pcd, mesh_set):
    from recon.stages import open3d, open3d_slider
    from recon.stages.meshlab import generate_weighted_alpha_shape

    by_radius = {len(open3d.create_from_point_cloud_alpha_shape(pcd, value * 4).triangles) for value in NUMBERS}
    by_alpha = {
        len(open3d.create_from_point_cloud_weighted_alpha_shape(pcd, alpha=value, surface="complex").triangles)
        for value in NUMBERS
    }
    assert len(by_radius) == len(by_alpha) == 1 and min(by_radius | by_alpha) > 0
    faces = set()
    for value in NUMBERS:
        generate_weighted_alpha_shape(
            mesh_set, alpha=value, surface="Complex", clean=np.bool_(True), threads=np.uint8(1)
        )
        faces.add(mesh_set.current_mesh().face_number())
        mesh_set.set_current_mesh(0)
    assert faces == by_alpha
    for value in WHOLES:
        open3d.create_from_point_cloud_weighted_alpha_shape(
            pcd, threads=value, clean=np.bool_(False), denoise=np.bool_(False)
        )
        assert len(open3d_slider.alpha_shapes(pcd, steps=value).alphas) >= 2


@pytest.mark.parametrize(
    "parameter", ["points", "weights", "mesh", "reference", "alpha", "attributes", "title", "note"]
)
def test_the_view_page_refuses_garbage(points, parameter):
    from recon.page import view_page

    values = [value for value in GARBAGE.values() if value is not None]
    assert_refused_in_a_line(lambda value: view_page(**{"points": points[:20], parameter: value}), *values)


@pytest.mark.parametrize("parameter", ["result", "points", "title", "options", "reference", "progress"])
def test_the_report_page_refuses_garbage(points, parameter):
    from recon.page import report_page

    result = recon.reconstruct(points)
    values = [v for k, v in GARBAGE.items() if k not in ("none", "dict", "infinite", "type")]
    assert_refused_in_a_line(
        lambda value: report_page(**{"result": result, "points": points, parameter: value}), *values
    )


def test_colours_that_do_not_fit_the_points_are_refused_and_others_of_that_name_are_left(points):
    from recon.page import view_page

    with pytest.raises(recon.InvalidInput, match="'colors': expected 60 rows"):
        view_page(points, attributes={"colors": np.ones((59, 3))})
    assert "own colours" in view_page(points, attributes={"colors": [[1, 2, 3]] * 60})
    assert "own colours" not in view_page(points, attributes={"colors": np.array([["a"] * 3] * 60)})


@pytest.mark.parametrize("tensor", [False, True])
def test_attributes_without_a_row_for_every_point_are_refused(points, tensor):
    o3d = pytest.importorskip("open3d")
    from recon.stages import open3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    if tensor:
        cloud = o3d.t.geometry.PointCloud.from_legacy(cloud)
        cloud.point["colors"] = o3d.core.Tensor(points[:10])
    else:
        cloud.colors = o3d.utility.Vector3dVector(points[:10])
    for take in (
        open3d.create_from_point_cloud_weighted_alpha_shape,
        lambda pcd: open3d.create_from_point_cloud_alpha_shape(pcd, 1.0),
    ):
        with pytest.raises(recon.InvalidInput, match="'colors': expected 60 rows, got shape"):
            take(cloud)


@pytest.mark.parametrize("rows", [[0.5, 1, 2], [math.nan, 1, 2], ["a", "b", "c"], [math.inf, 0, 0]])
def test_input_rows_that_are_no_rows_are_refused(rows):
    meshio = pytest.importorskip("meshio")
    theirs = meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])], point_data={"vertex_source": np.array(rows)})
    with pytest.raises(recon.InvalidInput, match="vertex_source: expected row numbers"):
        recon.Mesh.from_meshio(theirs)


def test_a_path_that_cannot_be_one_is_refused():
    from recon.stages.mlx import FilterScript

    with pytest.raises(recon.InvalidInput, match="null byte"):
        FilterScript.read("a\0b")


def test_the_alpha_shape_of_a_cloud_of_the_smallest_numbers_is_its_hull(points):
    faces = recon.alpha_shape(points * 2.0**-1000, 0.5).faces
    assert np.array_equal(faces, recon.alpha_shape(points, math.inf).faces)
