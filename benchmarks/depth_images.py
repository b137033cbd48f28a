"""Points as depth cameras around a thing see them: overlapping images, noise along the rays, every image a little out of place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import recon
from recon.proximity import area_samples

VIEWS = 14  # spread evenly around
FAR = 4.0  # distance of the cameras [half diagonals]
GRAZING = np.cos(np.radians(80))  # what is seen at a flatter angle gives no point
COARSE = 60  # pixels across, of the images that tell how many are needed
SEEN, REACH = 0.995, 3.0  # share of the surface that must have a point within so many pixels


def depth_images(mesh: recon.Mesh, n: int, noise: float, shift: float) -> NDArray[np.float64] | None:
    """Some n points of a closed mesh; None where the cameras see too little of it.

    Parameters
    ----------
    mesh : Mesh
    n : int
    noise : float
        Standard deviation along the ray [pixels].
    shift : float
        Standard deviation by which each image is out of place, along each axis [pixels].
    """
    middle, size = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2, np.ptp(mesh.vertices, axis=0)
    radius = float(np.linalg.norm(size)) / 2
    pixel = 2 * radius / COARSE
    pixel *= np.sqrt(len(_shoot(mesh, middle, radius, pixel, 0, 0)) / n)
    points = _shoot(mesh, middle, radius, pixel, noise * pixel, shift * pixel)
    surface = area_samples(mesh.vertices, mesh.faces, n, np.random.default_rng(1))[0]
    return points if (cKDTree(points).query(surface)[0] < REACH * pixel).mean() >= SEEN else None


def _shoot(
    mesh: recon.Mesh, middle: NDArray[np.float64], radius: float, pixel: float, noise: float, shift: float
) -> NDArray[np.float64]:
    """All images."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(mesh.vertices.astype(np.float32)), o3d.core.Tensor(mesh.faces.astype(np.uint32))
    )
    rng = np.random.default_rng(0)
    turns = (np.arange(VIEWS) + 0.5) * np.pi * (1 + np.sqrt(5))
    up = 1 - (2 * np.arange(VIEWS) + 1) / VIEWS
    around = np.column_stack([np.sqrt(1 - up**2) * np.cos(turns), np.sqrt(1 - up**2) * np.sin(turns), up])
    images = []
    for direction in around:
        side = np.cross(direction, rng.normal(size=3))
        side /= np.linalg.norm(side)
        grid = np.arange(-radius, radius, pixel) + pixel * rng.random()
        x, y = (part.ravel()[:, None] for part in np.meshgrid(grid, grid))
        eye = middle + FAR * radius * direction
        rays = middle + x * side + y * np.cross(direction, side) - eye
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        hit = scene.cast_rays(o3d.core.Tensor(np.hstack([np.broadcast_to(eye, rays.shape), rays]).astype(np.float32)))
        depth, facing = hit["t_hit"].numpy(), np.abs((hit["primitive_normals"].numpy() * rays).sum(axis=1))
        seen = np.isfinite(depth) & (facing > GRAZING)
        depth = depth[seen] + noise * rng.standard_normal(seen.sum())
        images.append(eye + depth[:, None] * rays[seen] + shift * rng.standard_normal(3))
    return np.concatenate(images)
