"""Draw the pictures of the theory pages, each from the first snippet of its page: docs/pictures/*.svg. Needs matplotlib.

Usage: python docs/pictures.py [NAME ...]. Colours are those of Okabe and Ito, which most colour-blind people can tell apart.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, PathPatch
from matplotlib.path import Path as Path_

DOCS = Path(__file__).parent
INK, GRAY, PALE = "#1a1a1a", "#777777", "#d9e8f3"
BLUE, ORANGE, GREEN, SKY, PURPLE = "#0072b2", "#d55e00", "#009e73", "#56b4e9", "#aa4499"
STYLE = {
    "font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 11, "axes.titlesize": 11,
    "axes.linewidth": 0.6, "axes.spines.top": False, "axes.spines.right": False, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "svg.fonttype": "path", "svg.hashsalt": "recon", "lines.solid_capstyle": "round",
    "legend.frameon": False, "legend.handlelength": 1.4, "legend.fontsize": 10,
}  # fmt: skip


def snippet(page):
    """Run the first Python snippet of a page; give the names that it leaves."""
    text = (DOCS / page).read_text(encoding="utf-8")
    code = text.split("```python\n", 1)[1].split("\n```", 1)[0]
    scene = {}
    exec(compile(code, str(page), "exec"), scene)
    return scene


def panels(columns, width=7.2, height=2.6, *, plane=True):
    """Make a figure of axes side by side; of a plane the axes are not shown."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False)[0]
    for one in axes if plane else ():
        one.set_aspect("equal")
        one.set_axis_off()
    return figure, axes


def draw_edges(axes, points, edges, color=INK, width=0.9, **kwargs):
    """Draw edges (e, 2) of points as straight lines."""
    kwargs.setdefault("zorder", 3)
    axes.add_collection(LineCollection(points[edges], colors=color, linewidths=width, capstyle="round", **kwargs))


def draw_discs(axes, points, weights, **kwargs):
    """Draw the balls of positive weight."""
    discs = [Circle(p, np.sqrt(w)) for p, w in zip(points, weights) if w > 0]
    return draw_together(axes, [disc.get_path().transformed(disc.get_patch_transform()) for disc in discs], **kwargs)


def draw_together(axes, paths, **kwargs):
    """Draw many paths as one, which keeps the file small."""
    return axes.add_patch(PathPatch(Path_.make_compound_path(*paths), **kwargs))


def draw_shape(axes, family, alpha):
    """Draw W_alpha: its interior, its regular and its singular edges, its isolated points."""
    points = family.triangulation.points
    cells = family.simplices(2)[family.classify(2, alpha) == 3]
    axes.add_collection(PolyCollection(points[cells], facecolors=PALE, edgecolors=PALE, linewidths=0.4, zorder=1))
    edges, classes = family.simplices(1), family.classify(1, alpha)
    draw_edges(axes, points, edges[classes == 3], "#b4cfe3", 0.4, zorder=2)
    draw_edges(axes, points, edges[classes == 2], BLUE, 1.3)
    draw_edges(axes, points, edges[classes == 1], ORANGE, 1.3)
    vertex = family.classify(0, alpha)
    rows = family.simplices(0)[:, 0]
    axes.plot(*points[rows[vertex > 0]].T, ".", color=INK, ms=2.6, zorder=4)
    axes.plot(*points[rows[vertex == 0]].T, ".", color=GRAY, ms=2.2, zorder=4)


