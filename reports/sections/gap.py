"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with that."""

from collections.abc import Sequence
from math import isnan

from markupsafe import Markup

from diagnosis.result import Controls, GapSize, Remainder
from reports.blocks import Block, Plot, Plots, Points, Prose, Section
from reports.context import ReportContext
from reports.diagnosed import Diagnosed
from reports.figures.gap_effects import gap_effects_figure
from reports.figures.gap_fish import gap_fish_figure
from reports.figures.gap_held_out import gap_held_out_figure
from reports.figures.gap_separation import APART, gap_separation_figure, told_apart
from reports.figures.gap_shares import gap_shares_figure
from reports.figures.gap_slides import gap_slides_figure, slides
from reports.figures.gap_waterfall import gap_waterfall_figure
from reports.numbers import in_words, listed, shown, whole_percent
from reports.sections.gap_evidence import evidence, missing, next_experiments
from reports.svg import inline_svg

_VERDICTS = {
    "named": "Verdict: named. The data leave no other name of the catalogue.",
    "inseparable": "Verdict: inseparable. These trials cannot tell the names of a group apart; one of each is enough.",
    "unexplained": "Verdict: unexplained. There is a gap, and no name of the catalogue can be said of it.",
    "no_gap": "Verdict: no gap. These trials do not make it sure enough that there is anything but noise, misplaced "
    "boxes and the twin’s own error.",
}
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

    leads = tuple(Prose(_lead(text), lead=True) for text in sentences(found.data))
    parts = (
        Section("Which effect", "gap-which", _which(found)),
        Section("How far it shrinks", "gap-how-far", _how_far(found)),
        Section("The forces that are missing", "gap-missing", missing(found, context)),
        Section("What to measure next", "gap-next", next_experiments(found)),
        Section("The evidence", "gap-evidence", evidence(found)),
    )
    return Section("Sim-to-real gap", "gap", (*leads, *_where(found, context)), _caveats(found), parts)


def _lead(text: str) -> Markup:
    """One of the three sentences, its question set apart."""
    question, _, answer = text.partition(": ")
    return Markup("<strong>{}?</strong> {}").format(question, answer[:1].upper() + answer[1:])


def _caveats(found: Diagnosed) -> tuple[str, ...]:
    told = []
    if found.effort != "full":
        told.append(f"This diagnosis was made with effort {found.effort}.")
    if withheld := found.data.withheld_from_catalogue:
        told.append(f"Its catalogue lacked {listed([in_words(name) for name in withheld])}.")
    return tuple(told)


def _where(found: Diagnosed, context: ReportContext) -> tuple[Block, ...]:
    robot, markers = context.calibration.robot, context.session.markers
    fish = Plot(
        inline_svg(gap_fish_figure(found, robot, markers), "gap-fish", "The robot with its gap painted on it"),
        "gap-fish",
        "Red is where the gap comes from: each part is as full of colour as its stage has of what the nearest twin "
        "leaves. Blue is where it shows: each disc is as large as the share of that marker, of the speed, of the "
        "course (slip and turning) or of the beat’s frequency.",
        wide=True,
        scrolls=True,
    )
    shares = Plot(
        inline_svg(gap_shares_figure(found), "gap-shares", "Shares by stage, trial, band and axis"),
        "gap-shares",
        "The same by numbers; the bars of each panel add up to 100 %. By stage, stages that can do alike share what "
        "they could both do: the tick is what each would take if it were alone, and the truth may lie anywhere "
        "along the line. Speed, course and frequency have neither axis nor band.",
        wide=True,
        scrolls=True,
    )
    return Plots((fish,)), Prose(_how(found)), Plots((shares,)), *_slides(found)


def _slides(found: Diagnosed) -> tuple[Block, ...]:
    """Where markers slide along the fish."""
    if not slides(found):
        return ()
    plot = Plot(
        inline_svg(gap_slides_figure(found), "gap-slides", "How fast each marker slides along the fish"),
        "gap-slides",
        "How fast each marker slides forward along the fish, beside the path of all and beside the twin. Nothing that "
        "swims does that: a camera that is near (in proportion to the speed and to how high a marker is), a lens, or "
        "boxes that slide (alike in all trials, at any speed).",
        wide=True,
        scrolls=True,
    )
    return (Plots((plot,)),)


def _how(found: Diagnosed) -> str:
    evidence = found.data.evidence
    return (
        "Twin and swims are compared by their gaits: forward speed, slip and turning, the frequency that the command "
        "leads to, mean and three harmonics of every marker, and how fast it slides along the fish; "
        f"{evidence.numbers} numbers in all, in standard deviations of tracking noise, hand-placed boxes, marker "
        "places and the twin’s own error. The nearest plain twin (published "
        f"geometry, five coefficients fitted to these numbers) leaves {shown(_mean_square(found), 1)} in the mean of "
        "their squares, where noise would leave 1. It is not the twin of the calibration, which minimises a distance."
    )


def _mean_square(found: Diagnosed) -> float:
    return found.data.evidence.squares / found.data.evidence.numbers


def _which(found: Diagnosed) -> tuple[Block, ...]:
    figure = Plot(
        inline_svg(gap_effects_figure(found), "gap-effects", "Probability of each effect"),
        "gap-effects",
        "How likely each effect is, once these swims are seen. Blue are those that are named: the "
        "gap has to look like one of a group with 0.9, and one of the group to be likelier there than not, for it may "
        "be something that only looks like it. Several may be present at once, so the bars need not add up to 1.",
    )
    blocks: list[Block] = [Prose(_VERDICTS[found.verdict])]
    if groups := found.data.groups:
        items = tuple(" or ".join(in_words(name) for name in group) for group in groups)
        blocks.append(Points(_title(groups), items))
    if found.verdict == "no_gap" and (chance := 1 - found.data.no_gap_probability) > _SUSPECT:
        blocks.append(Prose(_suspicion(found, chance)))
    if (rest := found.data.remainder) is not None:
        blocks.append(Prose(_remainder(rest, _added(found))))
    return (*blocks, Plots((figure, *_told_apart(found))))


