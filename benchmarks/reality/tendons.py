"""Two tendons: from the crank's anchors through the guides, springs and dampers along their path, both ways."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.body import Chain, Pose
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters

_SIDES = np.array([-1.0, 1.0])  # Left is -y, as the robot heads for -x.


@dataclass(frozen=True, eq=False)
class Turn:
    """Crank at an instant: angle (n, 1) rad, 0 with its arms upright, and speed (n, 1) rad/s."""

    angle_rad: np.ndarray
    speed_rad_s: np.ndarray


@dataclass(frozen=True, eq=False)
class Pull:
    """Tendons at an instant."""

    stretch_m: np.ndarray  # (n, 2) length beyond the free length
    rate_m_s: np.ndarray  # (n, 2) rate at which the stretch grows
    tension_n: np.ndarray  # (n, 2)
    gradient_m: np.ndarray  # (n, 2, N) gradient of the length to the coordinates
    per_turn_m: np.ndarray  # (n, 2) slope of the length to the crank's angle, per rad
    tension_rate_n_s: np.ndarray  # (n, 2) growth of the tension by the crank's turning alone

    @property
    def crank_torque_n_m(self) -> np.ndarray:
        """(n, 1) torque that the motor gives to keep the crank turning."""
        return (self.tension_n * self.per_turn_m).sum(axis=1, keepdims=True)


class Tendons:
    """Path and tension of the tendons of n simulations."""

    def __init__(self, layout: Layout, parameters: Parameters, chain: Chain) -> None:
        self._chain = chain
        self._stiffness, self._damping = parameters.tendon_stiffness_n_m, parameters.tendon_damping_n_s_m
        crank = layout.robot.crank
        self._axle_m, self._height_m = crank.position_m[0], crank.position_m[2]
        self._offset_m = _SIDES * crank.anchor_offset_m + crank.position_m[1]
        self._radius_m = parameters.anchor_radius_m * _SIDES
        self._links = np.append(0, layout.guide_link)
        self._guide_m = layout.guide_place_m + 1j * layout.guide_offset_m  # (2, g), link axes
        straight = np.concatenate([[0.0], layout.origin_m[layout.guide_link]]) + 0j
        guides = np.broadcast_to(straight[1:] + self._guide_m, (len(parameters), *self._guide_m.shape))
        upright = Turn(np.zeros((len(parameters), 1)), np.zeros((len(parameters), 1)))
        first = self._measure_first_span(guides[:, :, 0], upright)[0]
        self._free_m = first + np.abs(np.diff(guides)).sum(axis=2) + parameters.tendon_extra_m

    def pull(self, pose: Pose, turn: Turn, later: Turn, step_s: float) -> Pull:
        """Return the tendons in a pose, with the crank now and a step later."""
        direction = pose.direction[:, None, self._links[1:]]
        arm = direction * self._guide_m  # (n, 2, g) pool axes, from the links' origins
        guide = pose.origin_m[:, None, self._links[1:]] + arm
        head = pose.direction[:, :1]
        seen = (guide[:, :, 0] - pose.origin_m[:, :1]) * head.conj()  # first guide in the head's axes
        first, unit, per_turn = self._measure_first_span(seen, turn)
        span = np.diff(guide)
        length = np.abs(span)
        stretch = first + length.sum(axis=2) - self._free_m
        units = np.concatenate([(unit * head)[:, :, None], span / length], axis=2)  # (n, 2, g) along each span
        gradient = self._compute_gradient(pose, units, arm, turn)
        later_first, _, later_per_turn = self._measure_first_span(seen, later)
        speed = pose.velocity_m_s[:, :1]
        moved = (gradient @ np.concatenate([speed.real, speed.imag, pose.rate_rad_s], axis=1)[:, :, None])[..., 0]
        rate = moved + per_turn * turn.speed_rad_s
        growth = later_per_turn * later.speed_rad_s - per_turn * turn.speed_rad_s
        return Pull(
            stretch_m=stretch,
            rate_m_s=rate,
            tension_n=self._stiffness * stretch + self._damping * rate,
            gradient_m=gradient,
            per_turn_m=per_turn,
            tension_rate_n_s=(self._stiffness * (later_first - first) + self._damping * growth) / step_s,
        )

    def _measure_first_span(self, guide: np.ndarray, turn: Turn) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (n, 2) lengths from anchor to first guide (n, 2; head's axes), unit vectors, slopes over the angle.

        The anchors circle in the plane of x and z; the guides stay at z = 0, so the unit vector is shorter than one.
        """
        sin, cos = np.sin(turn.angle_rad), np.cos(turn.angle_rad)
        span = guide - (self._axle_m + self._radius_m * sin + 1j * self._offset_m)
        height = self._height_m + self._radius_m * cos
        length = np.sqrt(np.abs(span) ** 2 + height**2)
        slope = -(span.real * self._radius_m * cos + height * self._radius_m * sin) / length
        return length, span / length, slope

    def _compute_gradient(self, pose: Pose, units: np.ndarray, arm: np.ndarray, turn: Turn) -> np.ndarray:
        """Return the (n, 2, N) gradient of lengths: a tendon grows as guides move along the spans that end there."""
        links = pose.direction.shape[1]
        force = np.zeros((*units.shape[:2], links), complex)
        torque = np.zeros(force.shape)
        at_guides = units.copy()
        at_guides[:, :, :-1] -= units[:, :, 1:]
        force[:, :, self._links[1:]] = at_guides
        torque[:, :, self._links[1:]] = (arm.conj() * at_guides).imag
        anchor = self._axle_m + self._radius_m * np.sin(turn.angle_rad) + 1j * self._offset_m
        force[:, :, 0] -= units[:, :, 0]
        torque[:, :, 0] -= ((anchor * pose.direction[:, :1]).conj() * units[:, :, 0]).imag
        return self._chain.generalised(pose, force, torque)
