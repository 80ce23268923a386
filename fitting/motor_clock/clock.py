"""The clock of a motor log against that of a video: offset and rate, from the codes that both have seen."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fitting.motor_clock.code import CodeDelay, TailMotion, code_delay, search
from session import Flag, TrialSpec
from session.commands import MotorCommands
from swimmer import CrankTurn

FoundBy = Literal["code", "start code", "end code", "given"]

CODES = {"start_code": "start code", "end_code": "end code"}
LEAST_EXPLAINED = 0.3  # least share of the tail's motion over a code that the crank's explains
OUTSIDE_S = 0.1  # time of a code that a log may leave out: the last reading precedes the last command's end
CLEARLY = 1.2  # least ratio of the gain to that at any other offset
# Largest plausible difference of the rate from 1: quartz agrees ten times better, 59.94 Hz taken for 60 reaches it.
PLAUSIBLE_RATE = 1e-3
QUARTZ = 1e-4  # relative standard error of two clocks against each other, before any code is seen
LAG_SPREAD_S = {"dry": 0.0003, "swim": 0.0035}  # standard deviation of the tail's lag over the crank's angle
CONTRADICTS = 3.0  # standard errors beyond which the codes overrule the tolerance of quartz


@dataclass(frozen=True)
class MotorClock:
    """The clock of a motor log: motor time = rate * video time + offset.

    The moment of a code is that at which the tail follows the crank. It lags behind by about 1 ms in air and 9 ms in
    water (the built-in robot): the offset is off by as much, and in a fit the crank's phase takes it up. In water it is
    3 to 12 ms, with the crank's angle; that it differs between the codes is in the standard errors (`LAG_SPREAD_S`),
    besides the tracking and, for the rate, the tolerance of quartz. For tracks like the published ones the standard
    error of the rate is 1e-4. Where the crank is sideways at a code the tail hardly moves: such a code is worth less,
    and its error may then reach some 50 ms.

    Attributes:
        offset_s: motor clock minus video clock at the video's time 0, s.
        offset_se_s: its standard error; nan where it was given.
        rate: seconds of the motor's clock in one of the video's.
        rate_se: its standard error; nan where it was given.
        found_by: "code": both codes; "start code" or "end code": one alone, the rate taken for 1; "given": neither, the
            offset is that of `session.toml`.
    """

    offset_s: float
    offset_se_s: float
    rate: float
    rate_se: float
    found_by: FoundBy
    flags: tuple[Flag, ...] = ()

    def video_s(self, motor_s: float) -> float:
        """Convert a time of the motor's clock to the video's."""
        return (motor_s - self.offset_s) / self.rate


def find_clock(
    tail: TailMotion | None, turn: CrankTurn, commands: MotorCommands | None, zero_s: float, spec: TrialSpec
) -> MotorClock:
    """Find the clock of a log from the codes of a trial in its video.

    Args:
        tail: n frames; None where no tail is seen.
        turn: turn of the crank, on the motor's clock less `zero_s`.
        commands: commands on the motor's clock; None where they are not known.
        zero_s: subtracted so that the numbers stay small: a host's clock may count days.
        spec: the trial, for its offset and whether it swims.
    """
    commanded = {part: span for part in CODES if commands and (span := commands.span_s(part)) is not None}
    codes = {part: (begins - zero_s, ends - zero_s) for part, (begins, ends) in commanded.items()}
    codes = {part: span for part, span in codes.items() if _is_logged(span, turn)}
    spans = list(codes.values())
    seen: dict[str, CodeDelay] = {}
    found = search(tail, turn, spans) if tail is not None and spans else None
    if tail is not None and found is not None and found.gain > CLEARLY * found.next_gain:
        delays = [code_delay(tail, turn, span, found.offset_s) for span in spans]
        seen = {p: d for p, d in zip(codes, delays, strict=True) if d is not None and d.explained >= LEAST_EXPLAINED}
        lag_s = LAG_SPREAD_S[spec.kind]
        seen = {part: delay._replace(se_s=float(np.hypot(delay.se_s, lag_s))) for part, delay in seen.items()}
    flags = tuple(_unseen_flag(part, part in codes) for part in commanded if part not in seen)
    if not seen:
        given_s = spec.motor_offset_s
        message = f"offset {given_s:g} s as in session.toml, not found from a code; the rate is taken for 1"
        return MotorClock(given_s, np.nan, 1.0, np.nan, "given", (*flags, Flag("clock_given", message=message)))
    offset_s, offset_se_s, rate, rate_se = _combine(list(seen.values()))
    by = "code" if len(seen) > 1 else CODES[next(iter(seen))]
    return MotorClock(offset_s + zero_s, offset_se_s, rate, rate_se, by, (*flags, *_flag_implausible(rate, rate_se)))  # type: ignore[arg-type]


def _combine(codes: list[CodeDelay]) -> tuple[float, float, float, float]:
    """Return the offset at the video's time 0 and the rate, each with its standard error.

    Codes far apart give the rate better than the tolerance of quartz, codes close together worse: both count, unless
    they contradict each other.
    """
    if len(codes) > 1:
        alone = _regress(codes, np.inf)
        if abs(alone[2] - 1) > CONTRADICTS * float(np.hypot(alone[3], QUARTZ)):
            return alone
    return _regress(codes, QUARTZ)


def _regress(codes: list[CodeDelay], drift_se: float) -> tuple[float, float, float, float]:
    """Return offset and rate if the rates of the clocks are known beforehand to agree with this standard error."""
    columns = np.array([[1.0, code.middle_s] for code in codes] + [[0.0, 1.0]])  # offset, drift
    found = np.array([code.offset_s for code in codes] + [0.0])
    weight = 1 / np.array([code.se_s for code in codes] + [drift_se])
    covariance = np.linalg.inv((columns * weight[:, None] ** 2).T @ columns)
    offset_s, drift = covariance @ (columns.T @ (weight**2 * found))
    offset_se_s, rate_se = np.sqrt(np.diag(covariance))
    return float(offset_s), float(offset_se_s), float(1 + drift), float(rate_se)


def _is_logged(code: tuple[float, float], turn: CrankTurn) -> bool:
    """Tell whether the log holds the whole code; beyond its ends the crank's angle is a guess."""
    return code[0] > turn.start_s - OUTSIDE_S and code[1] < turn.end_s + OUTSIDE_S


def _unseen_flag(part: str, logged: bool) -> Flag:
    why = (
        "the tail's motion does not show it clearly in one place: is the whole of it in the video?"
        if logged
        else "the log does not hold the whole of it"
    )
    return Flag("code_not_seen", message=f"the {CODES[part]} was commanded, but {why}")


def _flag_implausible(rate: float, rate_se: float) -> tuple[Flag, ...]:
    if abs(rate - 1) <= PLAUSIBLE_RATE + 2 * rate_se:
        return ()
    message = (
        f"the motor's clock runs {100 * (rate - 1):+.2f} % faster than the video's; quartz clocks agree to "
        "0.01 %: are the video's time stamps right, or [camera] fps?"
    )
    return (Flag("clock_rate", message=message),)
