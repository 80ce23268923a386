"""The clock of a motor log against that of a video: offset and rate, from the codes that both have seen."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fitting.motor_clock.code_delay import CodeDelay, code_delay
from fitting.motor_clock.code_search import search
from fitting.motor_clock.tail_motion import TailMotion
from session import Flag, MotorCommands
from swimmer import CrankTurn

FoundBy = Literal["code", "start code", "end code", "given"]

CODES = {"start_code": "start code", "end_code": "end code"}
LEAST_EXPLAINED = 0.3  # of the tail's motion over a code, by the crank's
CLEARLY = 1.2  # times as well as at any other offset
PLAUSIBLE_RATE = 1e-3  # relative; quartz clocks agree ten times better, 59.94 taken for 60 frames a second reaches it
QUARTZ = 1e-4  # by how much two clocks may differ, where one code alone cannot tell


@dataclass(frozen=True)
class MotorClock:
    """The clock of a motor log: motor time = rate * video time + offset.

    The moment of a code is when the tail follows the crank. It lags behind by about 2 ms in air and 9 ms in water
    (the built-in robot), by the same at both codes: the rate does not notice, the offset is off by as much, and in a
    fit the crank's phase takes it up. The standard errors are those of the tracking; of tracks as good as the published
    ones they come to 5 to 7 ms and 5e-4. Where the crank stands across at a code the tail hardly moves: such a code is
    worth less, and its error may then reach some 50 ms.

    Attributes:
        offset_s: motor clock minus video clock at the video's time 0, s.
        offset_se_s: its standard error; nan where it was given.
        rate: seconds of the motor's clock in one of the video's.
        rate_se: its standard error; nan where it was given.
        found_by: "code": both codes; "start code" or "end code": one alone, the rate taken for 1; "given": neither,
            the offset is that of `session.toml`.
        flags: what is doubtful.
    """

    offset_s: float
    offset_se_s: float
    rate: float
    rate_se: float
    found_by: FoundBy
    flags: tuple[Flag, ...] = ()

    def video_s(self, motor_s: float) -> float:
        """A time of the motor's clock on the video's."""
        return (motor_s - self.offset_s) / self.rate


def find_clock(
    tail: TailMotion | None, turn: CrankTurn, commands: MotorCommands | None, zero_s: float, given_s: float
) -> MotorClock:
    """Looks for the codes of a trial in its video.

    Args:
        tail: n frames; None where no tail is seen.
        turn: of the crank, on the motor's clock less `zero_s`.
        commands: on the motor's clock; None where it is not known what was commanded.
        zero_s: so that the numbers stay small: a host's clock may stand at days.
        given_s: motor clock minus video clock, from `session.toml`.
    """
    codes = {part: span for part in CODES if commands and (span := commands.span_s(part)) is not None}
    spans = [(begins - zero_s, ends - zero_s) for begins, ends in codes.values()]
    seen: dict[str, CodeDelay] = {}
    found = search(tail, turn, spans) if tail is not None and spans else None
    if tail is not None and found is not None and found.gain > CLEARLY * found.next_gain:
        delays = [code_delay(tail, turn, span, found.offset_s) for span in spans]
        seen = {p: d for p, d in zip(codes, delays, strict=True) if d is not None and d.explained >= LEAST_EXPLAINED}
    flags = tuple(_not_seen(part) for part in codes if part not in seen)
    if not seen:
        message = f"offset {given_s:g} s as in session.toml, not found from a code; the rate is taken for 1"
        return MotorClock(given_s, np.nan, 1.0, np.nan, "given", (*flags, Flag("clock_given", message=message)))
    offset_s, offset_se_s, rate, rate_se = _joined(list(seen.values()))
    by = "code" if len(seen) > 1 else CODES[next(iter(seen))]
    return MotorClock(offset_s + zero_s, offset_se_s, rate, rate_se, by, (*flags, *_implausible(rate, rate_se)))  # type: ignore[arg-type]


def _joined(codes: list[CodeDelay]) -> tuple[float, float, float, float]:
    """Offset at the video's time 0 and rate, each with its standard error."""
    first, last = codes[0], codes[-1]
    if len(codes) == 1:
        return first.offset_s, float(np.hypot(first.se_s, QUARTZ * first.middle_s)), 1.0, QUARTZ
    apart_s = last.middle_s - first.middle_s
    drift = (last.offset_s - first.offset_s) / apart_s
    drift_se = float(np.hypot(first.se_s, last.se_s)) / apart_s
    offset_se_s = float(np.hypot(last.middle_s * first.se_s, first.middle_s * last.se_s)) / apart_s
    return first.offset_s - drift * first.middle_s, offset_se_s, 1 + drift, drift_se


def _not_seen(part: str) -> Flag:
    message = (
        f"the {CODES[part]} was commanded, but the tail's motion does not show it clearly in one place: "
        "is the whole of it in the video?"
    )
    return Flag("code_not_seen", message=message)


def _implausible(rate: float, rate_se: float) -> tuple[Flag, ...]:
    if abs(rate - 1) <= PLAUSIBLE_RATE + 2 * rate_se:
        return ()
    message = (
        f"the motor's clock runs {100 * (rate - 1):+.2f} % faster than the video's; quartz clocks agree to "
        "0.01 %: are the video's time stamps right, or [camera] fps?"
    )
    return (Flag("clock_rate", message=message),)
