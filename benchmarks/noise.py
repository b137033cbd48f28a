"""How much noise is taken out, and whether the topology survives it; against Poisson with estimated normals. Needs open3d.

    python benchmarks/noise.py
    python benchmarks/noise.py --points 60000 --json noise.json

Samples of the surfaces of the catalogue, at random by area, with noise along the normal, its standard deviation in mean spacings
(one sample owns a squared spacing). And noise of half a spacing that is not the same everywhere: along the line of sight of a
distant sensor, growing from nothing to twice that along x, in one half of the cloud alone, and in a fifth of it. Counted are the results with the true Euler characteristic and boundary loops, 2-manifold; of
those, the median of what is left: mean distance of points spread over the mesh to the surface, over that of the samples.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from peers import PEERS, nearest

import datasets_synthetic
import recon
from recon.proximity import area_samples
from recon.topology import topology

NOISES = (0.25, 0.5, 1.0, 2.0, "line of sight", "growing", "half", "a fifth")
UNEVEN = 0.5  # spacings
SPREAD = 20_000  # points over a mesh
CLOSED = datasets_synthetic.surfaces(3, closed=True)
OPEN = [name for name in datasets_synthetic.surfaces(3) if name not in CLOSED]


def ours(points: NDArray) -> recon.Mesh:
    """Default settings."""
    return recon.reconstruct(points).mesh


def poisson(points: NDArray) -> recon.Mesh:
    """Open3D's, as in the evidence."""
    return next(iter(PEERS["Open3D Poisson"].run(points, nearest(points))))


def uneven(clean: datasets_synthetic.Sample, kind: str) -> NDArray:
    """Displacements by noise of one, on average over the noisy part, that depends on place or direction."""
    x, error = clean.points[:, :1], np.random.default_rng(1).normal(size=(len(clean), 1))
    if kind == "line of sight":
        return error * [0.0, 0.0, 1.0]
    share = {
        "growing": 2 * (x - x.min()) / np.ptp(x),
        "half": x > np.quantile(x, 0.5),
        "a fifth": x > np.quantile(x, 0.8),
    }[kind]
    return error * share * clean.normals


def row(name: str, n: int, noise: float | str, method: Callable[[NDArray], recon.Mesh]) -> dict[str, float]:
    """One method on one cloud; noise in spacings, or the kind of that which is uneven."""
    truth = datasets_synthetic.surface(name)
    spacing = np.sqrt(truth.area / n)
    if isinstance(noise, str):
        clean = truth.sample(n, rng=0)
        points = clean.points + UNEVEN * spacing * uneven(clean, noise)
    else:
        points = np.array(truth.sample(n, noise=noise * spacing, rng=0).points)
    begin = time.perf_counter()
    mesh = method(points)
    seconds = time.perf_counter() - begin
    t = topology(mesh.faces)
    right = t.manifold and (t.euler, t.boundary_loops) == (truth.euler, truth.boundary_loops)
    spread = area_samples(mesh.vertices, mesh.faces, SPREAD, np.random.default_rng(0))[0]
    left = np.abs(truth.distance(spread)).mean() / np.abs(truth.distance(points)).mean()
    return {"right": bool(right), "euler": t.euler, "loops": t.boundary_loops, "left": float(left), "seconds": seconds}


def shown(noise: float | str) -> str:
    """Heading of a column."""
    return noise if isinstance(noise, str) else f"noise {noise:g}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=20_000)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    found = {}
    print(
        f"| surfaces | method | {' | '.join(shown(noise) for noise in NOISES)} | wrong |\n|{'---|' * (len(NOISES) + 3)}"
    )
    for kind, names, methods in (("closed", CLOSED, (ours, poisson)), ("open", OPEN, (ours,))):
        for method in methods:
            cells, wrong = [], []
            for noise in NOISES:
                rows = {name: row(name, options.points, noise, method) for name in names}
                found[f"{kind}, {method.__name__}, {shown(noise)}"] = rows
                good = [r["left"] for r in rows.values() if r["right"]]
                cells.append(f"{len(good)} of {len(names)}; {np.median(good) if good else np.nan:.2f}")
                wrong += [f"{name}, {shown(noise)}" for name, r in rows.items() if not r["right"]]
            print(
                f"| {kind} | {method.__name__} | {' | '.join(cells)} | {'; '.join(wrong) if method is ours else len(wrong)} |",
                flush=True,
            )
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
