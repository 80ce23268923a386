"""Judge of the program on a session: it runs its command line, and holds what it says against what truly happened.

Nothing of the program is imported: results are read as files, and true speeds are computed here from true positions.
"""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from benchmarks.foreign.recordings import Recording, Recordings

ROOT = Path(__file__).parents[2]
FAR_SD = 4.0  # A number is wrong where it is further off, in its standard errors.
LIMIT_S = 900
HALF_WIDTH_SD = 1.6449  # Half of a 90 % interval has this many standard deviations.
OF_TRACKS = frozenset(
    {"merged_markers", "frozen_marker", "jump", "segment_length", "gap", "lost_marker", "drift", "size", "swap"}
)
"""Kinds of flags that say what a file lacks, not what that does to a result."""
OF_NO_NUMBER = frozenset({"ebt_ratio_only", "no_command", "motor_slow", "tendon_pushes"})
"""Kinds of flags that say of no judged number that it may be off."""
INSIDE_WORDS = re.compile(
    r"Traceback|LinAlgError|\b\w*(Value|Type|Key|Index|Runtime|ZeroDivision|Attribute)Error|\barray\b|shape mismatch|"
    r"broadcast|ingular matrix|numpy|scipy|SVD|[Ii]nternal error|diverged from every start|RuntimeWarning"
)
# A speed that states no error may always be off by the larger of the two.
_FREE_SHARE = 0.01
_FREE_M_S = 3e-4
_MAX_OFF_MM = 300.0  # A forecast whose markers are further off is none.
_FAR_TIMES = 3.0  # A swim this many times slower or faster than the fitted ones may be left out.
_TAIL_STEP_S = 1 / 60  # time over which elongated body theory as published takes the speed of the tail
_MOSTLY = 0.5  # share of noise from which it is true that a speed is mostly noise
_MIN_INSIDE = 0.3  # A forecast whose bands hold a smaller share is none.
_ORDER = ("blunt_drag", "slender_drag", "angular_drag", "kutta_lift", "magnus_lift")


@dataclass(frozen=True)
class Verdict:
    """Judgement of one session; `wrong` are numbers, `unsaid` what no flag says."""

    seed: int
    number: int
    drawn: str
    disturbances: tuple[str, ...]
    commands: tuple[str, ...]
    code: int
    seconds: float
    broken: str = ""  # sign of a failure, in one line: a traceback, words of the inside, a time limit
    refusal: str = ""  # clear error
    wrong: tuple[str, ...] = ()
    unsaid: tuple[str, ...] = ()
    excused: tuple[str, ...] = ()  # numbers that are off, with the kinds of the flags that say so
    judged: int = 0  # number of numbers that were judged
    flags: tuple[str, ...] = ()  # about trials that nothing is wrong with

    @property
    def clean(self) -> bool:
        """Whether nothing was disturbed."""
        return not self.disturbances

    @property
    def short(self) -> bool:
        """Whether it falls short, but for needless flags."""
        return bool(self.broken or self.wrong or self.unsaid)


def run_program(folder: Path, commands: tuple[str, ...]) -> tuple[int, str]:
    """Run the commands; return the exit status, 124 past the time limit, and all text, which is kept in a file."""
    text, code = "", 0
    one = dict.fromkeys(("SWIMCAL_WORKERS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    for command in commands:
        asked = [sys.executable, "-m", "calib", command, str(folder), "--effort", "quick"]
        try:
            ran = subprocess.run(
                asked,
                capture_output=True,
                text=True,
                errors="replace",
                env=os.environ
                | one
                | {"PYTHONPATH": os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))},
                timeout=LIMIT_S,
                check=False,
            )
            code, text = ran.returncode, text + ran.stdout + ran.stderr
        except subprocess.TimeoutExpired:
            code, text = 124, f"{text}\nstill running after {LIMIT_S} s"
        if code:
            break
    (folder / "terminal.txt").write_text(text)
    return code, text


def judge(session: Recordings, folder: Path, seed: int, number: int, commands: tuple[str, ...]) -> Verdict:
    """Run the program on a session that lies in a folder, and judge it."""
    began = time.perf_counter()
    code, text = run_program(folder, commands)
    hz = ", ".join(
        f"{swim.name[-1]} {swim.role} {swim.hz:.2f} Hz {np.ptp(swim.pool_s):.0f} s" for swim in session.swims
    )
    noise = f"{np.hypot(session.tracker.lasting.sd_px, session.tracker.white_px):.1f} px"
    drawn = f"{session.robot.name} by {session.simulator}, {len(session.markers)} markers, {session.fps:g} fps, "
    drawn += f"{session.px_per_m:.0f} px/m, noise {noise}: {hz}"
    found = Verdict(seed, number, drawn, tuple(session.disturbances), commands, code, time.perf_counter() - began)
    return judge_results(session, folder, found, text)


