"""What is written is read back to the last bit; what others write is read right."""

import io
import json
import os
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import recon
from recon.io import formats, lzf
from recon.io.files import whole_file

UTM = np.array([[512700.8751234567, 5403547.5009876543, 295.25], [512834.75, 5403850.000000001, 404.0799865722656]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32)
MESH_FORMATS = ("ply", "obj", "off", "stl")


@pytest.fixture
def mesh(rng):
    vertices = rng.normal(size=(4, 3)) + UTM[0]
    normals = rng.normal(size=(4, 3))
    attributes = {
        "normals": normals / np.linalg.norm(normals, axis=1, keepdims=True),
        "colors": rng.integers(0, 256, (4, 3), dtype=np.uint8),
        "quality": rng.normal(size=4),
        "class": np.array([1, 2, 3, 65535], np.uint16),
        "feature": rng.normal(size=(4, 5)).astype(np.float32),
    }
    return recon.Mesh.from_arrays(vertices, TETRAHEDRON, [7, 3, -1, 9], attributes)


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def save(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def points_of(path, content, **options):
    return recon.read_points(save(path, content), **options)


# ---- what we write


def test_ply_gives_back_every_bit_and_every_type(tmp_path, mesh):
    assert recon.write_mesh(mesh, tmp_path / "m.ply") == ()
    back = recon.read_mesh(tmp_path / "m.ply")
    assert back.vertices.tobytes() == mesh.vertices.tobytes()
    assert back.faces.tobytes() == mesh.faces.tobytes()
    assert back.vertex_source.tolist() == [7, 3, -1, 9]
    assert set(back.attributes) == set(mesh.attributes)
    for key, value in mesh.attributes.items():
        assert back.attributes[key].dtype == value.dtype
        assert back.attributes[key].tobytes() == value.tobytes(), key


@pytest.mark.parametrize("extension", MESH_FORMATS)
def test_no_mesh_format_but_glb_loses_a_bit_of_a_coordinate(tmp_path, mesh, extension):
    path = tmp_path / f"m.{extension}"
    lost = recon.write_mesh(mesh, path)
    back = recon.read_mesh(path)
    assert np.array_equal(back.vertices[back.faces], mesh.vertices[mesh.faces])
    assert set(lost) == set(mesh.attributes) - set(back.attributes)


@given(
    hnp.arrays(np.float64, (5, 3), elements=st.floats(-1e100, 1e100, allow_subnormal=True)),
    st.sampled_from(["ply", "xyz", "csv", "npy", "npz"]),
)
@settings(max_examples=60, deadline=None)
def test_points_come_back_to_the_last_bit(tmp_path_factory, points, extension):
    path = tmp_path_factory.mktemp("io") / f"p.{extension}"
    recon.write_points(points, path)
    back = recon.read_points(path)
    assert back.points.tobytes() == points.tobytes()
    assert not back.attributes


@pytest.mark.parametrize("extension", ["xyz", "csv", "ply", "npz"])
def test_attributes_of_points_come_back(tmp_path, mesh, extension):
    lost = recon.write_points(mesh.vertices, tmp_path / f"p.{extension}", attributes=mesh.attributes)
    back = recon.read_points(tmp_path / f"p.{extension}")
    assert lost == ()
    assert set(back.attributes) == set(mesh.attributes)
    for key, value in mesh.attributes.items():
        assert np.array_equal(back.attributes[key], value), key
    assert back.attributes["colors"].dtype == np.uint8


@pytest.mark.parametrize(
    ("value", "read_as"),
    [
        (np.array([True, False]), "u1"),
        (np.array([1, 2], np.int64), "i4"),
        (np.array([1, 2**32 - 1], np.uint64), "u4"),
        (np.array([-(2**40), 2**53], np.int64), "f8"),
        (np.array([0.5, 65504], np.float16), "f4"),
        (np.array([-128, 127], np.int8), "i1"),
        (np.array([[1.5], [2.5]], ">f4"), "f4"),
    ],
)
def test_ply_gives_each_attribute_a_type_that_holds_it(tmp_path, value, read_as):
    recon.write_points(UTM, tmp_path / "p.ply", attributes={"some thing": value})
    back = recon.read_points(tmp_path / "p.ply").attributes["some_thing"]
    assert back.dtype == np.dtype(read_as)
    assert np.array_equal(back, value.reshape(2))


def test_attributes_that_share_a_column_name_are_all_kept(tmp_path):
    attributes = {"x": np.array([1.0, 2.0]), "a b": np.array([3, 4]), "a_b": np.array([5, 6])}
    recon.write_points(UTM, tmp_path / "p.ply", attributes=attributes)
    back = recon.read_points(tmp_path / "p.ply")
    assert np.array_equal(back.points, UTM)
    assert sorted(map(tuple, (value.tolist() for value in back.attributes.values()))) == [(1, 2), (3, 4), (5, 6)]


def test_stl_is_binary_just_where_that_is_exact(tmp_path, mesh):
    exact = recon.Mesh.from_arrays(np.eye(4, 3), TETRAHEDRON)
    recon.write_mesh(exact, tmp_path / "exact.stl")
    recon.write_mesh(mesh, tmp_path / "utm.stl")
    assert (tmp_path / "exact.stl").stat().st_size == 84 + 50 * 4
    assert (tmp_path / "utm.stl").read_bytes().startswith(b"solid")
    assert recon.read_mesh(tmp_path / "exact.stl").faces.shape == (4, 3)


def test_glb_keeps_large_coordinates_to_a_millionth_of_the_size(tmp_path, mesh):
    recon.write_mesh(mesh, tmp_path / "m.glb")
    data = (tmp_path / "m.glb").read_bytes()
    assert data[:4] == b"glTF" and int.from_bytes(data[8:12], "little") == len(data)
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    body = data[28 + length :]
    view = document["bufferViews"][0]
    positions = np.frombuffer(body, "<f4", 12, view["byteOffset"]).reshape(4, 3)
    world = positions + np.array(document["nodes"][0]["translation"])
    assert np.abs(world - mesh.vertices).max() < 1e-6 * np.ptp(mesh.vertices, axis=0).max()
    assert all(view["byteOffset"] % 4 == 0 for view in document["bufferViews"])


def test_glb_comes_back(tmp_path, mesh):
    assert set(recon.write_mesh(mesh, tmp_path / "m.glb")) == set(mesh.attributes) - {"normals", "colors"}
    back = recon.read_mesh(tmp_path / "m.glb")
    assert np.abs(back.vertices - mesh.vertices).max() < 1e-6 * np.ptp(mesh.vertices, axis=0).max()
    assert np.array_equal(back.faces, mesh.faces)
    assert np.array_equal(back.attributes["colors"][:, :3], mesh.attributes["colors"][:, :3])
    length = np.linalg.norm(mesh.attributes["normals"], axis=1, keepdims=True)
    assert np.allclose(back.attributes["normals"], mesh.attributes["normals"] / length, atol=1e-6)
    assert (tmp_path / "m.glb").rename(tmp_path / "unnamed")
    assert np.array_equal(recon.read_mesh(tmp_path / "unnamed").faces, mesh.faces)  # known by its first bytes


@pytest.mark.peers
def test_a_scene_of_trimeshs_is_read_as_trimesh_reads_it(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    ball, box = trimesh.creation.icosphere(1), trimesh.creation.box((1, 2, 3))
    turned = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]) @ np.diag([2.0, 0.5, 1.0, 1.0])
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirror[:3, 3] = 500_000.25, 0, -7
    arm = scene.add_geometry(ball, node_name="arm", transform=turned)
    scene.add_geometry(box, parent_node_name=arm, transform=mirror)
    scene.add_geometry(box, transform=np.eye(4))
    ball.visual.vertex_colors = [9, 8, 7, 255]
    (tmp_path / "s.glb").write_bytes(scene.export(file_type="glb"))
    theirs = trimesh.load_scene(tmp_path / "s.glb").to_geometry()
    ours = recon.read_mesh(tmp_path / "s.glb")
    assert len(ours.faces) == len(theirs.faces) == len(ball.faces) + 2 * len(box.faces)
    corners = [np.asarray(c).reshape(-1, 9) for c in (ours.vertices[ours.faces], theirs.vertices[theirs.faces])]
    centres = [c.reshape(-1, 3, 3).mean(axis=1) for c in corners]
    ranked = [c[np.lexsort(c.round(1).T)] for c in centres]
    assert np.allclose(*ranked, atol=0.05)
    volume = sum(part.volume for part in trimesh.load_scene(tmp_path / "s.glb").dump())
    signed = np.linalg.det((ours.vertices - ours.vertices[0])[ours.faces]).sum() / 6
    assert signed == pytest.approx(volume, rel=1e-3) and signed > 0  # the mirrored box is turned right


def test_strips_and_fans_of_a_glb_are_triangles_and_points_are_points(tmp_path):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], "<f4")
    for mode, expected in ((0, []), (5, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]), (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]])):
        document = {
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_TIME": 1}, "mode": mode}]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
                {"bufferView": 0, "componentType": 5126, "count": 5, "type": "SCALAR"},
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 60}],
            "buffers": [{"byteLength": 60}],
        }
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        parts = [
            len(text).to_bytes(4, "little"),
            b"JSON",
            text,
            (60).to_bytes(4, "little"),
            b"BIN\0",
            corners.tobytes(),
        ]
        body = b"".join(parts)
        (tmp_path / "m.glb").write_bytes(b"glTF\2\0\0\0" + (12 + len(body)).to_bytes(4, "little") + body)
        content = recon.io.read(tmp_path / "m.glb")
        assert getattr(content, "faces", np.zeros((0, 3))).tolist() == expected
        assert np.array_equal(recon.read_points(tmp_path / "m.glb").points, corners)
        assert np.array_equal(content.attributes["TIME"], corners.ravel()[:5])


