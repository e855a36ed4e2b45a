"""Figures of the power flow and of every stage of a run: forces, root stress, bearings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import (
    LEAST_E,
    bearing_life_hours,
    moment_force,
    paired_force,
)
from flexgear.gears.bearings.nominal import bearing_speed, blocked_loads, nominal_bearings
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import largest_root_stress
from flexgear.gears.power_flow import PowerFlow, StageFlow
from flexgear.model.names import BodyName, SupportName
from flexgear.model.stage_view import BearingPlace, StageView
from flexgear.model.units import RPM
from flexgear.results.quantities import ABSENT, ALWAYS, Figure, values

NO_LOAD = 0.01  # of a dynamic rating; a load with a life of a million million turns or more

if TYPE_CHECKING:  # the command ``check`` does not load xarray
    import xarray as xr


def root_figures(data: xr.Dataset, stage: str) -> dict[str, dict[str, float]]:
    """Largest and smallest stress in the fillets by gear ("planet", "sun", "ring"), MPa, and the
    largest range at one point along the face; empty for a stage without root stress."""
    extremes = root_extremes(data, stage)
    for gear, of_gear in gears_of(data, stage) if extremes else ():
        has_all_teeth = gear == "ring" and "tooth_root_range" in of_gear  # loaded or not
        largest_range = _range_of_teeth(of_gear, stage) if has_all_teeth else _range(of_gear)
        extremes[gear]["range"] = 1e-6 * largest_range
    return extremes


def root_extremes(data: xr.Dataset, stage: str) -> dict[str, dict[str, float]]:
    """Largest and smallest stress in the fillets by gear over all positions, MPa; empty without
    root stress."""
    if "face_root_stress" not in data:
        return {}
    return {
        gear: {
            "max": 1e-6 * float(of_gear["root_stress"].max()),
            "min": 1e-6 * min(0.0, float(of_gear["face_root_compression"].min())),
        }
        for gear, of_gear in gears_of(data, stage)
    }


def gears_of(data: xr.Dataset, stage: str) -> Iterator[tuple[str, xr.Dataset]]:
    """Gears of a stage with root stress, each with its part of the data (…, flank, …)."""
    of_stage = data.isel(flank=data["flank_stage"].to_numpy() == stage)
    for kind in dict.fromkeys(map(str, of_stage["flank_kind"].to_numpy())):
        mate = of_stage.isel(flank=of_stage["flank_kind"].to_numpy() == kind).sel(
            pair_member="gear"
        )
        yield from _loaded(kind, mate)
    yield from _loaded("planet", of_stage.sel(pair_member="planet"))


def _loaded(gear: str, of_gear: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """The gear with its flanks that have root stress at any position, if there are any."""
    loaded = of_gear.isel(flank=of_gear["root_stress"].notnull().any("position").to_numpy())
    if loaded.sizes["flank"]:
        yield gear, loaded


def _range_of_teeth(of_gear: xr.Dataset, stage: str) -> float:
    """Largest range in the tensile fillets of all teeth of a ring, Pa."""
    teeth = of_gear["tooth_root_range"].to_numpy()[of_gear["tooth_stage"].to_numpy() == stage]
    in_tension = np.isin([-1, 1], of_gear["root_side"].to_numpy())
    return float(teeth[:, in_tension].max())


def _range(of_gear: xr.Dataset) -> float:
    """Largest range in the tensile fillets, over all positions along the face, Pa."""
    side, ranges = of_gear["root_side"].to_numpy(), []
    for fillet in np.unique(side):
        tension = of_gear["face_root_stress"].isel(flank=side == fillet)
        compression = of_gear["face_root_compression"].isel(flank=side == -fillet)
        range_along = _over_all(tension, np.fmax) - _over_all(compression, np.fmin)
        ranges.append(float(range_along.max()))
    return max(ranges)


def _over_all(stress: xr.DataArray, extreme: np.ufunc) -> Array:
    """Extreme stress (face,) over flanks and positions, Pa. The zero stress of unloaded teeth
    counts, so that a largest value is never negative and a smallest never positive."""
    values = stress.transpose(..., "face").to_numpy()
    return np.asarray(extreme.reduce(values.reshape(-1, values.shape[-1]), axis=0, initial=0.0))


def bearing_forces(
    view: StageView, data: xr.Dataset
) -> Iterator[tuple[BearingPlace, str, SupportName, Array]]:
    """Places of the bearings of a stage, with label, spring and the force (…, 3) that it carries,
    N, in a pair with induced thrust; without those that have no stiffness."""
    springs = set(map(str, data["support"].to_numpy() if "support" in data else ()))
    for place in view.bearings:
        mate = view.mate(place)
        for label, spring in zip(place.labels, place.springs, strict=True):
            if spring in springs:
                force = _spring_force(data, spring)
                if mate is not None and mate.springs[0] in springs:
                    of_mate = _spring_force(data, mate.springs[0])
                    force = paired_force(place.bearing, force, mate.bearing, of_mate)
                yield place, label, spring, force


def _spring_force(data: xr.Dataset, spring: str) -> Array:
    """Force (…, 3) that a spring carries, N."""
    return np.asarray(data["bearing_force"].sel(support=spring).to_numpy()[..., :3])


def nominal_figures(view: StageView, flow: StageFlow) -> dict[str, float]:
    """Frequency, powers, forces and speeds of a turning stage by the power flow, and loads and
    lives of its bearings, by key."""
    figures = {
        "gear_mesh_frequency_hz": flow.gear_mesh_frequency,
        "rolling_power_w": flow.stage_power,
        "circulating_power_w": flow.circulating_power,
    }
    if flow.kind == "parallel":
        figures["gear_mesh_force_n"] = abs(flow.sun_gear_mesh_force)
        figures["tangential_force_n"] = abs(flow.sun_working_force)
    else:
        figures |= {
            "sun_gear_mesh_force_n": abs(flow.sun_gear_mesh_force),
            "ring_gear_mesh_force_n": abs(flow.ring_gear_mesh_force),
            "sun_tangential_force_n": abs(flow.sun_working_force),
            "ring_tangential_force_n": abs(flow.ring_working_force),
            "planet_speed_rpm": flow.planet_speed * RPM,
            "planet_speed_in_carrier_rpm": flow.planet_relative_speed * RPM,
            "planet_bearing_force_n": flow.planet_bearing_force,
            # from the outward radius, in the sense of rotation
            "planet_bearing_force_direction_deg": math.degrees(
                math.atan2(-flow.planet_bearing_tangential, flow.planet_bearing_radial)
            ),
        }
    if flow.planet_tilting_moment:
        figures["sun_axial_force_n"] = flow.sun_axial_force
        figures["planet_tilting_moment_nm"] = flow.planet_tilting_moment
    for label, bearing in nominal_bearings(view, flow).items():
        if bearing.place.part != "planet":
            figures[f"{label}_radial_force_n"] = bearing.radial
            figures[f"{label}_axial_force_n"] = bearing.axial
        if bearing.life_hours is not None and math.isfinite(bearing.life_hours):
            figures[f"nominal_{label}_life_h"] = bearing.life_hours
    return figures


@dataclass(frozen=True)
class StageRun:
    """A stage in a run. equilibria: equilibria for loads of bearings; cycles: number of gear-mesh
    cycles in the common period of the errors; least: force below which forces are rounding, N;
    torque: that of the equilibria over that of ``flow``."""

    view: StageView
    flow: StageFlow
    equilibria: xr.Dataset
    cycles: int
    least: float
    torque: float = 1.0

    def of_planets(self, value: float) -> Any:
        """``value`` for a planetary stage; absent for a parallel one."""
        return value if self.view.stage.kind == "planetary" else ABSENT

    def contact_ratios(self) -> dict[str, float]:
        """Total contact ratio ε_γ of the gear meshes, by the gear other than the planet."""
        gear_meshes = stage_geometry(self.view).gear_meshes
        ratios = {self.view.part(k): x.total_contact_ratio for k, x in gear_meshes.items()}
        return {gear: ratio for gear, ratio in ratios.items() if math.isfinite(ratio)}

    def nominal_root_stress(self) -> dict[str, float]:
        """Nominal root stress of each gear with the forces of the power flow, MPa."""
        stresses = largest_root_stress(self.view, self.flow.gear_mesh_forces)
        return {self.view.part(role): value / 1e6 for role, value in stresses.items()}

    def root_stress(self) -> dict[str, Mapping[str, float]]:
        """Largest and smallest root stress of each gear and its range, MPa."""
        stresses = root_figures(self.equilibria, self.view.name)
        return {self.view.part(role): stress for role, stress in stresses.items()}

    def nominal_life(self) -> Any:
        """L₁₀ₕ of a planet bearing under nominal load, h; absent without rating or relative
        speed."""
        bearing = nominal_bearings(self.view, self.flow).get("planet_bearing")
        life = None if bearing is None else bearing.life_hours
        return life if life is not None and math.isfinite(life) else ABSENT

    def least_film(self) -> Any:
        """Least oil film of the planets' plain bearings over the positions, µm; absent without."""
        if "film_thickness" not in self.equilibria:
            return ABSENT
        films = self.equilibria["film_thickness"]
        names = [BodyName.parse(name).stage for name in films["bearing"].to_numpy()]
        film = films.to_numpy()[:, [name == self.view.name for name in names]]
        return ABSENT if np.isnan(film).all() else 1e6 * float(np.nanmin(film))

    def not_in_life(self) -> dict[str, float]:
        """Largest thrust without ``thrust``, or force 2 F_M of a moment, neither of which the basic
        life counts, over the largest radial load, by label of a rated bearing; without those of
        less than ``LEAST_E`` and those of less than ``NO_LOAD`` of the rating."""
        shares = {}
        for place, label, spring, force in bearing_forces(self.view, self.equilibria):
            bearing, (radial, axial) = place.bearing, self._sizes(force)
            rating = (bearing.dynamic_rating or math.inf) * bearing.count
            blocked = blocked_loads(self.view, self.flow, place)
            thrust, moment = (self.torque * load for load in blocked)
            moments = self.equilibria["bearing_force"].sel(support=spring).to_numpy()[:, 3:5]
            about = moments - bearing.z * np.stack([-force[:, 1], force[:, 0]], axis=1)
            moment += float(np.hypot(*about.T).max())
            arm = 0.5 * self.view.stage.gear_width if place.part == "planet" else 0.0
            uncounted = 2.0 * moment_force(bearing, moment, arm)
            if bearing.thrust is None:
                uncounted = max(uncounted, thrust + axial.max())
            turns = bearing_speed(place, self.flow) != 0.0
            if turns and uncounted > max(LEAST_E * radial.max(), NO_LOAD * rating):
                shares[label] = float(uncounted / max(radial.max(), NO_LOAD * rating))
        return shares

    @cached_property
    def bearing_loads(self) -> dict[str, tuple[BearingPlace, Array]]:
        """Places of bearings and their radial and axial loads (2, p), N, over the positions, by
        label; without those that have no stiffness."""
        forces = bearing_forces(self.view, self.equilibria)
        return {label: (place, self._sizes(force)) for place, label, _, force in forces}

    def largest_radial(self, seats: bool) -> dict[str, float]:
        """Largest radial load over the positions, N, of a carrier's seats by side, or of other
        bearings than these and planets' by label; without those that carry none."""
        before = "carrier_bearing_"
        return {
            label.removeprefix(before): float(load[0].max())
            for label, (place, load) in self.bearing_loads.items()
            if place.part != "planet" and label.startswith(before) == seats
            if seats or load[0].any()
        }

    def largest_axial(self) -> dict[str, float]:
        """Largest axial load over the positions, N, of bearings other than planets' by label;
        without those that carry none."""
        return {
            label: float(load[1].max())
            for label, (place, load) in self.bearing_loads.items()
            if place.part != "planet" and load[1].any()
        }

    def lives(self) -> dict[str, float]:
        """L₁₀ₕ, h, of bearings by label, under the constant loads of equal damage over the
        positions; without bearings that have no rating or do not turn."""
        lives = {}
        for label, (place, (radial, axial)) in self.bearing_loads.items():
            speed = bearing_speed(place, self.flow)
            lives[label] = bearing_life_hours(place.bearing, radial, speed, axial)
        return {n: life for n, life in lives.items() if life is not None and math.isfinite(life)}

    def _sizes(self, force: Array) -> Array:
        """Radial and axial sizes (2, p) of forces (p, 3), zero where they are rounding."""
        x, y, z = np.where(np.abs(force) > self.least, force, 0.0).T
        return np.array([np.hypot(x, y), np.abs(z)])


