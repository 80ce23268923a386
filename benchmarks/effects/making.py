"""Withheld sessions as folders like any user's, and the answers that are kept apart from them."""

import gzip
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks import reality, wake
from benchmarks.effects.drawn import DrawnTrial, DrawnWorld, draw_swim, draw_world, sample_world, swims_forward
from benchmarks.effects.filming import Filming, Simulate
from benchmarks.effects.folder import Answer
from benchmarks.effects.rows import SessionRows, camera_of, closest_fit, tracks_of
from benchmarks.effects.severity import Strength, Strong, strength_for
from benchmarks.effects.suite import WARMUP_S, SessionPlan, SuiteSize, plan_suite
from benchmarks.reality import Mechanism, Recording, Trial, World
from benchmarks.reality.mechanisms import CATALOGUED, EVERY, OUTSIDE
from benchmarks.reality.record import Drive
from benchmarks.wake.mechanisms import CATALOGUED as IN_WAKES
from benchmarks.wake.suite import draw_wake_swim, draw_wake_world, is_plausible, plan_wake_suite, sample_wake_world
from diagnosis.discrepancy import Discrepancy
from diagnosis.refit import refit_from, residual_with
from swimcal.create_session import FISHSIM_MARKERS, new_folder, write_session_toml
from swimcal.effects.effect import Effect
from swimcal.motor_log import CURRENT_A, MotorLog
from swimcal.results import write_whole
from swimcal.session import load_session
from swimcal.tracks import save_tracks
from swimsynth.simulate import in_steps, save_motor_log

_READING_S = 0.02  # The motor is read at this interval.
_CLOCK_S = 1000.0  # The clock of the motor starts at most this late.
_FILED_S = 946_684_800  # Every file has the time stamp of 2000-01-01, in seconds since 1970.
# Every file of tracks is filled up to this size, since its packed size would depend on the motion.
_TRACKS_BYTES = 32_768
_IDLE_A = 0.25  # current without load
_AMPERE_PER_N_M = 0.6  # slope of the current over the torque
_VOLT = 12.1  # voltage
_WARM_C = 31.0  # temperature
_ROUNDS = 8  # A refit with the true effects takes this many steps.
_MIN_RESIDUAL = 1.0  # A gap shows where the plain twin leaves this many squared standard deviations of held-out trials.


@dataclass(frozen=True)
class Generator:
    """Way in which sessions come about."""

    plan: Callable[[int, SuiteSize], tuple[SessionPlan, ...]]  # plans the sessions of a seed
    draw: Callable[[SessionPlan], Filming[DrawnWorld]]  # draws a session before anything acts
    simulate: Simulate
    mechanisms: Mapping[str, Callable[[np.random.Generator], Strong]]  # mechanisms of the catalogue and others, by name
    world: Callable[[np.random.Generator], World]  # draws robot, water and camera
    swim: Callable[[float, float, np.random.Generator], Trial]  # draws a launch, by frequency and duration
    plausible: Callable[[Recording], bool]  # tells whether a swim of the base state is one


GENERATORS: Mapping[str, Generator] = {
    "reality": Generator(
        lambda seed, size: plan_suite(seed, size, [n for n in CATALOGUED if n not in size.without], tuple(OUTSIDE)),
        draw_world,
        reality.simulate,
        EVERY,
        sample_world,
        draw_swim,
        swims_forward,
    ),
    "wake": Generator(
        plan_wake_suite, draw_wake_world, wake.simulate, IN_WAKES, sample_wake_world, draw_wake_swim, is_plausible
    ),
}
"""The second simulator, and the one whose swimmer sheds its wake."""


@dataclass(frozen=True, eq=False)
class Making:
    """Sources that sessions are made from."""

    generator: Generator  # generator of what is filmed
    discrepancy: Discrepancy  # residual of the refitted twin in the base state of the second simulator
    effects: Mapping[str, Effect]  # effects in the catalogue's own forms

    def make(self, plan: SessionPlan, folder: Path) -> Filming[Answer]:
        """Make `folder/<name>` and end with what is in it.

        Raises:
            InputError: the folder of the session is there and not empty.
            ResultsNotWritable: the folder cannot be written.
            ValueError: no robot was drawn that swims forward.
        """
        drawn = yield from self.generator.draw(plan)
        present, answer = yield from self._choose_effects(drawn)
        write_session(folder / plan.name, drawn, (yield from drawn.recorded(present)))
        return answer

    def _choose_effects(self, drawn: DrawnWorld) -> Filming[tuple[tuple[Mechanism, ...], Answer]]:
        plan = drawn.plan
        if plan.kind == "null":
            return (), Answer(plan.name, "null", seed=plan.seed)
        base = yield from drawn.recorded()
        fitted = SessionRows.of(drawn, base, self.discrepancy)
        signatures = fitted.signatures(self.effects)
        random = np.random.default_rng([plan.seed, 3])
        strengths: list[Strength] = []
        for name in plan.effects:
            strong, own = self.generator.mechanisms[name](random), name if name in self.effects else None
            strengths.append((yield from strength_for(plan.detectability, strong, own, drawn, fitted, signatures)))
        present = tuple(mechanism for strength in strengths for mechanism in strength.mechanisms)
        known = [self.effects[name] for name in plan.effects if name in self.effects]
        shrinkage = None
        if known:
            held = SessionRows.of(drawn, base, self.discrepancy, "holdout", fitted.coefficients)
            recordings = yield from drawn.recorded(present)
            shrinkage = oracle_shrinkage(known, fitted, held, recordings)
        stages = {effect.stage for effect in known}
        outside = plan.effects[0] if plan.kind == "outside" else None
        return present, Answer(
            session=plan.name,
            kind=plan.kind,
            effects=tuple(effect.name for effect in known),
            outside=outside,
            alike=tuple(strength.alike for strength in strengths),
            detectability=round(min(strength.detectability for strength in strengths), 2),
            stage=stages.pop() if len(stages) == 1 else None,
            oracle_shrinkage=shrinkage,
            seed=plan.seed,
            strengths=tuple(strength.value for strength in strengths),
        )


