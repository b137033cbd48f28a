"""How often weights are found under which W_0 is a closed surface (level 1), or has one as its outer boundary (level 2).

    python benchmarks/closing.py                                      # every closed surface of the catalogue, two samplings
    python benchmarks/closing.py --meshes DIRECTORY --json closing.json     # and the vertices of closed meshes there

A success is a level that is certain, the right Euler characteristic, and more than 99 % of the points on the surface. The
column `level` says what was reached, whatever the topology; `covering` what the weights that it starts from reach.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import datasets_synthetic
import recon
import weighting
from recon.topology import topology

ENOUGH = 0.99


def clouds(names: list[str], n: int, seed: int, meshes: Path | None) -> Iterator[tuple[str, str, int, NDArray]]:
    """Name, sampling, true Euler characteristic, points."""
    for name in names:
        surface = datasets_synthetic.surface(name)
        for spacing in ("random", "blue"):
            yield name, spacing, surface.euler, surface.sample(n, spacing=spacing, rng=seed).points
    for path in sorted(meshes.iterdir()) if meshes else []:
        if path.suffix in (".off", ".obj", ".ply", ".stl"):
            mesh = recon.read_mesh(path)
            truth = topology(mesh.faces)
            if truth.closed:
                yield path.stem, "vertices", truth.euler, np.unique(mesh.vertices, axis=0)


def measure(points: NDArray, rounds: int) -> dict:
    """What covering weights reach, and what closing weights do."""
    start = weighting.closure(points, weighting.adaptive_weights(points, radius="covering"))
    busy = time.process_time()
    found = weighting.closing_weights(points, rounds=rounds)
    busy = time.process_time() - busy
    again = weighting.closure(points, found.weights)
    if (again.level, again.euler, len(again.faces)) != (found.level, found.euler, len(found.faces)):
        raise AssertionError(f"the weights reach {again}, not {found}")
    return {
        "level": found.level,
        "euler": found.euler,
        "components": found.components,
        "share": found.share,
        "cells": found.cells,
        "open": found.open_edges,
        "branched": found.nonmanifold_edges,
        "pinched": found.nonmanifold_vertices,
        "loose": found.loose,
        "rounds": found.rounds,
        "cpu": busy,
        "covering": start.level,
    }


def line(result: dict) -> str:
    """One row of the table."""
    figures = result["found"]
    success = figures["level"] if result["success"] else "-"
    return (
        f"{result['cloud']:24s}{result['sampling']:10s}{result['points']:7d}{result['true_euler']:6d}{figures['covering']:10d}"
        f"{figures['level']:7d}{figures['euler']:7d}{figures['components']:7d}{figures['share']:9.2%}{figures['cells']:7d}"
        f"{figures['open']:6d}{figures['branched']:9d}{figures['pinched']:8d}{figures['loose']:6d}{figures['rounds']:7d}"
        f"{figures['cpu']:8.1f}{success!s:>9s}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    closed = datasets_synthetic.surfaces(3, closed=True)
    parser.add_argument("--surfaces", nargs="*", default=list(closed), choices=closed, metavar="NAME")
    parser.add_argument("--meshes", type=Path, metavar="DIRECTORY", help="closed meshes: their vertices are clouds too")
    parser.add_argument("--points", type=int, default=3000, metavar="N")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--json", type=Path, help="file to write all figures to")
    arguments = parser.parse_args()

    print(
        f"{'cloud':24s}{'sampling':10s}{'points':>7s}{'true':>6s}{'covering':>10s}{'level':>7s}{'euler':>7s}{'comp.':>7s}"
        f"{'share':>9s}{'cells':>7s}{'open':>6s}{'branched':>9s}{'pinched':>8s}{'loose':>6s}{'rounds':>7s}{'cpu s':>8s}"
        f"{'success':>9s}"
    )
    results = []
    for name, sampling, euler, points in clouds(arguments.surfaces, arguments.points, arguments.seed, arguments.meshes):
        found = measure(points, arguments.rounds)
        success = found["level"] > 0 and found["euler"] == euler and found["share"] > ENOUGH
        results.append(
            {
                "cloud": name,
                "sampling": sampling,
                "points": len(points),
                "true_euler": euler,
                "found": found,
                "success": success,
            }
        )
        print(line(results[-1]), flush=True)
    for sampling in dict.fromkeys(result["sampling"] for result in results):
        these = [result for result in results if result["sampling"] == sampling]
        levels = [result["found"]["level"] for result in these if result["success"]]
        print(f"{sampling}: level 1 on {levels.count(1)}, level 2 on {levels.count(2)} of {len(these)}")
    if arguments.json:
        machine = {"platform": platform.platform(), "python": platform.python_version()}
        arguments.json.write_text(json.dumps({"machine": machine, "results": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
