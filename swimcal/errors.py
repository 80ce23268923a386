"""Errors with one message for a user, and the flags that a sample, a trial or an estimate can carry.

The tree of errors:

    SwimcalError                 anything the user can mend; the command ends with `exit_code`
    ├── InputError               faults in files that were read, all of them at once
    ├── SessionLocked            another run works on the same session
    ├── ResultsNotWritable       a result could not be written; nothing half-written is left
    ├── ModelMismatch            a calibration made with another engine or another model
    ├── SimulationDiverged       the twin left the range in which its numbers mean something
    ├── NotEnoughData            the recordings cannot carry the estimate that was asked for
    └── NotConverged             an estimate that must not be relied on, and therefore was not reported

Readers collect every `Fault` of a file in a `FaultCollector` and raise one `InputError`. A `Flag` is no error: it says
what is doubtful about a recording or a fit, with the number that it concerns; `FLAG_KINDS` lists them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import groupby
from typing import Any

SHOWN_PER_KIND = 10
"""Number of faults of one kind that are spelled out; the rest is only counted."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with one place of one file.

    Attributes:
        file: the file as the user knows it.
        where: the place in it: ``"line 12"``, ``"line 12, trial[2].role"``; empty for the whole file.
        what: what is wrong, without a full stop.
        found: what is there; empty if nothing is.
        expected: what would have been right.
        choices: the valid values, where they can be listed.
        next_step: what to do about it, where that is not obvious from `expected`.
    """

    file: str
    where: str
    what: str
    found: str = ""
    expected: str = ""
    choices: tuple[str, ...] = ()
    next_step: str = ""

    def describe(self) -> str:
        """Describe the fault in one line, without the name of the file."""
        details = [f"found {self.found}"] if self.found else []
        details += [f"expected {self.expected}"] if self.expected else []
        details += [f"choices: {', '.join(self.choices)}"] if self.choices else []
        head = f"{self.where}: {self.what}" if self.where else self.what
        sentence = "; ".join([head, *details])
        return f"{sentence}. {self.next_step}" if self.next_step else sentence

    def __str__(self) -> str:
        return f"{self.file}: {self.describe()}"


class SwimcalError(Exception):
    """Base of every error that the user can mend; its text is complete without a traceback.

    Example:
        >>> for folder in ("pool", "nowhere"):
        ...     try:
        ...         print(calib.report(folder).file.name)
        ...     except calib.SwimcalError as error:
        ...         print(error)
        report.html
        nowhere: no session.toml here; expected a session folder with a session.toml. Make one with `calib new`.
    """

    exit_code = 2


class InputError(SwimcalError):
    """The faults in what was read, all of them at once, grouped by file.

    Attributes:
        faults: every fault found, each once.

    Example:
        >>> try:
        ...     calib.convert_tracks("tracks.csv", "tracks.nc.gz", "movement", fps=0)
        ... except calib.InputError as error:
        ...     print(error)
        the options: 2 faults
          1. --fps: not a frame rate; found 0; expected a number above 0
          2. --out: packed files are read, not written; found tracks.nc.gz; expected a name without .gz
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(dict.fromkeys(faults))
        super().__init__(self.faults)

    def __str__(self) -> str:
        by_file = groupby(sorted(self.faults, key=lambda fault: fault.file), key=lambda fault: fault.file)
        return "\n".join(_paragraph(file, list(faults)) for file, faults in by_file)


def _paragraph(file: str, faults: Sequence[Fault]) -> str:
    if len(faults) == 1:
        return f"{file}: {faults[0].describe()}"
    ordered = sorted(faults, key=_line)
    lines = [f"  {number}. {fault.describe()}" for number, fault in enumerate(ordered, start=1)]
    return "\n".join([f"{file}: {len(faults)} faults", *lines])


def _line(fault: Fault) -> int:
    """Return the number of the line that a fault is on; faults without one come last, in the order they were found."""
    line = re.match(r"line (\d+)", fault.where)
    return int(line[1]) if line else sys.maxsize


class SessionLocked(SwimcalError):
    """The session is locked by another run.

    Example:
        >>> from swimcal.stage import session_lock
        >>> try:
        ...     with session_lock(calib.open_session("pool").folder):   # as another run does
        ...         calib.fit("pool", "quick", progress=False)
        ... except calib.SessionLocked as error:
        ...     print(error)
        pool: this session is being worked on; found: its lock held by process ... Wait for that run, or end it; ...
    """


class ResultsNotWritable(SwimcalError):
    """A result could not be written; what was there before is unchanged.

    Example:
        >>> try:
        ...     calib.export_mjcf(out="pool")
        ... except calib.ResultsNotWritable as error:
        ...     print(error)
        pool: cannot be written; found: a folder; expected: the name of a file.
    """


