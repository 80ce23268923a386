"""Section on the sim-to-real gap: where it lies, which effect makes it, how far it shrinks, and the evidence for it."""

from collections.abc import Mapping, Sequence
from math import isnan
from pathlib import Path

from markupsafe import Markup

from diagnosis.result import (
    AllEffects,
    DiagnosisResult,
    FreeDecay,
    MissingForces,
    Remainder,
    parameters_of,
)
from diagnosis.sentences import near_miss
from reports.context import ReportContext
from reports.gap_figures import (
    FORCES,
    LEAST_CLEAR,
    LEAST_LIKE,
    MILLI,
    Likeness,
    force_name,
    gap_effects_figure,
    gap_fish_figure,
    gap_forces_figure,
    gap_held_out_figure,
    gap_shares_figure,
    likenesses,
    seen,
)
from reports.page import Block, Plot, Plots, Points, Prose, Section, Table, table_head
from reports.words import (
    MISSING,
    MORE_THAN_NOISE,
    by_how_much,
    counted,
    gap_sentences,
    in_words,
    listed,
    of_its_size,
    parameter_in_words,
    shown,
    significant,
    whole_percent,
)
from swimcal.effects.catalogue import catalogue
from swimcal.robot import RobotSpec

# Figures
_CAPTIONS = {
    "gap-fish": "Red: parts where the gap comes from. Blue: where it shows; the size of a disc is the share of that "
    "marker, of the speed, of the course or of the beat frequency.",
    "gap-shares": "The same in numbers. Line: all ways to split what several stages could cause; tick: what the stage "
    "could explain alone.",
    "gap-effects": "Probability of each effect. Blue: named. Several may be present at once.",
    "gap-held-out": "Errors of the held-out trials, forecast by the twin without and with the effects. Dashed: what "
    "tracking noise alone would give.",
    "gap-everything": "Each held-out trial without effects and with all of them, fitted to the fit trials alone.",
    "gap-forces": "Forces and torques that the plain twin lacks over a beat, a line a trial, with bands of two "
    "standard deviations.",
}

# Tables of the evidence
FORCE = table_head("missing | root mean square [] | significant [% of beat] | goes with | correlation []")
SET = table_head("hypothesis | probability []")
PLACE = table_head("place | in all trials | probability []")
DECAY = table_head("free decay | stiffness over mass [%] | damping over mass [%] | used")
_PLACES = 5  # number of places that are shown, the likeliest
PARAMETER = table_head("effect | parameter | value [] | 95 % interval [] | unit")
VISIBLE = table_head("effect | parameter | least change that shows [] | unit")
SIDE_BY_SIDE = table_head("swim | reference [mm/s] | this session [mm/s] | difference [%]")
NEXT = table_head("what to do | separates | error after it [%]")

# The section
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
_SAME_HZ = 0.1  # relative difference of frequencies up to which two swims are shown side by side
_STRONGEST = 4  # number of parameters that are listed


def gap_plots(found: DiagnosisResult, robot: RobotSpec, markers: tuple[str, ...]) -> dict[str, Plot]:
    """Draw the figures of a diagnosis in which there is something to see.

    Args:
        found: the diagnosis.
        robot: the robot as described.
        markers: names of the tracked markers.
    """
    figures = {"gap-fish": gap_fish_figure(found, robot, markers), "gap-shares": gap_shares_figure(found)}
    figures["gap-effects"] = gap_effects_figure(found)
    if found.gap.trials:
        figures["gap-held-out"] = gap_held_out_figure(found.gap, bool(found.effect_parameters))
    if found.everything is not None and found.everything.gap.evaluated_on:
        figures["gap-everything"] = gap_held_out_figure(found.everything.gap, True)
    if seen(found.missing_forces):
        figures["gap-forces"] = gap_forces_figure(found.missing_forces)
    return {name: Plot(figure, name, _CAPTIONS[name]) for name, figure in figures.items()}


def missing(found: DiagnosisResult, context: ReportContext) -> tuple[Prose, tuple[Table, ...]]:
    """Describe the most significant missing force, and list all with the motion that each goes with.

    No table of zeros.
    """
    forces = found.missing_forces
    like = likenesses(forces, context.calibration.trials, context.calibration.robot)
    rows = tuple(_force_row(forces, place, like) for place in seen(forces))
    caption = (
        "Size of each missing force, the share of the beat in which it differs from zero, and the motion of that joint "
        "it goes with: deflection (a spring), speed (a damper), speed squared (drag) or acceleration (mass)."
    )
    return Prose(_loudest(found, forces, like)), (Table(caption, FORCE, rows, folded=True),) if rows else ()


