"""The commented case file of a proposed stage."""

from __future__ import annotations

import math
import tomllib

from flexgear.gears import surroundings as around
from flexgear.gears.sizing import FACTOR, FLANK, FORM, ROOT, Proposal
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml

_TEXT = """\
# Proposal of a stage: ratio {ratio:.4g}, {torque:.6g} N m at {speed:.5g} r/min on the carrier.
# Every value is a rule of thumb or chosen, and says which; replace them by those of your machine.

title = "Stage of ratio {ratio:.4g} for {torque:.6g} N m"

[material]                        # chosen: steel
young_modulus_gpa = 206
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[stage]
planets = {planets}
normal_module_mm = {module:.6g}          # {module_said}
pressure_angle_deg = 20           # ISO 53
helix_angle_deg = {helix:.6g}
planet_hand = "right"             # {hand_said}
face_width_mm = {width:.6g}           # the smallest that carries flank and root{halves}
# backlash_ring_mm and backlash_sun_mm are left out: ISO/TR 10064-2 gives them (flexgear check)
# flank: K* = F/(b d1) (u + 1)/u up to {flank:g} N/mm², the K* form of ISO 6336-2 (Niemann/Winter);
# root: F/(b m) Y up to {root:g} N/mm² with Y_Fa Y_Sa = {form:g}, ISO 6336-3;
# both with {factor:g} times the load

[stage.sun]
teeth = {sun}                        # ({sun} + {ring})/{planets} is whole: equal spacings assemble
profile_shift = {x_sun:g}             # ISO/TR 4467: λ (u - 1)/(u + 1), λ = 0.5; x_s + x_p = 0

[stage.planet]
teeth = {planet}
profile_shift = {x_planet:g}
bore_diameter_mm = {bore:.4g}           # bearing seat; rim of 1.2 tooth heights, ISO 6336-3

[stage.ring]
teeth = {ring}                       # z_sun + 2 z_planet: one centre distance
profile_shift = {x_ring:g}             # x_s + x_p = -(x_p + x_r)
addendum = {ring_addendum:g}                 # its tip stays off the planets' root

# ----------------------------------------------------------------------------------------- ring
[ring]
rim_thickness_mm = {rim:.4g}           # at least 3.5 modules (ISO 6336-3), and room for the bolts
end = "-z"                        # chosen: bolted {end_said}

[ring.bolts]                      # grade 10.9; friction 0.12 holds 1.5 times the torque (VDI 2230)
number = {bolts}
circle_diameter_mm = {circle:.6g}     # middle of the rim
diameter_mm = {bolt:g}
stiffness_radial_n_per_m = {bolt_across:.3g}      # chosen: friction joint, half of the axial one
stiffness_tangential_n_per_m = {bolt_across:.3g}
stiffness_axial_n_per_m = {bolt_axial:.3g}       # E A/l of the clamped sleeve
stiffness_tilt_nm_per_rad = {bolt_tilt:.3g}     # chosen: axial stiffness times d²
stiffness_twist_nm_per_rad = {bolt_twist:.3g}

# -------------------------------------------------------------------------------------- carrier
[carrier]                         # chosen: two plates round the planets, passing through the ring
drive_side = "-z"
plate_diameter_mm = {plate_diameter:.5g}
plate_thickness_drive_mm = {plate:.4g}
plate_thickness_far_mm = {plate:.4g}
plate_gap_mm = {gap:.5g}              # width of the gears and two modules
web_width_mm = {web_width:.4g}
web_clearance_mm = {web_clearance:.4g}
pin_diameter_mm = {pin:.4g}            # three quarters of the planets' bore
hub_outer_diameter_mm = {hub:.4g}
hub_bore_mm = {hub_bore:.4g}                # the sun's shaft passes through
hub_length_mm = {hub_length:.4g}

[carrier.seat_drive]
diameter_mm = {seat_drive:.4g}
width_mm = {seat_width:.4g}

[carrier.seat_far]
diameter_mm = {seat_far:.4g}
width_mm = {seat_width:.4g}

# ---------------------------------------------------------------------------------------- shaft
[shaft]
direction = "+z"

[[shaft.sections]]                # solid; 100 N/mm² of shear at rated torque
length_mm = {shaft_length:.5g}
outer_diameter_mm = {shaft:.4g}

[shaft.spline]                    # chosen: stiff in torsion, soft in tilt
radial_n_per_m = {bearing:.3g}
axial_n_per_m = {spline_axial:.3g}{spline_said}
tilt_nm_per_rad = {spline_tilt:.3g}
torsion_nm_per_rad = {spline_torsion:.3g}   # chosen: a thousandth of a radian at rated torque

# ------------------------------------------------------------------------------------- bearings
[bearings.planet]                 # two rows of 16 rollers, half of Palmgren's stiffness
radial_n_per_m = {bearing:.3g}
axial_n_per_m = {planet_axial:.3g}          # chosen: {planet_said}
tilt_nm_per_rad = {tilt:.3g}         # rows at a quarter of the face from the middle

[bearings.carrier_drive]          # chosen: as stiff as a planet's; locates axially
radial_n_per_m = {bearing:.3g}
axial_n_per_m = {axial:.3g}
tilt_nm_per_rad = {tilt:.3g}

[bearings.carrier_far]
radial_n_per_m = {bearing:.3g}
axial_n_per_m = {axial:.3g}
tilt_nm_per_rad = {tilt:.3g}

[bearings.output]                 # chosen: shaft bearing behind the spline
radial_n_per_m = {bearing:.3g}
axial_n_per_m = {bearing:.3g}
tilt_nm_per_rad = {tilt:.3g}

# ------------------------------------------------------------------------------------ operation
[drive]
rated_torque_nm = {torque:.9g}
rated_speed_rpm = {speed:.9g}

[inertia]                         # chosen: 0.05 s of rated power at both ends (or 100 discs)
drive_kg_m2 = {drive_inertia:.4g}
output_kg_m2 = {output_inertia:.4g}
output_mass_kg = {output_mass:.4g}          # a disc as large as the planets' circle
output_tilt_kg_m2 = {output_tilt:.4g}

[errors]                          # about ISO 1328 quality 5, or a thousandth of the module
ring_tooth_um = {tooth_error:.3g}
planet_tooth_um = {tooth_error:.3g}
sun_tooth_um = {tooth_error:.3g}
"""

