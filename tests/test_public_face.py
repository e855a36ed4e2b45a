"""What a script or a notebook does with `import flexgear as fg`, and what it is answered."""

import inspect
import pickle
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from trains import spur_pair, write

import flexgear as fg
from flexgear.model.load import bundled_text


def test_public_names_are_there():
    assert all(getattr(fg, name) is not None for name in fg.__all__)
    assert set(fg.__all__) <= set(dir(fg))


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing_like_it"):
        fg.nothing_like_it  # noqa: B018
    with pytest.raises(AttributeError, match="models have it as a method"):
        fg.run(fg.load_case("lin-parker"), "out")


def test_import_alone_is_light():
    code = "import sys, flexgear; print([m for m in ('gmsh', 'numba', 'vtk') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_public_function_takes_arguments_without_types():
    functions = [
        getattr(owner, name)
        for owner in (fg, fg.Case, fg.Model, fg.Comparison)
        for name in (fg.__all__ if owner is fg else vars(owner))
        if not name.startswith("_") and inspect.isfunction(getattr(owner, name))
    ]
    for function in functions:
        parameters = dict(inspect.signature(function).parameters)
        parameters.pop("self", None)
        assert all(p.annotation not in ("Any", p.empty) for p in parameters.values()), function


@pytest.fixture(scope="module")
def case():
    return fg.load_case("lin-parker")


