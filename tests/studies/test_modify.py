"""Proposed flanks: better than before by the very case that they are copied into."""

import tomllib

import pytest
from train_contexts import rigid_stage
from trains import spur_pair, write

from flexgear.cli.modify_command import keys_to_copy
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.results.face_load import face_figures
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from flexgear.studies.modify import propose_modifications

CASE = load_case("wind-5mw").with_(
    **{"stage.gear_mesh.model": "face_load", "stage.gear_mesh.slices": 9}
)


@pytest.fixture(scope="module")
def model():
    return rigid_stage(CASE)


@pytest.fixture(scope="module")
def proposal(model):
    return propose_modifications(model, "stage", trials=25)


AXES = 'teeth = {}, kinematics = "torsional"'


def worst(figures, kind, key):
    return max(one[key] for name, one in figures.items() if f" {kind} " in name)


def test_proposed_flanks_even_out_the_load(proposal):
    before, after = proposal.before[1.0], proposal.after[1.0]
    assert worst(before, "ring", "k_h_beta") > 1.5
    assert worst(after, "ring", "k_h_beta") < 1.25
    for kind in ("ring", "sun"):
        key = "largest_line_load_n_per_mm"
        assert worst(after, kind, key) < worst(before, kind, key)


def test_the_keys_to_copy_give_the_figures_of_the_search(proposal):
    """The case with the keys, read and put together anew, has the figures of the search."""
    text = tomllib.loads(keys_to_copy(CASE, "stage", proposal))
    ground = {
        f"stage.planet.modifications.{flank}.{key.removesuffix('_um')}": 1e-6 * amount
        for flank, keys in text["stage"]["planet"]["modifications"].items()
        for key, amount in keys.items()
    }
    assert len(ground) == 4
    model = rigid_stage(CASE.with_(**ground))
    turn = proposal.data[1]["input_angle"].to_numpy()[:, 0]
    again = face_figures(static(model, turn))
    for name, one in proposal.after[1.0].items():
        assert again[name]["k_h_beta"] == pytest.approx(one["k_h_beta"], rel=1e-6), name


def test_a_stage_whose_pairs_are_one_spring_is_refused():
    model = rigid_stage(load_case("wind-5mw"))
    with pytest.raises(
        InputError, match=r"stage.gear_mesh.model: is 'per_pair', which knows no load"
    ):
        propose_modifications(model, "stage")


def test_relief_of_the_case_keeps_its_start_and_form():
    """Its amount is sought where it begins already; the keys say so, and give what was said."""
    ring = {"amount": 20e-6, "start_diameter": 0.62, "form": "linear"}
    has = CASE.with_(**{"stage.planet.modifications.ring.tip_relief": ring})
    proposal = propose_modifications(rigid_stage(has), "stage", relief=True, trials=4)
    keys = tomllib.loads(keys_to_copy(has, "stage", proposal))["stage"]["planet"]["modifications"]
    old, new = (keys[flank]["tip_relief"] for flank in ("ring", "sun"))
    assert (old["start_diameter_mm"], old["form"]) == (620, "linear")
    assert (new["length_mm"], new["form"]) == (1e3 * has.stages[0].normal_module, "parabolic")
    assert "length_mm" not in old


def spur_proposal(folder, aim, **amounts):
    """Proposal for two aligned spur gears on rigid axes, and their case."""
    case = load_case(
        write(folder, spur_pair(AXES.format(30), AXES.format(60), 'model = "face_load"')),
        overrides={f"stages.stage_1.gear.modifications.{k}": v for k, v in amounts.items()},
    )
    return case, propose_modifications(assemble(case), "stage_1", aim=aim, relief=True, trials=20)


def test_crowning_that_only_harms_is_taken_out_whole(tmp_path):
    """Aligned gears on rigid axes carry most evenly without slope and crowning: these become zero,
    not a fraction of a micrometre below it, and the case takes the keys."""
    relief = {"amount_um": 5.7, "length_mm": 3}
    case, proposal = spur_proposal(tmp_path, "line-load", lead_crowning_um=3.7, tip_relief=relief)
    assert list(proposal.amounts.values())[:2] == [0.0, 0.0]
    keys = tomllib.loads(keys_to_copy(case, "stage_1", proposal))["stages"]["gear"]["modifications"]
    again = load_case(
        write(tmp_path, spur_pair(AXES.format(30), AXES.format(60), 'model = "face_load"')),
        overrides={"stages.stage_1.gear.modifications": keys},
    )
    figures = face_figures(static(assemble(again), proposal.data[1]["input_angle"][:, 0].values))
    assert figures["stage_1 pinion 1 drive"]["k_h_beta"] == pytest.approx(1.0, abs=1e-6)


def test_flanks_stay_as_they_are_where_nothing_is_gained(tmp_path):
    """Relief of one module on one gear leaves part of double contact as stiff as it was, so the
    peak-to-peak transmission error of spur gears does not fall."""
    _, proposal = spur_proposal(tmp_path, "transmission-error")
    assert list(proposal.amounts.values()) == [0.0, 0.0, 0.0]
