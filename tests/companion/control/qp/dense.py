"""A quadratic programme solved another way, for comparison: as a least-distance problem.

Lawson & Hanson (1974), Solving Least Squares Problems, chapter 23: with P = L Lᵀ and
z = Lᵀ x + L⁻¹ q the cost is ½ |z|², and the nearest z to 0 with G z ≥ h comes from a
non-negative least-squares problem.
"""

import numpy as np
from scipy.optimize import nnls


def dense_optimum(p, q, a, lower, upper):
    """The x that minimises ½ xᵀ P x + qᵀ x with lower ≤ A x ≤ upper; None if there is none."""
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    free = inverse.T @ (inverse @ q)  # x = L⁻ᵀ z - free
    rows = np.vstack([a, -a])
    bounds = np.concatenate([lower, -upper]) + rows @ free
    kept = np.isfinite(bounds)
    g, h = rows[kept] @ inverse.T, bounds[kept]
    # Lengths of 1 keep what nnls calls zero comparable.
    length = np.linalg.norm(g, axis=1)
    g, h = g / length[:, None], h / length
    e = np.vstack([g.T, h])
    f = np.append(np.zeros(len(p)), 1.0)
    y, _ = nnls(e, f, maxiter=50 * e.shape[1])
    r = e @ y - f
    if np.linalg.norm(r) < 1e-9:
        return None
    return inverse.T @ (-r[:-1] / r[-1]) - free
