"""A diagnosis in three sentences: how far its twin can be trusted, where the gap lies, which effect makes it."""

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.constants import ENOUGH, HELD, PLACED
from diagnosis.result import DiagnosisResult, GapSize, NonPeriodicResidual
from diagnosis.where import OF_NO_MARKER

_SHOWS_IN = ("in its speed", "in its course", "in its beat frequency", "in its free decay")
_OF_NO_MARKER = dict(zip(OF_NO_MARKER, _SHOWS_IN, strict=True))
_OF_STAGE = {
    "camera": "in what camera and tracker see",
    "drive": "in clock and drive",
    "body": "in the forces on the whole fish",
    "tail": "in the tail: its hinges and tendons",
}
_STANDS_OUT = 0.005  # share of a stage, below which none is named
_LOOKS_LIKE = 0.5  # of all that is there


def sentences(data: DiagnosisResult) -> tuple[str, str, str]:
    """Of a diagnosis."""
    return _how_far(data), _where(data), _which(data)


def plain(name: str) -> str:
    """A name as words."""
    return name.replace("_", " ")


def _where(data: DiagnosisResult) -> str:
    shares = dict(data.where.by_stage)
    floor = shares.pop("floor")
    if data.verdict == "no_gap":
        return f"Where: no place that these trials show; {floor:.0%} of the squared residual is noise."
    stage = max(shares, key=lambda name: shares[name])
    if shares[stage] < _STANDS_OUT:
        return f"Where: in nothing that repeats with the beat; {floor:.0%} of the squared residual that does is noise."
    shows = data.where.by_marker
    place = max(shows, key=lambda name: shows[name])
    return (
        f"Where: mostly {_OF_STAGE[stage]} ({shares[stage]:.0%} of the squared residual; {floor:.0%} is noise), "
        f"mainly {_OF_NO_MARKER.get(place, f'at {plain(place)}')}."
    )


def _which(data: DiagnosisResult) -> str:
    verdict, chances = data.verdict, data.probabilities
    if verdict == "no_gap":
        against = _refuted(data)
        but = f"; the fitted swims look like {against}" if against else ""
        return f"Which: the data need no effect (probability of no gap {data.no_gap_probability:.2f}){but}."
    if verdict == "unexplained" and (against := _refuted(data)):
        return f"Which: it looks like {against}{_elsewhere(data)}; see the missing forces."
    if verdict == "unexplained" and (like := _looks_like(chances)) is not None:
        but = (
            "may as well be something that only looks like it"
            if chances[like] < HELD
            else "most of the gap stays beside it"
        )
        return (
            f"Which: it looks most like {plain(like)} ({chances[like]:.2f}), but {but}{_elsewhere(data)}; "
            "see the missing forces."
        )
    if verdict == "unexplained" and chances["none_of_these"] < 0.5:
        several = [name for name in chances if name != "none_of_these"]
        sure = sum(chances[name] >= ENOUGH for name in several)
        likeliest = ", ".join(f"{plain(name)} ({chances[name]:.2f})" for name in several[: max(sure, 4)])
        what = "many at once, too many to name" if sure > 1 else "no effect stands out"
        return f"Which: {what}; the likeliest are {likeliest}{_elsewhere(data)}. See the missing forces."
    if verdict == "unexplained":
        return (
            "Which: no effect of the catalogue explains it "
            f"(probability that it is something else {chances['none_of_these']:.2f}){_elsewhere(data)}; "
            "see the missing forces."
        )
    named = _together([_group(group, chances) for group in data.groups])
    rest = data.remainder
    residual = "" if rest is None or rest.share < 0.05 else f"; {rest.share:.0%} of the fitted gap remains"
    against = _refuted(data)
    return f"Which: {named}{residual}{_elsewhere(data)}{'; not ' if against else ''}{against}."


def _refuted(data: DiagnosisResult) -> str:
    """What was taken back, and why; empty if nothing was."""
    withdrawn = []
    for each in data.evidence.refuted:
        low, high = each.shrinkage_ci95
        grows = f"their gap grows by {-each.shrinkage:.0%}, {-high:.0%} to {-low:.0%}"
        names = " or ".join(map(plain, each.effects))
        withdrawn.append(f"{names}, but with that fitted swims are forecast worse from the others ({grows})")
    return ", nor ".join(withdrawn)


def _elsewhere(data: DiagnosisResult) -> str:
    """Where something that no catalogue holds most probably acts, if anywhere."""
    chances: dict[str, float] = {}
    for each in data.evidence.elsewhere:
        chances[each.place] = chances.get(each.place, 0.0) + each.probability
    place = max(chances, key=lambda name: chances[name], default="")
    placed = chances.get(place, 0.0)
    if beside := _beside_the_beat(data, max(PLACED, placed)):
        return beside
    if placed < PLACED:
        return ""
    return f"; something that no catalogue holds acts on the {plain(place)} ({placed:.2f})"


