"""The MeshLab filter and the runner of filter scripts, tried as a user of PyMeshLab would."""

import subprocess
import sys

import numpy as np
import pytest

import recon
from recon.stages import meshlab as stage
from recon.stages import mlx

pytestmark = pytest.mark.peers
pymeshlab = pytest.importorskip("pymeshlab")

HEAD, TAIL = "<!DOCTYPE FilterScript>\n<FilterScript>\n", "\n</FilterScript>\n"


def sphere(n=600, seed=1):
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def layers(points, custom=None, **held):
    meshes = pymeshlab.MeshSet(verbose=False)
    mesh = pymeshlab.Mesh(points, **held)
    for name, values in (custom or {}).items():
        add = mesh.add_vertex_custom_scalar_attribute if values.ndim == 1 else mesh.add_vertex_custom_point_attribute
        add(values, name)
    meshes.add_mesh(mesh, "cloud")
    return meshes


def script(tmp_path, body):
    path = tmp_path / "script.mlx"
    path.write_text(HEAD + body + TAIL)
    return path


# The filter


def test_the_filter_is_a_method_and_makes_a_new_current_layer():
    meshes = layers(sphere())
    report = meshes.generate_weighted_alpha_shape(surface="Closed")
    assert meshes.mesh_number() == 2 and meshes.current_mesh_id() == 1
    assert meshes.current_mesh().label() == "Weighted Alpha Shape"
    assert meshes.current_mesh().face_number() == report["mesh"]["faces"] == 1196
    measures = meshes.get_topological_measures()
    assert measures["is_mesh_two_manifold"] and measures["boundary_edges"] == 0 and measures["genus"] == 0
    assert meshes.get_geometric_measures()["mesh_volume"] == pytest.approx(4 / 3 * np.pi, rel=0.03)
    assert meshes.mesh(0).face_number() == 0 and meshes.mesh(0).vertex_number() == 600