@pytest.fixture(scope="module")
def model(case):
    return case.assemble()


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda case: fg.load_case(3), "load_case(): source: 3 is of the wrong type"),
        (lambda case: fg.load_case("lin-parker", planets="five"),
         "load_case(): planets: 'five' is not a whole number"),
        (lambda case: fg.load_case("lin-parker", sun__teeth=-1),
         "load_case(): sun__teeth: -1 is outside 5 … 2000"),
        (lambda case: fg.load_case("lin-parker", fidelity="quick"), "write solver__fidelity"),
        (lambda case: fg.load_case("lin-parker", {"stage.planets": "x"}),
         "load_case(): stage.planets: 'x' is not a whole number"),
        (lambda case: fg.load_case("lin-parker", planet=5), "planet: is not a section"),
        (lambda case: fg.load_case("lin-parker", plannets=5), "did you mean planets?"),
        (lambda case: fg.load_case("lin-parker", modul=3), "normal_module_mm, pressure_angle_deg"),
        (lambda case: fg.load_case("lin-parker", face_width=5), "face_width: has no unit"),
        (lambda case: fg.load_case("nrel-5mw", planets=5),
         "planets: is a key of a stage -- write stage_1__planets or stage_2__planets or stage_3"),
        (lambda case: case.with_(nokey=1), "Case.with_(): nokey: is not a known key"),
        (lambda case: case.with_(plannets=1), "stage.plannets: is not a known key -- did you mean"),
        (lambda case: case.assemble(rigid=["rim"]), "Case.assemble(): rigid"),
        (lambda case: case.assemble(progress="bar"), "Case.assemble(): progress: 'bar'"),
        (lambda case: case.run(3), "Case.run(): out: 3 is of the wrong type"),
        (lambda case: case.run(folder="x"), "Case.run(): arguments"),
        (lambda case: fg.power_flow(3), "power_flow(): case: 3"),
        (lambda case: case.assemble().static("x"), "Model.static(): angle_deg: 'x'"),
        (lambda case: case.assemble().static(0, member="stage.rim"), "static(): member: "),
        (lambda case: case.assemble().modes(limit_hz="a"), "Model.modes(): limit_hz: 'a'"),
        (lambda case: case.assemble().transient("long"), "Model.transient(): duration: 'long'"),
        (lambda case: case.assemble().transient("0.5"), "transient(): duration: '0.5' is of"),
        (lambda case: case.assemble().transient(0), "transient(): duration: 0 is not positive"),
        (lambda case: case.assemble().transient(np.inf), "transient(): duration: inf is of the"),
        (lambda case: case.assemble().transient(0.001, output_interval=0.0),
         "transient(): output_interval: 0.0 is not positive -- give a number above zero"),
        (lambda case: case.assemble().static({}), "static(): angle_deg: {} is of the wrong type"),
        (lambda case: case.assemble().static([]), "static(): angle_deg: [] is of the wrong type"),
        (lambda case: case.assemble().static(np.eye(2)), "static(): angle_deg: array([["),
        (lambda case: case.assemble().static(np.datetime64("2020-01-01")), "static(): angle_deg"),
        (lambda case: case.assemble().static(np.inf), "static(): angle_deg: inf is of the wrong"),
        (lambda case: case.assemble().static(case.assemble().modes()), "angle_deg: <xarray.Data"),
        (lambda case: case.assemble().static(0, torque=True), "static(): torque: True is of the"),
        (lambda case: case.assemble().static(0, torque=np.nan), "static(): torque: nan is of the"),
        (lambda case: case.assemble().static(0, progress=1), "progress: 1 is of the wrong type -- g"
         "ive a function of the name of a step and the share of it that is done"),
        (lambda case: case.assemble().modes(limit_hz=0), "modes(): limit_hz: 0 is not positive"),
        (lambda case: case.assemble().modes(member="x"), "modes(): member: 'x': does not turn"),
        (lambda case: case.assemble().campbell("x"), "campbell(): factors: 'x' is of the wrong"),
        (lambda case: case.assemble().campbell(margin=-1), "campbell(): margin: -1 is not"),
        (lambda case: case.assemble().campbell(orders=[1, 0]), "campbell(): orders: 0: is no or"),
        (lambda case: case.assemble().stability(count=2.0), "count: 2.0 is of the wrong type"),
        (lambda case: case.assemble().stability(count=10**7), "count: 10000000 is too large"),
        (lambda case: case.assemble().rigid("ring"), "Model.rigid(): parts: lin-parker: has only"),
        (lambda case: case.assemble().transient(1e-3, torque_share=np.inf), "torque_share: inf is"),
        (lambda case: case.assemble().transient(1e-3, fields=["x"]), "transient(): fields: 'x'"),
        (lambda case: case.assemble().transient(1e-3, out=""), "transient(): out: \"\": names no"),
        (lambda case: case.assemble().transient(1e-3, drive={"kind": "r"}), "drive.kind: 'r' is u"),
        (lambda case: case.assemble().response((-1, 2)), "response(): speeds: -1 to 2: goes thr"),
        (lambda case: case.assemble().stability(count=0), "stability(): count: 0 is not positive"),
        (lambda case: case.assemble().stability((0, 0)), "stability(): speeds: 0 to 0: goes"),
        (lambda case: case.assemble().linear_response(orders=-1), "linear_response(): orders: -1"),
        (lambda case: case.assemble().response(speed=0.5), "response(): speed: 0.5: is fixed, but"),
        (lambda case: case.assemble().mode_field(b"x", 1), "mode_field(): body: b'x' is of the"),
        (lambda case: case.assemble().static().fg.orders(3), "orders(): name: 3 is of the wrong"),
        (lambda case: case.assemble().static().fg.orders("a\nb"), "name: a\\nb: is no history of "
         "this file -- it has none: take a transient"),
        (lambda case: case.assemble().transient(0.01).fg.orders("port_torque", window="x"),
         "orders(): window: 'x': is unknown"),
        (lambda case: case.assemble().transient(0.01).fg.orders("port_torque", "stage.x"),
         "orders(): member: stage.x: is no member"),
        (lambda case: case.assemble().transient(0.01).fg.orders("port_torque", band_hz=(9, 5)),
         "orders(): band_hz: band 9 to 5 Hz: is not within"),
        (lambda case: case.assemble().mode_field("stage.x", 1), "mode_field(): body: 'stage.x'"),
        (lambda case: fg.sweep(case, {"stage.planets": [3]}, measures=["x"]), "measures: x: is no"),
        (lambda case: fg.sweep(case, {"stage.planets": [3]}, workers=0), "workers: 0 is not"),
        (lambda case: fg.sweep(case, {"stage.planets": [3]}, modes=0), "modes: 0 is not positive"),
        (lambda case: fg.sweep(3, {"stage.planets": [3]}), "sweep(): source: 3 is of the wrong"),
        (lambda case: fg.load_case(case, planets=0), "load_case(): planets: 0 is outside"),
        (lambda case: fg.field_grid(case.assemble().static()), "field_grid(): field: dataset: is"),
        (lambda case: fg.swing(case.assemble().static()), "swing(): field: dataset: is no natural"),
        (lambda case: fg.stage_part(case.assemble().static(), "x"), "stage_part(): stage: 'x'"),
        (lambda case: fg.stage_part(case.assemble().static(), "stage", "x"), "half: 'x': is no"),
        (lambda case: fg.radial_harmonics(1.0), "radial_harmonics(): displacement: (): is not"),
        (lambda case: fg.compare(a=1, b=2), "compare(): a: 1 is of the wrong type"),
        (lambda case: fg.compare(), "compare(): runs: are fewer than two"),
        (lambda case: fg.power_flow("lin-parker"), "give a case that fg.load_case returns"),
        (lambda case: fg.sweep(case, "planets=3,4"), 'ranges by key: {"stage.planets": [3, 4]}'),
        (lambda case: fg.sweep(case, {"planets": [3]}, measures="load_sharing"),
         "measures: 'load_sharing' is of the wrong type -- give a list of texts"),
        (lambda case: fg.compare(1, 2), "without its name -- it takes **runs, such as name=value"),
        (lambda case: fg.compare(a=case.assemble().modes(), b=case.assemble().modes()),
         "compare(): a: has no gear_mesh_force"),
        (lambda case: fg.Case(stages=[{"planets": "five"}]), "Case()"),
        (lambda case: fg.Case(x=None), "Case(): x: is not a known key"),
        (lambda case: fg.Case(3), "Case(): 3: comes without a key -- give material=…, stage=…"),
    ],
)  # fmt: skip
def test_a_wrong_argument_is_one_line_that_names_it(case, call, line):
    with pytest.raises(fg.InputError) as fault:
        call(case)
    assert str(fault.value).startswith("flexgear.") and line in str(fault.value)
    assert "\n" not in str(fault.value) and "--" not in str(fault.value).replace(" -- ", "")


