"""The public interface: its names, its documentation, and that a program needs nothing else."""

import inspect

import pytest

import fingersplit as fs

NAMES = sorted(set(fs.__all__) - {"__version__"})


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_is_documented(name):
    assert inspect.getdoc(getattr(fs, name))


def test_every_public_name_is_listed_once():
    assert sorted(fs._HOME) == NAMES
    assert dir(fs) == sorted(fs.__all__)


def test_an_unknown_name_lists_the_public_ones():
    with pytest.raises(AttributeError, match=r"no attribute 'plann'; public names: .*plan"):
        _ = fs.plann


def test_a_program_needs_the_public_names_alone(tmp_path):
    from fingersplit.objects.parametric import box

    box().trimesh.export(tmp_path / "box.stl")
    hand = fs.load_hand("barrett")
    model = fs.load_object(tmp_path / "box.stl", unit="m", options=fs.ObjectOptions(mass=0.2))
    result = fs.plan(model, hand, starts=8, seed=1, top_k=2, settings=fs.PlannerSettings(pad_angle_limit=0.5))
    assert isinstance(result, fs.PlanResult)
    assert result.feasible
    fs.write_result(result, tmp_path / "box.json")
    again = fs.read_result(tmp_path / "box.json")
    assert again == result
    assert fs.export(again, "isaac_grasp")
    assert fs.replay(again, 1, model, hand).grasp == result.grasps[0]
