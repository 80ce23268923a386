"""Equations of motion of n simulations at an instant, ready for the integrator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.reality.body import Chain, Pose
from benchmarks.reality.fluid import ReactiveWater, StripForces, Water
from benchmarks.reality.instant import Instant, rows_of
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Group, Mechanism, grouped
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Pull, Tendons, Turn


@dataclass(frozen=True, eq=False)
class Equations:
    """mass q'' = force, with derivatives of the force's stiff part: -stiffness, -damping over q, q', and over time."""

    mass: np.ndarray  # (n, N, N)
    force: np.ndarray  # (n, N)
    # stiffness, damping: (n, N, N) symmetric, positive semidefinite
    stiffness: np.ndarray
    damping: np.ndarray
    force_rate: np.ndarray  # (n, N) slope of the force over time where the fish does not move
    now: Instant  # instant that they hold for
    # the same instant for each group of mechanisms that acts while it swims, its rows alone; the whole for others
    seen: list[Instant]


class Motion:
    """n simulations of one layout: parameters, commanded cranks, mechanisms.

    Args:
        layout: layout of the fish.
        parameters: n rows, already prepared by the mechanisms.
        frequency_hz: (n,) turns of the crank a second.
        phase_rad: (n,) angles of the crank at time 0.
        mechanisms: n tuples of the mechanisms that act.
    """

    def __init__(
        self,
        layout: Layout,
        parameters: Parameters,
        frequency_hz: np.ndarray,
        phase_rad: np.ndarray,
        mechanisms: Sequence[Sequence[Mechanism]],
    ) -> None:
        self.layout, self.parameters = layout, parameters
        self.groups = grouped(mechanisms, parameters)
        self.chain = Chain(layout, parameters)
        self._tendons = Tendons(layout, parameters, self.chain)
        self._water = Water(layout, parameters, self.chain)
        self._reactive = ReactiveWater(layout, parameters, self.chain) if parameters.added_mass_reaction.any() else None
        self._speed, self._phase = 2 * np.pi * frequency_hz[:, None], phase_rad[:, None]
        p = parameters
        self._hinge_stiffness = _couple_links(p.hinge_stiffness_n_m + p.extra_implicit_stiffness_n_m)
        self._hinge_damping = _couple_links(p.hinge_damping_n_m_s + p.extra_implicit_damping_n_m_s)

    def commanded(self, time_s: np.ndarray) -> Turn:
        """Return how the cranks are asked to turn at times (n, 1): evenly."""
        return Turn(self._phase + self._speed * time_s, self._speed)

    def turn(self, time_s: np.ndarray, states: list[np.ndarray]) -> Turn:
        """Return how the cranks turn at times (n, 1)."""
        even = self.commanded(time_s)
        angle, speed = even.angle_rad, even.speed_rad_s.copy()
        for group, state in zip(self.groups, states, strict=True):
            if group.overrides("turn"):
                rows = group.rows
                changed = group.mechanism.turn(time_s[rows], Turn(angle[rows], speed[rows]), state)
                angle[rows], speed[rows] = changed.angle_rad, changed.speed_rad_s
        return Turn(angle, speed)

    def start_states(self, time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> list[np.ndarray]:
        """Return the own state of each group of mechanisms; the crank is as commanded here."""
        even = self.commanded(time_s)
        now = self._build_instant(time_s, position, velocity, even, even, 1.0)
        return [group.mechanism.start(group.seen(now)) for group in self.groups]

    def advanced(self, at: Equations, states: list[np.ndarray], step_s: float) -> list[np.ndarray]:
        """Return the mechanisms' own states a step later."""
        return [
            group.mechanism.advance(seen, state, step_s) if group.overrides("advance") else state
            for group, seen, state in zip(self.groups, at.seen, states, strict=True)
        ]

    def equations(
        self, time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, states: list[np.ndarray], step_s: float
    ) -> Equations:
        """Build the equations at times (n, 1), coordinates and rates (n, N), force rates taken over a step."""
        now = self._build_instant(
            time_s, position, velocity, self.turn(time_s, states), self.turn(time_s + step_s, states), step_s
        )
        pose, pull = now.pose, now.pull
        mass, force = self.chain.inertia(pose)
        force += now.bend(self._compute_hinge_torque(pose)) + now.tighten(pull.tension_n)
        water = now.water
        seen_by_all = [group.seen(now) if group.acts else now for group in self.groups]
        for group, seen, state in zip(self.groups, seen_by_all, states, strict=True):
            if group.overrides("water"):
                water = _replace_rows(water, group, group.mechanism.water(seen, rows_of(water, group.rows), state))
            if group.overrides("force"):
                force[group.rows] += group.mechanism.force(seen, state)
        force += self._water.on_links(pose, water)
        if self._reactive is not None:
            mass += self._reactive.inertia(pose)
            force += self._reactive.force(pose, now.flow)
        stiffness, damping = self._linearise(now, pull)
        return Equations(mass, force, stiffness, damping, now.tighten(pull.tension_rate_n_s), now, seen_by_all)

    def _build_instant(
        self, time_s: np.ndarray, position: np.ndarray, velocity: np.ndarray, turn: Turn, later: Turn, step_s: float
    ) -> Instant:
        pose = self.chain.pose(position, velocity)
        flow = self._water.flow(pose)
        return Instant(
            time_s=time_s,
            pose=pose,
            turn=turn,
            pull=self._tendons.pull(pose, turn, later, step_s),
            flow=flow,
            water=self._water.forces(flow),
            parameters=self.parameters,
            layout=self.layout,
            chain=self.chain,
        )

    def _compute_hinge_torque(self, pose: Pose) -> np.ndarray:
        p = self.parameters
        bent = pose.hinge_rad - p.hinge_rest_rad
        return -p.hinge_stiffness_n_m * bent - p.hinge_damping_n_m_s * pose.hinge_rate_rad_s

    def _linearise(self, now: Instant, pull: Pull) -> tuple[np.ndarray, np.ndarray]:
        """Return (n, N, N) stiffness and damping of hinges and tendons, and of the water against motion."""
        gradient = pull.gradient_m
        along, p = np.swapaxes(gradient, 1, 2), self.parameters
        stiffness = self._hinge_stiffness + (along * p.tendon_stiffness_n_m[:, None]) @ gradient
        damping = self._hinge_damping + (along * p.tendon_damping_n_s_m[:, None]) @ gradient
        return stiffness, damping + self._water.resistance(now.pose, now.flow)


def _replace_rows(forces: StripForces, group: Group, by: StripForces) -> StripForces:
    """Return the forces on all strips, those in the group's rows exchanged."""
    along, across, torque = forces.along_n.copy(), forces.across_n.copy(), forces.torque_n_m.copy()
    along[group.rows], across[group.rows], torque[group.rows] = by.along_n, by.across_n, by.torque_n_m
    return StripForces(along, across, torque)


def _couple_links(values: np.ndarray) -> np.ndarray:
    """Return the (n, N, N) matrix of springs or dampers (n, h) between neighbouring links."""
    hinges = values.shape[1]
    apart = np.diff(np.eye(hinges + 1), axis=0)  # (h, l)
    matrix = np.zeros((len(values), hinges + 3, hinges + 3))
    matrix[:, 2:, 2:] = apart.T @ (values[:, :, None] * apart)
    return matrix
