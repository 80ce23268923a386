"""The evidence of a diagnosis: missing forces, hypotheses and refits; and what to measure next."""

from collections.abc import Mapping, Sequence

from diagnosis.result import DiagnosisResult, FittedParameter, FreeDecay, parameters_of
from reports.blocks import Block, Prose, Table, table_head
from reports.context import ReportContext
from reports.figures.gap_forces import MILLI
from reports.missing_forces import (
    FORCES,
    LEAST_CLEAR,
    LEAST_LIKE,
    Likeness,
    MissingForces,
    force_name,
    likenesses,
    seen,
)
from reports.numbers import MISSING, in_words, of_its_size, shown, significant, spanned, whole_percent
from swimmer.effects import catalogue

FORCE = table_head("missing | root mean square [] | significant [% of beat] | goes with | correlation []")
SET = table_head("hypothesis | probability []")
PLACE = table_head("place | in all trials | probability []")
DECAY = table_head("free decay | stiffness over mass [%] | damping over mass [%] | used")
_PLACES = 5  # number of places that are shown, the likeliest
PARAMETER = table_head("effect | parameter | value [] | 95 % interval [] | unit")
NEXT = table_head("what to do | separates | error after it [%]")


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
        "The most probable hypotheses. An effect stands for itself or a look-alike; “another effect” is outside the "
        "catalogue."
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
        rows += [(in_words(effect), in_words(name), *_format_fitted(own)) for name, own in fitted.items()]
    known = {name: effect.physics for name, effect in catalogue().items()}
    named = ((name, known.get(name, "an effect of the user’s own.")) for name in found.effect_parameters)
    physics = " ".join(f"{in_words(name)}: {what}" for name, what in named)
    caption = f"Parameters of the effects, refitted to the fit trials; zero is the plain twin. {physics}"
    return Table(caption.strip(), PARAMETER, tuple(rows))


def _format_fitted(own: FittedParameter) -> tuple[str, str, str]:
    low, high = own.ci95
    unit = {"1": "–"}.get(own.unit, own.unit)
    bound = ", at its bound" if own.at_bound else ""
    return significant(own.value, 3), f"{spanned(low, high)}{bound}", unit


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
