"""The determinants of the predicates in plain floating point, from differences; who calls knows how far to trust them."""

from __future__ import annotations

from .compile import kernel


@kernel(inline="always")
def max3(a, b, c):
    """Largest magnitude of three."""
    return max(max(abs(a), abs(b)), abs(c))


@kernel(inline="always")
def max4(a, b, c, d):
    """Largest magnitude of four."""
    return max(max(abs(a), abs(b)), max(abs(c), abs(d)))


@kernel
def sign_of(x):
    """Sign of a float as an integer."""
    return 1 if x > 0.0 else (-1 if x < 0.0 else 0)


@kernel(inline="always")
def orient3d_plain(px, py, pz, qx, qy, qz, rx, ry, rz):
    """Determinant of three vectors."""
    return (px * qy - py * qx) * rz + (py * qz - pz * qy) * rx + (pz * qx - px * qz) * ry


@kernel(inline="always")
def power2d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw):
    """Minus the determinant of three vectors, (x, y, x**2 + y**2 + z**2 - w), and the largest sum of squares."""
    ar = ax * ax + ay * ay + az * az
    br = bx * bx + by * by + bz * bz
    cr = cx * cx + cy * cy + cz * cz
    ab, bc, ca = ay * bx - ax * by, by * cx - bx * cy, cy * ax - cx * ay
    return ab * (cr - cw) + bc * (ar - aw) + ca * (br - bw), max(max(ar, br), cr)


@kernel(inline="always")
def power3d_plain(ax, ay, az, aw, bx, by, bz, bw, cx, cy, cz, cw, dx, dy, dz, dw):
    """Determinant of four vectors, (x, y, z, x**2 + y**2 + z**2 - w), and the largest sum of squares."""
    ar = ax * ax + ay * ay + az * az
    br = bx * bx + by * by + bz * bz
    cr = cx * cx + cy * cy + cz * cz
    dr = dx * dx + dy * dy + dz * dz
    ab, bc, cd = ax * by - ay * bx, bx * cy - by * cx, cx * dy - cy * dx
    da, ac, bd = dx * ay - dy * ax, ax * cy - ay * cx, bx * dy - by * dx
    abc, bcd = az * bc - bz * ac + cz * ab, bz * cd - cz * bd + dz * bc
    cda, dab = cz * da + dz * ac + az * cd, dz * ab + az * bd + bz * da
    determinant = (abc * (dr - dw) - bcd * (ar - aw)) + (cda * (br - bw) - dab * (cr - cw))
    return determinant, max(max(ar, br), max(cr, dr))