def judge_results(session: Recordings, folder: Path, run: Verdict, text: str) -> Verdict:
    """Judge what a finished run wrote and said."""
    last = next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")
    inside = INSIDE_WORDS.search(text)
    if run.code not in (0, 2) or inside is not None:
        worst = last if inside is None else text[max(inside.start() - 60, 0) : inside.end() + 100]
        return replace(run, broken=f"exit {run.code}: {' '.join(worst.split())[:240]}")
    refusal = "" if run.code == 0 else _strip_progress(text)[-300:]
    if run.code == 2 and not (folder / "results" / "calibration.json").is_file():
        right = session.refused or session.refusable
        return replace(run, refusal=refusal, unsaid=() if right else ("refused, though the rest is of use",))
    judgement = _Judgement(session, Results(folder))
    judgement.everything()
    wrong, excused = tuple(judgement.wrong), tuple(judgement.excused)
    unsaid, flags = (*judgement.unsaid, *["not refused"] * session.refused), tuple(judgement.needless())
    return replace(
        run, refusal=refusal, unsaid=unsaid, wrong=wrong, excused=excused, judged=judgement.judged, flags=flags
    )


def _strip_progress(text: str) -> str:
    """Return the text in one line, without the progress."""
    told = (line.strip() for line in text.splitlines())
    return " ".join(line for line in told if not re.match(r"calib: (reading|fitting|sampling)|.*(left|done)$", line))


class Results:
    """Files in `results/`, and the flags in them."""

    def __init__(self, folder: Path) -> None:
        names = ("calibration", "structure", "posterior", "diagnosis")
        files = {name: folder / "results" / f"{name}.json" for name in names}
        self.files = {name: json.loads(path.read_text()) if path.is_file() else {} for name, path in files.items()}
        self.fit: dict[str, Any] = self.files["calibration"]
        self.every = list({(place, flag["kind"], flag["message"]) for place, flag in _find_flags(self.files, "")})

    def flags(self, trial: str | None, without: frozenset[str] = frozenset()) -> list[tuple[str, str]]:
        """List kinds and messages of flags at or about a trial; with None, of those that stand at no trial."""
        ignored = OF_TRACKS | OF_NO_NUMBER | without

        def about(place: str, message: str) -> bool:
            if trial is None:
                return not re.search(r"/(trials|experiments|sways)/", place)
            return trial in place.split("/") or bool(re.search(rf"\b{re.escape(trial)}\b", message))

        return sorted({(k, message) for place, k, message in self.every if k not in ignored and about(place, message)})


def _find_flags(tree: object, place: str) -> Iterator[tuple[str, dict]]:
    if isinstance(tree, dict) and {"kind", "message"} <= tree.keys():
        yield place, tree
    elif isinstance(tree, dict | list):
        for key, branch in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from _find_flags(branch, f"{place}/{key}")


def true_speeds(session: Recordings, swim: Recording) -> tuple[float, float, float]:
    """Return the lowest and highest true speed of the compared frames, m/s, and how long these are, s.

    Slopes, beside three harmonics of the beat, of the way along the head, of that along the head's mean direction over
    a beat, and of that along its mean direction over all, as the program's contract has it: over all compared frames,
    and without the first or the last whole beat.
    """
    nose, neck = (swim.pool_px[:, marker] / session.px_per_m for marker in session.head)
    time_s, step = swim.pool_s - swim.pool_s[0], float(np.median(np.diff(swim.pool_s)))
    heading = np.unwrap(np.arctan2(*(nose - neck).T[::-1]))
    smooth = uniform_filter1d(heading, max(round(1 / swim.hz / step), 1), mode="nearest")
    start, end = (session.warmup_s, time_s[-1]) if swim.steady_s is None else swim.steady_s
    if swim.steady_s is not None:
        start = start + session.warmup_s
    if swim.role != "fit":
        start = max(start, min(2.0 / swim.hz + (0.0 if swim.steady_s is None else swim.steady_s[0]), (start + end) / 2))
    found = []
    steady = np.full_like(heading, heading[(time_s >= start) & (time_s <= end)].mean())
    for angle in (heading, smooth, steady):
        middle = (angle[1:] + angle[:-1]) / 2
        ahead = np.append(
            0.0, np.cumsum((np.diff(nose, axis=0) * np.stack([np.cos(middle), np.sin(middle)], 1)).sum(1))
        )
        for first, last in ((start, end), (start + 1 / swim.hz, end), (start, end - 1 / swim.hz)):
            beats = np.floor((last - first) * swim.hz + 1e-6)
            window = (time_s >= first - 1e-9) & (time_s < (first + beats / swim.hz if beats >= 1 else end))
            if window.sum() > 2:
                turn = 2 * np.pi * swim.hz * time_s[window, None] * (np.arange(1, 4) if beats >= 1 else np.zeros(0))
                columns = np.column_stack([time_s[window], np.ones(window.sum()), np.cos(turn), np.sin(turn)])
                found.append(float(np.linalg.lstsq(columns, ahead[window], rcond=None)[0][0]))
    return min(found), max(found), end - start


