"""Where in a recording the bent tail is let go, and until when its swing is worth fitting."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from fitting.series import bridged
from session import Flag, NotEnoughData

LEAST_SWING_M = 0.005  # way from side to side below which nothing was released
SLOW = 0.25  # of the fastest swing, below which the tail is still held
FADED = 0.02  # of the first swing, below which the tail is at rest
REST_S = 0.6  # at rest that is kept: for the places of the markers on the straight tail
LONGEST_S = 2.0  # of a decay; later swings add little
STILL_S = 0.3  # over which a tail is at rest, longer than the half of any swing
STRUCK, STRUCK_SHARE = 3.0, 0.1  # growth of a swing that no free decay shows; and of the first swing


@dataclass(frozen=True)
class Release:
    """The frames of a free decay, first and last included, with flags."""

    first: int
    last: int
    flags: tuple[Flag, ...] = ()


def find_release(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, name: str = "") -> Release:
    """The release: the last slow frame before the tail's fastest motion; the first frame kept comes after it.

    A hand bends the tail more slowly than its springs throw it back. Where the recording starts in mid-swing the
    decay starts with it.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) of the tail markers, m.
        weight: (n, k) 0 where a sample does not count.
        name: of the trial, for messages.

    Raises:
        NotEnoughData: the tail does not swing.
    """
    lateral = bridged(time_s, np.where(weight > 0, lateral_m, np.nan))  # (n, k)
    if len(time_s) < 4 or (swing := float(np.ptp(lateral, axis=0).max())) < LEAST_SWING_M:
        raise NotEnoughData(
            f"trial {name}: its tail swings by {1000 * swing if len(time_s) > 3 else 0:.1f} mm only, so nothing was "
            "released in it. Bend the tail by several centimetres, let go, and keep the camera running until it rests"
        )
    speed = np.sqrt((np.gradient(lateral, time_s, axis=0) ** 2).mean(axis=1))  # (n,)
    fastest = int(speed.argmax())
    held = np.flatnonzero(speed[: fastest + 1] < SLOW * speed[fastest])
    first = int(held[-1]) + 1 if len(held) else 0
    span = max(round(STILL_S / float(np.median(np.diff(time_s)))), 4)  # frames
    size = _swing(lateral[first:], speed[first:], span)
    last, moved_again = _end(time_s[first:], size, span)
    flags = []
    if not len(held):
        flags.append(Flag("no_release", message="the recording starts when the tail swings already: release not seen"))
    if moved_again:
        message = "the tail is moved again after it came to rest; only what comes before is fitted"
        flags.append(Flag("moved_again", frames=(first + last + 1, len(time_s) - 1), message=message))
    return Release(first, first + last, tuple(flags))


def _swing(lateral: np.ndarray, speed: np.ndarray, span: int) -> np.ndarray:
    """(n,) rms distance of the markers from where they are when the tail is stillest, m."""
    lasting = uniform_filter1d(speed, span, mode="nearest")
    middle = int(lasting.argmin())
    rest = np.median(lateral[max(middle - span // 2, 0) : middle + span // 2 + 1], axis=0)
    return np.sqrt(((lateral - rest) ** 2).mean(axis=1))


def _end(time_s: np.ndarray, size: np.ndarray, span: int) -> tuple[int, bool]:
    """The last frame worth fitting, and whether the tail was moved again after it."""
    widest = maximum_filter1d(size, span, mode="nearest")
    calmest = np.minimum.accumulate(widest)
    again = np.flatnonzero(widest > np.maximum(STRUCK * calmest, STRUCK_SHARE * size[0]))
    end = len(size) - 1
    if len(again):
        end = int(np.argmin(widest[: again[0]])) + span // 2
    to_come = np.maximum.accumulate(size[: end + 1][::-1])[::-1]
    faded = np.flatnonzero(to_come < FADED * to_come[0])
    rest_s = time_s[int(faded[0])] + REST_S if len(faded) else np.inf
    latest_s = min(rest_s, time_s[0] + LONGEST_S, time_s[end])
    return int(np.searchsorted(time_s, latest_s, side="right")) - 1, bool(len(again)) and latest_s == time_s[end]