class ModelMismatch(SwimcalError):
    """A calibration made with another engine or another model than the one in use.

    Example:
        >>> from swimgym import load_fish
        >>> try:
        ...     load_fish("old")                                # fitted with MuJoCo 3.9
        ... except calib.ModelMismatch as error:
        ...     print(error)
        old/results/calibration.json: this calibration was made with MuJoCo 3.9.0, here is 4... Fit again with ...
    """


class SimulationDiverged(SwimcalError):
    """The simulation became unstable; its numbers must not be used.

    Example:
        >>> try:
        ...     calib.load_twin(coefficients=[-50, 0, 0, 0, 0]).swim(1.0)
        ... except calib.SimulationDiverged as error:
        ...     print(error)
        1 of 1 simulations diverged; the first at coefficients [-50, 0, 0, 0, 0], 1 Hz. Expected a bounded motion; ...
    """


class NotEnoughData(SwimcalError):
    """The recordings cannot carry the estimate that was asked for.

    Example:
        >>> try:
        ...     calib.view("filmed")
        ... except calib.NotEnoughData as error:
        ...     print(error)
        filmed: nothing to show. Expected tracks; found videos that are not tracked: run `calib track filmed`.
    """


class NotConverged(SwimcalError):
    """An estimate that must not be relied on; it was not reported.

    Example:
        >>> try:
        ...     calib.posterior("short", "quick", progress=False)
        ... except calib.NotConverged as error:
        ...     print(error)
        short/results/posterior.nc: not written, nor are intervals reported; found: ... or try another [fit] seed ...
    """


class FaultCollector:
    """A collector of faults that raises them together.

    >>> faults = FaultCollector("robot.toml")
    >>> faults.add("line 3, water.density_kg_m3", "not a density", found="-1", expected="a number above 0")
    >>> with faults.nested():          # takes over the faults of an InputError raised inside
    ...     load_tracks(path, markers, fps)
    >>> faults.raise_if_any()
    """

    def __init__(self, file: str = "") -> None:
        self.file = file
        self.faults: list[Fault] = []

    def __bool__(self) -> bool:
        return bool(self.faults)

    def add(
        self,
        where: str,
        what: str,
        *,
        found: str = "",
        expected: str = "",
        choices: Iterable[str] = (),
        next_step: str = "",
    ) -> None:
        """Add a fault of this collector's file; the arguments are the fields of `Fault`."""
        self.faults.append(Fault(self.file, where, what, found, expected, tuple(choices), next_step))

    def extend(self, faults: Iterable[Fault]) -> None:
        """Add faults, whatever their file."""
        self.faults.extend(faults)

    def extend_capped(self, faults: Sequence[Fault], limit: int = SHOWN_PER_KIND) -> None:
        """Add the first `limit` faults of one kind, and one that counts the others."""
        self.faults.extend(faults[:limit])
        if (rest := len(faults) - limit) > 0:
            last = faults[-1]
            more = f"and {rest} more like the last"
            more += f", up to {last.where}" if last.where != faults[limit - 1].where else ""
            self.faults.append(Fault(last.file, "", more, "", ""))

    @contextmanager
    def nested(self) -> Iterator[None]:
        """Take over the faults of an `InputError` raised in the block, which then ends quietly."""
        try:
            yield
        except InputError as error:
            self.extend(error.faults)

    def raise_if_any(self) -> None:
        """Raise one `InputError` with every fault gathered.

        Raises:
            InputError: if there is any.
        """
        if self.faults:
            raise InputError(self.faults)


def did_you_mean(word: str, choices: Iterable[str]) -> str:
    """Suggest the closest choice as a next step; empty when none is close."""
    close = get_close_matches(word, list(choices), n=1)
    return f"Did you mean {close[0]!r}?" if close else ""


def shown(value: object, width: int = 60) -> str:
    """Format a value as an error message shows it: its repr, shortened to `width` characters."""
    text = repr(value)
    return text if len(text) <= width else f"{text[: width - 1]}…"