def speed_error(session: Recordings, length_s: float, speed: float) -> float:
    """Return the standard error of a speed by noise and placement of boxes alone, m/s."""
    lasting = session.tracker.lasting
    grid_px = 0.5 / np.sqrt(12.0) if lasting.half_pixel_grid else 0.0
    white = np.hypot(session.tracker.white_px, grid_px) ** 2 / session.fps
    slope_px = np.sqrt(
        12.0 * (2.0 * lasting.sd_px**2 * max(lasting.correlation_s, 0.5 / session.fps) + white) / length_s**3
    )
    scale = np.sqrt(2.0) * lasting.placement_sd_px / (session.robot.scale_length_m * session.px_per_m)
    return float(np.hypot(slope_px / session.px_per_m, scale * speed))


def noise_share(session: Recordings, swim: Recording) -> float:
    """Return the share of noise in the squared sideways speed of the last marker, over a sixtieth of a second."""
    true_px = CubicSpline(swim.pool_s, swim.pool_px)(swim.pool_s[0] + swim.time_s)
    step = max(1, round(_TAIL_STEP_S / float(np.median(np.diff(swim.time_s)))))
    (nose, neck), squares = session.head, []
    for place in (true_px, swim.xy):
        axis = place[:, neck] - place[:, nose]
        behind = place[:, session.tail[-1]] - place[:, neck]
        aside = (axis[:, 0] * behind[:, 1] - axis[:, 1] * behind[:, 0]) / np.linalg.norm(axis, axis=1)
        squares.append(np.nanmean((aside[step:] - aside[:-step]) ** 2))
    return float(1.0 - squares[0] / squares[1])


