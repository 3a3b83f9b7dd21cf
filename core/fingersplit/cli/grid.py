"""The command ``fingersplit grid``: every protocol over a set of objects, as one table."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import typer
from rich.table import Table

from fingersplit.cli.output import JsonOutput, new_table, progress_bar
from fingersplit.errors import SettingsError
from fingersplit.result.plan import PlanResult
from fingersplit.result.verification import Verification

__all__ = ["grid"]

NONE_HELD = 1
"""Exit code."""


@dataclass(frozen=True)
class _Row:
    """A grasp of one object: the object, the rank, and its report by protocol."""

    name: str
    rank: int
    mass: float
    reports: dict[str, Verification]

    def to_dict(self) -> dict[str, Any]:
        from fingersplit.result.wire import to_dict

        reports = {name: to_dict(report) for name, report in self.reports.items()}
        return {"object": self.name, "rank": self.rank, "mass": self.mass, "verifications": reports}


def grid(
    files: Annotated[
        list[Path], typer.Argument(help="Files of objects, planned for here.", exists=True, dir_okay=False)
    ],
    hand: Annotated[str, typer.Option(help="Name, folder or zip of the hand.")] = "barrett",
    unit: Annotated[str, typer.Option(help="Unit of the files: m, mm, cm or in.")] = "m",
    protocol: Annotated[list[str] | None, typer.Option(help="Only this protocol; repeatable.")] = None,
    controller: Annotated[
        str, typer.Option(help="position_servo or joint_torque, which execute the published grip, or virtual_frame.")
    ] = "position_servo",
    top: Annotated[int, typer.Option(help="How many of the ranked grasps of each object.", min=1)] = 1,
    starts: Annotated[int, typer.Option(help="Starts of each search.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Seed of each search.", min=0)] = 0,
    friction: Annotated[
        float | None, typer.Option(help="Sliding friction in the simulation; default: the planned one.", min=0.0)
    ] = None,
    table: Annotated[
        bool, typer.Option("--table", help="The objects stand on a table, which pick and noisy_pick need.")
    ] = False,
    threads: Annotated[int, typer.Option(help="Threads that plan and verify.", min=1)] = 2,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write every report here; - for standard output.")
    ] = None,
) -> None:
    """Plan for every object, run every protocol on the best grasps, and print one grid.

    A cell says whether the grasp held and how far the object slipped [mm], or why it did not hold.
    """
    from fingersplit.verification.protocols import available_protocols, load_protocol

    output = JsonOutput(json_file)
    needs_scene = () if table else ("pick", "noisy_pick")
    names = protocol or [name for name in available_protocols() if name not in needs_scene]
    for name in names:
        load_protocol(name)
        if name in needs_scene:
            raise SettingsError(f"Protocol {name!r} needs a support that the objects rest on; add --table.")
    rows: list[_Row] = []
    with progress_bar() as report:
        for number, file in enumerate(files):
            report(file.stem, number / len(files))
            rows += _rows(file, hand, unit, names, controller, top, starts, seed, friction, table, threads)
    output.console.print(_table(names, rows))
    output.write({"protocols": names, "grasps": [row.to_dict() for row in rows]}, "the reports")
    if not any(report.passed for row in rows for report in row.reports.values()):
        raise typer.Exit(NONE_HELD)


def _rows(
    file: Path,
    hand_source: str,
    unit: str,
    names: Sequence[str],
    controller: str,
    top: int,
    starts: int,
    seed: int,
    friction: float | None,
    table: bool,
    threads: int,
) -> list[_Row]:
    """The best grasps of one object, each with its reports."""
    from fingersplit.cli.scenes import read_constraints
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.planning.planning import plan
    from fingersplit.verification import verify_ranked

    model, hand = load_object(file, unit=unit), load_hand(hand_source)
    constraints = read_constraints(None, table, [])
    result = plan(model, hand, starts=starts, seed=seed, top_k=top, constraints=constraints, threads=threads)
    active, pieces = result.active_grip(hand), decompose(model.mesh)

    def verified(one: PlanResult, name: str) -> Verification | None:
        options = {"protocol": name, "controller": controller, "friction": friction}
        return verify_ranked(one, model, active, pieces, verified=1, **options).grasps[0].verification  # type: ignore[arg-type]

    rows = []
    for grasp in result.grasps:
        alone = replace(result, grasps=(grasp,))
        found = {name: verified(alone, name) for name in names}
        reports = {name: report for name, report in found.items() if report is not None}
        rows.append(_Row(file.stem, grasp.rank, model.mass, reports))
    return rows


def _table(names: Sequence[str], rows: Sequence[_Row]) -> Table:
    columns = {"object": "left", "rank": "right", "kg": "right"} | dict.fromkeys(names, "left")
    table = new_table("held, and slip in mm", columns)
    for row in rows:
        table.add_row(row.name, str(row.rank), f"{row.mass:.3f}", *(_cell(row.reports.get(name)) for name in names))
    table.add_section()
    table.add_row("held", "", "", *(_share(rows, name) for name in names))
    table.add_row("median slip", "", "", *(_slip(rows, name) for name in names))
    return table


def _cell(report: Verification | None) -> str:
    if report is None:
        return ""
    if not report.passed:
        return report.reason.replace("_", " ")
    return "yes" if report.slip is None else f"yes {1e3 * report.slip:.1f}"


def _share(rows: Sequence[_Row], name: str) -> str:
    reports = [row.reports[name] for row in rows if name in row.reports]
    return f"{sum(report.passed for report in reports)}/{len(reports)}"


def _slip(rows: Sequence[_Row], name: str) -> str:
    slips = [row.reports[name].slip for row in rows if name in row.reports]
    known = [slip for slip in slips if slip is not None]
    return f"{1e3 * median(known):.1f}" if known else ""
