"""Forces of the water on the strips of the surface, quasi-steady.

With v = (v_x, v_y) a strip's velocity through the water along and across its link, w the link's rate, h and t its half
height and half thickness, u the mean of v_y over the rigid plate that the strip is part of, c half that plate's chord,
and per unit of length:

- the pressure on a surface vanishes towards its edges: only pi / 4 of it counts, A = pi / 2 h;
- the share of it that the flow meets broadside is the plate's, b = e + (1 - e) |u| / sqrt(u^2 + (e v_x)^2), which falls
  to e = t / c where the plate moves edge on;
- drag -rho A |v| (C_blunt b + C_slender (1 - b)) v;
- torque -rho |C_angular i + C_slender (i_max - i)| |w| w with i = 4/15 pi h c^3 and i_max = max(i, 4/15 pi h^4), of the
  order of the third moments of the plate's planform about its span and about its chord;
- Kutta lift C_kutta rho A b v_x u / sqrt(v_x^2 + u^2) (u, -v_x): one circulation for a plate, which grows with the sine
  of its angle of attack; it does no work;
- Magnus lift C_magnus rho pi h t w (-v_y, v_x);
- the added mass across, mu = 2/3 pi rho h^2 c / sqrt(c^2 + h^2) (an elliptic plate between its two slender limits,
  Brennen 1982, A review of added mass and fluid inertial forces), in Kirchhoff's terms without acceleration:
  force (mu v_y w, 0) and torque -mu v_x v_y, which do no work.

`ReactiveWater` replaces the last term by the reactive force of elongated bodies, at a share of its own.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.body import Chain, Pose
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters

_STILL_M_S = 1e-6  # This is added to speeds against division by zero.


@dataclass(frozen=True, eq=False)
class Flow:
    """Motion of the strips through the water, in their links' axes: (n, s) m/s, m/s, rad/s."""

    along_m_s: np.ndarray
    across_m_s: np.ndarray
    rate_rad_s: np.ndarray


@dataclass(frozen=True, eq=False)
class StripForces:
    """Forces of the water on the strips, in their links' axes, at their middles: (n, s) N, N, N m."""

    along_n: np.ndarray
    across_n: np.ndarray
    torque_n_m: np.ndarray

    def plus(self, along_n: np.ndarray, across_n: np.ndarray, torque_n_m: np.ndarray | float = 0.0) -> "StripForces":
        """Add other forces."""
        return StripForces(self.along_n + along_n, self.across_n + across_n, self.torque_n_m + torque_n_m)


def wet_half_height_m(layout: Layout, parameters: Parameters) -> np.ndarray:
    """Return (n, s) half heights of the strips, m: of a fish that floats deeper, more of each is under water."""
    return layout.strips.half_height_m + parameters.sunk_m / 2


class Water:
    """Water around n simulations."""

    def __init__(self, layout: Layout, parameters: Parameters, chain: Chain) -> None:
        strips, density = layout.strips, parameters.density_kg_m3
        self.strips, self._chain = strips, chain
        self._current = parameters.current_m_s
        self._of_link = np.eye(len(layout.origin_m))[strips.link]  # (s, l) sums strips over their link
        height, chord, length = wet_half_height_m(layout, parameters), strips.half_chord_m, strips.length_m
        same_plate = strips.plate[:, None] == strips.plate
        # (s, s) means over the rest of a strip's plate
        self._over_plate = same_plate * length[:, None] / (same_plate @ length)
        self._edge = strips.half_thickness_m / chord
        blunt, slender, angular, kutta, magnus = np.moveaxis(parameters.coefficients, 1, 0)  # (n, s) each
        area = density * np.pi / 2 * height * length
        self._blunt, self._slender, self._kutta = area * blunt, area * slender, area * kutta
        moment = 4 / 15 * np.pi * height * chord**3
        largest = np.maximum(moment, 4 / 15 * np.pi * height**4)
        self._turning = density * length * np.abs(angular * moment + slender * (largest - moment))
        self._magnus = density * length * np.pi * height * strips.half_thickness_m * magnus
        plate = 2 / 3 * np.pi * height**2 * chord / np.hypot(chord, height)
        self._added = density * length * plate * (1 - parameters.added_mass_reaction)

    def flow(self, pose: Pose) -> Flow:
        """Return how the strips move through the water in a pose."""
        link = self.strips.link
        own = (pose.velocity_m_s - self._current) * pose.direction.conj()
        rate = pose.rate_rad_s[:, link]
        return Flow(own.real[:, link], own.imag[:, link] + self.strips.place_m * rate, rate)

    def forces(self, flow: Flow) -> StripForces:
        """Return the quasi-steady forces on the strips."""
        along, across, rate = flow.along_m_s, flow.across_m_s, flow.rate_rad_s
        drag, lift, mean = self._compute_strength(flow)
        return StripForces(
            along_n=lift * along * mean**2 + (self._added - self._magnus) * rate * across - drag * along,
            across_n=self._magnus * rate * along - lift * along**2 * mean - drag * across,
            torque_n_m=-self._turning * np.abs(rate) * rate - self._added * along * across,
        )

    def _compute_strength(self, flow: Flow) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (n, s) drag over speed; lift over v_x^2 u; u, the mean over the strip's plate."""
        along, across = flow.along_m_s, flow.across_m_s
        mean = across @ self._over_plate
        broadside = np.abs(mean) / np.sqrt(mean**2 + (self._edge * along) ** 2 + _STILL_M_S**2)
        share = self._edge + (1 - self._edge) * broadside
        drag = np.sqrt(along**2 + across**2) * (self._slender + share * (self._blunt - self._slender))
        return drag, self._kutta * share / np.sqrt(along**2 + mean**2 + _STILL_M_S**2), mean

    def on_links(self, pose: Pose, forces: StripForces) -> np.ndarray:
        """Return the (n, N) generalised force of the strips' forces."""
        force = (forces.along_n + 1j * forces.across_n) @ self._of_link * pose.direction
        torque = (forces.torque_n_m + self.strips.place_m * forces.across_n) @ self._of_link
        return self._chain.generalised(pose, force, torque)

    def resistance(self, pose: Pose, flow: Flow) -> np.ndarray:
        """Estimate how fast drag, torque and lift grow with the rates, (n, N, N); symmetric, never negative."""
        drag, lift, _ = self._compute_strength(flow)
        grows, place = 2 * drag + lift * flow.along_m_s**2, self.strips.place_m
        turning = 2 * self._turning * np.abs(flow.rate_rad_s)
        columns = (grows, grows * place, grows * place**2 + turning)
        return self._chain.form(*(each @ self._of_link for each in columns)).matrix(pose)


