"""One reference world: a robot as it truly is, its water and camera, its mechanisms, and the trials made in it."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from benchmarks.reality.camera import Camera, PixelNoise
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.parameters import Parameters, nominal_parameters

TrialKind = Literal["swim", "dry", "free_decay"]


@dataclass(frozen=True)
class Nuisances:
    """Departures of this robot from its description, within the tolerance of its maker."""

    # head_mass, tail_mass: factors of mass, moment and inertia
    head_mass: float = 1.0
    tail_mass: float = 1.0
    # hinge_stiffness, hinge_damping: factors, common to all hinges
    hinge_stiffness: float = 1.0
    hinge_damping: float = 1.0
    sunk_m: float = 0.0  # depth by which it floats deeper, m
    # offset of each marker from its published place, along and across its link, m
    marker_shift_m: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class World:
    """State that is the same in all trials of a session."""

    # blunt, slender and angular drag, Kutta and Magnus lift; see `benchmarks.reality.fluid`
    coefficients: tuple[float, float, float, float, float]
    nuisances: Nuisances = field(default_factory=Nuisances)  # nuisances of the robot
    mechanisms: tuple[Mechanism, ...] = ()  # mechanisms that act; none in the base state
    camera: Camera = field(default_factory=Camera)  # camera above the pool
    noise: PixelNoise = field(default_factory=PixelNoise)  # noise of the tracker


@dataclass(frozen=True)
class Trial:
    """One recording."""

    kind: TrialKind  # "swim"; "dry": head clamped, in air; "free_decay": the same without tendons, from a bent tail
    duration_s: float  # duration of the film
    frequency_hz: float = 0.0  # turns of the crank a second, as commanded
    # phase of the crank in the first frame; the tail is straight at 0 and pulled to the left at pi / 2
    phase_rad: float = 0.0
    fps: float = 60.0
    run_in_s: float = 1.0  # time simulated before the first frame, in which what the start left behind fades
    start_speed_m_s: float = 0.1  # forward speed at the start of the run-in
    place_m: complex = 0.0  # place of the head's origin in the pool then, m
    heading_rad: float = np.pi  # heading of the fish then, from the pool's +x counter-clockwise
    bent_rad: tuple[float, ...] = ()  # bend in which a free decay is held, by hinge of the robot
    release_s: float = 0.0  # time at which it is let go

    @property
    def lead_s(self) -> float:
        """Time that is simulated before the first frame, s: the run-in, but for a free decay."""
        return 0.0 if self.kind == "free_decay" else self.run_in_s

    @property
    def time_s(self) -> np.ndarray:
        """(f,) times of the frames, s."""
        return np.arange(int(np.floor(self.duration_s * self.fps + 1e-9)) + 1) / self.fps


def prepared_parameters(world: World, trial: Trial, layout: Layout, markers: tuple[str, ...]) -> Parameters:
    """Return one row: the world's robot in the scene of a trial, changed by every mechanism."""
    nominal = nominal_parameters(layout, markers, world.coefficients)
    parameters = _set_scene(_add_nuisances(nominal, world, markers), trial)
    for mechanism in world.mechanisms:
        parameters = mechanism.prepare(parameters, layout)
    return parameters


def _add_nuisances(nominal: Parameters, world: World, markers: tuple[str, ...]) -> Parameters:
    its = world.nuisances
    mass = np.full(nominal.link_mass_kg.shape[1], its.tail_mass)
    mass[0] = its.head_mass
    shift = np.array([complex(*its.marker_shift_m.get(name, (0.0, 0.0))) for name in markers])
    return replace(
        nominal.reweighed(mass, np.zeros(3)),
        sunk_m=nominal.sunk_m + its.sunk_m,
        hinge_stiffness_n_m=nominal.hinge_stiffness_n_m * its.hinge_stiffness,
        hinge_damping_n_m_s=nominal.hinge_damping_n_m_s * its.hinge_damping,
        marker_m=nominal.marker_m + shift,
    )


def _set_scene(parameters: Parameters, trial: Trial) -> Parameters:
    if trial.kind == "swim":
        return parameters
    tendons = 1.0 if trial.kind == "dry" else 0.0
    return replace(
        parameters,
        density_kg_m3=np.zeros_like(parameters.density_kg_m3),
        head_clamped=np.ones_like(parameters.head_clamped),
        tendon_stiffness_n_m=tendons * parameters.tendon_stiffness_n_m,
        tendon_damping_n_s_m=tendons * parameters.tendon_damping_n_s_m,
    )
