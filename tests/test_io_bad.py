"""Bad files give one clear line that names the file and the place; nothing else ever comes out of a reader."""

import io
import json
import os
import random
import re
import zipfile

import numpy as np
import pytest

import recon
from recon.io import check_writable, read_weights

VERTEX = "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
PCD = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA {1}\n"


def ply(vertices, body, fmt="ascii", extra=""):
    return f"ply\nformat {fmt} 1.0\n{VERTEX.format(vertices)}{extra}end_header\n".encode() + body


FACES = "element face 1\nproperty list uchar int vertex_indices\n"
FLOATS = np.arange(9, dtype="<f4").tobytes()
BAD = {
    "empty.xyz": (b"", "is empty"),
    "blank.xyz": (b"\n \n# nothing\n", "ends where the first point should follow"),
    "columns.xyz": (b"1 2 3\n4 5 6\n7 8\n", r"line 3: 2 columns, expected 3: '7 8'"),
    "late.xyz": (b"1 2 3\n" * 70_000 + b"\n# x\n1 2 3\n1 2\n", "line 70004: 2 columns, expected 3"),
    "word.xyz": (b"1 2 3\n# remark\n\n4 five 6\n", r"line 4: column 2: 'five' is not a number"),
    "words.txt": (b"Dear all,\nthis is a letter.\n", "line 2: "),
    "underscore.xyz": (b"1 2 3\n1_0 2 3\n", r"line 2: column 1: '1_0' is not a number"),
    "nan.xyz": (b"1 2 3\n\n4 nan 6\n7 8 inf\n", r"line 3 is no point: 4 nan 6 \(2 such rows of 3\)"),
    "huge.xyz": (b"1 2 3\n1e200 0 0\n", r"line 2 is no point: 1e\+200 0 0 \(1 such row of 2\)"),
    "one.xyz": (b"1\n2\n3\n", "line 2: one number where a point"),
    "column.xyz": (b"1.5\n2\n3\n", "expected at least two columns"),
    "promise.pts": (b"5\n1 2 3\n4 5 6\n", "first line promises 5 points but 2 follow"),
    "modest.pts": (b"1\n1 2 3\n4 5 6\n", "first line promises 1 point but 2 follow"),
    "field.csv": (b"x,y,z\n1,2,3\n1,,3\n", "line 3: column 2: an empty field"),
    "header.csv": (b"x,y,z,q\n1,2,3\n", "3 columns, but the line above names 4"),
    "twice.csv": (b"x,y,z,z\n1,2,3,4\n", "two columns are called 'z'"),
    "binary.xyz": (bytes(range(256)), "binary data where text was expected"),
    "gzip.xyz": (b"\x1f\x8b\x08\x00", "compressed with gzip: unpack it first"),
    "e57.e57": (b"ASTM-E57\0\0", "an E57 file"),
    "unknown.foo": (b"\x00\x01\x02", "its format is not known"),
    "head.ply": (b"plx\n", "does not begin with the line 'ply'"),
    "noend.ply": (b"ply\nformat ascii 1.0\nelement vertex 3\n", "has no end"),
    "format.ply": (b"ply\nformat middle_endian 1.0\nend_header\n", "line 2 of the PLY header makes no sense"),
    "type.ply": (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\n", "line 4 of the PLY header makes no sense"),
    "negative.ply": (b"ply\nformat ascii 1.0\nelement vertex -1\n", "line 3 of the PLY header makes no sense"),
    "doubled.ply": (ply(1, b"1 2 3\n", extra="property float x\n"), "a second property called 'x'"),
    "none.ply": (ply(0, b""), "holds no points"),
    "nox.ply": (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float a\nend_header\n1\n", "no columns named x and y"),
    "novertex.ply": (b"ply\nformat ascii 1.0\nelement point 1\nproperty float x\nend_header\n1\n", "no element called vertex"),
    "short.ply": (ply(3, b"1 2 3\n4 5 6\n"), "promises 3 rows of element vertex from line 8 on but has 2"),
    "long.ply": (ply(1, b"1 2 3\n4 5 6\n"), "goes on after the last vertex"),
    "ragged.ply": (ply(2, b"1 2 3\n4 5 6 7\n"), "line 9: 4 columns, expected 3"),
    "nan.ply": (ply(2, b"1 2 3\n4 5 nan\n"), "line 9 is no point"),
    "bits.ply": (ply(4, FLOATS, "binary_little_endian"), "promises 4 rows of element vertex"),
    "lie.ply": (ply(10**15, FLOATS, "binary_little_endian"), "promises 1000000000000000 rows"),
    "rest.ply": (ply(2, FLOATS, "binary_little_endian"), "goes on after the last vertex"),
    "faces.ply": (ply(3, FLOATS + b"\x03\0\0\0\0", "binary_little_endian", FACES), "promises 1 rows of element face"),
    "list.ply": (ply(1, b"1 2 3\n9 0 1 2\n", extra=FACES), "line 11: too short for the list"),
    "range.ply": (ply(1, b"1 2 3 300\n", extra="property uchar red\n"), "declared uint8 but holds 300"),
    "nan32.ply": (ply(3, FLOATS[:-4] + b"\0\0\xc0\x7f", "binary_little_endian"), r"point 2 \(counted from 0\) is no point"),
    "key.off": (b"MESH\n1 0 0\n1 2 3\n", "expected the keyword OFF, found 'MESH'"),
    "four.off": (b"4OFF\n1 0 0\n1 2 3 4\n", "another dimension"),
    "binary.off": (b"OFF BINARY\n", "binary OFF is not read"),
    "counts.off": (b"OFF\nmany\n", "expected the counts"),
    "short.off": (b"OFF\n3 0 0\n1 2 3\n4 5 6\n", "promises 3 vertices from line 3 on but has 2"),
    "long.off": (b"OFF\n1 0 0\n1 2 3\n4 5 6\n", "goes on after"),
    "face.off": (b"OFF\n1 1 0\n1 2 3\n3 0 0\n", "line 4: a face of 3 corners has 2 numbers"),
    "half.off": (b"OFF\n1 1 0\n1 2 3\n3 0 0 0.5\n", "line 4: a corner of a face is no whole number"),
    "none.obj": (b"# nothing\nvt 0 0\n", "has no vertex"),
    "two.obj": (b"v 1 2\n", "line 1: expected x y z"),
    "word.obj": (b"v 1 2 3\nv 1 b 3\n", "line 2: column 2: 'b' is not a number"),
    "zero.obj": (b"v 1 2 3\nf 0 1 2\n", "line 2: a corner of a face must be a whole number"),
    "short.stl": (b"x" * 80 + b"\x05\0\0\0" + bytes(100), "promises 5 triangles, 334 bytes, but has 184 bytes"),
    "tiny.stl": (b"abc", "too short for an STL"),
    "cut.stl": (b"solid a\nfacet\nouter loop\nvertex 1 2 3\n", "no line 'endsolid'"),
    "corner.stl": (b"solid a\nvertex 1 2 3\nendsolid\n", "no whole number of triangles"),
    "word.stl": (b"solid a\nvertex 1 2 3\nvertex 1 2\nendsolid\n", "line 3: 2 columns, expected 3"),
    "nodata.pcd": (b"VERSION .7\nFIELDS x y z\n", "no line DATA"),
    "junk.pcd": (b"HELLO\n", "line 1 of the PCD header makes no sense"),
    "fields.pcd": (b"FIELDS x y\nSIZE 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", "do not go together"),
    "width.pcd": (PCD.format(2, "ascii").replace("WIDTH 2", "WIDTH 3").encode(), "POINTS is 2 but WIDTH times HEIGHT is 3"),
    "ascii.pcd": (PCD.format(2, "ascii").encode() + b"1 2 3\n", "promises 2 points from line 10 on but has 1"),
    "long.pcd": (PCD.format(1, "ascii").encode() + b"1 2 3\n1 2 3\n", "goes on after the last of 1 points"),
    "binary.pcd": (PCD.format(2, "binary").encode() + bytes(23), "promises 2 points of 12 bytes but 23 bytes follow"),
    "lie.pcd": (PCD.format(10**14, "binary").encode() + bytes(23), "promises 100000000000000 points"),
    "lzf.pcd": (PCD.format(10**9, "binary_compressed").encode() + b"\x08\0\0\0\x00\xd8\x8d\xcb" + bytes(8), "do not fit"),
    "damage.pcd": (PCD.format(1, "binary_compressed").encode() + b"\x02\0\0\0\x0c\0\0\0\xff\xff", "compressed data are damaged"),
    "header.npy": (b"\x93NUMPY\x01\x00\x10\x00{'descr': [[[[[[", "no NPY header"),
    "cut.las": (b"LASF" + bytes(50), "no LAS header"),
    "zip.npz": (b"PK\x03\x04" + bytes(30), "no sound NPZ file"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_one_clear_line(tmp_path, name):
    content, message = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(recon.InvalidInput) as caught:
        recon.read_points(tmp_path / name)
    text = str(caught.value)
    assert text.startswith(str(tmp_path / name))
    assert re.search(message, text), text
    assert "\n" not in text and len(text.removeprefix(str(tmp_path))) < 300


def npy(array, allow_pickle=False):
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=allow_pickle)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (npy(np.zeros(5)), r"shape \(n, 2\), \(n, 3\) or more columns"),
        (npy(np.zeros((5, 1))), "or more columns"),
        (npy(np.zeros((5, 3), complex)), "complex128"),
        (npy(np.array([[1, None]], dtype=object), True), "Python objects"),
        (npy(np.zeros((0, 3))), "holds no points"),
        (npy(np.zeros((5, 3)))[:-1], "is the file truncated"),
        (npy(np.zeros((5, 3))).replace(b"(5, 3), ", b"(9**9,3)"), "no NPY header|promises an array"),
        (npy(np.zeros((9, 3))).replace(b"(9, 3), }   ", b"(9999999, 3)}"), "promises an array"),
        (npy(np.array([["a", "b", "c"]])), "expected numbers"),
    ],
)
def test_a_bad_npy_is_one_clear_line(tmp_path, content, message):
    (tmp_path / "p.npy").write_bytes(content)
    with pytest.raises(recon.InvalidInput, match=message):
        recon.read_points(tmp_path / "p.npy")


def test_an_npz_whose_points_are_not_named_is_refused(tmp_path):
    np.savez(tmp_path / "p.npz", a=np.zeros((4, 3)), b=np.ones((4, 3)))
    with pytest.raises(recon.InvalidInput, match="call it 'points'; there are 'a', 'b'"):
        recon.read_points(tmp_path / "p.npz")
    with zipfile.ZipFile(tmp_path / "q.npz", "w") as archive:
        archive.writestr("readme.txt", "no arrays")
    with pytest.raises(recon.InvalidInput, match="no arrays in it"):
        recon.read_points(tmp_path / "q.npz")


def test_missing_files_and_folders_are_named(tmp_path):
    with pytest.raises(recon.InvalidInput, match=r"nowhere\.xyz: no such file"):
        recon.read_points(tmp_path / "nowhere.xyz")
    with pytest.raises(recon.InvalidInput, match="is a folder, a file was expected"):
        recon.read_points(tmp_path)
    with pytest.raises(recon.InvalidInput, match="is no format that can be read; there are xyz"):
        recon.read_points(tmp_path / "p", format="docx") if (tmp_path / "p").write_text("1 2 3\n") else None


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("p.xyz", b"1 2 3\n", "has no faces, a mesh was expected"),
        ("p.ply", ply(1, b"1 2 3\n"), "has no faces"),
        (
            "p.off",
            b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            r"face 0 \(counted from 0\) names a vertex .* \[0, 1, 3\] of 3",
        ),
        ("p.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "has only 2 corners"),
        ("p.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", "names a vertex that is not there"),
        ("p.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n", "line 5 is no point"),
    ],
)
def test_a_bad_mesh_is_one_clear_line(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(recon.InvalidInput, match=message):
        recon.read_mesh(tmp_path / name)


def test_weights_are_one_number_a_point(tmp_path):
    path = tmp_path / "p.weights"
    path.write_text("1e-6\n# half\n0.5\n-2\n")
    assert read_weights(path, 3).tolist() == [1e-6, 0.5, -2]
    with pytest.raises(recon.InvalidInput, match="has 3 weights for 4 points"):
        read_weights(path, 4)
    path.write_text("1 2\n3 4\n")
    with pytest.raises(recon.InvalidInput, match="line 1: 2 columns, expected 1"):
        read_weights(path, 2)
    path.write_bytes(npy(np.arange(3)))
    assert read_weights(path, 3).tolist() == [0, 1, 2]


def test_an_output_that_cannot_be_is_refused_before_any_work(tmp_path):
    mesh = recon.Mesh.from_arrays(np.eye(3), [[0, 1, 2]])
    for path, message in [
        (tmp_path / "m.docx", r"extension \.docx is unknown, so the format is too; use one of ply, obj, off, stl, glb"),
        (tmp_path / "m", "no extension"),
        (tmp_path / "none" / "m.ply", "there is no folder"),
        ("", "no extension|no file name"),
    ]:
        with pytest.raises(recon.InvalidInput, match=message):
            recon.write_mesh(mesh, path)
    (tmp_path / "m.ply").mkdir()
    with pytest.raises(recon.InvalidInput, match="is a folder"):
        check_writable(tmp_path / "m.ply")
    with pytest.raises(recon.InvalidInput, match="no format that can be written"):
        recon.write_mesh(mesh, tmp_path / "x.ply", format="xyz")
    assert os.listdir(tmp_path) == ["m.ply"]


def test_attributes_that_cannot_be_written_leave_nothing_behind(tmp_path):
    with pytest.raises(recon.InvalidInput, match="attribute 'q': expected 3 rows"):
        recon.write_points(np.eye(3), tmp_path / "p.ply", attributes={"q": [1, 2]})
    assert os.listdir(tmp_path) == []


def glb(document, body=b""):
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = len(text).to_bytes(4, "little") + b"JSON" + text + len(body).to_bytes(4, "little") + b"BIN\0" + body
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks


def triangle(**changes):
    """A sound document, with changes."""
    sound = {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }
    return glb(sound | changes, FLOATS)


ACCESSOR = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"glTF" + bytes(30), "no GLB of version 2"),
        (triangle()[:-1], "promises .* bytes but has"),
        (glb(b"{"), "its JSON cannot be read"),
        (glb(b"[" * 100_000), "its JSON cannot be read"),
        (glb([1]), "no glTF 2.0"),
        (glb({}), "holds no points and no triangles"),
        (triangle(extensionsRequired=["KHR_draco_mesh_compression"]), "needs the glTF extension 'KHR_draco"),
        (triangle(accessors=[]), "no glTF 2.0"),
        (triangle(accessors=[ACCESSOR | {"count": 4}]), "goes beyond its 36 bytes"),
        (triangle(accessors=[ACCESSOR | {"count": 10**18}]), "goes beyond its 36 bytes"),
        (triangle(accessors=[ACCESSOR | {"count": -1}]), "expected a whole number"),
        (triangle(accessors=[ACCESSOR | {"sparse": {}}]), "is sparse"),
        (triangle(bufferViews=[{"byteLength": 36, "byteStride": 4}]), "goes beyond"),
        (triangle(buffers=[{"uri": "a.bin"}]), "in another file"),
        (triangle(nodes=[{"mesh": 0, "children": [0]}], scenes=[{"nodes": [0]}]), "nodes must form a tree"),
        (triangle(nodes=[{"mesh": 0, "matrix": [1, 2]}]), "no glTF 2.0"),
        (triangle(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}]), "holds no points"),
    ],
)
def test_a_bad_glb_is_one_clear_line(tmp_path, data, message):
    (tmp_path / "m.glb").write_bytes(data)
    with pytest.raises(recon.InvalidInput, match=message) as caught:
        recon.read_mesh(tmp_path / "m.glb")
    assert "m.glb" in str(caught.value) and "\n" not in str(caught.value)
    (tmp_path / "m.glb").write_bytes(triangle())
    assert recon.read_mesh(tmp_path / "m.glb").vertices.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]


