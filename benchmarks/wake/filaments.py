"""Velocity in the mid plane of vortex rings that stand upright: two columns and, at either height, a cap between them.

Planar vectors are complex numbers, x + i y. A ring from a to b with circulation G goes up at a, over to b at height H,
down at b, and back at -H. By Biot and Savart's law (Katz and Plotkin 2001, Low-Speed Aerodynamics, section 2.11), at a
place z of the plane half-way up, r away from a column at a,

    column  G i (z - a) / (2 pi (r^2 + core^2)) H / sqrt(r^2 + H^2),
    caps    G H / (2 pi D^2) (s_b / sqrt(s_b^2 + D^2) - s_a / sqrt(s_a^2 + D^2)) n,

s_a and s_b the places of a and b along the ring as seen from z, D^2 = d^2 + H^2 with d the distance of z from the
ring's line, and n across it, to the left from a to b. A core of Krasny's kind (J. Comput. Phys. 65, 1986) makes wakes
smooth; body rings have none. All speeds here are for G = 1 unless circulations are given.
"""

from typing import NamedTuple

import numpy as np


class Rings(NamedTuple):
    """Rings of n simulations side by side: k of them, corners a and b (n, k), half heights and cores (k,)."""

    a_m: np.ndarray
    b_m: np.ndarray
    half_height_m: np.ndarray
    core_a_m: np.ndarray
    core_b_m: np.ndarray


def of_rings(place_m: np.ndarray, rings: Rings) -> np.ndarray:
    """Return (n, p, k) m/s at places (n, p) of each ring of unit circulation."""
    place, height = place_m[:, :, None], rings.half_height_m
    a, b = rings.a_m[:, None], rings.b_m[:, None]
    columns = _compute_column(place - a, height, rings.core_a_m) - _compute_column(place - b, height, rings.core_b_m)
    return columns + _compute_caps(place, a, b, height)


def _compute_column(away: np.ndarray, height: np.ndarray, core_m: np.ndarray) -> np.ndarray:
    square = away.real**2 + away.imag**2
    return np.asarray(1j * away * height / (2 * np.pi * (square + core_m**2) * np.sqrt(square + height**2)))


def _compute_caps(place: np.ndarray, a: np.ndarray, b: np.ndarray, height: np.ndarray) -> np.ndarray:
    length = np.abs(b - a)
    along = (b - a) / np.where(length > 0, length, 1.0)
    first = (a - place) * along.conj()
    apart = first.imag**2 + height**2
    first, last = first.real, first.real + length
    size = last / np.sqrt(last**2 + apart) - first / np.sqrt(first**2 + apart)
    return np.asarray(1j * along * height / (2 * np.pi * apart) * size)


def of_sheet(
    place_m: np.ndarray, node_m: np.ndarray, circulation_m2_s: np.ndarray, half_height_m: float, core_m: float
) -> np.ndarray:
    """Return (n, p) m/s at places (n, p) of a sheet of rings of one height, nodes (n, k + 1), circulations (n, k).

    Its rings are short against their height, so their caps count as one element in the middle of each.
    """
    column = np.diff(circulation_m2_s, prepend=0.0, append=0.0)  # (n, k + 1)
    cap = 1j * circulation_m2_s * np.diff(node_m)
    square = _square_distances(place_m, node_m)
    width = np.sqrt(square + half_height_m**2)
    near = column[:, None] * (half_height_m / (2 * np.pi)) / ((square + core_m**2) * width)
    columns = place_m * near.sum(axis=2) - (near @ node_m[:, :, None])[..., 0]
    middle = (node_m[:, 1:] + node_m[:, :-1]) / 2
    far = (half_height_m / (2 * np.pi)) / (_square_distances(place_m, middle) + half_height_m**2) ** 1.5
    return np.asarray(1j * columns + (far @ cap[:, :, None])[..., 0])


def _square_distances(place_m: np.ndarray, node_m: np.ndarray) -> np.ndarray:
    """Return (n, p, k) distances squared."""
    x = place_m.real[:, :, None] - node_m.real[:, None]
    y = place_m.imag[:, :, None] - node_m.imag[:, None]
    return np.asarray(x * x + y * y)
