"""
Frames and signs
================

The conventions of docs/conventions.md, drawn with the package's own formulas for teeth, contact
points and flanks: a wrong sign would show as teeth that overlap.

Across the axis everything is seen from +Z. Angles, speeds and torques are positive
counter-clockwise.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import FancyArrowPatch

import flexgear as fg
from flexgear.gears.contact import planet_tooth_angle, sun_tooth_angle
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import stage_paths, tooth_sides
from flexgear.gears.power_flow import power_flow
from flexgear.views.stage_drawing import gear_outline, section_drawing
from flexgear.views.style import save_figure

case = fg.load_case("wind-5mw")
view, flow = case.view(), power_flow(case).stages[0]
g, paths = stage_geometry(view), stage_paths(view, flow.gear_mesh_forces)
a, turned = g.center_distance, np.radians(20)
SUN, PLANET, RING, CARRIER, TORQUE = "#0072B2", "#B87A00", "0.4", "#00795A", "#A3226B"


def polar(radius, angle):
    return radius * np.array([np.cos(angle), np.sin(angle)])


def arrow(ax, start, along, colour, width=1.6):
    style = {"arrowstyle": "-|>", "color": colour, "lw": width, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", np.add(start, along), start, arrowprops=style)


def label(ax, place, text, colour="black", shift=(0, 0), **style):
    box = {"fc": "white", "ec": "none", "pad": 0.8, "alpha": 0.85}
    style = {"ha": "center", "va": "center", "bbox": box, "color": colour, "zorder": 9} | style
    ax.annotate(text, place, shift, textcoords="offset points", **style)


def turning(ax, radius, start, end, colour):
    angle = np.linspace(start, end, 40)
    ax.plot(*polar(radius, angle[:-1]), color=colour, lw=1.8)
    head = FancyArrowPatch(
        polar(radius, angle[-3]), polar(radius, angle[-1]), color=colour,
        arrowstyle="-|>", mutation_scale=14, shrinkA=0, shrinkB=0,
    )  # fmt: skip
    ax.add_patch(head)


def axes_of(ax, origin, angle, size, names, colour):
    for k, name in enumerate(names):
        along = polar(size, angle + k * np.pi / 2)
        arrow(ax, origin, along, colour)
        label(ax, np.add(origin, along), name, colour, tuple(11 * along / size))


# %%
# Frames, numbers, torque
# -----------------------
# X, Y are fixed. The carrier, here turned by :math:`\theta_c` = 20°, has its x axis through
# planet 1; a planet has its x axis outward and y in the sense of rotation. Planets are numbered
# counter-clockwise, and so are teeth: tooth 1 of the ring stands on the X axis. The torque of the
# drive acts on the carrier and is positive, as its speed is; the sun turns faster in the same
# sense, and its load holds it back.
figure, ax = plt.subplots(figsize=(7, 6.6), layout="constrained")
ax.plot(*gear_outline(g.ring, 0.0).T, color=RING, lw=0.7)
for radius, ls in ((g.sun.reference_radius, "-"), (a, ":")):
    ax.plot(*polar(radius, np.linspace(0, 2 * np.pi, 181)), color="0.6", ls=ls, lw=1)
for i, phi in enumerate(view.stage.planet_angles):
    centre = polar(a, turned + phi)
    rim = polar(g.planet.reference_radius, np.linspace(0, 2 * np.pi, 181))
    ax.plot(*(centre[:, None] + rim), color=PLANET, lw=1)
    axes_of(ax, centre, turned + phi, 0.15, ("x", "y"), PLANET)
    back = polar(0.1, turned + phi + 1.25 * np.pi)
    label(ax, centre + back, f"planet {i + 1}", PLANET)
axes_of(ax, (0, 0), 0.0, 0.15, ("X", "Y"), "black")
axes_of(ax, (0, 0), turned, 0.34, ("", "y"), CARRIER)
label(ax, polar(0.24, turned), "x of the\ncarrier", CARRIER, (-14, 19))
turning(ax, 0.3, 0.0, turned, CARRIER)
ax.plot([0, 0.31], [0, 0], color="0.6", lw=0.8, zorder=0)
label(ax, polar(0.3, turned / 2), r"$\theta_c$", CARRIER, (12, 0))
for tooth in range(0, g.ring.teeth, 10):
    at = tooth * g.ring.pitch_angle
    ax.plot(*np.array([polar(r, at) for r in (0.875, 0.9)]).T, color=RING, lw=1.2)
    label(ax, polar(0.94, at), f"{tooth + 1}", RING)
turning(ax, 1.02, np.radians(12), np.radians(28), RING)
label(ax, (1.13, 0.1), "numbers of\nthe ring's teeth", RING)
turning(ax, 1.03, np.radians(60), np.radians(120), TORQUE)
label(
    ax,
    polar(1.03, np.pi / 2),
    r"$T_c > 0$ of the drive on the carrier, $\omega_c > 0$",
    TORQUE,
    (0, 16),
)
turning(ax, 0.11, np.radians(-60), np.radians(-150), SUN)
label(ax, (0, -0.16), r"$T_s < 0$ of the load" "\n" r"on the sun, $\omega_s > 0$", SUN, (0, -6))
_ = ax.set(xlim=(-1.02, 1.36), ylim=(-1.02, 1.2), xlabel="X (m)", ylabel="Y (m)", aspect="equal")
torque = {member.partition(".")[2]: t for member, t in power_flow(case).torque.items()}
print("torques from outside, kN m:", {part: round(t / 1e3) for part, t in torque.items()})
print("wrote", save_figure(figure, "frames.png"))

# %%
# Sides and faces
# ---------------
# The same stage cut along its axis. z = 0 is the middle of the face; its ends are the −z face and
# the +z face.
figure = section_drawing(view)
ax, half = figure.axes[0], 500 * view.stage.face_width
for z, text in ((-half, "−z face"), (0, "z = 0"), (half, "+z face")):
    ax.axvline(z, color=TORQUE, lw=1, ls="--")
    label(ax, (z, ax.get_ylim()[1]), text, TORQUE, (0, 9), fontsize=9)
for z, r, text in (
    (105, 910, "ring"), (105, 790, "planet"), (105, 620, "pin"), (310, 560, "carrier"),
    (105, 200, "sun"),
    (-560, 850, f"drive side:\n{view.carrier.drive_side}, the rotor's"),
    (800, 200, f"sun's shaft leaves to {view.shaft.direction}"),
):  # fmt: skip
    label(ax, (z, r), text.replace("-z", "−z"), bbox=None, fontsize=9)
ax.annotate(
    f"bolted face\nof the ring: {view.ring.end}".replace("-z", "−z"), (-250, 985), (-660, 1020),
    va="center", fontsize=9, arrowprops={"arrowstyle": "->", "color": "#BB5566"},
)  # fmt: skip
arrow(ax, (1150, 700), (-350, 0), "black")
label(
    ax,
    (975, 700),
    "seen this way in the pictures\nacross the axis, from +Z",
    shift=(0, 18),
    fontsize=9,
)
arrow(ax, (900, 0), (200, 0), "black")
label(ax, (1100, 0), "z", shift=(10, 0))
print("wrote", save_figure(figure, "sides_and_faces.png"))

# %%
# Flanks, numbers and pressure angle at the ring
# ----------------------------------------------
# Planet 1 at :math:`\theta_c` = 0. The carrier takes the planet upward, and the ring, which is
# held, pushes it back. n is the direction of the force on the planet; with the tangent of the
# working circles it makes the working pressure angle. The ring carries on its drive flank, on the
# −θ side of its teeth, the planet on its flank ``ring``, on the +θ side.
DRIVE, OTHER, MILLI, WIDTH = "#D55E00", "#2B7BBA", 1e3, 100.0  # mm, half of what is seen
sides = tooth_sides("planetary", forward=True)
at_ring, at_sun = paths["ring", ""], paths["sun", ""]
tooth_1 = {  # its angle, from a pair whose place and tooth numbers are known
    "ring": 0.0,
    "planet": planet_tooth_angle(g, at_ring.s0[0])
    - at_ring.planet_tooth0[0] * g.planet.pitch_angle,
    "sun": sun_tooth_angle(g, at_sun.s0[0]) - at_sun.gear_tooth0[0] * g.sun.pitch_angle,
}


def gear_near(ax, part, colour, carrying, near):
    """Teeth of a gear near a point: outline, flanks, numbers. carrying: its flank that carries.
    Points of the flanks (2, n), mm, from tip to root, by tooth's number and flank's name."""
    gear, centre = getattr(g, part), MILLI * np.array([a if part == "planet" else 0.0, 0.0])
    side, flanks = gear.profile(40, 20).T, {}
    bottom = polar(gear.root_radius, np.linspace(gear.root.end_angle, gear.pitch_angle / 2, 5))
    edge = MILLI * np.hstack([side, bottom])
    for tooth in range(gear.teeth):
        angle = tooth_1[part] + tooth * gear.pitch_angle
        middle = centre + MILLI * polar(gear.root_radius, angle)
        if np.hypot(*(middle - near)) > 1.6 * WIDTH:
            continue
        turn = np.array([polar(1.0, angle), polar(1.0, angle + np.pi / 2)]).T
        whole = np.hstack([edge[:, ::-1] * [[1], [-1]], edge])
        ax.plot(*(centre[:, None] + turn @ whole), color=colour, lw=1)
        for name in ("sun", "ring") if part == "planet" else ("drive", "coast"):
            flank = centre[:, None] + turn @ (edge[:, :41] * [[1], [sides[part, name]]])
            style = {"color": DRIVE} if name == carrying else {"color": OTHER, "ls": (0, (3, 1))}
            ax.plot(*flank, lw=2.8, **style)
            flanks[tooth + 1, name] = flank
        if abs(middle[1] - near[1]) < 0.7 * WIDTH:
            label(ax, middle, f"{tooth + 1}", colour)
    return flanks


def gear_mesh(path, kind, colour):
    """Figure, axes, flanks and pitch point of a gear mesh, with n and the pressure angle."""
    figure, ax = plt.subplots(figsize=(7, 5.9), layout="constrained")
    n, start = path.normal_xy, MILLI * (path.tangent_point + [a, 0])
    pitch = start - start[1] / n[1] * n
    for x, y in ((0.0, 0.9 * WIDTH), (0.5 * WIDTH, 0.0)):
        ax.plot(pitch[0] + [-x, x], pitch[1] + [-y, y], color="0.55", lw=0.9, ls="-.")
    flanks = {kind: gear_near(ax, kind, colour, "drive", pitch)}
    flanks["planet"] = gear_near(ax, "planet", PLANET, kind, pitch)
    ax.plot([], color=DRIVE, lw=2.8, label="flanks that carry")
    ax.plot([], color=OTHER, lw=2.8, ls=(0, (3, 1)), label="the other flanks")
    ends = start[:, None] - MILLI * n[:, None] * [path.s_lo, path.s_hi]
    ax.plot(*ends, color="black", lw=2, label="path of contact")
    s = path.s0[0] + path.base_pitch * np.arange(-200, 200)
    touch = start[:, None] - MILLI * n[:, None] * s[(s >= path.s_lo) & (s <= path.s_hi)]
    ax.plot(*touch, "o", color="black", ms=6, label="pairs in contact")
    action = pitch[:, None] + WIDTH * n[:, None] * [0, 0.85]
    ax.plot(*action, color="0.55", lw=0.9, ls="-.")
    arrow(ax, pitch, 0.6 * WIDTH * n, "black", 2)
    label(ax, pitch + 0.57 * WIDTH * n, "n", shift=(-24, 0))
    arc = np.linspace(-np.pi / 2, np.copysign(path.alpha, n[0]) - np.pi / 2, 30)
    ax.plot(*(pitch[:, None] + polar(0.7 * WIDTH, arc)), color="black", lw=1.2)
    corner, angle_deg = [-np.copysign(72, n[0]), -86], np.degrees(path.alpha)
    text = f"working pressure\nangle {angle_deg:.1f}°"
    note(ax, pitch + corner, pitch + polar(0.7 * WIDTH, arc[10]), text, "black")
    aside = pitch[0] + np.copysign(1.08, n[0]) * WIDTH
    arrow(ax, (aside, pitch[1] - 0.55 * WIDTH), (0, 0.4 * WIDTH), TORQUE)
    ax.text(aside, pitch[1] - 0.62 * WIDTH, "planet\nmoves", color=TORQUE, ha="center", va="top")
    ax.set(xlim=pitch[0] + np.array([-1.2, 1.2]) * WIDTH, ylim=pitch[1] + np.array([-1, 1]) * WIDTH,
           xlabel="X (mm)", ylabel="Y (mm)", aspect="equal")  # fmt: skip
    ax.legend(loc="upper left" if n[0] < 0 else "upper right")
    return figure, ax, flanks, pitch


def note(ax, place, point, text, colour):
    style = {"arrowstyle": "-", "color": colour, "lw": 1, "shrinkB": 0}
    ax.annotate(text, point, place, color=colour, ha="center", va="center", arrowprops=style)


figure, ax, flanks, pitch = gear_mesh(at_ring, "ring", RING)
for part, tooth, name, text, (x, y) in (
    ("ring", 1, "drive", "ring: drive flank,\n−θ side", (78, -25)),
    ("ring", 1, "coast", "ring: coast flank,\n+θ side", (78, 25)),
    ("planet", 2, "sun", "planet: flank sun,\n−θ side", (-78, 25)),
    ("planet", 1, "ring", "planet: flank ring,\n+θ side", (-78, -15)),
):
    colour = DRIVE if name in ("drive", "ring") else OTHER
    note(ax, pitch + [x, y], flanks[part][tooth, name][:, -3], text, colour)
print(f"ring: working pressure angle {np.degrees(at_ring.alpha):.2f}°")
print("wrote", save_figure(figure, "flanks_at_the_ring.png"))

# %%
# Flanks, numbers and pressure angle at the sun
# ---------------------------------------------
# The same planet pushes the sun upward with its flank ``sun``, on the −θ side of its teeth, and
# loads the sun's drive flank, on the −θ side, too. So a planet's tooth carries on one flank at
# the sun and on the other at the ring. Under a torque of the other sense the other flanks carry.
figure, ax, flanks, pitch = gear_mesh(at_sun, "sun", SUN)
for part, tooth, name, text, (x, y) in (
    ("sun", 11, "drive", "sun: drive flank,\n−θ side", (-78, 15)),
    ("sun", 10, "coast", "sun: coast flank,\n+θ side", (-78, -20)),
    ("planet", 18, "sun", "planet: flank sun,\n−θ side", (78, 25)),
    ("planet", 18, "ring", "planet: flank ring,\n+θ side", (78, -5)),
):
    colour = DRIVE if name in ("drive", "sun") else OTHER
    note(ax, pitch + [x, y], flanks[part][tooth, name][:, -3], text, colour)
print(f"sun: working pressure angle {np.degrees(at_sun.alpha):.2f}°")
print("wrote", save_figure(figure, "flanks_at_the_sun.png"))

# %%
# Helix
# -----
# Reference cylinders unrolled and seen from outside, z upward: φ then rises to the right, and
# with it the numbers of teeth. A right-handed tooth leans to the right as z rises. The planet's
# hand is that of the ring; the sun has the other.
figure, axes = plt.subplots(1, 3, figsize=(7, 4), layout="constrained", sharey=True)
z = MILLI * np.array([-0.5, 0.5]) * view.stage.face_width
planet_turn = at_ring.slope / g.planet.base_radius  # κ = dφ/dz
turns = {"sun": -planet_turn * g.planet.base_radius / g.sun.base_radius, "planet": planet_turn,
         "ring": planet_turn * g.planet.base_radius / g.ring.base_radius}  # fmt: skip
for ax, (name, turn), colour in zip(axes, turns.items(), (SUN, PLANET, RING), strict=True):
    gear = getattr(g, name)
    for tooth in range(-1, 3):
        middle, lean = MILLI * tooth * gear.pitch_angle, turn * gear.reference_radius
        middle *= gear.reference_radius
        ax.plot(middle + lean * z, z, color=colour, lw=2)
        label(ax, (middle + lean * 100, 100), f"{tooth % gear.teeth + 1}", colour)
    for level, text in zip((z[0], 0.0, z[1]), ("−z face", "z = 0", "+z face"), strict=True):
        ax.axhline(level, color=TORQUE, lw=1, ls="--")
        label(ax, (205, level), text, TORQUE, fontsize=9)
    hand = "right" if turn > 0 else "left"
    ax.set(title=f"{name}: {hand}-handed", xlabel="r φ (mm)", xlim=(-100, 262), ylim=1.15 * z)
_ = axes[0].set_ylabel("z (mm)")
print({name: "right-handed" if turn > 0 else "left-handed" for name, turn in turns.items()})
print("wrote", save_figure(figure, "helix.png"))
