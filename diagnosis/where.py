"""Where the gap lies: shares by stage, and by trial, marker, axis and band.

By stage, what is left is the sum of what missing forces on the head would do (body), missing torques in the hinges
(tail), a crank that turns otherwise (drive), markers that are seen elsewhere (camera), and noise (floor); and of what
effects that are named, and what no catalogue holds at one place, would do, each at its stage. Each of these has a size
that is not known and is found by maximum likelihood (variance components; Patterson and Thompson 1971); the shares are
those of the expected parts in the squared length, and add up exactly.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_solve, cholesky
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from diagnosis.linear_model import LinearModel
from diagnosis.local_discrepancies import HEAD, PER_JOINT, ForceResponses, LocalDiscrepancy
from diagnosis.result import GapShares, MissingForces
from diagnosis.tolerances import TAKEN
from fitting.free_decay.ring import NUMBERS as RING_NUMBERS
from fitting.model.features import (
    COURSE,
    HARMONICS,
    SPEED,
    advanced,
    harmonics_of,
    of_markers,
    places_of_markers,
    places_of_slides,
)
from fitting.model.variance import harmonic_decay
from fitting.signatures import Signature
from fitting.signatures.signature import pieces

STAGES = ("camera", "drive", "body", "tail", "floor")
OF_NO_MARKER = ("speed", "course", "frequency", "ringing")
"""Keys of `by_marker`, `by_axis` and `by_band` that stand for a whole trial; the last where there are free decays."""
_SEEN_M, _SCALE = 1e-3, 0.01  # of a marker, of the picture
_SLIDES_S = 10.0  # in which a marker slides as far
_RIPPLE_RAD = 0.05
_HERTZ = 0.01  # relative
_RINGING = 0.05  # of the logarithms of stiffness and damping


@dataclass(frozen=True, eq=False)
class VarianceDecomposition:
    """What the nearest plain twin leaves, split.

    Attributes:
        shares: of its squared whitened length, split in several ways.
        alone: by stage, the share that it would have if it were the only one (the other end of its range).
        forces: that are missing in the swims; nothing acts on the head in a dry run.
        parts: (5, k) of what is left, by stage.
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
) -> VarianceDecomposition:
    """Splits what is left; effects that are named, and what is placed, each explain what they can."""
    residual = linear.residual - linear.slopes @ linear.space.coefficients(linear.residual)
    columns_of = _components(linear, responses, signatures, named, placed)
    target = linear.space.projected(residual)
    projected = {component: linear.space.projected(part.T).T for component, part in columns_of.items()}
    fit, total = _fitted(target, projected), float(target @ target)
    shares, parts = dict.fromkeys(STAGES, 0.0), {stage: np.zeros_like(residual) for stage in STAGES}
    for component, part in projected.items():
        amplitude = fit.weights[component] * (part.T @ fit.solved)
        shares[component.stage] += float(amplitude @ (part.T @ target)) / total
        parts[component.stage] += columns_of[component] @ amplitude
    shares["floor"] = float(target @ fit.solved) / total
    parts["floor"] = residual - sum(parts.values())
    return VarianceDecomposition(
        shares=GapShares(shares, **_split(linear, residual)),
        alone=_alone(target, projected),
        forces=_forces(linear, responses, projected, fit),
        parts=np.array([parts[stage] for stage in STAGES]),
    )


class Component(NamedTuple):
    """What a stage makes of a gap, of a size of its own."""

    stage: str
    what: str


def _components(
    linear: LinearModel,
    responses: ForceResponses,
    signatures: Sequence[Signature],
    named: Collection[str],
    placed: Sequence[LocalDiscrepancy],
) -> dict[Component, np.ndarray]:
    """(k, q) columns of each component: what is steady, and what beats."""
    of_joint = np.moveaxis(responses.columns, 2, 0)  # (j, k, t, 7)
    found = {}
    for stage, joints in (("body", slice(None, len(HEAD))), ("tail", slice(len(HEAD), None))):
        steady, beating = of_joint[joints, ..., :1], of_joint[joints, ..., 1:]
        for what, part in (("steady", steady), ("beating", beating)):
            found[Component(stage, what)] = np.concatenate([each.reshape(len(each), -1) for each in part], axis=1)
    nuisances = linear.disturbances
    found[Component("camera", "on the body")] = _of_features(linear, TAKEN.marker_m * nuisances.per_marker)
    found[Component("camera", "in the picture")] = _of_features(linear, _SEEN_M * nuisances.per_box)
    found[Component("camera", "beating")] = _in_each_trial(linear, _beats)
    found[Component("camera", "sliding")] = _in_each_trial(linear, _slides)
    found[Component("camera", "scale")] = _in_each_trial(linear, lambda features: _SCALE * features[:, None])
    found[Component("drive", "ripple")] = _in_each_trial(linear, lambda features: _RIPPLE_RAD * rippled(features))
    found[Component("drive", "frequency")] = _other_frequencies(linear)
    found[Component("tail", "free decays")] = _RINGING * np.eye(len(linear.residual))[:, linear.model.places_of_rings]
    of_drives = [_of_each_parameter(signature) for signature in signatures if signature.effect.stage == "drive"]
    found[Component("drive", "effects")] = np.hstack([np.zeros((len(linear.residual), 0)), *of_drives])
    for signature in signatures:
        if (effect := signature.effect).name in named:
            found[Component(effect.stage, effect.name)] = _of_each_stretch(signature)
    for number, each in enumerate(placed):
        found[Component(each.stage, f"{each.place} {number}")] = each.columns
    return {
        component: columns
        for component, columns in found.items()
        if columns.size and np.any(linear.space.projected(columns.T))
    }


