"""First screen of the report: a swim from above, and three answers.

`swim_from_above` draws the robot and its twin in one pool, of the trial that `representative` chooses. `build_summary`
sets it above the answers of `reports.answers`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from markupsafe import Markup
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from fitting.calibration import CalibratedTrial
from reports.answers import Answers, HowFarOff, HowSure
from reports.context import ReportContext
from reports.forecasts import speed_sweep_figure
from reports.page import Bar, Card, FirstScreen, Plot, Range, Section, page_colour
from reports.style import FAINT, INK, MUTED, TWIN
from reports.words import MODELS, in_mm, in_words, listed, sentence, share_of, shown, spanned
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.robot import RobotSpec

_WIDTH = 760.0  # width of the picture, px
_BELOW = 30.0  # height of its legend, px
_LABEL = 28.0  # half the width of a label in large letters, px
_HIGHEST = 300.0  # largest height of the drawn paths, px
_STATIONS = 22  # points along the body
_FRAMES_A_SECOND = 14.0
_MOST_FRAMES = 64  # largest number of frames that are drawn
_LEAST_SEEN = 0.5  # share of the frames in which a marker must be seen to be drawn
_FEWEST = 3  # smallest number of markers, and of frames
_FINE = 200  # points of the outline
_NOSE = 0.14  # share of the length over which the nose widens
_TAPER = 0.3  # share of the length over which the tail narrows
_THINNEST_M = 0.004  # least half width of the outline
_APART = 0.62  # distance between snapshots, body lengths
_MOST_SNAPSHOTS = 4  # largest number of snapshots on paper

_FILMED = f'fill="{page_colour(INK)}" fill-opacity=".16" stroke="{page_colour(INK)}" stroke-opacity=".6"'
_SIMULATED = f'fill="none" stroke="{page_colour(TWIN)}" stroke-width="1.8"'
_TEXT = f'font-size="12.5" fill="{page_colour(MUTED)}"'


class _Swim(NamedTuple):
    """A swim for the picture: midlines (n, k, 2) of robot and twin in one pool, m, swimming to the left.

    `time_s` (n,) are the times, s, and `half_width_m` (k,) the half widths of the outline, m.
    """

    filmed: np.ndarray
    twin: np.ndarray
    time_s: np.ndarray
    half_width_m: np.ndarray


def representative(trials: tuple[CalibratedTrial, ...], robot: RobotSpec) -> CalibratedTrial | None:
    """Choose the held-out trial with the median marker distance, of those that can be drawn.

    If there is none, it is a fitted trial.
    """
    for role in ("holdout", "fit"):
        compared = [each for each in trials if each.measured.role == role and np.isfinite(each.scores.marker_error_m)]
        drawn = [trial for trial in compared if _on_axis(trial, robot).sum() >= _FEWEST]
        if drawn:
            return sorted(drawn, key=lambda trial: trial.scores.marker_error_m)[len(drawn) // 2]
    return None


def swim_from_above(trial: CalibratedTrial, robot: RobotSpec) -> Markup:
    """Draw the compared part of a trial as SVG; empty where too little of it was seen or simulated."""
    swim = _swim(trial, robot)
    return Markup("") if swim is None else _draw(swim, trial, robot)


def _on_axis(trial: CalibratedTrial, robot: RobotSpec) -> np.ndarray:
    """Mark (m,) the markers on the robot's axis that were seen often enough."""
    seen = np.isfinite(trial.measured.position_m[trial.measured.kept]).all(axis=2)
    often = seen.mean(axis=0) >= _LEAST_SEEN if seen.size else np.zeros(len(trial.measured.markers), bool)
    return np.asarray(often & (np.abs(robot.marker_positions_m(trial.measured.markers)[:, 1]) < 0.01 * robot.length_m))


