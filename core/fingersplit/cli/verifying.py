"""The command ``fingersplit verify``: stored grasps are simulated again, whoever planned them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

import typer
from rich.table import Table

from fingersplit.cli.output import JsonOutput, new_table, verdict_cells
from fingersplit.cli.values import named_values
from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.result.verification import Verification

if TYPE_CHECKING:
    from fingersplit.objects.convex_pieces import ConvexPieces
    from fingersplit.result.grasp import GraspResult
    from fingersplit.result.plan import PlanResult
    from fingersplit.verification.published import Execution
    from fingersplit.verification.ranked_pick import ResultPicks

__all__ = ["verify_stored"]

NONE_HELD = 1
"""Exit code."""


def verify_stored(
    file: Annotated[
        Path,
        typer.Argument(
            help="Result, or a file of a format whose hand grasps are read; see `fingersplit formats`.",
            exists=True,
            dir_okay=False,
        ),
    ],
    object_file: Annotated[Path, typer.Option("--object", help="The object's file.", exists=True, dir_okay=False)],
    unit: Annotated[
        str | None,
        typer.Option(help="Unit of the object's file, m, mm, cm or in; default: the one of the result, else m."),
    ] = None,
    hand: Annotated[
        str | None,
        typer.Option(help="Name, folder or zip of the hand; default: the one of the result by its name, else barrett."),
    ] = None,
    protocol: Annotated[str, typer.Option(help="What is done with the held object.")] = "lift",
    number: Annotated[
        list[str] | None, typer.Option(help="A number of the protocol as NAME=VALUE, such as height=0.1; repeatable.")
    ] = None,
    controller: Annotated[
        str,
        typer.Option(
            help="position_servo or joint_torque, which execute the published grip, or virtual_frame with its own."
        ),
    ] = "position_servo",
    friction: Annotated[
        float | None, typer.Option(help="Sliding friction in the simulation; default: the planned one.", min=0.0)
    ] = None,
    planned_friction: Annotated[
        float | None,
        typer.Option(help="Plan the grip anew for this friction; default: the grip of the result, else for 0.6."),
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the object [kg]; default: the planned one.")] = None,
    rank: Annotated[int | None, typer.Option(help="Only the grasp at this place of the file, from 1.", min=1)] = None,
    initial: Annotated[bool, typer.Option(help="Verify the initial parallel grasps, too.")] = False,
    obstacle: Annotated[
        list[Path] | None,
        typer.Option(
            help="For pick: file of a mesh or cloud among the obstacles; repeatable.", exists=True, dir_okay=False
        ),
    ] = None,
    threads: Annotated[int, typer.Option(help="Directions simulated at a time.", min=1)] = 2,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the reports here; - for standard output.")
    ] = None,
) -> None:
    """Simulate stored grasps in MuJoCo and say which hold, and why others do not.

    Of a result, unit, viewpoint, mass, friction and options of the object are those it was planned with, and what is
    executed is what it publishes: pre-grasp, joints, squeeze and grip.
    """
    from fingersplit.contacts.friction import planned_friction as decide_friction
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.verification import verify
    from fingersplit.verification.controllers import load_controller
    from fingersplit.verification.protocols import load_protocol
    from fingersplit.verification.protocols.pick import Pick

    output = JsonOutput(json_file)
    preset, chosen_controller = load_protocol(protocol, named_values(number)), load_controller(controller)
    stored = _Stored.read(file, object_file, unit, hand)
    chosen = stored.chosen(rank)
    planned = decide_friction(planned_friction, stored.friction)
    pieces = decompose(stored.model.mesh)

    def report(grasp: Grasp, execution: "Execution | None" = None) -> Verification:
        return verify(
            grasp,
            stored.hand,
            stored.model,
            pieces,
            preset,
            friction=planned if friction is None else friction,
            planned_friction=planned,
            mass=mass,
            controller=chosen_controller,
            execution=execution if planned_friction is None else None,
            threads=threads,
        )

    if isinstance(preset, Pick):
        pick, reachable = stored.picks(pieces, obstacle or []), [one for one in chosen if rank or one.pregrasp]
        rows = [_Row(one.name, pick.verify(one.result, preset, friction), None) for one in reachable if one.result]
    else:
        rows = [
            _Row(
                one.name,
                report(one.final, one.execution),
                report(one.initial) if initial and one.initial is not None else None,
            )
            for one in chosen
        ]
    output.console.print(_table(f"{object_file.stem}, {stored.hand.name}, {protocol}", rows))
    document = {
        "hand": stored.hand.name,
        "object_id": stored.model.id,
        "grasps": [row.to_dict() for row in rows],
    }
    output.write(document, "the reports")
    if not any(row.verification.passed for row in rows):
        raise typer.Exit(NONE_HELD)


@dataclass(frozen=True, eq=False)
class _Named:
    """A grasp to verify: its name in the file, how it is executed and what it began as where the file says so.

    Of a result, also the grasp as it stands there.
    """

    name: str
    final: Grasp
    execution: "Execution | None" = None
    initial: Grasp | None = None
    result: "GraspResult | None" = None

    @property
    def pregrasp(self) -> bool:
        """Whether a straight way in is free."""
        return self.result is not None and self.result.pregrasp is not None


@dataclass(frozen=True, eq=False)
class _Stored:
    """Grasps of a file, with what they were planned for; the friction is None where the file does not say."""

    hand: Hand
    model: ObjectModel
    grasps: tuple[_Named, ...]
    friction: float | None
    result: "PlanResult | None" = None

    def picks(self, pieces: "ConvexPieces", obstacles: Sequence[Path]) -> "ResultPicks":
        """What picks the grasps in the scene that they were planned in.

        Raises:
            SettingsError: The file is no result, so there is no scene and no approach in it.
        """
        from fingersplit.cli.objects import obstacle_files
        from fingersplit.verification.ranked_pick import ResultPicks

        if self.result is None:
            raise SettingsError("Protocol 'pick' needs the scene and the ways of a result, as `plan --json` writes it.")
        return ResultPicks(self.result, self.model, self.hand, pieces, obstacle_files(obstacles))

    @classmethod
    def read(cls, file: Path, object_file: Path, unit: str | None, hand: str | None) -> Self:
        """Read a file by its ending."""
        if file.suffix.lower() == ".json":
            return cls._from_result(file, object_file, unit, hand)
        return cls._from_other_tool(file, object_file, unit or "m", hand or "barrett")

    @classmethod
    def _from_result(cls, file: Path, object_file: Path, unit: str | None, hand: str | None) -> Self:
        from fingersplit.cli.objects import load_origin
        from fingersplit.result import read_result
        from fingersplit.verification.published import Execution

        result = read_result(file)
        planned = result.object.source.unit
        if unit not in (None, planned):
            raise SettingsError(f"{file} was planned with unit {planned!r}, not {unit!r}; leave --unit out.")
        model, known_hand = load_origin(result, object_file, hand)
        grasps = tuple(
            _Named(
                f"rank {one.rank}",
                one.for_hand(known_hand),
                Execution.of_result(one, known_hand),
                one.initial.for_hand(known_hand),
                one,
            )
            for one in result.grasps
        )
        return cls(known_hand, model, grasps, result.friction, result)

    @classmethod
    def _from_other_tool(cls, file: Path, object_file: Path, unit: str, hand: str) -> Self:
        from fingersplit.formats import grasp_at, read_hand_grasps
        from fingersplit.objects.loading import load_object

        found = read_hand_grasps(file, hand)
        model = load_object(object_file, unit=unit, scale=found.object_scale)
        grasps = tuple(_Named(one.name, grasp_at(model, found.hand, one.pose)) for one in found.grasps)
        return cls(found.hand, model, grasps, None)

    def chosen(self, rank: int | None) -> tuple[_Named, ...]:
        """All grasps, or the one at a place of the file."""
        if rank is None:
            return self.grasps
        if rank > len(self.grasps):
            raise SettingsError(f"rank is {rank}; the file has {len(self.grasps)} grasps.")
        return self.grasps[rank - 1 : rank]


@dataclass(frozen=True)
class _Row:
    name: str
    verification: Verification
    initial: Verification | None

    def to_dict(self) -> dict[str, Any]:
        from fingersplit.result.wire import to_dict

        return {
            "name": self.name,
            "verification": to_dict(self.verification),
            "initial_verification": None if self.initial is None else to_dict(self.initial),
        }

    def cells(self) -> Iterator[str]:
        report = self.verification
        yield self.name
        yield from verdict_cells(report)
        yield "" if self.initial is None else self.initial.reason.replace("_", " ")
        yield report.explanation


def _table(title: str, rows: list[_Row]) -> Table:
    right = ("held", "slip mm", "turn deg", "initial grasp")
    table = new_table(title, {"grasp": "left"} | dict.fromkeys(right, "right") | {"why": "left"})
    for row in rows:
        table.add_row(*row.cells())
    return table
