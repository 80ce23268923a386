"""What a diagnosis says: the records that ``results/diagnosis.json`` and ``results/supposed.json`` hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from session.results import ResultFile
from swimmer import FluidCoefficients

NONE = "none_of_these"

VerdictName = Literal["named", "inseparable", "unexplained", "no_gap"]


@dataclass(frozen=True)
class Remainder:
    """What the refitted twin with the named effects leaves of the fitted swims.

    Attributes:
        share: of the squared whitened length that the plain twin leaves, both above noise.
        stage: that most of it lies in.
        p_value: of as much by noise alone.
    """

    share: float
    stage: str | None
    p_value: float


@dataclass(frozen=True)
class GapShares:
    """Shares of the squared whitened residual of the nearest plain twin; those of each split add up to 1."""

    by_stage: Mapping[str, float]
    by_trial: Mapping[str, float]
    by_marker: Mapping[str, float]
    by_axis: Mapping[str, float]
    by_band: Mapping[str, float]


@dataclass(frozen=True)
class Controls:
    """Shrinkages of the same held-out swims.

    Attributes:
        placebo: name of an effect that the evidence speaks against, fitted as the named ones were; None where there
            is none.
        with_placebo: S with it.
        carried_over: S with what is left of the fitted swims carried over, whatever its cause.
    """

    placebo: str | None
    with_placebo: float | None
    carried_over: float | None


@dataclass(frozen=True)
class HeldOutSwim:
    """One held-out trial beside the plain twin and beside the one with effects; distances in mm, speeds in m/s.

    Attributes:
        before_mm, after_mm: mean marker distance.
        speed_measured, speed_before, speed_after: forward.
        speed_line: by a straight line in frequency through the fitted trials.
        frequency_measured_hz, frequency_before_hz, frequency_after_hz: of the beat, forecast from the command; nan
            without a command.
    """

    before_mm: float
    after_mm: float
    speed_measured: float
    speed_before: float
    speed_after: float
    speed_line: float = float("nan")
    frequency_measured_hz: float = float("nan")
    frequency_before_hz: float = float("nan")
    frequency_after_hz: float = float("nan")


@dataclass(frozen=True)
class GapSize:
    """Means over swims without and with effects; nan where there is nothing to compare.

    Attributes:
        baseline_mm, with_effects_mm: marker distance.
        speed_mae_before, speed_mae_after: mean absolute error of speeds, m/s.
        speed_mae_baselines: the same of simple rules in frequency through the fitted trials: "line", "power_law",
            "constant_stride".
        frequency_mae_before, frequency_mae_after: of beat frequencies forecast from the command, Hz.
        evaluated_on: names of the swims.
        noise_floor_mm: mean distance that tracking noise alone would make.
        shrinkage, shrinkage_ci95: S in whitened squares, see `diagnosis.gap`.
        squares_before, squares_after: these squares.
        controls: what the gap would shrink by anyhow; None where nothing was added.
        trials: each swim by its name.
    """

    baseline_mm: float = float("nan")
    with_effects_mm: float = float("nan")
    speed_mae_before: float = float("nan")
    speed_mae_after: float = float("nan")
    evaluated_on: tuple[str, ...] = ()
    noise_floor_mm: float = float("nan")
    shrinkage: float = float("nan")
    shrinkage_ci95: tuple[float, float] | None = None
    squares_before: float = float("nan")
    squares_after: float = float("nan")
    controls: Controls | None = None
    speed_mae_baselines: Mapping[str, float] = field(default_factory=dict)
    frequency_mae_before: float = float("nan")
    frequency_mae_after: float = float("nan")
    trials: Mapping[str, HeldOutSwim] | None = None

    @property
    def improves(self) -> bool:
        """Whether the effects surely improve forecasts of trials that nothing was fitted to."""
        return self.shrinkage_ci95 is not None and self.shrinkage_ci95[0] > 0


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of an effect, in its unit.

    Attributes:
        value, ci95: with its 95 % interval.
        unit: of both.
        at_bound: whether the value is as large or as small as it may be.
        parameter: its name.
    """

    value: float
    ci95: tuple[float, float]
    unit: str
    at_bound: bool
    parameter: str


EffectParameters = Mapping[str, FittedParameter | Mapping[str, FittedParameter]]
"""By effect: its one parameter, or each under its name."""


def parameters_of(found: EffectParameters, effect: str) -> Mapping[str, FittedParameter]:
    """The parameters of an effect by their names; none of an effect that was not fitted."""
    own = found.get(effect, {})
    return {own.parameter: own} if isinstance(own, FittedParameter) else own


@dataclass(frozen=True)
class Strength:
    """Of one parameter in the twin with all effects at once, in standard deviations of its prior."""

    effect: str
    parameter: str
    strength_sd: float


