"""Time triangulation, alpha shape and intervals against other programs, and print a table with ratios.

    python benchmarks/bench.py                                   # torus, 10,000 and 100,000 points, all that is installed
    python benchmarks/bench.py --points 1000000 --only recon diode --json bench.json

Every run is a process of its own, on one processor unless it has several threads, warmed up with a small cloud first
(imports, compiled kernels), so that neither memory nor thread pools of one contender touch another's. Contenders take
turns; the fastest run of each counts, and ratios are of processor time, which other users of the machine disturb least;
what threads gain is seen in the seconds. Memory is the peak of the process beyond what it had before the run, input
included in neither.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from clouds import CLOUDS
from numpy.typing import NDArray

PACKAGES = ("numpy", "numba", "scipy", "diode", "gudhi", "open3d")
Run = Callable[[NDArray, NDArray], int]  # points, weights -> number of cells, facets or simplices


def recon_triangulation(points, weights):
    import recon

    return len(recon.regular_triangulation(points, weights).cells)


def recon_boundary(points, weights):
    import recon

    return len(recon.alpha_complex(points, weights).boundary(0.0).facets)


def recon_boundary_on_threads(points, weights):
    from recon.scale.tiles import tiled_boundary

    return len(tiled_boundary(points, weights, threads=2).facets)


def recon_intervals(points, weights):
    import recon

    family = recon.alpha_complex(points, weights)
    return sum(len(family.simplices(k)) + 0 * len(family.mu_upper(k)) for k in range(family.dimension + 1))


def scipy_triangulation(points, weights):
    from scipy.spatial import ConvexHull

    centered = points - points.mean(axis=0)
    hull = ConvexHull(np.column_stack([centered, (centered**2).sum(axis=1) - weights]), qhull_options="Qt")
    return int(np.count_nonzero(hull.equations[:, -2] < 0))


def diode_triangulation(points, weights):
    import diode

    return len(diode.fill_weighted_delaunay_arrays(np.column_stack([points, weights]))[-1])


def diode_intervals(points, weights):
    import diode

    found = diode.fill_weighted_alpha_shapes_arrays(np.column_stack([points, weights]))
    return sum(len(simplices) for simplices in found[0])


def gudhi_intervals(precision):
    def run(points, weights):
        import gudhi

        return (
            gudhi.AlphaComplex(points=points, weights=weights, precision=precision)
            .create_simplex_tree()
            .num_simplices()
        )

    return run


def open3d_shape(points, weights):
    """No weights; a radius as large as the largest of ours, for it has but one."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    radius = float(np.sqrt(max(weights.max(), 1e-4)))
    return len(open3d.geometry.TriangleMesh.create_from_point_cloud_alpha_shape(cloud, radius).triangles)


# Job -> contender -> (package it needs, run). The first of each job is ours: ratios are to it.
JOBS: dict[str, dict[str, tuple[str, Run]]] = {
    "regular triangulation": {
        "recon": ("recon", recon_triangulation),
        "diode": ("diode", diode_triangulation),
        "scipy": ("scipy", scipy_triangulation),
    },
    "W_0: oriented facets": {
        "recon": ("recon", recon_boundary),
        "recon, two threads": ("recon", recon_boundary_on_threads),
        "diode, R alone": ("diode", diode_triangulation),
        "open3d, unweighted": ("open3d", open3d_shape),
    },
    "all intervals": {
        "recon": ("recon", recon_intervals),
        "diode": ("diode", diode_intervals),
        "gudhi fast": ("gudhi", gudhi_intervals("fast")),
        "gudhi safe": ("gudhi", gudhi_intervals("safe")),
    },
}


def work(job: str, contender: str, cloud: str, n: int, cpu: int | None) -> dict:
    """One run, in this process."""
    if cpu is not None and "threads" not in contender and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {cpu})
    run = JOBS[job][contender][1]
    points, weights = CLOUDS[cloud](n)
    run(*CLOUDS[cloud](500))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, busy = time.perf_counter(), time.process_time()
    count = run(points, weights)
    wall, busy = time.perf_counter() - wall, time.process_time() - busy
    unit = 1024 if platform.system() == "Darwin" else 1
    peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / unit / 1024
    return {"seconds": wall, "cpu_seconds": busy, "megabytes": peak, "count": count}


def measure(job: str, contender: str, cloud: str, n: int, cpu: int | None, limit: float) -> dict:
    """One run, in a process of its own."""
    command = [sys.executable, __file__, "--worker", json.dumps([job, contender, cloud, n, cpu])]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return {"failed": f"more than {limit:g} s"}
    if done.returncode != 0:
        return {"failed": (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]}
    return json.loads(done.stdout.splitlines()[-1])


def table(results: list[dict]) -> str:
    """One line a contender, the fastest of its runs, and how many times longer than ours it took."""
    lines = [
        f"{'job':24s}{'cloud':8s}{'points':>9s}  {'contender':20s}{'seconds':>9s}{'cpu':>9s}{'ratio':>7s}{'MB':>7s}{'result':>12s}"
    ]
    for result in results:
        head = f"{result['job']:24s}{result['cloud']:8s}{result['points']:9d}  {result['contender']:20s}"
        good = [run for run in result["runs"] if "seconds" in run]
        if not good:
            lines.append(f"{head}  {result['runs'][0]['failed']}")
            continue
        best = {key: min(run[key] for run in good) for key in ("seconds", "cpu_seconds", "megabytes", "count")}
        same = (r for r in results if all(r[key] == result[key] for key in ("job", "cloud", "points")))
        ours = min((run["cpu_seconds"] for run in next(same)["runs"] if "seconds" in run), default=np.nan)
        lines.append(
            f"{head}{best['seconds']:9.3f}{best['cpu_seconds']:9.3f}{best['cpu_seconds'] / ours:7.1f}"
            f"{best['megabytes']:7.0f}{best['count']:12d}"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=[10_000, 100_000], metavar="N")
    parser.add_argument("--clouds", nargs="+", default=["torus"], choices=CLOUDS)
    parser.add_argument("--jobs", nargs="+", default=list(JOBS), choices=JOBS)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="contenders whose names begin so")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--cpu", type=int, default=0, help="processor to stay on, -1 for all (default: %(default)s)")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds a run may take (default: %(default)s)")
    parser.add_argument("--json", type=Path, help="file to write all figures to")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        print(json.dumps(work(*json.loads(arguments.worker))))
        return

    cpu = arguments.cpu if arguments.cpu >= 0 else None
    results = [
        {"job": job, "cloud": cloud, "points": n, "contender": name, "runs": []}
        for cloud in arguments.clouds
        for n in arguments.points
        for job in arguments.jobs
        for name, (package, _) in JOBS[job].items()
        if importlib.util.find_spec(package) and (not arguments.only or name.startswith(tuple(arguments.only)))
    ]
    for _ in range(arguments.repeat):
        for result in results:
            if result["runs"] and "failed" in result["runs"][0]:
                continue
            print(f"{result['job']}, {result['cloud']} {result['points']}, {result['contender']} ...", file=sys.stderr)
            names = (result[key] for key in ("job", "contender", "cloud", "points"))
            result["runs"].append(measure(*names, cpu, arguments.limit))
    print(table(results))
    if arguments.json:
        machine = {
            "platform": platform.platform(),
            "python": platform.python_version(),
            "versions": {name: version(name) for name in PACKAGES if importlib.util.find_spec(name)},
        }
        arguments.json.write_text(json.dumps({"machine": machine, "results": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
