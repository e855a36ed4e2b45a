"""Every key of ``summary.json``: path, unit, meaning, and whether it must be there.

``docs`` lists these, `json_schema` is made of them, and `lacking` holds a summary to them. In a path
angle brackets stand for names that the case has. Units end the names; what has no number is null.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

VERSION = 3  # of the schema; 2 had a kind, and no stage above figures of an only flexible one
ALWAYS: Literal["always"] = "always"
WITH_SECTION: Literal["with its section"] = "with its section"
FREE = ("<figure>", "<key>")  # any value, with parts or without


class Key(NamedTuple):
    """unit: "" where it is no number; needed: always, where the section that it begins with is
    there, or not."""

    path: str
    unit: str
    meaning: str
    needed: Literal["", "always", "with its section"] = ""

    @property
    def names(self) -> list[str]:
        """Names on the way to it."""
        return self.path.split(".")


KEYS: tuple[Key, ...] = (
    Key("case", "", "name of the case", ALWAYS),
    Key("result", "", "\"run\""),
    Key("version", "", "of flexgear", ALWAYS),
    Key("content_hash", "", "SHA-256 of the case", ALWAYS),
    Key("schema_version", "", "of this list of keys; earlier runs have none"),
    Key("variant", "", "what bends in it", ALWAYS),
    Key("equilibrium_window", "", "what the positions of the equilibria cover, in words"),
    Key("errors_given", "", "whether any gear, pin or carrier has errors"),
    Key("system.bodies", "1", "bodies of the coupled system", ALWAYS),
    Key("system.coordinates", "1", "its coordinates", ALWAYS),
    Key("system.kept_modes", "1", "elastic modes that equilibria and transients keep", ALWAYS),
    Key("system.modes_limit_hz", "Hz", "highest of them; null: all", ALWAYS),
    Key("system.modes_band_hz", "Hz", "where bodies bend, up to which they are to be accurate"),
    Key("system.modes_estimate", "1", "largest relative error of what they leave out within this band", ALWAYS),
    Key("power_flow.mobility", "1", "rotations that may be chosen", ALWAYS),
    Key("power_flow.input_power_w", "W", "power that enters", ALWAYS),
    Key("power_flow.circulating_power_w", "W", "power that circulates"),
    Key("power_flow.members.<member>.speed_rpm", "1/min", "rated speed", ALWAYS),
    Key("power_flow.members.<member>.torque_on_stage_nm", "N m", "torque of the rest of the train on the member"),
    Key("power_flow.members.<member>.power_into_stage_w", "W", "its power"),
    Key("power_flow.members.<member>.outside_torque_nm", "N m", "torque from outside, where there may be one"),
    Key("stages.<stage>.kind", "", "\"planetary\" or \"parallel\""),
    Key("stages.<stage>.gear_mesh_frequency_hz", "Hz", "at rated speed", ALWAYS),
    Key("stages.<stage>.rolling_power_w", "W", "power through the gear meshes, seen from the carrier"),
    Key("stages.<stage>.sun_gear_mesh_force_n", "N", "mean rated force of a sun-planet gear mesh, or of pinion and gear", ALWAYS),
    Key("stages.<stage>.ring_gear_mesh_force_n", "N", "that of a ring-planet gear mesh"),
    Key("stages.<stage>.planet_bearing_force_n", "N", "mean rated force of a planet on its pin"),
    Key("stages.<stage>.planet_speed_in_carrier_rpm", "1/min", "rated speed of the planets against the carrier"),
    Key("stages.<stage>.nominal_planet_bearing_life_h", "h", "L₁₀ₕ of the planets' bearings under this force, where they have a rating"),
    Key("stages.<stage>.error_cycle_gear_meshes", "1", "gear-mesh cycles until errors come back together"),
    Key("stages.<stage>.nominal_root_stress_mpa.<gear>", "MPa", "see below"),
    Key("stages.<stage>.root_stress_mpa.<gear>.max", "MPa", "largest stress in the fillets, of `gear_mesh.root_stress = \"fe\"`"),
    Key("stages.<stage>.root_stress_mpa.<gear>.min", "MPa", "least stress there"),
    Key("stages.<stage>.root_stress_mpa.<gear>.range", "MPa", "how far it ranges at one place of the fillet, the worst one"),
    Key("stages.<stage>.carrier_bearing_force_n.<seat>", "N", "see below"),
    Key("stages.<stage>.bearing_life_h.<bearing>", "h", "see below"),
    Key("modes.lowest", "", "frequency_hz, type and multiplicity of the lowest twelve", ALWAYS),
    Key("modes.types.<type>", "1", "how many modes there are of each type", ALWAYS),
    Key("resonance.margin", "1", "share of a natural frequency within which an excitation at an operating speed meets it", ALWAYS),
    Key("resonance.speed_factors", "1", "these speeds over rated speed", ALWAYS),
    Key("resonance.orders.<stage>", "1", "orders of the gear-mesh frequency that are looked at", ALWAYS),
    Key("resonance.unknown_spectrum", "", "stages whose gear-mesh stiffness hardly varies, so that it tells no orders"),
    Key("resonance.ideal", "1", "meetings in which a stage of equal planets is excited", ALWAYS),
    Key("resonance.errors", "1", "meetings that take unequal planets, run-out or unbalance", ALWAYS),
    Key("resonance.met", "", "the first 24 of both: excitation, frequencies, modes, how far they are apart, nodal index k of the modes and of the order, cause, force_share as `meeting_force`", ALWAYS),
    Key("load_sharing.quasi_static.<variant>.<stage>.error_cycle_gear_meshes", "1", "gear-mesh cycles of the whole error cycle"),
    Key("load_sharing.quasi_static.<variant>.<stage>.gear_meshes_looked_at", "1", "how many of them were sampled"),
    Key("load_sharing.quasi_static.<variant>.<stage>.complete", "", "whether these were all"),
    Key("load_sharing.quasi_static.<variant>.<stage>.<group>.<definition>", "1", "load sharing coefficient of equilibria", ALWAYS),
    Key("load_sharing.transient.<variant>.<group>.<definition>", "1", "that of the transient in its window", ALWAYS),
    Key("load_sharing.transient.<variant>.window_s", "s", "the window of this variant"),
    Key("load_sharing.transient.<variant>.settled", "", "whether it has settled, as in `transient`"),
    Key("load_sharing.transient.<variant>.settling", "", "how that is known"),
    Key("transient.duration_s", "s", "simulated time", ALWAYS),
    Key("transient.window_s", "s", "start and end of the part of the run that the figures are of: from when it has settled; all of it where it has not"),
    Key("transient.settled", "", "whether it has settled; null where that was given, or cannot be told"),
    Key("transient.settling", "", "how that is known"),
    Key("transient.steps", "1", "time steps", ALWAYS),
    Key("transient.gear_mesh_force.<group>.min_n", "N", "least force of a gear mesh"),
    Key("transient.gear_mesh_force.<group>.mean_n", "N", "mean"),
    Key("transient.gear_mesh_force.<group>.max_n", "N", "largest"),
    Key("transient.displacement_um_max.<member>", "µm", "largest distance of a central member from the axis", ALWAYS),
    Key("motion_um_max.<member>", "µm", "largest displacement of a member from the axis, or of the teeth of an FE ring from their places, in equilibria and in the transient"),
    Key("harmonic.reason", "", "why there is no harmonic solution"),
    Key("harmonic.frequencies_hz", "Hz", "frequencies that excite the train"),
    Key("harmonic.largest_difference", "1", "largest difference to the transient over the largest force"),
    Key("harmonic.load_sharing.<group>.<definition>", "1", "load sharing coefficient of the harmonic solution"),
    Key("torque_steps.<torque>.<variant>.window_s", "s", "start and end of the part that the figures are of: from the drop on"),
    Key("torque_steps.<torque>.<variant>.speed_rpm_min.<member>", "1/min", "slowest speed of members of given speed", ALWAYS),
    Key("torque_steps.<torque>.<variant>.gear_mesh_force.<group>.min_n", "N", "least force of a gear mesh"),
    Key("torque_steps.<torque>.<variant>.gear_mesh_force.<group>.mean_n", "N", "mean"),
    Key("torque_steps.<torque>.<variant>.gear_mesh_force.<group>.max_n", "N", "largest", ALWAYS),
    Key("torque_steps.<torque>.<variant>.load_sharing.<group>", "1", "largest momentary load sharing factor", ALWAYS),
    Key("torque_steps.<torque>.<variant>.<stage>.carrier_speed_rpm_min", "1/min", "slowest speed of the carrier, of FE rings"),
    Key("torque_steps.<torque>.<variant>.<stage>.tooth_load_n_min", "N", "least load of a pair on the flank that carries"),
    Key("torque_steps.<torque>.<variant>.<stage>.load_sharing_max", "1", "largest load sharing factor at the ring"),
    Key("torque_steps.<torque>.<variant>.<stage>.planet_force_spread_max", "1", "largest (max F − min F) / rated mean F at the ring"),
    Key("headlines", "", "answers of the first screen of the report, the worst first: see below"),
    Key("neglected", "", "headline figures that are not ten times as large as an effect that is left out: `figure`, `stage`, `value_um` or `load_sharing`, `effects_um`, `sentence` (which is among `warnings`, too)"),
    Key("energy_residual", "1", "largest imbalance of the energy balance; null without one", ALWAYS),
    Key("equilibrium_closure_max", "1", "largest imbalance of an equilibrium"),
    Key("solver.<key>", "", "steps, samples, bands as they follow from the case, with reasons"),
    Key("warnings", "", "what a reader should know", ALWAYS),
    Key("timing_s.<part>", "s", "wall time", ALWAYS),
    Key("realtime_factor", "1", "simulated time over processor time of the transient", ALWAYS),
    Key("fe.<body>.dofs", "1", "of the FE mesh", WITH_SECTION),
    Key("reduction.<body>.<figure>", "1, Hz", "interface dofs, modes, `static_error`, `frequency_error` up to `frequency_limit_hz`, tie, fidelity"),
    Key("second_reduction.<variant>.<figure>", "1, Hz", "as in system, by variant", WITH_SECTION),
    Key("kinematics.<stage>.carrier_speed_rpm", "1/min", "rated", WITH_SECTION),
    Key("kinematics.<stage>.pin_speed_rpm", "1/min", "rated, of the pins against the ring", WITH_SECTION),
    Key("kinematics.<stage>.sun_speed_rpm", "1/min", "rated", WITH_SECTION),
    Key("kinematics.<stage>.gear_mesh_frequency_hz", "Hz", "rated", WITH_SECTION),
    Key("kinematics.<stage>.contact_ratio_ring", "1", "total, ring on planet", WITH_SECTION),
    Key("kinematics.<stage>.contact_ratio_sun", "1", "total, sun on planet", WITH_SECTION),
    Key("kinematics.<stage>.expected_ring_mesh_force_n", "N", "mean rated force of a ring-planet gear mesh", WITH_SECTION),
    Key("kinematics.<stage>.planet_bearing_force_n", "N", "mean rated force of a planet on its pin"),
    Key("steady.<stage>.window_s", "s", "the window of the transient that the figures are of"),
    Key("steady.<stage>.settled", "", "whether it has settled, as in `transient`"),
    Key("steady.<stage>.settling", "", "how that is known"),
    Key("steady.<stage>.carrier_speed_rpm_mean", "1/min", "in the transient", WITH_SECTION),
    Key("steady.<stage>.ring_mesh_force_n_mean", "N", "in the transient, mean of all planets", WITH_SECTION),
    Key("steady.<stage>.ring_pairs_in_contact.<number>", "1", "share of time with so many pairs in contact", WITH_SECTION),
    Key("steady.<stage>.tooth_displacement_peak_um.<axis>", "µm", "largest displacement of ring tooth 1", WITH_SECTION),
    Key("steady.<stage>.radial_harmonics_um", "µm", "amplitudes 0 … 20 of the ring's shape in the first equilibrium without errors", WITH_SECTION),
    Key("steady.<stage>.load_sharing.<variant>.mean", "1", "mean load sharing factor at the ring", WITH_SECTION),
    Key("steady.<stage>.load_sharing.<variant>.max", "1", "largest", WITH_SECTION),
    Key("steady.<stage>.equilibrium_closure_max", "1", "largest imbalance of an equilibrium"),
    Key("steady.<stage>.rim_stress_mpa.<figure>", "MPa", "see below"),
    Key("steady.<stage>.inertia_kg_m2.<end>", "kg m²", "inertias at the ports"),
    Key("face_load.<variant>.<flank>.k_h_beta", "1", "K_Hβ, largest over mean line load along the face, of all positions together"),
    Key("face_load.<variant>.<flank>.k_h_alpha", "1", "K_Hα, largest load of a pair over that of an accurate gear mesh under the same force"),
    Key("face_load.<variant>.<flank>.instantaneous_peak_factor", "1", "largest over mean line load at one instant"),
    Key("face_load.<variant>.<flank>.tip_load_share_max", "1", "largest share of the load that tip edges carry off the path of contact"),
    Key("face_load.<variant>.<flank>.tip_line_load_n_per_mm", "N/mm", "largest line load there"),
    Key("face_load.<variant>.<flank>.tip_contact_positions", "1", "share of positions where this is more than the mean line load"),
    Key("face_load.<variant>.<flank>.face_end_line_load_n_per_mm", "N/mm", "largest line load at an end of the face"),
    Key("face_load.<variant>.<flank>.face_end_contact_positions", "1", "share of positions where an end carries much more than the mean"),
    Key("face_load.<variant>.<flank>.mean_line_load_n_per_mm", "N/mm", "mean line load"),
    Key("face_load.<variant>.<flank>.largest_contact_pressure_mpa", "MPa", "largest Hertz pressure"),
    Key("face_load.<variant>.<flank>.largest_line_load_n_per_mm", "N/mm", "largest line load"),
    Key("face_load.<variant>.<flank>.misalignment_um", "µm", "mean misalignment over the face"),
    Key("face_load.<variant>.<flank>.misalignment_by_cause_um.<cause>", "µm", "the same by cause"),
    Key("face_load.<variant>.<flank>.transmission_error_um", "µm", "mean under load"),
    Key("face_load.<variant>.<flank>.transmission_error_peak_to_peak_um", "µm", "peak to peak over all positions"),
    Key("face_load.<variant>.<flank>.transmission_error_cycle_peak_to_peak_um", "µm", "largest peak to peak within a gear-mesh cycle"),
    Key("face_load.<variant>.<flank>.transmission_error_orders_um", "µm", "amplitudes by order of the gear mesh, from 1"),
    Key("face_load.<variant>.<flank>.unloaded_transmission_error_um", "µm", "mean of the unloaded one"),
    Key("face_load.<variant>.<flank>.unloaded_transmission_error_peak_to_peak_um", "µm", "peak to peak over all positions"),
    Key("face_load.<variant>.<flank>.unloaded_transmission_error_cycle_peak_to_peak_um", "µm", "largest peak to peak within a gear-mesh cycle"),
    Key("face_load.<variant>.<flank>.unloaded_transmission_error_orders_um", "µm", "amplitudes by order of the gear mesh, from 1"),
    Key("face_load.<variant>.<flank>.gear_mesh_stiffness_n_per_um.min", "N/µm", "least slope of the gear-mesh force, bodies held"),
    Key("face_load.<variant>.<flank>.gear_mesh_stiffness_n_per_um.mean", "N/µm", "mean"),
    Key("face_load.<variant>.<flank>.gear_mesh_stiffness_n_per_um.max", "N/µm", "largest"),
)  # fmt: skip


def lacking(summary: Mapping[str, Any]) -> list[str]:
    """Dotted names of keys that a summary must have and has not."""
    lost: dict[str, None] = {}
    for key in KEYS:
        if key.needed == ALWAYS or (key.needed and key.names[0] in summary):
            lost |= dict.fromkeys(_missing(summary, key.names, ""))
    return list(lost)


def _missing(value: Any, names: Sequence[str], at: str) -> Iterator[str]:
    if not names:
        return
    name, *rest = names
    if not isinstance(value, Mapping):
        yield at
    elif name.startswith("<"):
        for key, inner in value.items():
            if isinstance(inner, Mapping) or not rest:
                yield from _missing(inner, rest, f"{at}.{key}")
    elif name not in value:
        yield f"{at}.{name}".lstrip(".")
    else:
        yield from _missing(value[name], rest, f"{at}.{name}".lstrip("."))


def json_schema(rows: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Any]:
    """JSON schema (draft 2020-12) of ``summary.json``; rows: schemas of keys that hold lists."""
    root: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "summary.json of a run of flexgear",
        "description": f"version {VERSION}",
    }
    for key in KEYS:
        _add(root, key.names, _leaf(key, rows or {}))
    root["required"] = [k.path for k in KEYS if k.needed == ALWAYS and "." not in k.path]
    root["properties"]["schema_version"] |= {"const": VERSION}
    return root


def _leaf(key: Key, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    schema: dict[str, Any] = {"description": key.meaning}
    if key.path in rows:
        return {**schema, **rows[key.path]}
    if key.unit and not key.path.endswith(FREE):
        schema |= {"type": ["number", "null", "array"], "items": {"type": ["number", "null"]}}
        schema["x-unit"] = key.unit
    return schema


def _add(schema: dict[str, Any], names: Sequence[str], leaf: dict[str, Any]) -> None:
    """Put a key below the schema of an object."""
    name, *rest = names
    schema |= {"type": "object", "additionalProperties": schema.get("additionalProperties", False)}
    place = schema.setdefault("properties", {})
    if name.startswith("<"):
        if name in FREE:
            schema["additionalProperties"] = leaf
            return
        place, name = schema, "additionalProperties"
        schema[name] = schema[name] or {}
    if not rest:
        place[name] = {**place.get(name, {}), **leaf}
        return
    _add(place.setdefault(name, {}), rest, leaf)
