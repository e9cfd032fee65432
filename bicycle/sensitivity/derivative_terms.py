"""Derivatives of many eigenvalues with many parameters at once: sums of u M x, in blocks that fit the cache."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tyre.base.arrays import Array, Complex

BLOCK = 1024  # eigenvalues at a time: what is multiplied stays in the cache


def eigenvalue_derivative_terms(left: Complex, right: Complex, terms: Sequence[tuple[Any, Array]]) -> Complex:
    """Sum over terms of weight u M_p x for k eigenvalues and p parameters: one real matrix product for all of them.

    Parameters
    ----------
    left, right : ndarray, shape (k, n)
        Left and right eigenvector of each eigenvalue.
    terms : sequence of (weight, matrices)
        Weights (k,), and real matrices (p, n, n); only places where some matrix is not zero cost anything.
        Small as it is, the product is quicker in one BLAS thread (:func:`tyre.base.parallel.one_blas_thread`).

    Returns
    -------
    ndarray, shape (k, p)
    """
    places = [np.nonzero((stack != 0).any(0)) for _, stack in terms]
    table = np.concatenate([stack[:, i, j].T for (_, stack), (i, j) in zip(terms, places, strict=True)])
    result = np.empty((len(left), len(terms[0][1])), complex)
    products = np.empty((2, len(table), BLOCK))  # real and imaginary part; an eigenvalue is a column
    for start in range(0, len(left), BLOCK):
        k = slice(start, start + BLOCK)
        u, x = (np.ascontiguousarray(vectors[k].T) for vectors in (left, right))
        done = 0
        for (weight, _), (i, j) in zip(terms, places, strict=True):
            product = (weight[k] * u)[i]
            product *= x[j]
            rows = slice(done, done := done + len(i))
            products[0, rows, : u.shape[1]], products[1, rows, : u.shape[1]] = product.real, product.imag
        result[k].real, result[k].imag = (part[:, : u.shape[1]].T @ table for part in products)
    return result