MEMBERS = (  # of a pair of power flow and name of a member
    Figure("speed_rpm", "1/min", "rated speed", ALWAYS, lambda m: m[0].speed[m[1]] * RPM, "speed"),
    Figure("torque_on_stage_nm", "N m", "torque of the rest of the train on the member",
           "", lambda m: m[0].branch_torque[m[1]], "torque on its stage"),
    Figure("power_into_stage_w", "W", "power of this torque",
           "", lambda m: m[0].branch_power[m[1]], "power into its stage"),
    Figure("outside_torque_nm", "N m", "torque from outside, if the member is a port",
           of=lambda m: m[0].torque.get(m[1], ABSENT)),
)  # fmt: skip
TRAIN = (
    Figure("mobility", "1", "number of independent rotations",
           ALWAYS, lambda flow: flow.mobility),
    Figure("input_power_w", "W", "total power into the train",
           ALWAYS, lambda flow: flow.input_power, "power in"),
    Figure("circulating_power_w", "W", "circulating power",
           "", lambda flow: flow.circulating_power, "circulating power"),
)  # fmt: skip


def flow_summary(flow: PowerFlow) -> dict[str, Any]:
    """Speeds, torques from outside and powers of all members."""
    return values(TRAIN, flow) | {"members": {n: values(MEMBERS, (flow, n)) for n in flow.speed}}


