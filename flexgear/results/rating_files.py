"""A rating as rows of ``rating.csv``, figures of ``rating.json``, and results of a REXS model."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.files.rexs.from_case import BinResults
from flexgear.files.rexs.tables import APPLICATION_FACTOR, LOAD_FACTORS
from flexgear.gears.rating.sheet import KEY, value_of
from flexgear.model.names import GroupName
from flexgear.results.quantities import number
from flexgear.results.rating import PARTS, GearMeshRating, RatedPart, Rating
from flexgear.results.version import version

SCHEMA = 1  # of the summary
COLUMNS = ("of", "bin", "quantity", "value", "unit", "source")
ALL = "all"  # value of the column "bin" for all bins together


def rating_rows(rating: Rating) -> Iterator[tuple[str, str, str, float | str, str, str]]:
    """Rows of ``rating.csv``: one for each part or group of gear meshes, bin and quantity."""
    bins = [b.name for b in rating.bins]
    of_parts = {part.name: part.missing for part in rating.parts if part.missing}
    alike = {part.alike for part in rating.parts if part.missing}  # named part by part
    others = {name: why for name, why in rating.not_assessed.items() if name not in alike}
    for name, reason in {**of_parts, **others}.items():
        yield name, ALL, "not assessed", reason, "", ""
    for part in rating.parts:
        if part.estimates:
            reason = "; ".join(f"{key} {rule}" for key, rule in part.estimates.items())
            yield part.name, ALL, "no verdict", reason, "", ""
        for name, (quantity, of) in PARTS.items():
            values = np.atleast_1d(of(part)).tolist()
            for b, value in zip(bins if "bin" in quantity.dims else [ALL], values, strict=True):
                if not math.isnan(value):
                    is_life = name == "required" and part.kind == "bearing"
                    unit = "h" if is_life else quantity.units
                    source = KEY if name == "required" and not is_life else "computed"
                    yield part.name, b, name, value, unit, source
        for k, damage in enumerate(part.of_rows.tolist(), 1):
            yield part.name, ALL, f"damage_sum of row {k}", damage, "1", "computed"
    sheets = [(part.name, ALL, part.direct) for part in rating.parts]
    of_bins = [(x.name, x.factors) for x in rating.gear_meshes]
    for owner, factors in (*of_bins, *((x.name, x.factors) for x in rating.parts)):
        sheets += [(owner, b, sheet) for b, sheet in zip(bins, factors, strict=True)]
    for name, b, sheet in sheets:
        for f in sheet.values():
            yield name, b, f.symbol, f.value, f.unit, f.source


def rating_summary(rating: Rating) -> dict[str, Any]:
    """Figures of ``rating.json``; None for values that are not finite."""
    bins = {
        b.name: {"hours": b.hours, "extreme": b.extreme, "torque_nm": dict(b.torque),
                 "source": b.source}
        for b in rating.bins
    }  # fmt: skip
    return {
        "case": rating.case.name,
        "result": "rating",
        "schema_version": SCHEMA,
        "version": version(),
        "content_hash": rating.case.content_hash(),
        "variant": rating.variant,
        "hours": rating.hours,
        "positions": dict(rating.positions),
        "load_factor_change_with_half_of_positions": rating.halving[0],
        "equilibrium_closure_max": rating.closure,
        "reliability": rating.reliability,
        "bins": bins,
        "weakest": [p.name for p in rating.ranked],
        "load_factors": {g.name: _load_factors(g, list(bins)) for g in rating.gear_meshes},
        "parts": {p.name: _part_summary(p, list(bins)) for p in rating.parts},
        "not_assessed": dict(rating.not_assessed),
    }


def _load_factors(gear_mesh: GearMeshRating, bins: Sequence[str]) -> dict[str, Any]:
    of_bins = zip(bins, gear_mesh.factors, gear_mesh.planet, gear_mesh.largest_k_gamma, strict=True)
    return {
        name: {s: f.value for s, f in factors.items()}
        | {"planet": planet, "largest_k_gamma": largest}
        for name, factors, planet, largest in of_bins
        if factors
    }


def _part_summary(part: RatedPart, bins: Sequence[str]) -> dict[str, Any]:
    """Figures of a part by the names of ``PARTS`` with units."""
    figures: dict[str, Any] = {"kind": part.kind, "stage": part.stage, "count": part.count}
    if part.missing:
        return figures | {"not_assessed": part.missing}
    for name, (quantity, of) in PARTS.items():
        key = name if quantity.units == "1" else f"{name}_{quantity.units.lower()}"
        values = of(part)
        by_bin = "bin" in quantity.dims
        figures[key] = (
            dict(zip(bins, map(number, values), strict=True)) if by_bin else number(values)
        )
    return figures | {
        "within_limits": part.holds,
        "estimates": [f"{key} {rule}" for key, rule in part.estimates.items()],
        "damage_sum_of_rows": list(map(number, part.of_rows)),
        "direct_path": {s: number(f.value) for s, f in part.direct.items()},
        "worst_bin": bins[part.worst_bin],
    }


SAFETIES = {"flank": "safety_factor_pitting", "root": "safety_factor_tooth_root"}
SYMBOLS = ("K_A", "K_γ", "K_v", "K_Hβ", "K_Fβ", "K_Hα", "K_Fα")  # of rows of load factors
LIVES = {  # attributes of bearings by their symbols in a sheet, lives in 10⁶ revolutions
    "L_10": "nominal_rating_life_rotations_iso_281_2007",
    "L_nm": "modified_rating_life_rotations_iso_281_2007",
    "L_10r": "nominal_reference_rating_life_rotations_iso_16281_2008",
    "L_nmr": "modified_reference_rating_life_rotations_iso_16281_2008",
    "S_0": "static_safety_factor_iso_76_2006",
}


def rexs_results(rating: Rating) -> BinResults:
    """Figures of every load bin, named by REXS attributes: load factors of gear meshes, safeties of
    their gears, lives and static safety of bearings."""
    edition = rating.case.rating.edition
    gears: dict[tuple[GroupName, str], dict[str, Array]] = {}
    for gear_mesh in rating.gear_meshes:
        gears[gear_mesh.name, ""] = {
            row.names[edition == 2006]: np.array([value_of(x, symbol) for x in gear_mesh.factors])
            for symbol, row in zip(SYMBOLS, (APPLICATION_FACTOR, *LOAD_FACTORS), strict=True)
        }
        for (part, kind), safety in gear_mesh.safety.items():
            name = f"{SAFETIES[kind]}_iso_6336_{edition}"
            gears.setdefault((gear_mesh.name, part), {})[name] = safety
    bearings = {p.name: _of_bearing(p) for p in rating.parts if p.kind == "bearing"}
    return BinResults(rating.bins, gears, bearings)


def _of_bearing(part: RatedPart) -> dict[str, Array]:
    """Values (B,) of a bearing by REXS attribute; lives in revolutions."""
    return {
        name: np.array([value_of(sheet, symbol) for sheet in part.factors])
        * (1e6 if symbol.startswith("L") else 1.0)
        for symbol, name in LIVES.items()
    }