def test_an_unknown_stage_is_one_line(case):
    for block in (fg.geometry, fg.contact_paths):
        with pytest.raises(fg.InputError, match=r"lin-parker: 'x': is of no stage .* one of stage"):
            block(case, "x")
    with pytest.raises(fg.InputError, match="0: is of no stage of the case -- use one of stage"):
        case.stage(0)


def test_a_value_in_place_of_a_section_is_one_line(case):
    with pytest.raises(fg.InputError, match="inputs: -1 is not a list -- give a list"):
        case.with_(inputs=-1)
    with pytest.raises(fg.InputError, match="damping: 3 is not a section with keys"):
        case.with_(damping=3)


def test_numbers_of_numpy_and_labelled_ones_are_numbers(model):
    angles = model.static(np.arange(3)).lead_angle
    assert model.static(np.degrees(angles)).lead_angle.values == pytest.approx(angles.values)
    path = fg.contact_paths(model.case)["ring"]
    assert np.isnan(fg.pair_stiffness(path, [np.nan, 0.0])[0])  # as in places without a pair
    assert model.static(np.float32(1), torque=angles[0]).sizes["position"] == 1
    assert model.campbell(1, orders=np.array([1, 2])).attrs["margin"] == pytest.approx(0.1)
    unsorted, rising = model.campbell([1, 0, 0.5]), model.campbell([0, 0.5, 1])
    xr.testing.assert_equal(unsorted, rising)


def test_a_transient_in_memory_keeps_what_is_asked_for(model, tmp_path):
    alone = model.transient(0.002, save=["gear_mesh_force"])
    assert "gear_mesh_force" in alone and "body_displacement" not in alone
    in_file = model.transient(0.002, save=["gear_mesh_force"], out=tmp_path / "run.nc")
    assert set(alone.data_vars) == set(in_file.data_vars)
    with pytest.raises(fg.InputError, match=r"transient\(\): save: x: is not saved by this run"):
        model.transient(0.002, save=["x"])


