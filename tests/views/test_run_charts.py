"""The list of a run's pictures: names, sections, and that a subject's words fill all braces."""

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.report.parts import SECTIONS
from flexgear.results.run_folder import Folder
from flexgear.views.chart import planned
from flexgear.views.run_charts import FLANK, RUN_CHARTS

CHARTS = [chart for _, charts in RUN_CHARTS for chart in charts]


def test_every_picture_has_a_name_of_its_own_and_a_section():
    assert len({chart.name for chart in CHARTS}) == len(CHARTS)
    assert {chart.section for chart in CHARTS} <= set(SECTIONS)


def test_a_case_that_is_not_solved_has_pictures_of_its_gears():
    case = load_case("grc-750kw")
    run = Folder(case, power_flow(case), {}, {}, {})
    of_gears = [pair for pair in RUN_CHARTS if {c.section for c in pair[1]} == {"geometry"}]
    plan = planned(run, of_gears)
    drawings = {f"drawing_{what}_{s.name}" for s in case.stages for what in ("front", "section")}
    assert drawings <= set(plan)
    assert {p.chart for n, p in plan.items() if n not in drawings} <= {FLANK}
    assert not any("{" in p.caption for p in plan.values())
