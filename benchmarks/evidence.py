"""All the evidence there is: every surface of the catalogue in many conditions, every file of a folder, and the peers.

    python benchmarks/evidence.py OUT                          # synthetic surfaces; less than an hour on two idle cores
    python benchmarks/evidence.py OUT --data FOLDER            # the files of FOLDER too (default: $RECON_DATA)
    python benchmarks/evidence.py OUT --quick                  # one thing at a time, recon alone: minutes
    python benchmarks/evidence.py OUT --only "torus, "         # runs whose name, "CONTENDER: CASE", contains this

Writes to the folder OUT: results.json (every figure of every run; what is there already is not run again), results.md (the tables)
and results.html (the tables, and pictures of the synthetic surfaces). Failures come first.

*Solved*: closed, 2-manifold, outward, with the true Euler characteristic (of an open surface: 2-manifold with the true Euler
characteristic and boundary loops), more than 99 % of the genuine samples used as vertices, and mean distances from the mesh to
the true surface and back below a quarter of d1, the median distance between nearest neighbours of the samples before noise.
A contender that tries several values of its parameter is counted by the best of them, chosen with the truth in hand; one that
places its own vertices is excused from using the samples. Where a piece was removed, the result may be closed over the hole, or keep it
as one boundary loop. Scans have no truth: of them only the reading as closed or open is judged, where it is known.

Every contender runs in processes of its own; what takes longer than LIMIT or crashes is a failure with that reason.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import evidence_report
import numpy as np
from evidence_clouds import CLOSED, Case, Cloud, cloud_of, files, synthetic
from peers import CONTENDERS, PEERS, RECON, WEIGHTS

import recon
from recon.page import raster

SAMPLES = 20_000  # points that distances are taken from, either way
ACCURATE = 0.25  # d1
USED = 0.99
LIMIT = 300.0  # seconds by the clock that a run may take, judging included
PICTURE = (112, 84)  # pixels
EYE = (0.6, -1.5, 0.9)  # direction that pictures are seen from
# How scans are to be read, where that is known of them. Base and belly of bunny_5000 and horse have holes: either will do.
READINGS = {
    "kitten.xyz": "closed", "sphere_20k.xyz": "closed", "spheres.ply": "closed", "tore3D_300.off": "closed",
    "sphere3D_pts_on_grid.off": "closed", "hippo1.ply": "open", "oni.pwn": "open", "before_upsample.xyz": "open", "half.xyz": "open",
    "fin90_with_PCA_normals.xyz": "open", "point_set_2.xyz": "planar", "bun0.pcd": "open", "lamppost.pcd": "open", "milk.pcd": "open",
    "samp11-utm.pcd": "terrain", "urban.las": "terrain", "simple.las": "open",
}  # fmt: skip


def judge(mesh: recon.Mesh, cloud: Cloud, interpolates: bool) -> dict[str, Any]:
    """Measure a mesh against the truth and list what is wrong with it, worst first; nothing wrong: solved."""
    if len(mesh.faces) == 0:
        return {"faults": ["no faces"]}
    found = {metric.name: metric.value for metric in recon.measure(mesh, cloud.truth, samples=SAMPLES)}
    kept = ("euler", "components", "boundary_loops", "open_edges", "nonmanifold_edges", "nonmanifold_vertices", "faces")
    figures: dict[str, Any] = {name: found[name] for name in kept}
    source = mesh.vertex_source[np.unique(mesh.faces)]
    used = np.unique(source[source >= 0])
    figures["used"] = float(cloud.genuine[used].sum() / cloud.genuine.sum())
    figures["outliers_used"] = int((~cloud.genuine[used]).sum())
    figures["intersections"] = found["self_intersections"]
    faults = []
    if cloud.truth is not None:
        off = [found[f"{way}_reference_mean"] for way in ("to", "from")]
        figures["off"] = max(off) / cloud.near if None not in off else None
        figures["right"] = cloud.topologies[0]
        shape = (found["euler"], found["boundary_loops"])
        closed = shape[1] > 0 or (found["closed"] and found["outward"])
        figures["shape"] = bool(shape in cloud.topologies and found["manifold"] and closed)
        if not found["manifold"]:
            count = f"{found['nonmanifold_edges']} edges, {found['nonmanifold_vertices']} vertices"
            faults.append(f"not manifold: {count}")
        if shape not in cloud.topologies:
            faults.append(_wrong_shape(shape, cloud.topologies[0]))
        if shape[1] == 0 and not found["closed"]:
            faults.append("not closed")  # edges of three faces, and none of one
        if found["closed"] and found["manifold"] and not found["outward"]:
            faults.append("not outward")
        if interpolates and figures["used"] <= USED:
            faults.append(f"{figures['used']:.1%} of the samples used")
        if figures["off"] is None:
            faults.append("no area")
        elif figures["off"] >= ACCURATE:
            faults.append(f"{figures['off']:.2f} d1 off")
    return {**figures, "faults": faults}


def _wrong_shape(shape: tuple[int, int], right: tuple[int, int]) -> str:
    """How the topology differs from the truth, in words."""
    if (shape[1] > 0) != (right[1] > 0):
        return f"open: {shape[1]} loops, chi {shape[0]}, not {right[0]}" if shape[1] else "closed over its boundary"
    loops = f", {shape[1]} loops, not {right[1]}" if right[1] or shape[1] else ""
    return f"chi {shape[0]}, not {right[0]}{loops}"


def run(contender: str, case: Case, folder: Path | None, pictures: Path) -> dict[str, Any]:
    """One contender on one cloud: the best of its meshes, judged and, of a synthetic surface, drawn."""
    cloud = cloud_of(case, folder)
    how = CONTENDERS[contender]
    begin, made, best, shown = time.process_time(), 0, None, None
    spent = 0.0
    for result in how.run(cloud.points, cloud.near):
        spent += time.process_time() - begin
        made += 1
        mesh = result if isinstance(result, recon.Mesh) else result.mesh
        judged = judge(mesh, cloud, how.interpolates)
        if isinstance(result, recon.Reconstruction):
            judged.update(_own_words(result))
            wanted = READINGS.get(case.source.rpartition("/")[2], result.surface)
            judged["faults"] += [f"read as {result.surface}, not {wanted}"] * (wanted != result.surface)
            if "certificate" in judged:
                judged["faults"].append(f"certificate: {judged['certificate']}")
        rank = (judged["faults"] != [], not judged.get("shape"), np.inf if judged.get("off") is None else judged["off"])
        if best is None or rank < best[0]:
            best, shown = (rank, judged), mesh
        begin = time.process_time()
    if best is None or shown is None:
        return {"faults": ["no mesh"], "cpu": spent}
    figures = {"points": len(cloud.points), **best[1], "cpu": spent / made}
    if "/" not in case.source and (contender == RECON or case.condition == "plain"):
        figures["picture"] = "".join(c if c.isalnum() else "_" for c in f"{contender} {case.name}") + ".png"
        drawn = raster.picture(shown.vertices, shown.faces, EYE, (0, 0, 1), PICTURE)
        (pictures / figures["picture"]).write_bytes(drawn)
    return figures


def _own_words(result: recon.Reconstruction) -> dict[str, Any]:
    """What recon says of itself: reading, confidence, and whether its certificate holds."""
    said = result.report["samples"]
    words = {
        "surface": result.surface,
        "confidence": result.confidence,
        "because": result.report["surface"]["because"],
        "denoised": said["denoised"],
        "removed_outliers": said["removed_outliers"],
        "noise": said.get("noise_in_spacings"),
    }
    try:
        recon.certify(result)
    except recon.CertificateError as error:
        words["certificate"] = str(error)
    return words


def serve(pipe: Any, contender: str, folder: Path | None, pictures: Path) -> None:
    """Answer cases one after the other, in a process of its own."""
    for case in iter(pipe.recv, None):
        try:
            pipe.send(run(contender, case, folder, pictures))
        except Exception as error:  # whatever it is, it is a failure of that contender, by name
            pipe.send({"faults": [f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"]})


class Runner:
    """A process that serves one contender at a time, and is replaced where it crashes or is late."""

    def __init__(self, folder: Path | None, pictures: Path):
        self._context = multiprocessing.get_context("spawn")
        self._places = folder, pictures
        self._contender = ""
        self._process: Any = None

    def __call__(self, contender: str, case: Case) -> dict[str, Any]:
        if self._process is None or self._contender != contender:
            self.stop()
            self._pipe, theirs = self._context.Pipe()
            self._process = self._context.Process(target=serve, args=(theirs, contender, *self._places), daemon=True)
            self._process.start()
            theirs.close()
            self._contender = contender
            self._pipe.send(Case("sphere"))  # imports, kernels, thread pools: not to be counted
            self._answer(10 * LIMIT)
        if self._process is None:
            return {"faults": ["crashed at its start"]}
        self._pipe.send(case)
        return self._answer(LIMIT)

    def _answer(self, limit: float) -> dict[str, Any]:
        late = not self._pipe.poll(limit)
        try:
            if not late:
                return self._pipe.recv()
        except EOFError:
            pass
        self._process.kill()
        self._process.join()
        code, self._process = self._process.exitcode, None
        return {"faults": [f"more than {limit:g} s" if late else f"crashed, exit code {code}"]}

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._pipe.send(None)
            self._process.join()
            self._process = None


def tasks(folder: Path | None, quick: bool) -> Iterator[tuple[str, Case]]:
    """What is run: recon on everything, uniform weights where density varies, peers where one thing is done at a time."""
    made = [case for case in synthetic() if not quick or case.single]
    given = list(files(folder)) if folder else []
    yield from ((RECON, case) for case in [*made, *given])
    if quick:
        return
    meshes = [case for case in given if case.source.startswith("meshes/")]
    for contender in WEIGHTS:
        graded = [case for case in made if case.single and case.density != 1]
        yield from ((contender, case) for case in graded if fits(contender, case))
    for contender in PEERS:
        if importlib.util.find_spec(PEERS[contender].package):
            alone = [case for case in made if case.single]
            yield from ((contender, case) for case in [*alone, *meshes] if fits(contender, case))


def fits(contender: str, case: Case) -> bool:
    """Whether a contender can do this at all; an open mesh among the files is for it to fail on."""
    return not CONTENDERS[contender].closes or "/" in case.source or case.source in CLOSED


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--data", type=Path, default=os.environ.get("RECON_DATA"), metavar="FOLDER")
    parser.add_argument("--only", default="", metavar="TEXT")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (default: %(default)s)")
    options = parser.parse_args()
    pictures = options.out / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    file = options.out / "results.json"
    done: dict[str, dict[str, Any]] = json.loads(file.read_text()) if file.exists() else {}
    waiting = [
        (contender, case)
        for contender, case in tasks(options.data, options.quick)
        if f"{contender}: {case.name}" not in done and options.only in f"{contender}: {case.name}"
    ]
    total, lock = len(waiting), threading.Lock()
    waiting.reverse()
    os.environ.setdefault("OMP_NUM_THREADS", "1")

    def work() -> None:
        runner = Runner(options.data, pictures)
        while True:
            with lock:
                if not waiting:
                    break
                contender, case = waiting.pop()
            result = runner(contender, case)
            result = {"contender": contender, "source": case.source, "condition": case.condition, **result}
            with lock:
                done[f"{contender}: {case.name}"] = result
                save(file, done)
                print(
                    f"{total - len(waiting)}/{total} {contender}: {case.name}: {result['faults'] or 'ok'}",
                    file=sys.stderr,
                )
        runner.stop()

    threads = [threading.Thread(target=work) for _ in range(options.jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    evidence_report.write(list(done.values()), options.out)


def save(file: Path, done: Any) -> None:
    """Write whole or not at all."""
    new = file.with_suffix(".new")
    new.write_text(json.dumps(done, indent=0) + "\n")
    new.replace(file)


if __name__ == "__main__":
    main()
