"""Variance decomposition of the gap: shares by stage, and by trial, marker, axis and band.

`decompose`: by stage, the residual is the sum of missing forces on the head (body), missing torques in the hinges
(tail), a crank that turns otherwise (drive), displaced markers (camera), and noise (floor); and of the named effects,
and unknown ones at one place, each at its stage. Each of these components has an unknown size, which is found by
maximum likelihood (variance components; Patterson and Thompson 1971); the shares are those of the expected parts in the
squared norm, and add up exactly.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_solve, cholesky
from scipy.optimize import minimize

from diagnosis.constants import TAKEN
from diagnosis.linear_model import LinearModel
from diagnosis.places import HEAD, PER_JOINT, ForceResponses, LocalDiscrepancy
from diagnosis.result import GapShares, MissingForces
from fitting.covariance import harmonic_decay, inverse_of
from fitting.decay_fit import NUMBERS as RING_NUMBERS
from fitting.features import COURSE, SPEED, harmonics_of, marker_part, marker_slice, places_of_slides
from fitting.signatures import Signature, pieces
from fitting.trial import HARMONICS
from fitting.trial_model import slope_of_phase

STAGES = ("camera", "drive", "body", "tail", "floor")
OF_NO_MARKER = ("speed", "course", "frequency", "ringing")
"""Keys of `by_marker`, `by_axis` and `by_band` that stand for a whole trial; the last where there are free decays."""
_SEEN_M = 1e-3  # displacement of a marker
_SCALE = 0.01  # relative error of the picture's scale
_SLIDES_S = 10.0  # time in which a marker slides by that displacement
_RIPPLE_RAD = 0.05  # lead of the crank
_HERTZ = 0.01  # relative error of a frequency
_RINGING = 0.05  # change of the logarithms of stiffness and damping


class GapComponent(NamedTuple):
    """One component of a gap, at a stage, with a size of its own."""

    stage: str
    what: str


@dataclass(frozen=True, eq=False)
class VarianceDecomposition:
    """The residual of the nearest plain twin, split into components.

    Attributes:
        shares: shares of its squared whitened norm, split in several ways.
        alone: by stage, the share that it would have if it were the only one (the other end of its range).
        forces: forces missing in the swims; nothing acts on the head in a dry run.
        parts: (5, k) parts of the residual, by stage.
    """

    shares: GapShares
    alone: Mapping[str, float]
    forces: MissingForces
    parts: np.ndarray


def decompose(
    linear: LinearModel,
    responses: ForceResponses,
    signatures: Sequence[Signature],
    named: Collection[str] = (),
    placed: Sequence[LocalDiscrepancy] = (),
    unknown: Mapping[GapComponent, np.ndarray] | None = None,
) -> VarianceDecomposition:
    """Split the residual into components.

    Args:
        linear: the linearised model of the fitted trials.
        responses: responses to missing forces.
        signatures: what each effect does.
        named: names of effects that explain what they can.
        placed: unknown effects at one place that explain what they can.
        unknown: columns (k, q) of the laws of an unknown effect that explain what they can; default: none.
    """
    found = _split_by_stage(linear, _components(linear, responses, signatures, named, placed, unknown or {}))
    return VarianceDecomposition(
        shares=GapShares(found.shares, **_split(linear, found.residual)),
        alone=_alone(found.target, found.projected),
        forces=_forces(linear, responses, found.projected, found.fit),
        parts=np.array([found.parts[stage] for stage in STAGES]),
    )


def shares_by_stage(
    linear: LinearModel,
    responses: ForceResponses,
    signatures: Sequence[Signature],
    placed: Sequence[LocalDiscrepancy] = (),
) -> Mapping[str, float]:
    """Return the share of each stage alone, as in `decompose` without named effects, in less time."""
    return _split_by_stage(linear, _components(linear, responses, signatures, (), placed, {})).shares


class _ByStage(NamedTuple):
    """The residual (k,) less what coefficients explain, its projection (q,), and what each stage has of it."""

    residual: np.ndarray
    target: np.ndarray
    projected: Mapping[GapComponent, np.ndarray]
    fit: "_Fit"
    shares: Mapping[str, float]
    parts: Mapping[str, np.ndarray]


def _split_by_stage(linear: LinearModel, columns_of: Mapping[GapComponent, np.ndarray]) -> _ByStage:
    """Split the residual into components, by the columns (k, q) of each."""
    residual = linear.residual - linear.slopes @ linear.space.coefficients(linear.residual)
    target = linear.space.projected(residual)
    projected = {component: linear.space.projected(part.T).T for component, part in columns_of.items()}
    fit, total = _fit_sizes(target, projected), float(target @ target)
    shares, parts = dict.fromkeys(STAGES, 0.0), {stage: np.zeros_like(residual) for stage in STAGES}
    for component, part in projected.items():
        amplitude = fit.weights[component] * (part.T @ fit.solved)
        shares[component.stage] += float(amplitude @ (part.T @ target)) / total
        parts[component.stage] += columns_of[component] @ amplitude
    shares["floor"] = float(target @ fit.solved) / total
    parts["floor"] = residual - sum(parts.values())
    return _ByStage(residual, target, projected, fit, shares, parts)


def _components(
    linear: LinearModel,
    responses: ForceResponses,
    signatures: Sequence[Signature],
    named: Collection[str],
    placed: Sequence[LocalDiscrepancy],
    unknown: Mapping[GapComponent, np.ndarray],
) -> dict[GapComponent, np.ndarray]:
    """Return the columns (k, q) of each component: of what is steady, and of what beats."""
    of_joint = np.moveaxis(responses.columns, 2, 0)  # (j, k, t, 7)
    found = {}
    for stage, joints in (("body", slice(None, len(HEAD))), ("tail", slice(len(HEAD), None))):
        steady, beating = of_joint[joints, ..., :1], of_joint[joints, ..., 1:]
        for what, part in (("steady", steady), ("beating", beating)):
            found[GapComponent(stage, what)] = np.concatenate([each.reshape(len(each), -1) for each in part], axis=1)
    nuisances = linear.disturbances
    found[GapComponent("camera", "on the body")] = of_features(linear, TAKEN.marker_m * nuisances.per_marker)
    found[GapComponent("camera", "in the picture")] = of_features(linear, _SEEN_M * nuisances.per_box)
    found[GapComponent("camera", "beating")] = _in_each_trial(linear, _beats)
    aside = _SEEN_M / _SLIDES_S * np.eye(len(linear.residual))[:, linear.model.places_of_creeps]
    found[GapComponent("camera", "sliding")] = np.hstack([_in_each_trial(linear, _slides), aside])
    found[GapComponent("camera", "scale")] = _in_each_trial(linear, lambda features: _SCALE * features[:, None])
    found[GapComponent("drive", "ripple")] = _in_each_trial(linear, _ripples)
    found[GapComponent("drive", "frequency")] = other_frequencies(linear)
    found[GapComponent("tail", "free decays")] = (
        _RINGING * np.eye(len(linear.residual))[:, linear.model.places_of_rings]
    )
    of_drives = [response_of(signature) for signature in signatures if signature.effect.stage == "drive"]
    found[GapComponent("drive", "effects")] = np.hstack([np.zeros((len(linear.residual), 0)), *of_drives])
    for signature in signatures:
        if (effect := signature.effect).name in named:
            found[GapComponent(effect.stage, effect.name)] = _of_each_stretch(signature)
    for number, each in enumerate(placed):
        found[GapComponent(each.stage, f"{each.place} {number}")] = each.columns
    found |= unknown
    return {
        component: columns
        for component, columns in found.items()
        if columns.size and np.any(linear.space.projected(columns.T))
    }


def response_of(signature: Signature) -> np.ndarray:
    """Return the response (k, p) of the row to each parameter of an effect.

    Each is as strong as it was tried without divergence.
    """
    which, standing = np.abs(signature.values).argmax(axis=1), np.isfinite(signature.rows).all(axis=1)
    rows = [signature.rows[(which == number) & standing] for number in range(signature.values.shape[1])]
    return np.column_stack([np.zeros((signature.rows.shape[1], 0)), *[own[-1] for own in rows if len(own)]])


def _of_each_stretch(signature: Signature) -> np.ndarray:
    """Return the slope (k, s) by each parameter about each strength, for one standard deviation of its prior."""
    parameters = enumerate(signature.effect.parameters[: signature.values.shape[1]])
    slopes = [each.sd * piece.slope for number, each in parameters for piece in pieces(signature, number)]
    return np.column_stack([np.zeros((signature.rows.shape[1], 0)), *slopes])


def _in_each_trial(linear: LinearModel, columns: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return columns (k, q) that change each trial's features by itself, from the columns (g, p) of one trial."""
    return of_features(linear, block_diag(*[columns(model.measured) for model in linear.model.trials]))