def oracle_shrinkage(
    effects: Sequence[Effect], fitted: SessionRows, held_out: SessionRows, recordings: Mapping[str, Recording]
) -> float | None:
    """Return S = 1 - L_with / L_plain of held-out trials, both twins refitted on the fitted ones with the simulation.

    Of all features that a diagnosis uses, course and sliding too. Nothing has noise, and the residual of the base state
    is subtracted, so there is no floor. None where a twin diverges, or the effects do not change held-out trials.

    Effects are in the twin's own form; recordings, by name, are of all swims with them as they truly are. The rows of
    held-out swims are at the coefficients of the fitted ones.
    """
    try:
        at = fitted.refitted(recordings)
        _, start = closest_fit(
            fitted.changes(recordings), fitted.signatures({effect.name: effect for effect in effects})
        )
        best = refit_from(fitted.linear(recordings, at), effects, np.concatenate(start.values), _ROUNDS)
        held = held_out.linear(recordings, at)
        plain, rest = (
            float((held.whitened_swims(row) ** 2).sum()) for row in (held.residual, residual_with(held, best))
        )
    except (np.linalg.LinAlgError, ValueError):  # a twin diverged, and what it leaves is not finite
        return None
    return 1 - rest / plain if plain > _MIN_RESIDUAL else None


def write_session(folder: Path, drawn: DrawnWorld, recordings: Mapping[str, Recording]) -> None:
    """Write what a user would have of these recordings: tracks with a tracker's errors, motor logs, the description.

    Raises:
        InputError: the folder is there and not empty.
        ResultsNotWritable: it cannot be written.
    """
    with new_folder(folder) as part:
        tables = []
        for number, each in enumerate(drawn.trials):
            recording = recordings[each.name]
            random = np.random.default_rng([drawn.plan.seed, 4, number])
            tracks = tracks_of(recording, drawn.world.noise.tracked(recording.time_s, recording.position_px, random))
            plain = part / "trials" / f"{each.name}.csv"
            save_tracks(plain, tracks)
            write_whole(plain.with_suffix(".csv.gz"), _pack(plain.read_bytes()))
            plain.unlink()
            table = {"name": each.name, "kind": each.trial.kind, "tracks": f"trials/{each.name}.csv.gz"}
            asked = {"commanded_hz": each.commanded_hz, "role": each.role}
            tables.append(table | asked | _write_log(part, drawn, each, recording, random))
        camera = camera_of(drawn)
        write_session_toml(
            part,
            name=drawn.plan.name,
            camera={"fps": camera.fps, "scale_length_m": round(camera.scale_length_m, 9)},
            markers=FISHSIM_MARKERS,
            trials=tables,
            fit={"warmup_s": WARMUP_S},
        )
        load_session(part)
    for path in [*folder.rglob("*"), folder]:  # the time to make it would depend on what is in it
        os.utime(path, (_FILED_S, _FILED_S))


def _pack(plain: bytes) -> bytes:
    """Compress bytes, then fill them up with the zeros that readers of the format skip (gzip, RFC 1952)."""
    packed = gzip.compress(plain, mtime=0)
    return packed + bytes(-len(packed) % _TRACKS_BYTES)


def _write_log(
    folder: Path, drawn: DrawnWorld, each: DrawnTrial, recording: Recording, random: np.random.Generator
) -> dict[str, Any]:
    """Write the log of a motor, where there is one; its clock offset is given by hand."""
    if not drawn.plan.recorded.logged or each.trial.kind == "free_decay":
        return {}
    offset_s = float(np.round(random.uniform(0.0, _CLOCK_S), 3))
    file = f"trials/{each.name}.motor.csv"
    save_motor_log(folder / file, _read_motor(recording.drive, each.trial.duration_s, offset_s, random))
    return {"motor": file, "motor_offset_s": offset_s}


def _read_motor(drive: Drive, duration_s: float, offset_s: float, random: np.random.Generator) -> MotorLog:
    """Read the motor at even times on a clock of its own, in its own steps, while its trial is filmed."""
    time_s = np.arange(0.0, duration_s + 1e-9, _READING_S)
    crank = CubicSpline(drive.time_s, drive.angle_rad)
    load_a = _AMPERE_PER_N_M * np.interp(time_s, drive.time_s, drive.torque_n_m)
    current_a = _IDLE_A + load_a + CURRENT_A * random.standard_normal(len(time_s))
    zero_rad = 2 * np.pi * random.random()
    even = np.ones(len(time_s))
    return in_steps(
        time_s + offset_s, crank(time_s) + zero_rad, crank(time_s, 1), current_a, _VOLT * even, _WARM_C * even
    )
