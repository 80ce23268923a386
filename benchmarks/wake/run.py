"""Simulation of trials in water that holds their wakes, filmed by their worlds' cameras."""

from collections.abc import Sequence

import numpy as np

from benchmarks.reality import simulate as simulate_reality
from benchmarks.reality.film import Recording
from benchmarks.reality.layout import Layout, lay_out
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.run import cranks, filmed
from benchmarks.reality.world import Trial, World
from benchmarks.wake.coupling import HEAD_PANELS, WakeMotion, panels_of
from benchmarks.wake.lattice import SLENDER, Panels, Water
from benchmarks.wake.mechanisms import roughness_of, wall_of
from benchmarks.wake.viscous import Viscous
from benchmarks.wake.world import WakeWorld, trial_parameters
from swimcal.robot import load_robot

STEP_S = 0.004
_STEPS_A_BEAT = 60
_LONGEST_S = 0.03  # No step of a wake is longer.
_CLASSES = (1, 2, 4, 7)
_BATCH = 96


def simulate(
    trials: Sequence[tuple[World, Trial]],
    markers: tuple[str, ...] | None = None,
    step_s: float = STEP_S,
    fineness: int = 1,
    *,
    allow_divergence: bool = False,
) -> list[Recording]:
    """Simulate the trials, as `benchmarks.reality.simulate` does, which also makes those out of water.

    Args:
        trials: worlds and what is done in them, in any mix.
        markers: names of the markers wanted; default all of the robot's.
        step_s: step of the integrator, s.
        fineness: factor on the number of panels, and on that of the steps of the wake.
        allow_divergence: what blows up becomes nan instead of an error.
    """
    robot = load_robot()
    layout, names = lay_out(robot), markers or tuple(robot.markers)
    dry = [i for i, (_, trial) in enumerate(trials) if trial.kind != "swim"]
    made = simulate_reality([trials[i] for i in dry], names, allow_divergence=allow_divergence)
    recordings = dict(zip(dry, made, strict=True))
    alike: dict[tuple[int, bool], list[int]] = {}
    for i, (world, trial) in enumerate(trials):
        if trial.kind == "swim":
            alike.setdefault((_count_substeps(trial, step_s, fineness), wall_of(world) is not None), []).append(i)
    for (substeps, _), rows in alike.items():
        rows.sort(key=lambda i: (-trials[i][1].duration_s, [type(m).__qualname__ for m in trials[i][0].mechanisms]))
        for first in range(0, len(rows), _BATCH):
            batch = rows[first : first + _BATCH]
            swims = [trials[i] for i in batch]
            films = _simulate_batch(swims, layout, names, substeps, step_s, fineness, allow_divergence)
            recordings.update(zip(batch, films, strict=True))
    return [recordings[i] for i in range(len(trials))]


def _count_substeps(trial: Trial, step_s: float, fineness: int) -> int:
    """Return the steps of the integrator for one of the wake, in few classes so that trials find company."""
    most = min(1 / (trial.frequency_hz * _STEPS_A_BEAT), _LONGEST_S) / (fineness * step_s)
    return max((each for each in _CLASSES if each <= most + 1e-9), default=1)


def _simulate_batch(
    trials: Sequence[tuple[World, Trial]],
    layout: Layout,
    markers: tuple[str, ...],
    substeps: int,
    step_s: float,
    fineness: int,
    allow_divergence: bool,
) -> list[Recording]:
    worlds = [world for world, _ in trials]
    parameters = Parameters.stacked([trial_parameters(*each, layout, markers) for each in trials])
    panels = panels_of(layout, fineness)
    motion = WakeMotion(
        layout,
        parameters,
        cranks(trials),
        [world.mechanisms for world in worlds],
        panels,
        _build_viscous(worlds, layout, panels, fineness),
        _build_water(trials, parameters),
        substeps * step_s,
    )

    def renew(k: int, position: np.ndarray, velocity: np.ndarray) -> None:
        if k % substeps == 0:
            motion.renew(position, velocity)

    return filmed(motion, trials, markers, step_s, allow_divergence, renew)


def _build_viscous(worlds: Sequence[World], layout: Layout, panels: Panels, fineness: int) -> Viscous:
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


def _build_water(trials: Sequence[tuple[World, Trial]], parameters: Parameters) -> Water:
    walls = [wall_of(world) for world, _ in trials]
    if walls[0] is None:
        return Water(parameters.current_m_s)
    planes = [wall.plane(trial) for wall, (_, trial) in zip(walls, trials, strict=True) if wall is not None]
    place, normal = np.array(planes).T[:, :, None]
    return Water(parameters.current_m_s, place, normal)
