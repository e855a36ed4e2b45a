"""The model for scripts and notebooks: equilibria, modes, transients, fields of bodies."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.face import accessor as accessor  # datasets have ``.fg`` from here on
from flexgear.face.notebook import Progress, html_table, progress_or_bars, with_bars
from flexgear.model.arguments import Numbers, Positive, checked
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearWarning, InputError, echo
from flexgear.model.load import load_case
from flexgear.model.machine import TorqueHistory
from flexgear.model.read import nearest
from flexgear.results.dataset_file import chosen, dataset_file, reopened
from flexgear.results.sinks import TIME, MemorySink
from flexgear.solve import deformed, model, static, transient
from flexgear.solve.angles import lead_angles, reference_member
from flexgear.solve.bodies import Bodies, silent
from flexgear.solve.campbell import campbell
from flexgear.solve.linear_response import linear_response
from flexgear.solve.modes import modes, usual_limit
from flexgear.solve.response import response
from flexgear.solve.stability import stability


@dataclass(frozen=True, repr=False, eq=False)
class Model(model.Model):
    """The coupled bodies of a case, made by ``Case.assemble``.

    Angles are rotations of a member in degrees; all other members turn in rated proportion. Where
    no member is named they are those of the reference member: the first port of a stated speed that
    is not zero.
    """

    rigid_parts: tuple[str, ...] = ()

    @property
    def reference_member(self) -> str:
        """The member whose rotation positions refer to: "stage.carrier"."""
        return reference_member(self.case, self.flow)

    @checked
    def rigid(self, *parts: str) -> Model:
        """A model with more rigid bodies.

        parts: "ring", "carrier", "planet", "shaft" of all flexible stages, "stage_1.ring" of one;
        all bodies if left out.
        """
        names = (*self.rigid_parts, *(parts or ("all",)))
        other = assembled(self.case, names, bodies=self.bodies)
        return other.without_errors() if self.ideal else other

    @checked
    def static(
        self,
        angle_deg: Numbers = 0.0,
        *,
        member: str = "",
        torque: float | None = None,
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Equilibria at angles (p,) of a member, positive in its rated sense.

        torque: on the first input, N m, the others in rated proportion; rated torques if left out.
        """
        angles = self._reference_angles(angle_deg, member)
        return static.static(self, angles, torque, progress_or_bars(progress))

    @checked
    def modes(
        self, limit_hz: Positive | None = None, *, angle_deg: float | None = None, member: str = ""
    ) -> xr.Dataset:
        """Undamped modes at zero speed, merged with the frequencies over speed of ``campbell``.

        limit_hz: highest frequency; if left out the band of interest, or all of a lumped train.
        angle_deg: rotation at which the stiffness of gear meshes is taken, without frequencies over
        speed; if left out gear meshes have their mean stiffness over a gear-mesh cycle.
        """
        limit = usual_limit(self) if limit_hz is None else limit_hz
        angle = self._reference_angle(angle_deg or 0.0, member)
        if angle_deg is not None:
            return modes(self, angle=angle, limit_hz=limit)
        over_speed = campbell(self, limit_hz=limit)
        at_rest = modes(self, limit_hz=limit)
        return at_rest.merge(over_speed).assign_attrs({**at_rest.attrs, **over_speed.attrs})

    # analyses of a model as they are, with checked arguments
    campbell = checked(campbell, "Model.")
    stability = with_bars(checked(stability, "Model."))
    linear_response = with_bars(checked(linear_response, "Model."))
    response = with_bars(checked(response, "Model."))

    @checked
    def transient(
        self,
        duration: Positive | None = None,
        *,
        drive: TorqueHistory | Mapping[str, object] | None = None,
        torque_share: float = 1.0,
        output_interval: Positive | None = None,
        energy: bool = False,
        fields: Sequence[str] = (),
        out: str | Path | None = None,
        save: Sequence[str] = (),
        progress: Progress | None = None,
        start: xr.Dataset | None = None,
    ) -> xr.Dataset:
        """A transient under the machines at the ports, from static equilibrium.

        duration: s; if left out start-up and a turn of the slowest stage, or longer until vibration
        from the start decays. drive: torque of the first input in the place of the case's, by the
        keys of [drive], {"kind": "ramp", "times_s": [0, 1], "torques_nm": [0, 100]}, all other
        machines at rated torque or speed.
        torque_share: factor on all torques. output_interval: s between samples. energy: add the
        energy balance. fields: FE bodies whose coordinates are saved, for ``deformed``. out: netCDF
        file to which samples are written during the run, so that memory does not grow with the
        duration; save: variables over time that are saved, all if none is named. start: a transient
        of this train, also under other machines, from whose last state this one continues.
        InputError where the run would be too long, FlexgearError where the motion diverges.
        """
        for text in transient.fault_warnings(self, duration):
            warnings.warn(text, FlexgearWarning, stacklevel=2)
        if isinstance(drive, Mapping):
            drive = load_case(self.case, {"drive": drive}).drive
        simulate = partial(
            transient.simulate,
            self,
            duration=duration,
            drive=drive,
            torque_share=torque_share,
            output_interval=output_interval,
            energy=energy,
            fields=fields,
            progress=progress_or_bars(progress),
            start=start,
        )
        if out is None:
            samples = MemorySink(lambda data: chosen(data, save) if TIME in data.dims else data)
            simulate(sink=samples)
            return samples.data
        with dataset_file(out, save) as sink:
            simulate(sink=sink)
        return reopened(out)

    @checked
    def deformed(
        self,
        body: str,
        angle_deg: float = 0.0,
        *,
        member: str = "",
        torque: float | None = None,
        run: xr.Dataset | None = None,
        time: float = 0.0,
    ) -> xr.Dataset:
        """Displacement (p, 3) m and stress (p, 6) Pa at the vertices of a body's FE mesh.

        body: "stage.ring". The state is the equilibrium at an angle under ``torque``, N m on the
        first input; or the sample nearest to ``time``, s, of the transient ``run``, which must have
        saved the body (``fields=["stage.ring"]``). Rigid rotation of the train is subtracted;
        stress is smoothed where the mesh does not resolve it, as in tooth roots.
        """
        angle = self._reference_angle(angle_deg, member)
        return deformed.deformed(self, body, angle, torque, run=run, time=time)

    @checked
    def mode_field(
        self,
        body: str,
        mode: int,
        *,
        angle_deg: float | None = None,
        member: str = "",
        largest: Positive = 1e-3,
    ) -> xr.Dataset:
        """Displacement (p, 3) m and stress (p, 6) Pa of a body in a natural mode.

        mode: number from 1, rigid rotations first, as in ``modes``; angle_deg: as in ``modes``;
        largest: largest displacement of a vertex, m. InputError for an unknown mode, or one in
        which the body does not move.
        """
        angle = None if angle_deg is None else self._reference_angle(angle_deg, member)
        return deformed.mode_field(self, body, mode, angle, largest)

    def _reference_angles(self, angle_deg: Numbers, member: str) -> NDArray[np.float64]:
        """Rotations (p,) of the reference member, rad; InputError if ``member`` does not turn."""
        angles = np.radians(np.atleast_1d(np.asarray(angle_deg, dtype=float)))
        if not member:
            return angles
        turning = [name for name, speed in self.flow.speed.items() if speed != 0]
        if member not in turning:
            raise InputError("--member", echo(member), "does not turn", nearest(member, turning))
        return lead_angles(self.case, self.flow, angles, member)

    def _reference_angle(self, angle_deg: float, member: str) -> float:
        return float(self._reference_angles(angle_deg, member)[0])

    def _repr_html_(self) -> str:
        return html_table({**self.facts, "angles of": self.reference_member})


def assembled(
    case: Case, rigid: Sequence[str], *, bodies: Bodies | None = None, progress: Progress = silent
) -> Model:
    """The model of a case; bodies: reduced ones of another model of the case."""
    plain = model.assemble(case, rigid, bodies=bodies, progress=progress)
    of_plain = {field.name: getattr(plain, field.name) for field in fields(plain)}
    return Model(**of_plain, rigid_parts=tuple(rigid))
