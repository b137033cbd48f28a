"""Arrays as text inside a page: one base64 string of gzip, and a table that says what is where.

Neighbouring numbers are alike in their high bytes, so the bytes of equal significance are put together; columns of
integers are replaced by their differences first. `unpack` in viewer.js turns this back, bit for bit.
"""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TYPES = {"float64": "Float64Array", "float32": "Float32Array", "int32": "Int32Array", "uint8": "Uint8Array"}


def pack(arrays: Mapping[str, NDArray]) -> tuple[list[dict[str, Any]], str]:
    """Pack arrays.

    Parameters
    ----------
    arrays : mapping of str to (n,) or (n, k) ndarray of float64, float32, int32 or uint8

    Returns
    -------
    table : list of dict
        Name, JavaScript type, rows and columns of each array, in order.
    text : str
        Base64 of gzip of all of them.
    """
    table, parts = [], []
    for name, array in arrays.items():
        columns = array.shape[1] if array.ndim == 2 else 1
        little = np.ascontiguousarray(array.reshape(len(array), columns).T).astype(array.dtype.newbyteorder("<"))
        if array.dtype == np.int32:
            little = np.diff(little.view("<u4"), axis=1, prepend=np.uint32(0))  # modulo 2**32
        planes = little.reshape(-1, 1).view(np.uint8).reshape(-1, array.dtype.itemsize).T
        table.append({"name": name, "type": _TYPES[array.dtype.name], "rows": len(array), "columns": columns})
        parts.append(planes.tobytes())
    squeezed = gzip.compress(b"".join(parts), compresslevel=6, mtime=0)
    return table, base64.b64encode(squeezed).decode("ascii")