def _beside_the_beat(data: DiagnosisResult, least: float) -> str:
    """What something that no catalogue holds does beside the beat, where that is surer than this; else empty."""
    sway, delay = data.evidence.sway_m, data.evidence.delay_s
    surer: tuple[NonPeriodicResidual, str, str] = (sway, "moves the whole fish beside its beat", "mm")
    if delay.probability > sway.probability:
        surer = delay, "makes its beats early and late", "ms"
    found, what, unit = surer
    if found.probability <= least:
        return ""
    of_size = f"{1000 * found.rms:.1f} {unit}, {found.probability:.2f}"
    return f"; something that no catalogue holds {what} ({of_size})"


def _looks_like(chances: Mapping[str, float]) -> str | None:
    """An effect that is likelier than all others together, and than none of them."""
    found = {name: chance for name, chance in chances.items() if name != "none_of_these"}
    like = max(found, key=lambda name: found[name], default=None)
    if like is None or found[like] < _LOOKS_LIKE * sum(chances.values()):
        return None
    return like


def _together(groups: Sequence[str]) -> str:
    if len(groups) == 1:
        return groups[0]
    return f"{', '.join(groups[:-1])} and {groups[-1]}, all at once"


def _group(group: Sequence[str], chances: Mapping[str, float]) -> str:
    named = [f"{plain(name)} ({chances.get(name, 0.0):.2f})" for name in group]
    return named[0] if len(named) == 1 else f"either {' or '.join(named)}"


def _how_far(data: DiagnosisResult) -> str:
    gap = data.gap
    if not gap.evaluated_on:
        return "How far: not known, for no swim was held out; do not use this model for forecasts before one is."
    if np.isnan([gap.baseline_mm, gap.with_effects_mm]).any():
        return "How far: not known, for no marker of the held-out swims could be compared."
    trials = f"{len(gap.evaluated_on)} untouched swim{'s' * (len(gap.evaluated_on) > 1)}"
    every = _with_everything(data)
    if data.verdict in ("no_gap", "unexplained"):
        sizes = _sizes(gap.baseline_mm, gap.speed_mae_before, gap.frequency_mae_before)
        return f"How far: nothing was added; on {trials} {sizes}{_line(gap)}{every}."
    sizes = (
        f"{_sizes(gap.baseline_mm, gap.speed_mae_before, gap.frequency_mae_before)} without, "
        f"{_sizes(gap.with_effects_mm, gap.speed_mae_after, gap.frequency_mae_after)} with what is named"
    )
    if np.isnan(gap.shrinkage):
        return f"How far: on {trials} the plain twin leaves no more than noise; {sizes}{_line(gap)}{every}."
    warning = "" if gap.improves else "do not use this model for forecasts; "
    return f"How far: {warning}on {trials} the gap {by_how_much(gap)}; {sizes}{_line(gap)}{every}."


def _sizes(markers_mm: float, speed_m_s: float, frequency_hz: float) -> str:
    beats = "" if np.isnan(frequency_hz) else f" and frequencies {1000 * frequency_hz:.0f} mHz"
    return f"markers are {markers_mm:.1f} mm, speeds {1000 * speed_m_s:.1f} mm/s{beats} off"


def _line(gap: GapSize) -> str:
    """The baseline that every forecast of a speed has to beat."""
    error = gap.speed_mae_baselines.get("line", float("nan"))
    if np.isnan(error):
        return ""
    return f"; a straight line in frequency through the fitted speeds is {1000 * error:.1f} mm/s off"


def by_how_much(gap: GapSize) -> str:
    """What became of a held-out gap of which a shrinkage is reported, with its interval."""
    interval = gap.shrinkage_ci95
    grows = round(gap.shrinkage, 2) < 0
    sure = "how surely is not known"
    if interval is not None:  # of a gap that grows, by how much it does
        low, high = (-interval[1], -interval[0]) if grows else interval
        sure = f"{low:.0%} to {high:.0%}"
    how = f"grows by {-gap.shrinkage:.0%}" if grows else f"shrinks by {max(gap.shrinkage, 0.0):.0%}"
    return f"{how} ({sure})"


def _with_everything(data: DiagnosisResult) -> str:
    """What the held-out swims would be off by with all effects at once; empty where that was not asked."""
    gap = None if data.everything is None else data.everything.gap
    if gap is None or np.isnan(gap.with_effects_mm) or gap.evaluated_on != data.gap.evaluated_on:
        return ""
    return (
        "; with all effects at once, each a little, markers are "
        f"{gap.with_effects_mm:.1f} mm off and speeds {1000 * gap.speed_mae_after:.1f} mm/s"
    )
