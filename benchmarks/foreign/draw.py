"""Drawn and simulated sessions: robot, water, camera, tracker, trials; by the twin, or by the second simulator."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.foreign.recordings import Recording, Recordings, Tracker
from benchmarks.posterior.truth import forward_swimmer
from benchmarks.reality import Trial as RealTrial
from benchmarks.reality import World, simulate
from swimcal.errors import InputError, SimulationDiverged
from swimcal.robot import RobotSpec, load_robot
from swimcal.twin import Twin
from swimsynth.disturbances import SyntheticMotor, TrackingNoise
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS, SyntheticCamera, SyntheticPlan, SyntheticTrial, default_plan
from swimsynth.simulate import simulate_decays, simulate_dry_runs, simulate_swims

FPS = (20.0, 24.0, 25.0, 29.97, 30.0, 50.0, 59.94, 60.0, 90.0, 100.0, 120.0, 240.0)
SLOWEST_HZ = 0.3
FASTEST_HZ = 3.0
SHORTEST_S = 3.0
LONGEST_S = 20.0
REALLY_LONGEST_S = 7.0  # The second simulator, which is slow, makes no longer trials.
COUNTS = (1, 2, 2, 2, 3, 3, 3, 4, 5, 6)  # The number of swim trials is one of these.
FINEST_FPS = 240.0  # At least as many instants a second are kept of what truly happens.
SLOWEST_M_S = 0.01  # A slower robot is no swimmer, and is drawn anew.
_TIMESTEP_S = 0.0005
_RUN_IN_S = 6.0
_REAL_RUN_IN_S = 3.0  # run-in of the second simulator
_TRIES = 40  # At most this many sessions are drawn for one.
_ROBOTS = Path(__file__).parents[2] / "tests" / "swimcal" / "robots"


def draw(seed: int, number: int) -> Recordings:
    """Draw a session in the pool, still to be disturbed and filmed; draw anew what diverges or does not swim."""
    for attempt in range(_TRIES):
        try:
            session = _draw_session(np.random.default_rng([seed, number, attempt]))
        except (SimulationDiverged, InputError):
            continue
        if all(_measure_swum_m(session, swim) > SLOWEST_M_S * np.ptp(swim.pool_s) for swim in session.swims):
            return session
    raise RuntimeError(f"session {number} of seed {seed}: no swimmer in {_TRIES} draws")


def _draw_session(random: np.random.Generator) -> Recordings:
    robot, built_in = _draw_robot(random)
    simulator = "reality" if built_in and random.random() < 0.2 else "twin"
    px_per_m, mirrored = float(np.exp(random.uniform(*np.log([400.0, 2500.0])))), bool(random.random() < 0.3)
    fps, warmup_s = float(random.choice(FPS)), float(random.choice([0.5, 1.0, 1.0, 2.0]))
    markers = _draw_markers(robot, mirrored, random)
    trials = _draw_trials(warmup_s, LONGEST_S if simulator == "twin" else REALLY_LONGEST_S, random)
    fine = fps * np.ceil(FINEST_FPS / fps)
    plan = SyntheticPlan(
        trials=trials,
        seed=int(random.integers(2**31)),
        robot=robot,
        markers=markers,
        camera=SyntheticCamera(fps=fine, px_per_m=px_per_m, width_px=100_000, height_px=100_000),
        run_in_s=_RUN_IN_S,
        warmup_s=0.0,
        timestep_s=_TIMESTEP_S,
    )
    if simulator == "reality":
        recordings, coefficients = _simulate_by_reality(plan, random), None
    else:
        asked = np.array([trial.frequency_hz for trial in trials])
        true = forward_swimmer(Twin(robot, markers, workers=1), np.array([asked.min(), asked.max()]), random)
        dry = _list_dry_experiments(plan) if built_in and random.random() < 0.3 else {}
        recordings, coefficients = _simulate_by_twin(plan.model_copy(update={"coefficients": true, **dry})), tuple(true)
    for trial in recordings:
        _place(trial, mirrored)
    tracker = _draw_tracker(px_per_m, random)
    return Recordings(robot, built_in, simulator, markers, fps, px_per_m, warmup_s, tracker, coefficients, recordings)


def _draw_robot(random: np.random.Generator) -> tuple[RobotSpec, bool]:
    """Draw a robot, and return whether it is the built-in one."""
    fish, kind = load_robot(), random.random()
    if kind < 0.5:
        return fish, True
    if kind < 0.85:
        return load_robot(_ROBOTS / ("three_link.toml" if kind < 0.65 else "seven_link.toml")), False
    stiff, thick, arm = np.exp(random.uniform(-0.25, 0.25, 3))
    tail = {
        "hinge_stiffness_n_m": stiff * fish.tail.hinge_stiffness_n_m,
        "hinge_damping_n_m_s": thick * fish.tail.hinge_damping_n_m_s,
    }
    content = fish.model_dump()
    content["tail"] |= tail
    content["crank"] |= {"arm_m": arm * fish.crank.arm_m}
    return RobotSpec.model_validate(content | {"name": "other_fish"}), False


def _draw_markers(robot: RobotSpec, mirrored: bool, random: np.random.Generator) -> tuple[str, ...]:
    """Draw nose, neck, and some of the others: of those behind the head one at least."""
    flat = [name for name, marker in robot.markers.items() if not (mirrored and marker.position_m[1])]
    tail = [name for name in flat if robot.markers[name].body != "head"]
    share = random.choice([0.0, 0.5, 1.0, 1.0, 1.0])
    chosen = {"nose", "neck", str(random.choice(tail))} | {name for name in flat if random.random() < share}
    return tuple(name for name in robot.markers if name in chosen)


def _draw_trials(warmup_s: float, longest_s: float, random: np.random.Generator) -> tuple[SyntheticTrial, ...]:
    count, logged = int(random.choice(COUNTS)), longest_s == LONGEST_S and random.random() < 0.2
    roles = ["fit", *("fit" if random.random() < 0.5 else "holdout" for _ in range(count - 1))]
    names = (f"swim_{letter}" for letter in "abcdef")
    return tuple(_draw_trial(*named, warmup_s, longest_s, logged, random) for named in zip(names, roles, strict=False))


def _draw_trial(
    name: str, role: str, warmup_s: float, longest_s: float, logged: bool, random: np.random.Generator
) -> SyntheticTrial:
    """Draw a trial long enough for two beats that are compared, and two before them where it is held out."""
    hz = float(np.exp(random.uniform(*np.log([SLOWEST_HZ, FASTEST_HZ]))))
    least_s = warmup_s + 2.5 / hz if role == "fit" else max(warmup_s, 2.0 / hz) + 2.5 / hz
    least_s = max(least_s, SHORTEST_S)
    seconds = round(float(np.exp(random.uniform(np.log(least_s), np.log(max(longest_s, least_s))))), 1)
    motor = None
    if logged:
        motor = SyntheticMotor(drive_s=seconds + 1.0, clock_offset_s=float(random.uniform(0.0, 9000.0)))
        seconds = motor.ends_s + 0.4
    return SyntheticTrial(
        name=name,
        frequency_hz=hz,
        commanded_hz=hz * (1.0 + float(random.uniform(0.0, 0.03))),
        seconds=seconds,
        role="fit" if role == "fit" else "holdout",
        phase_rad=float(random.uniform(0.0, 2 * np.pi)),
        heading_rad=float(random.uniform(0.0, 2 * np.pi)),
        motor=motor,
    )


def _draw_tracker(px_per_m: float, random: np.random.Generator) -> Tracker:
    """Draw errors of 0.2 to 2 px in all, boxes off by up to half a millimetre (one standard deviation)."""
    sd_px, white = np.exp(random.uniform(*np.log([0.2, 2.0]))), random.uniform()
    lasting = TrackingNoise(
        sd_px=sd_px * np.sqrt(1 - white),
        correlation_s=float(random.uniform(0.0, 0.3)),
        placement_sd_px=float(random.uniform(0.0, 0.0005)) * px_per_m,
        half_pixel_grid=bool(random.random() < 0.5),
    )
    return Tracker(lasting, float(sd_px * np.sqrt(white)))


def _list_dry_experiments(plan: SyntheticPlan) -> dict:
    """Return the dry experiments of the sample session: two logged dry runs and three free decays."""
    like = default_plan(plan.seed)
    return {"dry_runs": like.dry_runs, "free_decays": like.free_decays}


def _simulate_by_twin(plan: SyntheticPlan) -> list[Recording]:
    found = []
    for kind, runs in (("swim", simulate_swims(plan)), ("dry", simulate_dry_runs(plan))):
        for run in runs:
            log = None if run.motor is None else (run.motor.log, run.motor.commands)
            stretch = None if run.motor is None else run.motor.steady_s
            named = (run.trial.name, kind, run.trial.role, run.frequency_hz, run.trial.commanded_hz)
            found.append(Recording(*named, run.time_s, run.position_px, log, stretch))
    for decay in simulate_decays(plan):
        found.append(Recording(decay.trial.name, "free_decay", "fit", 0.0, None, decay.time_s, decay.position_px))
    return found


def _simulate_by_reality(plan: SyntheticPlan, random: np.random.Generator) -> list[Recording]:
    """Simulate the same trials by the second simulator, without logs."""
    coefficients = np.array(PLAUSIBLE_COEFFICIENTS) * random.uniform(0.8, 1.25, 5)
    blunt, slender, angular, kutta, magnus = map(float, coefficients)
    world, swims = World((blunt, slender, angular, kutta, magnus)), []
    for trial in plan.trials:
        swim = RealTrial("swim", trial.seconds, fps=plan.camera.fps, run_in_s=_REAL_RUN_IN_S)
        beats = replace(swim, frequency_hz=trial.frequency_hz, phase_rad=trial.phase_rad, heading_rad=trial.heading_rad)
        swims.append(beats)
    found = []
    for trial, seen in zip(plan.trials, simulate([(world, swim) for swim in swims], plan.markers), strict=True):
        place = plan.camera.px_per_m * seen.marker_m * np.array([1.0, -1.0])
        named = (trial.name, "swim", trial.role, trial.frequency_hz, trial.commanded_hz)
        found.append(Recording(*named, seen.trial.time_s, place))
    return found


def _place(trial: Recording, mirrored: bool) -> None:
    """Mirror the picture, and cut it so that all of the swim is in it, with a margin."""
    if mirrored:
        trial.pool_px = trial.pool_px * np.array([-1.0, 1.0])
    trial.pool_px = trial.pool_px - trial.pool_px.min(axis=(0, 1)) + 100.0


def _measure_swum_m(session: Recordings, swim: Recording) -> float:
    """Return how far the swim got the way the robot looks, m."""
    nose, neck = session.head
    way = (swim.pool_px[:, nose] - swim.pool_px[:, neck]).mean(axis=0)
    return float((swim.pool_px[-1, nose] - swim.pool_px[0, nose]) @ way / np.linalg.norm(way)) / session.px_per_m
