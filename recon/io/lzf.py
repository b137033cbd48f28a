"""LZF, the compression inside PCD files."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._kernels.compile import kernel


def decompress(packed: bytes, size: int) -> bytes | None:
    """Decompress `packed` to exactly `size` bytes; None where the data do not make sense."""
    out = np.empty(size, np.uint8)
    if _decompress(np.frombuffer(packed, np.uint8), out) != size:
        return None
    return out.tobytes()


@kernel
def _decompress(packed: NDArray[np.uint8], out: NDArray[np.uint8]) -> int:
    """Give the number of bytes made, -1 where a run leaves either array."""
    i = 0
    j = 0
    n = len(packed)
    while i < n:
        control = int(packed[i])
        i += 1
        if control < 32:  # that many literals, and one
            length = control + 1
            if i + length > n or j + length > len(out):
                return -1
            for k in range(length):
                out[j + k] = packed[i + k]
            i += length
            j += length
            continue
        length = (control >> 5) + 2
        if length == 9:
            if i >= n:
                return -1
            length += int(packed[i])
            i += 1
        if i >= n:
            return -1
        begin = j - ((control & 31) << 8) - int(packed[i]) - 1
        i += 1
        if begin < 0 or j + length > len(out):
            return -1
        for k in range(length):  # the run may overlap itself: byte by byte
            out[j + k] = out[begin + k]
        j += length
    return j
