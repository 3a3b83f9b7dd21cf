"""Which object plays which of the paper's ten grasps, and from which side the hand comes."""

from pathlib import Path
from statistics import mean

import numpy as np
import pytest

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit_bench.cases import PAPER_CASES, Case, cases_of, parallel_grasps_of
from fingersplit_bench.objects import benchmark_objects
from fingersplit_bench.sections import SECTIONS, chosen_sections, run_sections
from fingersplit_bench.suite import Bench, BenchError, Chapter

SHARED = ("apple", "bunny", "cat", "koala", "mug", "mug_dense", "polygons", "rubber_duck", "screwdriver")


def bench_of(names, barrett, folder: Path = Path()) -> Bench:
    objects = {name: PARAMETRIC_OBJECTS.get(name, PARAMETRIC_OBJECTS["sphere"]) for name in names}
    return Bench(objects, barrett, folder, repeats=1, starts=4, note=lambda text: None)


def test_published_rows_are_those_of_table_one():
    assert len(PAPER_CASES) == 10
    assert mean(case.published.run_ms for case in PAPER_CASES) == pytest.approx(582.1, abs=0.1)
    assert mean(case.published.rounds for case in PAPER_CASES) == pytest.approx(4.2)


@pytest.mark.parametrize("names", [SHARED, tuple(PARAMETRIC_OBJECTS)])
def test_all_ten_are_played_by_public_and_by_parametric_objects(barrett, names):
    played = cases_of(bench_of(names, barrett))
    assert [case for case, _ in played] == list(PAPER_CASES)
    assert {name for _, name in played} <= set(names)
    assert len({(name, case.side) for case, name in played}) == 10


def test_dense_mug_is_preferred(barrett):
    assert {case.name: name for case, name in cases_of(bench_of(SHARED, barrett))}["Mug"] == "mug_dense"


def test_foreign_objects_are_cases_of_their_own(barrett):
    assert [(case.name, case.side, name) for case, name in cases_of(bench_of(["spoon", "fork"], barrett))] == [
        ("spoon", "above", "spoon"),
        ("fork", "above", "fork"),
    ]


@pytest.mark.parametrize(
    ("approach", "sides"),
    [((0, 0, -1), {"above"}), ((0, 0.6, 0.8), {"below"}), ((0, 1, 0), {"beside"}), ((0, 0.9, -0.3), {"beside"})],
)
def test_side_is_where_the_hand_comes_from(approach, sides):
    grasp = ParallelGrasp(np.array([[0.03, 0, 0], [-0.03, 0, 0]]), np.array(approach, dtype=float))
    assert {side for side in ("above", "below", "beside") if Case("x", (), side, None).comes_from(grasp)} == sides


def test_parallel_grasps_of_a_case_come_from_its_side(barrett):
    bench = bench_of(["sphere"], barrett)
    cases = [Case("ball", ("sphere",), side, None) for side in ("above", "below")]
    above, below = (parallel_grasps_of(bench, case, "sphere") for case in cases)
    assert above
    assert below
    assert all(grasp.approach[2] <= -0.5 for grasp in above)
    assert all(grasp.approach[2] >= 0.5 for grasp in below)
    assert bench.model("sphere") is bench.model("sphere")


def test_objects_come_from_the_folder_or_are_our_own(tmp_path, monkeypatch):
    PARAMETRIC_OBJECTS["sphere"]().trimesh.export(tmp_path / "ball.ply")
    (tmp_path / "notes.txt").write_text("no mesh")
    assert set(benchmark_objects(tmp_path)) == {"ball"}
    assert len(benchmark_objects(tmp_path)["ball"]().faces) == len(PARAMETRIC_OBJECTS["sphere"]().faces)
    monkeypatch.setenv("FINGERSPLIT_OBJECTS", str(tmp_path))
    assert set(benchmark_objects(None)) == {"ball"}
    (tmp_path / "empty").mkdir()
    monkeypatch.setenv("FINGERSPLIT_OBJECTS", str(tmp_path / "empty"))
    assert set(benchmark_objects(None)) == set(PARAMETRIC_OBJECTS)
    with pytest.raises(BenchError, match=r"holds no mesh; files that are read: \.glb"):
        benchmark_objects(tmp_path / "empty")


def test_sections_are_chosen_by_name_in_the_order_of_the_report():
    assert chosen_sections([]) == list(SECTIONS)
    assert chosen_sections(["ipopt", "planner", "planner"]) == ["planner", "ipopt"]
    with pytest.raises(BenchError, match="Unknown section 'speed'; known sections: planner"):
        chosen_sections(["speed"])


def test_section_without_its_package_is_left_out_unless_it_was_asked_for(monkeypatch, barrett):
    monkeypatch.setitem(SECTIONS, "exotic", "package_that_nobody_has:measure")
    monkeypatch.setitem(SECTIONS, "simple", f"{__name__}:chapter_of")
    monkeypatch.setattr("fingersplit_bench.sections.resolve_name", resolve_here)
    bench = bench_of(["sphere"], barrett)
    chapters, left_out = run_sections(bench, ["exotic", "simple"], required=False)
    assert chapters["simple"].text == "1 objects"
    assert "It needs package_that_nobody_has" in left_out["exotic"]
    with pytest.raises(BenchError, match=r"Section 'exotic' cannot run\. It needs package_that_nobody_has"):
        run_sections(bench, ["exotic"], required=True)


def chapter_of(bench: Bench) -> Chapter:
    return Chapter("Simple", f"{len(bench.objects)} objects")


def resolve_here(name: str):
    if name.startswith("package"):
        raise ModuleNotFoundError(name="package_that_nobody_has")
    return chapter_of
