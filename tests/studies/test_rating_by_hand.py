"""A whole rating against a calculation that shares nothing with it: every factor of ISO 6336 in 42
load cases and two extreme ones, Miner's sums, lives and safeties of two editions."""

import math

import numpy as np
import pytest
from studies.gearbox_by_hand import RATED, SPEED, STAGES, ByHand, as_toml, loads

from flexgear.model.load import load_case
from flexgear.results.rating import rating_rows
from flexgear.studies.rating import rate

RANDOM = np.random.default_rng(7)
BINS = [
    (f"b{k}", round(float(hours), 1), round(share * RATED), round(speed * SPEED, 2))
    for k, (hours, share, speed) in enumerate(
        zip(RANDOM.uniform(200, 9000, 42), np.linspace(0.1, 2.6, 42), np.linspace(0.4, 1.1, 42),
            strict=True)
    )
]  # fmt: skip
EXTREME = [("stop", None, 5 * RATED, 60.0), ("brake", None, 4 * RATED, 0.0)]
HOURS = sum(hours for _, hours, *_ in BINS)


def safety(curves, cycles):
    """Factor on all stresses with a Miner's sum of one, by halving."""
    low, high = 1e-3, 1e3
    for _ in range(100):
        middle = math.sqrt(low * high)
        damages = (c.damage(n, middle) for c, n in zip(curves, cycles, strict=True))
        low, high = (low, middle) if sum(damages) > 1 else (middle, high)
    return low


@pytest.fixture(scope="module", params=[2006, 2019])
def sheets(request, tmp_path_factory):
    """Edition, and rows of rating.csv by part or gear mesh, load case and quantity."""
    folder = tmp_path_factory.mktemp("by_hand")
    (folder / "mine.toml").write_text(as_toml(request.param, [*BINS, *EXTREME]), encoding="utf-8")
    rating = rate(load_case(folder / "mine.toml"), workers=1)
    return request.param, {tuple(row[:3]): row[3] for row in rating_rows(rating)}


def test_every_factor_and_every_sum_is_that_of_a_calculation_by_hand(sheets):
    edition, rows = sheets
    ratios = []  # computed over by hand

    def compare(owner, load_case, by_hand):
        ratios.extend(
            (float(rows[owner, load_case, symbol]) / value, owner, load_case, symbol)
            for symbol, value in by_hand.items()
        )

    for stage in STAGES:
        hand = ByHand(stage, edition)
        for part, role in (("planet", "sun"), ("sun", "sun"), ("planet", "ring"), ("ring", "ring")):
            curves, cycles = {"flank": [], "root": []}, []
            for label, hours, torque, speed in (*BINS, *EXTREME):
                force, v, turns = loads(torque, speed)[stage]
                k = hand.factors(role, force, v)
                compare(f"{stage} {role}", label, k)
                n = 60 * (hours or 0.0) * turns[part] * (1 if part == "planet" else hand.n)
                cycles.append(n)
                flank, root = hand.flank(part, role, force, v, k), hand.root(part, role, force, k)
                for kind, letter, life, (factors, curve) in (
                    ("flank", "H", "Z_NT", flank), ("root", "F", "Y_NT", root),
                ):  # fmt: skip
                    end = f" to the {role}" if part == "planet" else ""
                    owner = f"{stage}.{part} {kind}{end}"
                    of_life = dict(zip((life, f"S_{letter}"), curve.at(n or 1.0), strict=True))
                    compare(owner, label, {s: x for s, x in (factors | of_life).items() if x})
                    if hours:
                        curves[kind].append(curve)
                        damage = {"load_cycles": n, "damage": curve.damage(n)}
                        compare(owner, label, damage)
            for kind in curves:
                owner = f"{stage}.{part} {kind}" + (f" to the {role}" if part == "planet" else "")
                total = sum(c.damage(n) for c, n in zip(curves[kind], cycles, strict=False))
                sums = {"damage_sum": total, "life": HOURS / total}
                compare(owner, "all", sums | {"spectrum_safety": safety(curves[kind], cycles[:42])})
    assert len(ratios) > 15000
    # fillets of the ring are followed point by point
    wrong = [line for line in ratios if line[0] != pytest.approx(1.0, rel=1e-4)]
    assert not wrong, wrong[:10]
