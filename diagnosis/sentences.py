"""Sentences on a diagnosis: where the gap lies (`where`), and which effect makes it (`which`)."""

from collections.abc import Mapping, Sequence

from diagnosis.constants import ADEQUATE, ALARM, ENOUGH, HELD, PLACED
from diagnosis.result import NONE, DiagnosisResult, Visible
from diagnosis.where import OF_NO_MARKER

_SHOWS_IN = ("in the speed", "in the course", "in the beat frequency", "in the free decays")
_OF_NO_MARKER = dict(zip(OF_NO_MARKER, _SHOWS_IN, strict=True))
_OF_STAGE = {
    "camera": "in what camera and tracker see",
    "drive": "in clock and drive",
    "body": "in the forces on the whole fish",
    "tail": "in the tail: its hinges and tendons",
}
_OF_UNKNOWN = {
    "camera": "in what the camera sees",
    "drive": "in motor or clock",
    "tendons": "in the tendons",
    "structure": "in the tail's structure",
    "water": "in the water",
}
_STANDS_OUT = 0.005  # least share of a stage that is named
_MOSTLY_NOISE = 0.5  # least share of noise that is told
_MARKER_STANDS_OUT = 2.0  # least ratio of a marker's share to the mean share for it to be named
_SHARES = ("relative", "share")  # parameters that are told in percent
_OF_FREQUENCY = 0.5  # least share of the gap that shows in the beat frequency for it to be told apart from the rest
_LOOKS_LIKE = 0.5  # least share of all probabilities for an effect to be what the gap looks like


def plain(name: str) -> str:
    """Return a name as words."""
    return name.replace("_", " ")


def where(data: DiagnosisResult) -> str:
    """Say where the gap comes from and where it shows, without numbers: the shares have denominators of their own."""
    shares = {stage: share for stage, share in data.where.by_stage.items() if stage != "floor"}
    if data.verdict == "no_gap" and data.reference is not None:
        return "Where: nowhere; launches of the reference differ as much from one another."
    if data.verdict == "no_gap":
        return "Where: no place that these trials show; what is left is no more than the twin usually leaves."
    stage = max(shares, key=lambda name: shares[name])
    if shares[stage] < _STANDS_OUT:
        return "Where: in nothing that repeats with the beat."
    noise = ", though noise is larger" if data.where.by_stage["floor"] > _MOSTLY_NOISE else ""
    rest = max((name for name in shares if name != stage), key=lambda name: shares[name])
    of_frequency = data.where.by_marker.get("frequency", 0.0) > _OF_FREQUENCY and shares[rest] >= _STANDS_OUT
    motion = f"; of the motion itself mostly {_OF_STAGE[rest]}" if stage == "drive" and of_frequency else ""
    return f"Where: mostly {_OF_STAGE[stage]}{noise}; it shows {_shows(data.where.by_marker)}{motion}."


def _shows(by_marker: Mapping[str, float]) -> str:
    """Name the numbers in which the gap shows.

    The markers count together, and one is named only where it stands out.
    """
    alone = {name: share for name, share in by_marker.items() if name in _OF_NO_MARKER}
    markers = {name: share for name, share in by_marker.items() if name not in _OF_NO_MARKER}
    whole = max(alone, key=lambda name: alone[name], default="")
    if not markers or (whole and alone[whole] > sum(markers.values())):
        return f"mostly {_OF_NO_MARKER[whole]}"
    most = max(markers, key=lambda name: markers[name])
    stands_out = markers[most] > _MARKER_STANDS_OUT * sum(markers.values()) / len(markers)
    return f"in how the markers move, {f'most at {plain(most)}' if stands_out else 'along the whole fish'}"


def which(data: DiagnosisResult) -> str:
    """Name the effects, or say why none is named."""
    verdict, chances = data.verdict, data.probabilities
    if verdict == "no_gap":
        against = _describe_withdrawn(data)
        but = f"; the fitted swims look like {against}" if against else ""
        need = "the data need no effect (probability of no gap"
        if data.reference is not None:
            need = "nothing changed that these trials show (probability of no change"
        nothing = f"Which: {need} {data.no_gap_probability:.2f}){but}."
        return f"{nothing} {near_miss(data)}".rstrip()
    if verdict == "unexplained" and (against := _describe_withdrawn(data)):
        return f"Which: it looks like {against}{_elsewhere(data)}; see the missing forces."
    if verdict == "unexplained" and is_inadequate(data):
        helps = [name for name in chances if name != NONE][:2]
        help_most = "help" if len(helps) > 1 else "helps"
        most = f"; {' and '.join(map(plain, helps))} {help_most} most, although not enough" if helps else ""
        stage = at_stage(data)
        what = f"{'changed' if data.reference is not None else 'acts'}{f', {stage}' if stage else ''}"
        return (
            f"Which: no set of effects of the catalogue leaves only noise, so something else {what}{most}"
            f"{_elsewhere(data)}; see the missing forces."
        )
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
    residual = "" if rest is None or rest.share < 0.05 else "; some of the gap remains"
    against = _describe_withdrawn(data)
    return f"Which: {named}{residual}{_elsewhere(data)}{'; not ' if against else ''}{against}."


