"""Springs between two 6-dof nodes; bearings, their rolling elements and ratings; the lubricant."""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import (
    Angle,
    Density,
    Force,
    Length,
    Life,
    MatrixEntry,
    RotationalDamping,
    RotationalStiffness,
    Stiffness,
    Temperature,
    TranslationalDamping,
    Viscosity,
)

LARGEST = 1e16  # N/m, N m/rad, of a matrix of springs


class Rollers(Section):
    """Rows of cylindrical rollers of steel.

    count: rollers of a row; rows: side by side; length: effective length of a roller; spacing:
    between the middles of neighbouring rows; clearance: radial gap on every side (half of the
    radial internal clearance that catalogues state).
    """

    count: int = Field(ge=4, le=200)
    rows: int = Field(default=1, ge=1, le=4)
    length: Length = Field(gt=0.0, le=1.0)
    spacing: Length = Field(default=0.0, ge=0.0, le=1.0)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)

    @property
    def places(self) -> tuple[float, ...]:
        """Axial positions of the rows from the middle of the bearing, m."""
        middle = 0.5 * (self.rows - 1)
        return tuple(self.spacing * (j - middle) for j in range(self.rows))

    def _check(self) -> None:
        if self.rows > 1:
            _refuse_overlap("spacing", self.spacing, self.length)


def _refuse_overlap(key: str, spacing: float, length: float) -> None:
    """Raise Refusal for rows of rollers that reach into one another along the axis; m."""
    if spacing < length:
        problem = f"{1e3 * spacing:g} mm is less than the length of rollers, {1e3 * length:g} mm"
        raise Refusal(key, problem, "give the distance between the middles of neighbouring rows")


class Springs(Section):
    """Stiffness of a link between two nodes.

    radial: across the axis, x and y. radial_x, radial_y: in place of radial in one direction.
    axial: along the axis. tilt: about x and y. tilt_x, tilt_y: in place of tilt about one axis.
    torsion: about the axis. full: symmetric 6 x 6 matrix that replaces all other keys; rows and
    columns are ux, uy, uz (m), rx, ry, rz (rad).
    """

    radial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    radial_x: Stiffness | None = Field(default=None, ge=0.0, le=1e14)
    radial_y: Stiffness | None = Field(default=None, ge=0.0, le=1e14)
    axial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)
    tilt_x: RotationalStiffness | None = Field(default=None, ge=0.0, le=1e14)
    tilt_y: RotationalStiffness | None = Field(default=None, ge=0.0, le=1e14)
    torsion: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)
    full: tuple[tuple[MatrixEntry, ...], ...] | None = None

    @property
    def stiffness(self) -> tuple[float, float, float, float, float, float]:
        """Diagonal of ``matrix``: three values in N/m, three in N m/rad."""
        if self.full is not None:
            d = np.diag(np.array(self.full))
            return (d[0], d[1], d[2], d[3], d[4], d[5])
        x = self.radial if self.radial_x is None else self.radial_x
        y = self.radial if self.radial_y is None else self.radial_y
        a = self.tilt if self.tilt_x is None else self.tilt_x
        b = self.tilt if self.tilt_y is None else self.tilt_y
        return (x, y, self.axial, a, b, self.torsion)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Stiffness (6, 6), SI."""
        return np.diag(self.stiffness) if self.full is None else np.array(self.full)

    def _check(self) -> None:
        if self.full is None:
            return
        if len(self.full) != 6 or any(len(row) != 6 for row in self.full):
            raise Refusal("full", "is not 6 x 6", "give six rows of six numbers")
        k = np.array(self.full)
        if np.abs(k).max() > LARGEST:
            problem = f"has entries beyond {LARGEST:g}"
            raise Refusal("full", problem, "check the unit: N/m, N m/rad")
        scale = np.sqrt(np.abs(np.diag(k)))
        if np.abs(k - k.T).max() > 1e-9 * np.abs(k).max():
            raise Refusal("full", "is not symmetric", "forces would not balance; correct it")
        unit = k / np.where(scale > 0, scale, 1.0) / np.where(scale > 0, scale, 1.0)[:, None]
        if not np.isfinite(unit).all() or np.linalg.eigvalsh(unit).min() < -1e-9:
            raise Refusal("full", "is not positive semidefinite", "correct its signs")


def at_height(z: float) -> NDArray[np.float64]:
    """Matrix (6, 6) from the motion of a body's node to that of a point at z (m) on its axis."""
    transform = np.eye(6)
    transform[0, 4], transform[1, 3] = z, -z
    return transform