def test_colour_quality_normals_and_custom_attributes_come_with_their_points():
    points = sphere()
    shades = np.column_stack([np.arange(600) % 256, np.arange(600) // 256, np.full(600, 7), np.full(600, 200)]) / 255
    custom = {"radius": np.arange(600) / 7, "time": np.arange(600) * 1e6 + 0.1, "beam": points * 3}

    def twice(values):  # the second row is a duplicate, which no vertex comes from: rows shift
        return np.concatenate([values[:1], values])

    meshes = layers(
        twice(points),
        {name: twice(values) for name, values in custom.items()},
        v_color_matrix=twice(shades),
        v_scalar_array=twice(np.arange(600) * 1.1),
        v_normals_matrix=twice(points),
    )
    meshes.generate_weighted_alpha_shape(attributes="time, beam", surface="Closed")
    mesh = meshes.current_mesh()
    assert np.array_equal(mesh.vertex_matrix(), points)
    assert np.array_equal(mesh.vertex_color_matrix(), shades)
    assert np.array_equal(mesh.vertex_scalar_array(), np.arange(600) * 1.1)
    for name in ("radius", "time"):
        assert np.array_equal(mesh.vertex_custom_scalar_attribute_array(name), custom[name])
    assert np.array_equal(mesh.vertex_custom_point_attribute_matrix("beam"), custom["beam"])
    assert np.array_equal(mesh.vertex_custom_point_attribute_matrix("normals"), points)
    assert np.array_equal(mesh.vertex_custom_scalar_attribute_array("vertex_source"), [0, *range(2, 601)])


def test_utm_coordinates_keep_every_digit():
    points = sphere() * 0.01 + [500_000.123, 4_649_776.25, 87.0]
    meshes = layers(points)
    meshes.generate_weighted_alpha_shape()
    assert meshes.current_mesh().face_number() == 1196
    assert np.array_equal(meshes.current_mesh().vertex_matrix(), points)


def test_the_matrix_of_the_layer_is_applied():
    meshes = layers(sphere(), v_normals_matrix=sphere())
    meshes.set_matrix(
        transformmatrix=np.array([[0, -2, 0, 5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1.0]]), freeze=False
    )
    assert not np.array_equal(meshes.current_mesh().transform_matrix(), np.eye(4))
    meshes.generate_weighted_alpha_shape()
    made = meshes.current_mesh()
    x, y, z = sphere().T
    assert np.array_equal(made.vertex_matrix(), np.column_stack([5 - 2 * y, 2 * x, 2 * z]))
    directions = made.vertex_custom_point_attribute_matrix("normals")
    outward = (made.vertex_matrix() - [5, 0, 0]) / 2
    assert np.allclose(directions / np.linalg.norm(directions, axis=1)[:, None], outward)


def test_weights_are_radii_squared_by_attribute_by_quality_and_by_percentage():
    points, radius = sphere(), np.linspace(0.1, 0.3, 600)
    expected = recon.reconstruct(points, radius**2, surface="complex").mesh
    for options in (
        {"weights": "Radius attribute"},
        {"weights": "Radius attribute", "radiusattribute": "other"},
        {"weights": "Quality"},
    ):
        meshes = layers(points, {options.get("radiusattribute", "radius"): radius}, v_scalar_array=radius)
        meshes.generate_weighted_alpha_shape(surface="Complex", **options)
        assert np.array_equal(meshes.current_mesh().face_matrix(), expected.faces)
    diagonal = layers(points).current_mesh().bounding_box().diagonal()
    for length in (pymeshlab.PercentageValue(10), pymeshlab.PureValue(0.1 * diagonal), 0.1 * diagonal, "10%"):
        meshes = layers(points)
        meshes.generate_weighted_alpha_shape(weights="Uniform", radius=length, surface="Complex")
        uniform = recon.reconstruct(points, np.full(600, (0.1 * diagonal) ** 2), surface="complex").mesh
        assert np.array_equal(meshes.current_mesh().face_matrix(), uniform.faces)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"surfase": "Closed"}, "no parameter 'surfase'; did you mean 'surface'"),
        ({"Surface": "Closed"}, "no parameter 'Surface'; did you mean 'surface'"),
        ({"surface": "closed"}, "expected one of 'Auto', 'Closed', 'Open', 'Complex', 'Terrain'"),
        ({"surface": 5}, "expected one of"),
        ({"surface": True}, "expected one of"),
        ({"clean": 1}, "expected True or False"),
        ({"threads": 1.5}, "expected a whole number"),
        ({"threads": -1}, "expected 0"),
        ({"alpha": "0"}, "expected a finite number"),
        ({"alpha": float("nan")}, "expected a finite number"),
        ({"radius": "many%"}, "no percentage"),
        ({"radius": -1.0, "weights": "Uniform"}, "non-negative"),
        ({"weights": "Radius attribute"}, "no custom vertex attribute 'radius'"),
        ({"attributes": "time"}, "no custom vertex attribute 'time'"),
        ({"weights": "Quality"}, "radius of point 3 is no length: -1"),
    ],
)
def test_wrong_parameters_are_refused_and_nothing_is_added(options, message):
    quality = np.ones(600)
    quality[3] = -1
    meshes = layers(sphere(), v_scalar_array=quality)
    with pytest.raises(recon.InvalidInput, match=message):
        meshes.generate_weighted_alpha_shape(**options)
    assert meshes.mesh_number() == 1


def test_no_layer_no_points_no_surface_are_said():
    with pytest.raises(recon.InvalidInput, match="no layer"):
        pymeshlab.MeshSet().generate_weighted_alpha_shape()
    with pytest.raises(recon.InvalidInput, match="empty"):
        emptied = layers(sphere(9))
        emptied.set_selection_all()
        emptied.meshing_remove_selected_vertices()
        emptied.generate_weighted_alpha_shape()
    with pytest.raises(recon.DegenerateInput):
        layers(np.zeros((9, 3))).generate_weighted_alpha_shape()
    with pytest.raises(recon.InvalidInput, match=r"expected a pymeshlab\.MeshSet"):
        stage.generate_weighted_alpha_shape(sphere())


