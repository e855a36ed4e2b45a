"""Every figure of the tables is compared; what stands behind them is a balance at 5 MW."""

import pytest

from flexgear.gears.power_flow import power_flow
from yang2019.statements import rows
from yang2019.trains import (
    CARRIER,
    OUTPUT,
    RATED,
    RATIOS,
    RING,
    consistent,
    power_ratio,
    printed_speeds,
    published,
    single_rotor,
    train,
)

TABLES = {"Table 2": 11, "Table 3": 9, "Table 4": 16, "Table 7": 24, "Table 8": 49, "Table 9": 48}


def test_every_figure_of_the_tables_is_demanded() -> None:
    demanded = [row.where for row in rows() if row.holds is not None]
    assert {table: demanded.count(table) for table in TABLES} == TABLES


@pytest.mark.parametrize("text", RATIOS)
def test_consistent_flow_has_rated_power_in_the_given_ratio(text: str) -> None:
    flow = consistent(text)
    assert flow.mobility == 2
    assert flow.power[OUTPUT] == pytest.approx(-RATED)
    assert flow.power[RING] / flow.power[CARRIER] == pytest.approx(power_ratio(text))
    assert flow.speed[RING] < 0 < flow.speed[CARRIER]
    assert flow.circulating_power == 0


@pytest.mark.parametrize("text", RATIOS)
def test_rated_port_has_its_power(text: str) -> None:
    for port, rated in ((CARRIER, "carrier"), (RING, "ring"), (OUTPUT, "output")):
        flow = printed_speeds(text, rated)  # type: ignore[arg-type]
        share = {CARRIER: 1 / (1 + power_ratio(text)), OUTPUT: -1.0}
        share[RING] = 1 - share[CARRIER]
        assert flow.power[port] == pytest.approx(RATED * share[port])


def test_single_rotor_has_rated_power_on_its_carrier() -> None:
    flow = single_rotor()
    assert flow.mobility == 1
    assert flow.power[CARRIER] == pytest.approx(RATED)
    assert flow.torque[RING] < 0 and flow.speed[RING] == 0


def test_bundled_case_is_the_power_ratio_5_to_5() -> None:
    """As it stands, without changes from here."""
    flow, figures = power_flow(train("double-rotor-5mw")), published()
    assert flow.torque[CARRIER] / 1e3 == pytest.approx(figures["T_x1 at 5/5"].value, rel=5e-4)
    assert -flow.torque[RING] / 1e3 == pytest.approx(figures["T_b1 at 5/5"].value, rel=5e-4)
    assert flow.input_power == pytest.approx(RATED, rel=5e-4)


def test_reference_has_every_figure_of_the_tables() -> None:
    where = [p.where for p in published().values()]
    counts = {name: where.count(name) for name in ("Table 4", "Table 7", "Table 8", "Table 9")}
    assert counts == {"Table 4": 16, "Table 7": 24, "Table 8": 48, "Table 9": 32}