@pytest.mark.parametrize("extension", ["xyz", "csv", "ply", "npz"])
def test_booleans_come_back_as_numbers_and_words_where_they_can(tmp_path, extension):
    attributes = {"seen": np.array([True, False]), "name": np.array(["tree", "Ö"])}
    lost = recon.write_points(UTM, tmp_path / f"p.{extension}", attributes=attributes)
    back = recon.read_points(tmp_path / f"p.{extension}").attributes
    assert back["seen"].tolist() == [1, 0]
    assert lost == (() if extension == "npz" else ("name",))
    assert extension != "npz" or (back["name"].tolist() == ["tree", "Ö"] and back["seen"].dtype == bool)


def test_words_survive_a_reconstruction_and_what_holds_no_words_says_so(tmp_path):
    points = np.random.default_rng(0).normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    names = np.array([f"p{k}" for k in range(200)])
    recon.write_points(points, tmp_path / "p.npz", attributes={"name": names})
    mesh = recon.reconstruct(recon.read_points(tmp_path / "p.npz")).mesh
    assert np.array_equal(mesh.attributes["name"], names[mesh.vertex_source])
    assert recon.write_mesh(mesh, tmp_path / "m.ply") == ("name",)


@pytest.mark.parametrize("extension", ["ply", "obj", "off", "stl", "glb"])
def test_a_mesh_without_faces_or_vertices_can_be_written(tmp_path, extension):
    recon.write_mesh(recon.Mesh.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int)), tmp_path / f"m.{extension}")
    assert (tmp_path / f"m.{extension}").stat().st_size > 0


