"""Draw the picture of the README: a cloud of a knot, and the mesh of it. Needs matplotlib."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import datasets_synthetic
import recon

knot = datasets_synthetic.surface("trefoil")
points = knot.sample(6000, density=10, noise=0.002, rng=0).points
result = recon.reconstruct(points)
figure = plt.figure(figsize=(10, 5), dpi=110)
for place, title in ((1, f"{len(points):,} points"), (2, f"{len(result.mesh.faces):,} triangles, closed, genus 1")):
    axes = figure.add_subplot(1, 2, place, projection="3d")
    if place == 1:
        axes.scatter(*points.T, s=0.7, c="0.2", linewidths=0)
    else:
        corners = result.mesh.vertices[result.mesh.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        shade = LightSource(azdeg=315, altdeg=50).shade_normals(normal / np.linalg.norm(normal, axis=1)[:, None])
        color = np.clip(0.25 + 0.75 * shade, 0, 1)[:, None] * np.array([[0.45, 0.65, 0.9]])
        axes.add_collection3d(Poly3DCollection(corners, facecolors=color, edgecolors=color * 0.75, linewidths=0.2))
    half = np.ptp(points, axis=0).max() / 2 * 0.72
    center = (points.max(axis=0) + points.min(axis=0)) / 2
    axes.set(xlim=(center[0] - half, center[0] + half), ylim=(center[1] - half, center[1] + half))
    axes.set_zlim(center[2] - half, center[2] + half)
    axes.set_box_aspect((1, 1, 1))
    axes.set_axis_off()
    axes.view_init(60, -60)
    axes.set_title(title, y=-0.02, fontsize=11)
figure.tight_layout(pad=0.2)
figure.savefig("docs/picture.png")
