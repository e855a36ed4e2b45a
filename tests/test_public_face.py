"""Every public name exists, and importing the package loads nothing heavy."""

import inspect
import subprocess
import sys

import pytest

import flexgear


@pytest.mark.parametrize("name", flexgear.__all__)
def test_public_name_is_there(name):
    assert getattr(flexgear, name) is not None
    assert name in dir(flexgear)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nothing_like_it"):
        flexgear.nothing_like_it  # noqa: B018


def test_import_alone_is_light():
    code = "import sys, flexgear; print([m for m in ('gmsh', 'numba', 'vtk') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_face_is_small_and_one_thing_is_handed_over():
    """Whoever has a model has its case."""
    assert len(flexgear.__all__) < 24
    for name in flexgear.__all__:
        if not inspect.isfunction(function := getattr(flexgear, name)):
            continue
        found = inspect.signature(function).parameters
        assert not {"case", "model"} <= set(found), name


@pytest.fixture(scope="module")
def case():
    return flexgear.load_case("lin-parker")


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda case: flexgear.load_case(3), "load_case(): source: 3 is of the wrong type"),
        (lambda case: flexgear.load_case("lin-parker", planets=5), "unexpected keyword argument"),
        (lambda case: flexgear.load_case("lin-parker", {"stage.planets": "x"}),
         "load_case(): overrides: stage.planets: 'x' is not a whole number"),
        (lambda case: flexgear.assemble("lin-parker"), "assemble(): case: 'lin-parker'"),
        (lambda case: flexgear.assemble(case, rigid=["rim"]), "assemble(): rigid"),
        (lambda case: flexgear.run(case, "out"), "run(): progress: 'out'"),
        (lambda case: flexgear.power_flow(3), "power_flow(): case: 3"),
        (lambda case: flexgear.static(flexgear.assemble(case), "x"), "static(): carrier_angle"),
        (lambda case: flexgear.modes(flexgear.assemble(case), limit_hz="a"), "modes(): limit_hz"),
    ],
)  # fmt: skip
def test_a_wrong_argument_is_one_line_that_names_it(case, call, line):
    with pytest.raises(flexgear.InputError) as fault:
        call(case)
    assert str(fault.value).startswith("flexgear.") and line in str(fault.value)
    assert "\n" not in str(fault.value) and "--" not in str(fault.value).replace(" -- ", "")


def test_cases_and_models_are_shown_in_a_line(case):
    model = flexgear.assemble(case)
    for shown in (repr(case), repr(model)):
        assert "lin-parker" in shown and len(shown) < 300
    assert "<td>lin-parker</td>" in model._repr_html_()
