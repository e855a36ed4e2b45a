"""Synthetic stage: five planets under a ring of 93 teeth; shapes, not physics."""

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

from flexgear.structures.fe_mesh.fe_mesh import HEX_FROM_VTK
from flexgear.views.star import StageOutline

PLANETS, TEETH, SLOTS = 5, 93, 4
RING_RADIUS, CENTER_DISTANCE = 0.844, 0.545
SPACING = 2 * np.pi / PLANETS


def star_field(angles: np.ndarray, amplitude: float = 30e-6) -> np.ndarray:
    """(p, 93, 3): u_r = a cos 5(φ − θ_c) with a mean twist, so maxima sit at the planets."""
    phi = 2 * np.pi * np.arange(TEETH) / TEETH
    wave = 5 * (phi[None, :] - np.asarray(angles)[:, None])
    radial = amplitude * np.cos(wave)
    tangential = amplitude * (0.8 + 0.3 * np.sin(wave))
    x = radial * np.cos(phi) - tangential * np.sin(phi)
    y = radial * np.sin(phi) + tangential * np.cos(phi)
    return np.stack([x, y, 0.1 * amplitude * np.sin(wave)], axis=-1)


def pair_states(angles: np.ndarray, ratio: float = 2.3) -> tuple[np.ndarray, np.ndarray]:
    """Tooth numbers (1-based, 0 none) and stiffness (n, planets, slots) with contact ratio."""
    tooth = np.zeros((angles.size, PLANETS, SLOTS), dtype=np.int16)
    stiffness = np.zeros(tooth.shape)
    for i in range(PLANETS):
        place = (angles + i * SPACING) * TEETH / (2 * np.pi)
        newest = np.floor(place).astype(int)
        for k in range(SLOTS):
            progress = (place - (newest - k)) / ratio  # 0 entry … 1 exit
            on = progress <= 1
            tooth[:, i, k] = np.where(on, (newest - k) % TEETH + 1, 0)
            stiffness[:, i, k] = np.where(on, 4e9 * (1 - 1.6 * (progress - 0.5) ** 2), 0)
    return tooth, stiffness