def of_features(linear: LinearModel, columns: np.ndarray) -> np.ndarray:
    """Return columns (k, q) of the row from columns that change features alone, in all trials."""
    return np.vstack([columns, np.zeros((linear.model.beside, columns.shape[1]))])


def _beats(features: np.ndarray) -> np.ndarray:
    """Return columns (g, 12 m) that change the harmonics of each marker."""
    markers = marker_part(features)
    sizes = np.zeros(len(features))
    sizes[marker_slice(len(features))] = np.broadcast_to(np.append(0.0, harmonic_decay()), markers.shape).ravel()
    return _SEEN_M * np.diag(sizes)[:, sizes > 0]


def _slides(features: np.ndarray) -> np.ndarray:
    """Return columns (g, s) that slide each marker along the fish."""
    return _SEEN_M / _SLIDES_S * np.eye(len(features))[:, places_of_slides(len(features))]


def other_frequencies(linear: LinearModel) -> np.ndarray:
    """Return columns (k, f) that change each trial's frequency against its command.

    One set does it by the camera's clock, one by the crank.
    """
    filmed, logged = np.diag([_HERTZ * trial.frequency.hz for trial in linear.trials]), list(linear.model.logged)
    clocks = np.vstack([filmed, np.zeros((len(logged), len(filmed)))])
    hertz = np.hstack([clocks, np.vstack([filmed[:, logged], filmed[np.ix_(logged, logged)]])])
    columns = np.zeros((len(linear.residual), hertz.shape[1]))
    columns[len(linear.model.measured) :][: len(hertz)] = hertz
    return columns