GEAR_MESHES = (
    Figure("kind", "", '"planetary" or "parallel"', of=lambda s: s.view.stage.kind),
    Figure("gear_mesh_frequency_hz", "Hz", "at rated speed", ALWAYS,
           lambda s: s.flow.gear_mesh_frequency, "gear-mesh frequency"),
    Figure("pin_speed_rpm", "1/min", "rated, of the pins against the ring", "",
           lambda s: s.of_planets((s.flow.carrier_speed - s.flow.ring_speed) * RPM),
           "speed of the pins against the ring"),
    Figure("contact_ratio.<gear>", "1", "total, of the planet's gear mesh with sun or ring, or of "
           "pinion and gear", of=StageRun.contact_ratios),
    Figure("rolling_power_w", "W", "power through the gear meshes, relative to the carrier", "",
           lambda s: s.flow.stage_power, "rolling power, of sun or pinion relative to any carrier"),
    Figure("sun_gear_mesh_force_n", "N",
           "mean rated force of a sun-planet gear mesh, or of pinion and gear",
           ALWAYS, lambda s: abs(s.flow.sun_gear_mesh_force), "normal force of one gear mesh, sun"),
    Figure("ring_gear_mesh_force_n", "N", "mean rated force of a ring-planet gear mesh", "",
           lambda s: s.of_planets(abs(s.flow.ring_gear_mesh_force)), "normal force of one gear "
           "mesh, ring"),
    Figure("error_cycle_gear_meshes", "1", "gear-mesh cycles in the common period of the errors",
           "", lambda s: s.cycles, "gear-mesh periods until errors repeat"),
)  # fmt: skip
ROOTS = (
    Figure("nominal_root_stress_mpa.<gear>", "MPa",
           "ISO 6336-3:2006 without load factors, of a planet the larger of its gear meshes",
           of=StageRun.nominal_root_stress),
    Figure("root_stress_mpa.<gear>.max", "MPa",
           'largest stress in the fillets, of `gear_mesh.root_stress = "fe"`', "",
           StageRun.root_stress, "{name}, largest"),
    Figure("root_stress_mpa.<gear>.min", "MPa", "smallest stress in the fillets",
           label="{name}, least, in the opposite fillet"),
    Figure("root_stress_mpa.<gear>.range", "MPa",
           "largest range over the positions at one point of the fillet",
           label="{name}, range over the positions at one point of a tensile fillet"),
)  # fmt: skip
PLANET_BEARINGS = (
    Figure("planet_bearing_force_n", "N", "mean rated force of a planet on its pin",
           "", lambda s: s.of_planets(s.flow.planet_bearing_force), "load of a planet's bearings"),
    Figure("planet_tilting_moment_nm", "N m",
           "mean rated moment of the axial forces of a planet's helical teeth on its bearings", "",
           lambda s: s.flow.planet_tilting_moment or ABSENT,
           "tilting moment on a planet's bearings, of axial tooth forces"),
    Figure("planet_speed_in_carrier_rpm", "1/min", "rated speed of the planets against the carrier",
           "", lambda s: s.of_planets(s.flow.planet_relative_speed * RPM),
           "speed of a planet relative to the carrier"),
    Figure("nominal_planet_bearing_life_h", "h",
           "L₁₀ₕ of the planets' bearings under this force, if they have a rating",
           "", StageRun.nominal_life,
           "basic rating life of a planet bearing (ISO 281), nominal load"),
    Figure("least_film_um", "µm", "least oil film of the planets' plain bearings over the rated "
           "equilibria of the run", "", StageRun.least_film,
           "least oil film of a planet's plain bearing"),
)  # fmt: skip
SEATS = (
    Figure("carrier_bearing_force_n.<seat>", "N", "largest radial load of the bearing on each seat "
           "of an FE carrier over the rated equilibria of the run", "",
           lambda s: s.largest_radial(seats=True), "largest radial load, {name} side"),
    Figure("bearing_force_n.<bearing>", "N", "that of the bearings of pinion, gear, sun, hub and "
           "lumped carrier", "", lambda s: s.largest_radial(seats=False),
           "{name}, largest radial load"),
    Figure("axial_bearing_force_n.<bearing>", "N", "largest axial load of each of these bearings",
           "", StageRun.largest_axial, "{name}, largest axial load"),
)  # fmt: skip
LIVES = (
    Figure("bearing_life_h.<bearing>", "h", "L₁₀ₕ of bearings under the constant load of the same "
           "damage over the equilibria", "", StageRun.lives, "{name}"),
    Figure("not_in_bearing_life.<bearing>", "1", "thrust or force of a moment that this life does "
           f"not count, over the largest radial load, where above {LEAST_E:g}", "",
           StageRun.not_in_life, "{name}, not counted over radial load"),
)  # fmt: skip
STAGE_FIGURES = (*GEAR_MESHES, *ROOTS, *PLANET_BEARINGS, *SEATS, *LIVES)
