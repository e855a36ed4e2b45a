"""ISO/TR 6336-30, example 1: every printed figure, and what the print needs to be met."""

import pytest
from rows import failures, reference

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.load_factors import dynamic_factor
from flexgear.gears.rating.pair import gear_pair, pair_load
from flexgear.model.load import load_case
from iso_tr_6336_30.statements import HERE, PAPER, figures, rows


def test_every_printed_figure_is_met() -> None:
    table = rows()
    assert len(table) == 33
    assert all(row.holds for row in table), failures(table)


def test_the_edition_of_2006_is_the_one_that_the_report_applies() -> None:
    """The report is of 2017: its Z_β = 1.01944 = 1/√cos 15.8° is that of 2006 and its corrigendum,
    and so are its stresses and safeties."""
    printed, computed = reference(PAPER), figures("2006")
    for quantity in ("Z_β", "σ_H0", "σ_H", "S_H1", "S_H2"):
        assert computed[quantity] == pytest.approx(printed[quantity].value, rel=1e-3)


@pytest.mark.parametrize(
    "change",
    [
        {"rating.edition": "2006"},
        {"stage.pinion.bore_diameter_mm": "60"},
        {"stage.pinion.modifications.tip_relief.amount_um": "50"},
    ],
)
def test_k_v_rounds_to_the_print_whatever_the_report_does_not_print(change: dict[str, str]) -> None:
    case = load_case(HERE / "case.toml", change)
    view = case.view()
    pair = gear_pair(view, stage_geometry(view), "sun")
    factor, _ = dynamic_factor(pair, pair_load(pair, power_flow(case).stages[0]), 1.0)
    assert factor == pytest.approx(1.003, abs=5e-4)
