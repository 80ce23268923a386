"""A `diagnosis.json` in three sentences and a table for the terminal."""

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any

from diagnosis.sentences import by_how_much, plain, sentences

_ROWS, _NEXT = 6, 3  # effects, at least, and experiments that are shown
_TELLS = 0.2  # error below which an experiment tells two effects apart
_OFF = 0.1  # share by which tails beat beside their commands, from which numbers of the session are to be checked
_OF_FREQUENCY = frozenset({"time_base_error", "drive_ratio_error", "motor_speed_sag"})


def diagnosis_lines(data: Mapping[str, Any]) -> list[str]:
    """Where, which and how far; then the likeliest effects, what to check, and what to measure next."""
    lines = [*sentences(data), ""]
    chances = {name: p for name, p in data["probabilities"].items() if name != "none_of_these"}
    lines.append(f"{'effect':28} {'probability':>11}  fitted")
    for number, (name, chance) in enumerate(chances.items()):
        if number < _ROWS or name in data["effects"]:
            lines.append(f"{name:28} {chance:11.3f}  {_fitted(data['effect_parameters'].get(name))}".rstrip())
    lines.append(f"{'none of these':28} {data['probabilities']['none_of_these']:11.3f}")
    lines.append(f"{'nothing at all':28} {data['no_gap_probability']:11.3f}")
    return [*lines, *(f"check: {each}" for each in _checks(data)), *_next(data), *_models(data)]


def _next(data: Mapping[str, Any]) -> list[str]:
    """Experiments that tell something apart, each once."""
    told: dict[str, list[str]] = {}
    for each in data["next_experiments"]:
        if each["expected_error"] < _TELLS:
            pair = " from ".join(map(plain, each["separates"]))
            told.setdefault(each["describe"], []).append(f"{pair}, {each['expected_error']:.0%} error left")
    return [f"next: {what} (tells {'; '.join(pairs)})" for what, pairs in list(told.items())[:_NEXT]]


def _models(data: Mapping[str, Any]) -> list[str]:
    """Files of twins with effects, and which of several alternatives stands in them."""
    either = [plain(group[0]) for group in data["groups"] if len(group) > 1]
    chosen = f"; with {' and '.join(either)}, the likeliest of those told" if either else ""
    names = data.get("models", ())
    return [f"model: {name}{'' if name.startswith('calibrated+everything.') else chosen}" for name in names]


def _checks(data: Mapping[str, Any]) -> list[str]:
    """What makes a diagnosis doubtful, or should be looked at before it is believed."""
    told = []
    if lacking := data.get("withheld_from_catalogue"):
        told.append(f"this diagnosis was made without {', '.join(map(plain, lacking))}; run it again for the whole")
    known = [f["measured_hz"] / f["commanded_hz"] - 1 for f in data["frequencies"].values() if f["commanded_hz"]]
    off = sum(known) / len(known) if known else 0.0
    if abs(off) > _OFF and (data["verdict"] == "unexplained" or _OF_FREQUENCY & set(data["effects"])):
        told.append(
            f"tails beat {abs(off):.0%} {'slower' if off < 0 else 'faster'} than commanded; fps of the camera, and "
            "commanded_hz in turns a second, should be sure before clock, gear or motor are blamed"
        )
    ends = [f"{plain(effect)} ({plain(name)})" for effect, name in _at_bound(data["effect_parameters"])]
    if ends:
        told.append(f"as strong as it may be, so perhaps stronger or something else: {', '.join(ends)}")
    if len(data["missing_forces"]["trials"]) == 1:
        told.append("one swim was fitted; two or more at different speeds tell far more")
    return told


def _at_bound(parameters: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Effects and those of their parameters that are at a bound."""
    return [
        (effect, name)
        for effect, own in parameters.items()
        for name, told in _named(own).items()
        if told.get("at_bound")
    ]


def supposition_lines(data: Mapping[str, Any]) -> list[str]:
    """What speaks for each supposed effect and for all together; then the gap without and with them."""
    factor = data["log_bayes_factor"]
    lines = [
        f"Supposed: {', '.join(plain(name) for name in data['effects'])}.",
        f"The fitted swims are e^{factor:.1f} times as probable with {'it' if len(data['effects']) == 1 else 'them'} "
        "as with the plain twin, whatever else may be amiss.",
        "",
        f"{'effect':28} {'ln factor':>11}  fitted",
    ]
    for name, own in data["log_bayes_factor_of_each"].items():
        lines.append(f"{name:28} {own:11.1f}  {_fitted(data['effect_parameters'].get(name))}".rstrip())
    lines += ["", f"{'':28} {'plain':>11} {'supposed':>11}"]
    for swims, gap in (("fitted", data["fitted"]), ("held out", data["gap"])):
        if gap["evaluated_on"]:
            lines.append(_beside(f"{swims}: markers, mm", gap["baseline_mm"], gap["with_effects_mm"]))
            placed = gap["baseline_placed_mm"], gap["with_effects_placed_mm"]
            lines.append(_beside(f"{swims}: boxes put right, mm", *placed))
            speeds = gap["speed_mae_before"], gap["speed_mae_after"]
            lines.append(_beside(f"{swims}: speed, mm/s", *(1000 * each for each in speeds)))
    if data["gap"].get("shrinkage") is not None:
        lines.append(f"The held-out gap {by_how_much(data['gap'])}.")
    return lines


def _beside(what: str, before: float | None, after: float | None) -> str:
    return f"{what:28} " + " ".join(f"{'-' if each is None else f'{each:.1f}':>11}" for each in (before, after))


def _fitted(parameters: Mapping[str, Any] | None) -> str:
    if parameters is None:
        return ""
    shown = sorted(_named(parameters).items(), key=lambda item: -_clear(item[1]["value"], item[1]["ci95"]))[:3]
    return ", ".join(_parameter(name, told) for name, told in shown)


def _named(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """By the names of an effect's parameters, also where it has but one."""
    return {parameters["parameter"]: parameters} if "value" in parameters else parameters


def _parameter(name: str, told: Mapping[str, Any]) -> str:
    """With as many digits as its interval has to say, two of its half at least."""
    low, high = told["ci95"]
    places = max(1 - floor(log10(max(high - low, 1e-12) / 2)), 0)
    unit = "" if told["unit"] == "1" else f" {told['unit']}"
    return f"{name} {told['value']:.{places}f} ({low:.{places}f} to {high:.{places}f}){unit}"


def _clear(value: float, interval: Sequence[float]) -> float:
    """How many half intervals it is from zero."""
    return abs(value) / max(interval[1] - interval[0], 1e-12)