@pytest.mark.peers
@pytest.mark.parametrize("extension", ["ply", "obj", "off", "stl", "glb"])
def test_trimesh_reads_what_we_write(tmp_path, mesh, extension):
    trimesh = pytest.importorskip("trimesh")
    recon.write_mesh(mesh, tmp_path / f"m.{extension}")
    scene = trimesh.load_scene(tmp_path / f"m.{extension}")
    other = scene.to_geometry()
    tolerance = 1e-6 if extension == "glb" else 0.0
    assert other.faces.shape == (4, 3)
    corners = np.sort(np.asarray(other.triangles).reshape(-1, 3), axis=0)
    assert np.abs(corners - np.sort(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0)).max() <= tolerance
    if extension in ("ply", "obj", "glb"):
        assert np.array_equal(np.asarray(other.visual.vertex_colors)[:, :3], mesh.attributes["colors"])


# ---- whole or not at all


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = save(tmp_path / "m.ply", "old")
    for problem in (RuntimeError, KeyboardInterrupt):
        with pytest.raises(problem), whole_file(target) as file:
            file.write(b"half")
            file.flush()
            raise problem
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["m.ply"]


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions and links")
def test_a_new_file_has_usual_permissions_and_a_replaced_one_its_own(tmp_path, mesh):
    umask = os.umask(0o027)
    try:
        recon.write_mesh(mesh, tmp_path / "new.ply")
    finally:
        os.umask(umask)
    assert (tmp_path / "new.ply").stat().st_mode & 0o777 == 0o640
    old = save(tmp_path / "old.ply", "old")
    old.chmod(0o604)
    (tmp_path / "link.ply").symlink_to(old)
    recon.write_mesh(mesh, tmp_path / "link.ply")
    assert (tmp_path / "link.ply").is_symlink()
    assert old.stat().st_mode & 0o777 == 0o604
    assert len(recon.read_mesh(old).vertices) == 4


