"""Tables and a page of pictures from the figures of `evidence.py`. Failures first."""

from __future__ import annotations

import platform
import time
from collections.abc import Iterable, Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from peers import PEERS, RECON, WEIGHTS

import datasets_synthetic
from recon.page.raster import as_url

Result = dict[str, Any]
SURFACES, CLOSED = datasets_synthetic.surfaces(3), datasets_synthetic.surfaces(3, closed=True)
CONDITIONS = (
    "plain",
    "density 10",
    "density 50",
    "noise 0.1",
    "noise 0.5",
    "10% outliers",
    "lines 5",
    "lines 12",
    "hole",
)
PACKAGES = ("weighted-alpha-recon", "open3d", "pymeshlab", "numpy", "numba")


def write(results: Sequence[Result], out: Path) -> None:
    """Write results.md and results.html to a folder; pictures are taken from its folder `pictures`."""
    sections = [
        (FAILED, failures(results)),
        ("Solved, one thing at a time: closed surfaces", contest(results, closed=True)),
        ("Solved, one thing at a time: open surfaces", contest(results, closed=False)),
        ("Solved by recon, everything at once: closed surfaces", crossed(results, closed=True)),
        ("Solved by recon, everything at once: open surfaces", crossed(results, closed=False)),
        ("Adaptive against uniform weights, where density varies", duels(results)),
        ("The same, set by set", weights(results)),
        ("Models with a truth", models(results)),
        ("Scans", scans(results)),
    ]
    sections = [(title, rows) for title, rows in sections if len(rows) > 1]
    text = [f"# Evidence\n\n{machine()}\n", f"{LEGEND}\n"]
    text += [f"## {title}\n\n{markdown(rows)}\n" for title, rows in sections]
    (out / "results.md").write_text("\n".join(text), encoding="utf-8")
    bad, *good = gallery(results, out / "pictures")
    page = [f"<h1>Evidence</h1><p>{escape(machine())}</p>", bad, f"<p>{escape(LEGEND)}</p>"]
    page += [f"<h2>{escape(title)}</h2>{html(rows)}" for title, rows in sections if title != FAILED]
    (out / "results.html").write_text(PAGE + "".join([*page, *good]), encoding="utf-8")


FAILED = "What recon does not solve"
LEGEND = (
    "In each cell: solved / right topology (of 16 closed or 6 open surfaces); median distance from the true surface in d1, the median "
    "distance between nearest neighbours (the larger of both ways)."
)
PAGE = """<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>Evidence</title>
<style>
body { font: 14px/1.45 system-ui, sans-serif; margin: 2rem; color: #222; background: #fff }
table { border-collapse: collapse; margin: 1rem 0 } td, th { border: 1px solid #ccc; padding: .15rem .5rem; text-align: left }
.all { display: flex; flex-wrap: wrap; gap: .5rem }
figure { margin: 0; width: 116px; border: 2px solid #9b9; border-radius: 4px; font-size: 11px; overflow-wrap: anywhere }
figure.bad { border-color: #c33 } figcaption { padding: .2rem .3rem } img { display: block; width: 112px; height: 84px }
</style>
"""