class GroupShare(NamedTuple):
    """Of the joint fit's gain on held-out trials that one group makes.

    Attributes:
        gap: of the skill score S.
        gap_ci90: its interval over the posterior of the joint fit.
        speed: of the decrease of the mean absolute speed error, m/s.
        speed_ci90: its interval.
    """

    gap: float
    gap_ci90: tuple[float, float]
    speed: float
    speed_ci90: tuple[float, float]


@dataclass(frozen=True)
class Attribution:
    """Of what the joint fit of all effects improves.

    Attributes:
        shares: by group.
        smallest: the fewest groups that forecast held-out trials as well, within one standard error over these.
        smallest_speed: the same of their speeds.
    """

    shares: Mapping[str, GroupShare]
    smallest: tuple[str, ...]
    smallest_speed: tuple[str, ...]

    @property
    def of_speed(self) -> tuple[str, ...]:
        """Groups whose share of the speed's gain is above zero, by its interval."""
        return tuple(name for name, share in self.shares.items() if share.speed_ci90[0] > 0)


@dataclass(frozen=True)
class AllEffects:
    """The twin with all effects at once.

    Attributes:
        share_of_priors: that the swims ask for.
        log_evidence_gained: over the twin with names alone.
        coefficients: of that twin.
        at_bound: effect and parameter.
        strengths: the strongest first.
        gap: of the held-out swims with it.
        attribution: to which groups of effects it owes that; None without held-out swims.
    """

    share_of_priors: float
    log_evidence_gained: float
    coefficients: FluidCoefficients
    at_bound: tuple[tuple[str, str], ...]
    strengths: tuple[Strength, ...]
    gap: GapSize
    attribution: Attribution | None


@dataclass(frozen=True)
class ProposedTrial:
    """A trial that could be added to a session.

    Attributes:
        kind: of experiment.
        commanded_hz: that the motor is told; None of a free decay.
        logged: whether the motor is to be logged in it.
    """

    kind: Literal["swim", "dry", "free_decay"]
    commanded_hz: float | None = None
    logged: bool = False


@dataclass(frozen=True)
class Experiment:
    """One that could be made.

    Attributes:
        describe: what to do, in a sentence.
        separates: two names.
        expected_error: chance to still take one for the other afterwards; 0.5 is a coin.
        trial: what would be added to the session; None of a clock in view, which no trial has.
    """

    describe: str
    separates: tuple[str, str]
    expected_error: float
    trial: ProposedTrial | None = None


