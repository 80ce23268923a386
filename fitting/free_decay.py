"""A free decay as measured: its release, the doubts about its clamp, and its spectrum.

`measure_decay_trial` checks and scales the tracks, finds the release (`find_release`) and asks whether the head moved
(`clamp_flags`). `measure_decay` computes the spectrum of what follows. The fit by the twin is in `fitting.decay_fit`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.ndimage import maximum_filter1d, uniform_filter1d
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from fitting.pool import bridged, in_pool
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import markers_of
from tracking.head_frame import to_head_frame

# Release and clamp
LEAST_SWING_M = 0.005  # least swing from side to side of a tail that was released
SLOW = 0.25  # share of the fastest speed below which the tail is still held
FADED = 0.02  # share of the first swing below which the tail is at rest
REST_S = 0.6  # time at rest that is kept, for the places of the markers on the straight tail
LONGEST_S = 2.0  # longest time of a decay that is used; later swings add little
STILL_S = 0.3  # time over which a tail must be at rest, longer than the half of any swing
STRUCK = 3.0  # growth of a swing that no free decay shows
STRUCK_SHARE = 0.1  # least such swing, as a share of the first one
HEAD_MOVES_M = 0.003  # rms motion of nose or neck in the decay from which a head is not well clamped
# Least share of the fin's swing that flags the clamp: a springy one lowers the stiffness by 0.6 to 1.35 times it.
LEAST_SHARE = 0.0075
SURE_SE = 2.5  # standard errors from which a share is no tracking error
# The shape that `check_tracks` learns from a trial is that of its many frames at rest: the few in which the tail is
# bent look wrong to it. Only gross faults are left to it; the twin judges the others (`fitting.decay_fit`).
FAR_OUT_PX = 75.0
FEWEST_FRAMES = 12  # least number of frames of a decay

# The spectrum
HIGHEST_HZ = 15.0  # highest frequency at which a peak is looked for
FEWEST_PERIODS = 2.0  # least number of periods recorded after the release
SECOND_PEAK = 0.5  # least height of a second peak, relative to the highest
PEAK_PROMINENCE = 0.3  # least prominence of a peak over the valley before it, relative to the highest
AT_REST = 2 / 3  # share of the recording after which the tail is taken to rest
_FINER = 16  # factor by which the spectrum has more bins than the record


# The release and the clamp.


@dataclass(frozen=True)
class Release:
    """The frames of a free decay, first and last included, with flags."""

    first: int
    last: int
    flags: tuple[Flag, ...] = ()


def find_release(time_s: np.ndarray, lateral_m: np.ndarray, weight: np.ndarray, name: str = "") -> Release:
    """Find the release: the last slow frame before the tail's fastest motion; the first frame kept comes after it.

    A hand bends the tail more slowly than its springs throw it back. Where the recording starts in mid-swing the decay
    starts with it.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) of the tail markers, m.
        weight: (n, k) 0 where a sample does not count.
        name: name of the trial, for messages.

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
    """Return the rms distance of the markers from where they are when the tail is stillest (n,), m."""
    lasting = uniform_filter1d(speed, span, mode="nearest")
    middle = int(lasting.argmin())
    rest = np.median(lateral[max(middle - span // 2, 0) : middle + span // 2 + 1], axis=0)
    return np.sqrt(((lateral - rest) ** 2).mean(axis=1))


def _end(time_s: np.ndarray, size: np.ndarray, span: int) -> tuple[int, bool]:
    """Return the last frame worth fitting, and whether the tail was moved again after it."""
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


def measure_yield(head_m: np.ndarray, fin_m: np.ndarray, reach: float) -> tuple[float, float]:
    """Return the share of the fin's swing that is the head's, and its standard error.

    The line through nose and neck is carried on to the fin and regressed on the fin's motion. Errors of the tracks
    last, as the fin's motion does: the standard error is widened for both (Bartlett 1935).

    Args:
        head_m: (n, 2) lateral motion of nose and neck, m; nan where a sample does not count.
        fin_m: (n,) lateral motion of the fin, m.
        reach: distance from nose to fin, in lengths from nose to neck.
    """
    carried = head_m[:, 0] + reach * (head_m[:, 1] - head_m[:, 0])
    good = np.isfinite(carried) & np.isfinite(fin_m)
    if good.sum() < 4:
        return 0.0, np.inf
    carried, fin = carried[good] - carried[good].mean(), fin_m[good] - fin_m[good].mean()
    power = max(float(fin @ fin), 1e-300)
    share = float(carried @ fin) / power
    residual = carried - share * fin
    lasting = max(_lag_one(residual) * _lag_one(fin), 0.0)
    variance = residual @ residual / (len(fin) - 2) / power * (1 + lasting) / max(1 - lasting, 1e-3)
    return share, float(np.sqrt(variance))


def clamp_flags(position_m: np.ndarray, markers: tuple[str, ...], fin: int, reach: float) -> tuple[Flag, ...]:
    """List the doubts about the clamp.

    Args:
        position_m: (n, m, 2) of all markers from the release on, in the robot frame, m; nan where they do not count.
        markers: names of the m markers, nose and neck among them.
        fin: index of the rearmost one.
        reach: distance from nose to that one, in lengths from nose to neck.
    """
    head = [markers.index("nose"), markers.index("neck")]
    flags = []
    for i in head:
        spread = float(np.sqrt(np.nanvar(position_m[:, i], axis=0).sum())) if np.isfinite(position_m[:, i]).any() else 0
        if spread > HEAD_MOVES_M:
            message = f"{markers[i]} moves by {1000 * spread:.1f} mm (rms): the head is not clamped"
            flags.append(Flag("head_moves", (markers[i],), message=f"{message}, and its motion is not fitted"))
    share, se = measure_yield(position_m[:, head, 1], position_m[:, fin, 1], reach)
    if abs(share) > max(LEAST_SHARE, SURE_SE * se) and not flags:
        message = (
            f"{100 * share:.1f} ± {100 * se:.1f} % of the fin's swing are the head's: the clamp yields; "
            f"the stiffness comes out low by up to {135 * abs(share):.0f} %"
        )
        flags.append(Flag("head_moves", ("nose", "neck"), message=message))
    return tuple(flags)


def _lag_one(series: np.ndarray) -> float:
    """Return the lag-one autocorrelation of a series (n,) about 0."""
    return float(series[1:] @ series[:-1]) / max(float(series @ series), 1e-300)


# The measured decay.


@dataclass(frozen=True, eq=False)
class DecayTrial:
    """The tail of a clamped robot swinging freely, n frames of k tail markers from the release on.

    Attributes:
        name: name of the trial.
        markers: the k tail markers, from head to fin.
        time_s: (n,) from the first frame after the release, s.
        position_m: (n, k, 2) in the robot frame (x from nose to tail, y to the right of a swimmer seen from above), m.
        weight: (n, k) 0 where a sample is missing or flagged.
        first_frame: first frame of the recording that is kept, just after the release.
        metres_per_px: scale of the picture.
        flags: flags of the tracks, the release and the clamp.
    """

    name: str
    markers: tuple[str, ...]
    time_s: np.ndarray
    position_m: np.ndarray
    weight: np.ndarray
    first_frame: int
    metres_per_px: float
    flags: tuple[Flag, ...] = ()

    @property
    def lateral_m(self) -> np.ndarray:
        """Motion across the body (n, k), nan where a sample does not count."""
        return np.where(self.weight > 0, self.position_m[..., 1], np.nan)


def measure_decay_trial(name: str, tracks: xr.Dataset, camera: CameraSpec, robot: RobotSpec) -> DecayTrial:
    """Check and scale the tracks of a free decay, find its release, and turn them into the robot frame.

    The head is clamped, so its axis is that of the median nose and the median neck: their tracking errors would
    otherwise reach the fin four times enlarged.

    Args:
        name: name of the trial.
        tracks: tracks in pixels, with nose, neck and at least one tail marker.
        camera: clock, scale length and lens.
        robot: the robot.

    Raises:
        NotEnoughData: no tail marker, no release, or too few frames after it.
    """
    place_m, metres_per_px, quality, tail = in_pool(tracks, camera, robot, f"trial {name}", FAR_OUT_PX)
    time_s = tracks.time.values - tracks.time.values[0]
    position_m = _in_robot_frame(place_m, markers_of(tracks), quality.weight, robot)
    weight = np.where(np.isfinite(position_m).all(axis=-1), quality.weight, 0.0)
    release = find_release(time_s, position_m[:, tail, 1], weight[:, tail], name)
    kept = slice(release.first, release.last + 1)
    if release.last - release.first + 1 < FEWEST_FRAMES:
        raise NotEnoughData(
            f"trial {name}: {release.last - release.first + 1} frames after the release at "
            f"{time_s[release.first]:.2f} s; at least {FEWEST_FRAMES} are needed. Record until the tail is at rest"
        )
    seen_m = np.where(weight[kept, :, None] > 0, position_m[kept], np.nan)
    nose, neck, far = robot.marker_positions_m(("nose", "neck", markers_of(tracks)[tail[-1]]))[:, 0]
    clamp = clamp_flags(seen_m, markers_of(tracks), tail[-1], float((far - nose) / (neck - nose)))
    return DecayTrial(
        name=name,
        markers=tuple(markers_of(tracks)[i] for i in tail),
        time_s=time_s[kept] - time_s[release.first],
        position_m=position_m[kept][:, tail],
        weight=weight[kept][:, tail],
        first_frame=release.first,
        metres_per_px=metres_per_px,
        flags=(*_within(quality.flags, release), *release.flags, *clamp),
    )


def _in_robot_frame(
    position_m: np.ndarray, markers: tuple[str, ...], weight: np.ndarray, robot: RobotSpec
) -> np.ndarray:
    """Return positions (n, m, 2) in the robot frame.

    Its axes are along and across the line from the median nose to the median neck.
    """
    nose, neck = markers.index("nose"), markers.index("neck")
    still = position_m.copy()
    for head in (nose, neck):
        trusted = (weight[:, head] > 0) & np.isfinite(position_m[:, head]).all(axis=-1)
        if not trusted.any():
            raise NotEnoughData(f"{markers[head]} is never seen well enough to locate the head; track it again")
        still[:, head] = np.median(position_m[trusted, head], axis=0)
    turned = to_head_frame(np.concatenate([position_m, still[:, [nose, neck]]], axis=1), -2, -1).shape_m[:, :-2]
    return turned + robot.marker_positions_m(("nose",))[0, :2]


def _within(flags: tuple[Flag, ...], release: Release) -> tuple[Flag, ...]:
    """Return the flags that concern the decay.

    A tail that is held still, for example, looks like a frozen video.
    """
    spans = [flag.frames or (release.first, release.last) for flag in flags]
    return tuple(
        flag for flag, (first, last) in zip(flags, spans, strict=True) if last > release.first and first <= release.last
    )


# The spectrum.


@dataclass(frozen=True, eq=False)
class DecaySpectrum:
    """Spectrum of a ringing tail, from k markers from head to fin.

    Attributes:
        bins_hz: (b,) frequencies of the spectrum, Hz.
        amplitude_m: (b, k) windowed amplitude spectrum of the lateral motion, m.
        peak_hz: peak of the markers' rms spectrum, between the bins; None where it has none, as the tail creeps back.
        decay_1_s: rate at which the swing falls, 1/s: an exponential's squares have their centroid at 1 / (2 rate).
        rest_m: (k,) where the markers rest, m.
        flags: what is doubtful about it.
    """

    bins_hz: np.ndarray
    amplitude_m: np.ndarray
    peak_hz: float | None
    decay_1_s: float
    rest_m: np.ndarray
    flags: tuple[Flag, ...] = ()

    @property
    def rms_m(self) -> np.ndarray:
        """Root mean square amplitude over all markers, (b,)."""
        return np.sqrt((self.amplitude_m**2).mean(axis=1))


def measure_decay(trial: DecayTrial) -> DecaySpectrum:
    """Compute the spectrum of a free decay, with flags."""
    found = spectrum_of(trial.time_s, trial.lateral_m)
    return replace(found, flags=(*_peak_flags(found), *_ring_flags(float(trial.time_s[-1]), found.peak_hz)))


def spectrum_of(time_s: np.ndarray, lateral_m: np.ndarray) -> DecaySpectrum:
    """Compute the spectrum of motions.

    The window is the falling half of Hann's, as a decay begins strongest.

    Args:
        time_s: (n,) s.
        lateral_m: (n, k) motions, m, nan where missing.
    """
    step = float(np.median(np.diff(time_s)))
    even_s = np.arange(0.0, time_s[-1] + step / 2, step)
    lateral = bridged(time_s, lateral_m, even_s)
    rest = lateral[round(AT_REST * len(lateral)) :].mean(axis=0)
    swing = lateral - rest
    window = hann(2 * len(even_s) + 1)[len(even_s) + 1 :]
    bins_hz = np.fft.rfftfreq(_FINER * len(even_s), step)
    amplitude = 2 * np.abs(np.fft.rfft(swing * window[:, None], _FINER * len(even_s), axis=0)) / window.sum()
    shown = bins_hz <= HIGHEST_HZ
    square = (swing**2).sum(axis=1)
    rate = float(square.sum() / max(2 * (even_s @ square), 1e-300))
    found = DecaySpectrum(bins_hz[shown], amplitude[shown], None, rate, rest)
    return replace(found, peak_hz=_peak(found.bins_hz, found.rms_m))


def _peak(bins_hz: np.ndarray, rms: np.ndarray) -> float | None:
    """Return the frequency of the highest peak, between the bins by a parabola through the logarithms."""
    peaks, _ = find_peaks(rms, prominence=PEAK_PROMINENCE / 10 * rms.max())
    if not len(peaks):
        return None
    top = int(peaks[np.argmax(rms[peaks])])
    before, at, after = np.log(rms[top - 1 : top + 2])
    return float(bins_hz[top] + 0.5 * (before - after) / (before - 2 * at + after) * (bins_hz[1] - bins_hz[0]))


def _ring_flags(seconds: float, peak_hz: float | None) -> Iterator[Flag]:
    if peak_hz is None:
        message = "the tail creeps back instead of ringing: its spectrum has no peak"
        yield Flag("unidentifiable", message=message)
    elif (periods := peak_hz * seconds) < FEWEST_PERIODS:
        message = f"only {periods:.1f} periods are recorded after the release; expected at least {FEWEST_PERIODS:g}"
        yield Flag("too_short", message=message)


def _peak_flags(spectrum: DecaySpectrum) -> Iterator[Flag]:
    bins_hz, rms = spectrum.bins_hz, spectrum.rms_m
    peaks, _ = find_peaks(rms, height=SECOND_PEAK * rms.max(), prominence=PEAK_PROMINENCE * rms.max())
    if len(peaks) > 1:
        both = " and ".join(f"{bins_hz[peak]:.2f} Hz" for peak in peaks[:2])
        message = f"the spectrum has peaks at {both}: the robot is touched, the clamp gives, or two swings are mixed"
        yield Flag("double_peaked", message=message)