def test_a_mesh_goes_to_pymeshlab_and_back():
    mesh = recon.reconstruct(
        sphere(), attributes={"colors": np.full((600, 3), 51, np.uint8), "quality": np.arange(600.0), "t": sphere()}
    ).mesh
    back = stage.from_pymeshlab(stage.to_pymeshlab(mesh), ("t",))
    assert np.array_equal(back.vertices, mesh.vertices) and np.array_equal(back.faces, mesh.faces)
    assert np.array_equal(back.vertex_source, mesh.vertex_source)
    assert np.array_equal(back.attributes["colors"], np.tile(np.uint8([51, 51, 51, 255]), (600, 1)))
    assert np.array_equal(back.attributes["quality"], np.arange(600.0))
    assert np.array_equal(back.attributes["t"], sphere())
    with pytest.raises(recon.InvalidInput, match="attribute 'wide'"):
        stage.to_pymeshlab(recon.Mesh.from_arrays(sphere(9), [[0, 1, 2]], attributes={"wide": np.zeros((9, 5))}))


# Scripts


def test_ours_stands_among_stock_filters(tmp_path):
    path = tmp_path / "made.mlx"
    made = stage.FilterScript(
        [
            ("meshing_remove_duplicate_vertices", {}),
            ("Weighted Alpha Shape", {"surface": "Closed", "weights": "Uniform", "radius": 0.2, "alpha": 0.001}),
            ("apply_coord_laplacian_smoothing", {"stepsmoothnum": 1, "cotangentWeight": False}),
            ("Simplification: Quadric Edge Collapse Decimation", {"TargetFaceNum": 500}),
        ]
    )
    made.write(path)
    read = stage.FilterScript.read(path)
    assert read.filters == made.filters
    results = []
    for either in (path, made):
        meshes = layers(np.concatenate([sphere(), sphere()[:50]]))
        answers = stage.run_filter_script(meshes, either)
        assert answers[1]["input"] == {"points": 600, "duplicates": 0} and len(answers) == 4
        results.append((meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()))
    assert len(results[0][1]) == 500
    assert np.array_equal(results[0][0], results[1][0]) and np.array_equal(results[0][1], results[1][1])


def stock(meshes):
    """Filters with parameters of many types."""
    meshes.generate_alpha_shape(alpha=pymeshlab.PercentageValue(60), filtering="Alpha Shape")
    meshes.compute_color_perlin_noise_per_vertex(
        color1=pymeshlab.Color(10, 20, 30, 255), offset=np.array([0.5, 1.25, 2.0])
    )
    meshes.set_matrix(transformmatrix=np.array([[0, -1, 0, 0.5], [1, 0, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1.0]]))
    meshes.compute_scalar_by_function_per_vertex(q="x*x + 2", normalize=True)
    meshes.apply_coord_taubin_smoothing(lambda_=0.4, mu=-0.41, stepsmoothnum=2)
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=100, boundaryweight=0.75, preservenormal=True)
    meshes.get_hausdorff_distance(sampledmesh=0, targetmesh=1, samplenum=100)


def test_a_script_saved_by_pymeshlab_runs_unchanged(tmp_path):
    path = tmp_path / "saved.mlx"
    theirs, ours = layers(sphere(200)), layers(sphere(200))
    theirs.clear_filter_script()
    stock(theirs)
    theirs.save_filter_script(str(path))
    stage.run_filter_script(ours, path)
    assert ours.mesh_number() == theirs.mesh_number() == 2
    assert theirs.current_mesh().face_number() > 10
    # MeshLab writes lengths with six digits
    assert np.allclose(ours.current_mesh().vertex_matrix(), theirs.current_mesh().vertex_matrix(), atol=1e-5)
    assert np.array_equal(ours.current_mesh().face_matrix(), theirs.current_mesh().face_matrix())
    assert np.array_equal(ours.current_mesh().vertex_color_matrix(), theirs.current_mesh().vertex_color_matrix())
    assert np.array_equal(ours.current_mesh().transform_matrix(), theirs.current_mesh().transform_matrix())


def test_meshlab_runs_the_stock_part_of_what_we_write(tmp_path):
    saved, ours, again = (tmp_path / f"{name}.mlx" for name in ("saved", "ours", "again"))
    meshes = layers(sphere(200))
    meshes.clear_filter_script()
    stock(meshes)
    meshes.save_filter_script(str(saved))
    script = stage.FilterScript.read(saved)
    script.write(ours, diagonal=1.0)
    by_meshlab = layers(sphere(200))
    by_meshlab.load_filter_script(str(ours))
    by_meshlab.save_filter_script(str(again))
    assert stage.FilterScript.read(again).filters == script.filters  # MeshLab skipped nothing
    by_meshlab.apply_filter_script()
    assert by_meshlab.current_mesh().face_number() == meshes.current_mesh().face_number()


