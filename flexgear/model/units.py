"""Dimensions, the unit suffixes of TOML keys, and their factors to SI.

The type of a field states its dimension (``face_width: Length``), the ending of the TOML key the
unit of the number (``face_width_mm``). All conversions between units are in this module.
"""

import math
from dataclasses import dataclass
from typing import Annotated

RPM = 30.0 / math.pi  # r/min per rad/s
_DEG = math.pi / 180.0

# suffix -> (factor, divisor): one of the two is 1, so that 430 mm is exactly 0.43
SUFFIXES: dict[str, dict[str, tuple[float, float]]] = {
    "length": {"mm": (1, 1e3), "m": (1, 1), "um": (1, 1e6), "cm": (1, 1e2)},
    "angle": {"deg": (_DEG, 1), "rad": (1, 1), "mrad": (1, 1e3)},
    "time": {"s": (1, 1), "ms": (1, 1e3), "us": (1, 1e6)},
    "frequency": {"hz": (1, 1), "khz": (1e3, 1)},
    "rate": {"per_s": (1, 1)},
    "speed": {"rpm": (math.pi, 30), "rad_per_s": (1, 1)},
    "torque": {"nm": (1, 1), "knm": (1e3, 1)},
    "force": {"n": (1, 1), "kn": (1e3, 1)},
    "power": {"kw": (1e3, 1), "w": (1, 1), "mw": (1e6, 1)},
    "acceleration": {"m_per_s2": (1, 1)},
    "stiffness": {
        "n_per_m": (1, 1),
        "n_per_mm": (1e3, 1),
        "n_per_um": (1e6, 1),
        "kn_per_m": (1e3, 1),
        "kn_per_mm": (1e6, 1),
        "gn_per_m": (1e9, 1),
    },
    "rotational stiffness": {"nm_per_rad": (1, 1), "knm_per_rad": (1e3, 1)},
    "damping": {"n_s_per_m": (1, 1), "kn_s_per_m": (1e3, 1), "n_s_per_mm": (1e3, 1)},
    "rotational damping": {"nm_s_per_rad": (1, 1), "knm_s_per_rad": (1e3, 1)},
    "stiffness per face width": {"n_per_mm_um": (1e9, 1), "n_per_m2": (1, 1), "gpa": (1e9, 1)},
    "modulus": {"gpa": (1e9, 1), "mpa": (1e6, 1), "pa": (1, 1)},
    "stress": {"mpa": (1e6, 1), "pa": (1, 1)},
    "life": {"h": (3600, 1)},
    "density": {"kg_per_m3": (1, 1), "g_per_cm3": (1e3, 1), "t_per_m3": (1e3, 1)},
    "mass": {"kg": (1, 1), "t": (1e3, 1)},
    "inertia": {"kg_m2": (1, 1), "t_m2": (1e3, 1)},
    "kinematic viscosity": {"mm2_per_s": (1, 1e6), "m2_per_s": (1, 1)},
    "dynamic viscosity": {"mpa_s": (1, 1e3), "pa_s": (1, 1)},
    "temperature": {"c": (1, 1)},
    "6 x 6 matrix": {"si": (1, 1)},  # entries in N/m, N/rad, N m/m and N m/rad
}

_OFFSET = {"c": 273.15}  # zero of the scale in SI


