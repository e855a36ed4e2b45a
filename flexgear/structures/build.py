"""Ring and carrier of a case as reduced bodies: FE mesh, matrices, reduction, errors, cache."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.structures import estimate, probe_loads
from flexgear.structures.fe_mesh import (
    CarrierMeshParameters,
    FeMesh,
    RingMeshParameters,
    carrier_fe_mesh,
    read_fe_mesh,
    ring_fe_mesh,
)
from flexgear.structures.fem import FeModel, assemble
from flexgear.structures.interfaces import (
    carrier_interface,
    carrier_supports,
    ring_interface,
    ring_supports,
)
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.reduction import Progress, Reduction, reduce, silent
from flexgear.structures.store import cached, content_key
from flexgear.structures.tall import single_threaded_blas

FREQUENCY_LIMIT_HZ = 2000.0
_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


def ring_body(case: Case, progress: Progress | None = None) -> ReducedBody:
    """The case's ring gear, reduced; from the cache if it was reduced before."""
    report = progress or silent
    parameters, ring = ring_mesh_parameters(case), case.ring
    key = content_key(
        body="ring",
        fe_mesh=_mesh_content(ring.fe_mesh_file, ring.fe_mesh_unit, parameters, ring.fe_mesh),
        material=case.material.model_dump(),
        ties=[ring.tie, ring.tie_kind, ring.end, [f.z for f in ring.fits]],
        bolts=[
            ring.bolts.number,
            ring.bolts.circle_diameter,
            ring.bolts.diameter,
            ring.bolts.holes,
            ring.bolts.first_angle,
        ],
        teeth=[case.stage.ring.teeth, stage_geometry(case.stage).ring.reference_radius],
        modes=ring.fixed_interface_modes,
    )
    body = cached(key, lambda: _reduce_ring(case, report))
    return _judged(body, ring_supports(case, body))


def carrier_body(case: Case, progress: Progress | None = None) -> ReducedBody:
    """The case's planet carrier, reduced; from the cache if it was reduced before."""
    report = progress or silent
    parameters, carrier = carrier_mesh_parameters(case), case.carrier
    key = content_key(
        body="carrier",
        fe_mesh=_mesh_content(
            carrier.fe_mesh_file, carrier.fe_mesh_unit, parameters, carrier.fe_mesh
        ),
        material=case.material.model_dump(),
        pins=[list(case.stage.planet_angles), stage_geometry(case.stage).center_distance],
        modes=carrier.fixed_interface_modes,
    )
    body = cached(key, lambda: _reduce_carrier(case, report))
    at = slice(0, body.interface_dofs)
    return _judged(body, carrier_supports(case, body, body.stiffness[at, at]))


def ring_mesh_parameters(case: Case) -> RingMeshParameters:
    """What the ring's FE mesh takes from the case."""
    stage, ring = case.stage, case.ring
    return RingMeshParameters(
        teeth=stage.ring.teeth,
        normal_module=stage.normal_module,
        pressure_angle=stage.pressure_angle,
        helix_angle=abs(stage.helix_angle),
        hand="right" if stage.signed_helix_angle >= 0 else "left",
        profile_shift=stage.ring.profile_shift,
        addendum=stage.ring.addendum,
        dedendum=stage.ring.dedendum,
        root_fillet=stage.ring.root_fillet,
        face_width=stage.face_width,
        rim_thickness=ring.rim_thickness,
        bolts=ring.bolts.number,
        bolt_circle_diameter=ring.bolts.circle_diameter,
        bolt_diameter=ring.bolts.diameter,
        bolt_holes=ring.bolts.holes,
        first_bolt_angle=ring.bolts.first_angle,
        fits=tuple(fit.band for fit in ring.fits),
        fidelity=case.solver.fidelity,
    )


def carrier_mesh_parameters(case: Case) -> CarrierMeshParameters:
    """What the carrier's FE mesh takes from the case."""
    stage, carrier = case.stage, case.carrier
    geometry = stage_geometry(stage)
    return CarrierMeshParameters(
        planets=stage.planets,
        center_distance=geometry.center_distance,
        planet_tip_radius=geometry.planet.tip_radius,
        gear_face_width=stage.face_width,
        plate_diameter=carrier.plate_diameter,
        plate_thickness_drive=carrier.plate_thickness_drive,
        plate_thickness_far=carrier.plate_thickness_far,
        plate_gap=carrier.plate_gap,
        web_width=carrier.web_width,
        web_inner_radius=carrier.web_inner_radius,
        web_clearance=carrier.web_clearance,
        pin_diameter=carrier.pin_diameter,
        pin_bore=carrier.pin_bore,
        pin_seat_width=carrier.pin_seat_width,
        hub_outer_diameter=carrier.hub_outer_diameter,
        hub_bore=carrier.hub_bore,
        hub_length=carrier.hub_length,
        seat_drive_diameter=carrier.seat_drive.diameter,
        seat_drive_width=carrier.seat_drive.width,
        seat_far_diameter=carrier.seat_far.diameter,
        seat_far_width=carrier.seat_far.width,
        drive_side=carrier.drive_side,
        fidelity=case.solver.fidelity,
    )


def ring_mesh(case: Case) -> FeMesh:
    """The ring's FE mesh, generated or the user's own with its named groups checked."""
    ring = case.ring
    if ring.fe_mesh == "generate" or ring.fe_mesh_file is None:
        return ring_fe_mesh(ring_mesh_parameters(case))
    patches = [f"tooth_{ring.tie}_{j + 1:03d}" for j in range(case.stage.ring.teeth)]
    patches += [f"fit_{k + 1}" for k in range(len(ring.fits))]
    if ring.bolts.holes:
        patches += [f"bolt_{k + 1:02d}" for k in range(ring.bolts.number)]
    geometry = stage_geometry(case.stage)
    size = 2 * (geometry.ring.root_radius + ring.rim_thickness)
    return read_fe_mesh(ring.fe_mesh_file, ring.fe_mesh_unit, patches, size, "ring")


