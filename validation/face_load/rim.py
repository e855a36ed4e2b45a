"""What the shapes of a ring's teeth change, and what they leave out: beside all slices of all pairs
of one planet at once, stored.

`python -m face_load.rim` in validation/ writes rim.csv, from FE bodies of quick fidelity. All other
bodies are held, the planet closes along the path by one approach and tilts by a share of it over
the face; line contact is linear, the secant at the mean load. Rows: pairs feel each other by the
resultants of each, as in a case; all: every slice moves every other.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rows import STORED, Row
from scipy.optimize import nnls

from face_load.runs import bodies_at
from flexgear.arrays import Array
from flexgear.files.atomic import atomic_file
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.slices import Slices, factor_along
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.solve.bodies import stage_bodies
from flexgear.structures.bodies import turn
from flexgear.structures.reduced import RimFlexibility
from flexgear.structures.sources.ring import source as ring_source
from flexgear.structures.tooth_influence.of_case import PairBending, mating_flanks, pair_bending
from flexgear.structures.tooth_influence.rim import flank_motion, rim_bending

CASES = {
    "ev-reducer": "stage",
    "wind-5mw": "stage",
    "grc-750kw": "lss",
}
TILTS = (-0.5, -0.15, 0.0, 0.15, 0.5)  # of the approach, over the face
POSITIONS = (0.1, 0.35, 0.6, 0.85)  # of a base pitch
ALONG = 41  # places of the face
WAYS = ("without", "rows", "all")
TABLE = Path(__file__).with_name("rim.csv")
SAME = 0.02


@dataclass(frozen=True)
class Ring:
    """The ring gear mesh of a case. nodes (6, 6 z) m/N of all teeth on tooth 0, along the axes of
    each; rim: of its teeth; more: what that adds, (S, K, K) and (S, 2, K, K) m/N."""

    path: GearMeshPath
    slices: Slices
    bending: PairBending
    rim: RimFlexibility
    more: tuple[Array, Array]
    nodes: Array
    force: float


def ring_of(case: str) -> Ring:
    """Of a bundled case, as FE influences have it."""
    stage, options = CASES[case], {"model": "face_load", "tooth_compliance": "fe"}
    train = load_case(
        case,
        {
            **bodies_at(case, "quick"),
            **{f"stages.{stage}.gear_mesh.{k}": v for k, v in options.items()},
        },
    )
    view = train.view(stage)
    force = power_flow(train).stage(stage).gear_mesh_forces["ring"]
    path = stage_paths(view, power_flow(train).stage(stage).gear_mesh_forces)["ring", ""]
    assert path.slices is not None
    carrier = BodyName.of(stage, "carrier")
    bodies = stage_bodies(view, rigid=[carrier])
    body = bodies[BodyName.of(stage, "ring")]
    assert body.rim is not None
    b = body.interface_dofs
    held = np.linalg.inv(
        body.stiffness[:b, :b] + ring_source(view).supports(body.node_names, body.stiffness)
    )
    return Ring(
        path=path,
        slices=path.slices,
        bending=pair_bending(view, path, path.slices, force),
        rim=body.rim,
        more=rim_bending(body.rim, path, path.slices, 1),
        nodes=_of_teeth(view, held),
        force=abs(force),
    )


def _of_teeth(view: StageView, held: Array) -> Array:
    """Of a tooth a third of the ring on from tooth 0, so that supports count as they mostly do."""
    teeth = view.ring_gear.teeth
    j = teeth // 3
    rotation = turn(2 * np.pi * j / teeth)
    blocks = [
        rotation.T @ held[6 * j : 6 * j + 6, 6 * i : 6 * i + 6] @ turn(2 * np.pi * i / teeth)
        for i in ((j + k) % teeth for k in range(teeth))
    ]
    return np.hstack(blocks)


@dataclass(frozen=True)
class Pairs:
    """Slices (k K,) of the k pairs at one position: z, width m, scale m/N and limit N of their line
    contact; flexibility (k K, k K) m/N by way."""

    count: int
    z: Array
    width: Array
    scale: Array
    limit: Array
    flexibility: dict[str, Array]

    def carrying(self, way: str, force: float, tilt: float, line_load: float) -> Array:
        """Forces N of so much together: bodies closed by x (1 + tilt z)."""
        whole = self.flexibility[way] + np.diag(_secant(self, line_load))
        lower = np.linalg.cholesky(0.5 * (whole + whole.T))
        x = np.linalg.solve(lower, 1.0 + tilt * self.z)
        unit = nnls(lower.T, x, maxiter=5000)[0]  # all is linear in x
        return np.asarray(unit * force / unit.sum())


def _secant(pairs: Pairs, line_load: float) -> Array:
    nominal = np.minimum(np.maximum(line_load * pairs.width, 1e-6 * pairs.limit), pairs.limit / 8)
    return np.asarray(pairs.scale * np.log(pairs.limit / nominal))


def pairs_at(ring: Ring, share: float) -> Pairs:
    """Of one planet at a share of a base pitch."""
    s, path = ring.slices, ring.path
    places = s.s[0] + path.base_pitch * (share + np.arange(8))
    places = places[(places < s.s[-1])]
    places = places[np.interp(places, s.s, s.stiffness.sum(axis=1)) > 0.0]

    def at(table: Array) -> Array:
        flat = table.reshape(len(table), -1).T
        columns = [np.interp(places, s.s, column) for column in flat]
        return np.array(columns).T.reshape(len(places), *table.shape[1:])

    flank = mating_flanks(path, s)[1]
    z, k, n = at(s.z), s.count, len(places)
    motion = flank_motion(ring.rim, flank.tooth, -flank.sense, (at(flank.roll), z))[..., :6]
    single, next_ones = at(ring.bending.flexibility), at(ring.bending.beside)
    more, more_beside = (at(table) for table in ring.more)
    scale, limit, width = at(ring.bending.scale), at(ring.bending.limit), at(s.width)
    base, rims = np.zeros((2, n * k, n * k))
    for p in range(n):
        for q in range(n):
            block_p, block_q = slice(p * k, p * k + k), slice(q * k, q * k + k)
            on = (q - p) * flank.step % (ring.nodes.shape[1] // 6)
            base[block_p, block_q] += motion[p] @ ring.nodes[:, 6 * on : 6 * on + 6] @ motion[q].T
            if p == q:
                base[block_p, block_q] += single[p]
                rims[block_p, block_q] += more[p]
            elif 0 < q - p <= next_ones.shape[1]:
                base[block_p, block_q] += next_ones[p, q - p - 1]
                base[block_q, block_p] += next_ones[p, q - p - 1].T
                rims[block_p, block_q] += more_beside[p, q - p - 1]
                rims[block_q, block_p] += more_beside[p, q - p - 1].T
    pairs = Pairs(n, z.ravel(), width.ravel(), scale.ravel(), limit.ravel(), {})
    nominal = ring.force / (n * 2 * path.half_face)
    by_rows = _by_rows(pairs, rims, base + np.diag(_secant(pairs, nominal)))
    ways = (base, base + by_rows, base + rims)
    pairs.flexibility.update(zip(WAYS, ways, strict=True))
    return pairs


def _by_rows(pairs: Pairs, rims: Array, whole: Array) -> Array:
    """Flexibility of the rim, between pairs by their resultants as in ``neighbour_flexibility``."""
    k = len(pairs.z) // pairs.count
    tall, pressed = np.zeros((2, len(pairs.z), 2 * pairs.count))
    for p in range(pairs.count):
        at, columns = slice(p * k, p * k + k), slice(2 * p, 2 * p + 2)
        t = np.column_stack([np.ones(k), pairs.z[at]])
        solved = np.linalg.solve(whole[at, at] + rims[at, at], t)
        tall[at, columns], pressed[at, columns] = t, solved @ np.linalg.inv(t.T @ solved)
    flexibility = tall @ (pressed.T @ rims @ pressed) @ tall.T
    for p in range(pairs.count):
        at = slice(p * k, p * k + k)
        flexibility[at, at] = rims[at, at]
    return flexibility


def k_h_beta(ring: Ring, way: str, tilt: float) -> float:
    """Over a gear-mesh cycle, tilted by a share of the approach over the face."""
    along = np.linspace(-1.0, 1.0, ALONG) * ring.path.half_face
    load = np.zeros(ALONG)
    for share in POSITIONS:
        pairs = pairs_at(ring, share)
        k, width = len(pairs.z) // pairs.count, 2 * ring.path.half_face
        nominal = ring.force / (pairs.count * width)

        w = pairs.carrying(way, ring.force, tilt / width, nominal) / pairs.width
        for p in range(pairs.count):
            at = slice(p * k, p * k + k)
            z, reach = pairs.z[at], 0.5 * pairs.width[p * k]
            on = (along >= z[0] - reach) & (along <= z[-1] + reach)
            load[on] += np.interp(along[on], z, w[at])
    return factor_along(load)


def computed() -> dict[tuple[str, float], tuple[float, ...]]:
    """K_Hβ by case and tilt, of all ``WAYS``."""
    factors = {}
    for case in CASES:
        ring = ring_of(case)
        for tilt in TILTS:
            factors[case, tilt] = tuple(k_h_beta(ring, way, tilt) for way in WAYS)
    return factors


def stored() -> dict[tuple[str, float], tuple[float, ...]]:
    """rim.csv, as ``computed``."""
    with TABLE.open(encoding="utf-8", newline="") as stream:
        return {
            (line["case"], float(line["tilt"])): tuple(float(line[way]) for way in WAYS)
            for line in csv.DictReader(stream)
        }


def rows(again: bool) -> list[Row]:
    """What is stored; again: compared with what is computed."""
    now, lines = computed() if again else {}, []
    for (case, tilt), factors in stored().items():
        without, taken, whole = factors
        text = (
            f"{without:.3f} without, {taken:.3f} with shapes; all slices at once {whole:.3f} "
            f"({100 * (without / whole - 1):+.1f}, {100 * (taken / whole - 1):+.1f} %)"
        )
        demand, holds = "reported", None
        if again:
            off = max(abs(b / a - 1) for a, b in zip(factors, now[case, tilt], strict=True))
            text, demand, holds = f"{text}; {100 * off:.2f} % off", f"{100 * SAME:g} %", off < SAME
        name = f"K_Hβ of the ring, its rim within a tooth, tilted by {tilt:g} of the approach"
        why = "pairs feel shapes of their neighbours by resultants; other bodies held; stored"
        against = STORED if again else ""
        lines.append(Row("face_load", case, name, "–", text, demand, holds, why, against))
    return lines


def main() -> None:
    """Compute and write rim.csv."""
    by_case = computed()
    with atomic_file(TABLE) as path, path.open("w", encoding="utf-8", newline="") as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["case", "tilt", *WAYS])
        for (case, tilt), factors in by_case.items():
            out.writerow([case, f"{tilt:g}", *(f"{factor:.5f}" for factor in factors)])


if __name__ == "__main__":
    main()
