"""Closed models from elsewhere, sampled anew: of how many does the surface come out right?

    pip download --no-deps --dest wheels example-robot-data==6.0.0 pybullet==3.2.7 pymeshlab==2025.7.post1
    for wheel in wheels/*.whl; do python -m zipfile -e $wheel models; done
    python benchmarks/models.py models models.json                               # recon; add --contender NAME for others
    python benchmarks/models.py models models.json --random                      # points at random, none kept apart
    python benchmarks/models.py models models.json --images 0.25 0.5             # depth images: noise, misplacement [pixels]

Of a folder all meshes are taken that are closed, 2-manifold and do not cross themselves, of 500 to 500,000 faces, one of each
number of vertices and faces (many are copies). Each is given POINTS samples, spread evenly by area: those of eight times as
many at random that lie no nearer than 0.8 mean spacings to one before. Judged as in `evidence.py`: right topology, and solved.
Depth images are those of 14 cameras (`depth_images.py`), of the models that they see all of.
Many of these models have walls, slots and fillets that are finer than the samples: not all can come out right.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from depth_images import depth_images
from evidence import judge, save
from evidence_clouds import Cloud, welded
from numpy.typing import NDArray
from peers import CONTENDERS, RECON, nearest
from scipy.spatial import cKDTree

import recon
from recon.proximity import area_samples, area_vectors
from recon.topology import topology

POINTS = 20_000
SUFFIXES = (".ply", ".off", ".obj", ".stl")
FACES = range(500, 500_000)
CROWD, APART = 8, 0.8


def models(folder: Path) -> Iterator[tuple[str, recon.Mesh]]:
    """Name and mesh, largest dimension 1, of each model that can be judged."""
    seen = set()
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() not in SUFFIXES or not path.is_file():
            continue
        try:
            mesh = welded(recon.read_mesh(path))
        except recon.ReconError:
            continue
        size = len(mesh.vertices), len(mesh.faces)
        if len(mesh.faces) not in FACES or size in seen:
            continue
        unit = (mesh.vertices - mesh.vertices.mean(axis=0)) / np.ptp(mesh.vertices, axis=0).max()
        mesh = recon.Mesh.from_arrays(unit, mesh.faces)
        shape = topology(mesh.faces)
        if not (shape.closed and shape.manifold and shape.oriented):
            continue
        found = {metric.name: metric.value for metric in recon.measure(mesh)}
        if found["outward"] and not found["self_intersections"]:
            seen.add(size)
            yield path.relative_to(folder).as_posix(), mesh


def sample(mesh: recon.Mesh, n: int, even: bool) -> NDArray[np.float64]:
    """Points of a mesh."""
    rng = np.random.default_rng(0)
    points = rng.permutation(area_samples(mesh.vertices, mesh.faces, CROWD * n if even else n, rng)[0])
    if not even:
        return points
    area = np.linalg.norm(area_vectors(mesh.vertices, mesh.faces), axis=1).sum()
    near = cKDTree(points).query_ball_point(points, APART * np.sqrt(area / n), workers=-1)
    kept = np.ones(len(points), bool)
    for i, others in enumerate(near):
        if kept[i]:
            kept[[j for j in others if j > i]] = False
    return points[kept]


def told(result: Any) -> int | None:
    """Thin loops of a surface that recon read as closed."""
    return len(result.thin_loops) if getattr(result, "surface", None) == "closed" else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("json", type=Path, metavar="JSON")
    parser.add_argument("--contender", action="append", choices=list(CONTENDERS), help="default: recon")
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--random", action="store_true")
    parser.add_argument("--images", nargs=2, type=float, metavar=("NOISE", "SHIFT"))
    options = parser.parse_args()
    results = []
    for name, mesh in models(options.folder):
        if options.images:
            points = depth_images(mesh, options.points, *options.images)
        else:
            points = sample(mesh, options.points, not options.random)
        if points is None:
            continue
        euler = len(mesh.vertices) - len(mesh.faces) // 2
        cloud = Cloud(points, np.ones(len(points), bool), nearest(points), mesh, ((euler, 0),))
        for contender in options.contender or [RECON]:
            start = time.perf_counter()
            try:
                made = list(CONTENDERS[contender].run(points, cloud.near))
                seconds = time.perf_counter() - start
                judged = [
                    {**judge(getattr(one, "mesh", one), cloud, CONTENDERS[contender].interpolates), "thin": told(one)}
                    for one in made
                ]
                best = min(judged, key=lambda one: (one["faults"] != [], not one.get("shape")))
            except Exception as error:  # whatever it is, it is a failure of that contender, by name
                seconds, best = time.perf_counter() - start, {"faults": [f"{type(error).__name__}: {error}"]}
            results.append({"model": name, "contender": contender, "points": len(points), "seconds": seconds, **best})
            print(f"{contender}: {name}: {best['faults'] or 'ok'}", file=sys.stderr, flush=True)
            save(options.json, results)
    for contender in options.contender or [RECON]:
        own = [one for one in results if one["contender"] == contender]
        right, solved = sum(bool(one.get("shape")) for one in own), sum(not one["faults"] for one in own)
        print(f"{contender}: of {len(own)} models {right} of the right topology, {solved} solved")
    closed = [one for one in results if one.get("thin") is not None]
    for name, some in (
        ("none", [one for one in closed if not one["thin"]]),
        ("some", [one for one in closed if one["thin"]]),
    ):
        print(
            f"{RECON}, thin loops: {name}: {sum(bool(one.get('shape')) for one in some)} of {len(some)} of the right topology"
        )


if __name__ == "__main__":
    main()
