"""What is computed: sun and ring of `case.toml` with a planet, at shares of the rated line load."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from cut_teeth.gear import working
from cut_teeth.of_case import gear_of

from flexgear.arrays import Array
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from plane_contact.body import Elastic
from plane_contact.gear_contact import ContactResult, GearContact
from plane_contact.rolling import Pair, Relief
from plane_contact.sector import Grid

KINDS = ("sun", "ring")
CASE = Path(__file__).parent / "case.toml"
RELIEF_UM, RELIEF_MM = 40.0, 20.0  # amount and length on the path, linear, on both gears
FINE = Grid(flank=240, fillet=32)
WINDOW = 6.0  # of the nodes looked at, gaps over a Hertz pair's closing at the load


@dataclass(frozen=True)
class Loading:
    """share: of the rated line load; relieved: tips of both gears; path_only: nothing touches off
    the path of contact."""

    share: float
    relieved: bool = False
    path_only: bool = False

    @property
    def name(self) -> str:
        """As in reference.json."""
        words = ["full" if self.share == 1.0 else f"{self.share:g}"]
        words += ["relieved"] if self.relieved else []
        return " ".join(words + (["path only"] if self.path_only else []))


LOADINGS = (
    *(Loading(share, relieved) for relieved in (False, True) for share in (1.0, 0.5)),
    *(Loading(share, path_only=True) for share in (1.0, 0.5)),
)


@cache
def stage() -> StageView:
    """The stage of case.toml."""
    return load_case(CASE).view()


def pair(kind: str) -> Pair:
    """Planet and sun or ring."""
    planet, gear = gear_of(stage(), "planet"), gear_of(stage(), kind)
    return Pair(planet, gear, *working(planet, gear))


def line_load(kind: str) -> float:
    """Rated gear-mesh force over the face width, N/m."""
    view = stage()
    return power_flow(view.case).stages[0].gear_mesh_forces[kind] / view.stage.face_width


def material() -> Elastic:
    """Of the case."""
    m = stage().material
    return Elastic(m.young_modulus, m.poisson_ratio)


def contact(kind: str, grid: Grid) -> GearContact:
    """Both bodies of a pair, ready to be pressed together."""
    return GearContact(pair(kind), material(), stage().stage.normal_module, grid)


def places(kind: str, count: int) -> Array:
    """(count,) s of the middle pair over one base pitch about the middle of the path."""
    p = pair(kind)
    return np.mean(p.path) + p.planet.base_pitch * (np.arange(count) / count - 0.5)


def over_a_pitch(
    bodies: GearContact, kind: str, loading: Loading, count: int
) -> list[ContactResult]:
    """Contact at ``places``."""
    p, load = bodies.pair, loading.share * line_load(kind)
    tips = [p.planet.roll_length(p.planet.tip_radius), p.gear.roll_length(p.gear.tip_radius)]
    relief = tuple(_relief(tip) if loading.relieved else np.zeros_like for tip in tips)
    # two held teeth in line give way by some 20 w (1 − ν²)/E; nothing further apart can touch
    elastic = material()
    window = WINDOW * 20 * load * (1 - elastic.poisson**2) / elastic.young
    rolling = bodies.rolling(relief, window, loading.path_only)
    return [bodies.at(s, load, rolling) for s in places(kind, count)]


def _relief(tip: float) -> Relief:
    def missing(roll: Array) -> Array:
        left = 1.0 - np.abs(roll - tip) / (1e-3 * RELIEF_MM)
        return 1e-6 * RELIEF_UM * np.clip(left, 0.0, 1.0)

    return missing