# ---- text


@pytest.mark.parametrize(
    "content",
    [
        "1.5 2.5 3.5\n4 5 6\n",
        "  1.5\t2.5   3.5  \r\n\r\n4 5 6",
        "1.5,2.5,3.5\n4,5,6\n",
        "1.5, 2.5, 3.5,\n4, 5, 6,\n",
        "1.5;2.5;3.5\n4;5;6\n",
        "1,5;2,5;3,5\n4;5;6\n",
        "2\n1.5 2.5 3.5\n4 5 6\n",
        "# a comment\n1.5 2.5 3.5 # a remark\n// another\n4 5 6\n",
        "x y z\n1.5 2.5 3.5\n4 5 6\n",
        '"X","Y","Z"\n1.5,2.5,3.5\n4,5,6\n',
        "//X Y Z\n2\n1.5 2.5 3.5\n4 5 6\n",
        "\ufeffX Y Z\n1.5 2.5 3.5\n4 5 6\n",
        "z,y,x\n3.5,2.5,1.5\n6,5,4\n",
        "Easting\tNorthing\tElevation (m)\n1.5\t2.5\t3.5\n4\t5\t6\n",
        "1.5e0 +2.5E+000 .35e1\n4. 5 6\n",
        "1.5 2.5 3.5\r4 5 6\r",
    ],
)
def test_text_of_any_habit_gives_the_same_two_points(tmp_path, content):
    for extension in (".xyz", ".csv", ""):
        cloud = points_of(tmp_path / f"p{extension}", content)
        assert cloud.points.tolist() == [[1.5, 2.5, 3.5], [4, 5, 6]]
        assert not cloud.attributes


def test_utf16_text_is_read(tmp_path):
    assert points_of(tmp_path / "p.txt", "1 2 3\n4 5 6\n".encode("utf-16")).points.shape == (2, 3)


def test_two_columns_stay_planar(tmp_path):
    assert points_of(tmp_path / "p.xy", "1 2\n3 4\n").points.tolist() == [[1, 2], [3, 4]]
    assert points_of(tmp_path / "p.csv", "x,y,class\n1,2,7\n3,4,8\n").points.tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize(
    ("extension", "rest", "expected"),
    [
        ("xyz", "0.6 0 0.8", {"normals": "f8"}),
        ("xyz", "255 0 128", {"colors": "u1"}),
        ("xyz", "0.25 0.5 0.5", {"column_4": "f8", "column_5": "f8", "column_6": "f8"}),
        ("xyzrgb", "0.25 0.5 0.5", {"colors": "f8"}),
        ("xyzn", "2 0 0", {"normals": "f8"}),
        ("xyzr", "1.7", {"radius": "f8"}),
        ("pts", "-1024 255 0 128", {"intensity": "f8", "colors": "u1"}),
        ("pts", "12", {"intensity": "f8"}),
        ("xyz", "12", {"column_4": "f8"}),
        ("asc", "255 0 128 0.6 0 0.8", {"colors": "u1", "normals": "f8"}),
        ("txt", "0.6 0 0.8 255 0 128 9", {"normals": "f8", "colors": "u1", "column_10": "f8"}),
    ],
)
def test_unnamed_columns_are_told_by_what_they_hold(tmp_path, extension, rest, expected):
    cloud = points_of(tmp_path / f"p.{extension}", f"1 2 3 {rest}\n4 5 6 {rest}\n")
    assert {key: value.dtype.str[1:] for key, value in cloud.attributes.items()} == expected