# ---- fuzzing: whatever the bytes, a result or a ReconError


def seeds(folder):
    """Give small sound files of every format."""
    generator = np.random.default_rng(1)
    normals = generator.normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    attributes = {"normals": normals, "colors": generator.integers(0, 255, (20, 3), dtype=np.uint8), "q": np.arange(20)}
    exact = generator.integers(0, 9, (20, 3)).astype(float)
    faces = generator.integers(0, 20, (20, 3))
    made = {}
    for name, vertices in (("real", generator.normal(size=(20, 3))), ("exact", exact)):
        mesh = recon.Mesh.from_arrays(vertices, faces, attributes=attributes)
        for extension in ("ply", "obj", "off", "stl", "glb"):
            recon.write_mesh(mesh, folder / f"{name}.{extension}")
        for extension in ("xyz", "csv", "npy", "npz"):
            recon.write_points(vertices, folder / f"{name}.{extension}", attributes=attributes)
    for path in sorted(folder.iterdir()):
        made[path.name] = path.read_bytes()
    made["a.ply"] = ply(
        4,
        b"0 0 0 2 1 1\n1 0 0 2 1 2\n0 1 0 1 1\n0 0 1 0\n3 0 1 2\n4 0 1 2 3\n",
        extra="property list uchar int near\n" + FACES.replace("face 1", "face 2"),
    )
    made["be.ply"] = ply(
        3,
        b"".join(np.arange(3, dtype=">f4").tobytes() + np.array(k, ">i2").tobytes() + bytes(4 * k) for k in (2, 0, 1))
        + b"\x03" + np.arange(3, dtype=">i4").tobytes(),
        "binary_big_endian",
        "property list short float w\n" + FACES,
    )  # fmt: skip
    made["b.pcd"] = PCD.format(3, "binary").encode() + FLOATS
    made["a.pcd"] = PCD.format(3, "ascii").encode() + b"1 2 3\n4 5 nan\n7 8 9\n"
    made["c.pcd"] = PCD.format(2, "binary_compressed").encode() + b"\x08\0\0\0\x18\0\0\0\x03\0\0\x80\x3f\xe0\x0b\x03"
    made["o.obj"] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nf 1//1 2//2 3//3\nf -1/1/1 -2 -3/\\\n\n"
    made["p.pts"] = b"3\n1 2 3 100 1 2 3\n4 5 6 -20 3 4 5\n1 1 1 2 3 4 255\n"
    made["h.csv"] = b'"X";"Y";"Z (m)";name 2\n1,5;2,5;3,5;4\n1;2;3;4\n'
    return made