_HALVES = """ in each half
double_helical = true
half_gap_mm = {gap:.6g}             # chosen: six modules for the tool to run out"""


def new_case_text(p: Proposal) -> str:
    """The case of a proposal in the short form. InputError where nothing holds its ring, or where a
    part is larger or smaller than a case may say."""
    text = _text(p)
    try:
        case_of_toml(tomllib.loads(text), "new", "new")
    except InputError as fault:
        raise InputError(
            "new", "--torque-nm",
            f"of {p.wanted.torque:g} N m with {p.wanted.planets} planets leads to {fault.key}: "
            f"{fault.problem}",
            "use more planets or a lower ratio for a smaller stage",
        ) from None  # fmt: skip
    return text


def _text(p: Proposal) -> str:
    bolts, c = around.bolting(p), around.carrier_size(p)
    stiffness = around.bearing_stiffness(p)
    arm, double = 0.25 * p.gear_width, p.wanted.double_helical
    mm = {
        **{name: 1e3 * value for name, value in vars(c).items()},
        "module": 1e3 * p.module,
        "width": 1e3 * p.face_width,
        "rim": 1e3 * bolts.rim,
        "circle": 1e3 * bolts.circle,
        "bolt": 1e3 * bolts.diameter,
        "seat_drive": 1e3 * min(1.1 * c.hub, 0.95 * c.plate_diameter),
        "seat_far": 1e3 * max(0.9 * c.hub, 1.12 * c.hub_bore),
        "seat_width": 0.5e3 * c.hub_length,
        "shaft_length": 1e3 * (p.gear_width + 4 * c.plate),
    }
    inertia = around.port_inertia(p)
    output = inertia / p.ratio**2
    return _TEXT.format(
        **mm,
        ratio=p.ratio, torque=p.wanted.torque, speed=p.wanted.speed * 30 / math.pi,
        helix=math.degrees(p.wanted.helix), planets=p.wanted.planets,
        module_said="as asked" if p.wanted.module else "DIN 780, from flank and root, see below",
        flank=FLANK, root=ROOT, form=FORM, factor=FACTOR,
        sun=p.sun, planet=p.planet, ring=p.ring,
        x_sun=p.shifts[0] + 0.0, x_planet=p.shifts[1] + 0.0, x_ring=p.shifts[2] + 0.0,
        ring_addendum=p.ring_addendum,
        bolts=bolts.number, bolt_across=bolts.across, bolt_axial=bolts.axial,
        bolt_tilt=bolts.tilt, bolt_twist=0.1 * bolts.tilt,
        bearing=stiffness, axial=0.25 * stiffness, tilt=stiffness * arm**2,
        hand_said="of planets and ring"
        + (" in the left half (-z)" if double else "; the sun has the other"),
        halves=_HALVES.format(gap=1e3 * p.half_gap) if double else "",
        end_said="at the outer end of the left half, the right one mirrored"
        if double
        else "on the drive side",
        planet_axial=(0.0025 if double else 0.25) * stiffness,
        planet_said="rollers slide; halves place the planet" if double else "a quarter",
        spline_axial=(0.01 if double else 1.0) * stiffness,
        spline_said="  # chosen: slides; halves place the sun" if double else "",
        spline_tilt=stiffness * arm**2, spline_torsion=1e3 * p.sun_torque,
        drive_inertia=inertia, output_inertia=output,
        output_mass=max(2 * output / p.center_distance**2, 0.01),
        output_tilt=max(0.5 * output, 1e-6),
        tooth_error=min(1.2 * math.sqrt(1e3 * p.module) + 2, 1e3 * p.module),
    )  # fmt: skip