def test_named_columns_become_attributes(tmp_path):
    cloud = points_of(tmp_path / "p.csv", "id,x,y,z,R,G,B,nx,ny,nz\n7,1,2,3,255,0,9,0,0,1\n8,4,5,6,0,1,2,0,0,1\n")
    assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert cloud.attributes["colors"].tolist() == [[255, 0, 9], [0, 1, 2]]
    assert cloud.attributes["normals"].tolist() == [[0, 0, 1]] * 2
    assert cloud.attributes["id"].tolist() == [7, 8]


# ---- PLY of others


def ply(fmt, vertex, body, extra=""):
    return f"ply\nformat {fmt} 1.0\ncomment by hand\n{vertex}{extra}end_header\n".encode() + body


def test_ply_ascii_keeps_digits_beyond_its_declared_float(tmp_path):
    head = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    body = b"512700.8751234567 5403547.5 1 200\n1 2 3 7\n"
    for end in (b"\n", b"\r\n"):
        content = ply("ascii", head, body).replace(b"\n", end)
        cloud = points_of(tmp_path / "p.ply", content)
        assert cloud.points[0, 0] == 512700.8751234567
        assert cloud.attributes["red"].dtype == np.uint8


@pytest.mark.parametrize(("fmt", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">"), ("ascii", "")])
def test_ply_lists_of_unequal_length_are_read_in_any_byte_order(tmp_path, fmt, order):
    rows = [(0.5, 1, 2, [7, 8]), (3, 4, 5, []), (6, 7, 8, [9]), (1, 1, 1, [3, 2])]
    polygons = [[0, 1, 2, 3], [0, 1, 2], [3, 2, 1]]  # the longest first
    head = (
        "element camera 1\nproperty int id\nelement vertex 4\nproperty float x\nproperty double y\nproperty short z\n"
        "property list ushort int near\nproperty uchar tag\n"
        "element face 3\nproperty uchar flag\nproperty list uchar int vertex_indices\n"
    )
    if order:
        pack = lambda kind, *values: np.array(values, order + kind).tobytes()  # noqa: E731
        body = pack("i4", 5)
        for x, y, z, near in rows:
            body += pack("f4", x) + pack("f8", y) + pack("i2", z) + pack("u2", len(near)) + pack("i4", *near) + b"\x01"
        for corners in polygons:
            body += b"\x02" + bytes([len(corners)]) + pack("i4", *corners)
    else:
        body = b"5\n"
        body += "".join(f"{x} {y} {z} {len(near)} {' '.join(map(str, near))} 1\n" for x, y, z, near in rows).encode()
        body += "".join(f"2 {len(c)} {' '.join(map(str, c))}\n" for c in polygons).encode()
    path = save(tmp_path / "p.ply", ply(fmt, head, body))
    cloud = recon.read_points(path)
    assert cloud.points.tolist() == [[0.5, 1, 2], [3, 4, 5], [6, 7, 8], [1, 1, 1]]
    assert cloud.attributes["tag"].tolist() == [1, 1, 1, 1]
    assert recon.read_mesh(path).faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1]]