class Dampers(Section):
    """Viscous dampers parallel to the springs of a bearing, F = c δ̇.

    radial: across the axis, x and y. axial: along the axis. tilt: about x and y. torsion: about the
    axis, against its whole rotation: a drag torque.
    """

    radial: TranslationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    axial: TranslationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    tilt: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    torsion: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Damping along and about x, y, z: three values in N s/m, three in N m s/rad."""
        return (self.radial, self.radial, self.axial, self.tilt, self.tilt, self.torsion)


class RollingElements(Section):
    """Rolling elements of one bearing, for the load in every row (ISO/TS 16281).

    Keys that are in ``rollers`` of the same bearing are left out here.

    count: elements of a row; rows: number of rows of one bearing; spacing: between the middles of
    neighbouring rows, also of neighbouring bearings; the rows are symmetric about z of the bearing.
    diameter: D_w of balls, D_we of rollers. pitch_diameter: D_pw of the circle of their centres.
    length: L_we, effective length of rollers. clearance: radial gap on every side (half of the
    radial internal clearance) in operation. contact_angle: nominal; one half of several rows faces
    +z and the other half -z, and a single row is loaded by thrust along +z. arrangement: contact
    lines meet the axis outside of the rows ("O") or between them ("X"). profile: of rollers, see
    below. drops: profile drops of a table, at equal steps from the middle of the roller to its end.
    edge_stress: whether lives include the stress concentration at the ends of rollers, a factor of
    the standard on the loads of laminae. laminae: n_s of a roller, on which that factor depends.
    inner_groove, outer_groove: groove radius over ball diameter. tilt_arm: of balls, R at which a
    tilt moves the raceways along the axis; by the groove of the inner ring if left out, D_pw/2 in
    some programs.

    logarithmic  that of ISO/TS 16281
    straight     none
    table        ``drops``
    """

    count: int | None = Field(default=None, ge=3, le=300)
    rows: int | None = Field(default=None, ge=1, le=4)
    spacing: Length | None = Field(default=None, ge=0.0, le=3.0)
    diameter: Length = Field(gt=0.0, le=1.0)
    pitch_diameter: Length = Field(gt=0.0, le=10.0)
    length: Length | None = Field(default=None, gt=0.0, le=1.0)
    clearance: Length | None = Field(default=None, ge=-1e-3, le=5e-3)
    contact_angle: Angle = Field(default=0.0, ge=0.0, le=0.78539816339745)
    arrangement: Literal["O", "X"] = "O"
    profile: Literal["logarithmic", "straight", "table"] = "logarithmic"
    drops: tuple[Length, ...] = ()
    edge_stress: bool = True
    laminae: int = Field(default=30, ge=30, le=1000)
    inner_groove: float = Field(default=0.52, gt=0.5, le=1.0)
    outer_groove: float = Field(default=0.53, gt=0.5, le=1.0)
    tilt_arm: Length | None = Field(default=None, gt=0.0, le=5.0)

    def _check(self) -> None:
        if self.diameter >= self.pitch_diameter:
            raise Refusal("diameter", "is not below pitch_diameter", "correct one of them")
        if (self.profile == "table") != bool(self.drops):
            remedy = 'give both profile = "table" and drops, or neither'
            raise Refusal("drops", 'needs profile = "table"', remedy)
        if len(self.drops) == 1 or any(drop < 0 for drop in self.drops):
            raise Refusal("drops", "is no profile", "give two values or more, none negative")


class Thrust(Section):
    """How thrust counts in the equivalent loads of a bearing that has no ``elements``.

    P = F_r + Y_1 F_a where F_a is at most e F_r, else X F_r + Y F_a (ISO 281); P_0 = X_0 F_r + Y_0
    F_a, at least F_r (ISO 76). Thrusts of both directions are alike.

    contact_angle: nominal, from which the factors follow by the tables of both standards: of
    rollers, of balls from 20° on, and 0 of deep-groove balls. rows: of one bearing: 1, or 2 that
    face one another, as in a pair of single-row bearings with the ratings of the pair.
    calculation_factor: f_0 of deep-groove balls (ISO 76), as catalogues state it. e, x, y, y_1:
    factors of a catalogue in place of contact_angle. x_0, y_0: likewise, for the static safety.
    direction: of the thrust of the shaft that a single row takes, and under which radial loads
    induce thrust on the bearing of the same member with the other direction; a pair without
    preload.
    """

    contact_angle: Angle | None = Field(default=None, ge=0.0, le=0.78539816339745)
    direction: Literal["+z", "-z"] | None = None
    rows: int = Field(default=1, ge=1, le=2)
    calculation_factor: float | None = Field(default=None, ge=3.0, le=30.0)
    e: float | None = Field(default=None, gt=0.0, le=10.0)
    x: float | None = Field(default=None, ge=0.0, le=2.0)
    y: float | None = Field(default=None, ge=0.0, le=10.0)
    y_1: float = Field(default=0.0, ge=0.0, le=10.0)
    x_0: float | None = Field(default=None, ge=0.0, le=2.0)
    y_0: float | None = Field(default=None, ge=0.0, le=10.0)

    def _check(self) -> None:
        if self.direction is not None and (self.rows == 2 or 0.0 in (self.contact_angle, self.y)):
            problem = "is of single rows with a contact angle"
            raise Refusal("direction", problem, "take it out, or correct the others")
        if self.contact_angle is None:
            remedy = "give contact_angle_deg, or e, x and y"
            self._require_set(("e", "x", "y"), "is missing without contact_angle", remedy)
            return
        factors = ("e", "x", "y", "y_1", "x_0", "y_0")
        self._refuse_set(factors, "follows from contact_angle", "keep one of the two")


class Rolling(Section):
    """Data for the rating of a rolling bearing.

    dynamic_rating: C of one bearing, for the basic rating life; static_rating: C_0; rolling: kind
    of its elements, which decides the life exponent; fatigue_load_limit: C_u, for the modified
    life; mean_diameter: of bore and outer ring, for the modified life without elements. count:
    equal bearings side by side, which share the load evenly; the load of their rows follows from
    elements. required_life: limit for the verdict on the rating life. elements: for the load in
    rows. thrust: for the equivalent load without elements, which is the radial load where thrust is
    left out.
    """

    dynamic_rating: Force | None = Field(default=None, gt=0.0, le=1e9)
    static_rating: Force | None = Field(default=None, gt=0.0, le=1e9)
    fatigue_load_limit: Force | None = Field(default=None, gt=0.0, le=1e9)
    mean_diameter: Length | None = Field(default=None, ge=1e-3, le=10.0)
    rolling: Literal["roller", "ball"] | None = None
    count: int = Field(default=1, ge=1, le=8)
    required_life: Life | None = Field(default=None, gt=0.0, le=3.6e10)
    elements: RollingElements | None = None
    thrust: Thrust | None = None

    def _check(self) -> None:
        for key in ("dynamic_rating", "elements"):
            if getattr(self, key) is not None:
                remedy = 'add rolling = "roller" or "ball"'
                self._require_set(["rolling"], f"is missing beside {key}", remedy)
        if self.required_life is not None:
            remedy = "add dynamic_rating and rolling"
            self._require_set(["dynamic_rating"], "is missing beside required_life", remedy)
        if self.mean_diameter is not None:
            if self.elements is not None:
                problem = "stands beside elements, which have a pitch_diameter"
                raise Refusal("mean_diameter", problem, "keep one of the two")
            needed = ("dynamic_rating", "fatigue_load_limit")
            self._require_set(needed, "is missing beside mean_diameter", "add it, in kN")
        if self.thrust is not None:
            self._check_thrust(self.thrust)

    def _check_thrust(self, thrust: Thrust) -> None:
        if self.elements is not None:
            problem = "stands beside elements, whose contact angle says it"
            raise Refusal("thrust", problem, "keep one of the two")
        self._require_set(["dynamic_rating"], "is missing beside thrust", "add dynamic_rating_kn")
        angle = thrust.contact_angle
        if self.rolling == "roller" and angle == 0.0:
            problem = "is 0, and rollers without one take no thrust but by their ribs"
            raise Refusal("thrust.contact_angle", problem, "take thrust out, or give e, x and y")
        if self.rolling == "ball" and angle == 0.0:
            self._require_set(["static_rating"], "is missing beside thrust", "add static_rating_kn")
            if thrust.calculation_factor is None:
                raise Missing("thrust.calculation_factor", "is missing of deep-groove balls")
        elif self.rolling == "ball" and angle is not None and angle < math.radians(20 - 1e-9):
            problem = f"is {math.degrees(angle):g}: factors of balls below 20 deg follow the load"
            raise Refusal("thrust.contact_angle", problem, "give e, x and y of the catalogue")


class Bearing(Springs, Rolling):
    """A bearing with springs and data for its rating; ``torsion``, stiffness against rotation about
    its axis, is usually 0.

    z: where its springs act along the axis, m, from the middle of the gear or the seat, off centre
    where two rows are unequal. They act on u_x + z r_y, u_y - z r_x and the tilts. clearance:
    radial gap there before the radial springs carry. rollers: carry radial load and tilting moment
    with a stiffness that grows with load; radial and tilt, if left out that of rows which share
    radial, are then used in modes and other linear analyses. damping: dampers at z beside the
    springs.
    """

    z: Length = Field(default=0.0, ge=-5.0, le=5.0)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)
    rollers: Rollers | None = None
    damping: Dampers | None = None

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Stiffness (6, 6) at the node, Tᵀ K T with T the motion at z; SI."""
        to_z = at_height(self.z)
        return to_z.T @ super().matrix @ to_z

    def _check(self) -> None:
        _check_elements(self)
        if self.rollers is not None and (min(self.stiffness[:2]) <= 0 or self.full is not None):
            problem = "is needed beside rollers: the stiffness in modes and other linear analyses"
            raise Refusal("radial", problem, "give radial, and no full matrix")
        if self.clearance == 0:
            return
        if min(self.stiffness[:2]) <= 0:
            problem = "is the gap of a support without radial stiffness"
            raise Refusal("clearance", problem, "give radial")
        if self.rollers is not None:
            raise Refusal("clearance", "stands beside rollers", "give it as rollers.clearance")
        if self.full is not None and np.array(self.full)[:2, 2:].any():
            problem = "is a radial gap, but full couples radial motion with other directions"
            raise Refusal("clearance", problem, "delete one of the two")