def _swim(trial: CalibratedTrial, robot: RobotSpec) -> _Swim | None:
    measured, twin = trial.measured, trial.simulated
    place = robot.marker_positions_m(measured.markers)
    chosen = np.flatnonzero(_on_axis(trial, robot))
    chosen = chosen[np.argsort(place[chosen, 0])]
    frames = np.flatnonzero(measured.kept)
    if len(chosen) < _FEWEST or len(frames) < _FEWEST:
        return None
    cos, sin = np.cos(twin.heading_rad[frames]), np.sin(twin.heading_rad[frames])
    turn = np.stack([np.stack([cos, -sin], -1), np.stack([sin, cos], -1)], -2)  # (n, 2, 2)
    simulated = twin.nose_m[frames, None] + np.einsum("nij,nkj->nki", turn, twin.shape_m[frames][:, chosen])
    filmed, simulated = (_bridge(each) for each in (measured.position_m[frames][:, chosen], simulated))
    if not (np.isfinite(filmed).all() and np.isfinite(simulated).all()):
        return None
    time_s = measured.time_s[frames] - measured.time_s[frames[0]]
    first = time_s <= max(1 / measured.frequency.hz, time_s[_FEWEST - 1])
    simulated = _lay_on(simulated, simulated[first], filmed[first])
    way = filmed[-1].mean(axis=0) - filmed[0].mean(axis=0)
    leftwards = np.pi - np.arctan2(way[1], way[0])
    both = [_turn(each, leftwards) for each in (filmed, simulated)]
    step = max(len(time_s) // min(_MOST_FRAMES, max(int(time_s[-1] * _FRAMES_A_SECOND), 2)), 1)
    x = place[chosen, 0]
    at = np.linspace(x[0], x[-1], _STATIONS)
    lines = [PchipInterpolator(x, each[::step], axis=1)(at) for each in both]
    return _Swim(lines[0], lines[1], time_s[::step], _half_width(robot, at))


def _bridge(position_m: np.ndarray) -> np.ndarray:
    """Fill the gaps of single markers in (n, k, 2), straight over time."""
    flat = position_m.reshape(len(position_m), -1).copy()
    at = np.arange(len(flat))
    for column in flat.T:
        known = np.isfinite(column)
        if known.any():
            column[:] = np.interp(at, at[known], column[known])
    return flat.reshape(position_m.shape)


def _lay_on(everything: np.ndarray, part: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Move and turn all points so that the part (..., 2) is nearest to the target, by least squares."""
    middle, onto = part.mean(axis=(0, 1)), target.mean(axis=(0, 1))
    a, b = (part - middle).reshape(-1, 2), (target - onto).reshape(-1, 2)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    return _turn(everything - middle, angle) + onto


def _turn(points: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def _half_width(robot: RobotSpec, x: np.ndarray) -> np.ndarray:
    """Compute the half widths of a smooth outline of the robot at places (k,) along it, m.

    The outline is about the parts of the head and the ribs of the tail.
    """
    at = np.linspace(x[0], x[-1], _FINE)
    width = np.full(_FINE, _THINNEST_M)
    for part in robot.head.part:
        (half, across), centre = part.half_size_m[:2], part.centre_m[0]
        if 2 * half > across:  # a shaft across the fish is no part of its outline
            reach = np.abs(at - centre) <= half
            width[reach] = np.maximum(width[reach], across)
    for (front, rear), segment in zip(robot.segment_x_m, robot.tail.segment, strict=True):
        reach = (at >= front) & (at <= rear)
        width[reach] = np.maximum(width[reach], segment.guide_offset_m)
    smooth = gaussian_filter1d(width, 0.055 * _FINE, mode="nearest")
    nose = np.sqrt(np.clip((at - x[0]) / (_NOSE * (x[-1] - x[0])), 0.0, 1.0))
    tail = np.clip((x[-1] - at) / (_TAPER * (x[-1] - x[0])), 0.0, 1.0)
    return np.maximum(np.interp(x, at, smooth * nose * tail), _THINNEST_M)


def _outline(midline: np.ndarray, half_width_m: np.ndarray) -> np.ndarray:
    """Compute the outline (2 k, 2) around a midline (k, 2)."""
    along = np.gradient(midline, axis=0)
    across = np.column_stack([-along[:, 1], along[:, 0]]) / np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    side = across * half_width_m[:, None]
    return np.concatenate([midline + side, (midline - side)[::-1]])


def _draw(swim: _Swim, trial: CalibratedTrial, robot: RobotSpec) -> Markup:
    shapes = [[_outline(line, swim.half_width_m) for line in lines] for lines in (swim.filmed, swim.twin)]
    points = np.concatenate([np.concatenate(each) for each in shapes])
    low, high = points.min(axis=0), points.max(axis=0)
    scale = min((_WIDTH - 24) / (high[0] - low[0]), _HIGHEST / (high[1] - low[1]))
    left = 12 + (_WIDTH - 24 - scale * (high[0] - low[0])) / 2
    height = scale * (high[1] - low[1]) + 44

    def px(at: np.ndarray) -> np.ndarray:
        return np.column_stack([left + scale * (at[:, 0] - low[0]), 26 + scale * (high[1] - at[:, 1])])

    def path(at: np.ndarray, closed: bool = True) -> str:
        return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in px(at)) + ("Z" if closed else "")

    parts = [_tank(scale, height, left)]
    for lines, colour, look in ((swim.filmed, INK, ""), (swim.twin, TWIN, ' stroke-dasharray="3 2"')):
        for end in (0, -1):
            trace = path(lines[:, end], closed=False)
            parts.append(f'<path d="{trace}" fill="none" stroke="{page_colour(colour)}" stroke-opacity=".35"{look}/>')
    for frame in _snapshots(swim, robot):
        for shape, style in zip(shapes, (_FILMED, _SIMULATED), strict=True):
            parts.append(f'<path class="still" d="{path(shape[frame])}" {style}/>')
        x, y = px(swim.filmed[frame])[0]
        when = f"{shown(float(swim.time_s[frame]), 1)} s"
        middle = float(np.clip(x, _LABEL, _WIDTH - _LABEL))
        parts.append(f'<text x="{middle:.0f}" y="14" text-anchor="middle" {_TEXT}>{when}</text>')
        parts.append(f'<path d="M{x:.1f} 18V{y:.1f}" stroke="{page_colour(FAINT)}" stroke-dasharray="2 3"/>')
    for shape, style in zip(shapes, (_FILMED, _SIMULATED), strict=True):
        values = ";".join(path(each) for each in shape)
        parts.append(
            f'<path class="move" d="{path(shape[-1])}" {style}><animate attributeName="d" '
            f'dur="{max(float(swim.time_s[-1]), 0.5):.2f}s" repeatCount="indefinite" values="{values}"/></path>'
        )
    parts.append(_legend(scale, height))
    label = f"Trial {trial.measured.name} from above: the filmed fish and the twin."
    return Markup('<svg role="img" aria-label="{}" viewBox="0 0 {} {:.0f}" xmlns="http://www.w3.org/2000/svg">').format(
        label, int(_WIDTH), height + _BELOW
    ) + Markup("".join(parts) + "</svg>")


def _snapshots(swim: _Swim, robot: RobotSpec) -> list[int]:
    """Choose the frames that are drawn for paper: the last one and some before it, far enough apart to be distinct."""
    way = float(np.hypot(*(swim.filmed[-1].mean(axis=0) - swim.filmed[0].mean(axis=0))))
    count = int(np.clip(way / (_APART * robot.length_m), 1, _MOST_SNAPSHOTS - 1)) + 1
    return sorted({int(frame) for frame in np.linspace(0, len(swim.time_s) - 1, count).round()})


def _tank(scale: float, height: float, left: float) -> str:
    """Draw lines every 10 cm."""
    step = 0.1 * scale
    across = "".join(f"M{x:.1f} 20V{height:.1f}" for x in np.arange(left % step, _WIDTH, step))
    down = "".join(f"M0 {y:.1f}H{_WIDTH:.0f}" for y in np.arange(26, height, step))
    return f'<path d="{across}{down}" stroke="{page_colour(FAINT)}" stroke-opacity=".5" fill="none"/>'


def _legend(scale: float, height: float) -> str:
    y = height + 18
    return (
        f'<path d="M4 {y}h{0.1 * scale:.1f}" stroke="{page_colour(INK)}" stroke-width="2"/>'
        f'<text x="{12 + 0.1 * scale:.0f}" y="{y + 4}" {_TEXT}>10 cm, swims to the left</text>'
        f'<rect x="500" y="{y - 6}" width="18" height="12" rx="4" {_FILMED}/>'
        f'<text x="525" y="{y + 4}" {_TEXT}>filmed</text>'
        f'<rect x="600" y="{y - 6}" width="18" height="12" rx="4" {_SIMULATED}/>'
        f'<text x="625" y="{y + 4}" {_TEXT}>exported twin</text>'
    )


# The first screen.


def build_summary(context: ReportContext) -> Section:
    """Build the first screen; for what was not computed it names the command."""
    answers = context.answers
    hero, about = _hero(context)
    screen = FirstScreen(
        lead=_lead(answers),
        hero=hero,
        hero_caption=about,
        plots=(_speeds(context),),
        cards=(
            _how_far_off(answers.how_far_off),
            _how_sure(answers.how_sure, context),
            _missing(answers, context),
        ),
        next_step=answers.next_step,
        caveats=answers.caveats,
        explained=answers.explained,
    )
    return Section("Summary", "summary", (screen,))


def _lead(answers: Answers) -> Markup:
    off = answers.how_far_off
    parts = [Markup(_describe_exported(off))]
    if (found := answers.missing) is not None:
        if found.groups:
            names = Markup(listed([str(Markup("<b>{}</b>").format(group)) for group in found.groups], 3))
            what = "Missing from it, at least" if found.more_is_missing else "Missing from it"
            parts.append(Markup("{}: {}.").format(what, names))
        elif found.no_gap:
            parts.append(Markup("These trials do not show that an effect is missing from it."))
        else:
            at = f", {found.at_stage}," if found.at_stage else ""
            parts.append(Markup("Something is missing from it{} that these trials do not name.").format(at))
    return Markup(" ").join(parts)


def _describe_exported(off: HowFarOff) -> Markup:
    parts = [Markup("{}").format(off.misses)] if off.misses else []
    if (held := off.held_out) is None:
        if off.fitted is not None:
            known = f"The exported twin is off by {off.fitted.size} in the trials that it was fitted to."
            parts.append(Markup("{}").format(known))
        parts.append(Markup("No held-out trial tells how well it forecasts."))
        return Markup(" ").join(parts)
    swims = "an unseen swim" if held.trials == 1 else f"{held.trials} unseen swims"
    if held.frequencies < held.trials:
        swims += " at one frequency" if held.frequencies == 1 else f" at {held.frequencies} frequencies"
    rule = off.beside.get(off.best)
    beside = "" if rule is None else f"; the best simple rule, {MODELS[off.best]}, to {in_mm(rule)}"
    theory = off.beside_theory and f", {off.beside_theory}"
    text = "The exported twin predicts the speed of {} to <b>{}&nbsp;mm/s</b> of {}{}{}."
    parts.append(Markup(text).format(swims, in_mm(held.speed), in_mm(held.swum, 0), theory, beside))
    return Markup(" ").join(parts)


def _hero(context: ReportContext) -> tuple[Markup, str]:
    trial = representative(context.calibration.trials, context.calibration.robot)
    drawn = Markup("") if trial is None else swim_from_above(trial, context.calibration.robot)
    if trial is None or not drawn:
        return Markup(""), ""
    seen = "fitted" if trial.measured.role == "fit" else "never shown to the fit"
    return drawn, (
        f"Trial {trial.measured.name}, {shown(trial.measured.frequency.hz, 2)} Hz, {seen}. Robot and twin are "
        "laid on each other over the first beat; their markers are "
        f"{in_mm(trial.scores.marker_error_m)} mm apart in the mean."
    )


def _speeds(context: ReportContext) -> Plot:
    calibration, sure = context.calibration, context.answers.how_sure
    low, high = calibration.sweep.fitted_hz
    diverged = int(np.isnan(calibration.sweep.speed_twin).sum())
    band = ""
    if context.posterior is not None:
        inside, count = sure.in_band
        bars = " Upright bars know the swim’s own beat and start, so they are shorter." if count else ""
        missed = context.unknown_to_bands if inside < 0.8 * count else ""
        whose = "its bar" if count == 1 else "their bars"
        held = f" {share_of(inside, count, 'held-out speed')} in {whose}{missed}." if count else ""
        band = (
            " Pale: the twin corrected with the fit trials, not the one you export (blue); its "
            f"band should hold 90 % of new swims.{bars}{held}"
        )
    return Plot(
        speed_sweep_figure(calibration, context.posterior),
        "sweep",
        f"Speed over tail beat frequency. Below: the same minus the twin’s speed.{band} The curve of elongated body "
        "theory takes the twin’s tail motion; its mean error takes the measured one. Grey: outside what was fitted, "
        f"{shown(low, 2)}{'' if low == high else f' to {shown(high, 2)}'} Hz.",
        f"The twin diverged at {diverged} frequencies, which are left out." if diverged else "",
        narrow=speed_sweep_figure(calibration, context.posterior, narrow=True),
    )


def _how_far_off(off: HowFarOff) -> Card:
    title = "How far off is the twin I can export?"
    if (held := off.held_out) is None:
        known = f"{off.fitted.size} in {off.fitted.over('fit')}. " if off.fitted is not None else ""
        return Card(title, "Not known", (f"{known}Hold a trial out to find how well it forecasts.",))
    fitted = "" if off.fitted is None else f" In {off.fitted.over('fit')}: {off.fitted.size}."
    highest = max(held.speed, *off.beside.values(), 1e-9)
    rows = [("exported twin", held.speed, True), *((MODELS[name], error, False) for name, error in off.beside.items())]
    bars = tuple(Bar(name, f"{in_mm(error)} mm/s", error / highest, twin) for name, error, twin in rows)
    return Card(
        title, held.size, (f"Mean error of speed and markers in {held.over('held-out')}.{fitted}", off.compared), bars
    )


def _how_sure(sure: HowSure, context: ReportContext) -> Card:
    low, high = COEFFICIENT_BOUNDS
    ranges = tuple(
        Range(in_words(name), one.text, *((each - low) / (high - low) for each in (one.low, one.high, one.value)))
        for name, one in sure.intervals.items()
    )
    how = f"90 % intervals; lines span {spanned(low, high)}."
    command = "" if sure.sampled else f"calib posterior {context.session.folder.name}"
    said = " ".join(filter(None, (sure.verdict, how, sure.beware)))
    return Card("How sure are the coefficients?", "", (said,), (), ranges, command)


def _missing(answers: Answers, context: ReportContext) -> Card:
    found, title = answers.missing, "What is missing?"
    if found is None:
        return Card(
            title, "Not known", (answers.not_searched,), command=f"calib diagnose {context.session.folder.name}"
        )
    bars = tuple(Bar(name, shown(chance, 2), chance, name in found.named) for name, chance in found.chances.items())
    place = "" if found.no_gap else sentence(found.where.partition(" (")[0].partition(";")[0])
    return Card(title, found.headline, tuple(filter(None, (found.size, f"{place} {found.how_far}".strip()))), bars)