def test_names_of_files_survive_meshlabs_own_reader(tmp_path):
    made = stage.FilterScript(
        [
            ("Set Texture", {"textName": "t.png", "use_dummy_texture": True}),
            ("NXS Build", {"input_file": "a.ply", "output_file": "b.nxs"}),
        ]
    )
    made.write(tmp_path / "ours.mlx")
    meshes = layers(sphere(50))
    meshes.load_filter_script(str(tmp_path / "ours.mlx"))
    meshes.save_filter_script(str(tmp_path / "theirs.mlx"))
    assert stage.FilterScript.read(tmp_path / "theirs.mlx").filters == made.filters


def test_the_sample_script_of_pymeshlab_reads():
    from pathlib import Path

    path = Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / "sample_filter_script.mlx"
    if not path.exists():
        pytest.skip("this PyMeshLab comes without samples")
    meshes = pymeshlab.MeshSet(verbose=False)
    stage.run_filter_script(meshes, path)
    assert meshes.current_mesh().face_number() > 100


def test_the_shipped_clean_up_mends_what_it_says(tmp_path):
    ball, other = recon.reconstruct(sphere()).mesh, recon.reconstruct(sphere(8)).mesh
    faces = np.concatenate([ball.faces[1:], ball.faces[5:6], other.faces + 600])  # a hole, a duplicate, a small piece
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.concatenate([ball.vertices, other.vertices + 9]), faces))
    answers = stage.run_filter_script(meshes, stage.CLEAN_UP)
    assert {"closed_holes": 1, "new_faces": 1} in answers
    measures = meshes.get_topological_measures()
    assert measures["is_mesh_two_manifold"] and measures["boundary_edges"] == 0
    assert measures["connected_components_number"] == 1 and measures["faces_number"] == 1196
    by_meshlab = pymeshlab.MeshSet(verbose=False)
    by_meshlab.add_mesh(pymeshlab.Mesh(np.concatenate([ball.vertices, other.vertices + 9]), faces))
    by_meshlab.load_filter_script(str(stage.CLEAN_UP))
    by_meshlab.apply_filter_script()
    assert np.array_equal(by_meshlab.current_mesh().face_matrix(), meshes.current_mesh().face_matrix())


PARAM = '<filter name="Alpha Complex/Shape"><Param {} /></filter>'
ALPHA = 'name="alpha" type="RichAbsPerc" min="0" max="9"'


@pytest.mark.parametrize(
    "body, message",
    [
        ('<filter name="Alpha Complex Shape"/>', "no filter 'Alpha Complex Shape'; did you mean 'Alpha Complex/Shape'"),
        ('<filter name="generate_alpha_shape"/>', "no filter 'generate_alpha_shape'"),
        ("<filter/>", "no name"),
        ('<xmlfilter name="Alpha Complex/Shape"/>', "old versions"),
        ('<step name="Alpha Complex/Shape"/>', "expected <filter>"),
        (
            PARAM.format('name="filtering" type="RichEnum" value="1"'),
            "no parameter 'filtering'; did you mean 'Filtering'",
        ),
        (PARAM.format('name="alpha" type="RichFloat" value="1"'), "expected type 'RichAbsPerc', got 'RichFloat'"),
        (PARAM.format('name="alpha" value="1"'), "expected type 'RichAbsPerc', got None"),
        (PARAM.format(ALPHA + ' value="abc"'), "no RichAbsPerc: could not convert"),
        (PARAM.format(ALPHA + ' value="nan"'), "expected a length"),
        (PARAM.format(ALPHA), "no RichAbsPerc: 'value'"),
        (PARAM.format('name="Filtering" type="RichEnum" value="7"'), "expected one of 'Alpha Complex', 'Alpha Shape'"),
        (PARAM.format('name="Filtering" type="RichEnum" value="-1"'), "expected one of"),
        (
            '<filter name="Weighted Alpha Shape"><Param name="clean" type="RichBool" value="yes"/></filter>',
            "no RichBool",
        ),
        ('<filter name="Weighted Alpha Shape"><param name="clean"/></filter>', "expected <Param name"),
        (f'<filter name="Alpha Complex/Shape"><Param {ALPHA} value="1"/><Param {ALPHA} value="1"/></filter>', "twice"),
    ],
)
def test_what_meshlab_would_skip_is_an_error_before_anything_runs(tmp_path, body, message):
    meshes = layers(sphere(50))
    with pytest.raises(recon.InvalidInput, match=message) as caught:
        stage.run_filter_script(meshes, script(tmp_path, '<filter name="Duplicate Current layer"/>' + body))
    assert str(tmp_path) in str(caught.value) and "\n" not in str(caught.value)
    assert meshes.mesh_number() == 1


