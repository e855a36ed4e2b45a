"""Pictures that a run gets, and lives of bearings as bars."""

import xarray as xr

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.report.parts import SECTIONS
from flexgear.results.run_folder import Run
from flexgear.views.chart import planned, rings
from flexgear.views.run_charts import FLANK, RUN_CHARTS
from flexgear.views.sharing_charts import bearing_life_chart

CHARTS = [chart for _, charts in RUN_CHARTS for chart in charts]


def test_every_picture_has_a_name_of_its_own_and_a_section():
    assert len({chart.name for chart in CHARTS}) == len(CHARTS)
    assert {chart.section for chart in CHARTS} <= set(SECTIONS)


def test_a_case_that_is_not_solved_has_pictures_of_its_gears():
    case = load_case("grc-750kw")
    run = Run(case, power_flow(case), {}, {}, {})
    of_gears = [pair for pair in RUN_CHARTS if {c.section for c in pair[1]} == {"geometry"}]
    plan = planned(run, of_gears)
    drawings = {f"drawing_{what}_{s.name}" for s in case.stages for what in ("front", "section")}
    assert drawings <= set(plan)
    assert {p.sentence for n, p in plan.items() if n not in drawings} <= {FLANK.sentence}
    assert not any("{" in p.caption for p in plan.values())


def test_pictures_of_two_variants_name_the_windows_of_both():
    """Settled from 1 s on, and with rigid bodies from 0.5 s on or from the same time on."""
    case = load_case("wind-5mw")
    titles = []
    for start in (0.5, 1.0):
        data = {
            name: xr.Dataset(coords={"time": [2.0]}, attrs={"settle_s": begin, "settled": "yes"})
            for name, begin in (("transient", 1.0), ("transient_rigid", start))
        }
        (ring,) = rings(Run(case, power_flow(case), data, {}, {}))
        titles.append(ring.words["windows"])
    assert titles == ["from 1 to 2 s, settled; rigid bodies from 0.5 to 2 s, settled",
                      "from 1 to 2 s, settled"]  # fmt: skip
    shown = [chart.caption for chart in CHARTS if "{windows}" in chart.caption]
    assert len(shown) == 4 and any("of the sun" in caption for caption in shown)


def test_a_bar_for_every_name_of_every_stage():
    lives = {"first": {"planet_bearing_1": 2e4, "planet_bearing_2": 3e4}, "second": {"far": 1e5}}
    ax = bearing_life_chart(lives).axes[0]
    labels = [text.get_text() for text in ax.get_yticklabels()]
    assert labels == ["first planet bearing 1", "first planet bearing 2", "second far"]
    assert [bar.get_width() for bar in ax.patches] == [2e4, 3e4, 1e5]
    assert ax.get_xlabel() == "basic rating life (h)"


def test_the_shortest_life_has_a_bar_beside_bearings_that_hardly_carry():
    lives = {"stage": {"planet_bearing_1": 3.6e4, "carrier_bearing_drive": 4e11}}
    ax = bearing_life_chart(lives).axes[0]
    left, right = ax.get_xlim()
    for bar in ax.patches:
        end = ax.transAxes.inverted().transform(ax.transData.transform((bar.get_width(), 0.0)))
        assert left < bar.get_width() < right and end[0] > 0.03