def machine() -> str:
    """Versions and place, in a line."""
    known = []
    for name in PACKAGES:
        try:
            known.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return f"{time.strftime('%Y-%m-%d')}, {platform.system()} {platform.machine()}, Python {platform.python_version()}, {', '.join(known)}."


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table, its head first."""
    head, *body = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body])


def html(rows: Sequence[Sequence[str]]) -> str:
    """The same for a page."""
    lines = [
        "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) + "</tr>"
        for tag, part in (("th", rows[:1]), ("td", rows[1:]))
        for row in part
    ]
    return f"<table>{''.join(lines)}</table>"


def cell(results: Iterable[Result], whole: int) -> str:
    """How many are solved, how many have the right topology, and the median distance; of how many where it is not the whole."""
    these = list(results)
    if not these:
        return ""
    solved, shape = sum(map(_solved, these)), sum(map(_shape, these))
    off = float(np.median([np.inf if r.get("off") is None else r["off"] for r in these]))
    return f"{solved} / {shape}; {off:.2f}" + f" (of {len(these)})" * (len(these) != whole)


def how_many(closed: bool) -> int:
    """Closed or open surfaces in the catalogue."""
    return len(CLOSED) if closed else len(SURFACES) - len(CLOSED)


def synthetic(results: Iterable[Result], contender: str, closed: bool) -> list[Result]:
    """Runs of one contender on closed or open surfaces of the catalogue."""
    these = [r for r in results if r["contender"] == contender and r["source"] in SURFACES]
    return [r for r in these if (r["source"] in CLOSED) == closed]


def failures(results: Sequence[Result]) -> list[list[str]]:
    """Every run of recon that is not solved, and why."""
    bad = [r for r in results if r["contender"] == RECON and r["faults"]]
    return [
        ["source", "condition", "what is wrong"],
        *([r["source"], r["condition"], "; ".join(r["faults"])] for r in bad),
    ]


def contest(results: Sequence[Result], closed: bool) -> list[list[str]]:
    """Contenders against conditions."""
    rows = [["", *CONDITIONS[: None if closed else -1], "CPU s"]]
    for name in (RECON, *WEIGHTS, *PEERS):
        these = [r for r in synthetic(results, name, closed) if r["condition"] in CONDITIONS]
        if these:
            cells = [cell((r for r in these if r["condition"] == c), how_many(closed)) for c in rows[0][1:-1]]
            rows.append([name, *cells, f"{np.mean([r['cpu'] for r in these if 'cpu' in r]):.2f}"])
    return rows


def crossed(results: Sequence[Result], closed: bool) -> list[list[str]]:
    """Density and noise against outliers and holes."""
    these = synthetic(results, RECON, closed)
    columns = ["", "10% outliers", "hole", "10% outliers, hole"][: None if closed else 2]
    rows = [["density, noise", *(column or "neither" for column in columns)]]
    for before in dict.fromkeys(_graded_and_noisy(r["condition"]) for r in these):
        wanted = [", ".join(part for part in (before, column) if part) or "plain" for column in columns]
        rows.append(
            [
                before or "even, none",
                *(cell((r for r in these if r["condition"] == w), how_many(closed)) for w in wanted),
            ]
        )
    return rows


def _graded_and_noisy(condition: str) -> str:
    return ", ".join(part for part in condition.split(", ") if part.startswith(("density", "lines", "noise")))


def weights(results: Sequence[Result]) -> list[list[str]]:
    """Every density-graded set: what each way of weighing reaches."""
    table = {(r["contender"], r["source"], r["condition"]): r for r in results}
    names = (RECON, *WEIGHTS)
    rows = [["set", *names]]
    for source in SURFACES:
        for condition in ("density 10", "density 50"):
            found = [table.get((name, source, condition)) for name in names]
            if found[0] and found[1]:
                rows.append([f"{source}, {condition}", *("" if r is None else verdict(r) for r in found)])
    return rows


DUELS = (
    (RECON, "recon, uniform weights"),
    (RECON, "recon, one spacing, best of 4"),
    (RECON, "W_0, best of 10 uniform"),
    ("W_0, closing weights", "W_0, best of 10 uniform"),
    ("W_0, covering weights", "W_0, best of 10 uniform"),
    ("W_0, best of 10 spacing", "W_0, best of 10 uniform"),
    ("W_0, best of 10 covering", "W_0, best of 10 uniform"),
)
CLOSER = 0.95  # times the distance of the other, to be counted as better where the rest is equal


def duels(results: Sequence[Result]) -> list[list[str]]:
    """Where adaptive weights win, draw or lose: solved first, then right topology, then distance."""
    table = {(r["contender"], r["source"], r["condition"]): r for r in results}
    rows = [["adaptive", "uniform", "condition", "solved", "right topology", "better", "alike", "worse", "where worse"]]
    for ours, theirs in DUELS:
        for condition in ("density 10", "density 50"):
            keys = [(source, condition) for source in SURFACES]
            pairs = [
                (s, table[ours, s, c], table[theirs, s, c])
                for s, c in keys
                if (ours, s, c) in table and (theirs, s, c) in table
            ]
            if not pairs:
                continue
            signs = [compare(a, b) for _, a, b in pairs]
            solved, shape = (
                f"{sum(map(good, (a for _, a, _ in pairs)))} : {sum(map(good, (b for _, _, b in pairs)))}"
                for good in (_solved, _shape)
            )
            counts = [f"{signs.count(sign)}" for sign in (1, 0, -1)]
            worse = ", ".join(source for (source, *_), sign in zip(pairs, signs) if sign < 0)
            rows.append([ours, theirs, condition, f"{solved} of {len(pairs)}", shape, *counts, worse])
    return rows


def compare(one: Result, two: Result) -> int:
    """1 where the first is better, -1 where the second is, 0 where they are alike."""
    for good in (_solved, _shape):
        if good(one) != good(two):
            return 1 if good(one) else -1
    a, b = (np.inf if r.get("off") is None else r["off"] for r in (one, two))
    return int(a < CLOSER * b) - int(b < CLOSER * a)


def _solved(result: Result) -> bool:
    return not result["faults"]


def _shape(result: Result) -> bool:
    return bool(result.get("shape"))


def verdict(result: Result) -> str:
    """Solved and how close, or what is wrong."""
    if result["faults"]:
        return "; ".join(result["faults"])
    return f"solved, {result['off']:.3f}" if "off" in result else "ok"


def models(results: Sequence[Result]) -> list[list[str]]:
    """Files with a truth: solved, or the first of what is wrong, by contender."""
    these = [r for r in results if r["source"].startswith("meshes/")]
    names = [name for name in (RECON, *PEERS) if any(r["contender"] == name for r in these)]
    table = {(r["contender"], r["source"]): r for r in these}
    rows = [["model", "points", *names]]
    for source in dict.fromkeys(r["source"] for r in these):
        found = [table.get((name, source)) for name in names]
        points = str((found[0] or {}).get("points", ""))
        brief = ("" if r is None else verdict({**r, "faults": r["faults"][:1]}) for r in found)
        rows.append([source.removeprefix("meshes/"), points, *brief])
    solved = [sum(not r["faults"] for r in these if r["contender"] == name) for name in names]
    return [*rows, ["solved", "", *map(str, solved)]]


def scans(results: Sequence[Result]) -> list[list[str]]:
    """Files without a truth: what came out."""
    these = [
        r for r in results if "/" in r["source"] and not r["source"].startswith("meshes/") and r["contender"] == RECON
    ]
    head = ["file", "points", "read as", "confidence", "χ", "pieces", "loops", "non-manifold", "used", "CPU s", "wrong"]
    rows = [head]
    for r in sorted(these, key=lambda r: not r["faults"]):
        if "euler" not in r:
            rows.append([r["source"], str(r.get("points", "")), *[""] * 8, "; ".join(r["faults"])])
            continue
        noise = " (denoised)" if r["denoised"] else ""
        rows.append(
            [
                r["source"], str(r["points"]), r["surface"] + noise, f"{r['confidence']:.2f}", str(r["euler"]),
                str(r["components"]), str(r["boundary_loops"]), str(r["nonmanifold_edges"] + r["nonmanifold_vertices"]),
                f"{r['used']:.1%}", f"{r['cpu']:.2f}", "; ".join(r["faults"]),
            ]
        )  # fmt: skip
    return rows


def gallery(results: Sequence[Result], pictures: Path) -> list[str]:
    """Pictures in three parts: failures of recon, what it solves, the peers."""
    groups = (
        (FAILED, [r for r in results if r["contender"] == RECON and r["faults"]]),
        ("What recon solves", [r for r in results if r["contender"] == RECON and not r["faults"]]),
        ("Others, plain samples", [r for r in results if r["contender"] != RECON]),
    )
    parts = []
    for title, these in groups:
        shown = [r for r in these if "picture" in r and (pictures / r["picture"]).exists()]
        figures = [_figure(r, as_url((pictures / r["picture"]).read_bytes())) for r in shown]
        parts.append(f"<h2>{title}</h2><div class=all>{''.join(figures)}</div>" if figures else "")
    return parts


def _figure(result: Result, url: str) -> str:
    words = [f"{result['source']}, {result['condition']}", verdict(result)]
    if result["contender"] != RECON:
        words.insert(0, result["contender"])
    kind = " class=bad" if result["faults"] else ""
    return f"<figure{kind}><img src='{url}' loading=lazy alt=''><figcaption>{escape(': '.join(words))}</figcaption></figure>"
