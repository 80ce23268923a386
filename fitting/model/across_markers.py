"""How far the noise of the markers goes together, part by part.

One step of Fisher's scoring of the restricted likelihood from independent markers, which are Rao's minimum norm
quadratic estimates (MINQUE; Rao 1971, J. Multivar. Anal. 1, 257). Slow parts of real tracks are common to neighbours
and fast ones are not, so each part has a correlation of its own. It is shrunk towards one that is the same between all
markers by how much chance alone would scatter it (Schaefer and Strimmer 2005, Stat. Appl. Genet. Mol. Biol. 4, 32;
the target of Ledoit and Wolf 2004, J. Portf. Manag. 30, 110): towards independence, what all have in common, which
moves the speed most, would be lost.
"""

from collections.abc import Sequence

import numpy as np

_LEAST_EIGENVALUE = 0.02


def across_markers(
    series: np.ndarray,
    usable: np.ndarray,
    columns: np.ndarray,
    parts: Sequence[np.ndarray],
    correlation: np.ndarray,
) -> list[np.ndarray]:
    """(m, m) correlation between markers of each part.

    Args:
        series: (n, m, 2) of the markers, in their standard deviations; both coordinates count alike.
        usable: (n, m) samples that count.
        columns: (n, c) that are taken out of each.
        parts: (n, n) covariance in time of each part.
        correlation: (n, n) in time of them all and of white noise.
    """
    masks, which = np.unique(usable, axis=1, return_inverse=True)
    which = which.ravel()
    restricted = [_restricted(columns, mask, correlation) for mask in masks.T]  # (g, n, n)
    common = _information(restricted, parts)[:, :, which[:, None], which]  # (p, p, m, m)
    clean = np.where(usable[..., None], series, 0.0)
    residual = np.stack([restricted[group] @ clean[:, m] for m, group in enumerate(which)])  # (m, n, 2)
    seen = np.array(
        [np.einsum("inx,nk,jkx->ij", residual, part, residual, optimize=True) for part in parts]
    )  # (p, m, m)
    information = np.moveaxis(common, (0, 1), (-2, -1))  # (m, m, p, p)
    # one sample more, which says independent, so that a pair that is never seen together has an inverse
    inverse = np.linalg.inv(information + np.eye(len(parts)))
    found = np.einsum("ijpq,qij->pij", inverse, seen)
    variance = np.einsum("ijpq,ijqr,ijrp->pij", inverse, information, inverse)
    return [_shrunk(*pair) for pair in zip(found, variance, strict=True)]


def _restricted(columns: np.ndarray, mask: np.ndarray, correlation: np.ndarray) -> np.ndarray:
    """(n, n) inverse of the correlation (n, n) in the frames of a mask, beside columns (n, c); 0 in all others."""
    frames, result = np.flatnonzero(mask), np.zeros_like(correlation)
    if len(frames) > 2 * columns.shape[1]:
        inverse, design = np.linalg.inv(correlation[np.ix_(frames, frames)]), columns[frames]
        solved = inverse @ design
        result[np.ix_(frames, frames)] = inverse - solved @ np.linalg.solve(design.T @ solved, solved.T)
    return result


def _information(restricted: Sequence[np.ndarray], parts: Sequence[np.ndarray]) -> np.ndarray:
    """(p, p, g, g) Fisher's information of two coordinates, between parts, for a pair of independent markers."""
    reach = [[inverse @ part for inverse in restricted] for part in parts]  # [p][g] (n, n)
    return np.array([[[[2 * (a * b.T).sum() for b in other] for a in own] for other in reach] for own in reach])


def _shrunk(found: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """(m, m) correlation from what was found (m, m) and how far chance scatters it.

    Each pair goes towards what all pairs have in common in the mean, by how much of their scatter chance alone would
    give; and that towards independence. A pair that was never seen together has what all have in common.
    """
    pairs = np.triu(variance > 0, 1)  # those that were seen together
    if not pairs.any():
        return np.eye(len(found))
    common = _without_chance(found[pairs].mean(), variance[pairs].mean() / pairs.sum())
    own = _without_chance(found - common, variance[pairs].mean(), np.mean((found[pairs] - common) ** 2))
    matrix = common + np.where(variance > 0, own, 0.0)
    np.fill_diagonal(matrix, 1.0)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    definite = (vectors * np.maximum(values, _LEAST_EIGENVALUE)) @ vectors.T
    size = np.sqrt(np.diag(definite))
    return np.asarray(definite / np.outer(size, size))


def _without_chance(found: np.ndarray, chance: float, square: float | None = None) -> np.ndarray:
    """What was found, shrunk by the share of its mean square (default: its own square) that chance would give."""
    square = float(found**2) if square is None else square
    return max(1.0 - chance / max(square, 1e-12), 0.0) * found
