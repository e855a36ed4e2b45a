"""Headlines of stresses in teeth: roots and flanks."""

from __future__ import annotations

from collections.abc import Iterator

from flexgear.gears.flank_pressure import pitch_point_pressure
from flexgear.gears.geometry import stage_geometry
from flexgear.model.names import FlankName
from flexgear.results.report.sharing import own_variant
from flexgear.results.report.wording import with_unit, words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline

UNRATED = "Not assessed: no allowable stress given."


def _root_stress(findings: Findings) -> Iterator[Answer]:
    for stage, figures in findings.summary["stages"].items():
        stresses = {gear: f["max"] for gear, f in figures.get("root_stress_mpa", {}).items()}
        basis = "by finite elements, largest of the equilibria"
        if not stresses:
            stresses = figures.get("nominal_root_stress_mpa", {})
            basis = "nominal, of ISO 6336-3 without load factors"
        yield from _largest(stage, stresses, basis)


def _flank_pressure(findings: Findings) -> Iterator[Answer]:
    flanks = own_variant(findings.summary.get("face_load", {}))
    for stage in findings.summary["stages"]:
        pressures: dict[str, float] = {}
        for flank, figures in flanks.items():
            group = FlankName.parse(flank).group
            if group.stage == stage and "largest_contact_pressure_mpa" in figures:
                largest = figures["largest_contact_pressure_mpa"]
                pressures[group.part] = max(pressures.get(group.part, 0.0), largest)
        basis = "along the face, largest of the equilibria"
        if not pressures:
            view = findings.case.view(stage)
            geometry, forces = stage_geometry(view), findings.flow.stage(stage).gear_mesh_forces
            pressures = {
                role: pitch_point_pressure(view, geometry, role, force) / 1e6
                for role, force in forces.items()
                if role in geometry.gear_meshes and force
            }
            basis = "nominal at the pitch point, without load factors"
        yield from _largest(stage, pressures, basis)


def _largest(stage: str, stresses_mpa: dict[str, float], basis: str) -> Iterator[Answer]:
    """The largest stress of a stage, and the others beside it; none of a stage without load."""
    loaded = {words(name): size for name, size in stresses_mpa.items() if size > 0.0}
    if not loaded:
        return
    (name, size), *rest = sorted(loaded.items(), key=lambda item: -item[1])
    beside = "".join(f"; {other} {with_unit(1e6 * s, 'Pa')}" for other, s in rest)
    sentence = f"{name.capitalize()}, {basis}{beside}. {UNRATED}"
    yield Answer("open", stage, size, with_unit(1e6 * size, "Pa"), sentence)


ROOT_STRESS = Headline(
    "root_stress", "Root stress", "MPa", "largest stress in the roots of the teeth", "face",
    _root_stress,
)  # fmt: skip
FLANK_PRESSURE = Headline(
    "flank_pressure", "Flank pressure", "MPa", "largest Hertz pressure between flanks", "face",
    _flank_pressure,
)  # fmt: skip