def make_dataset(variant: str = "flexible", drop: bool = False, samples: int = 3000) -> xr.Dataset:
    flexible = variant == "flexible"
    time = np.linspace(0, 5.32, samples)
    theta = 2 * np.pi * time / 5.32
    torque = np.full(samples, 4e6)
    if drop:
        torque[(time > 1) & (time <= 1.2)] = 2e5
    sag = np.cumsum((torque - 4e6) / 4e6) * (time[1] - time[0]) * 0.15
    settle = np.where(time > 1, np.exp(-(time - 1.2).clip(0) / 0.8), 0)
    speed = 1.1802 + sag * settle + 2e-4 * np.sin(93 * theta)
    tooth, stiffness = pair_states(theta)
    ripple = 1 + (0.012 if flexible else 0.006) * np.sin(
        7 * theta[:, None] + 2 * np.pi * np.arange(PLANETS) / PLANETS * 2
    )
    force = 1.03e6 * ripple * (torque / 4e6)[:, None]
    share = stiffness / stiffness.sum(axis=-1, keepdims=True)
    skew = 1 + 0.1 * np.cos(np.pi * np.arange(SLOTS) / 3)
    load = force[..., None] * share * skew
    load *= force[..., None] / load.sum(axis=-1, keepdims=True)
    total = force.sum(axis=1)
    sharing = np.where(torque > 0.06 * 4e6, PLANETS * force.max(axis=1) / total, np.nan)
    size = 1.0 if flexible else 0.02
    dims = ("time", "flank", "slot")
    planet = np.zeros((samples, PLANETS, 6))
    planet[..., 0] = size * 12e-6 * np.sin(5 * theta)[:, None]
    planet[..., 1] = CENTER_DISTANCE * theta[:, None] - 320e-6 * (torque / 4e6)[:, None]
    planet[..., 2] = -6e-6
    planet[..., 3] = 2e-5
    sun = np.zeros((samples, 6))
    sun[:, :3] = np.array([2e-6, 3e-6, 25e-6]) * np.sin(theta[:, None] * 7 + np.arange(3))
    carrier = np.zeros((samples, 1, 6))
    carrier[:, 0, 5] = theta
    bodies = [f"stage.planet_{i + 1}" for i in range(PLANETS)]
    energies = {
        "kinetic": 3.4e5 * (speed / 1.18) ** 2,
        "elastic": 900 * (torque / 4e6) ** 2,
        "pair_elastic": 500 * (torque / 4e6) ** 2,
        "input_work": np.cumsum(torque * speed) * (time[1] - time[0]),
        "damping_work": 20 * time,
        "pair_damping_work": 10 * time,
        "parametric_work": 3 * np.sin(theta),
        "load_work": np.zeros_like(theta),
    }
    stored = energies["kinetic"] + energies["elastic"] + energies["pair_elastic"]
    lost = energies["damping_work"] + energies["pair_damping_work"]
    entered = energies["input_work"] - energies["input_work"][0] + energies["parametric_work"]
    energies["brake_work"] = entered - lost - (stored - stored[0]) - 0.8 * np.sin(40 * time)
    return xr.Dataset(
        {
            "stage_angle": ("time", theta),
            "stage_speed": ("time", speed),
            "port_torque": (("time", "port"), torque[:, None]),
            "gear_mesh_force": (("time", "gear_mesh"), force),
            "rated_gear_mesh_force": ("gear_mesh", np.full(PLANETS, 1.03e6)),
            "pair_load": (dims, load),
            "pair_tooth": (dims, tooth),
            "pair_stiffness": (dims, stiffness),
            "tooth_displacement": (("time", "tooth", "axis"), size * star_field(theta)),
            "body_displacement": (
                ("time", "body", "dof"),
                np.concatenate([sun[:, None], planet], axis=1),
            ),
            "carrier_displacement": (("time", "carrier_node", "dof"), carrier),
            "load_sharing": (("time", "group"), sharing[:, None]),
            **{f"energy_{name}": ("time", value) for name, value in energies.items()},
        },
        coords={
            "time": time,
            "kind": ("gear_mesh", ["ring"] * PLANETS),
            "planet": ("gear_mesh", np.arange(1, PLANETS + 1)),
            "group_kind": ("group", ["ring"]),
            "flank": [f"stage ring {i + 1} drive" for i in range(PLANETS)],
            "flank_kind": ("flank", ["ring"] * PLANETS),
            "flank_planet": ("flank", np.arange(1, PLANETS + 1)),
            "flank_sense": ("flank", ["drive"] * PLANETS),
            "body": ["stage.sun", *bodies],
            "tooth": np.arange(1, TEETH + 1),
            "axis": ["x", "y", "z"],
            "carrier_node": ["stage.drive"],
        },
        attrs={"variant": variant},
    )


def make_annulus(cells_around: int = 93) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hex8 annulus: points, cells and a five-lobed displacement (m)."""
    radii, heights = np.linspace(0.86, 1.06, 4), np.linspace(-0.215, 0.215, 5)
    phi = 2 * np.pi * np.arange(cells_around) / cells_around
    p, r, z = np.meshgrid(phi, radii, heights, indexing="ij")
    points = np.column_stack([(r * np.cos(p)).ravel(), (r * np.sin(p)).ravel(), z.ravel()])
    number = np.arange(p.size).reshape(p.shape)
    i, j, k = (
        a.ravel() for a in np.meshgrid(*(np.arange(n) for n in (cells_around, 3, 4)), indexing="ij")
    )
    n = (i + 1) % cells_around
    cells = np.column_stack(
        [number[i, j, k], number[i, j + 1, k], number[n, j + 1, k], number[n, j, k]]
        + [
            number[i, j, k + 1],
            number[i, j + 1, k + 1],
            number[n, j + 1, k + 1],
            number[n, j, k + 1],
        ]
    )
    radial = 40e-6 * np.cos(5 * p.ravel())
    away = np.column_stack([np.cos(p.ravel()), np.sin(p.ravel()), 0 * p.ravel()])
    return points, cells[:, HEX_FROM_VTK], radial[:, None] * away


@pytest.fixture(scope="session")
def outline() -> StageOutline:
    return StageOutline(
        RING_RADIUS, 0.245, 0.2996, CENTER_DISTANCE, tuple(SPACING * np.arange(PLANETS))
    )


@pytest.fixture(scope="session")
def field() -> Callable[[np.ndarray], np.ndarray]:
    return star_field


@pytest.fixture(scope="session")
def steady() -> dict[str, xr.Dataset]:
    return {name: make_dataset(name) for name in ("flexible", "rigid")}


@pytest.fixture(scope="session")
def dropped() -> dict[str, xr.Dataset]:
    return {name: make_dataset(name, drop=True) for name in ("flexible", "rigid")}


@pytest.fixture(scope="session")
def annulus() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return make_annulus()