INSERTS = (b"9", b"-", b"\n", b" ", b"nan", b"e999", b"\0", b"\xff\xff\xff\xff", b"1" * 15, b"#", b",", b";", b"9" * 20)


def mangled(data, chance):
    """Cut, overwrite, insert or remove bytes, near the front more often than not."""
    out = bytearray(data)
    place = chance.randrange(len(out) if chance.random() < 0.4 else min(len(out), 400))
    match chance.randrange(4):
        case 0:
            return bytes(out[: chance.randrange(len(out))])
        case 1:
            for _ in range(chance.choice((1, 1, 2, 8))):
                out[chance.randrange(place + 1)] = chance.randrange(256)
        case 2:
            out[place:place] = chance.choice(INSERTS)
        case 3:
            del out[place : place + chance.randrange(1, 20)]
    return bytes(out)


def survive(path, data):
    path.write_bytes(data)
    outcomes = 0
    for read in (recon.read_points, recon.read_mesh):
        try:
            read(path)
            outcomes += 1
        except recon.ReconError as error:
            text = str(error)
            assert "\n" not in text and len(text) < 400, text
    return outcomes


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("rounds", [30, pytest.param(1000, marks=pytest.mark.slow)])
def test_mangled_files_give_a_result_or_a_recon_error(tmp_path, rounds):
    (tmp_path / "seeds").mkdir()
    chance = random.Random(6)
    sound = seeds(tmp_path / "seeds")
    assert all(survive(tmp_path / f"x-{name}", data) for name, data in sound.items() if name != "a.pcd")
    outcomes = [
        survive(tmp_path / f"x-{name}", mangled(data, chance)) for name, data in sound.items() for _ in range(rounds)
    ]
    assert 0.05 < np.mean([outcome > 0 for outcome in outcomes]) < 0.95
