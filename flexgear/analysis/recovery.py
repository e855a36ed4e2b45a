"""Recovery of motions and forces in physical coordinates from saved samples.

A sample has modal coordinates η and pair loads. The channel forces f follow from the pair loads and
the contact rows at the sample's angle; then q = Φ η + R f, R the residual flexibility. Without
rigid rotation of the undeflected train, q_el = q − rolling · input_angles is elastic displacement
including wind-up.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.kernels.samples import all_forces
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import RotatingFrameSupport
from flexgear.model.bearings import at_height
from flexgear.structures.bodies import rotation

Result = Equilibrium | Transient
BLOCK = 128  # samples of one product, over which only few teeth of a ring are loaded


def channel_forces(result: Result) -> Array:
    """Forces (t, n_c) on the channels: on contact blocks, then torques on the ports, N and N·m."""
    modal = result.modal
    pairs, ports = modal.system.pairs, len(modal.system.ports)
    out = np.zeros((len(result.theta), len(modal.channels)))
    all_forces(
        packed(pairs),
        pair_rows(pairs),
        result.theta,
        result.active_flanks,
        (result.pair_load, result.far_load, result.support_load),
        out,
    )
    out[:, -ports:] = result.torques
    return out


def _in_blocks(forces: Array) -> list[tuple[NDArray[np.intp], Array]]:
    """Forces (t, n_c) in blocks of samples: indices of loaded channels, and their forces."""
    parts = []
    for start in range(0, len(forces), BLOCK):
        block = forces[start : start + BLOCK]
        loaded = np.flatnonzero(block.any(axis=0))
        parts.append((loaded, block[:, loaded]))
    return parts


@dataclass(frozen=True)
class Output:
    """A linear output with k components as matrices for the data of samples: modes (k, n),
    residual (k, n_c) for channel forces, rolling (k, F); basis (d, n): the modes of the system."""

    basis: Array
    modes: Array
    residual: Array
    rolling: Array


def output_of(modal: ModalSystem, rows: Array) -> Output:
    """The output with rows (k, d) on physical coordinates, most of whose entries are zero."""
    sparse, basis = csr_array(rows), modal.modes
    return Output(
        basis, sparse @ basis, sparse @ modal.residual_motion, sparse @ modal.system.rolling
    )


class Recovery:
    """Elastic motions and forces of a result, without storing q(t).

    outputs: cache of outputs by name, shared by the results of a system; forces (t, n_c): forces on
    the channels, computed if left out.
    """

    def __init__(
        self, result: Result, outputs: dict[str, Output] | None = None, forces: Array | None = None
    ) -> None:
        self.result = result
        self.modal: ModalSystem = result.modal
        self._outputs = {} if outputs is None else outputs
        self._forces = _in_blocks(channel_forces(result) if forces is None else forces)
        self._roll = np.zeros_like(result.eta[:, : len(self.modal.input_rows)])
        if isinstance(result, Transient):
            # input_angles are those of the kept modes; residual flexibility adds wind-up
            static = self.modal.system.input_rows @ self.modal.residual_motion
            self._roll = result.input_angles + self._motion_by_forces(static)

    @property
    def rotations(self) -> Array:
        """Independent rotations (t, F) of the undeflected train, relative to which q_el is, rad."""
        return self._roll if isinstance(self.result, Transient) else self.result.input_angles

    def motion(self, rows: Array) -> Array:
        """rows · q_el over samples, (t, k), for rows (k, d) on physical coordinates."""
        return self._value(output_of(self.modal, rows))

    def named(self, name: str, rows: Callable[[], Array]) -> Array:
        """``motion`` of rows whose output is cached under a name; rows: called on first use."""
        return self._value(self._output(name, rows))

    def of_blocks(self, blocks: NDArray[np.int64]) -> Array:
        """Motions (t, k, 6) of the system's blocks with numbers ``blocks`` (t, k)."""
        output = self._output("blocks", lambda: self.modal.system.blocks)
        out = np.empty((*blocks.shape, 6))
        for start, (loaded, forces) in zip(range(0, len(out), BLOCK), self._forces, strict=True):
            part = slice(start, start + BLOCK)
            numbers, at = np.unique(blocks[part], return_inverse=True)
            rows = (6 * numbers[:, None] + np.arange(6)).ravel()
            motion = self.result.eta[part] @ output.modes[rows].T
            motion += forces @ output.residual[np.ix_(rows, loaded)].T
            motion -= self._roll[part] @ output.rolling[rows].T
            places = at.reshape(len(motion), -1, 1)
            out[part] = np.take_along_axis(motion.reshape(len(motion), -1, 6), places, axis=1)
        return out

    def _output(self, name: str, rows: Callable[[], Array]) -> Output:
        """The output of a name from the cache, computed on first use."""
        output = self._outputs.get(name)
        if output is None or output.basis is not self.modal.modes:
            output = self._outputs[name] = output_of(self.modal, rows())
        return output

    def _value(self, output: Output) -> Array:
        out = self.result.eta @ output.modes.T + self._motion_by_forces(output.residual)
        return np.asarray(out - self._roll @ output.rolling.T)

    def _motion_by_forces(self, residual: Array) -> Array:
        """Motion (t, k) by the channel forces, with residual flexibility (k, n_c)."""
        out = np.empty((len(self.result.theta), len(residual)))
        for start, (loaded, forces) in zip(range(0, len(out), BLOCK), self._forces, strict=True):
            np.matmul(forces, residual[:, loaded].T, out=out[start : start + BLOCK])
        return out

    def node(self, body: str, node: str) -> Array:
        """Motion (t, 6) of a named node in its body's frame, m and rad."""
        return self.motion(self.modal.system.node_rows(body, node))

    def link_force(self, name: str) -> Array:
        """Force and moment (t, 6) in a link or bearing, in its axes, N and N·m; for carrier and sun
        bearings in carrier axes, also where their stiffness is fixed in the housing. In a joint
        those that its first member exerts on it, with its damper. KeyError for an unknown name."""
        for support in self.modal.system.rotating_frame_supports:
            if support.name == name:
                return self._turning_force(support) + self._law_force(name, support.rows)
        link = next((x for x in self.modal.system.links if x.name == name), None)
        if link is None:
            raise KeyError(name)
        force = self.named(f"link {name}", lambda: link.rows) @ link.matrix[:6].T
        if len(link.rows) == 6:
            return force + self._law_force(name, link.rows)
        return force + self._law_force(f"{name}_damper", link.rows[:6] - link.rows[6:])

    def _law_force(self, name: str, rows: Array) -> Array:
        """Force (t, 6) by the laws of a bearing, in the sense of the rows (6, d) of its spring."""
        pairs, at = self.modal.system.pairs, len(self.modal.system.pairs.support_stiffness)
        force = np.zeros((len(self.result.theta), 6))
        for bearing in self.modal.system.bearings:
            stop = at + len(bearing.components)
            if bearing.name == name:
                # rows of a spring may be outer minus inner ring, in the outer ring's frame
                sign = np.sign(np.sum(rows * (at_height(-bearing.z) @ bearing.relative)))
                by_law = np.zeros_like(force)
                by_law[:, bearing.components] = sign * self.result.support_load[:, at:stop]
                turned = by_law if sign < 0 else self._turned(bearing.angle, by_law, -1)
                force += turned @ at_height(bearing.z)
            at = stop
        assert at + len(pairs.load_block) == self.result.support_load.shape[1]
        return force

    def row_loads(self, names: Sequence[str]) -> Array:
        """Radial forces (t, names, rows) of the roller rows of bearings, N; NaN where a bearing has
        fewer rows. The last axis has the largest number of rows in the train, or length 0 if no
        named bearing has rollers."""
        rollers = {b.name: b.part_rows for b in self.modal.system.bearings if b.has_parts}
        rows = max(rollers.values()) if rollers.keys() & {*names} else 0
        out = np.full((len(self.result.theta), len(names), rows), np.nan)
        for i, name in enumerate(names):
            if name in rollers:
                load = self.bearing_loads(name)
                psi = 2 * np.pi * np.arange(load.shape[2]) / load.shape[2]
                out[:, i, : load.shape[1]] = np.abs(load @ np.exp(1j * psi))
        return out

    def bearing_loads(self, name: str) -> Array:
        """Loads (t, rows, parts) of the rollers or pads of a bearing with a nonlinear law, N;
        KeyError for an unknown name."""
        for bearing in self.modal.system.bearings:
            if bearing.name == name:
                inner = self._turned(bearing.angle, self.motion(bearing.rows), 1)
                motion = inner - self.motion(bearing.outer_rows)
                return bearing.part_loads(motion, self.result.theta)
        raise KeyError(name)

    def _turned(self, angle: int, vectors: Array, sense: int) -> Array:
        """Vectors (t, 6) rotated by the angle numbered ``angle`` of the system (−1: not rotated)
        times ``sense``, 1 or −1."""
        if angle < 0:
            return vectors
        turns = rotation(sense * self.result.theta[:, angle])
        return np.einsum("tij,tkj->tki", turns, vectors.reshape(-1, 2, 3)).reshape(-1, 6)

    def _turning_force(self, support: RotatingFrameSupport) -> Array:
        motion = self.named(
            f"support {support.name}", lambda: np.vstack([support.rows, support.housing])
        )
        closing = self._turned(support.angle, motion[:, :6], 1)
        closing -= self._turned(support.housing_angle, motion[:, 6:], 1)
        return self._turned(support.angle, closing @ support.matrix.T, -1)

    def coordinates(self, body: str) -> Array:
        """Elastic coordinates (t, n) of one body, for its displacement field; without the rotation
        of a turning FE ring against its hub."""
        system = self.modal.system
        motion = np.zeros((system.body(body).size, system.size))
        motion[:, system.slice_of(body)] = np.eye(len(motion))
        return self.motion(motion - np.outer(system.body(body).spin, system.ring_turn(body)))