def _of_each_parameter(signature: Signature) -> np.ndarray:
    """(k, p) what each parameter does, as strong as it was tried without divergence."""
    which, standing = np.abs(signature.values).argmax(axis=1), np.isfinite(signature.rows).all(axis=1)
    rows = [signature.rows[(which == number) & standing] for number in range(signature.values.shape[1])]
    return np.column_stack([np.zeros((signature.rows.shape[1], 0)), *[own[-1] for own in rows if len(own)]])


def _of_each_stretch(signature: Signature) -> np.ndarray:
    """(k, s) what each parameter does about each strength, of one standard deviation of its prior."""
    parameters = enumerate(signature.effect.parameters[: signature.values.shape[1]])
    slopes = [each.sd * piece.slope for number, each in parameters for piece in pieces(signature, number)]
    return np.column_stack([np.zeros((signature.rows.shape[1], 0)), *slopes])


def _in_each_trial(linear: LinearModel, columns: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """(k, q) columns (g, p) of each trial's features, by itself."""
    return _of_features(linear, block_diag(*[columns(model.measured) for model in linear.model.trials]))


def _of_features(linear: LinearModel, columns: np.ndarray) -> np.ndarray:
    """(k, q) of columns that change features alone."""
    return np.vstack([columns, np.zeros((linear.model.beside, columns.shape[1]))])


def _beats(features: np.ndarray) -> np.ndarray:
    """(g, 12 m) each marker's harmonics otherwise."""
    markers = of_markers(features)
    sizes = np.zeros(len(features))
    sizes[places_of_markers(len(features))] = np.broadcast_to(np.append(0.0, harmonic_decay()), markers.shape).ravel()
    return _SEEN_M * np.diag(sizes)[:, sizes > 0]


def _slides(features: np.ndarray) -> np.ndarray:
    """(g, s) each marker sliding along the fish."""
    return _SEEN_M / _SLIDES_S * np.eye(len(features))[:, places_of_slides(len(features))]


def _other_frequencies(linear: LinearModel) -> np.ndarray:
    """(k, f) each trial at another frequency than its command says: by the clocks of cameras, and of cranks as well."""
    filmed, logged = np.diag([_HERTZ * trial.frequency.hz for trial in linear.trials]), list(linear.model.logged)
    clocks = np.vstack([filmed, np.zeros((len(logged), len(filmed)))])
    hertz = np.hstack([clocks, np.vstack([filmed[:, logged], filmed[np.ix_(logged, logged)]])])
    columns = np.zeros((len(linear.residual), hertz.shape[1]))
    columns[len(linear.model.measured) :][: len(hertz)] = hertz
    return columns


def rippled(features: np.ndarray) -> np.ndarray:
    """(g, 4) how features (g,) changes, over rad, whose crank runs ahead by a cosine or sine of one turn or of two."""
    return np.column_stack([_ahead(features, order, sine) for order in (1, 2) for sine in (False, True)])


def _ahead(features: np.ndarray, order: int, sine: bool) -> np.ndarray:
    """(g,) how features changes, over rad, whose crank runs ahead by a cosine, or sine, of `order` turns."""
    step = 1e-4
    slope = (advanced(features, step) - advanced(features, -step)) / (2 * step)
    rates = harmonics_of(slope)  # (m, 2, 3) complex, Re(rate exp(i h turn))
    ahead = -1j if sine else 1.0 + 0j
    result = np.zeros_like(features)
    beats = of_markers(result)
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


def _sizes(target: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """(s,) the likeliest size of each stage, against that of its columns."""
    grams = [part @ part.T for part in parts]

    def deviance(ln_sizes: np.ndarray) -> tuple[float, np.ndarray]:
        covariance = np.eye(len(target)) + sum(np.exp(2 * s) * gram for s, gram in zip(ln_sizes, grams, strict=True))
        root = cholesky(covariance, lower=True)
        solved, half = cho_solve((root, True), target), dpotri(root, lower=True)[0]  # the inverse's lower triangle
        against = 2 * np.tril(half) - np.diag(np.diag(half)) - np.outer(solved, solved)
        slope = [2 * np.exp(2 * s) * np.vdot(against, gram) for s, gram in zip(ln_sizes, grams, strict=True)]
        return float(target @ solved + 2 * np.log(np.diag(root)).sum()), np.array(slope)

    scale = np.array([np.sqrt(np.trace(gram) / len(target)) for gram in grams])
    starts = np.log(np.maximum(target @ target / len(target) - 1, 0.05) ** 0.5 / scale / 2)
    low = starts - 8.0
    found = minimize(deviance, starts, jac=True, method="L-BFGS-B", bounds=list(zip(low, starts + 5.0, strict=True)))
    return np.asarray(np.where(found.x <= low + 1e-6, 0.0, np.exp(found.x)))


class _Fit(NamedTuple):
    """Components at their likeliest sizes: squared sizes, (k, k) covariance, and what is left by its inverse (k,)."""

    weights: Mapping[Component, float]
    covariance: np.ndarray
    solved: np.ndarray


def _fitted(target: np.ndarray, parts: Mapping[Component, np.ndarray]) -> _Fit:
    weights = dict(zip(parts, _sizes(target, list(parts.values())) ** 2, strict=True))
    covariance = np.eye(len(target)) + sum(weights[component] * part @ part.T for component, part in parts.items())
    return _Fit(weights, covariance, np.linalg.solve(covariance, target))


def _alone(target: np.ndarray, parts: Mapping[Component, np.ndarray]) -> dict[str, float]:
    """The share of each stage, were it the only one."""
    found = {}
    for stage in dict.fromkeys(component.stage for component in parts):
        own = {component: part for component, part in parts.items() if component.stage == stage}
        found[stage] = 1 - float(target @ _fitted(target, own).solved) / float(target @ target)
    return found


def _forces(
    linear: LinearModel, responses: ForceResponses, parts: Mapping[Component, np.ndarray], fit: _Fit
) -> MissingForces:
    """Mean and standard deviation of the missing forces, given all that was measured."""
    trials, unit = responses.columns.shape[1], responses.unit[:, None]
    mean, sd = np.zeros((2, len(responses.joints), trials, PER_JOINT))
    for stage, joints in (("body", slice(None, len(HEAD))), ("tail", slice(len(HEAD), None))):
        for what, harmonics in (("steady", slice(None, 1)), ("beating", slice(1, None))):
            if (component := Component(stage, what)) not in parts:
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
    """Squares of the row, whitened so that each number stays as near to itself as can be (Kessy et al. 2018)."""
    sd = np.sqrt(np.diag(linear.covariance))
    values, vectors = np.linalg.eigh(linear.covariance / np.outer(sd, sd))
    squares = (vectors @ ((vectors.T @ (residual / sd)) / np.sqrt(values))) ** 2
    squares /= squares.sum()
    trials, markers = linear.trials, linear.trials[0].markers
    count = len(linear.model.measured)
    features, hertz, ringing = np.split(squares, [count, count + linear.model.frequencies])
    features = features.reshape(len(trials), -1)
    of_trial = np.array(hertz[: len(trials)])
    of_trial[list(linear.model.logged)] += hertz[len(trials) :]
    speed, beats, course = features[:, SPEED], of_markers(features), features[:, -len(COURSE) :]
    slides = features[:, places_of_slides(features.shape[1])].sum(axis=0)  # (s,)
    bands = {"mean": beats[..., 0].sum(), "drift": slides.sum()}
    bands |= {f"harmonic_{h}": beats[..., 2 * h - 1 : 2 * h + 1].sum() for h in range(1, HARMONICS + 1)}
    rings = zip(linear.model.rings, ringing.reshape(-1, RING_NUMBERS), strict=True)
    of_decay = {ring.name: float(part.sum()) for ring, part in rings}
    no_markers = (speed, course, hertz, *([ringing] if of_decay else ()))
    alone = {name: float(part.sum()) for name, part in zip(OF_NO_MARKER, no_markers, strict=False)}
    return {
        "by_trial": {t.name: float(g.sum() + f) for t, g, f in zip(trials, features, of_trial, strict=True)} | of_decay,
        "by_marker": {name: float(beats[:, i].sum() + slides[i : i + 1].sum()) for i, name in enumerate(markers)}
        | alone,
        "by_axis": {"along": float(beats[:, :, 0].sum() + slides.sum()), "across": float(beats[:, :, 1].sum())} | alone,
        "by_band": {name: float(share) for name, share in bands.items()} | alone,
    }
