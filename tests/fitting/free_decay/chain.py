"""The linear chain by hand: mass matrix of flat links about their hinges, without the engine."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from swimmer import RobotSpec


def linear_mass(robot: RobotSpec) -> np.ndarray:
    """(h, h) mass matrix of the straight tail in its hinge angles, kg m^2: plates as uniform rods with thickness."""
    hinge_x = robot.hinge_x_m
    h, segments, fin = len(hinge_x), robot.tail.segment, robot.caudal_fin
    ends = np.append(hinge_x[1:], robot.fin_root_x_m)
    mass = np.zeros((h, h))
    plates = [
        (i, (hinge_x[i] + ends[i]) / 2, ends[i] - hinge_x[i], s.thickness_m,
         2 * s.half_height_m * s.length_m * s.thickness_m * robot.tail.density_kg_m3)
        for i, s in enumerate(segments)
    ]  # fmt: skip
    plates.append((h - 1, robot.fin_root_x_m + fin.centre_m, fin.chord_m, fin.thickness_m, fin.mass_kg))
    for link, centre, length, thickness, kg in plates:
        lever = np.where(np.arange(h) <= link, centre - hinge_x, 0.0)  # (h,) of each hinge that moves this plate
        turned = (np.arange(h) <= link).astype(float)
        mass += kg * np.outer(lever, lever) + kg * (length**2 + thickness**2) / 12 * np.outer(turned, turned)
    return mass


def natural_hz(robot: RobotSpec, stiffness_n_m: float) -> np.ndarray:
    """(h,) undamped frequencies of the linear chain."""
    return np.sqrt(eigh(stiffness_n_m * np.eye(len(robot.hinges)), linear_mass(robot), eigvals_only=True)) / (2 * np.pi)


def linear_decay(
    robot: RobotSpec, stiffness_n_m: float, damping_n_m_s: float, bent_rad: np.ndarray, time_s: np.ndarray
) -> np.ndarray:
    """(n, h) hinge angles of the linear chain released from rest, exact, by its (overdamped or ringing) modes."""
    squared, modes = eigh(stiffness_n_m * np.eye(len(bent_rad)), linear_mass(robot))
    amount = modes.T @ linear_mass(robot) @ bent_rad
    rate = squared * damping_n_m_s / stiffness_n_m / 2 + 0j
    root = np.sqrt(rate**2 - squared)
    t = time_s[:, None]
    motion = np.exp(-rate * t + root * t) * (1 + rate / root) / 2 + np.exp(-rate * t - root * t) * (1 - rate / root) / 2
    return (motion.real * amount) @ modes.T
