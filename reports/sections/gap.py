"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with that."""

from math import isnan

from markupsafe import Markup

from diagnosis.result import AllEffects, Attribution, Controls, DiagnosisResult, GapSize, Remainder
from reports.blocks import Block, Plots, Points, Prose, Section
from reports.context import ReportContext
from reports.numbers import in_mm, in_words, listed, shown, spanned, whole_percent
from reports.sections.gap_evidence import evidence, missing, next_experiments
from reports.sections.gap_plots import gap_plots

_VERDICTS = {
    "named": "Verdict: named. The data leave no other name of the catalogue.",
    "inseparable": "Verdict: inseparable. These trials cannot tell the names of a group apart; one of each is enough.",
    "unexplained": "Verdict: unexplained. There is a gap, and no name of the catalogue can be said of it.",
    "no_gap": "Verdict: no gap. These trials do not make it sure enough that there is anything but noise, misplaced "
    "boxes and the twin’s own error.",
}
_NOT_HELD_OUT = (
    "No swim was held out, so nobody knows how far the gap shrinks on swims that were not fitted. Give one or more "
    'trials the role "holdout" in session.toml and diagnose again.'
)
_SUSPECT = 0.5  # probability of a gap from which a verdict of none is called a near miss
_STRONGEST = 4  # parameters that are told
_CLEAR = 0.01  # of the p value from which what remains passes for noise


def build(context: ReportContext) -> Section:
    """Everything that is said of the gap; without a diagnosis, how to get one."""
    found = context.diagnosed
    if found is None:
        text = (
            "This session was not diagnosed. calib diagnose SESSION tells where the gap between twin and robot lies, "
            "which effect that the twin leaves out makes it, and how far it shrinks with that effect; then run "
            "calib report SESSION again."
        )
        return Section("Sim-to-real gap", "gap", (Prose(text),))
    from diagnosis.sentences import sentences  # its package loads the twin

    plots = gap_plots(found, context.calibration.robot, context.session.markers)

    def of(*names: str) -> Plots:
        return Plots(tuple(plots[f"gap-{name}"] for name in names if f"gap-{name}" in plots))

    leads = tuple(Prose(_lead(text), lead=True) for text in sentences(found))
    where = (of("fish"), Prose(_how(found)), of("shares"))
    how_far: tuple[Block, ...] = (Prose(_NOT_HELD_OUT),)
    if found.gap.trials:
        how_far = (Prose(_shrinkage(found)), of("waterfall", "held-out"))
    if found.everything is not None and "gap-everything" in plots:
        how_far = (*how_far, Prose(_everything(found.everything)), of("everything"))
    loudest, forces = missing(found, context)
    parts = (
        Section("Which effect", "gap-which", (*_which(found), of("effects"))),
        Section("How far it shrinks", "gap-how-far", how_far),
        Section("The forces that are missing", "gap-missing", (loudest, of("forces"), forces)),
        Section("What to measure next", "gap-next", next_experiments(found)),
        Section("The evidence", "gap-evidence", evidence(found)),
    )
    return Section("Sim-to-real gap", "gap", (*leads, *where), _caveats(context, found), parts)


def _lead(text: str) -> Markup:
    """One of the three sentences, its question set apart."""
    question, _, answer = text.partition(": ")
    return Markup("<strong>{}?</strong> {}").format(question, answer[:1].upper() + answer[1:])


def _caveats(context: ReportContext, found: DiagnosisResult) -> tuple[str, ...]:
    told = []
    if (effort := context.diagnosis_effort) != "full":
        told.append(f"This diagnosis was made with effort {effort}.")
    if withheld := found.withheld_from_catalogue:
        told.append(f"Its catalogue lacked {listed([in_words(name) for name in withheld])}.")
    return tuple(told)


def _how(found: DiagnosisResult) -> str:
    evidence = found.evidence
    mean_square = evidence.squares / evidence.numbers
    return (
        "Twin and swims are compared by their features: forward speed, slip and turning, the frequency that the "
        "command leads to, mean and three harmonics of every marker, and how fast it slides along the fish; "
        f"{evidence.numbers} numbers in all, in standard deviations of tracking noise, hand-placed boxes, marker "
        "places and the twin’s own error. The nearest plain twin (published "
        f"geometry, five coefficients fitted to these numbers) leaves {shown(mean_square, 1)} in the mean of "
        "their squares, where noise would leave 1. It is not the twin of the calibration, which minimises a distance."
    )


def _which(found: DiagnosisResult) -> tuple[Block, ...]:
    blocks: list[Block] = [Prose(_VERDICTS[found.verdict])]
    if groups := found.groups:
        items = tuple(" or ".join(in_words(name) for name in group) for group in groups)
        title = "Together" if len(groups) > 1 else "Named" if len(groups[0]) == 1 else "One of these"
        blocks.append(Points(title, items))
    if found.verdict == "no_gap" and (chance := 1 - found.no_gap_probability) > _SUSPECT:
        blocks.append(Prose(_suspicion(found, chance)))
    if (rest := found.remainder) is not None:
        blocks.append(Prose(_remainder(rest, _added(found))))
    return tuple(blocks)


