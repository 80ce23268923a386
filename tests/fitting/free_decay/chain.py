"""The linear chain by hand: mass matrix of links and what they carry about their hinges, without the engine."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from swimcal.robot import RobotSpec


def linear_mass(robot: RobotSpec) -> np.ndarray:
    """(h, h) mass matrix of the straight tail in its hinge angles, kg m^2: parts as uniform boxes from above."""
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
    thin = 0.001
    for i, s in enumerate(segments):
        both, rear, fat = 2 * s.guide_plate_width_m, robot.segment_x_m[i, 1], s.thickness_m
        area = robot.tail.guide_plate_length_m * robot.tail.guide_plate_height_m
        # One box over both guide plates and the segment between them, less the segment's part.
        for across, sign in ((both + fat, 1), (fat, -1)):
            kg = sign * area * across * robot.tail.density_kg_m3 * (both > 0)
            plates.append((i, rear - robot.tail.guide_inset_m, robot.tail.guide_plate_length_m, across, kg))
        plates.append((i, hinge_x[i] + s.gap_m / 4, s.gap_m / 2, thin, s.strip_mass_kg))
        if i > 0:
            plates.append((i - 1, hinge_x[i] - s.gap_m / 4, s.gap_m / 2, thin, s.strip_mass_kg))
    plates.append((h - 1, robot.fin_root_x_m - fin.gap_m / 2, fin.gap_m, thin, fin.strip_mass_kg))
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