def test_a_drive_is_a_section_and_its_file_is_read(model, tmp_path):
    """By keys, from a file, and of a case that is changed, the same torque acts."""
    file = tmp_path / "drop.csv"
    file.write_text("time_s,torque_nm\n0,100\n0.001,40\n")
    keys = {"kind": "ramp", "times_s": [0, 0.001], "torques_nm": [100, 40]}
    ramp = model.transient(0.002, drive=keys).port_torque.sel(port="stage.sun")
    assert ramp.values[-1] == pytest.approx(40.0)
    from_file = {"kind": "csv", "file": str(file)}
    read = model.transient(0.002, drive=from_file).port_torque.sel(port="stage.sun")
    assert read.values == pytest.approx(ramp.values)
    for case in (
        fg.load_case(model.case, drive=from_file),
        model.case.with_(**{"drive.kind": "csv", "drive.file": str(file)}),
    ):
        assert case.drive.torques == (100.0, 40.0)
    file.unlink()  # the case has its content
    assert fg.load_case(case, title="x").drive.torques == (100.0, 40.0)


def test_a_limit_above_all_frequencies_gives_all_modes(model):
    every = model.modes(angle_deg=0).frequency.values
    assert model.modes(1e300, angle_deg=0).frequency.values == pytest.approx(every)


def test_keys_of_a_case_are_keywords_of_load_case():
    """Those of the only stage without its name, values as Python has them; None takes one out."""
    by_text = fg.load_case("lin-parker", {"stage.planets": "5", "stage.errors.pin_radial_um": "10"})
    errors = {"pin_radial_um": np.float64(10.0)}
    assert fg.load_case("lin-parker", planets=5, errors=errors) == by_text
    assert fg.load_case("lin-parker", **{"stage.planets": 5, "errors.pin_radial_um": 10}) == by_text
    assert fg.load_case("lin-parker", title=None).title == ""
    assert fg.load_case("lin-parker", gyroscopic=True).gyroscopic


def test_a_case_of_objects_is_that_of_the_file(case):
    fields = {name: getattr(case, name) for name in type(case).model_fields}
    assert fg.Case(**fields) == case
    plain = case.model_dump(exclude_unset=True)
    assert fg.Case(**{**plain, "stages": list(plain["stages"])}) == case


def test_a_case_takes_the_only_stage_as_a_file_does():
    data = tomllib.loads(bundled_text("lin-parker"))
    case = fg.Case(name="lin-parker", **data)
    assert case.content_hash() == fg.load_case("lin-parker").content_hash()
    assert case.stages[0].name == "stage"
    with pytest.raises(fg.InputError, match="stage: is given beside"):
        fg.Case(stages=[data["stage"]], **data)


def test_a_case_takes_units_or_si(case):
    fields = {name: getattr(case, name) for name in type(case).model_fields}
    stage = case.stages[0].model_dump(exclude_unset=True)
    in_mm = {"face_width_mm": 1e3 * stage.pop("face_width"), **stage}
    assert fg.Case(**{**fields, "stages": [in_mm]}) == case
    with pytest.raises(fg.InputError, match=r"stages\[0\].face_width_mm: -1 mm is outside"):
        fg.Case(**{**fields, "stages": [{**in_mm, "face_width_mm": -1.0}]})


def test_the_page_of_building_blocks_runs(capsys):
    """A beam's first frequency is that of Euler and Bernoulli; shear takes less than a percent."""
    page = (Path(__file__).parents[1] / "docs" / "building_blocks.md").read_text(encoding="utf-8")
    names: dict = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), names)
    inertia, area = 0.05**4 / 12, 0.05**2
    beam = 1.8751**2 / (2 * np.pi) * np.sqrt(2.1e11 * inertia / (7850 * area))
    assert names["frequency"] == pytest.approx(beam, rel=5e-3) and names["frequency"] < beam
    of_pairs, path = names["of_planet_1"], names["path"]
    assert of_pairs.min() < path.mean_stiffness < of_pairs.max()
    assert capsys.readouterr().out.count("\n") == 5
    with pytest.raises(fg.InputError, match="nodes: 'rim': is no boundary"):
        fg.reduce_fe_mesh(
            names["grid"], {"rim": None}, young_modulus=1.0, poisson_ratio=0.3, density=1.0
        )


def test_results_go_to_other_processes_with_their_pictures(model):
    data = model.static(0.0)
    names = dir(data.fg.plot)
    late = pickle.loads(pickle.dumps(data))
    assert late.identical(data) and dir(late.fg.plot) == names


