"""Regular triangulation in 1-D: sort along the line, keep the lower hull (Andrew 1979), exact and perturbed."""

from __future__ import annotations

import numpy as np

from .compile import kernel
from .predicates import power1d


@kernel
def lower_chain(points, index):
    """Rows of the lower hull, in order; `points` (x, y, z, w) ascend in x, all different. `index` breaks ties.

    y and z count in the heights only. Perturbed as everywhere: of three points in line the middle one stays if it is
    the most significant of them.
    """
    n = points.shape[0]
    chain = np.empty(n, np.int64)
    length = 0
    for e in range(n):
        while length >= 2:
            a, b = chain[length - 2], chain[length - 1]
            s = power1d(
                points[a, 0], points[a, 1], points[a, 2], points[a, 3],
                points[e, 0], points[e, 1], points[e, 2], points[e, 3],
                points[b, 0], points[b, 1], points[b, 2], points[b, 3],
            )  # fmt: skip
            if s < 0 or (s == 0 and index[b] < index[a] and index[b] < index[e]):
                break
            length -= 1
        chain[length] = e
        length += 1
    return chain[:length]
