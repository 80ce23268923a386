"""Simulates trials in water that holds their wakes, filmed by their worlds' cameras."""

from collections.abc import Sequence

import numpy as np

from benchmarks.reality import simulate as simulate_reality
from benchmarks.reality.film import Recording, exposed_s, film
from benchmarks.reality.integrate import step
from benchmarks.reality.layout import Layout, lay_out
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.record import Recorder
from benchmarks.reality.run import divergence, start_of
from benchmarks.reality.world import Trial, World
from benchmarks.wake.coupling import HEAD_PANELS, WakeMotion, panels_of
from benchmarks.wake.lattice import SLENDER, Panels, Water
from benchmarks.wake.mechanisms import roughness_of, wall_of
from benchmarks.wake.viscous import Viscous
from benchmarks.wake.world import WakeWorld, trial_parameters
from swimmer.robot import load_robot

STEP_S = 0.004
_STEPS_A_BEAT = 60
_LONGEST_S = 0.03  # step of a wake
_CLASSES = (1, 2, 4, 7)
_BATCH, _SPARE_S = 96, 0.01


def simulate(
    trials: Sequence[tuple[World, Trial]],
    markers: tuple[str, ...] | None = None,
    step_s: float = STEP_S,
    fineness: int = 1,
    *,
    allow_divergence: bool = False,
) -> list[Recording]:
    """Recordings of the trials, in their order, each in its world; those out of water are reality's.

    Args:
        trials: worlds and what is done in them, in any mix.
        markers: names of the markers wanted; default all of the robot's.
        step_s: of the integrator.
        fineness: how many times as many panels, and as many steps of the wake.
        allow_divergence: what blows up becomes nan instead of an error.

    Raises:
        SimulationDiverged: a simulation blew up and `allow_divergence` is False.
    """
    robot = load_robot()
    layout, names = lay_out(robot), markers or tuple(robot.markers)
    dry = [i for i, (_, trial) in enumerate(trials) if trial.kind != "swim"]
    made = simulate_reality([trials[i] for i in dry], names, allow_divergence=allow_divergence)
    recordings = dict(zip(dry, made, strict=True))
    alike: dict[tuple[int, bool], list[int]] = {}
    for i, (world, trial) in enumerate(trials):
        if trial.kind == "swim":
            alike.setdefault((_substeps(trial, step_s, fineness), wall_of(world) is not None), []).append(i)
    for (substeps, _), rows in alike.items():
        rows.sort(key=lambda i: (-trials[i][1].duration_s, [type(m).__qualname__ for m in trials[i][0].mechanisms]))
        for first in range(0, len(rows), _BATCH):
            batch = rows[first : first + _BATCH]
            swims = _Swims([trials[i] for i in batch], layout, names, substeps, step_s, fineness)
            recordings.update(zip(batch, swims.filmed(allow_divergence), strict=True))
    return [recordings[i] for i in range(len(trials))]


def _substeps(trial: Trial, step_s: float, fineness: int) -> int:
    """Steps of the integrator for one of the wake, in few classes so that trials find company."""
    most = min(1 / (trial.frequency_hz * _STEPS_A_BEAT), _LONGEST_S) / (fineness * step_s)
    return max((each for each in _CLASSES if each <= most + 1e-9), default=1)


class _Swims:
    """Trials of one batch."""

    def __init__(
        self,
        trials: Sequence[tuple[World, Trial]],
        layout: Layout,
        markers: tuple[str, ...],
        substeps: int,
        step_s: float,
        fineness: int,
    ) -> None:
        self._trials, self._layout, self._markers = trials, layout, markers
        self._substeps, self._step_s = substeps, step_s
        self._made = [trial for _, trial in trials]
        worlds = [world for world, _ in trials]
        self._parameters = Parameters.stacked([trial_parameters(*each, layout, markers) for each in trials])
        panels = panels_of(layout, fineness)
        self._motion = WakeMotion(
            layout,
            self._parameters,
            (np.array([t.frequency_hz for t in self._made]), np.array([t.phase_rad for t in self._made])),
            [world.mechanisms for world in worlds],
            panels,
            _viscous(worlds, layout, panels, fineness),
            _water(trials, self._parameters),
            substeps * step_s,
        )

    def filmed(self, allow_divergence: bool) -> list[Recording]:
        """By the camera of each world."""
        trials, start_s = self._trials, -np.array([[trial.lead_s] for trial in self._made])
        last_s = np.array([max(float(exposed_s(*each).max()), each[1].duration_s) for each in trials])
        position, velocity = start_of(self._motion, self._made, start_s)
        recorder = Recorder(self._step_s)
        states = self._motion.start_states(start_s, position, velocity)
        steps = int(np.ceil((float((last_s - start_s[:, 0]).max()) + _SPARE_S) / self._step_s)) + 1
        with np.errstate(all="ignore"):  # what blows up is found below
            for k in range(steps):
                if k % self._substeps == 0:
                    self._motion.renew(position, velocity)
                time_s = start_s + k * self._step_s
                later, faster, at = step(self._motion, time_s, position, velocity, states, self._step_s)
                recorder.add(k, at.now, position, velocity)
                states = self._motion.advanced(at, states, self._step_s)
                position, velocity = later, faster
        record = recorder.finished(start_s)
        if (lost := record.lost).any() and not allow_divergence:
            raise divergence(self._made, lost, self._step_s)
        record.position[lost] = np.nan
        return [
            film(world, trial, record, row, self._layout, self._parameters, self._markers)
            for row, (world, trial) in enumerate(trials)
        ]


def _viscous(worlds: Sequence[World], layout: Layout, panels: Panels, fineness: int) -> Viscous:
    own = [world if isinstance(world, WakeWorld) else WakeWorld() for world in worlds]
    water, length = layout.robot.water, float(panels.node_m[-1] - panels.node_m[0])
    columns = ((w.drag_area_m2, w.cross_drag, w.roughness * roughness_of(w), w.suction) for w in own)
    return Viscous(
        water.density_kg_m3,
        water.viscosity_pa_s / water.density_kg_m3,
        length,
        panels.half_height_m / SLENDER,
        HEAD_PANELS * fineness,
        *(np.array(column)[:, None] for column in zip(*columns, strict=True)),
    )


def _water(trials: Sequence[tuple[World, Trial]], parameters: Parameters) -> Water:
    walls = [wall_of(world) for world, _ in trials]
    if walls[0] is None:
        return Water(parameters.current_m_s)
    planes = [wall.plane(trial) for wall, (_, trial) in zip(walls, trials, strict=True) if wall is not None]
    place, normal = np.array(planes).T[:, :, None]
    return Water(parameters.current_m_s, place, normal)