def test_ply_lists_of_equal_length_are_an_attribute(tmp_path):
    head = (
        "element vertex 2\nproperty double x\nproperty double y\nproperty double z\nproperty list uchar float weights\n"
    )
    row = np.array([1, 2, 3.0]).tobytes() + b"\x02" + np.array([4, 5], "<f4").tobytes()
    cloud = points_of(tmp_path / "p.ply", ply("binary_little_endian", head, row * 2))
    assert cloud.attributes["weights"].tolist() == [[4, 5], [4, 5]]


# ---- OFF, OBJ, STL, PCD, NumPy


def test_off_prefixes_and_polygons(tmp_path):
    content = (
        "STCNOFF # all of it\n\n4 2 0\n"
        "0 0 0 0 0 1 255 0 0 255 0.5 1\n1 0 0 0 0 1 9 8 7 255 0 0\n1 1 0 0 0 1 1 2 3 255 0 0\n0 1 0 0 0 1 0 0 0 255 0 1\n"
        "4 0 1 2 3 255 0 0\n3 0 2 1\n"
    )
    mesh = recon.read_mesh(save(tmp_path / "m.off", content))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 2, 1]]
    assert mesh.attributes["colors"].tolist()[1] == [9, 8, 7, 255]
    assert mesh.attributes["normals"].shape == (4, 3)
    assert mesh.attributes["texture"][0].tolist() == [0.5, 1]


def test_obj_slashes_negative_corners_and_colours(tmp_path):
    content = (
        "mtllib a.mtl\no thing\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\n"
        "vn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 1 0\ns off\nf 1/1/1 2/1/2 3/1/3 \\\n 4/1/4\nf -4//1 -2//3 -3//2\n"
    )
    mesh = recon.read_mesh(save(tmp_path / "m.obj", content))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 2, 1]]
    assert mesh.attributes["colors"].tolist()[1] == [0, 1, 0]
    assert mesh.attributes["normals"].tolist()[3] == [0, 1, 0]
    other = content.replace("4/1/4", "4/1/1")
    assert "normals" not in recon.read_mesh(save(tmp_path / "m.obj", other)).attributes


def test_stl_merges_equal_corners_in_order_of_use(tmp_path):
    facet = "facet normal 0 0 0\n outer loop\n  vertex {}\n  VERTEX {}\n  vertex {}\n endloop\nendfacet\n"
    content = (
        "solid s\n"
        + facet.format("1 0 0", "0 0 0", "0 1 0")
        + facet.format("0 1 0", "-0.0 0 0", "0 0 1")
        + "endsolid s"
    )
    mesh = recon.read_mesh(save(tmp_path / "m.stl", content))
    assert mesh.vertices.tolist() == [[1, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 1, 3]]


def lzf_literals(data):
    return b"".join(bytes([len(part) - 1]) + part for part in (data[i : i + 32] for i in range(0, len(data), 32)))


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_pcd_fields_counts_padding_and_packed_colour(tmp_path, encoding):
    kinds = [("x", "<f4"), ("y", "<f8"), ("z", "<f4"), ("rgb", "<u4"), ("_", "u1", (3,)), ("hist", "<i2", (2,))]
    rows = np.zeros(2, kinds)
    rows["x"], rows["y"], rows["z"] = [1, 2], [5403547.500987654, 4], [5, 6]
    rows["rgb"], rows["hist"] = [0x112233, 0xFFFEFD], [[1, -2], [3, 4]]
    header = (
        "VERSION .7\nFIELDS x y z rgb _ hist\nSIZE 4 8 4 4 1 2\nTYPE F F F U U I\nCOUNT 1 1 1 1 3 2\n"
        f"WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA {encoding}\n"
    ).encode()
    if encoding == "binary":
        body = rows.tobytes()
    elif encoding == "ascii":
        flat = [np.concatenate([np.atleast_1d(value) for value in row]).tolist() for row in rows.tolist()]
        body = "".join(" ".join(map(repr, row)) + "\n" for row in flat).encode()
    else:
        plain = b"".join(np.ascontiguousarray(rows[field]).tobytes() for field in rows.dtype.names)
        packed = lzf_literals(plain)
        body = np.array([len(packed), len(plain)], "<u4").tobytes() + packed
    cloud = points_of(tmp_path / "p.pcd", header + body)
    assert cloud.points.tolist() == [[1, 5403547.500987654, 5], [2, 4, 6]]
    assert cloud.attributes["colors"].tolist() == [[0x11, 0x22, 0x33], [0xFF, 0xFE, 0xFD]]
    assert cloud.attributes["hist"].tolist() == [[1, -2], [3, 4]]
    assert set(cloud.attributes) == {"colors", "hist"}


