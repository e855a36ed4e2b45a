"""Figures of steady states: stability, forces, transmission errors, bearings and sensors."""

import math
import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.harmonic_balance import Balance, Orbit, in_time
from flexgear.analysis.kernels.samples import empty_pair_loads
from flexgear.analysis.orbit_receptance import CondensedTrain, Range
from flexgear.analysis.recovery import Output, Recovery
from flexgear.analysis.stability import (
    fewer_steps,
    monodromy,
    multipliers,
    vibration_matrices,
    without_following_modes,
)
from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearWarning
from flexgear.solve.bodies import Progress
from flexgear.solve.dataset import support_names
from flexgear.solve.model import Model

MEASURES = ("maximum", "minimum", "mean", "rms")
# of a period for the monodromy matrix, as far as there are samples: in all, and for every harmonic
MIN_STEPS, STEPS = 256, 8
FIRST_STATES, STATES = 4, (50, 150)  # that are timed, and of a curve
LONG = 120.0  # of a curve, s, to be announced
START, FIRST = "response, start", "response, first states"
STABLE = 1e-5  # excess over 1 allowed for multipliers of stable states: undamped modes have |μ| = 1


@dataclass(frozen=True)
class State(Orbit):
    """A steady state without histories over time; values: its variables of the dataset."""

    values: dict[str, Any]


class Figures:
    """Figures of the states of one train. Reports the share of the range that the current curve has
    covered; the number of curves is not known in advance."""

    def __init__(
        self, model: Model, train: CondensedTrain, span: Range, progress: Progress, curve: int = 1
    ) -> None:
        self.model, self.train, self.span, self.progress = model, train, span, progress
        elements = train.elements
        stage = model.case.stages[elements.stage].name
        self.gear_meshes = model.gear_meshes.of_stage(stage)
        carrying = model.gear_meshes.carrying[self.gear_meshes]
        opposite = model.system.pairs.opposite[carrying]
        self.rows = np.array([elements.mean_row(int(m)) for m in carrying])
        self.drive = elements.owner[:, :, None] == carrying
        self.coast = (elements.owner[:, :, None] == opposite) & (opposite >= 0)
        self.supports = support_names(model)
        self.curve, self._covered = curve, (math.inf, -math.inf)
        # at which the first states of the first curve were known, and duration of figures, s
        self._times, self._duration = list[float](), 0.0

    def end_curve(self) -> None:
        """Report the end of a curve; the next state belongs to the next curve."""
        if self.curve == 1 and len(self._times) < FIRST_STATES:
            self.progress(FIRST, 1.0)
        self.progress(f"response, curve {self.curve}", 1.0)
        self.curve, self._covered = self.curve + 1, (math.inf, -math.inf)

    def take(self, orbit: Orbit) -> State:
        """The state with its figures, without histories over time."""
        begin = time.monotonic()
        values = {
            "response_period": self.train.elements.gear_meshes,
            **self._stability(orbit), **self._of_gear_meshes(orbit), **self._recovered(orbit),
        }  # fmt: skip
        self._duration = time.monotonic() - begin
        self._report(self.span.value(orbit.point))
        return State(**vars(orbit.without_histories), values=values)

    def beyond(self, share: float) -> None:
        """Report the share of a curve outside the range that is known."""
        if not self._timed(self._duration):
            self.progress(f"response, curve {self.curve} beyond the range", min(share, 1.0))

    def _report(self, value: float) -> None:
        """Report the share of the range covered by the curve with a state at λ = ``value``."""
        low, high = self._covered
        low, high = self._covered = min(low, value), max(high, value)
        if not self._timed():
            share = (high - low) / (self.span.high - self.span.low)
            self.progress(f"response, curve {self.curve}", min(share, 0.999))

    def _timed(self, missing: float = 0.0) -> bool:
        """Whether a state is one of the first, which are timed; with the last one a long response
        is announced. missing: seconds that the figures of such a state would take."""
        if self.curve > 1 or len(self._times) == FIRST_STATES:
            return False
        self._times.append(time.monotonic())
        if len(self._times) == 1:
            self.progress(START, 1.0)
        self.progress(FIRST, (len(self._times) - 1) / (FIRST_STATES - 1))
        if len(self._times) == FIRST_STATES:
            each = (self._times[-1] - self._times[0]) / (FIRST_STATES - 1)
            each, (fewest, most) = each + missing, STATES
            if most * each > LONG:
                warnings.warn(
                    f"a steady state takes {each:.2g} s, a curve of {fewest} to {most} states "
                    f"{fewest * each / 60:.0f} to {most * each / 60:.0f} min, and there may be "
                    f"several: fewer --harmonics than {self.train.harmonics}, a shorter range, "
                    "--doublings 0 and --rigid are quicker; --linear takes seconds",
                    FlexgearWarning,
                    stacklevel=2,
                )
        return True

    def _stability(self, orbit: Orbit) -> dict[str, Any]:
        period = 1.0 / (self.train.elements.frequency * orbit.point.speed)
        elements, waves = self.train.elements, orbit.waves
        tangents = elements.tangents_around(*waves, period)
        steps = fewer_steps(tangents, max(STEPS * self.train.harmonics, MIN_STEPS))
        part = vibration_matrices(self.train, orbit.point)
        part = without_following_modes(part, period, steps)
        largest = multipliers(monodromy(part, period, steps))
        first = largest[0] if len(largest) else 0.0
        return {
            "stable": int(abs(first) <= 1.0 + STABLE),
            "multiplier_real": float(np.real(first)),
            "multiplier_imag": float(np.imag(first)),
        }

    def _of_gear_meshes(self, orbit: Orbit) -> dict[str, Any]:
        force = np.einsum("jn,jnm->jm", orbit.force, self.drive)
        coast_force = np.einsum("jn,jnm->jm", orbit.force, self.coast)
        closed = (orbit.displacement[:, :, None] > 0.0) & self.drive
        closing = orbit.waves.motion @ self.rows.T
        return {
            **_measured("response_gear_mesh_force", force - coast_force, self.train.harmonics),
            **_measured("response_transmission_error", closing, self.train.harmonics),
            "lost_contact_share": 1.0 - closed.any(axis=1).mean(axis=0),
            "back_contact_share": (coast_force > 0.0).mean(axis=0),
        }

    def _recovered(self, orbit: Orbit) -> dict[str, Any]:
        """Variables of bearings and sensors."""
        sensors, harmonics, out = self.model.sensors, self.train.harmonics, dict[str, Any]()
        if not self.supports and sensors is None:
            return out
        balance = Balance(self.train.elements, self.train.at(orbit.point))
        recovery = recovery_of(self.train, balance, orbit, self.model.outputs)
        if self.supports:
            forces = np.stack([recovery.link_force(name)[:, :2] for name in self.supports], axis=1)
            size = np.linalg.norm(forces, axis=2)
            out |= _measured("response_bearing_force", size, harmonics)
        if sensors is not None:
            signals = sensors.periodic(recovery, balance.receptance.omega)
            out |= _measured("response_sensor", signals, harmonics)
        return out


