"""All pictures of a run: name, place in the report, caption, sentence, drawing function.

``RUN_CHARTS`` is in the order of the report. A new picture is one entry.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.expected_lines import BOLT_PASS, TOOTH_FAULT, expected_lines
from flexgear.gears.geometry import stage_geometry
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.names import GEAR_MESH, SHAFT
from flexgear.results.report.wording import with_unit
from flexgear.results.run_folder import StageOfRun
from flexgear.results.run_orders import HIGHEST_ORDER, case_of, gear_mesh_orders
from flexgear.results.settling import settled
from flexgear.results.sinks import between
from flexgear.results.stage_part import has_pairs
from flexgear.results.time_figures import ORDERS, radial_harmonics
from flexgear.results.tooth_pattern import gear_pattern, planet_pattern
from flexgear.views import chart as each
from flexgear.views import face_load_charts, histories, sharing_charts, star, style
from flexgear.views.chart import Chart, Drawing, NotDrawn, Subjects, having
from flexgear.views.face_load_charts import root_stress_chart, tooth_rows_chart
from flexgear.views.mode_charts import campbell_chart, modes_chart
from flexgear.views.order_charts import order_chart, sensors_chart, static_sensors_chart
from flexgear.views.select import thinned, within_window
from flexgear.views.stage_drawing import flank_drawing, front_drawing, section_drawing
from flexgear.views.vibration_charts import (
    energy_balance,
    linear_response_chart,
    response_chart,
    stability_chart,
)

DPI = 150  # of pictures, which are as wide as a page
MAX_READ = 1_000_000  # samples of a transient that a picture reads, the last ones
MAX_OF_DROP = 50_000  # samples of a torque drop in a picture
CYCLES_SHOWN = 12  # gear-mesh cycles of a stage in its close-up
TEETH_SHOWN = 5  # tooth pitches in a picture of pair loads

SHARES = "Each planet's share times the number of planets: 1 is an even share."
ENLARGED = "Displacements are drawn larger as stated"
MOVE = "Displacement of bodies from their position without load."
NODE = "Displacement of ring teeth while the planets pass them."
PAIRS = (
    "Each line is one tooth pair from its entry to its exit; the dashed line is a split of the "
    "load by stiffness alone."
)
ROWS = (
    "The flank of each tooth, face across and diameter upwards: largest line load at each place "
    "over all positions; white: no contact under load."
)


def _forces(data: xr.Dataset, stage: StageOfRun) -> Any:
    """Gear-mesh forces of a stage in its last cycles."""
    end = float(data.variables["time"][-1])
    last = between(data, end - CYCLES_SHOWN / stage.flow.gear_mesh_frequency)
    return sharing_charts.gear_mesh_forces(_gear_meshes(last, stage.name))


def _gear_meshes(data: xr.Dataset, stage: str) -> xr.Dataset:
    """The gear meshes of one stage."""
    return data.isel(gear_mesh=np.flatnonzero(data["stage"].to_numpy() == stage))


def _spectrum(data: xr.Dataset, stage: StageOfRun) -> Any:
    """Order spectra of a stage's gear-mesh forces in the settled part of a run."""
    case, several = case_of(data), int(HIGHEST_ORDER)
    expected = [x for x in expected_lines(case, harmonics=several) if x.kind != BOLT_PASS]
    expected += [x for x in expected_lines(case) if x.kind == BOLT_PASS and x.harmonic <= 1]
    lines = [
        (line, line.frequency / stage.flow.gear_mesh_frequency)
        for line in expected
        if (line.stage == stage.name and line.kind in (GEAR_MESH, SHAFT, TOOTH_FAULT, BOLT_PASS))
        or (line.kind == GEAR_MESH and line.harmonic == 1)
    ]
    try:
        return order_chart(gear_mesh_orders(settled(data), stage.name), lines)
    except InputError as error:  # the run stops or reverses
        return style.text_only(str(error))


def _sharing(data: xr.Dataset, stage: StageOfRun) -> Any:
    """Load sharing of a stage in the settled window."""
    settled_part = _gear_meshes(settled(data, MAX_READ), stage.name)
    return sharing_charts.sharing_chart(settled_part[["planet_load_factor"]].load())