@pytest.mark.parametrize("text", ["", "<FilterScript>", "<MeshLabProject/>", "\x00\x01"])
def test_what_is_no_script_is_refused(tmp_path, text):
    path = tmp_path / "wrong.mlx"
    path.write_text(text)
    with pytest.raises(recon.InvalidInput, match="not a filter script"):
        stage.FilterScript.read(path)
    with pytest.raises(recon.InvalidInput, match="No such file"):
        stage.FilterScript.read(tmp_path / "none.mlx")


def test_a_failing_filter_is_named(tmp_path):
    meshes = layers(sphere(50))
    body = '<filter name="Duplicate Current layer"/><filter name="Close Holes"/>'
    with pytest.raises(recon.StageError, match=r"^filter 1, 'Close Holes': ") as caught:
        stage.run_filter_script(meshes, script(tmp_path, body))
    assert isinstance(caught.value.__cause__, pymeshlab.PyMeshLabException) and "\n" not in str(caught.value)
    with pytest.raises(recon.StageError, match="filter 0, 'Close Holes': there is no layer"):
        stage.run_filter_script(pymeshlab.MeshSet(), script(tmp_path, '<filter name="Close Holes"/>'))
    with pytest.raises(recon.DegenerateInput, match=r"^filter 0, 'Weighted Alpha Shape': "):
        stage.run_filter_script(layers(np.zeros((9, 3))), stage.FilterScript([("Weighted Alpha Shape", {})]))


def test_percentages_are_kept_until_a_mesh_is_there(tmp_path):
    made = stage.FilterScript([("Weighted Alpha Shape", {"weights": "Uniform", "radius": "10%"})])
    with pytest.raises(recon.InvalidInput, match="diagonal"):
        made.write(tmp_path / "a.mlx")
    assert not (tmp_path / "a.mlx").exists()
    made.write(tmp_path / "a.mlx", diagonal=3.0)
    assert stage.FilterScript.read(tmp_path / "a.mlx").filters[0][1]["radius"] == pytest.approx(0.3)


def test_names_in_text_are_escaped(tmp_path):
    made = stage.FilterScript([("Weighted Alpha Shape", {"radiusattribute": 'a<b>&"ü'})])
    made.write(tmp_path / "a.mlx")
    assert stage.FilterScript.read(tmp_path / "a.mlx").filters == made.filters


def test_the_table_knows_pymeshlabs_filters_and_parameters():
    known = set(pymeshlab.filter_list())
    meshes = layers(sphere(20))
    meshes.create_cube()
    checked = 0
    for name, entry in mlx.filters().items():
        if name == mlx.FILTER or entry["filter"] not in known:
            continue
        try:
            theirs = meshes.filter_parameter_values(entry["filter"])
        except pymeshlab.MissingComponentException:
            continue  # asks for more than these layers have
        assert sorted(theirs) == sorted(map(mlx.python_name, entry["parameters"])), name
        checked += 1
    assert checked > 200


def test_without_pymeshlab_scripts_still_read_and_one_line_says_what_to_install(tmp_path):
    code = (
        "import sys; sys.modules['pymeshlab'] = None\n"
        "import recon, recon.stages.meshlab as stage\n"
        "print(len(stage.FilterScript.read(stage.CLEAN_UP)))\n"
        "try: stage.run_filter_script(None, stage.CLEAN_UP)\n"
        "except recon.MissingDependency as error: print(error)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert out.stdout.splitlines() == [
        "6",
        "pymeshlab is not installed; get it with: pip install 'weighted-alpha-recon[meshlab]'",
    ], out.stderr
