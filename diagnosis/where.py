"""Where the gap lies: shares by stage, and by trial, marker, axis and band.

By stage, what is left is the sum of what missing forces on the head would do (body), missing torques in the hinges
(tail), a crank that turns otherwise (drive), markers that are seen elsewhere (camera), and noise (floor). Each stage
has a size that is not known and is found by maximum likelihood (variance components; Patterson and Thompson 1971); the
shares are those of the expected parts in the squared length, and add up exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.optimize import minimize

from diagnosis.ground import Ground
from diagnosis.pushes import HEAD, Responses
from fitting.posterior.gait import HARMONICS, OF_A_MARKER, SPEED, advanced, harmonics_of
from fitting.signatures import Signature

STAGES = ("camera", "drive", "body", "tail", "floor")
_SEEN_M, _OF_HARMONIC, _SCALE = 1e-3, 0.5, 0.01  # of a marker, of each harmonic against the one before, of the picture
_RIPPLE_RAD = 0.05
_HERTZ = 0.01  # relative


class Forces(NamedTuple):
    """What is missing on the head and in the hinges, in each trial.

    Attributes:
        joints: (j,) names.
        mean: (t, j, 7) mean, then cosine and sine of each harmonic of the crank's turn, N or N m.
        sd: (t, j, 7).
    """

    joints: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True, eq=False)
class Where:
    """Shares of the squared whitened length of what the nearest plain twin leaves; each adds up to 1.

    Attributes:
        by_stage: camera, drive, body, tail and floor; may be negative.
        alone: by stage, the share that it would have if it were the only one (the other end of its range).
        by_trial, by_marker, by_axis, by_band: an orthogonal split of the same length.
        forces: that are missing.
        parts: (5, k) of what is left, by stage.
    """

    by_stage: Mapping[str, float]
    alone: Mapping[str, float]
    by_trial: Mapping[str, float]
    by_marker: Mapping[str, float]
    by_axis: Mapping[str, float]
    by_band: Mapping[str, float]
    forces: Forces
    parts: np.ndarray


def locate(ground: Ground, responses: Responses, signatures: Sequence[Signature]) -> Where:
    """Splits what is left.

    Args:
        ground: the fitted swims beside the nearest twin.
        responses: to missing forces.
        signatures: of the catalogue; those of the stage "drive" say how cranks turn otherwise.
    """
    left = ground.left - ground.slopes @ ground.space.coefficients(ground.left)
    columns = _columns(ground, responses, signatures)
    target = ground.space.freed(left)
    freed = {stage: ground.space.freed(part.T).T for stage, part in columns.items()}
    sizes = _sizes(target, list(freed.values()))
    weights = {stage: size**2 for stage, size in zip(freed, sizes, strict=True)}
    solved = _solved(target, freed, weights)
    total = float(target @ target)
    shares = {s: weights[s] * float(np.sum((part.T @ solved) * (part.T @ target))) / total for s, part in freed.items()}
    shares["floor"] = float(target @ solved) / total
    amplitudes = {stage: weights[stage] * (part.T @ solved) for stage, part in freed.items()}
    parts = {stage: columns[stage] @ amplitude for stage, amplitude in amplitudes.items()}
    parts["floor"] = left - sum(parts.values())
    return Where(
        by_stage={stage: shares[stage] for stage in STAGES},
        alone=_alone(target, freed),
        **_split(ground, left),
        forces=_forces(responses, freed, weights, solved),
        parts=np.array([parts[stage] for stage in STAGES]),
    )


def _columns(ground: Ground, responses: Responses, signatures: Sequence[Signature]) -> dict[str, np.ndarray]:
    """(k, q) by stage."""
    of_joint = np.moveaxis(responses.columns, 2, 0)  # (j, k, t, 7)
    head = np.concatenate([part.reshape(len(part), -1) for part in of_joint[: len(HEAD)]], axis=1)
    hinges = np.concatenate([part.reshape(len(part), -1) for part in of_joint[len(HEAD) :]], axis=1)
    return {"camera": _seen(ground), "drive": _driven(ground, signatures), "body": head, "tail": hinges}


def _seen(ground: Ground) -> np.ndarray:
    """(k, q) each marker elsewhere in its mean and harmonics, and another scale, in each trial by itself."""
    decay = np.concatenate([[1.0], np.repeat(_OF_HARMONIC ** np.arange(HARMONICS), 2)])
    blocks = []
    for model in ground.model.trials:
        gait = model.measured
        markers = np.vstack(
            [np.zeros(len(gait) - 1), np.diag(np.tile(_SEEN_M * decay, (len(gait) - 1) // OF_A_MARKER))]
        )
        blocks.append(np.column_stack([markers, _SCALE * gait]))
    return np.vstack([block_diag(*blocks), np.zeros((len(blocks), sum(block.shape[1] for block in blocks)))])


def _driven(ground: Ground, signatures: Sequence[Signature]) -> np.ndarray:
    """(k, q) cranks that ripple once and twice a turn, what the drive's effects do, and other frequencies."""
    blocks, trials = [], len(ground.trials)
    for model in ground.model.trials:
        blocks.append(np.column_stack([_rippled(model.measured, n, sine) for n in (1, 2) for sine in (False, True)]))
    rippled = np.vstack([block_diag(*blocks), np.zeros((trials, 4 * trials))])
    hertz = np.vstack(
        [
            np.zeros((len(ground.left) - trials, trials)),
            _HERTZ * np.diag([each.frequency.hz for each in ground.trials]),
        ]
    )
    told = [s.rows[np.isfinite(s.rows).all(axis=1)].T for s in signatures if s.effect.stage == "drive"]
    return np.hstack([rippled, hertz, *[rows[:, [0, -1]] / 2 for rows in told if rows.shape[1]]])