def test_a_saved_dataset_is_read_as_it_was_with_its_pictures(model, tmp_path):
    data = model.static([0.0, 3.0])
    data.to_netcdf(tmp_path / "mine.nc", engine="h5netcdf")
    code = "import sys, flexgear as fg; print(dir(fg.open_dataset(sys.argv[1]).fg.plot))"
    command = [sys.executable, "-c", code, str(tmp_path / "mine.nc")]
    alone = subprocess.run(command, capture_output=True, text=True, check=True)
    assert alone.stdout.strip() == str(dir(data.fg.plot))
    xr.testing.assert_identical(fg.open_dataset(tmp_path / "mine.nc"), data)
    with pytest.raises(fg.InputError, match="there is no such file"):
        fg.open_dataset(tmp_path / "other.nc")


def test_a_case_is_swept_as_a_file_is(case):
    keys = {"stage.planet_bearing.radial_n_per_m": [1e8, 2e8]}
    study = fg.sweep(case, keys, settings={"stage.planets": 3}, workers=1)
    by_name = fg.sweep("lin-parker", keys, settings={"stage.planets": 3}, workers=1)
    xr.testing.assert_equal(study, by_name)
    assert "frequency" in dir(study.fg.plot)
    figure = study.fg.plot.frequency()
    assert figure.axes[0].get_ylabel() == "frequency (Hz)"
    assert fg.load_case(case, planets=3) == fg.load_case("lin-parker", planets=3)
    assert fg.load_case(fg.load_case("nrel-5mw")) == fg.load_case("nrel-5mw")


def test_studies_show_bars_in_a_notebook(case, monkeypatch):
    """As methods do: a bar until the last point is done."""
    pages = []
    monkeypatch.setattr("flexgear.face.notebook._in_notebook", lambda: True)
    monkeypatch.setattr("flexgear.face.notebook.NotebookBars._draw", lambda self: pages.append(1))
    keys = {"stage.face_width_mm": [30, 31]}
    fg.sweep(case, keys, workers=1)
    assert pages
    del pages[:]
    fg.sweep(case, keys, workers=1, progress=lambda stage, share: None)
    assert not pages


def test_samples_of_a_tolerance_have_their_picture():
    study = fg.tolerance(
        fg.load_case("herringbone", {
            "tolerance.samples": 20, "tolerance.errors.pin_tangential.standard_deviation_um": 15,
        }),
        workers=1,
    )  # fmt: skip
    assert dir(study.fg.plot) == ["load_sharing"] and study.fg.plot.load_sharing().axes


def test_angles_are_those_of_the_member_that_is_named():
    """In one planetary stage the carrier is slower than the sun by the ratio of the stage."""
    model = fg.load_case("herringbone").assemble()
    speed, lead = model.flow.speed, model.reference_member
    other = next(m for m, w in speed.items() if w not in (0.0, speed[lead]))
    ratio = abs(speed[other] / speed[lead])
    by_lead, by_other = model.static([0, 3]), model.static([0, 3 * ratio], member=other)
    xr.testing.assert_allclose(by_lead, by_other, rtol=1e-6, atol=1e-12)
    assert by_lead.lead_angle.values == pytest.approx(np.radians([0, 3]))


def test_rigid_adds_to_what_is_rigid():
    model = fg.load_case("wind-5mw").assemble(rigid="all")
    assert model.rigid_parts == ("all",) and model.variant == "rigid"
    assert model.rigid("ring").variant == "rigid"
    assert model.without_errors().rigid().variant == "rigid, without errors"


def test_runs_are_compared_in_a_table_and_a_picture(model):
    stiffer = model.case.with_(**{"stage.planet_bearing.radial": 1e9}).assemble()
    both = fg.compare(soft=model.transient(0.002), stiff=stiffer.transient(0.002))
    assert both.figures.gear_mesh_force.dims == ("run", "gear_mesh")
    assert repr(both).count("\n") == 2 and "<td>stiff</td>" in both._repr_html_()
    axes = [ax for ax in both.plot().axes if ax.has_data()]
    assert len(axes) == 4
    sharing = [ax for ax in axes if "load sharing" in ax.get_ylabel()]
    assert min(np.ptp(ax.get_ylim()) for ax in sharing) > 9e-3  # K = 1 to rounding