def at_stage(data: DiagnosisResult) -> str:
    """Say at which stage an effect outside the catalogue acts, where none of it suffices; "" if none is probable."""
    stage = max(data.stages, key=lambda name: data.stages[name], default="")
    chance = data.stages.get(stage, 0.0)
    if not is_inadequate(data) or chance <= HELD:
        return ""
    paced = stage != "drive" and data.where.by_marker.get("frequency", 0.0) > _OF_FREQUENCY
    beside = f", beside a beat frequency that {'is off' if data.reference is None else 'changed'}" if paced else ""
    return f"most probably {_OF_UNKNOWN[stage]} ({chance:.2f}){beside}"


def is_inadequate(data: DiagnosisResult) -> bool:
    """Tell whether even the best set of effects leaves more than noise."""
    return data.adequate is not None and data.adequate.p_value < ADEQUATE


def visible_changes(data: DiagnosisResult) -> tuple[str, ...]:
    """List the least change of each effect that the comparison with a reference would show, the names in order."""
    if data.reference is None:
        return ()
    return tuple(
        f"{plain(effect)}: {plain(least.parameter)} {_in_unit(least)}"
        for effect, least in sorted(data.reference.visible.items())
        if least.within_bounds
    )


def _in_unit(least: Visible) -> str:
    if least.unit == "m":
        return f"{1000 * least.value:.2g} mm"
    if least.unit == "1":
        return f"{100 * least.value:.2g} %" if least.parameter in _SHARES else f"{least.value:.2g}"
    return f"{least.value:.2g} {least.unit}"


def near_miss(data: DiagnosisResult) -> str:
    """Say that there probably is some effect which is not certain enough for a verdict; otherwise an empty text."""
    chance = 1 - data.no_gap_probability
    if data.verdict != "no_gap" or chance <= HELD:
        return ""
    suspect = ""
    if not data.evidence.refuted:  # one that was refuted would be the likeliest
        name = max(data.probabilities, key=lambda each: data.probabilities[each])
        what = "something that no catalogue holds" if name == NONE else plain(name)
        suspect = f"; the likeliest is {what} ({data.probabilities[name]:.2f})"
    return (
        f"A near miss: some effect has a probability of {chance:.2f}, and an alarm needs {ALARM:g}{suspect}. One more "
        "trial may settle it."
    )


def _describe_withdrawn(data: DiagnosisResult) -> str:
    """Name the effects that were withdrawn, and why; an empty text if there are none."""
    withdrawn = []
    for each in data.evidence.refuted:
        names = " or ".join(map(plain, each.effects))
        if each.held_out_mm is not None:
            before, after = (f"{mm:.1f}" for mm in each.held_out_mm)
            withdrawn.append(f"{names}, but with that held-out swims are forecast worse ({before} to {after} mm)")
            continue
        assert each.shrinkage_ci95 is not None
        low, high = each.shrinkage_ci95
        grows = f"their gap grows by {-100 * each.shrinkage:.0f} %, {-100 * high:.0f} % to {-100 * low:.0f} %"
        withdrawn.append(f"{names}, but with that fitted swims are forecast worse from the others ({grows})")
    return ", nor ".join(withdrawn)


def _elsewhere(data: DiagnosisResult) -> str:
    """Name the place where an unknown effect most probably acts, if there is one."""
    chances: dict[str, float] = {}
    for each in data.evidence.elsewhere:
        chances[each.place] = chances.get(each.place, 0.0) + each.probability
    place = max(chances, key=lambda name: chances[name], default="")
    placed = chances.get(place, 0.0)
    if placed < PLACED:
        return ""
    return f"; something that no catalogue holds acts on the {plain(place)} ({placed:.2f})"


def _looks_like(chances: Mapping[str, float]) -> str | None:
    """Return an effect that is likelier than all others together, and than none of them."""
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