@dataclass(frozen=True)
class Quantity:
    """Annotation of fields whose TOML key ends in a unit of this dimension.

    usual: suffix of the usual unit, the first of its dimension if left out.
    """

    dimension: str
    usual: str = ""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Unit suffixes of keys, the usual one first."""
        return tuple(sorted(SUFFIXES[self.dimension], key=lambda suffix: suffix != self.usual))

    def to_si(self, value: float, suffix: str) -> float:
        """A value in the unit ``suffix`` converted to SI."""
        times, over = SUFFIXES[self.dimension][suffix]
        return value * times / over + _OFFSET.get(suffix, 0.0)

    def from_si(self, value: float, suffix: str) -> float:
        """A value in SI converted to the unit ``suffix``."""
        times, over = SUFFIXES[self.dimension][suffix]
        return (value - _OFFSET.get(suffix, 0.0)) * over / times


ALL_SUFFIXES = frozenset(s for units in SUFFIXES.values() for s in units)

_PRINTED = {  # parts of suffixes, "_per_" and "_" between them
    "um": "µm", "us": "µs", "hz": "Hz", "khz": "kHz", "gpa": "GPa", "mpa": "MPa", "pa": "Pa",
    "n": "N", "kn": "kN", "gn": "GN", "nm": "N m", "knm": "kN m", "w": "W", "kw": "kW", "mw": "MW",
    "m2": "m²", "s2": "s²", "mm2": "mm²", "m3": "m³", "cm3": "cm³", "c": "°C", "si": "",
}  # fmt: skip
_IRREGULAR = {
    "per_s": "1/s", "n_per_mm_um": "N/(mm µm)", "mpa_s": "mPa s", "nm_s_per_rad": "N m s/rad",
    "knm_s_per_rad": "kN m s/rad",
}  # fmt: skip


def unit_name(suffix: str) -> str:
    """Printed unit of a suffix: n_per_m -> N/m."""
    if suffix in _IRREGULAR:
        return _IRREGULAR[suffix]
    sides = (side.split("_") for side in suffix.split("_per_"))
    return "/".join(" ".join(_PRINTED.get(part, part) for part in side) for side in sides)


def size_text(size: float) -> str:
    """A size in bytes with a decimal prefix: "1.5 MB"."""
    units = ("B", "kB", "MB", "GB", "TB")
    power = min(int(math.log10(max(size, 1)) / 3), len(units) - 1)
    return f"{size / 1000**power:.4g} {units[power]}"


_SYNONYMS = {"sec": "s", "r/min": "rpm", "1/min": "rpm", "degrees": "deg"}  # in other programs


def suffix_of(text: str, dimension: str) -> str | None:
    """Suffix of a unit as other programs write it ("(kN-m)" -> knm); None for a unit of another
    dimension."""
    unit = "".join(sign for sign in text.lower() if sign not in " ()[]·-*")
    suffixes = Quantity(dimension).suffixes
    by_name = {unit_name(s).lower().replace(" ", ""): s for s in suffixes}
    suffix = by_name.get(unit, _SYNONYMS.get(unit, unit))
    return suffix if suffix in suffixes else None


Length = Annotated[float, Quantity("length")]
Deviation = Annotated[float, Quantity("length", "um")]
Angle = Annotated[float, Quantity("angle")]
Time = Annotated[float, Quantity("time")]
Frequency = Annotated[float, Quantity("frequency")]
Rate = Annotated[float, Quantity("rate")]
Speed = Annotated[float, Quantity("speed")]
Torque = Annotated[float, Quantity("torque")]
Force = Annotated[float, Quantity("force")]
Power = Annotated[float, Quantity("power")]
Acceleration = Annotated[float, Quantity("acceleration")]
Stiffness = Annotated[float, Quantity("stiffness")]
RotationalStiffness = Annotated[float, Quantity("rotational stiffness")]
TranslationalDamping = Annotated[float, Quantity("damping")]
RotationalDamping = Annotated[float, Quantity("rotational damping")]
StiffnessPerWidth = Annotated[float, Quantity("stiffness per face width")]
Modulus = Annotated[float, Quantity("modulus")]
Stress = Annotated[float, Quantity("stress")]
Life = Annotated[float, Quantity("life")]
Density = Annotated[float, Quantity("density")]
Mass = Annotated[float, Quantity("mass")]
Inertia = Annotated[float, Quantity("inertia")]
Viscosity = Annotated[float, Quantity("kinematic viscosity")]
DynamicViscosity = Annotated[float, Quantity("dynamic viscosity")]
Temperature = Annotated[float, Quantity("temperature")]  # K
MatrixEntry = Annotated[float, Quantity("6 x 6 matrix")]