@dataclass(frozen=True, eq=False)
class MissingForces:
    """On the head and in the hinges, in each of t fitted swims, as they go with the crank's turn.

    Attributes:
        joints: (j,) names: along and across the head, the moment on it, then the hinges.
        trials: (t,) names.
        mean, sd: (t, j, 7) mean, then cosine and sine of each harmonic, N or N m.
    """

    joints: tuple[str, ...]
    trials: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray

    def over(self, turn_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(t, j, n) mean and standard deviation at angles (n,) of the crank; coefficients as if independent."""
        columns = _columns(turn_rad, self.mean.shape[-1])
        return self.mean @ columns.T, np.sqrt(self.sd**2 @ columns.T**2)

    @property
    def size(self) -> np.ndarray:
        """(j,) root mean square over the beat and the swims, N or N m."""
        squares = self.mean[..., 0] ** 2 + (self.mean[..., 1:] ** 2).sum(axis=-1) / 2
        return np.asarray(np.sqrt(squares.mean(axis=0)))

    @property
    def clear(self) -> np.ndarray:
        """(j,) share of the beats in which zero lies beyond two standard deviations."""
        mean, sd = self.over(np.linspace(0.0, 2 * np.pi, 72, endpoint=False))
        return np.asarray((np.abs(mean) > 2 * sd).mean(axis=(0, 2)))


@dataclass(frozen=True)
class FreeDecay:
    """What a free decay says, relative to the robot as described, with standard errors by tracking noise.

    Attributes:
        trial: its name.
        stiffness_over_mass, damping_over_mass: relative differences; None where it does not count.
        not_used: why it does not count.
    """

    trial: str
    stiffness_over_mass: float | None = None
    stiffness_over_mass_se: float | None = None
    damping_over_mass: float | None = None
    damping_over_mass_se: float | None = None
    not_used: str | None = None


@dataclass(frozen=True)
class BeatFrequency:
    """Commanded and measured, Hz."""

    commanded_hz: float | None
    measured_hz: float


@dataclass(frozen=True)
class EffectSet:
    """Effects that may be present together.

    Attributes:
        effects: their names.
        something_else: whether something is there that the catalogue does not hold.
        that_looks_like: the effect that this looks like, if any.
        probability: of just this set.
    """

    effects: tuple[str, ...]
    something_else: bool
    that_looks_like: str | None
    probability: float


@dataclass(frozen=True)
class Place:
    """Where something may act that the catalogue does not hold."""

    place: str
    same_in_all_trials: bool
    probability: float


@dataclass(frozen=True)
class Refuted:
    """Names that are not said, for with them fitted trials are forecast worse from the others."""

    effects: tuple[str, ...]
    shrinkage: float
    shrinkage_ci95: tuple[float, float]


@dataclass(frozen=True)
class CrossValidation:
    """Of the names that are said: each fitted swim trial forecast from the others.

    Attributes:
        trials: that were left out in turn; none where fewer than three were fitted, of which this says nothing.
        shrinkage, shrinkage_ci95: skill with the named effects; nan where nothing is named.
    """

    trials: tuple[str, ...]
    shrinkage: float = float("nan")
    shrinkage_ci95: tuple[float, float] | None = None


@dataclass(frozen=True)
class BesideBeat:
    """What shows beside the beat: how far (m) or how late (s), and how probably something else makes it."""

    rms: float
    log_bayes_factor: float
    probability: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a diagnosis rests on.

    Attributes:
        squares, numbers: what the nearest plain twin leaves, whitened, and of how many numbers.
        sets: of effects, the likeliest first.
        elsewhere, refuted, cross_validation, sway_m, delay_s: see there.
    """

    squares: float
    numbers: int
    sets: tuple[EffectSet, ...]
    elsewhere: tuple[Place, ...]
    refuted: tuple[Refuted, ...]
    sway_m: BesideBeat
    delay_s: BesideBeat
    cross_validation: CrossValidation = CrossValidation(())


@dataclass(frozen=True, eq=False)
class DiagnosisResult:
    """The content of ``diagnosis.json``; the public contract's keys come first.

    Attributes:
        verdict: what is said.
        groups: alternatives (inner), the likeliest first, that act together (outer).
        effects: all that are named.
        probabilities: that an effect is present, the likeliest first, and `NONE`: something else.
        remainder: what stays of the fitted gap; None where nothing is named.
        where: shares of the gap.
        gap: on held-out swims.
        effect_parameters: of the twin with the likeliest of the named effects.
        next_experiments: the most telling first.
        no_gap_probability: that there is nothing.
        everything: the twin with all effects at once; None where it is not called for.
        coefficients: of the plain twin ("plain"), and of the one "with_effects".
        stage_alone: share that a stage would explain if it were the only one.
        missing_forces, free_decays, evidence: see there.
        frequencies: of each fitted swim.
        withheld_from_catalogue: effects that the catalogue lacked.
        models: files of the twins with effects.
    """

    verdict: VerdictName
    groups: tuple[tuple[str, ...], ...]
    effects: tuple[str, ...]
    probabilities: Mapping[str, float]
    remainder: Remainder | None
    where: GapShares
    gap: GapSize
    effect_parameters: EffectParameters
    next_experiments: tuple[Experiment, ...]
    no_gap_probability: float
    everything: AllEffects | None
    coefficients: Mapping[str, FluidCoefficients]
    stage_alone: Mapping[str, float]
    missing_forces: MissingForces
    free_decays: tuple[FreeDecay, ...]
    frequencies: Mapping[str, BeatFrequency]
    evidence: Evidence
    withheld_from_catalogue: tuple[str, ...] = ()
    models: tuple[str, ...] = ()

    @property
    def chances(self) -> dict[str, float]:
        """Probabilities of the effects alone."""
        return {name: chance for name, chance in self.probabilities.items() if name != NONE}

    @property
    def none_of_these(self) -> float:
        """Probability of something that the catalogue does not hold."""
        return self.probabilities[NONE]


@dataclass(frozen=True)
class SuppositionResult:
    """The content of ``supposed.json``: what the swims say of effects that a user names.

    Attributes:
        effects: their names.
        log_bayes_factor: of all together over the plain twin, ln.
        log_bayes_factor_of_each: of each by itself.
        effect_parameters: of the twin with them.
        fitted, gap: on the fitted and on the held-out swims.
    """

    effects: tuple[str, ...]
    log_bayes_factor: float
    log_bayes_factor_of_each: Mapping[str, float]
    effect_parameters: EffectParameters
    fitted: GapSize
    gap: GapSize


def _columns(turn_rad: np.ndarray, count: int) -> np.ndarray:
    """(n, c) one, then cosine and sine of each harmonic of the turn (n,)."""
    of_harmonics = [wave(h * turn_rad) for h in range(1, count // 2 + 1) for wave in (np.cos, np.sin)]
    return np.column_stack([np.ones(len(turn_rad)), *of_harmonics])


DIAGNOSIS = ResultFile("diagnosis.json", DiagnosisResult)
SUPPOSITION = ResultFile("supposed.json", SuppositionResult)