def _told_apart(found: Diagnosed) -> tuple[Plot, ...]:
    """The matrix of separations, where these swims would have two effects at all."""
    if len(told_apart(found)[0]) < 2:
        return ()
    matrix = Plot(
        inline_svg(gap_separation_figure(found), "gap-separation", "Which effects can be told apart"),
        "gap-separation",
        "How far the effect of a row, as strong as these swims would have it, is from the nearest that the effect "
        f"of a column can do, coefficients refitted, in standard deviations. Below {APART} one is taken for the other "
        "in more than one of twenty sessions. That counts with right forms and with nothing else amiss: names of one "
        "group, which stay confused although these swims should tell them apart, say that it is not so. Bold: named.",
        tall=True,
    )
    return (matrix,)


def _suspicion(found: Diagnosed, chance: float) -> str:
    names = list(found.data.chances.items())
    suspect = ""
    if names and not found.data.evidence.refuted:  # one that was refuted would be the first
        suspect = f", and the first suspect is {in_words(names[0][0])} ({shown(names[0][1], 2)})"
    return (
        f"It is a near miss: something is there with a probability of {shown(chance, 2)}{suspect}. "
        "One more swim would settle it."
    )


def _title(groups: Sequence[Sequence[str]]) -> str:
    if len(groups) > 1:
        return "Together"
    return "Named" if len(groups[0]) == 1 else "One of these"


def _remainder(rest: Remainder, added: str) -> str:
    share, p_value = rest.share, rest.p_value
    if p_value >= _CLEAR:
        return f"With {added}, what remains of the fitted swims passes for noise (p = {shown(p_value, 2)})."
    return (
        f"With {added}, {whole_percent(share)} of the gap in the fitted swims remains, more than noise leaves "
        f"(p {'< 0.001' if p_value < 0.001 else f'= {shown(p_value, 3)}'}): something else is there too."
    )


def _how_far(found: Diagnosed) -> tuple[Block, ...]:
    if not found.held_out:
        text = (
            "No swim was held out, so nobody knows how far the gap shrinks on swims that were not fitted. Give one or "
            'more trials the role "holdout" in session.toml and diagnose again.'
        )
        return (Prose(text),)
    waterfall = Plot(
        inline_svg(gap_waterfall_figure(found), "gap-waterfall", "The held-out gap before and after"),
        "gap-waterfall",
        "Mean squared residual of the held-out swims in units of what disturbs them: what the plain twin leaves, what "
        "adding the effects takes away, what is left above noise, and noise itself.",
    )
    swims = Plot(
        inline_svg(
            gap_held_out_figure(found.data.gap, bool(found.refitted)),
            "gap-held-out",
            "Each held-out swim before and after",
        ),
        "gap-held-out",
        "The same swims in millimetres and mm/s, run ahead by the twin alone, before and after. The dashed "
        "line is the distance that tracking noise alone would make.",
    )
    return Prose(_shrinkage(found)), Plots((waterfall, swims)), *_everything(found)


def _everything(found: Diagnosed) -> tuple[Block, ...]:
    """The twin with all effects at once."""
    every = found.everything
    if every is None:
        return ()
    gap, strongest = every.gap, every.strengths[:_STRONGEST]
    told = [f"{in_words(each.effect)} ({in_words(each.parameter)} {shown(each.strength_sd, 1)})" for each in strongest]
    far = ""
    if not isnan(gap.shrinkage):
        far = f" With it {_by_how_much(gap.shrinkage)}"
        far += f" (95 % interval over the noise of these swims {_interval(gap)})." if gap.shrinkage_ci95 else "."
    ends = [f"{in_words(effect)} ({in_words(name)})" for effect, name in every.at_bound]
    bound = f" As strong as they may be: {listed(ends)}." if ends else ""
    text = (
        "All effects at once, each a little: the fitted swims call for more than is named "
        f"(e^{shown(every.log_evidence_gained, 0)} times as probable so), without telling what. This twin has every "
        "effect of the catalogue, those that are not named as strong as is likeliest where priors are "
        f"{shown(every.share_of_priors, 2)} times as wide as described.{far} It claims no name; strongest in it, in "
        f"standard deviations of their priors, are {listed(told)}.{bound}"
    )
    swims = Plot(
        inline_svg(gap_held_out_figure(gap, True), "gap-everything", "Each held-out swim with all effects at once"),
        "gap-everything",
        "Each held-out swim without effects and with all of them, fitted to the fitted swims alone.",
    )
    return Prose(text), Plots((swims,))


def _by_how_much(shrinkage: float) -> str:
    return f"the held-out gap {'grows' if shrinkage < 0 else 'shrinks'} by {whole_percent(abs(shrinkage))}"


def _interval(gap: GapSize) -> str:
    """Of a shrinkage, or of how far a gap grows."""
    sign = -1 if gap.shrinkage < 0 else 1
    return " to ".join(whole_percent(end) for end in sorted(sign * end for end in gap.shrinkage_ci95 or ()))


def _added(found: Diagnosed) -> str:
    return listed([in_words(name) for name in found.refitted])


def _shrinkage(found: Diagnosed) -> str:
    gap = found.data.gap
    if not found.refitted:
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
        why = (
            " The interval is over the noise of these swims, how large it is, and how far what was fitted may be off; "
            "other swims may fare otherwise."
        )
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