def _loudest(found: DiagnosisResult, forces: MissingForces, like: Mapping[str, Likeness]) -> str:
    clear = forces.clear
    if not (clear > 0.5).any():
        return "No missing force differs significantly from zero over half of the beat."
    place = max(range(len(forces.joints)), key=lambda i: (clear[i], forces.size[i]))
    joint = forces.joints[place]
    size, likeness = _format_size(forces, place), _describe_likeness(like.get(joint))
    text = f"The most significant is the {force_name(joint)}: {size}{likeness}."
    if found.verdict == "unexplained":
        text += " It is a lead to the effect that the catalogue lacks."
    elif found.verdict == "no_gap":
        text += " With this verdict noise and boxes can explain it."
    return text


def _describe_likeness(like: Likeness | None) -> str:
    if like is None or abs(like.correlation) < LEAST_LIKE:
        return ", and it correlates with no motion of that joint"
    return f", and it correlates with the {' or '.join(like.motions)} there (correlation {shown(like.correlation, 2)})"


def _format_size(forces: MissingForces, place: int) -> str:
    unit = "mN" if forces.joints[place] in FORCES else "mN m"
    return f"{of_its_size(MILLI * float(forces.size[place]))} {unit}"


def _force_row(forces: MissingForces, place: int, like: Mapping[str, Likeness]) -> tuple[str, ...]:
    joint = forces.joints[place]
    own = like.get(joint)
    clear = float(forces.clear[place])
    significantly = own is not None and clear >= LEAST_CLEAR
    goes = " or ".join(own.motions) if own and significantly and abs(own.correlation) >= LEAST_LIKE else MISSING
    return (
        force_name(joint),
        _format_size(forces, place),
        shown(100 * clear, 0),
        goes,
        shown(own.correlation, 2, signed=True) if own and significantly else MISSING,
    )


def evidence(found: DiagnosisResult) -> tuple[Block, ...]:
    """List the hypotheses with their probabilities, and the effects as strong as they were fitted."""
    blocks: list[Block] = [_explanations(found)]
    if rows := _list_elsewhere(found):
        caption = "Where an effect outside the catalogue may act, alike or differently in all trials."
        blocks.append(Table(caption, PLACE, rows, folded=True))
    if decays := found.free_decays:
        blocks.append(_decays(decays))
    if found.effect_parameters:
        blocks.append(_parameters(found))
    return tuple(blocks)


def _decays(decays: Sequence[FreeDecay]) -> Table:
    rows = []
    for decay in decays:
        stiffness = _format_with_error(decay.stiffness_over_mass, decay.stiffness_over_mass_se)
        damping = _format_with_error(decay.damping_over_mass, decay.damping_over_mass_se)
        rows.append((decay.trial, stiffness, damping, f"no: {decay.not_used}" if decay.not_used else "yes"))
    caption = (
        "Hinges in the free decays, relative to the robot as described; within 3 % in stiffness and 5 % in damping it "
        "counts as described."
    )
    return Table(caption, DECAY, tuple(rows), folded=True)


def _format_with_error(off: float | None, se: float | None) -> str:
    return MISSING if off is None or se is None else f"{shown(100 * off, 1, signed=True)} ± {shown(100 * se, 1)}"


def _explanations(found: DiagnosisResult) -> Table:
    rows = []
    for each in found.evidence.sets:
        names = [in_words(name) for name in each.effects]
        other = ["another effect"] if each.something_else else []
        rows.append((" + ".join([*names, *other]) or "no effect", shown(each.probability, 3)))
    caption = (
        "The most probable hypotheses. Each effect stands for itself or a look-alike, so its own probability is lower "
        "than the sum of its rows; “another effect” is outside the catalogue."
    )
    return Table(caption, SET, tuple(rows), folded=True)


def _list_elsewhere(found: DiagnosisResult) -> tuple[tuple[str, ...], ...]:
    places = [
        (each.probability, in_words(each.place), "the same" if each.same_in_all_trials else "different")
        for each in found.evidence.elsewhere
    ]
    likeliest = sorted(places, reverse=True)[:_PLACES]
    return tuple((place, trials, shown(chance, 3)) for chance, place, trials in likeliest)


def _parameters(found: DiagnosisResult) -> Table:
    rows = []
    for effect in found.effect_parameters:
        fitted = parameters_of(found.effect_parameters, effect)
        for name, own in fitted.items():
            told = parameter_in_words(name, own)
            bound = ", at its bound" if own.at_bound else ""
            rows.append((in_words(effect), told.name, told.value, f"{told.interval}{bound}", told.unit or "–"))
    known = {name: effect.physics for name, effect in catalogue().items()}
    named = ((name, known.get(name, "an effect of the user’s own.")) for name in found.effect_parameters)
    physics = " ".join(f"{in_words(name)}: {what}" for name, what in named)
    caption = f"Parameters of the effects, refitted to the fit trials; zero is the plain twin. {physics}"
    return Table(caption.strip(), PARAMETER, tuple(rows))


