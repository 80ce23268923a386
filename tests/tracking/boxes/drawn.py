"""Pictures of a robot from above, drawn with its truth: discs on a body in water, with whatever disturbs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from swimcal.robot import load_robot

NINE = ("nose", "neck", "dorsal_fin", "tail_1", "tail_2", "tail_3", "tail_4", "tail_5", "caudal_fin")
WATER = 125.0
ELEVEN = (*NINE, "pectoral_left", "pectoral_right")


def layout(markers: tuple[str, ...] = NINE) -> np.ndarray:
    """(m, 2) places on the straight robot, m."""
    return load_robot().marker_positions_m(markers)[:, :2]


@dataclass(frozen=True)
class Scene:
    """What is drawn; lengths in px of the picture."""

    size: tuple[int, int] = (800, 600)
    markers: tuple[str, ...] = NINE
    bend_deg: tuple[float, ...] = (0, 0, 0, 0, 0)
    heading_deg: float = 180.0  # the tail as seen from the nose; anticlockwise in the picture
    px_per_m: float = 900.0
    centre: tuple[float, float] = (400.0, 300.0)
    diameter: float = 16.0
    bright: bool = True
    contrast: float = 120.0
    noise: float = 3.0
    glints: int = 0
    ripple: float = 0.0
    body: bool = True
    hidden: tuple[str, ...] = ()
    seed: int = 0

    def but(self, **changes: object) -> Scene:
        return replace(self, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Drawn:
    luma: np.ndarray  # (h, w)
    centre_px: np.ndarray  # (m, 2)


def bent(markers: tuple[str, ...], bend_deg: tuple[float, ...]) -> np.ndarray:
    """(m, 2) places of the markers of a robot whose hinges are bent, robot frame, m."""
    robot = load_robot()
    place = robot.marker_positions_m(markers)[:, :2] @ [1, 1j]
    link = np.array([robot.links.index(robot.markers[name].body) for name in markers])
    for hinge in range(len(bend_deg), 0, -1):
        pivot = robot.hinge_x_m[hinge - 1]
        behind = link >= hinge
        place[behind] = pivot + (place[behind] - pivot) * np.exp(1j * np.deg2rad(bend_deg[hinge - 1]))
    return np.stack([place.real, place.imag], axis=1)


def places_px(scene: Scene) -> np.ndarray:
    """(m, 2) centres of the markers in the picture."""
    turn = np.exp(1j * np.deg2rad(scene.heading_deg))
    place = (bent(scene.markers, scene.bend_deg) - [0.2, 0.0]) @ [1, 1j] * turn * scene.px_per_m
    return np.stack([scene.centre[0] + place.real, scene.centre[1] - place.imag], axis=1)


def draw(scene: Scene, centre_px: np.ndarray | None = None) -> Drawn:
    """Draws the scene; with markers at given places if there are."""
    rng = np.random.default_rng(scene.seed)
    centre_px = places_px(scene) if centre_px is None else centre_px
    picture = water(scene, rng)
    level = WATER if not scene.body else 60.0 if scene.bright else 190.0
    if scene.body:
        draw_body(picture, scene, centre_px, level)
    for _ in range(scene.glints):
        at = rng.uniform((0, 0), scene.size)
        axes = scene.diameter / 2 * rng.uniform(0.4, 1.8) * rng.uniform(0.7, 1.4, 2)
        blob(picture, at, axes, rng.uniform(0, 180), level + rng.uniform(0.3, 1.6) * sign(scene) * scene.contrast)
    for name, at in zip(scene.markers, centre_px, strict=True):
        if name not in scene.hidden:
            blob(picture, at, np.full(2, scene.diameter / 2), 0.0, level + sign(scene) * scene.contrast)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    if scene.noise:
        picture += rng.normal(0, scene.noise, picture.shape).astype(np.float32)
    return Drawn(np.clip(picture, 0, 255).astype(np.uint8), centre_px)


def sign(scene: Scene) -> float:
    return 1.0 if scene.bright else -1.0


def water(scene: Scene, rng: np.random.Generator) -> np.ndarray:
    """(h, w) level of the pool, with a slope and a net of caustics."""
    width, height = scene.size
    slope = np.linspace(-15, 15, width, dtype=np.float32) + np.linspace(-8, 8, height, dtype=np.float32)[:, None]
    coarse = rng.normal(0, 1, (height // 12 + 2, width // 12 + 2)).astype(np.float32)
    net = cv2.resize(cv2.GaussianBlur(coarse, (0, 0), 1.5), (width, height), interpolation=cv2.INTER_CUBIC)
    return WATER + slope + scene.ripple * (1 - np.abs(net) / (np.abs(net).std() + 1e-9))


def draw_body(picture: np.ndarray, scene: Scene, centre_px: np.ndarray, level: float) -> None:
    """The head as an ellipse, the tail as a band along its markers."""
    at = dict(zip(scene.markers, centre_px, strict=True))
    nose, neck, dorsal = at["nose"], at["neck"], at["dorsal_fin"]
    middle, along = (nose + dorsal) / 2, dorsal - nose
    length = np.linalg.norm(neck - nose) / 0.142
    axes = np.linalg.norm(along) / 2 + 0.04 * length, 0.12 * length
    blob(picture, middle, np.array(axes), np.rad2deg(np.arctan2(along[1], along[0])), level)
    line = np.rint(np.array([at[name] for name in NINE[2:]]) * 16).astype(np.int32)
    cv2.polylines(picture, [line], False, level, max(3, int(0.05 * length)), cv2.LINE_AA, 4)


def blob(picture: np.ndarray, at: np.ndarray, axes: np.ndarray, angle_deg: float, level: float) -> None:
    """An ellipse with a soft edge, placed to a fraction of a pixel."""
    reach = int(np.max(axes)) + 3
    left, top = int(at[0]) - reach, int(at[1]) - reach
    x0, y0 = max(left, 0), max(top, 0)
    patch = picture[y0 : top + 2 * reach + 1, x0 : left + 2 * reach + 1]
    if patch.size == 0:
        return
    y, x = np.mgrid[y0 : y0 + patch.shape[0], x0 : x0 + patch.shape[1]]
    turned = ((x - at[0]) + 1j * (y - at[1])) * np.exp(-1j * np.deg2rad(angle_deg))
    distance = np.hypot(turned.real / axes[0], turned.imag / axes[1])
    cover = np.clip((1 - distance) * np.sqrt(axes[0] * axes[1]) + 0.5, 0, 1)
    patch += (cover * (level - patch)).astype(np.float32)
