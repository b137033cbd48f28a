"""Numbers that look random, the same in every run."""

from __future__ import annotations

import numpy as np

from .compile import kernel


@kernel
def word(x):
    """64 bits that look random, of a number from 0 on (splitmix64)."""
    z = np.uint64(x + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