def frame(axes, points, margin=0.06):
    """Show all points, with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    pad = margin * (high - low).max()
    axes.set_xlim(low[0] - pad, high[0] + pad)
    axes.set_ylim(low[1] - pad, high[1] + pad)


def introduction():
    """Draw one radius, a larger one, and a radius for every point."""
    scene = snippet("theory/index.md")
    figure, axes = panels(3, height=2.2)
    for one, (title, family) in zip(axes, scene["shapes"].items()):
        points, weights = family.triangulation.points, family.triangulation.weights
        draw_discs(one, points, weights, facecolor="#e8e8e8", edgecolor="none", zorder=0)
        draw_shape(one, family, 0.0)
        frame(one, points, 0.1)
        one.set_title(title)
    return figure


def alpha_shapes():
    """Draw a weighted alpha shape with the empty balls of two of its facets."""
    scene = snippet("theory/alpha-shapes.md")
    points, weights, alpha, boundary = (scene[name] for name in ("points", "weights", "alpha", "boundary"))
    figure, (axes,) = panels(1, 5.4, 3.3)
    draw_discs(axes, points, weights, facecolor="#dddddd", edgecolor=GRAY, linewidth=0.6, zorder=1)
    draw_shape(axes, scene["shape"], alpha)
    for facet in ([1, 3], [4, 5]):
        color = ORANGE if boundary.singular[(np.sort(boundary.facets) == facet).all(axis=1)][0] else BLUE
        for x in exposing(points, weights, facet, alpha):
            gaps = ((points - x) ** 2).sum(axis=1) - weights - alpha
            if np.delete(gaps, facet).min() > 0:
                axes.add_patch(
                    Circle(x, np.sqrt(alpha), fill=False, edgecolor=color, linewidth=0.8, linestyle=(0, (4, 3)))
                )
                axes.plot(*x, "+", color=color, ms=4, mew=0.7)
                axes.annotate("$x$", x, (3, 3), textcoords="offset points", color=color)
    handles = [Line2D([], [], color=BLUE, lw=1.3), Line2D([], [], color=ORANGE, lw=1.3)]
    axes.legend(handles, ["regular: one empty ball", "singular: two"], loc="lower right", bbox_to_anchor=(1.02, -0.02))
    axes.set(xlim=(-0.7, 6.5), ylim=(-1.3, 3.2))
    return figure


def exposing(points, weights, facet, alpha):
    """Give the two locations x' whose balls of squared radius alpha are orthogonal to both ends of an edge."""
    a, b = points[facet]
    length = np.linalg.norm(b - a)
    along = (b - a) / length
    foot = 0.5 * (length + (weights[facet[0]] - weights[facet[1]]) / length)
    height = np.sqrt(weights[facet[0]] + alpha - foot**2)
    normal = np.array([-along[1], along[0]])
    return a + foot * along + height * normal, a + foot * along - height * normal


def regular_triangulations():
    """Draw a triangulation with its power diagram, and the complex beside it."""
    scene = snippet("theory/regular-triangulations.md")
    triangulation, diagram = scene["triangulation"], scene["diagram"]
    points, weights = triangulation.points, triangulation.weights
    family = recon_complex(triangulation)
    figure, (left, right) = panels(2, 7.2, 2.9)
    for axes in (left, right):
        draw_discs(axes, points, weights, facecolor="#e4e4e4", edgecolor="#aaaaaa", linewidth=0.5, zorder=0)
        draw_power_diagram(axes, diagram)
        axes.set(xlim=(points[:, 0].min() - 1.0, points[:, 0].max() + 1.0))
        axes.set(ylim=(points[:, 1].min() - 0.9, points[:, 1].max() + 0.9))
    draw_edges(left, points, family.simplices(1), INK, 0.9)
    left.plot(*np.delete(points, triangulation.hidden, axis=0).T, ".", color=INK, ms=5, zorder=4)
    left.plot(*points[triangulation.hidden].T, "o", mfc="white", mec=ORANGE, ms=4, mew=1.2, zorder=5)
    at = points[triangulation.hidden[0]]
    arrow = {"arrowstyle": "-", "color": ORANGE, "linewidth": 0.7, "shrinkB": 3}
    left.annotate("hidden", at, (30, 52), textcoords="offset points", color=ORANGE, zorder=6, arrowprops=arrow)
    draw_shape(right, family, 0.0)
    left.set_title(r"$\mathcal{R}$ and $\mathcal{P}$")
    right.set_title(r"$\mathcal{K}_0$")
    return figure


def recon_complex(triangulation):
    """Give the complex of a triangulation; recon is imported where a picture is drawn."""
    import recon

    return recon.alpha_complex(triangulation)


def power_edges(diagram, far=20.0):
    """Give the edges (e, 2, 2) of a planar power diagram, rays cut off at a distance."""
    faces = diagram.faces(1)
    pairs = [diagram.vertices[faces.corners_of(i)] for i in range(len(faces)) if faces.bounded[i]]
    start, direction = diagram.rays
    rays = np.stack([diagram.vertices[start], diagram.vertices[start] + far * direction], axis=1)
    return np.concatenate([np.array(pairs).reshape(-1, 2, 2), rays])


def draw_power_diagram(axes, diagram, color=PURPLE, width=0.7, **kwargs):
    """Draw the edges of a planar power diagram, dashed."""
    kwargs.setdefault("linestyle", (0, (3, 2)))
    axes.add_collection(LineCollection(power_edges(diagram), colors=color, linewidths=width, zorder=2, **kwargs))