def _rippled(gait: np.ndarray, order: int, sine: bool) -> np.ndarray:
    """(g,) how a gait changes whose crank runs ahead by a cosine, or sine, of `order` turns."""
    step = 1e-4
    slope = (advanced(gait, step) - advanced(gait, -step)) / (2 * step)
    rates = harmonics_of(slope)  # (m, 2, 3) complex, Re(rate exp(i h turn))
    ahead = -1j if sine else 1.0 + 0j
    result = np.zeros_like(gait)
    beats = result[1:].reshape(*rates.shape[:2], OF_A_MARKER)
    for h in range(1, HARMONICS + 1):
        rate = rates[..., h - 1]
        for other, product in ((h + order, ahead * rate / 2), (h - order, np.conj(ahead) * rate / 2)):
            number, told = (other, product) if other >= 0 else (-other, np.conj(product))
            if number == 0:
                beats[..., 0] += told.real
            elif number <= HARMONICS:
                beats[..., 2 * number - 1] += told.real
                beats[..., 2 * number] -= told.imag
    return _RIPPLE_RAD * result


def _sizes(target: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """(s,) the likeliest size of each stage, against that of its columns."""
    grams = [part @ part.T for part in parts]

    def deviance(ln_sizes: np.ndarray) -> tuple[float, np.ndarray]:
        covariance = np.eye(len(target)) + sum(np.exp(2 * s) * gram for s, gram in zip(ln_sizes, grams, strict=True))
        factor = cho_factor(covariance, lower=True)
        solved, inverse = cho_solve(factor, target), cho_solve(factor, np.eye(len(target)))
        slope = [
            np.exp(2 * s) * 2 * (np.sum(inverse * gram) - solved @ gram @ solved)
            for s, gram in zip(ln_sizes, grams, strict=True)
        ]
        return float(target @ solved + 2 * np.log(np.diag(factor[0])).sum()), np.array(slope)

    scale = np.array([np.sqrt(np.trace(gram) / len(target)) for gram in grams])
    starts = np.log(np.maximum(target @ target / len(target) - 1, 0.05) ** 0.5 / scale / 2)
    low = starts - 8.0
    found = minimize(deviance, starts, jac=True, method="L-BFGS-B", bounds=list(zip(low, starts + 5.0, strict=True)))
    return np.asarray(np.where(found.x <= low + 1e-6, 0.0, np.exp(found.x)))


def _solved(target: np.ndarray, parts: Mapping[str, np.ndarray], weights: Mapping[str, float]) -> np.ndarray:
    covariance = np.eye(len(target)) + sum(weights[stage] * part @ part.T for stage, part in parts.items())
    return np.asarray(np.linalg.solve(covariance, target))


def _alone(target: np.ndarray, parts: Mapping[str, np.ndarray]) -> dict[str, float]:
    """The share of each stage, were it the only one."""
    found = {}
    for stage, part in parts.items():
        weight = float(_sizes(target, [part])[0]) ** 2
        solved = _solved(target, {stage: part}, {stage: weight})
        found[stage] = 1 - float(target @ solved) / float(target @ target)
    return found


def _forces(
    responses: Responses, parts: Mapping[str, np.ndarray], weights: Mapping[str, float], solved: np.ndarray
) -> Forces:
    """Mean and standard deviation of the missing forces, given all that was measured."""
    trials = responses.columns.shape[1]
    names = ("body", "tail")
    columns = np.hstack([parts[stage] for stage in names])
    prior = np.concatenate([np.full(parts[stage].shape[1], weights[stage]) for stage in names])
    covariance = np.eye(len(solved)) + sum(weights[stage] * part @ part.T for stage, part in parts.items())
    explained = np.einsum("ij,ij->j", columns, np.linalg.solve(covariance, columns))
    mean, sd = prior * (columns.T @ solved), np.sqrt(np.maximum(prior - prior**2 * explained, 0.0))
    joints = len(responses.joints)
    shaped = [np.moveaxis(each.reshape(joints, trials, -1), 0, 1) * responses.unit[:, None] for each in (mean, sd)]
    return Forces(responses.joints, *shaped)


def _split(ground: Ground, left: np.ndarray) -> dict[str, dict[str, float]]:
    """Squares of the row, whitened so that each number stays as near to itself as can be (Kessy et al. 2018)."""
    sd = np.sqrt(np.diag(ground.covariance))
    values, vectors = np.linalg.eigh(ground.covariance / np.outer(sd, sd))
    squares = (vectors @ ((vectors.T @ (left / sd)) / np.sqrt(values))) ** 2
    squares /= squares.sum()
    trials, markers = ground.trials, ground.trials[0].markers
    gaits, hertz = np.split(squares, [len(squares) - len(trials)])
    gaits = gaits.reshape(len(trials), -1)
    speed, beats = gaits[:, SPEED], gaits[:, SPEED + 1 :].reshape(len(trials), len(markers), 2, OF_A_MARKER)
    bands = {"mean": beats[..., 0].sum()}
    bands |= {f"harmonic_{h}": beats[..., 2 * h - 1 : 2 * h + 1].sum() for h in range(1, HARMONICS + 1)}
    alone = {"speed": float(speed.sum()), "frequency": float(hertz.sum())}
    return {
        "by_trial": {t.name: float(g.sum() + f) for t, g, f in zip(trials, gaits, hertz, strict=True)},
        "by_marker": {name: float(beats[:, i].sum()) for i, name in enumerate(markers)} | alone,
        "by_axis": {axis: float(beats[:, :, i].sum()) for i, axis in enumerate(("along", "across"))} | alone,
        "by_band": {name: float(share) for name, share in bands.items()} | alone,
    }
