"""Load sharing of grc-750kw cause by cause, over a turn of the carrier.

`python -m grc.by_cause` in validation/ computes all causes (minutes), or those that are named, and
writes causes.csv and the table of source.md.
"""

import csv
import math
import re
import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import flexgear as fg
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System
from flexgear.files.atomic import atomic_file
from flexgear.gears.radii import stage_radii
from flexgear.solve.angles import lead_angles
from flexgear.solve.model import Model, assemble
from flexgear.solve.static import static as equilibria
from grc.causes import Cause, every_cause

HERE = Path(__file__).parent
STORED, PAGE = HERE / "causes.csv", HERE / "source.md"
ANGLES = 2 * np.pi * np.arange(25) / 25  # of the carrier: as many phases of its gear meshes
QUICK = {
    "solver.fidelity": "quick",
    "stages.0.ring.fe.fixed_interface_modes": "20",
    "stages.0.carrier.fe.fixed_interface_modes": "20",
    "solver.reduction_limit_hz": "100",
}
DIRECTIONS = 4  # of the rotor moment, a right angle apart, the first about x
TABLE = re.compile(r"(?<=<!-- causes -->\n).*?(?=<!-- end -->)", re.DOTALL)


@dataclass(frozen=True)
class Figures:
    """Of equilibria over a turn of the carrier.

    excess: largest force on a pin over the mean of all, less one (–); row_excess: largest load of a
    row over half that mean, less one (–), NaN without rollers; held: largest resultant in their
    plane of the gear meshes of the sun, by which its shaft and its weight hold it, N.
    """

    excess: float
    row_excess: float
    held: float

    @property
    def factor(self) -> float:
        """K_gamma."""
        return 1.0 + self.excess

    @property
    def row(self) -> float:
        """Of the worst row."""
        return 1.0 + self.row_excess


@dataclass(frozen=True)
class CauseFigures:
    """Of a cause: in pure torque; under the rotor moment, each figure in the direction that is
    worst for it; and that of the factor, in degrees from x."""

    name: str
    torque: Figures
    moment: Figures
    direction: float


def put_together(cause: Cause, earlier: list[ModalSystem]) -> Model:
    """The case of a cause without the rotor moment, in the modes of the ``earlier`` one that has
    the same matrices: errors, clearances and weights change none. Equilibria depend on no mode."""
    none: dict[str, Any] = {f"stages.0.{name}.rollers": None for name in cause.linear}
    keys = {**QUICK, **cause.keys, "loads.0.moment_nm": "[0, 0, 0]"}
    model = _without_rim_stress(assemble(fg.load_case("grc-750kw", keys).with_(**none)))
    same = [modal for modal in earlier if _same_matrices(modal.system, model.system)]
    if same:
        modal = replace(same[0], system=model.system)
        return replace(model, shared_modal=modal, with_errors=model)
    earlier.append(model.modal)
    return model


def _without_rim_stress(model: Model) -> Model:
    """The model without the matrix of the stress in the ring's rim, which no figure here needs."""
    vars(model)["rim_stress"] = np.zeros((0, model.system.size))
    return model


def _same_matrices(one: System, other: System) -> bool:
    names = ("mass", "stiffness", "blocks", "port_rows")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def figures(cause: Cause, model: Model, direction: float | None = None) -> Figures:
    """Without the rotor moment, or with it in a direction, rad from x; ``model`` is the cause's."""
    if direction is not None:
        model = _loaded(model, cause.moment * np.array([np.cos(direction), np.sin(direction), 0.0]))
    static = equilibria(model, lead_angles(model.case, model.flow, ANGLES, "lss"))
    pins = np.linalg.norm(static.planet_bearing_force.values[..., :2], axis=-1)
    row = math.nan
    if "planet_bearing" not in cause.linear:
        row = float(2 * static.planet_bearing_row_load.max() / pins.mean()) - 1.0
    beta = stage_radii(model.case.view("lss")).base_helix_angle
    held = math.cos(beta) * _resultant(static)
    return Figures(float(pins.max() / pins.mean()) - 1.0, row, held)


