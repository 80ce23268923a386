"""What the diagnosis of the gap rests on: missing forces, explanations, refits; and what to measure next."""

from collections.abc import Mapping, Sequence

from diagnosis.result import DiagnosisResult, FittedParameter, FreeDecay, parameters_of
from reports.blocks import Block, Prose, Table, table_head
from reports.context import ReportContext
from reports.figures.gap_forces import MILLI
from reports.missing_forces import FORCES, LEAST_CLEAR, LEAST_LIKE, Likeness, MissingForces, force_name, likenesses
from reports.numbers import MISSING, in_words, of_its_size, shown, significant, spanned, whole_percent
from swimmer.effects import catalogue

FORCE = table_head("missing | root mean square [] | clear of zero [% of beat] | goes with | correlation []")
SET = table_head("explanation | probability []")
PLACE = table_head("place | in all trials | probability []")
DECAY = table_head("free decay | stiffness over mass [%] | damping over mass [%] | used")
_PLACES = 5  # that are shown, the likeliest
_LEAST_BESIDE = 0.01  # probability
PARAMETER = table_head("effect | parameter | value [] | 95 % interval [] | unit")
NEXT = table_head("what to do | tells apart | error left [%]")


def missing(found: DiagnosisResult, context: ReportContext) -> tuple[Prose, Table]:
    """Which of the missing forces stands out, and what each goes with."""
    forces = found.missing_forces
    like = likenesses(forces, context.calibration.trials, context.calibration.robot)
    rows = tuple(_force_row(forces, place, like) for place in range(len(forces.joints)))
    caption = (
        "Size of each missing force over all fitted swims, and the motion of that joint in the calibrated twin that it "
        "goes with: deflection (as a spring), speed (a damper), speed squared (drag) or acceleration (mass). A "
        f"correlation below {LEAST_LIKE} names none, nor does a force that is clear of zero in less than "
        f"{100 * LEAST_CLEAR:.0f} % of the beat; motions within 0.03 of the best are both told."
    )
    return Prose(_loudest(found, forces, like)), Table(caption, FORCE, rows)


def _loudest(found: DiagnosisResult, forces: MissingForces, like: Mapping[str, Likeness]) -> str:
    """The force that stands out most, for who has no name to go by."""
    clear = forces.clear
    if not (clear > 0.5).any():
        return "No missing force stands clear of zero over half of the beat."
    place = max(range(len(forces.joints)), key=lambda i: (clear[i], forces.size[i]))
    joint = forces.joints[place]
    text = f"The clearest of them is the {force_name(joint)}: {_sized(forces, place)}{_with(like.get(joint))}."
    if found.verdict == "unexplained":
        text += " It is a lead to what the catalogue lacks."
    elif found.verdict == "no_gap":
        text += " With this verdict it is no more than what noise and boxes can feign."
    return text


def _with(like: Likeness | None) -> str:
    if like is None or abs(like.correlation) < LEAST_LIKE:
        return ", and it goes with no motion of that joint"
    return f", and it goes with the {' or '.join(like.motions)} there (correlation {shown(like.correlation, 2)})"


def _sized(forces: MissingForces, place: int) -> str:
    unit = "mN" if forces.joints[place] in FORCES else "mN m"
    return f"{of_its_size(MILLI * float(forces.size[place]))} {unit}"


def _force_row(forces: MissingForces, place: int, like: Mapping[str, Likeness]) -> tuple[str, ...]:
    joint = forces.joints[place]
    own = like.get(joint)
    clear = float(forces.clear[place])
    told = own is not None and clear >= LEAST_CLEAR
    goes = " or ".join(own.motions) if own and told and abs(own.correlation) >= LEAST_LIKE else MISSING
    return (
        force_name(joint),
        _sized(forces, place),
        shown(100 * clear, 0),
        goes,
        shown(own.correlation, 2, signed=True) if own and told else MISSING,
    )


def evidence(found: DiagnosisResult) -> tuple[Block, ...]:
    """Explanations with their weight, and the effects as strong as they were fitted."""
    blocks: list[Block] = [_explanations(found)]
    if rows := _elsewhere(found):
        caption = (
            "Where something else may act: a marker that is seen elsewhere, a force or torque that no model holds, a "
            "crank that runs unevenly, each free in every harmonic of the beat; or the whole fish is moved in no step "
            "with it, as tracks tell where markers stray together."
        )
        blocks.append(Table(caption, PLACE, rows))
    if decays := found.free_decays:
        blocks.append(_decays(decays))
    if found.effect_parameters:
        blocks.append(_parameters(found))
    return tuple(blocks)