def test_lzf_back_references_may_overlap_themselves():
    # "ab", then 9 + 3 bytes from two back, then 3 bytes from twelve back
    packed = bytes([1]) + b"ab" + bytes([7 << 5, 3, 1]) + bytes([1 << 5, 11])
    assert lzf.decompress(packed, 17) == b"ab" + b"ab" * 6 + b"aba"
    assert lzf.decompress(packed, 16) is None
    assert lzf.decompress(packed, 18) is None
    assert lzf.decompress(bytes([1 << 5, 5]), 3) is None
    assert lzf.decompress(bytes([9, 1]), 10) is None


def test_npy_and_npz_of_any_layout(tmp_path):
    expected = np.arange(12, dtype=float).reshape(4, 3)
    for array in (expected, np.asfortranarray(expected), expected.astype(">f4"), expected.astype(np.int16)):
        np.save(tmp_path / "p.npy", array)
        assert np.array_equal(recon.read_points(tmp_path / "p.npy"), expected)
    structured = np.zeros(4, [("z", "f8"), ("y", "f8"), ("x", "f8"), ("gps_time", ">f8")])
    structured["x"], structured["y"], structured["z"] = expected.T
    np.save(tmp_path / "p.npy", structured)
    cloud = recon.read_points(tmp_path / "p.npy")
    assert np.array_equal(cloud.points, expected) and set(cloud.attributes) == {"gps_time"}
    np.savez_compressed(tmp_path / "p.npz", xyz=expected, quality=np.arange(4), other=np.arange(9))
    cloud = recon.read_points(tmp_path / "p.npz")
    assert np.array_equal(cloud.points, expected) and set(cloud.attributes) == {"quality"}


# ---- the cloud


def test_a_cloud_is_an_array_of_points_and_frozen(tmp_path):
    cloud = points_of(tmp_path / "p.xyz", "1 2 3\n4 5 6\n")
    assert len(cloud) == 2
    assert np.asarray(cloud) is cloud.points
    assert np.array(cloud).flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0, 0] = 1
    assert repr(cloud) == "PointCloud(2 points in 3-D)"
    assert recon.regular_triangulation(np.vstack([cloud, [[0, 0, 1], [0, 1, 0], [3, 1, 0]]])).cells.shape[1] == 4


def test_invalid_rows_are_dropped_counted_and_mapped(tmp_path):
    content = "1 2 3 9\nnan 1 1 8\n4 5 6 7\n0 inf 0 6\n1e300 0 0 5\n7 8 9 4\n"
    cloud = points_of(tmp_path / "p.xyz", content, drop_invalid=True)
    assert cloud.rows.tolist() == [0, 2, 5]
    assert cloud.attributes["column_4"].tolist() == [9, 7, 4]
    assert cloud.dropped == 3


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3\n",
            "ply",
        ),
        ("OFF\n1 0 0\n1 2 3\n", "off"),
        ("# thing\nv 1 2 3\n", "obj"),
        ("solid\nfacet\nouter loop\nvertex 1 2 3\nvertex 1 2 4\nvertex 1 1 3\nendloop\nendfacet\nendsolid\n", "stl"),
        ("# .PCD v0.7\nFIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n", "pcd"),
        ("1\n1 2 3\n", "text"),
    ],
)
def test_a_file_without_extension_is_told_by_its_content(tmp_path, monkeypatch, content, kind):
    assert points_of(tmp_path / "cloud", content).points[0].tolist() == [1, 2, 3]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content.encode())))
    assert recon.read_points("-").points[0].tolist() == [1, 2, 3]
    assert formats.recognise(content.encode(), "cloud", "") == kind


