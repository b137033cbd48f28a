"""What is done to a mesh after the complex: Mesh in, Mesh out, each step saying what it changed."""

from .attributes import transfer, with_normals
from .clean import split_pinches
from .denoise import denoise
from .fill import fill_holes
from .islands import remove_islands
from .refine import refine
from .remesh import flip_edges, remesh

__all__ = [
    "denoise",
    "fill_holes",
    "flip_edges",
    "refine",
    "remesh",
    "remove_islands",
    "split_pinches",
    "transfer",
    "with_normals",
]