def _displacements(data: xr.Dataset) -> Any:
    """Motion of central members in the settled window."""
    rest = settled(data, MAX_READ)[["body_displacement"]].sel(dof=["ux", "uy"])
    return sharing_charts.displacements_chart(rest.load())


def _outline(ring: StageOfRun) -> star.StageOutline:
    """Circles of the gears of a stage with an FE ring."""
    g = stage_geometry(ring.view)
    return star.StageOutline(
        ring_radius=g.ring.reference_radius,
        sun_radius=g.sun.reference_radius,
        planet_radius=g.planet.reference_radius,
        center_distance=g.center_distance,
        planet_angles=tuple(ring.view.stage.planet_angles),
    )


def _two_positions(ring: StageOfRun) -> tuple[xr.DataArray, Any, star.StageOutline]:
    """Displacement of ring teeth and carrier angles in two equilibria, with the first tooth at a
    planet and between two planets, and the outline of the stage; one equilibrium if it is the
    nearest to both."""
    turned = ring.equilibria["stage_angle"].to_numpy() * ring.view.stage.planets / (2.0 * np.pi)
    distances = [np.abs((turned - target + 0.5) % 1.0 - 0.5).round(6) for target in (0.0, 0.5)]
    positions = ring.equilibria.isel(position=list(dict.fromkeys(map(np.argmin, distances))))
    return positions["tooth_displacement"], positions["stage_angle"].to_numpy(), _outline(ring)


def _harmonics(ring: StageOfRun) -> Any:
    """Radial harmonics of the ring in the first position."""
    orders = np.abs(radial_harmonics(ring.equilibria["tooth_displacement"].to_numpy()[0]))
    return star.radial_harmonics(orders[:ORDERS], ring.view.stage.planets)


def _first(ring: StageOfRun) -> xr.Dataset:
    """The settled part of the transient of the first variant, which is the case itself."""
    return next(iter(ring.steady.values()))