def _ripples(features: np.ndarray) -> np.ndarray:
    """Return columns (g, 4) of a crank that runs ahead by a cosine or sine of one or two turns."""
    return _RIPPLE_RAD * np.column_stack([_ahead(features, order, sine) for order in (1, 2) for sine in (False, True)])


def _ahead(features: np.ndarray, order: int, sine: bool) -> np.ndarray:
    """Return the change (g,) of features, per rad, if the crank runs ahead by a cosine, or sine, of `order` turns."""
    rates = harmonics_of(slope_of_phase(features))  # (m, 2, 3) complex, Re(rate exp(i h turn))
    ahead = -1j if sine else 1.0 + 0j
    result = np.zeros_like(features)
    beats = marker_part(result)
    for h in range(1, HARMONICS + 1):
        rate = rates[..., h - 1]
        for other, product in ((h + order, ahead * rate / 2), (h - order, np.conj(ahead) * rate / 2)):
            number, turned = (other, product) if other >= 0 else (-other, np.conj(product))
            if number == 0:
                beats[..., 0] += turned.real
            elif number <= HARMONICS:
                beats[..., 2 * number - 1] += turned.real
                beats[..., 2 * number] -= turned.imag
    return result


def likeliest_sizes(target: np.ndarray, parts: list[np.ndarray]) -> tuple[np.ndarray, float]:
    """Return the likeliest size of each component (s,), relative to its columns, and the deviance there.

    Args:
        target: (k,) what they make together with noise of unit size.
        parts: (k, q) columns of each component.
    """
    count = len(target)
    target, parts = _in_their_span(target, parts)
    grams = [part @ part.T for part in parts]

    def deviance(ln_sizes: np.ndarray) -> tuple[float, np.ndarray]:
        covariance = np.eye(len(target)) + sum(np.exp(2 * s) * gram for s, gram in zip(ln_sizes, grams, strict=True))
        root = cholesky(covariance, lower=True)
        solved = cho_solve((root, True), target)
        against = inverse_of(root) - np.outer(solved, solved)
        slope = [2 * np.exp(2 * s) * np.vdot(against, gram) for s, gram in zip(ln_sizes, grams, strict=True)]
        return float(target @ solved + 2 * np.log(np.diag(root)).sum()), np.array(slope)

    scale = np.array([np.sqrt(np.trace(gram) / count) for gram in grams])
    starts = np.log(np.maximum(target @ target / count - 1, 0.05) ** 0.5 / scale / 2)
    low = starts - 8.0
    found = minimize(deviance, starts, jac=True, method="L-BFGS-B", bounds=list(zip(low, starts + 5.0, strict=True)))
    return np.asarray(np.where(found.x <= low + 1e-6, 0.0, np.exp(found.x))), float(found.fun)