def _suspicion(found: DiagnosisResult, chance: float) -> str:
    names = list(found.chances.items())
    suspect = ""
    if names and not found.evidence.refuted:  # one that was refuted would be the first
        suspect = f", and the first suspect is {in_words(names[0][0])} ({shown(names[0][1], 2)})"
    return (
        f"It is a near miss: something is there with a probability of {shown(chance, 2)}{suspect}. "
        "One more swim would settle it."
    )


def _remainder(rest: Remainder, added: str) -> str:
    share, p_value = rest.share, rest.p_value
    if p_value >= _CLEAR:
        return f"With {added}, what remains of the fitted swims passes for noise (p = {shown(p_value, 2)})."
    return (
        f"With {added}, {whole_percent(share)} of the gap in the fitted swims remains, more than noise leaves "
        f"(p {'< 0.001' if p_value < 0.001 else f'= {shown(p_value, 3)}'}): something else is there too."
    )


def _everything(every: AllEffects) -> str:
    """Of the twin with all effects at once."""
    gap, strongest = every.gap, every.strengths[:_STRONGEST]
    told = [f"{in_words(each.effect)} ({in_words(each.parameter)} {shown(each.strength_sd, 1)})" for each in strongest]
    far = ""
    if not isnan(gap.shrinkage):
        far = f" With it {_by_how_much(gap.shrinkage)}"
        far += f" (95 % interval over the noise of these swims {_interval(gap)})." if gap.shrinkage_ci95 else "."
    ends = [f"{in_words(effect)} ({in_words(name)})" for effect, name in every.at_bound]
    bound = f" As strong as they may be: {listed(ends)}." if ends else ""
    return (
        "All effects at once, each a little: the fitted swims call for more than is named "
        f"(e^{shown(every.log_evidence_gained, 0)} times as probable so), without telling what. This twin has every "
        "effect of the catalogue, those that are not named as strong as is likeliest where priors are "
        f"{shown(every.share_of_priors, 2)} times as wide as described.{far} It claims no name; strongest in it, in "
        f"standard deviations of their priors, are {listed(told)}.{bound}{_attribution(every.attribution)}"
    )


def _attribution(found: Attribution | None) -> str:
    """To which groups of effects the joint fit owes its forecasts."""
    if found is None:
        return ""
    shares = [f"{name} {shown(each.gap, 2)} ({spanned(*each.gap_ci90, _two)})" for name, each in found.shares.items()]
    speeds = [
        f"{name} {in_mm(each.speed, signed=True)} ({spanned(*each.speed_ci90, in_mm)})"
        for name, each in found.shares.items()
    ]
    fewest = listed(found.smallest) or "no group"
    speed = (
        f"Of the speed error alone {listed(found.smallest_speed) or 'no group'} would do as well."
        if found.of_speed
        else "The change of the speed error is not attributable with these trials: every interval holds zero."
    )
    return (
        f" Shares of this gain by groups of effects (Shapley, with 90 % intervals): {listed(shares)}; of the decrease "
        f"of the mean speed error, in mm/s: {listed(speeds)}. The fewest groups that forecast as well within one "
        f"standard error over trials: {fewest}. {speed}"
    )


def _two(value: float) -> str:
    return shown(value, 2)


def _by_how_much(shrinkage: float) -> str:
    return f"the held-out gap {'grows' if shrinkage < 0 else 'shrinks'} by {whole_percent(abs(shrinkage))}"


def _interval(gap: GapSize) -> str:
    """Of a shrinkage, or of how far a gap grows."""
    sign = -1 if gap.shrinkage < 0 else 1
    return " to ".join(whole_percent(end) for end in sorted(sign * end for end in gap.shrinkage_ci95 or ()))


def _added(found: DiagnosisResult) -> str:
    return listed([in_words(name) for name in found.effect_parameters])


def _shrinkage(found: DiagnosisResult) -> str:
    gap = found.gap
    if not found.effect_parameters:
        return "Nothing was added to the twin; this is the gap that stands."
    added = _added(found)
    if isnan(gap.shrinkage):
        return f"The plain twin leaves no more of the held-out swims than noise: there is no gap for {added} to shrink."
    told = f"With {added}, both twins refitted to the fitted swims, {_by_how_much(gap.shrinkage)}"
    if gap.shrinkage_ci95 is None:
        told += "."
        why = " How surely is not known: twins a little off what was fitted diverge."
    else:
        told += f" (95 % interval {_interval(gap)})."
        why = " The interval is over swims, their noise, how large that is, and how far what was fitted may be off."
    if gap.shrinkage > 1:
        why += " More than all of it is gone, for less is left than noise was taken to leave."
    worse = " What explains the fitted swims does not carry over." if gap.shrinkage < 0 else ""
    return told + why + worse + _controls(gap.controls)


def _controls(told: Controls | None) -> str:
    """What the gap would shrink by anyhow."""
    if told is None or told.carried_over is None:
        return ""
    text = ""
    if told.with_placebo is not None:
        text += (
            f" With {in_words(told.placebo or '')} in its place, which the evidence speaks against, it would be "
            f"{whole_percent(told.with_placebo)};"
        )
    return (
        f"{text or ' It would be'} {whole_percent(told.carried_over)} with what is left of the fitted swims carried "
        "over to these, whatever its cause."
    )