def test_objects_are_short_in_a_notebook(case):
    """Half a screen of a stage as it is stated, a line of a path of contact."""
    stage = repr(case.stages[0])
    assert "planets=4, " in stage and "support=Support(radial=100000000.0)" in stage
    assert len(stage) < 1000 and "=None" not in stage
    path = repr(fg.contact_paths(case)["ring"])
    assert re.fullmatch(r"<ring path of contact: 94/34 teeth, s from .* to .* mm>", path)
    assert repr(case.view()) == "<stage of <flexgear case 'lin-parker': stage (planetary)>>"
    assert len(repr(fg.geometry(case))) < 900


def test_a_train_without_load_has_no_linear_response(case):
    """No gear mesh deflects, so that none excites the train."""
    data = fg.load_case(case, inputs__0__torque_nm=0).assemble().linear_response(count=3)
    assert not data.linear_force_amplitude.any() and data.sizes["peak"] == 0


def test_a_comparison_of_gear_pairs_has_no_load_sharing(tmp_path):
    """Nobody shares the load of one gear mesh: of a pair alone, or at the end of a train."""
    text = spur_pair(gear_mesh='model = "constant"', backlash=20, speed=10, torque=500)
    cases = (fg.load_case(source) for source in (write(tmp_path, text), "nrel-5mw"))
    models = [case.assemble() for case in cases]
    alone, last = (fg.compare(a=m.static([0, 1]), b=m.static([2, 3])) for m in models)
    assert "load factor" not in repr(alone) and "load factor" in repr(last)
    assert [ax.get_ylabel() for ax in alone.plot().axes] == ["largest force (kN)"]
    weak = fg.compare(
        **{n: d.assign(gear_mesh_force=1e-2 * d.gear_mesh_force) for n, d in alone.runs.items()}
    )
    texts = [repr(of).split() for of in (alone, weak)]
    assert ["force (kN)" in repr(alone), "force (N)" in repr(weak)] == [True, True]
    assert float(texts[1][-1]) == pytest.approx(10 * float(texts[0][-1]), rel=1e-3)
    axes = last.plot().axes
    assert [ax.get_visible() for ax in axes[-2:]] == [True, False]
    assert axes[-2].get_xlabel() == axes[-3].get_xlabel() == "turns of stage 1, carrier (–)"


def test_a_run_in_a_folder_is_read_again_and_drawn(tmp_path):
    case = fg.load_case("lin-parker").with_(**{"solver.duration": 0.01, "solver.settle": 0.002})
    run = case.run(tmp_path / "own")
    assert {"modes", "equilibrium", "transient"} <= set(run.datasets)
    assert len(repr(run)) < 300 and "<table>" in run._repr_html_()
    run.summary["warnings"] += ["first line", "second line"]
    html = run._repr_html_()
    assert "<td>first line</td><td>look at this</td>" in html and "second line" in html
    del run.summary["warnings"][-2:]
    assert fg.read_run(tmp_path / "own").summary == run.summary
    page = fg.report(tmp_path / "own", interactive=False)
    assert page.read_text().startswith("<!DOCTYPE html>")
    with pytest.raises(fg.InputError, match="finished run"):
        fg.report(tmp_path)


def test_cases_and_models_are_shown_in_a_line(case, model):
    methods = repr(model.static().fg)
    assert "plot" in methods and "orders" in methods and " at 0x" not in methods
    for shown in (repr(case), repr(model)):
        assert "lin-parker" in shown and len(shown) < 300
    assert "<td>lin-parker</td>" in model._repr_html_()
    assert "26/34/94 teeth" in case._repr_html_()
    small = case.with_(planets=1, normal_module=5e-4, center_distance=None)
    assert "planetary, 1 planet, ring held" in small._repr_html_()
    assert "normal module 0.5 mm" in small._repr_html_()


def test_a_notebook_shows_bars_and_a_script_nothing(case, monkeypatch, capsys):
    shown = []

    class Page(str):
        pass

    class Display:
        HTML = Page

        @staticmethod
        def display(page, display_id):
            shown.append(page)
            return type("Handle", (), {"update": lambda self, page: shown.append(page)})()

    class Shell:
        kernel = object()

    class IPython:
        get_ipython = staticmethod(Shell)

    case.assemble().static()
    assert capsys.readouterr() == ("", "")
    monkeypatch.setitem(sys.modules, "IPython", IPython)
    monkeypatch.setitem(sys.modules, "IPython.display", Display)
    case.assemble().transient(0.3)
    assert any("<progress" in page and "transient" in page for page in shown)
    assert "<progress" not in shown[-1]