def _pair_loads(ring: StageOfRun, gear: str) -> Any:
    """Loads of the tooth pairs of planet 1 over a few pitches, in the middle of the run."""
    name, first = next(iter(ring.steady.items()))
    angle = float(first["stage_angle"][first.sizes["time"] // 2])
    close = (angle, angle + TEETH_SHOWN * 2 * np.pi / ring.view.ring_gear.teeth)
    close_runs = within_window(ring.steady, "stage_angle", close)
    return histories.pair_loads(close_runs, gear, split=name)


def _drop(ring: StageOfRun, depth: str) -> dict[str, xr.Dataset]:
    """Transients of a torque drop by variant, thinned for a picture."""
    parts = ring.runs(f"torque_step_{depth}")
    return {n: thinned(part, MAX_OF_DROP) for n, part in parts.items()}


def _energy(data: xr.Dataset, *_: Any) -> Any:
    return energy_balance(thinned(data, MAX_OF_DROP))


def _animation(ring: StageOfRun) -> Drawing:
    """Animation of the deformed ring over one planet spacing of the carrier."""
    angles = ring.equilibria["stage_angle"].to_numpy()
    loop = np.flatnonzero(angles < ring.view.stage.planet_period - 1e-9)
    shape, outline = ring.equilibria["tooth_displacement"][loop], _outline(ring)

    write = partial(star.animate_star, shape, angles[loop], outline, dpi=90, frames_per_second=12)
    return Drawing(write, ())


def _deformed(body: str, field: xr.Dataset, bodies: int) -> Drawing:
    """3D render of a deformed body."""
    from flexgear.views.scenes import body_scene, triangles_of_each

    points, cells, shape = (field[n].to_numpy() for n in ("point", "cell", "displacement"))
    torque = field.attrs["input_torque"]
    title = f"{body}, equilibrium at {with_unit(torque, 'N m')}"
    stress = field["von_mises_stress"].to_numpy()
    scene = body_scene(points, cells, shape, stress, triangles_of_each(bodies)[0])
    return _rendered(scene, points, cells, shape, title=title)


def _mode_shapes(body: str, field: xr.Dataset, bodies: int) -> Drawing:
    """Lowest natural modes of a body: the first mode in the file, all modes on a screen."""
    from flexgear.views.scenes import mode_scene, triangles_of_each

    points, cells, shapes = (field[n].to_numpy() for n in ("point", "cell", "mode_displacement"))
    labels = [
        f"mode {int(mode)}, {with_unit(float(hz), 'Hz')}"
        for mode, hz in zip(field["mode"], field["frequency"], strict=True)
    ]
    scene = mode_scene(points, cells, shapes, labels, triangles_of_each(bodies)[1])
    title = f"{body} in {labels[0]}"
    return _rendered(scene, points, cells, shapes[0], title=title, relative=True)


def _rendered(scene: Sequence[Mapping[str, Any]], *shape: Any, **options: Any) -> Drawing:
    """A 3D picture for the file and the scene that replaces it on a screen; NotDrawn if this
    machine cannot render."""
    from flexgear.views.render import render_deformed, require_rendering

    try:
        require_rendering()
    except FlexgearError as error:
        raise NotDrawn(f"no 3D renders: {error}") from None
    return Drawing(partial(style.save_figure, render_deformed(*shape, **options), dpi=DPI), scene)


FLANK = Chart(
    "flank_{stage}_{part}_{flank}", "geometry", "{Stage}: modified {part} flank, {flanks}",
    "Material missing on a flank, normal to it in the transverse section.", flank_drawing,
)  # fmt: skip
RUN_CHARTS: Sequence[tuple[Subjects, Sequence[Chart]]] = (
    (each.stages, (
        Chart("drawing_front_{stage}", "geometry", "{Stage} to scale, front",
            "Gears and their supports to scale, seen along the axis: teeth, bolts, pins and bores "
            "of the case.", lambda stage: front_drawing(stage.view)),
        Chart("drawing_section_{stage}", "geometry", "{Stage} to scale, section",
            "The upper half of the stage cut along its axis, to scale.",
            lambda stage: section_drawing(stage.view)),
    )),
    (each.flanks, (FLANK,)),
    (having(each.rings, lambda ring: ring.equilibria), (
        Chart("{prefix}ring_star", "deflections",
            "{ring}Ring at two carrier angles, equilibrium without errors",
            "The ring bends into a star with a point at each planet, which turns with the carrier. "
            f"{ENLARGED}.", lambda ring: star.ring_star(*_two_positions(ring))),
        Chart("{prefix}ring_profile", "deflections",
            "{ring}Radial displacement of the tooth nodes",
            "Outward displacement round the ring, by angle.",
            lambda ring: star.radial_profile(*_two_positions(ring))),
        Chart("{prefix}radial_harmonics", "deflections",
            "{ring}Radial harmonics of the ring at rated torque",
            "The ring's shape as a sum of waves round the circle; with equal planets only "
            "multiples of their number occur.", _harmonics),
    )),
    (having(each.rings, lambda ring: ring.steady), (
        Chart("{prefix}tooth_node_1", "deflections",
            "{ring}Displacement of ring tooth node 1, {windows}", NODE,
            lambda ring: histories.displacement(ring.steady, "tooth node")),
        Chart("{prefix}tooth_displacement_map", "deflections",
            "{ring}x displacement of all tooth nodes, {window}", NODE,
            lambda ring: star.tooth_displacement_map(_first(ring))),
        Chart("{prefix}sun_displacement", "deflections",
            "Displacement of the sun{of}, axes of the carrier, {windows}", MOVE,
            lambda ring: histories.displacement(ring.steady, "sun")),
        Chart("{prefix}planet_displacement", "deflections",
            "Displacement of planet 1{of}, its own axes, {windows}", MOVE,
            lambda ring: histories.displacement(ring.steady, "planet")),
        Chart("{prefix}load_sharing", "sharing", "{ring}Load sharing in time, {windows}", SHARES,
            lambda ring: histories.load_sharing(ring.steady)),
    )),
    (having(each.rings, lambda ring: ring.steady and has_pairs(_first(ring))), (
        Chart("{prefix}ring_tooth_loads", "gear_meshes", "{ring}Load of the ring's tooth pairs, "
            f"{TEETH_SHOWN} pitches; dashed: by stiffness alone", PAIRS,
            lambda ring: _pair_loads(ring, "ring")),
        Chart("{prefix}sun_tooth_loads", "gear_meshes", "{ring}Load of the sun's tooth pairs, "
            f"{TEETH_SHOWN} pitches; dashed: by stiffness alone", PAIRS,
            lambda ring: _pair_loads(ring, "sun")),
        Chart("{prefix}engagement_map", "gear_meshes",
            "{ring}Engaged ring teeth and their pair stiffness, {window}",
            "Which teeth of the ring are in contact as the carrier turns.",
            lambda ring: histories.engagement_map(_first(ring))),
    )),
    (each.torque_drops, (
        Chart("{prefix}torque_step_{depth}", "dynamics", "{ring}Torque drop to {torque}",
            "Response of the load sharing to a sudden change of the torque.",
            lambda *drop: histories.torque_drop(_drop(*drop))),
        Chart("{prefix}torque_step_{depth}_speed", "dynamics",
            "Carrier speed against the ring{of}, torque drop to {torque}",
            "The stage slows down as the torque changes, and settles again.",
            lambda *drop: histories.carrier_speed(_drop(*drop))),
        Chart("{prefix}torque_step_{depth}_energy", "dynamics",
            "Energy balance{of}, torque drop to {torque}",
            "Work of the machines and its distribution; the rest is error of the time steps.",
            _energy, "torque_step_{depth}", "energy_kinetic"),
    )),
    (each.bearing_lives, (
        Chart("bearing_life_h", "bearings", "Basic rating life of the bearings, ISO 281",
            "Under the constant load of the same damage over the equilibria.",
            sharing_charts.bearing_life_chart),
    )),
    (each.trains, (
        Chart("power_flow", "power", "Speeds, torques and powers of the members",
            "Power that enters is positive, power that leaves negative.",
            sharing_charts.power_flow_chart),
    )),
    (each.runs, (
        Chart("stability", "modes", "Speeds at which vibration grows by itself",
            "Growth of free vibration under the varying stiffness of the gear meshes, with the "
            "modes i and j and the order l that meet, f_i + f_j = l f_z.",
            stability_chart, "stability"),
        Chart("linear_response", "dynamics", "Response to the static transmission error",
            "Gear-mesh force by order at mean stiffness, with the mode of the largest share of "
            "each peak.", linear_response_chart, "linear_response"),
        Chart("response", "dynamics", "Steady states over speed or torque, with all branches",
            "Largest and smallest gear-mesh force, peak-to-peak transmission error. Solid: stable, "
            "dashed: unstable; arrows: jumps of a sweep to the force at their head.",
            response_chart, "response"),
        Chart("modes", "modes", "Natural modes by type and energy",
            "Each mode by its frequency, and the distribution of its energy.",
            modes_chart, "modes"),
        Chart("campbell", "modes", "Natural frequencies and excitations over speed",
            "Equal planets excite only modes of the colour of the order; other modes need errors.",
            campbell_chart, "campbell"),
        Chart("face_line_load", "face",
            "Load along the face of every gear mesh, in the mean of the positions",
            "Load per width of all pairs of a gear mesh along the face; K_Hβ is the largest over "
            "the mean (ISO 6336-1).",
            face_load_charts.along_face_chart, "equilibrium", "face_line_load"),
        Chart("face_contact_pattern", "face",
            "Contact pattern: largest line load over path and face",
            "Largest load at each place of the flanks: more load at one end of the face indicates "
            "tilt or twist.",
            face_load_charts.contact_pattern, "equilibrium", "face_line_load"),
        Chart("face_misalignment", "face", "Misalignment of every gear mesh by what causes it",
            "Approach of the flanks at the +z end of the face less that at the −z end, by the body "
            "or bearing that tilts; lines go from least to largest.",
            face_load_charts.misalignment_chart, "equilibrium", "gear_mesh_misalignment_by_cause"),
    )),
    (each.runs_that_move, (
        Chart("transient_displacements", "deflections",
            "Displacement of central members in time, {window}", MOVE, _displacements, "transient"),
    )),
    (each.runs, (
        Chart("equilibrium_sensors", "dynamics", "Sensors in equilibria",
            "Quasi-static displacement, strain and torque at the sensors.",
            static_sensors_chart, "equilibrium", "sensor_static"),
        Chart("transient_sensors", "dynamics", "Signals of sensors and their spectra, {window}",
            "Records of a measuring system with an anti-alias filter, from the bodies of the case: "
            "without airborne noise and transfer paths through other housings.",
            lambda data: sensors_chart(settled(data)), "transient", "sensor_signal"),
    )),
    (each.tooth_sets, (
        Chart("face_rows_{stage}_{teeth}", "face",
            "Contact pattern of {teeth_words}, tooth by tooth, with all planets", ROWS,
            lambda data, group: tooth_rows_chart(gear_pattern(data, group)), "equilibrium"),
        Chart("face_rows_{stage}_planet_{teeth}", "face",
            "Contact pattern of planet 1 with {teeth_words}, tooth by tooth", ROWS,
            lambda data, group: tooth_rows_chart(planet_pattern(data, group)), "equilibrium"),
    )),
    (having(each.stages, lambda stage: stage.has_roots), (
        Chart("root_stress_{stage}", "face",
            "Root stress of {plain} over the positions and along the face (thin: fillets on the "
            "other side of the teeth)",
            "Stress in the fillets at the roots of the teeth. Left: over a turn, in the loaded "
            "roots of planet 1's gear meshes; right: along the face where it is largest. Positive "
            "is tension, where cracks grow; thin lines: the compressive fillets.",
            lambda data, stage: root_stress_chart(data, stage.name), "equilibrium"),
    )),
    (each.stages, (
        Chart("face_transmission_error_{stage}", "face",
            "Transmission error{of}, planet 1, over a gear-mesh cycle without errors",
            "Lag of the gears behind rigid and perfect ones; its peak-to-peak value excites noise, "
            "order by order. Unloaded: from flank modifications alone.",
            lambda data, _: face_load_charts.transmission_error_chart(data),
            "gear_mesh_cycles_{stage}"),
        Chart("face_stiffness_{stage}", "face",
            "Stiffness of the gear meshes{of} over a cycle",
            "Slope of the force as all tooth pairs approach alike, under load: of the teeth, with "
            "fixed gear bodies.", lambda data, _: face_load_charts.stiffness_chart(data),
            "gear_mesh_cycles_{stage}"),
        Chart("sharing_{stage}", "sharing", "Load sharing{of}, quasi-static, over one turn", SHARES,
            lambda data, _: sharing_charts.sharing_chart(data), "sharing_{stage}"),
    )),
    (having(each.stages, lambda stage: stage.flow.gear_mesh_frequency), (
        Chart("transient_forces_{stage}", "gear_meshes",
            "Gear-mesh forces{of} in time, the last " f"{CYCLES_SHOWN} gear-mesh cycles",
            "Normal force of every gear mesh; equal lines share the load.",
            _forces, "transient"),
        Chart("spectrum_{stage}", "dynamics",
            "Spectrum of the gear-mesh forces{of}, gear-mesh frequency {hz} Hz, {window}",
            "Amplitudes of the force of every gear mesh by order; planet 1 stands for all where "
            "their forces are equal. Unevenness of a member causes sidebands at its rotation. "
            "Expected: orders of gear meshes, bolts, shafts and tooth faults. Samples are not "
            "filtered, so others may be aliases of high orders, which flexgear orders names.",
            _spectrum, "transient"),
    )),
    (having(each.stages, lambda stage: stage.is_shared), (
        Chart("transient_sharing_{stage}", "sharing", "Load sharing{of} in time, {window}", SHARES,
            _sharing, "transient"),
    )),
    (each.fields, (
        Chart("{prefix}{body}_3d", "deflections", "Deformed {deformed}, exaggerated as stated",
            "Colour is the displacement, the shape is exaggerated as stated. Where plots are "
            "interactive, the mouse or a finger turns it.", _deformed, slow=True),
    )),
    # runs of earlier versions have no modes
    (having(each.fields, lambda _, field, count: field.sizes.get("mode", 0)), (
        Chart("{prefix}{body}_mode_shapes", "modes",
            "{Body} in the lowest natural modes in which it moves",
            "Colour is the displacement in per cent of the largest; the amplitude of a mode is "
            "arbitrary. Where plots are interactive, choose a mode, animate it, turn it.",
            _mode_shapes, slow=True),
    )),
    (having(each.rings, lambda ring: ring.equilibria), (
        Chart("{prefix}ring_star_turning", "deflections", "The star turns with the carrier",
            f"One planet spacing of the carrier. {ENLARGED}; gears are shown undeformed.",
            _animation, slow=True, suffix=".gif"),
    )),
)  # fmt: skip