def _loaded(model: Model, moment: Array) -> Model:
    """The same under a moment on the carrier, the last of the train's loads, whose axes are fixed;
    it enters neither matrices nor modes."""
    pairs = model.system.pairs
    vectors = pairs.load_vector.copy()
    vectors[-1, 3:] = moment
    system = model.system.with_(pairs=pairs._replace(load_vector=vectors))
    modal = replace(model.modal, system=system)
    return replace(model, system=system, shared_modal=modal, with_errors=model)


def _resultant(static: xr.Dataset) -> float:
    """|Σ F_j exp(2πi j/N)| of the gear meshes of the sun, the largest of all positions, N."""
    of_sun = [str(name).startswith("lss sun") for name in static.gear_mesh.values]
    force = static.gear_mesh_force.values[:, of_sun]
    spread = np.exp(2j * np.pi * np.arange(force.shape[1]) / force.shape[1])
    return float(np.abs(force @ spread).max())


def cause_figures(cause: Cause, earlier: list[ModalSystem]) -> CauseFigures:
    """In pure torque and under the moment in all directions; earlier: see ``put_together``."""
    turned = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    model = put_together(cause, earlier)
    moments = [figures(cause, model, float(angle)) for angle in turned]
    worst = Figures(*(max(each) for each in zip(*map(astuple, moments), strict=True)))
    about = turned[int(np.argmax([one.excess for one in moments]))]
    return CauseFigures(cause.name, figures(cause, model), worst, float(np.degrees(about)))


@cache
def computed() -> dict[str, CauseFigures]:
    """Every cause by its name, as of now."""
    earlier: list[ModalSystem] = []
    return {cause.name: cause_figures(cause, earlier) for cause in every_cause()}


def stored_figures(line: dict[str, str], load: str) -> Figures:
    """A cause's figures under one load, from its line of causes.csv."""
    excess, row_excess, held = (
        float(line[f"{load}_{key}"]) for key in ("excess", "row_excess", "held")
    )
    return Figures(excess, row_excess, held)


@cache
def stored() -> dict[str, CauseFigures]:
    """causes.csv by the names of causes."""
    with STORED.open(encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    return {
        line["cause"]: CauseFigures(
            line["cause"],
            stored_figures(line, "torque"),
            stored_figures(line, "moment"),
            float(line["direction"]),
        )
        for line in lines
    }


def store(every: list[CauseFigures]) -> None:
    """Write causes.csv."""
    with atomic_file(STORED) as path, path.open("w", encoding="utf-8", newline="") as stream:
        keys = [f"{load}_{key}" for load in ("torque", "moment") for key in Figures.__annotations__]
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["cause", *keys, "direction"])
        for one in every:
            values = [*astuple(one.torque), *astuple(one.moment)]
            out.writerow([one.name, *(f"{x:.6g}" for x in values), f"{one.direction:g}"])


def table() -> str:
    """Markdown of what is stored."""
    why = {cause.name: cause.why for cause in every_cause()}
    lines = [
        "| cause | size and where it is from | K_gamma, torque | row | sun held, kN "
        "| K_gamma, moment | row | sun held, kN | about |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for one in stored().values():
        cells = [c for part in (one.torque, one.moment) for c in _cells(part)]
        cells = [one.name, why[one.name], *cells, f"{one.direction:.0f}°"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cells(part: Figures) -> list[str]:
    row = "–" if math.isnan(part.row_excess) else f"{part.row:.2f}"
    return [f"{part.factor:.3f}", row, f"{1e-3 * part.held:.1f}"]


def main(names: Sequence[str]) -> None:
    """Compute what is named or not yet stored, all without names, and write everything."""
    by_name = stored() if names else {}
    every, earlier = [], list[ModalSystem]()
    for cause in every_cause():
        old = by_name.get(cause.name)
        every.append(cause_figures(cause, earlier) if old is None or cause.name in names else old)
        print(every[-1], flush=True)
    store(every)
    stored.cache_clear()
    PAGE.write_text(TABLE.sub(lambda _: table(), PAGE.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
