"""What is done to a mesh after the complex: Mesh in, Mesh out, each step saying what it changed."""

from .clean import split_pinches
from .denoise import denoise

__all__ = ["denoise", "split_pinches"]
