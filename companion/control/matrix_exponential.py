"""The exponential of small matrices, inside the control loop.

scipy's gives the same to the last digits, but its LAPACK may wake the threads of a numerical
library, which on a busy machine has been seen to take 0.1 s: a missed deadline.  Products of
matrices this small start none.
"""

import numpy as np

from companion.control.reference_model import Array

_TERMS = 18
"""Of the series for a norm of at most 1/2: the next one is below 1e-22."""


def matrix_exponential(a: Array) -> Array:
    """``exp(A)`` of a square matrix by scaling, Taylor's series and squaring.

    Moler & Van Loan (2003), Nineteen dubious ways to compute the exponential of a matrix, method 3.
    """
    norm = float(np.abs(a).sum(axis=1).max())
    squarings = max(0, int(np.ceil(np.log2(norm))) + 1) if norm > 0.5 else 0
    scaled = a / 2.0**squarings
    identity = np.eye(len(a))
    result: Array = identity
    for k in range(_TERMS, 0, -1):
        result = identity + scaled @ result / k
    for _ in range(squarings):
        result = result @ result
    return result