def space_filling():
    """Draw a union of discs cut along its power diagram, its arcs and corners, and the dual complex."""
    scene = snippet("theory/space-filling.md")
    union = scene["union"]
    family, points = union.complex, union.complex.triangulation.points
    figure, (axes,) = panels(1, 5.6, 3.2)
    union_of_discs = draw_discs(axes, points, scene["weights"], facecolor="#bfe3d6", edgecolor="none", zorder=0)
    import recon

    cut = LineCollection(
        power_edges(recon.power_diagram(family.triangulation)), colors="white", linewidths=1.1, zorder=1
    )
    cut.set_clip_path(union_of_discs)
    axes.add_collection(cut)
    arcs, corners = union.faces(1), union.faces(0)
    for i in range(len(arcs)):
        ends = corners.points[(corners.on == i).any(axis=1)] - arcs.centers[i]
        turns = np.sort(np.degrees(np.arctan2(ends[:, 1], ends[:, 0])))
        begin, end = turns if len(turns) else (0.0, 360.0)
        ahead = np.radians(begin + 1e-3 * (end - begin))  # just past the first end: in another disc, or on the arc?
        there = arcs.centers[i] + arcs.radii[i] * np.array([np.cos(ahead), np.sin(ahead)])
        others = np.delete(np.arange(len(points)), arcs.simplices[i, 0])
        if (((points[others] - there) ** 2).sum(axis=1) < scene["weights"][others]).any():
            begin, end = end, begin + 360.0
        color = ORANGE if arcs.region[i] >= 0 else GREEN
        size = 2 * arcs.radii[i]
        axes.add_patch(Arc(arcs.centers[i], size, size, theta1=begin, theta2=end, color=color, linewidth=1.6, zorder=3))
    draw_edges(axes, points, family.simplices(1)[family.entry(1) <= 0.0], BLUE, 1.0, zorder=4)
    cells = family.simplices(2)[family.entry(2) <= 0.0]
    axes.add_collection(PolyCollection(points[cells], facecolors=BLUE, alpha=0.25, edgecolors="none", zorder=2))
    axes.plot(*points.T, ".", color=BLUE, ms=5, zorder=5)
    axes.plot(*corners.points.T, ".", color=INK, ms=4, zorder=6)
    axes.text(0, 0, "void", ha="center", va="center", color=ORANGE)
    frame(axes, points, 0.2)
    return figure