# ---- real files

COUNTS = {
    "points/kitten.xyz": 5210, "points/bunny_5000": 5000, "points/horse.ply": 48485, "points/hippo1.ply": 6104,
    "points/oni.pwn": 1435, "points/before_upsample.xyz": 850, "points/half.xyz": 325,
    "points/fin90_with_PCA_normals.xyz": 757, "points/sphere_20k.xyz": 21000, "points/spheres.ply": 5969,
    "points/point_set_2.xyz": 3634, "points/sphere3D_pts_on_grid.off": 17284, "points/grid_10_10_10_in_0_1.off": 1000,
    "points/tore3D_300.off": 300, "points/bun0.pcd": 397, "points/lamppost.pcd": 1771, "points/milk.pcd": 13704,
    "points/samp11-utm.pcd": 38010, "points/urban.las": 13511, "points/simple.las": 1065, "molecules/1A8O.xyzr": 644,
}  # fmt: skip
EULER = {
    "elephant.off": -4, "femur.off": -2, "hand.off": 2, "eight.off": -2, "knot1.off": 0, "anchor_dense.off": -6,
    "goathead.obj": 2, "wingnut.obj": 2, "skull_low_resolution.obj": -2, "torus.obj": 0, "mannequin-devil.off": 1,
}  # fmt: skip


def data(path):
    root = os.environ.get("RECON_DATA")
    if not root:
        pytest.skip("RECON_DATA is not set")
    return os.path.join(root, path)


@pytest.mark.data
@pytest.mark.parametrize(("path", "count"), COUNTS.items())
def test_real_clouds_have_their_points(path, count):
    if path.endswith(".las"):
        pytest.importorskip("laspy")
    cloud = recon.read_points(data(path))
    assert cloud.points.shape == (count, 3)
    assert len(np.unique(cloud.points, axis=0)) > count // 2


@pytest.mark.data
@pytest.mark.parametrize(("path", "euler"), EULER.items())
def test_real_meshes_have_their_euler_characteristic(path, euler):
    mesh = recon.read_mesh(data(f"meshes/{path}"))
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    assert len(np.unique(mesh.faces)) - len(np.unique(edges, axis=0)) + len(mesh.faces) == euler


@pytest.mark.data
def test_real_lidar_keeps_its_utm_coordinates():
    laspy = pytest.importorskip("laspy")
    urban, raw = recon.read_points(data("points/urban.las")), laspy.read(data("points/urban.las"))
    stored = np.column_stack([raw.X, raw.Y, raw.Z])
    assert np.array_equal(urban.points, stored * raw.header.scales + raw.header.offsets)
    assert {"intensity", "classification", "colors"} <= set(urban.attributes)


@pytest.mark.peers
@pytest.mark.data
@pytest.mark.parametrize("name", ["horse.ply", "hippo1.ply", "milk.pcd", "samp11-utm.pcd", "bun0.pcd"])
def test_open3d_reads_the_same_points(name):
    open3d = pytest.importorskip("open3d")
    theirs = np.asarray(open3d.io.read_point_cloud(data(f"points/{name}")).points)
    ours = recon.read_points(data(f"points/{name}")).points
    assert np.array_equal(theirs.astype(np.float32), ours.astype(np.float32))


@pytest.mark.parametrize("name", ["m.obj", "m.off", "m.stl"])
def test_text_is_the_same_in_small_blocks(tmp_path, monkeypatch, name):
    rng = np.random.default_rng(5)
    attributes = {"normals": rng.normal(size=(20, 3)), "colors": rng.integers(0, 256, (20, 3), dtype=np.uint8)}
    mesh = recon.Mesh.from_arrays(rng.normal(size=(20, 3)), rng.integers(0, 20, (31, 3)), None, attributes)
    recon.write_mesh(mesh, tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    monkeypatch.setattr(recon.io.files, "_ROWS", 7)
    recon.write_mesh(mesh, tmp_path / name)
    assert (tmp_path / name).read_bytes() == whole
    assert len(recon.read_mesh(tmp_path / name).faces) == 31
