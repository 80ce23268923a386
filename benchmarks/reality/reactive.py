"""Reactive force of elongated bodies, with the water's reaction to acceleration: an effect, off in the base state.

Lighthill, "Large-amplitude elongated-body theory of fish locomotion", Proc. R. Soc. B 179 (1971): a slice of water at
a strip holds the momentum m w n across it, m = pi rho h^2 per unit of length, w the strip's velocity across its link.
With s tailwards along the body, x the unit vector along it and v_x the velocity along it, the force on the fish is

    f = -d/dt (m w n) + d/ds (m v_x w n - 1/2 m w^2 x),

whose second term leaves at the tail tip what the wake carries away. Candelier, Boyer and Leroyer (J. Fluid Mech. 673,
2011) derive the same from the water's kinetic energy.
"""

import numpy as np

from benchmarks.reality.body import Chain, Pose
from benchmarks.reality.fluid import Flow, wet_half_height_m
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters


class ReactiveWater:
    """Elongated body theory's force on n simulations, each at its own share."""

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