def _check_elements(bearing: Bearing) -> None:
    """Raise Refusal if ``elements`` lack a dimension, or contradict ``rolling`` or ``rollers``."""
    elements, rollers = bearing.elements, bearing.rollers
    if elements is None:
        return
    count = rollers.count if rollers else elements.count
    chord = elements.pitch_diameter * math.sin(math.pi / count) if count else math.inf
    if elements.diameter > chord:
        problem = f"is too large: each element has only {1e3 * chord:.4g} mm on the circle"
        raise Refusal("elements.diameter", problem, "correct it, count or pitch_diameter")
    if bearing.rolling == "ball":
        distance = (elements.inner_groove + elements.outer_groove - 1) * elements.diameter
        limit = distance * math.cos(elements.contact_angle)
        if elements.length is not None:
            problem, remedy = "is that of rollers, but these are balls", "delete it"
            raise Refusal("elements.length", problem, remedy)
        if (elements.clearance or 0.0) >= limit:
            problem = f"is too large for groove centres that are {1e3 * distance:.4g} mm apart"
            raise Refusal("elements.clearance", problem, f"keep it below {1e3 * limit:.4g} mm")
    if rollers is None:
        several = (elements.rows or 1) * bearing.count > 1
        needed = {"count": True, "length": bearing.rolling == "roller", "spacing": several}
        for key, is_needed in needed.items():
            if is_needed and getattr(elements, key) is None:
                unit = "" if key == "count" else "_mm"
                raise Missing(f"elements.{key}", "is missing", f"add elements.{key}{unit}")
        if elements.length and elements.spacing is not None and not elements.contact_angle:
            _refuse_overlap("elements.spacing", elements.spacing, elements.length)
        return
    if bearing.rolling == "ball":
        raise Refusal("rolling", "is ball, beside rollers", "take one of the two out")
    if rollers.rows % bearing.count:
        problem = f"of {rollers.rows} rows are not {bearing.count} equal bearings"
        raise Refusal("rollers.rows", problem, "correct rows or count")
    for key in ("count", "rows", "spacing", "length", "clearance"):
        if getattr(elements, key) is not None:
            raise Refusal(f"elements.{key}", "is given in rollers, too", "keep that in rollers")


