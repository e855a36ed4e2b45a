"""Geometric similarity: one case made λ times as large, and what every result of it becomes.

Lengths times λ at the same material make stresses and strains the same: forces λ², torques λ³,
stiffnesses λ (N/m) and λ³ (N m/rad), masses λ³, inertias λ⁵, times λ, speeds and frequencies 1/λ.
Which key is what the model says once, by its quantity.
"""

import json
from typing import Any

import numpy as np
import xarray as xr

from flexgear.model.case import Case, validated_case
from flexgear.model.read import Written
from flexgear.model.section import Section, quantity_of, section_of

POWERS = {
    "length": 1, "angle": 0, "time": 1, "frequency": -1, "rate": -1, "speed": -1, "torque": 3,
    "force": 2, "power": 2, "acceleration": -1, "stiffness": 1, "rotational stiffness": 3,
    "damping": 2, "rotational damping": 4, "dynamic viscosity": 1,
    "stiffness per face width": 0, "modulus": 0, "stress": 0, "life": 1, "density": 0, "mass": 3,
    "inertia": 5, "kinematic viscosity": 1, "temperature": 0,
}  # fmt: skip
UNITS = {
    "": 0, "1": 0, "rad": 0, "m": 1, "s": 1, "Hz": -1, "rad/s": -1, "N": 2, "N m": 3, "N/m": 1,
    "J": 3, "W": 2, "Pa": 0,
}  # fmt: skip
UNSCALED = {"end_state"}  # of modal amplitudes and more; runs that go on from it scale or not
MIXED = {"m, rad": (1, 0), "N, N m": (2, 3)}  # of the dofs ux … uz and rx … rz
ALONE = 1e-9  # of a frequency: one that is closer to the next is the same
MODE_SHAPE = (-1.5, -2.5)  # at a modal mass of 1 kg
SUFFIXES = {
    "_mm": 1, "_um": 1, "_m": 1, "_s": 1, "_hz": -1, "_rpm": -1, "_n": 2, "_nm": 3, "_w": 2,
    "_n_per_m": 1, "_n_per_mm_um": 0, "_kg_m2": 5, "_h": 1, "_mpa": 0,
}  # fmt: skip


def similar(case: Case, factor: float) -> Case:
    """The case ``factor`` times as large: all that it says, and nothing that it leaves open."""
    data = _scaled(Case, case.model_dump(exclude_unset=True), factor)
    return validated_case(data, "similar", Written())


def _scaled(section: type[Section], data: dict[str, Any], factor: float) -> dict[str, Any]:
    out = {}
    for name, value in data.items():
        quantity, inside = quantity_of(section, name), section_of(section, name)
        if quantity is not None:
            out[name] = (
                value if value is None else _times(value, factor ** POWERS[quantity.dimension])
            )
        elif inside is not None and isinstance(value, dict):
            out[name] = _scaled(inside, value, factor)
        elif inside is not None and isinstance(value, (tuple, list)):
            out[name] = type(value)(_scaled(inside, v, factor) for v in value)
        else:
            out[name] = value
    return out


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, (tuple, list)):
        return type(value)(_times(v, factor) for v in value)
    return value * factor


def differences(small: xr.Dataset, large: xr.Dataset, factor: float) -> dict[str, float]:
    """Largest difference of every variable that ``large`` has from what similarity makes of
    ``small``, over the variable's largest value (of translations and rotations apart)."""
    assert set(small.variables) == set(large.variables)
    return {
        str(name): _difference(str(name), small[name], large[name], factor, _module(large))
        for name in small.variables
        if small[name].dtype.kind in "if" and name not in UNSCALED and not _rounding(name, small)
    }


def _rounding(name: Any, data: xr.Dataset) -> bool:
    """Whether inertia takes nothing: what is left of the torques then is their rounding."""
    if name != "inertia_torque":
        return False
    return bool(abs(data[name]).max() < 1e-9 * abs(data["port_torque"]).max())


def of_one_frequency(modes: xr.Dataset) -> xr.Dataset:
    """Modes with those of one frequency put together, as they may stand for any others of their
    span: energies added, of mode shapes the root of the sum of squares."""
    frequency = modes["frequency"].to_numpy()
    new = np.diff(frequency, prepend=-1.0) > ALONE * frequency
    group = xr.DataArray(np.cumsum(new), dims="mode", name="group")
    energies = [n for n in map(str, modes) if n.endswith("_energy")]
    together = modes[energies].groupby(group).sum(keep_attrs=True)
    shape = (modes["mode_shape"] ** 2).groupby(group).sum() ** 0.5
    return together.assign(
        mode_shape=shape, frequency=modes["frequency"].groupby(group).mean(keep_attrs=True)
    )


def _module(data: xr.Dataset) -> float:
    """Normal module of the first stage, m."""
    parameters = json.loads(data.attrs["parameters"])
    return float(
        (parameters["stages"][0] if "stages" in parameters else parameters["stage"])[
            "normal_module"
        ]
    )


def _difference(
    name: str, small: xr.DataArray, large: xr.DataArray, factor: float, module: float
) -> float:
    units = small.attrs.get("units", "")
    a, b = small.to_numpy(), large.to_numpy()
    assert a.shape == b.shape, name
    powers = MODE_SHAPE if name == "mode_shape" else MIXED.get(units)
    if powers is None:
        return _apart(a * factor ** UNITS[units], b)
    return max(
        _apart(a[..., :3] * factor ** powers[0], b[..., :3]),
        _apart(a[..., 3:] * factor ** powers[1], b[..., 3:], _no_moment(units, b, module)),
    )


def _no_moment(units: str, loads: Any, module: float) -> float:
    """Moments below 1e-3 of the largest force times the module count as none: those of forces that
    cancel at levers of many modules differ by 1e-10 of it from rounding alone."""
    return 1e-3 * module * np.nanmax(np.abs(loads[..., :3]), initial=0.0) if "N m" in units else 0.0


def _apart(expected: Any, values: Any, least: float = 0.0) -> float:
    assert np.array_equal(np.isnan(expected), np.isnan(values))
    largest = np.nanmax(np.abs(expected), initial=least)
    return float(np.nanmax(np.abs(expected - values), initial=0.0) / largest) if largest else 0.0


def figures_apart(small: Any, large: Any, factor: float, name: str = "") -> dict[str, float]:
    """The same of figures with their units at the end of their names, by name."""
    if isinstance(small, dict):
        assert set(small) == set(large)
        by_name: dict[str, float] = {}
        for key, value in small.items():
            by_name |= figures_apart(value, large[key], factor, f"{name}.{key}")
        return by_name
    if isinstance(small, (list, tuple)):
        assert len(small) == len(large), name
        return {
            k: v
            for i, value in enumerate(small)
            for k, v in figures_apart(value, large[i], factor, f"{name}_{i}").items()
        }
    if isinstance(small, bool) or not isinstance(small, (int, float)):
        return {}
    return {name: _apart(np.array([small * factor ** _power(name)]), np.array([large]))}


def _power(name: str) -> int:
    """Of λ, by the longest unit that ends a part of a dotted name, the last part first."""
    for part in reversed(name.split(".")):
        stem = part.rstrip("0123456789").rstrip("_")
        for end in ("_min", "_max", "_mean"):
            stem = stem.removesuffix(end)
        fitting = [s for s in SUFFIXES if stem.endswith(s)]
        if fitting:
            return SUFFIXES[max(fitting, key=len)]
    return 0