class _Judgement:
    """Collector of what is wrong, and of what is off but flagged."""

    def __init__(self, session: Recordings, results: Results) -> None:
        self.session, self.results = session, results
        self.judged = 0
        self.wrong: list[str] = []
        self.excused: list[str] = []
        self.unsaid: list[str] = []

    def everything(self) -> None:
        """Judge all that is there."""
        for swim in self.session.swims:
            if swim.name in self.results.fit["trials"]:
                self._judge_trial(swim)
            elif not self.results.flags(swim.name):
                self.unsaid.append(f"{swim.name} is left out, and nothing says why")
            if swim.said and not self.results.flags(swim.name, frozenset({"extrapolated"})):
                self.unsaid.append(f"{swim.name}: nothing says that {swim.said}")
        self._judge_coefficients()
        self._judge_structure()
        if self.session.disturbances == [] and self.results.files["diagnosis"].get("verdict") == "named":
            self._count("diagnosis", "named effects of a clean session", True, self._list_fit_flags())

    def needless(self) -> Iterator[str]:
        """Yield flags about trials that nothing is wrong with, but for those that are true of them."""
        for swim in (swim for swim in self.session.swims if not swim.touched):
            for kind, message in self.results.flags(swim.name):
                if not self._is_true(kind, message, swim):
                    yield f"{swim.name}: {kind}: {message[:120]}"

    def _is_true(self, kind: str, message: str, swim: Recording) -> bool:
        """Tell whether what a flag says of a swim that nothing was done to is true of it all the same."""
        fitted = [other.hz for other in self.session.swims if other.role == "fit"]
        if kind == "extrapolated":
            return not min(fitted) <= swim.hz <= max(fitted) or len(fitted) == 1
        if kind == "left_out" and "times beyond the fitted" in message:
            return not min(fitted) / _FAR_TIMES < swim.hz < max(fitted) * _FAR_TIMES
        return kind == "ebt_noise" and noise_share(self.session, swim) > _MOSTLY

    def _list_fit_flags(self, without: frozenset[str] = frozenset()) -> list[tuple[str, str]]:
        """List flags of the fit as a whole and of its trials."""
        fitted = [swim.name for swim in self.session.swims if swim.role == "fit"]
        return self.results.flags(None, without) + [
            flag for name in fitted for flag in self.results.flags(name, without)
        ]

    def _count(self, what: str, figure: str, off: bool, flags: list[tuple[str, str]]) -> None:
        self.judged += 1
        if off and flags:
            self.excused.append(f"{what}: {figure} [{', '.join(sorted({kind for kind, _ in flags}))}]")
        elif off:
            self.wrong.append(f"{what}: {figure}")

    def _judge_number(self, what: str, found: object, true: float, sd: float, flags: list[tuple[str, str]]) -> None:
        """Hold one number against the truth; one that is null says nothing."""
        if found is None:
            return
        far = abs(float(found) - true) / sd if sd > 0 else np.inf  # type: ignore[arg-type]
        self._count(what, f"{found:.4g}, truly {true:.4g}, {far:.1f} of its standard errors", not far <= FAR_SD, flags)

    def _judge_trial(self, swim: Recording) -> None:
        found, flags = self.results.fit["trials"][swim.name], self.results.flags(swim.name, frozenset({"extrapolated"}))
        if swim.said:
            return  # its numbers need the flag that is asked for above
        self._judge_number(
            f"{swim.name} frequency", found["frequency_hz"], swim.hz, found["frequency_se_hz"] or 0.0, flags
        )
        low, high, length_s = true_speeds(self.session, swim)
        near = float(np.clip(found["speed_measured"] if found["speed_measured"] is not None else low, low, high))
        by_noise = speed_error(self.session, length_s, high) + max(_FREE_SHARE * abs(near), _FREE_M_S) / FAR_SD
        error = found.get("speed_measured_se") or by_noise
        self._judge_number(f"{swim.name} measured speed", found["speed_measured"], near, error, flags)
        for name in ("speed_ebt", "speed_ebt_large", "speed_ebt_smoothed", "speed_twin"):
            if found[name] is not None:
                self._count(f"{swim.name} {name}", f"{found[name]:.4g} m/s", abs(found[name]) > 3.0, flags)
        self._judge_forecasts(swim, low, high)

    def _judge_forecasts(self, swim: Recording, low: float, high: float) -> None:
        """Judge forecasts of swims like the twin's, from fit trials that are like it."""
        among = [each for each in self.session.swims if each.role == "fit"]
        if not all(each.like_twin for each in (*among, swim)):
            return
        told = (self.results.fit["forecasts"]["trials"].get(swim.name) or {}).get("forecasts", {})
        flags = self.results.flags(swim.name) + self._list_fit_flags(frozenset({"extrapolated", "unidentifiable"}))
        for name, forecast in told.items():
            what, far_mm = f"{swim.name} {name}", forecast["marker_error_mm"]
            if forecast["speed_ci90"] is not None and None not in forecast["speed_ci90"]:
                sd = (forecast["speed_ci90"][1] - forecast["speed_ci90"][0]) / 2.0 / HALF_WIDTH_SD
                near = float(np.clip(forecast["speed"], low, high))
                self._judge_number(f"{what} speed", forecast["speed"], near, sd, flags)
            if forecast["inside"] is not None:
                within = f"{100 * forecast['inside']:.0f} % of markers within 90 % bands"
                self._count(f"{what} bands", within, forecast["inside"] < _MIN_INSIDE, flags)
            if far_mm is not None:
                self._count(f"{what} markers", f"{far_mm:.0f} mm off", far_mm > _MAX_OFF_MM, flags)

    def _judge_coefficients(self) -> None:
        fitted = [swim for swim in self.session.swims if swim.role == "fit"]
        if self.session.coefficients is None or not all(swim.like_twin for swim in fitted):
            return
        fit, drawn = self.results.fit["fit"], self.results.fit.get("posterior") or {}
        for name, true, (low, high) in zip(_ORDER, self.session.coefficients, fit["interval"], strict=True):
            value = fit["coefficients"][name]
            flags = [
                flag
                for flag in self._list_fit_flags()
                if flag[0] not in ("unidentifiable", "at_bound") or name in flag[1]
            ]
            reach = high - value if true > value else value - low
            self._judge_number(f"coefficient {name}", value, true, reach / HALF_WIDTH_SD, flags)
            if name in drawn:
                self._judge_number(f"posterior of {name}", drawn[name]["mean"], true, drawn[name]["sd"], flags)

    def _judge_structure(self) -> None:
        robot, structure = self.session.robot, self.results.fit["structure"]
        true = {"hinge_stiffness": robot.tail.hinge_stiffness_n_m, "hinge_damping": robot.tail.hinge_damping_n_m_s}
        for quantity, value in (true | {"crank_arm": robot.crank.arm_m}).items():
            source = structure[quantity]
            if source["se"] is not None:
                flags = self.results.flags(None) + [f for name in source["trials"] for f in self.results.flags(name)]
                self._judge_number(quantity, source["value"], value, source["se"], flags)
