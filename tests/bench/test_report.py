"""Tables, figures and the report on hand-made rows."""

import json

import pytest

from fingersplit_bench.ipopt.section import table_three
from fingersplit_bench.machine import describe_machine
from fingersplit_bench.paper_tables import gain_table, table_one, table_two
from fingersplit_bench.profiles import METRICS
from fingersplit_bench.published import compare_with_published
from fingersplit_bench.report import FIGURES, to_document, to_markdown
from fingersplit_bench.suite import Chapter, Figure, table

MACHINE = {
    "cpu": "Abacus 3000",
    "cores": 2,
    "load_average": 0.5,
    "system": "Linux",
    "python": "3.11",
    "versions": {"numpy": "2.1", "casadi": None},
}
RUN = {"objects": 2, "starts": 8, "repeats": 1, "cpu_share": 0.5}


def run_row(**changes: float) -> dict:
    stages = {"CPO": [0.1, 0.2, 0.3], "PPO": [0.01, 0.02, 0.03]}
    return {"runs": 8, "feasible": 6, "rounds": 3, "cpo": 40, "ppo": 20, "run_ms": 1.5, "stage_ms": stages} | changes


def case_row(**changes: object) -> dict:
    row = {"case": "Mug", "object": "mug", "side": "above", "vertices": 8188, "published": None}
    return row | {"paper": run_row(), "default": run_row(run_ms=0.25)} | changes


def cells(markdown: str, first: str) -> list[str]:
    """The row of a Markdown table that begins with ``first``."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in markdown.splitlines()]
    return next(row for row in rows if row[0] == first)


def test_table_is_markdown_with_numbers_to_the_right():
    assert table(["a", "b"], [["x", "1"]]) == "| a | b |\n| :-- | --: |\n| x | 1 |"
    assert table(["a", "b"], [], left=2) == "| a | b |\n| :-- | :-- |"


def test_figure_is_median_and_quartiles():
    figure = Figure.of([5, 1, 2, 4, 3], "ms", "Something.", other=7.0)
    assert (figure.low, figure.value, figure.high, figure.runs) == (2, 3, 4, 5)
    assert figure.to_document()["beside"] == {"other": 7.0}


def test_table_one_has_our_figures_and_the_published_ones_in_brackets():
    published = {"rounds": 5, "cpo": 90, "ppo": 22, "run_ms": 1257.3, "vertices": 185_511}
    other = case_row(case="Ball", paper=run_row(rounds=1, cpo=20, run_ms=0.5), vertices=100)
    markdown = table_one([case_row(published=published), other])
    assert cells(markdown, "Mug") == [
        "Mug", "mug, above", "3.0 (5.0)", "40/20 (90/22)", "1.50 (1257)", "6/8", "8,188 (185,511)"
    ]  # fmt: skip
    assert cells(markdown, "Ball") == ["Ball", "mug, above", "1.0", "20/20", "0.50", "6/8", "100"]
    assert cells(markdown, "**mean**")[2:] == [
        "2.0 (5.0)", "30/20 (90/22)", "1.00 (1257)", "12/16", "4,144 (185,511)"
    ]  # fmt: skip


def test_table_two_adds_up():
    markdown = table_two([case_row(), case_row()])
    assert cells(markdown, "paper, CPO")[1:] == ["0.100", "0.200", "0.300", "0.600"]
    assert cells(markdown, "paper, both")[1:] == ["0.110", "0.220", "0.330", "0.660"]
    assert cells(markdown, "published, CPO")[1:] == ["37.0", "326.9", "29.0", "392.9"]
    assert cells(markdown, "published, both")[-1] == "582.1"


def test_gains_are_medians_of_both_ends_and_how_many_rose():
    up, down = ({metric: [0.1, ends, ends] for metric in METRICS} for ends in (0.3, 0.05))
    assert cells(gain_table([up, up, down]), "Q_iso") == ["Q_iso", "0.1", "0.3", "2 of 3"]


def test_table_three_counts_what_is_feasible():
    row = {
        "case": "Bunny",
        "object": "bunny",
        "starts": 8,
        "ipopt": {"ms": 200, "quality": 0.005, "feasible": 1, "converged": 7},
        "paper": {"ms": 1.5, "quality": 0.004, "feasible": 5},
        "default": {"ms": 0.25, "quality": 0.0041, "feasible": 6},
    }
    assert cells(table_three([row]), "Bunny (bunny)")[1:] == [
        "200.00", "1.50", "0.25", "5.00", "4.00", "4.10", "1 / 5 / 6 of 8", "7 of 8"
    ]  # fmt: skip


def test_published_planners_stand_beside_ours():
    figures = {"feasible_per_second": Figure.of([1234], "1/s", ""), "best_of_64_ms": Figure.of([42], "ms", "")}
    markdown = compare_with_published(figures, 64)
    assert "1,234 feasible grasps/s, 42 ms for a ranked best of 64" in cells(markdown, "this run")
    for planner, claim in (("[Fan2018]", "582 ms"), ("FRoGGeR", "0.41 s"), ("BODex", "50"), ("Lightning", "300-1000")):
        assert any(planner in line and claim in line for line in markdown.splitlines())


def test_report_has_a_row_for_every_figure_and_a_chapter_for_every_section():
    figure = Figure.of([0.9, 1.1], "ms", "One run.", other_way=2345.6)
    chapters = {"paper": Chapter("The paper", "Its text.", {"paper_run_ms": figure}, {"cases": [1]})}
    left_out = {"ipopt": "It needs casadi."}
    text = to_markdown(MACHINE, RUN, chapters, left_out)
    assert "Abacus 3000; 2 cores" in text
    assert "numpy 2.1" in text
    assert "50% of a core" in text
    assert "casadi None" not in text
    assert cells(text, "`paper_run_ms`")[1:] == [
        "**1** ms", "median", "0.95 to 1.05 (2)", FIGURES["paper_run_ms"], "One run. Other way 2,346."
    ]  # fmt: skip
    for key in set(FIGURES) - {"paper_run_ms"}:
        assert cells(text, f"`{key}`")[1] == "not measured"
    assert "## The paper (`paper`)\n\nIts text." in text
    assert "Left out: `ipopt`. It needs casadi." in text


def test_json_document_is_plain_data_with_figures_by_key():
    figure = Figure.of([3.0], "ms", "One run.")
    chapters = {"paper": Chapter("The paper", "", {"paper_run_ms": figure, "unknown": figure}, {"cases": [1]})}
    document = json.loads(json.dumps(to_document(MACHINE, RUN, chapters, {})))
    assert set(document) == {"machine", "run", "figures", "sections", "left_out"}
    assert document["figures"] == {"paper_run_ms": figure.to_document()}
    assert document["sections"] == {"paper": {"cases": [1]}}


def test_machine_is_described():
    machine = describe_machine()
    assert machine["cores"] >= 1
    assert machine["cpu"]
    assert machine["versions"]["numpy"]
    assert json.loads(json.dumps(machine)) == machine


@pytest.mark.parametrize("number", [0.0, 3])
def test_figure_of_one_measurement_has_no_spread(number):
    figure = Figure.of([number], "1", "")
    assert figure.low == figure.value == figure.high == number