def intervals():
    """Draw edges by class, and the intervals of some."""
    scene = snippet("theory/intervals.md")
    family, alpha = scene["family"], scene["alpha"]
    figure, (left, right) = panels(2, 7.2, 3.1, plane=False)
    left.set_aspect("equal")
    left.set_axis_off()
    points = family.triangulation.points
    cells = family.simplices(2)[family.classify(2, alpha) == 3]
    left.add_collection(PolyCollection(points[cells], facecolors=PALE, edgecolors="none", zorder=1))
    for kind, color, width in ((0, "#d0d0d0", 0.5), (3, SKY, 1.1), (2, BLUE, 1.6), (1, ORANGE, 1.6)):
        draw_edges(left, points, family.simplices(1)[scene["classes"] == kind], color, width)
    left.plot(*points.T, ".", color=INK, ms=3.5, zorder=4)
    frame(left, points)
    order = np.argsort(scene["entry"])
    rows = order[np.linspace(0, 0.8 * len(order), 24).astype(int)]
    top = 0.052
    kinds = (("singular", ORANGE), ("regular", BLUE), ("interior", SKY))
    ends = np.minimum(
        np.array([scene["entry"], scene["lower"], scene["upper"], np.full(len(order), top)])[:, rows], top
    )
    for (name, color), start, stop in zip(kinds, ends[:-1], ends[1:]):
        right.barh(np.arange(len(rows)), stop - start, left=start, height=0.62, color=color, label=name)
    right.axvline(alpha, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    right.annotate(r"$\alpha$", (alpha, len(rows) - 0.3), (3, 0), textcoords="offset points")
    right.set(yticks=[], xlim=(0, top), xlabel=r"$\alpha$  [L$^2$]", ylabel="edges")
    right.legend(loc="lower right", ncols=3, bbox_to_anchor=(1, 1.0), borderaxespad=0)
    return figure


def weights():
    """Draw a triangulation before and after two edges are enforced."""
    scene = snippet("theory/weights.md")
    points, wanted = scene["points"], np.array(scene["wanted"])
    figure, (left, right) = panels(2, 7.2, 2.8)
    for axes, name, title in ((left, "before", "Delaunay"), (right, "after", "regular, two edges enforced")):
        family = scene[name]
        edges = np.sort(wanted, axis=1).tolist()
        others = [edge for edge in family.simplices(1).tolist() if edge not in edges]
        draw_edges(axes, points, np.array(others), "#8a8a8a", 0.7, zorder=2)
        style = "solid" if name == "after" else (0, (4, 2))
        draw_edges(axes, points, wanted, ORANGE, 1.8, linestyle=style)
        hidden = family.triangulation.hidden
        axes.plot(*np.delete(points, hidden, axis=0).T, ".", color=INK, ms=5, zorder=4)
        axes.plot(*points[hidden].T, "o", mfc="white", mec=INK, ms=4, mew=1, zorder=4)
        axes.set_title(title)
        frame(axes, points, 0.11)
    changed = scene["weights"]
    draw_discs(right, points, changed, facecolor="#e4e4e4", edgecolor=GRAY, linewidth=0.6, zorder=0)
    draw_discs(right, points, -changed, fill=False, edgecolor=GRAY, linewidth=0.8, linestyle=(0, (3, 2)), zorder=1)
    return figure


def predicates():
    """Draw the signs of an orientation test, rounded and exact, and the triangulation of a grid."""
    from matplotlib.colors import ListedColormap

    scene = snippet("theory/predicates.md")
    figure, (left, middle, right) = panels(3, 7.2, 2.6)
    colors = ListedColormap([ORANGE, (1, 1, 1, 0), BLUE])
    for axes, name, title in ((left, "plain", "floating point"), (middle, "exact", "exact")):
        axes.imshow(scene[name], cmap=colors, vmin=-1, vmax=1, origin="lower", interpolation="nearest")
        axes.set_title(title)
    triangulation = scene["triangulation"]
    edges = recon_complex(triangulation).simplices(1)
    draw_edges(right, triangulation.points, edges, INK, 0.8)
    right.plot(*triangulation.points.T, ".", color=INK, ms=4)
    frame(right, triangulation.points)
    right.set_title("every square a tie")
    return figure


def algorithm():
    """Cut a reconstruction open along a plane: the cells inside and outside, and the surface between them."""
    scene = snippet("algorithm.md")
    triangulation, mesh = scene["result"].triangulation, scene["result"].mesh
    points = triangulation.points
    inside = inside_of(triangulation, mesh.vertex_source[mesh.faces])
    figure, (axes,) = panels(1, 7.2, 3.4)
    level = float(np.median(points[:, 2])) + 1e-9
    for within, face, line in ((False, "none", "#c4c4c4"), (True, PALE, "#9dbfd8")):
        cut = [Path_(np.vstack([p, p[:1]])) for p in sections(points[triangulation.cells[inside == within]], level)]
        draw_together(axes, cut, facecolor=face, edgecolor=line, linewidth=0.5, zorder=1 + within)
    cut = [Path_(line) for line in sections(mesh.vertices[mesh.faces], level)]
    draw_together(axes, cut, fill=False, edgecolor=BLUE, linewidth=1.8, capstyle="round", zorder=4)
    frame(axes, points[:, :2], 0.01)
    return figure


def inside_of(triangulation, faces):
    """Tell of every cell whether the surface parts it from the outside (m,): a flood from the hull that no face lets through."""
    walls = {tuple(face) for face in np.sort(faces, axis=1).tolist()}
    cells, neighbors = np.sort(triangulation.cells, axis=1), triangulation.neighbors
    inside = np.ones(len(cells), bool)
    front = []

    def enter(cell, facet):
        if inside[cell] and tuple(facet) not in walls:
            inside[cell] = False
            front.append(cell)

    for cell, corner in zip(*np.nonzero(neighbors < 0)):
        enter(cell, cells[cell][cells[cell] != triangulation.cells[cell, corner]])
    while front:
        cell = front.pop()
        for corner, other in zip(triangulation.cells[cell], neighbors[cell]):
            if other >= 0:
                enter(other, cells[cell][cells[cell] != corner])
    return inside


def sections(simplices, level):
    """Cut triangles or tetrahedra (s, k, 3) by the plane z = level: segments or convex polygons in x and y."""
    found = []
    for corners in simplices:
        above, below = corners[corners[:, 2] > level], corners[corners[:, 2] <= level]
        if len(above) and len(below):
            share = (level - below[None, :, 2]) / (above[:, None, 2] - below[None, :, 2])
            cut = (below[None] + share[..., None] * (above[:, None] - below[None])).reshape(-1, 3)[:, :2]
            around = cut - cut.mean(axis=0)
            found.append(cut[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])
    return found


def main(names):
    """Draw the pictures named, or all."""
    with mpl.rc_context(STYLE):
        for name in names or DRAWINGS:
            path = DOCS / "pictures" / f"{name}.svg"
            path.parent.mkdir(exist_ok=True)
            DRAWINGS[name]().savefig(path, transparent=True, metadata={"Date": None})


_IN_ORDER = introduction, alpha_shapes, regular_triangulations, space_filling, intervals, weights, predicates, algorithm
DRAWINGS = {function.__name__.replace("_", "-"): function for function in _IN_ORDER}
if __name__ == "__main__":
    main(sys.argv[1:])
