"""Data that the sections of a report are built from: results of a session, motor logs, and swims of its policies.

`ReportContext` holds all of it; the motor log of a trial is a `LoggedTrial`, the episodes of a policy are
`PolicySwims`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from diagnosis.result import DiagnosisResult
from fitting.calibration import CalibratedTrial, Calibration
from fitting.calibration_file import PublishedResult, calibration_result
from fitting.dry_run import DryTrial
from fitting.motor_clock import MotorRecord
from fitting.structure import Structure
from fitting.trial import MeasuredTrial
from reports.answers import Answers, answers_of
from reports.caveats import explains_the_rest
from reports.words import in_words, listed
from swimcal.results import Provenance, check_whole, sha256_of
from swimcal.robot import RobotSpec
from swimcal.session import Session

if TYPE_CHECKING:
    from fitting.posterior.summary import PosteriorSummary

# Motor logs
TURN = 2 * np.pi
BINS = 72  # bins of a turn

# Policies
TASKS = ("target", "circle")
SWIMS = ".swims.npz"
"""Ending of the file that `calib policy train` writes next to a policy."""


# Motor logs.


@dataclass(frozen=True, eq=False)
class LoggedTrial:
    """One dry run or swim with a motor log of n rows."""

    name: str
    kind: Literal["dry", "swim"]
    motor: MotorRecord

    @property
    def off_command(self) -> float:
        """Relative difference of the measured from the commanded speed; nan without a command."""
        hz = self.motor.commanded_hz
        return self.motor.measured_hz / hz - 1 if hz > 0 else float("nan")

    @property
    def speed(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,), s, and the motor's own speeds (n,), turns/s, positive as the crank turns on the whole."""
        log = self.motor.log
        return self._on_video(log.time_s), self._forward * log.velocity_rad_s / TURN

    @property
    def command(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Times (k,), s, and the speeds commanded then (k,), turns/s; None where they were not kept."""
        commands = self.motor.commands
        if commands is None:
            return None
        return self._on_video(commands.time_s), self._forward * commands.velocity_rad_s / TURN

    @property
    def codes(self) -> tuple[tuple[float, float], ...]:
        """Start and end of each coded wiggle, s."""
        commands = self.motor.commands
        spans = [commands.span_s(part) for part in ("start_code", "end_code")] if commands else []
        return tuple((float(a), float(b)) for a, b in (self._on_video(np.array(span)) for span in spans if span))

    @property
    def zero_s(self) -> float:
        """The time at which a time axis begins, s.

        It is the video's time 0, or the first row of a log that cannot be aligned with the video.
        """
        return 0.0 if self.motor.laid else float(self._on_video(self.motor.log.time_s)[0])

    @property
    def steady(self) -> np.ndarray:
        """Mask (n,) of the rows of the log within the steady stretch."""
        time_s, (start, end) = self._on_video(self.motor.log.time_s), self.motor.drive_s
        return (time_s >= start) & (time_s <= end)

    @property
    def turns(self) -> np.ndarray:
        """Speed over its mean (t, BINS), at even angles of the shaft, in each whole turn of the steady stretch."""
        motor = self.motor
        inside = self.steady & np.isfinite(motor.log.position_rad)
        if not inside.any():
            return np.zeros((0, BINS))
        time_s = self._on_video(motor.log.time_s[inside])
        turned = motor.turn.angle(time_s)
        angle = turned + np.median(self._forward * motor.log.position_rad[inside] - turned)
        whole = np.arange(np.ceil(angle[0] / TURN), np.floor(angle[-1] / TURN))
        places = TURN * (whole[:, None] + np.arange(BINS) / BINS)  # (t, BINS)
        return np.interp(places, angle, motor.turn.speed(time_s)) / (TURN * motor.measured_hz)

    @property
    def _forward(self) -> float:
        """The sign of the shaft's turning on the whole."""
        position = self.motor.log.position_rad[np.isfinite(self.motor.log.position_rad)]
        return -1.0 if len(position) and position[-1] < position[0] else 1.0

    def _on_video(self, motor_s: np.ndarray) -> np.ndarray:
        return (motor_s - self.motor.clock.offset_s) / self.motor.clock.rate


# Policies.


@dataclass(frozen=True, eq=False)
class PolicySwims:
    """The episodes of one policy on the twin.

    Attributes:
        task, method: "target" or "circle"; "search" or "sac".
        of_this_fit: whether it was trained on the twin that the report is about.
        start_m: (n, 2) first targets, from the start, where the robot heads along -x; its left is -y.
        reached, diverged: (n,) how the episodes ended; neither: out of time.
        seconds: (n,) how long they lasted.
        off_path_m: (2, n) mean and largest distance from the path; nan without one.
        path_m: (k, m, 2) paths of the first m episodes, at even times; nan once one is over.
        radius_m: radius of the circle; nan without one.
    """

    task: str
    method: str
    trained_s: float
    seed: int
    of_this_fit: bool
    start_m: np.ndarray
    reached: np.ndarray
    diverged: np.ndarray
    seconds: np.ndarray
    off_path_m: np.ndarray
    path_m: np.ndarray
    radius_m: float = float("nan")

    @property
    def distance_m(self) -> np.ndarray:
        """Distances (n,) of the targets from the start, m."""
        return np.asarray(np.hypot(*self.start_m.T))


def swims_files(results: Path) -> tuple[Path, ...]:
    """List the files of swims that are there, with their cards; targets first."""
    files = [results / "policy" / f"{task}{SWIMS}" for task in TASKS]
    return tuple(file for file in files if file.is_file() and _card(file).is_file())


def read_swims(results: Path) -> tuple[PolicySwims, ...]:
    """Read the swims of all policies of a session."""
    fitted = results / "calibrated.xml"
    return tuple(_read(file, sha256_of(fitted) if fitted.is_file() else "") for file in swims_files(results))


def _card(file: Path) -> Path:
    return file.with_name(file.name.removesuffix(SWIMS) + ".json")


def _read(file: Path, fit: str) -> PolicySwims:
    for part in (_card(file), file):
        check_whole(part, "calib policy evaluate")
    card = json.loads(_card(file).read_bytes())
    with np.load(file, allow_pickle=False) as arrays:
        return PolicySwims(
            card["task"],
            card["method"],
            float(card["training"].get("trained_s", np.nan)),
            card["seed"],
            card["model_sha256"] == fit,
            arrays["start_m"],
            arrays["reached"],
            arrays["diverged"],
            arrays["seconds"],
            arrays["off_path_m"],
            arrays["path"],
            radius_m=1.0 if card["task"] == "circle" else np.nan,
        )


# The session.


class NoSwims(NamedTuple):
    """A stand-in for the calibration of a session without a swim trial."""

    structure: Structure
    trials: tuple[CalibratedTrial, ...] = ()

    @property
    def robot(self) -> RobotSpec:
        """The robot with this structure."""
        return self.structure.robot


@dataclass(frozen=True, eq=False)
class ReportContext:
    """The results of one session.

    Attributes:
        notes: further sentences for the reader, such as what was left out.
        published: what the published search leads to; None where it was not run.
        posterior: how sure the coefficients are; None where it was not sampled.
        diagnosed: where the sim-to-real gap is and what causes it; None where it was not diagnosed.
        policies: how the trained policies swim, targets first.
        damaged: the file of "posterior" or "diagnosis" that cannot be read, where there is one.
    """

    session: Session
    calibration: Calibration
    provenance: Provenance
    notes: tuple[str, ...] = ()
    published: PublishedResult | None = None
    posterior: PosteriorSummary | None = None
    diagnosed: DiagnosisResult | None = None
    diagnosis_effort: str = "full"
    policies: tuple[PolicySwims, ...] = ()
    damaged: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def answers(self) -> Answers:
        """The answers to what a reader asks first."""
        found = calibration_result(self.calibration)
        return answers_of(found, self.posterior, self.diagnosed, self.session.folder.name, self.damaged)

    @property
    def unknown_to_bands(self) -> str:
        """The named effects that bands of the plain twin do not know of, as a clause with its comma; "" without any."""
        if self.diagnosed is None or not explains_the_rest(self.diagnosed):
            return ""
        return f", which do not know of {listed([in_words(name) for name in self.diagnosed.effects])}"

    def trials(self, role: str) -> tuple[CalibratedTrial, ...]:
        """Return the fit or the held-out trials, in the order of the session."""
        return tuple(trial for trial in self.calibration.trials if trial.measured.role == role)

    @property
    def driven(self) -> tuple[tuple[DryTrial | MeasuredTrial, Literal["dry", "swim"]], ...]:
        """Dry runs and swims with their kind, in the order of the chain."""
        crank = self.calibration.structure.crank
        dry = crank.trials if crank else ()
        return (
            *((run.measured, "dry") for run in dry),
            *((trial.measured, "swim") for trial in self.calibration.trials),
        )

    @property
    def logged(self) -> tuple[LoggedTrial, ...]:
        """The driven trials that have a motor log."""
        return tuple(LoggedTrial(trial.name, kind, trial.motor) for trial, kind in self.driven if trial.motor)

    @property
    def even(self) -> list[str]:
        """Names of the trials whose crank is taken to turn evenly, for want of a log to follow."""
        followed = [trial.name for trial in self.logged if trial.motor.usable]
        return [trial.name for trial, _ in self.driven if trial.name not in followed]