def carrier_mesh(case: Case) -> FeMesh:
    """The carrier's FE mesh, generated or the user's own with its named groups checked."""
    carrier, stage = case.carrier, case.stage
    if carrier.fe_mesh == "generate" or carrier.fe_mesh_file is None:
        equal = 2 * np.pi * np.arange(stage.planets) / stage.planets
        if not np.allclose(stage.planet_angles, equal, atol=1e-9):
            raise InputError(
                "carrier",
                "fe_mesh",
                "is generated for equally spaced planets only",
                "give a carrier mesh file with pins at the case's planet positions",
            )
        return carrier_fe_mesh(carrier_mesh_parameters(case))
    patches = ["drive", "bearing_drive", "bearing_far"]
    patches += [f"pin_{i + 1}" for i in range(stage.planets)]
    return read_fe_mesh(
        carrier.fe_mesh_file, carrier.fe_mesh_unit, patches, carrier.plate_diameter, "carrier"
    )


def _reduce_ring(case: Case, progress: Progress) -> ReducedBody:
    clock = _Clock()
    progress("ring: FE mesh", 0.0)
    fe_mesh = ring_mesh(case)
    clock.lap("fe_mesh")
    model = _assembled(case, fe_mesh, progress)
    interface = ring_interface(case, model)
    clock.lap("assembly")
    reduction = reduce(model, interface, case.ring.fixed_interface_modes, progress, "ring")
    clock.lap("reduction")
    supports = ring_supports(case, interface)
    flank = all(f"tooth_flank_{j + 1:03d}" in fe_mesh.facets for j in range(case.stage.ring.teeth))
    teeth = case.stage.ring.teeth
    probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
    loads = probe_loads.tooth_lines(model, probed, case.stage.face_width) if flank else []
    return _estimated(
        reduction,
        supports,
        loads,
        clock,
        progress,
        tie=case.ring.tie,
        tie_kind=case.ring.tie_kind,
        fidelity=case.solver.fidelity,
    )


def _reduce_carrier(case: Case, progress: Progress) -> ReducedBody:
    clock = _Clock()
    progress("carrier: FE mesh", 0.0)
    fe_mesh = carrier_mesh(case)
    clock.lap("fe_mesh")
    model = _assembled(case, fe_mesh, progress)
    interface = carrier_interface(case, model)
    clock.lap("assembly")
    reduction = reduce(model, interface, case.carrier.fixed_interface_modes, progress, "carrier")
    clock.lap("reduction")
    supports = carrier_supports(case, interface, reduction.condensation.stiffness)
    angles = np.asarray(case.stage.planet_angles)
    loads = probe_loads.pin_pressures(model, case.stage.planets, angles)
    return _estimated(
        reduction,
        supports,
        loads,
        clock,
        progress,
        tie="surface",
        tie_kind="averaging",
        fidelity=case.solver.fidelity,
    )


def _assembled(case: Case, fe_mesh: FeMesh, progress: Progress) -> FeModel:
    progress("stiffness and mass", 0.0)
    m = case.material
    return assemble(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)


def _estimated(
    reduction: Reduction,
    supports: NDArray[np.float64],
    loads: Sequence[probe_loads.ProbeLoad],
    clock: _Clock,
    progress: Progress,
    **options: Any,
) -> ReducedBody:
    """The reduced body with its error estimates in the report."""
    progress("static check", 0.0)
    with single_threaded_blas():
        static = estimate.compare_static(reduction, supports, loads) if loads else None
        frequencies = estimate.compare_frequencies(
            reduction, supports, FREQUENCY_LIMIT_HZ, progress
        )
    clock.lap("estimates")
    report = {
        **reduction.body.report,
        **options,
        "supports_key": content_key(supports=supports),
        "static_end_share": probe_loads.END_SHARE,
        "static_error": static.error if static else None,
        "static_error_cases": static.of_largest if static else {},
        "static_error_each": static.of_each if static else {},
        "frequency_error": frequencies.error,
        "frequency_limit_hz": FREQUENCY_LIMIT_HZ,
        "frequencies_below_limit": len(frequencies.full),
        "supported_frequency_min_hz": float(frequencies.full.min(initial=np.inf)),
        "seconds": clock.laps,
    }
    return reduction.body.with_(report=report)


def _judged(body: ReducedBody, supports: NDArray[np.float64]) -> ReducedBody:
    """The body, its report saying whether the error estimates stood on these very supports.

    Supports are not part of the cache's key: other bolts or bearings need no new reduction.
    """
    same = body.report["supports_key"] == content_key(supports=supports)
    return body.with_(report={**body.report, "estimated_on_these_supports": same})


class _Clock:
    """Wall time of stages, s."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name], self._last = now - self._last, now


def _mesh_content(file: str | None, unit: str, parameters: object, kind: str) -> object:
    """What a mesh depends on: the generator's parameters, or the bytes of the user's file."""
    if kind == "generate" or file is None:
        return parameters
    try:
        return ["file", unit, hashlib.sha256(Path(file).read_bytes()).hexdigest()]
    except OSError as error:
        raise InputError(
            "case", "fe_mesh_file", f"{file}: {error.strerror}", "check the path"
        ) from None
