"""Every variable a result of a train may hold: dimensions, unit, meaning.

The first dimension "sample" is "time", "position", "mode", "speed_factor" or "point". A gear mesh
is one planet against ring or sun, whichever flank carries; frames and signs are those of
docs/conventions.md.
"""

from __future__ import annotations

from flexgear.results.quantities import UNLOADED, Quantity, S
from flexgear.results.response_quantities import RESPONSE_QUANTITIES

NODAL = (
    "nodal index min(k, N - k) of the mode in every stage; -1: several, -2: the stage is at rest, "
    "-3: planets do not stand evenly"
)
UNSAID = (
    "with fewer than four samples a gear-mesh cycle, less than one cycle, a stage that does not "
    "turn, or planets that at times carry no load together"
)
RESULT_QUANTITIES: dict[str, Quantity] = {
    "energy_kinetic": Quantity((S,), "J", "kinetic energy"),
    "energy_elastic": Quantity((S,), "J", "strain energy of bodies, bearings, bolts, splines"),
    "energy_pair_elastic": Quantity((S,), "J", "strain energy of the tooth pairs"),
    "energy_input_work": Quantity((S,), "J", "work done by the machines at the inputs"),
    "energy_brake_work": Quantity((S,), "J", "work taken by the machine at the output"),
    "energy_damping_work": Quantity((S,), "J", "work taken by damping of the structure"),
    "energy_pair_damping_work": Quantity((S,), "J", "work taken by damping of the tooth pairs"),
    "energy_parametric_work": Quantity(
        (S,), "J", "work of changing pair stiffness and contact vectors"
    ),
    "energy_load_work": Quantity((S,), "J", "work done by weight and loads given from outside"),
    "input_angle": Quantity(
        (S, "input_coordinate"), "rad", "rotation of members that turn independently"
    ),
    "input_speed": Quantity((S, "input_coordinate"), "rad/s", "their speed"),
    "inertia_torque": Quantity(
        (S, "input_coordinate"),
        "N m",
        "torque of all machines about them in rolling: what speeds the train up, and what drag "
        "and given loads take",
    ),
    "end_state": Quantity(
        ("state",), "", "what a transient that starts from the end of this one carries on"
    ),
    "stage_angle": Quantity(
        (S, "turning_stage"), "rad", "turn of the carrier (mean of the pins) against the ring; gear"
    ),
    "carrier_angle": Quantity(
        (S, "turning_stage"), "rad", "rotation of the carrier in space (mean of the pins); 0: none"
    ),
    "ring_angle": Quantity(
        (S, "turning_stage"), "rad", "rotation of the ring in space (hub of an FE ring); 0: none"
    ),
    "stage_speed": Quantity((S, "turning_stage"), "rad/s", "its speed when the train rolls"),
    "output_speed": Quantity((S,), "rad/s", "speed of the output"),
    "closure": Quantity(
        (S,),
        "1",
        "largest imbalance of an equilibrium over its load, or what errors and gaps are worth",
    ),
    "pair_load": Quantity(
        (S, "flank", "slot"), "N", "load of a tooth pair; compressive is positive"
    ),
    "pair_tooth": Quantity(
        (S, "flank", "slot"), "1", "tooth of ring or sun in a pair, from 1; 0: no pair"
    ),
    "pair_stiffness": Quantity((S, "flank", "slot"), "N/m", "stiffness of a tooth pair"),
    "pair_position": Quantity(
        (S, "flank", "slot"), "m", "path coordinate, from the planet's base tangent point"
    ),
    "pair_planet_tooth": Quantity(
        (S, "flank", "slot"), "1", "tooth of the planet in a pair, from 1; 0: no pair"
    ),
    "path_start": Quantity(
        ("flank",),
        "m",
        "path coordinate where the path of contact starts, at the root of the planet",
    ),
    "path_end": Quantity(
        ("flank",), "m", "path coordinate where it ends, at the tip of the planet"
    ),
    "planet_base_diameter": Quantity(
        ("flank",), "m", "base diameter of the planet, or of the gear of a parallel stage"
    ),
    "gear_base_diameter": Quantity(("flank",), "m", "base diameter of ring, sun or pinion"),
    "gear_roll_offset": Quantity(
        ("flank",),
        "m",
        (
            "roll length of ring, sun or pinion at path coordinate 0; a ring's grows "
            "with it, others' fall"
        ),
    ),
    "face_section": Quantity(
        ("flank",),
        "1",
        (
            "length of the pieces of the face whose mean line load K_Hβ takes, over the "
            "face width; 0: at one place"
        ),
    ),
    "line_load": Quantity(
        (S, "flank", "slot", "slice"),
        "N/m",
        "load of a slice of a contact line per width of the face",
        missing="without a pair",
    ),
    "contact_pressure": Quantity(
        (S, "flank", "slot", "slice"),
        "Pa",
        "Hertz pressure at the middle of a slice",
        missing="without a pair",
    ),
    "slice_position": Quantity(
        (S, "flank", "slot", "slice"),
        "m",
        "middle of the slice along the face, from its mid-plane",
        missing="without a pair",
    ),
    "slice_path": Quantity(
        (S, "flank", "slot", "slice"),
        "m",
        "path coordinate of the middle of the slice",
        missing="without a pair",
    ),
    "face_line_load": Quantity(
        (S, "flank", "face"), "N/m", "load per width that all pairs of a flank carry there together"
    ),
    "largest_line_load": Quantity(
        (S, "flank"), "N/m", "largest line load of any pair, continued to the ends of its line"
    ),
    "mean_line_load": Quantity(
        (S, "flank"),
        "N/m",
        "force of the gear mesh over the length that its contact lines have on the path of contact",
        missing="without load",
    ),
    "instantaneous_peak_factor": Quantity(
        (S, "flank"), "1", "largest over mean line load", missing="without load"
    ),
    "tip_load_share": Quantity(
        (S, "flank"),
        "1",
        "share of the load that tip edges carry off the path of contact",
        missing="without load",
    ),
    "tip_line_load": Quantity((S, "flank"), "N/m", "largest line load off the path of contact"),
    "face_end_line_load": Quantity(
        (S, "flank"),
        "N/m",
        "largest line load in the last slice of a contact line at an end of the face",
    ),
    "largest_contact_pressure": Quantity(
        (S, "flank"), "Pa", "largest Hertz pressure at the middle of any slice"
    ),
    "root_stress": Quantity(
        (S, "flank", "pair_member"),
        "Pa",
        "largest stress in the roots of the teeth that carry, in the fillet under the loaded flank",
        missing="without load, and of stages without gear_mesh.root_stress",
    ),
    "root_side": Quantity(
        ("flank", "pair_member"),
        "1",
        "side of the teeth where load on the flank stretches the fillet: -1 that of -theta, 1 that "
        "of +theta, 0 of stages without gear_mesh.root_stress",
    ),
    "face_root_stress": Quantity(
        (S, "flank", "pair_member", "face"),
        "Pa",
        "the same at places along the face",
        missing="without load, and of stages without gear_mesh.root_stress",
    ),
    "face_root_compression": Quantity(
        (S, "flank", "pair_member", "face"),
        "Pa",
        "least stress in the fillets on the other side of these teeth",
        missing="without load, and of stages without gear_mesh.root_stress",
    ),
    "tooth_root_stress": Quantity(
        (S, "tooth", "fillet"),
        "Pa",
        "largest stress in the fillets of every tooth of an FE ring, its rim's bending included",
        missing="of stages without gear_mesh.root_stress",
    ),
    "tooth_root_range": Quantity(
        ("tooth", "fillet"),
        "Pa",
        "how far the stress ranges over the positions at one point of the fillet, the worst one",
        missing="of stages without gear_mesh.root_stress",
    ),
    "tooth_root_least": Quantity(
        ("tooth", "fillet"),
        "Pa",
        "least stress over the positions at the point of the fillet with the largest",
        missing="of stages without gear_mesh.root_stress",
    ),
    "transmission_error": Quantity(
        (S, "flank"),
        "m",
        "approach of both bodies along the line of action at the middle of the face, under load",
        missing="without load",
    ),
    "unloaded_transmission_error": Quantity(
        (S, "flank"),
        "m",
        (
            "approach at which rigid flanks without tilt touch first, by errors and "
            "ground flanks alone"
        ),
        missing="without a pair",
    ),
    "transmission_error_order": Quantity(
        ("flank", "gear_mesh_order"),
        "m",
        "amplitude of the transmission error under load by order of the gear mesh",
        missing="of a flank that does not carry throughout",
    ),
    "unloaded_transmission_error_order": Quantity(
        ("flank", "gear_mesh_order"),
        "m",
        "the same of the unloaded one",
        missing="of a flank that does not carry throughout",
    ),
    "gear_mesh_stiffness": Quantity(
        (S, "flank"),
        "N/m",
        "slope of the gear-mesh force as all pairs close alike, bodies held; under load",
    ),
    "gear_mesh_misalignment": Quantity(
        (S, "flank"),
        "m",
        "how much more the bodies have approached at the +z end of the face than at its -z end",
        missing="without load",
    ),
    "gear_mesh_misalignment_by_cause": Quantity(
        (S, "flank", "cause"),
        "m",
        "the same by each cause; bodies add up to it, errors and modified flanks come on top",
        missing="without load",
    ),
    "tooth_displacement": Quantity((S, "tooth", "axis"), "m", "ring tooth node, axes of the ring"),
    "sensor_signal": Quantity(
        ("sensor_time", "sensor"), "", "what a sensor measures, in its unit, up to its band"
    ),
    "sensor_input_angle": Quantity(
        ("sensor_time", "input_coordinate"), "rad", "input_angle at the samples of sensors"
    ),
    "sensor_static": Quantity(
        (S, "static_sensor"), "", "what a sensor measures in equilibrium, in its unit"
    ),
    "rim_stress": Quantity(
        (S, "tooth"),
        "Pa",
        "stress along the circumference on the ring's outer surface over a tooth, at mid-face",
        missing="of a ring without FE mesh",
    ),
    "carrier_displacement": Quantity(
        (S, "carrier_node", "dof"), "m, rad", "carrier node, carrier axes, rolling taken off"
    ),
    "bolt_force": Quantity(
        (S, "bolt", "axis"), "N", "force of the ring on a bolt: radial, tangential, axial"
    ),
    "bearing_force": Quantity(
        (S, "support", "dof"),
        "N, N m",
        "force and moment that a bearing, fit or spline carries, of what it holds on its support",
    ),
    "port_torque": Quantity((S, "port"), "N m", "torque from outside on the member, about +z"),
    "applied_load": Quantity(
        (S, "load", "dof"),
        "N, N m",
        "force and moment that the case puts on a member, in its frame",
    ),
    "port_speed": Quantity((S, "port"), "rad/s", "speed of the member, elastic motion included"),
    "gear_mesh_force": Quantity(
        (S, "gear_mesh"),
        "N",
        "normal force along the 3D line of action, flank that carries rated torque less the other",
    ),
    "planet_load_factor": Quantity(
        (S, "gear_mesh"),
        "1",
        "N F / sum F over the planets of a stage, one kind and side",
        missing=f"{UNLOADED}; of a gear mesh that shares its load with none",
    ),
    "load_sharing": Quantity(
        (S, "group"), "1", "N max F / sum F over the planets", missing=UNLOADED
    ),
    "body_displacement": Quantity(
        (S, "body", "dof"),
        "m, rad",
        "axes of the stage's carrier (planets: radial, tangential, axial), rolling taken off",
    ),
    "fe_coordinate": Quantity(
        (S, "fe_coordinate_of"),
        "m, rad, 1",
        "elastic coordinates of FE bodies: motion of interface nodes, then amplitudes of modes",
    ),
    "planet_bearing_force": Quantity(
        (S, "bearing", "direction"), "N", "force of the planet on its pin"
    ),
    "film_thickness": Quantity(
        (S, "bearing"),
        "m",
        "least thickness of the oil film of a plain planet bearing; surfaces touch at least_film",
        missing="of other bearings",
    ),
    "planet_bearing_row_load": Quantity(
        (S, "bearing", "bearing_row"),
        "N",
        "radial force of a row of rollers",
        missing="of a bearing without rollers, and of a row that it does not have",
    ),
    "bearing_row_load": Quantity(
        (S, "support", "bearing_row"),
        "N",
        "radial force of a row of rollers, where others than planets have them",
        missing="of a support without rollers, and of a row that it does not have",
    ),
    "dynamic_transmission_error": Quantity(
        (S, "gear_mesh"),
        "m",
        (
            "approach of both bodies along the line of action of the flank that carries rated "
            "torque, at the pitch point at mid-face, touching or not, under every gear-mesh model"
        ),
        missing="while no tooth of an FE ring or planet is in mesh",
    ),
    "rated_gear_mesh_force": Quantity(("gear_mesh",), "N", "mean at rated torque"),
    "load_sharing_coefficient": Quantity(
        ("definition", "group"), "1", "largest coefficient of the planets", missing=UNSAID
    ),
    "planet_coefficient": Quantity(
        ("definition", "gear_mesh"),
        "1",
        "load sharing coefficient of each planet",
        missing=f"{UNSAID}; of a gear mesh that shares its load with none",
    ),
    "mesh_load_factor": Quantity(
        ("group",),
        "1",
        "factor that IEC 61400-4 has designers assume",
        missing="for a number of planets that it does not name",
    ),
    "cycle_maximum": Quantity(
        ("cycle", "gear_mesh"), "N", "largest gear-mesh force in a gear-mesh cycle"
    ),
    "cycle_number": Quantity(("cycle",), "1", "number of the cycle in the error cycle, from 0"),
    "force_amplitude": Quantity(
        (S, "gear_mesh"), "N", "amplitude of the gear-mesh force in the harmonic steady state"
    ),
    "stepped_force_amplitude": Quantity(
        (S, "gear_mesh"), "N", "the same fitted to the settled time stepping"
    ),
    "displacement_amplitude": Quantity(
        (S, "body", "dof"), "m, rad", "amplitude in the harmonic steady state"
    ),
    "frequency": Quantity((S,), "Hz", "natural frequency"),
    "type": Quantity((S,), "", "type of the mode by energy"),
    "multiplicity": Quantity((S,), "1", "modes of that frequency and type"),
    "kinetic_energy": Quantity((S, "inertia"), "1", "share of the mode's kinetic energy"),
    "strain_energy": Quantity((S, "spring"), "1", "share of the mode's strain energy"),
    "motion_energy": Quantity((S, "motion"), "1", "share of the mode's kinetic energy"),
    "nodal_index": Quantity((S, "turning_stage"), "1", NODAL),
    "mode_shape": Quantity((S, "body", "dof"), "m, rad", "motion of bodies, modal mass 1 kg"),
    "campbell_frequency": Quantity((S, "mode"), "Hz", "frequency of a whirl mode"),
    "whirl": Quantity(
        (S, "mode"),
        "1",
        "sense of whirl: 1 forward circle, -1 backward",
        missing="of a mode that does not whirl",
    ),
    "campbell_nodal_index": Quantity(("mode", "turning_stage"), "1", NODAL),
    "excitation_slope": Quantity(("excitation",), "Hz", "frequency at rated speed"),
    "excitation_share": Quantity(
        ("excitation",),
        "1",
        "largest amplitude of a gear mesh's stiffness at that order over its mean",
        missing="of shafts and passing planets",
    ),
    "excitation_index": Quantity(
        ("excitation",),
        "1",
        "k = l z_s mod N that the order drives in a stage of equal planets; -1: none",
    ),
    "crossing_factor": Quantity(("crossing",), "1", "speed over rated speed where they meet"),
    "crossing_frequency": Quantity(("crossing",), "Hz", "frequency where they meet"),
    "crossing_mode": Quantity(("crossing",), "1", "number of the mode, from 1"),
    "crossing_excitation": Quantity(("crossing",), "", "which excitation"),
    "meeting_factor": Quantity(("meeting",), "1", "operating speed over rated speed"),
    "meeting_excitation": Quantity(("meeting",), "", "which excitation"),
    "meeting_mode": Quantity(("meeting",), "1", "number of the mode, from 1"),
    "meeting_frequency": Quantity(("meeting",), "Hz", "frequency of the excitation"),
    "meeting_away": Quantity(("meeting",), "1", "how far it lies above the mode, over the mode's"),
    "meeting_index": Quantity(("meeting",), "1", NODAL.replace("every stage", "that stage")),
    "meeting_cause": Quantity(
        ("meeting",), "", "ideal: a stage of equal planets is excited; errors: unequal parts are"
    ),
    "meeting_force": Quantity(
        ("meeting",),
        "1",
        "amplitude of a gear-mesh force over its mean if they met exactly; for errors: if a "
        "single planet's teeth pushed",
        missing="where no variation of the gear-mesh stiffness or no damping is known",
    ),
    "linear_force_amplitude": Quantity(
        (S, "gear_mesh", "gear_mesh_order"),
        "N",
        "amplitude of the gear-mesh force under the static transmission error, at mean stiffness",
    ),
    "linear_transmission_error_amplitude": Quantity(
        (S, "gear_mesh", "gear_mesh_order"), "m", "amplitude of the dynamic transmission error"
    ),
    "static_transmission_error_amplitude": Quantity(
        ("gear_mesh", "gear_mesh_order"), "m", "amplitude of the static transmission error"
    ),
    "peak_factor": Quantity(("peak",), "1", "speed over rated speed of a peak of the force"),
    "peak_gear_mesh": Quantity(("peak",), "", "gear mesh whose force it is"),
    "peak_order": Quantity(("peak",), "1", "order of its gear-mesh frequency"),
    "peak_force": Quantity(("peak",), "N", "amplitude there"),
    "peak_mode_share": Quantity(
        ("peak", "kept_mode"),
        "1",
        "share of the mode in it; the rest is the error alone",
    ),
    "growth_rate": Quantity(
        (S, "turning_stage"),
        "1/s",
        "growth of free vibration under the varying gear-mesh stiffness of a stage; 0: it decays",
    ),
    "largest_multiplier": Quantity(
        (S, "turning_stage"), "1", "largest modulus of a Floquet multiplier over a gear-mesh cycle"
    ),
    "stage_gear_mesh_frequency": Quantity(
        ("turning_stage",), "Hz", "gear-mesh frequency at rated speed"
    ),
    "kept_frequency": Quantity(
        ("kept_mode",), "Hz", "natural frequency with the mean stiffness of the gear meshes"
    ),
    "band_stage": Quantity(("band",), "", "stage whose gear-mesh stiffness makes vibration grow"),
    "band_lower_factor": Quantity(("band",), "1", "speed over rated speed where growth begins"),
    "band_upper_factor": Quantity(("band",), "1", "speed over rated speed where it ends"),
    "band_peak_factor": Quantity(("band",), "1", "speed over rated speed of the largest growth"),
    "band_growth_rate": Quantity(("band",), "1/s", "largest growth in the band"),
    "band_modes": Quantity(
        ("band", "acting"), "1", "numbers of the modes i and j that act, from 1; twice the same: i"
    ),
    "band_order": Quantity(("band",), "1", "order l of l f_z = f_i + f_j, f_z gear-mesh frequency"),
    **RESPONSE_QUANTITIES,
}
