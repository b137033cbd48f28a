"""Doors to other programs: Open3D, MeshLab; and conversion of meshes to and from other libraries."""