def _measured(name: str, values: Array, harmonics: int) -> dict[str, Array]:
    """Measures (k, 4) and amplitudes (k, H) of values (N, k) over a period."""
    mean = values.mean(axis=0)
    rms = np.sqrt(np.mean((values - mean) ** 2, axis=0))
    spectrum = 2.0 * np.abs(np.fft.rfft(values, axis=0))[1 : harmonics + 1] / len(values)
    measures = np.stack([values.max(axis=0), values.min(axis=0), mean, rms], axis=1)
    return {name: measures, f"{name}_amplitude": spectrum.T}


def recovery_of(
    train: CondensedTrain, balance: Balance, orbit: Orbit, outputs: dict[str, Output]
) -> Recovery:
    """Elastic motions and forces at the N samples of a steady state's period, with all frames at
    angle zero and without loads of single tooth pairs."""
    elements, modal = train.elements, train.modal
    f, a = balance.parts(orbit.unknown)
    eta, linear_forces = _harmonics(train, orbit, f, a)
    constant, count, q = train.constant_forces(orbit.point), elements.samples, f.shape[1]
    forces = in_time(np.hstack([f, linear_forces]), count) @ train.rows + constant
    system, pairs = modal.system, modal.system.pairs
    ports = len(system.ports)
    loads = empty_pair_loads(pairs, count)
    bearings = elements.bearing_rows
    first = q - len(bearings)
    loads.support_load[:, bearings] = -in_time(f[:, first:], count)
    dampers = np.flatnonzero(elements.springs.number >= 0)
    at = elements.springs.number[dampers]
    loads.support_load[:, at] = -in_time(linear_forces[:, dampers], count)
    result = Equilibrium(
        modal=modal,
        theta=np.zeros((count, len(system.angles))),
        torques=forces[:, -ports:].copy(),
        eta=in_time(eta, count),
        active_flanks=np.broadcast_to(elements.flanks, (count, len(elements.flanks))),
        input_angles=np.zeros((count, len(system.input_rows))),
        closure=np.zeros(count),
        **loads._asdict(),
    )
    return Recovery(result, outputs, forces)


def _harmonics(
    train: CondensedTrain, orbit: Orbit, f: Complex, a: Array
) -> tuple[Complex, Complex]:
    """Modal coordinates (H + 1, n) and forces (H + 1, s) on the linear rows of a steady state."""
    modal, point, q = train.modal, orbit.point, f.shape[1]
    r, harmonics = modal.rigid_count, len(f) - 1
    w = 2 * np.pi * train.elements.frequency * point.speed * np.arange(1.0, harmonics + 1)
    response = train.modal_response(w, point.speed)
    receptance = train.modes @ response + train.residual
    linear_forces = np.zeros((harmonics + 1, len(train.linear)), dtype=complex)
    by_unit_forces = train.linear_row_forces(receptance, w, point)
    linear_forces[1:] = np.einsum("hsq,hq->hs", by_unit_forces, f[1:])
    constant = train.constant_forces(point)
    flexibility, under_load = train.static_motions(point, constant)
    rigid = train.modes[q:, :r] @ train.rigid_basis @ a
    motion = flexibility[q:, :q] @ f[0].real + rigid + under_load[q:]
    k, eye = train.static_stiffness, np.eye(len(train.static_stiffness))
    linear_forces[0] = -np.linalg.solve(eye + k[:, None] * flexibility[q:, q:], k * motion)
    forces = np.hstack([f, linear_forces])
    eta = np.zeros((harmonics + 1, len(modal.omega)), dtype=complex)
    eta[1:] = np.einsum("hnq,hq->hn", response, forces[1:])
    mean = train.modes.T @ forces[0].real + modal.channel_modes.T @ constant
    operator = train.operator(np.zeros(1), point.speed)[0].real
    elastic = operator[r:] if operator.ndim == 1 else operator[r:, r:]
    eta[0, r:] = mean[r:] / elastic if elastic.ndim == 1 else np.linalg.solve(elastic, mean[r:])
    eta[0, :r] = train.rigid_basis @ a
    return eta, linear_forces
