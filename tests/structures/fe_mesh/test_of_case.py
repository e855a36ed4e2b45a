"""From a case to the FE meshes it asks for."""

from pathlib import Path

import pytest

from flexgear.gears.geometry import stage_geometry
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.files import write_fe_mesh
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.planet import source as planet_source
from flexgear.structures.sources.ring import source as ring_source


@pytest.fixture(scope="module")
def case() -> StageView:
    quick = {"solver.fidelity": "quick", "stage.planet.fe.flexible": "true"}
    return load_case("wind-5mw", quick).view()


@pytest.mark.parametrize("shift", [-0.2, 0.0, 0.1])
def test_tooth_equals_the_gear_theory_of_the_same_case(case: StageView, shift: float) -> None:
    shifted = case.with_(
        **{"stage.ring.profile_shift": -shift, "stage.planet.profile_shift": shift,
           "stage.sun.profile_shift": -shift}
    )  # fmt: skip
    theory = stage_geometry(shifted)
    assert ring_source(shifted).parameters.tooth == theory.ring
    assert planet_source(shifted).parameters.tooth == theory.planet


def test_planets_stated_at_equal_angles_have_the_carrier_of_equal_ones(case: StageView) -> None:
    four = case.with_(**{"stage.planets": 4})
    stated = four.with_(**{"stage.planet_positions": four.stage.planet_angles})
    assert carrier_source(stated).parameters == carrier_source(four).parameters


def test_own_files_are_read_and_checked(case: StageView, tmp_path: Path) -> None:
    files = {"ring": "ring.msh", "planet": "planet.vtu", "carrier": "carrier.inp"}
    for name, source in zip(files, (ring_source, planet_source, carrier_source), strict=True):
        write_fe_mesh(source(case).fe_mesh(), tmp_path / files[name])
    with_files = case.with_(
        **{
            f"stage.{name}.fe.fe_mesh{key}": value
            for name, file in files.items()
            for key, value in (("_file", str(tmp_path / file)), ("", "file"), ("_unit", "m"))
        }
    )
    for body in (ring_source(with_files), planet_source(with_files), carrier_source(with_files)):
        assert set(body.groups.needed) <= set(body.fe_mesh().facets)
    with pytest.raises(InputError, match='set fe_mesh_unit = "m"'):
        ring_source(with_files.with_(**{"stage.ring.fe.fe_mesh_unit": "mm"})).fe_mesh()
    with pytest.raises(InputError, match="25 of 120 missing"):
        ring_source(with_files.with_(**{"stage.ring.fe.bolts.holes": True})).fe_mesh()
    with pytest.raises(InputError, match=r"ring\.fe\.fe_mesh_file.*no such file"):
        ring_source(
            with_files.with_(**{"stage.ring.fe.fe_mesh_file": str(tmp_path / "none.msh")})
        ).fe_mesh()