class ReactiveWater:
    """Reactive force of elongated bodies, with the water's reaction to acceleration: an effect, off in the base state.

    Lighthill, "Large-amplitude elongated-body theory of fish locomotion", Proc. R. Soc. B 179 (1971): a slice of water
    at a strip holds the momentum m w n across it, m = pi rho h^2 per unit of length, w the strip's velocity across its
    link. With s tailwards along the body, x the unit vector along it and v_x the velocity along it, the force is

        f = -d/dt (m w n) + d/ds (m v_x w n - 1/2 m w^2 x),

    whose second term leaves at the tail tip what the wake carries away. Candelier, Boyer and Leroyer (J. Fluid Mech.
    673, 2011) derive the same from the water's kinetic energy.

    It is that on n simulations, each at its own share.
    """

    def __init__(self, layout: Layout, parameters: Parameters, chain: Chain) -> None:
        strips = layout.strips
        self._strips, self._chain = strips, chain
        self._of_link = np.eye(len(layout.origin_m))[strips.link]
        share = parameters.added_mass_reaction * parameters.density_kg_m3
        self._per_length = share * np.pi * wet_half_height_m(layout, parameters) ** 2  # (n, s) m, times the share
        mass = self._per_length * strips.length_m
        self._moments = [(mass * strips.place_m**k) @ self._of_link for k in (0, 1, 2)]  # (n, l)

    def inertia(self, pose: Pose) -> np.ndarray:
        """Return the (n, N, N) added mass matrix."""
        mass, first, second = self._moments
        gradient = self._chain.across(pose)  # (n, N, l)
        added = (gradient * mass[:, None]) @ np.swapaxes(gradient, 1, 2)
        sided = gradient * first[:, None]
        added[:, :, 2:] += sided
        added[:, 2:, :] += np.swapaxes(sided, 1, 2)
        links = np.arange(2, added.shape[1])
        added[:, links, links] += second
        return added

    def force(self, pose: Pose, flow: Flow) -> np.ndarray:
        """Return the (n, N) generalised force, less what `inertia` times the coordinates' acceleration gives."""
        link, length = self._strips.link, self._strips.length_m
        m, along, across, rate = self._per_length, flow.along_m_s, flow.across_m_s, flow.rate_rad_s
        direction = pose.direction[:, link]
        centripetal = self._chain.centripetal(pose)[:, link]
        turning = (centripetal * direction.conj()).imag - rate * along
        lasting = m * length * (across * rate - 1j * turning) * direction  # -d/dt (m w n) at rest of the rates
        passed = m * (1j * along * across - 0.5 * across**2) * direction
        before = np.concatenate([np.zeros_like(passed[:, :1]), passed[:, :-1]], axis=1)
        behind = np.concatenate([passed[:, 1:], 2 * passed[:, -1:] - passed[:, -2:-1]], axis=1)  # on to the tip's edge
        entering = 0.5 * (behind - before)
        entering[:, 0] += 0.5 * passed[:, 0]  # the nose meets water at rest
        force = lasting + entering
        torque = (force * direction.conj()).imag * self._strips.place_m
        return self._chain.generalised(pose, force @ self._of_link, torque @ self._of_link)
