"""How close meshes come to a torus, against screened Poisson that is told the true normals. Needs open3d.

    python benchmarks/accuracy.py
    python benchmarks/accuracy.py --points 20000 --json accuracy.json

8,000 points on the torus of radii 1 and 0.4, their density varying by a ratio of 1, 10 or 50, without noise or with a standard
deviation of 0.005 in every direction. Of each mesh: the mean distance of points spread evenly over it to the torus. Poisson gets the
true normals, and the best of its depths 7 to 9 counts; recon gets points alone.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from clouds import torus
from numpy.typing import NDArray

import recon
from recon.postprocess import refine
from recon.proximity import area_samples

RATIOS = (1, 10, 50)
NOISES = (0.0, 0.005)
DEPTHS = (7, 8, 9)
SPREAD = 200_000  # points over a mesh


def off(vertices: NDArray, faces: NDArray) -> float:
    """Mean distance of a mesh to the torus."""
    x, y, z = area_samples(vertices, faces, SPREAD, np.random.default_rng(0))[0].T
    return float(np.abs(np.hypot(np.hypot(x, y) - 1, z) - 0.4).mean())


def poisson(points: NDArray, clean: NDArray) -> float:
    """The best of the depths, with true normals."""
    import open3d as o3d

    ring = clean * [1, 1, 0]
    normals = clean - ring / np.linalg.norm(ring, axis=1)[:, None]
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals / np.linalg.norm(normals, axis=1)[:, None])
    found = []
    for depth in DEPTHS:
        mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth, n_threads=1)
        found.append(off(np.asarray(mesh.vertices), np.asarray(mesh.triangles)))
    return min(found)


def row(n: int, ratio: float, noise: float) -> dict[str, float]:
    """All contenders on one cloud."""
    points, clean = torus(n, ratio, noise)[0], torus(n, ratio, 0.0)[0]
    raw = recon.reconstruct(points, denoise=False)
    default = recon.reconstruct(points)
    begin = time.process_time()
    fine, inserted = refine(default.mesh)
    seconds = time.process_time() - begin
    return {
        "ratio": ratio,
        "noise": noise,
        "poisson": poisson(points, clean),
        "interpolating": off(raw.mesh.vertices, raw.mesh.faces),
        "default": off(default.mesh.vertices, default.mesh.faces),
        "refined": off(fine.vertices, fine.faces),
        "chi": default.report["mesh"]["chi"],
        "inserted": inserted,
        "refine_cpu_seconds": seconds,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=8000)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = [row(options.points, ratio, noise) for noise in NOISES for ratio in RATIOS]
    print(
        "| noise | ratio | Poisson, true normals | interpolating | default | refined | Poisson / refined | chi | inserted |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for r in rows:
        lengths = " | ".join(f"{r[name]:.5f}" for name in ("poisson", "interpolating", "default", "refined"))
        ahead = r["poisson"] / r["refined"]
        print(f"| {r['noise']} | {r['ratio']} | {lengths} | {ahead:.2f} | {r['chi']} | {r['inserted']:,} |")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