class Lubricant(Section):
    """Lubricant of the whole gearbox, for the rating of gears and bearings.

    viscosity_40: kinematic viscosity at 40 °C (the number of an ISO VG class); viscosity_100:
    kinematic viscosity at 100 °C, which determines it at other temperatures; a viscosity index of
    95 is assumed if left out. temperature: of the oil in contacts; operating_viscosity: kinematic
    viscosity at the operating temperature, in place of temperature. density: at the operating
    temperature, for the dynamic viscosity in journal bearings. cleanliness: ISO 4406 code of solid
    particles in an oil circuit with a filter (filters of β_6 = 200, β_12 = 200, β_25 = 75,
    β_40 = 75 in this order); together with the bearing's size it determines the contamination
    factor e_C of ISO 281. contamination: e_C itself, in place of cleanliness. Without both, only
    the basic life of bearings is computed.
    """

    viscosity_40: Viscosity = Field(ge=1e-6, le=1e-2)
    viscosity_100: Viscosity | None = Field(default=None, ge=5e-7, le=1e-2)
    temperature: Temperature | None = Field(default=None, ge=223.15, le=473.15)
    operating_viscosity: Viscosity | None = Field(default=None, ge=5e-7, le=1e-1)
    density: Density | None = Field(default=None, ge=500.0, le=1500.0)
    cleanliness: Literal["-/13/10", "-/15/12", "-/17/14", "-/19/16"] | None = None
    contamination: float | None = Field(default=None, gt=0.0, le=1.0)

    def _check(self) -> None:
        if self.viscosity_100 is not None and self.viscosity_100 >= self.viscosity_40:
            problem = "is not below viscosity_40, but viscosity decreases with temperature"
            raise Refusal("viscosity_100", problem, "correct one of them")
        self._keep_one("operating_viscosity", "temperature", ", from which it follows")
        self._keep_one("contamination", "cleanliness", ", from which it follows")