def _in_their_span(target: np.ndarray, parts: list[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return a target (k,) and columns (k, q) in a basis of what they span, where that is smaller than k.

    Likelihoods keep their differences: across the span nothing is left but the floor's ones.
    """
    stacked = np.column_stack([*parts, target])
    if stacked.shape[1] >= len(target):
        return target, parts
    *within, last = np.split(np.linalg.qr(stacked, mode="r"), np.cumsum([part.shape[1] for part in parts]), axis=1)
    return last[:, 0], within


class _Fit(NamedTuple):
    """Components at their likeliest sizes: squared sizes, covariance (k, k), its inverse times the residual (k,)."""

    weights: Mapping[GapComponent, float]
    covariance: np.ndarray
    solved: np.ndarray


def _fit_sizes(target: np.ndarray, parts: Mapping[GapComponent, np.ndarray]) -> _Fit:
    weights = dict(zip(parts, likeliest_sizes(target, list(parts.values()))[0] ** 2, strict=True))
    covariance = np.eye(len(target)) + sum(weights[component] * part @ part.T for component, part in parts.items())
    return _Fit(weights, covariance, np.linalg.solve(covariance, target))


def _alone(target: np.ndarray, parts: Mapping[GapComponent, np.ndarray]) -> dict[str, float]:
    """Return the share of each stage, were it the only one."""
    found = {}
    for stage in dict.fromkeys(component.stage for component in parts):
        own = {component: part for component, part in parts.items() if component.stage == stage}
        found[stage] = 1 - float(target @ _fit_sizes(target, own).solved) / float(target @ target)
    return found


def _forces(
    linear: LinearModel, responses: ForceResponses, parts: Mapping[GapComponent, np.ndarray], fit: _Fit
) -> MissingForces:
    """Return mean and standard deviation of the missing forces, given all that was measured."""
    trials, unit = responses.columns.shape[1], responses.unit[:, None]
    mean, sd = np.zeros((2, len(responses.joints), trials, PER_JOINT))
    for stage, joints in (("body", slice(None, len(HEAD))), ("tail", slice(len(HEAD), None))):
        for what, harmonics in (("steady", slice(None, 1)), ("beating", slice(1, None))):
            if (component := GapComponent(stage, what)) not in parts:
                continue
            columns, prior = parts[component], fit.weights[component]
            explained = np.einsum("ij,ij->j", columns, np.linalg.solve(fit.covariance, columns))
            shape = mean[joints, :, harmonics].shape
            mean[joints, :, harmonics] = (prior * (columns.T @ fit.solved)).reshape(shape)
            sd[joints, :, harmonics] = np.sqrt(np.maximum(prior - prior**2 * explained, 0.0)).reshape(shape)
    swims = tuple(trial.name for trial in linear.swims)
    mean, sd = (np.moveaxis(each, 0, 1)[: len(swims)] * unit for each in (mean, sd))
    return MissingForces(responses.joints, swims, mean, sd)


def _split(linear: LinearModel, residual: np.ndarray) -> dict[str, dict[str, float]]:
    """Split the squares of the row, whitened so that each number stays near to itself (Kessy et al. 2018)."""
    sd = np.sqrt(np.diag(linear.covariance))
    values, vectors = np.linalg.eigh(linear.covariance / np.outer(sd, sd))
    squares = (vectors @ ((vectors.T @ (residual / sd)) / np.sqrt(values))) ** 2
    squares /= squares.sum()
    trials, markers = linear.trials, linear.trials[0].markers
    count = len(linear.model.measured)
    creeps = linear.model.places_of_creeps
    features, hertz, aside, ringing = np.split(squares, [count, creeps.start, creeps.stop])
    features, aside = features.reshape(len(trials), -1), aside.reshape(len(trials), -1)
    of_trial = np.array(hertz[: len(trials)])
    of_trial[list(linear.model.logged)] += hertz[len(trials) :]
    speed, beats, course = features[:, SPEED], marker_part(features), features[:, -len(COURSE) :]
    slides = features[:, places_of_slides(features.shape[1])].sum(axis=0)  # (s,)
    bands = {"mean": beats[..., 0].sum(), "drift": slides.sum() + aside.sum()}
    bands |= {f"harmonic_{h}": beats[..., 2 * h - 1 : 2 * h + 1].sum() for h in range(1, HARMONICS + 1)}
    rings = zip(linear.model.rings, ringing.reshape(-1, RING_NUMBERS), strict=True)
    of_decay = {ring.name: float(part.sum()) for ring, part in rings}
    no_markers = (speed, course, hertz, *([ringing] if of_decay else ()))
    alone = {name: float(part.sum()) for name, part in zip(OF_NO_MARKER, no_markers, strict=False)}
    return {
        "by_trial": {
            t.name: float(g.sum() + f + a.sum()) for t, g, f, a in zip(trials, features, of_trial, aside, strict=True)
        }
        | of_decay,
        "by_marker": {
            name: float(beats[:, i].sum() + slides[i : i + 1].sum() + aside[:, i : i + 1].sum())
            for i, name in enumerate(markers)
        }
        | alone,
        "by_axis": {
            "along": float(beats[:, :, 0].sum() + slides.sum()),
            "across": float(beats[:, :, 1].sum() + aside.sum()),
        }
        | alone,
        "by_band": {name: float(share) for name, share in bands.items()} | alone,
    }
