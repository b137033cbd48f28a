"""What is done to a mesh after the complex: Mesh in, Mesh out, each step saying what it changed."""

from .clean import split_pinches
from .denoise import denoise
from .refine import refine

__all__ = ["denoise", "refine", "split_pinches"]