def _decays(decays: Sequence[FreeDecay]) -> Table:
    rows = []
    for told in decays:
        stiffness = _with_error(told.stiffness_over_mass, told.stiffness_over_mass_se)
        damping = _with_error(told.damping_over_mass, told.damping_over_mass_se)
        rows.append((told.trial, stiffness, damping, f"no: {told.not_used}" if told.not_used else "yes"))
    caption = (
        "What free decays say of the hinges, against the robot as described: in air, beside no water and no tendons. "
        "The errors are those of tracking; a robot counts as described within 3 % in stiffness and 5 % in damping."
    )
    return Table(caption, DECAY, tuple(rows))


def _with_error(off: float | None, se: float | None) -> str:
    return MISSING if off is None or se is None else f"{shown(100 * off, 1, signed=True)} ± {shown(100 * se, 1)}"


def _explanations(found: DiagnosisResult) -> Table:
    rows = []
    for told in found.evidence.sets:
        names = [in_words(name) for name in told.effects]
        other = ["something else"] if told.something_else else []
        rows.append((" + ".join([*names, *other]) or "nothing", shown(told.probability, 3)))
    caption = (
        "The likeliest explanations, each weighed by its evidence. An effect stands for itself and for what only looks "
        "like it; “something else” is an error that no effect of the catalogue makes."
    )
    return Table(caption, SET, tuple(rows))


def _elsewhere(found: DiagnosisResult) -> tuple[tuple[str, ...], ...]:
    told = [
        (
            each.probability,
            in_words(each.place),
            "alike" if each.same_in_all_trials else "each its own",
        )
        for each in found.evidence.elsewhere
    ]
    sway, delay = found.evidence.sway_m, found.evidence.delay_s
    for beside, what, unit in ((sway, "the whole fish, beside its beat", "mm"), (delay, "beats early and late", "ms")):
        if beside.probability >= _LEAST_BESIDE:
            size = f"{of_its_size(MILLI * beside.rms)} {unit}"
            told.append((beside.probability, f"{what} ({size})", "each its own"))
    likeliest = sorted(told, reverse=True)[:_PLACES]
    return tuple((place, trials, shown(chance, 3)) for chance, place, trials in likeliest)


def _parameters(found: DiagnosisResult) -> Table:
    rows = []
    for effect in found.effect_parameters:
        fitted = parameters_of(found.effect_parameters, effect)
        rows += [(in_words(effect), in_words(name), *_fitted(own)) for name, own in fitted.items()]
    known = {name: effect.physics for name, effect in catalogue().items()}
    told = ((name, known.get(name, "an effect of the user’s own.")) for name in found.effect_parameters)
    physics = " ".join(f"{in_words(name)}: {what}" for name, what in told)
    caption = f"The effects as strong as the refit of the fitted swims has them; zero is the plain twin. {physics}"
    return Table(caption.strip(), PARAMETER, tuple(rows))


def _fitted(own: FittedParameter) -> tuple[str, str, str]:
    low, high = own.ci95
    unit = {"1": "–"}.get(own.unit, own.unit)
    bound = ", at its bound" if own.at_bound else ""
    return significant(own.value, 3), f"{spanned(low, high)}{bound}", unit


def next_experiments(found: DiagnosisResult) -> tuple[Block, ...]:
    """The menu, the most telling first."""
    told = found.next_experiments
    if not told:
        return (Prose("No further experiment is proposed: nothing is confused, or nothing on the menu helps."),)
    rows = tuple(
        (each.describe, " and ".join(map(in_words, each.separates)), whole_percent(each.expected_error)[:-2])
        for each in told
    )
    caption = (
        "Experiments by how well they separate what these trials confuse. “Error left” is the chance to still take one "
        "for the other afterwards, at today’s odds and by what the new trial adds. More swims add less where those "
        "that were fitted should have told the two apart and did not."
    )
    return (Table(caption, NEXT, rows),)
