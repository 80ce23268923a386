"""The section on the sim-to-real gap: where it lies, which effect makes it, how far it shrinks with that."""

from math import isnan

from markupsafe import Markup

from diagnosis.result import AllEffects, DiagnosisResult, Remainder
from diagnosis.sentences import near_miss
from reports.blocks import Block, Plots, Points, Prose, Section
from reports.context import ReportContext
from reports.gap_words import MORE_THAN_NOISE, by_how_much, gap_sentences
from reports.numbers import in_words, listed, shown, whole_percent
from reports.sections.gap_evidence import evidence, missing, next_experiments
from reports.sections.gap_plots import gap_plots

_VERDICTS = {
    "named": "Verdict: named. No other effect of the catalogue explains the data.",
    "inseparable": "Verdict: inseparable. These trials cannot separate the effects of a group; one of each is enough.",
    "unexplained": "Verdict: unexplained. There is a gap, and no effect of the catalogue explains it.",
    "no_gap": "Verdict: no gap. Noise, misplaced boxes and the twin’s own error are enough to explain the residual.",
}
_NOT_HELD_OUT = (
    "No trial is held out, so how far the gap shrinks on trials that were not fitted is not known. Give one or more "
    'trials the role "holdout" in session.toml and diagnose again.'
)
_STRONGEST = 4  # number of parameters that are listed


def build(context: ReportContext) -> Section:
    """Build the section; without a diagnosis it says how to get one."""
    found = context.diagnosed
    if found is None:
        text = (
            "This session was not diagnosed. Run calib diagnose SESSION, then calib report SESSION: it finds "
            "where the gap between twin and robot lies, which unmodelled effect causes it, and how far it shrinks with "
            "that effect."
        )
        if file := context.damaged.get("diagnosis"):
            text = f"results/{file} is damaged or cut short; calib diagnose SESSION makes it again."
        return Section("The sim-to-real gap", "gap", (Prose(text),))
    plots = gap_plots(found, context.calibration.robot, context.session.markers)

    def of(*names: str) -> Plots:
        return Plots(tuple(plots[f"gap-{name}"] for name in names if f"gap-{name}" in plots))

    where, which, in_short = (Prose(_lead(text)) for text in gap_sentences(found))
    how_far: tuple[Block, ...] = (in_short, Prose(_NOT_HELD_OUT))
    if found.gap.trials:
        how_far = (in_short, Prose(_shrinkage(found)), of("waterfall", "held-out"))
    if found.everything is not None and "gap-everything" in plots:
        how_far = (*how_far, Prose(_everything(found.everything)), of("everything"))
    loudest, forces = missing(found, context)
    experiments = next_experiments(found)
    next_parts = (Section("What to measure next", "gap-next", experiments),) if experiments else ()
    parts = (
        Section("Where it lies", "gap-where", (where, of("fish"), Prose(_how(found)), of("shares"))),
        Section("Which effect", "gap-which", (which, *_which(found), of("effects"))),
        Section("How far it shrinks", "gap-how-far", how_far),
        *next_parts,
        Section("The forces that are missing", "gap-missing", (loudest, of("forces"), *forces)),
        Section("The evidence", "gap-evidence", evidence(found)),
    )
    return Section("The sim-to-real gap", "gap", (), _caveats(context), parts)


def _lead(text: str) -> Markup:
    """Set the question of one of the three sentences apart from its answer."""
    question, _, answer = text.partition(": ")
    return Markup("<strong>{}?</strong> {}").format(question, answer[:1].upper() + answer[1:])


def _caveats(context: ReportContext) -> tuple[str, ...]:
    effort = context.diagnosis_effort
    return () if effort == "full" else (f"This diagnosis was made with effort {effort}.",)


def _how(found: DiagnosisResult) -> str:
    evidence = found.evidence
    mean_square = evidence.squares / evidence.numbers
    return (
        f"The residual of {evidence.numbers} numbers (speed, course, frequency, harmonics of every marker) has a mean "
        f"square of {shown(mean_square, 1)} over noise, misplaced boxes and the twin’s own error; these alone give 1."
    )


def _which(found: DiagnosisResult) -> tuple[Block, ...]:
    blocks: list[Block] = [Prose(_VERDICTS[found.verdict])]
    if (groups := found.groups) and len(found.effects) > 1:
        items = tuple(" or ".join(in_words(name) for name in group) for group in groups)
        title = "Together" if len(groups) > 1 else "One of these"
        blocks.append(Points(title, items))
    if missed := near_miss(found):
        blocks.append(Prose(missed))
    if (rest := found.remainder) is not None:
        blocks.append(Prose(_remainder(rest, _list_added(found))))
    return tuple(blocks)


def _remainder(rest: Remainder, added: str) -> str:
    share, p_value = rest.share, rest.p_value
    if p_value >= MORE_THAN_NOISE:
        return f"With {added}, the residual of the fitted trials is no more than noise (p = {shown(p_value, 2)})."
    return (
        f"With {added}, {whole_percent(share)} of the gap in the fitted trials remains, more than noise explains "
        f"(p {'< 0.001' if p_value < 0.001 else f'= {shown(p_value, 3)}'}): something else is missing too."
    )


def _everything(every: AllEffects) -> str:
    gap, strongest = every.gap, every.strengths[:_STRONGEST]
    listing = [f"{in_words(s.effect)} ({in_words(s.parameter)} {shown(s.strength_sd, 1)})" for s in strongest]
    far = ""
    if not isnan(gap.shrinkage):
        far = f" With it the held-out gap {by_how_much(gap, 'over the noise of these trials ')}."
    ends = [f"{in_words(effect)} ({in_words(name)})" for effect, name in every.at_bound]
    bound = f" At a bound: {listed(ends)}." if ends else ""
    return (
        "All effects at once (joint shrinkage fit): the fitted trials support more than is named, by a log Bayes "
        f"factor of {shown(every.log_evidence_gained, 0)}, but do not identify what. This twin has every effect of the "
        "catalogue; the unnamed ones are at their most probable size, with priors "
        f"{shown(every.share_of_priors, 2)} times as wide as in the catalogue.{far} It names no cause. The largest, in "
        f"standard deviations of their priors: {listed(listing)}.{bound}"
    )


def _list_added(found: DiagnosisResult) -> str:
    return listed([in_words(name) for name in found.effect_parameters])


def _shrinkage(found: DiagnosisResult) -> str:
    gap = found.gap
    if not found.effect_parameters:
        return "Nothing was added to the twin; this is its gap."
    added = _list_added(found)
    if isnan(gap.shrinkage):
        return f"The residual of the held-out trials is no more than noise: there is no gap for {added} to shrink."
    text = f"With {added}, the held-out gap {by_how_much(gap)}."
    why = " Both twins were refitted to the fit trials. The interval covers trials, noise and fitted parameters."
    if gap.shrinkage_ci95 is None:
        why = " The interval is not known: twins near the fitted one diverge."
    if gap.shrinkage > 1:
        why += " Above 100 %: the residual is smaller than the assumed noise."
    worse = " What explains the fit trials does not help the held-out ones." if gap.shrinkage < 0 else ""
    return text + why + worse
