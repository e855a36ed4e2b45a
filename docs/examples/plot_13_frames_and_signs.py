"""
Frames and signs
================

The conventions of docs/conventions.md as the package itself places things: teeth stand where the
contact formulas put them, so that a wrong sign would show as teeth that overlap.
"""

import matplotlib.pyplot as plt
import numpy as np

import flexgear as fg
from flexgear.gears.contact import planet_tooth_angle, ring_start, sun_side, sun_tooth_angle
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.views.stage_drawing import gear_outline

case = fg.load_case("wind-5mw")
view, flow = case.view(), power_flow(case).stages[0]
g, paths = stage_geometry(view), stage_paths(view, flow.gear_mesh_forces)
figure, (frames, teeth, helix) = plt.subplots(
    1, 3, figsize=(16.5, 6.2), layout="constrained", width_ratios=[1, 1.1, 0.75]
)
a, turned = g.center_distance, np.radians(20)


def arrow(ax, start, along, text, colour, shift=(0, 0)):
    tip = np.add(start, along)
    style = {"arrowstyle": "-|>", "color": colour, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", tip, start, arrowprops=style)
    ax.annotate(
        text, tip, shift, textcoords="offset points", color=colour, ha="center", va="center"
    )


def circle(ax, centre, radius, **style):
    angle = np.linspace(0, 2 * np.pi, 181)
    ax.plot(centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), **style)


def axes_of(ax, origin, angle, size, names, colour):
    for k, name in enumerate(names):
        along = size * np.array([np.cos(angle + k * np.pi / 2), np.sin(angle + k * np.pi / 2)])
        arrow(ax, origin, along, name, colour, tuple(12 * along / size))


# fixed, carrier and planet frames, seen from +Z
for radius, ls in ((g.ring.reference_radius, "-"), (g.sun.reference_radius, "-"), (a, ":")):
    circle(frames, (0, 0), radius, color="0.6", ls=ls, lw=1)
for i, phi in enumerate(view.stage.planet_angles):
    centre = a * np.array([np.cos(turned + phi), np.sin(turned + phi)])
    circle(frames, centre, g.planet.reference_radius, color="#E69F00", lw=1)
    frames.annotate(str(i + 1), centre, (-9, -9), textcoords="offset points")
    axes_of(frames, centre, turned + phi, 0.16, ("x", "y"), "#E69F00")
axes_of(frames, (0, 0), 0.0, 0.24, ("X", "Y"), "black")
axes_of(frames, (0, 0), turned, 0.4, ("", ""), "#009E73")
frames.annotate("x of the carrier", (0.16, 0.09), color="#009E73", rotation=np.degrees(turned))
arc = np.linspace(0, turned, 30)
frames.plot(0.33 * np.cos(arc), 0.33 * np.sin(arc), color="#009E73")
frames.annotate(r"$\theta_c$", (0.36 * np.cos(turned / 2), 0.36 * np.sin(turned / 2)), va="center")
frames.plot(*(g.ring.tip_radius * np.array([1, 0])), "k>", ms=7)
frames.annotate(
    "ring tooth 1", (g.ring.tip_radius, 0), (-6, -14), textcoords="offset points", ha="right"
)
frames.set_title("seen from +Z: speeds, torques, angles positive counter-clockwise")

# planet 1 at rest on the X axis: which flanks carry, and where they touch
s_ring = float(ring_start(g, np.zeros(1))[0])
gamma = planet_tooth_angle(g, np.array([s_ring]))
s_sun = float(sun_side(g, gamma)[0])
sigma = float(sun_tooth_angle(g, np.array([s_sun]))[0])
for outline, centre, colour in (
    (gear_outline(g.ring, 0.0), 0.0, "0.45"),
    (gear_outline(g.planet, float(gamma[0])), a, "#E69F00"),
    (gear_outline(g.sun, sigma), 0.0, "#0072B2"),
):
    teeth.plot(outline[:, 0] + centre, outline[:, 1], color=colour, lw=1)
for kind, s, colour in (("ring", s_ring, "#D55E00"), ("sun", s_sun, "#CC79A7")):
    path = paths[kind, ""]
    s += path.base_pitch * np.ceil((path.s_lo - s) / path.base_pitch)
    line = path.tangent_point - np.outer([path.s_lo, path.s_hi], path.normal_xy) + [a, 0]
    teeth.plot(
        line[:, 0], line[:, 1], color=colour, lw=3, alpha=0.5, label=f"path of contact, {kind}"
    )
    while s <= path.s_hi:
        point = path.tangent_point - s * path.normal_xy + [a, 0]
        teeth.plot(*point, "o", color=colour, ms=5)
        s += path.base_pitch
    arrow(teeth, line.mean(axis=0), 0.09 * path.normal_xy, "n", colour, (10, -4))
teeth.annotate(
    "drive flanks touch,\ncoast flanks face each other\nwith the backlash",
    (a, 0),
    ha="center",
    va="center",
)
arrow(teeth, (a, 0.12), (0, 0.1), "the carrier drives", "black", (0, 8))
teeth.set(xlim=(0.19, 0.87), ylim=(-0.3, 0.38))
teeth.legend(loc="upper center", ncols=2)
teeth.set_title("planet 1 at $\\theta_c$ = 0; n: direction of the force on the planet")

# helix hand and sides: teeth on their reference cylinders, unrolled and seen from outside
z = np.array([-0.5, 0.5]) * view.stage.face_width
planet_turn = paths["ring", ""].slope / g.planet.base_radius  # κ = dφ/dz
turns = {"planet": planet_turn, "ring": planet_turn * g.planet.base_radius / g.ring.base_radius,
         "sun": -planet_turn * g.planet.base_radius / g.sun.base_radius}  # fmt: skip
for k, (name, turn) in enumerate(turns.items()):
    radius = getattr(g, name).reference_radius
    for tooth in range(-2, 3):
        at = 0.35 * k + radius * (
            turn * z + tooth * g.sun.pitch_angle * g.sun.reference_radius / radius / 2
        )
        helix.plot(z, at, color=("#E69F00", "0.45", "#0072B2")[k])
    helix.annotate(name, (0, 0.35 * k + 0.12), ha="center")
helix.axvline(z[0], color="0.8"), helix.axvline(z[1], color="0.8")
helix.annotate(
    f"drive side {view.carrier.drive_side}", (z[0], -0.16), (4, 0), textcoords="offset points"
)
helix.set(xlabel="z (m)", ylabel="r φ (m)", ylim=(-0.2, 0.9))
helix.set_title(f"planet hand: {view.stage.planet_hand}")
for ax in (frames, teeth):
    ax.set_aspect("equal")
    ax.set(xlabel="X (m)", ylabel="Y (m)")