FLAG_KINDS: dict[str, str] = {
    "merged_markers": "two markers sit on one spot",
    "frozen_marker": "a marker does not move while its neighbours do",
    "jump": "a marker, or the whole body, moves further between two frames than it can",
    "segment_length": "the distance to the neighbouring marker is implausible",
    "gap": "samples are missing",
    "lost_marker": "the tracker does not see a marker",
    "only_csrt": "no spot answers, only CSRT sees the marker",
    "drift": "a marker has lost its appearance for a while; the tracker may have drifted onto something else",
    "size": "a marker appears in another size",
    "swap": "two markers seem to be exchanged",
    "edited": "a person corrected the track",
    "doubtful_box": "a start box may hold no marker",
    "damaged_video": "part of the video cannot be read",
    "few_frames": "markers move between two frames by more than half the distance to their neighbours",
    "repeated_frames": "pictures of the video repeat the one before",
    "no_lens": "the lens is not calibrated",
    "no_camera_height": "the camera's height is not known, so parallax is not undone",
    "lens_other_size": "the lens was calibrated for pictures of another size",
    "camera_height_off_scale": "the camera's height does not fit the scale of the tracks",
    "lens_folds": "the lens calibration has no meaning near the corners of the picture",
    "tendon_pushes": "a tendon of the twin pushes where a string would be slack",
    "tendon_stretch": "the tendons of the twin stretch otherwise than published",
    "too_short": "the recording is too short for the estimate to be trusted",
    "trials_disagree": "trials give different values",
    "head_moves": "the head is not clamped",
    "poor_fit": "the twin does not follow the recording",
    "clipped": "a marker leaves the picture, merges or is cut off at its largest swings",
    "decays_disagree": "decays give different values",
    "double_peaked": "the spectrum has a second peak as high",
    "moved_again": "the tail was moved again after its release",
    "no_release": "the moment of release was not found",
    "code_not_seen": "the coded wiggle of the motor was not found in the video",
    "clock_given": "the offset between video and motor log was not found, it is that of session.toml",
    "clock_rate": "the clocks of video and motor log run at implausibly different rates",
    "short_log": "the motor log does not cover what is compared",
    "log_gap": "readings are missing from the motor log",
    "misread_position": "single readings of the motor's position cannot be, and are left out",
    "position_jump": "the counter of the motor's position jumps by whole turns, which are taken out",
    "motor_error": "the motor reported an error",
    "motor_slow": "the motor turned otherwise than commanded",
    "supply_sags": "the supply voltage of the motor sags",
    "beat_off_crank": "the tail beats at another frequency than the crank turns",
    "other_command": "the motor was commanded another speed than the session states",
    "truncated_log": "the last row of a log is cut short",
    "not_used": "an experiment is not believed and was left out",
    "fit_outside": "the fit lies outside its own posterior interval",
    "wide_bands": "predictive bands are wider than the trials need",
    "markers_off": "markers sit elsewhere than the robot's description has them",
    "robot_off": "the swim trials support another robot than the described one",
    "at_bound": "an estimate sits at the bound of its range",
    "not_converged": "the optimiser stopped before it converged",
    "restarts_disagree": "different starts end at different estimates",
    "ebt_ratio_only": "of elongated body theory only c_D / beta is identifiable",
    "unidentifiable": "the data do not determine this number",
    "no_command": "the commanded frequency is not known",
    "frequency_off_command": "the swim frequency differs from the command",
    "scale_off_robot": "the scale of the picture does not fit the robot",
    "scale_drifts": "nose and neck come closer together, or part, during the trial",
    "rests": "the tail does not beat for a part of the trial",
    "leaves_picture": "nose and neck are not seen any more before the trial ends",
    "unread_marker": "a marker is seen too little to take part",
    "tail_first": "the robot swims tail first",
    "turns": "the course bends so much that the net displacement is shorter than the path",
    "left_out": "a swim trial takes no part",
    "far_from_twin": "the trial's own twin is far from it",
    "speed_missed": "the twin misses the speed of a trial it was fitted to",
    "no_ebt": "the tail does not show what elongated body theory needs",
    "few_beats": "too few beats for a frequency to be trusted",
    "swims_backward": "started from rest, the fitted twin swims backward",
    "rejected_restart": "closer coefficients were rejected because their twin swims backward from rest",
    "emulator_off": "the emulator of the twin misses it by more than it may",
    "model_discrepancy": "the twin itself is off by more than noise and nuisances explain",
    "noise_not_white": "the errors of the tracks are not as the posterior takes them to be",
    "extrapolated": "outside the range of the trials that were fitted",
}
"""The kinds of flag and what each means. Later stages may use further kinds of their own."""


@dataclass(frozen=True)
class Flag:
    """One thing that is doubtful, in a sentence for the reader of the report.

    Attributes:
        kind: one of `FLAG_KINDS`, or a later stage's own.
        markers: the markers concerned; empty where it is not about markers.
        frames: first and last frame concerned, both included; None for the whole trial or fit.
    """

    kind: str
    markers: tuple[str, ...] = ()
    frames: tuple[int, int] | None = None
    message: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the flag in the form of the public contract."""
        frames = None if self.frames is None else [int(frame) for frame in self.frames]
        return {"kind": self.kind, "markers": list(self.markers), "frames": frames, "message": self.message}

    def later(self, first: int) -> Flag:
        """Return the same flag for a recording that begins `first` frames earlier."""
        return self if self.frames is None else replace(self, frames=(self.frames[0] + first, self.frames[1] + first))

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Flag:
        """Read what `to_json` wrote."""
        frames = None if data.get("frames") is None else (int(data["frames"][0]), int(data["frames"][1]))
        return cls(data["kind"], tuple(data.get("markers", ())), frames, data.get("message", ""))