def next_experiments(found: DiagnosisResult) -> tuple[Block, ...]:
    """List the experiments, the most informative first."""
    experiments = found.next_experiments
    if not experiments:
        return ()
    rows = tuple(
        (each.describe, " and ".join(map(in_words, each.separates)), whole_percent(each.expected_error)[:-2])
        for each in experiments
    )
    caption = (
        "Experiments by how well they separate effects that these trials confuse: the expected probability to take one "
        "for the other afterwards."
    )
    return (Table(caption, NEXT, rows),)


def build_gap(context: ReportContext) -> Section:
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
        how_far = (in_short, Prose(_shrinkage(found)), of("held-out"))
    if found.everything is not None and "gap-everything" in plots:
        how_far = (*how_far, Prose(_everything(found.everything)), of("everything"))
    compared = (_compared(found, context),) if found.reference is not None else ()
    loudest, forces = missing(found, context)
    experiments = next_experiments(found)
    next_parts = (Section("What to measure next", "gap-next", experiments),) if experiments else ()
    parts = (
        *compared,
        Section("Where it lies", "gap-where", (where, of("fish"), Prose(_how(found)), of("shares"))),
        Section("Which effect", "gap-which", (which, *_which(found), of("effects"))),
        Section("How far it shrinks", "gap-how-far", how_far),
        *next_parts,
        Section("The forces that are missing", "gap-missing", (loudest, of("forces"), *forces)),
        Section("The evidence", "gap-evidence", evidence(found)),
    )
    title = "The sim-to-real gap" if found.reference is None else "What changed since the reference"
    return Section(title, "gap", (), _caveats(context), parts)


def _compared(found: DiagnosisResult, context: ReportContext) -> Section:
    """Show the swims of both sessions side by side, and what a change would have to be to show."""
    reference = found.reference
    assert reference is not None, "a section of a comparison"
    own = [trial.measured for trial in context.calibration.trials]
    rows = []
    for name, (hz, speed) in reference.speeds.items():
        near = min(own, key=lambda trial: abs(trial.frequency.hz - hz), default=None)
        if near is not None and abs(near.frequency.hz / hz - 1) < _SAME_HZ:
            differs = shown(100 * (near.speed / speed - 1), 1, signed=True) if speed else MISSING
            rows.append((f"{name} ({shown(hz, 2)} Hz)", shown(1000 * speed), shown(1000 * near.speed), differs))
    side = (
        "Forward speed of both sessions at about the same beat frequency. The effects below act on this session alone."
    )
    least = "The least change that these trials would show: five standard deviations, all else the same."
    seen = tuple(
        (in_words(effect), in_words(each.parameter), significant(each.value, 2), {"1": "–"}.get(each.unit, each.unit))
        for effect, each in sorted(reference.visible.items())
        if each.within_bounds
    )
    text = (
        f"The reference is {Path(reference.session).name}, with {counted(len(reference.swims), 'swim')}. Its launches "
        f"differ {shown(reference.launch_scatter)} times as much as is usual; whatever both sessions share, the error "
        "of the water first of all, cancels."
    )
    blocks: list[Block] = [Prose(text)]
    if rows:
        blocks.append(Table(side, SIDE_BY_SIDE, tuple(rows)))
    if seen:
        blocks.append(Table(least, VISIBLE, seen, folded=True))
    return Section("Side by side", "gap-compared", tuple(blocks))


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
        return "No effect is named, so nothing is added to the twin; this is its gap."
    added = _list_added(found)
    if isnan(gap.shrinkage):
        return f"The held-out trials leave no more than noise and the twin's own error: no gap for {added} to shrink."
    text = f"With {added}, the held-out gap {by_how_much(gap)}."
    why = (
        " Both twins were refitted to the fit trials. The gap is the mean square of what is left beyond noise: at "
        "100 % noise alone is left, while distances in mm shrink by less. The interval covers trials, noise and fitted "
        "parameters."
    )
    if gap.shrinkage_ci95 is None:
        why = " The interval is not known: twins near the fitted one diverge."
    if gap.shrinkage > 1:
        why += " Above 100 %: the residual is smaller than the assumed noise."
    worse = " What explains the fit trials does not help the held-out ones." if gap.shrinkage < 0 else ""
    return text + why + worse
