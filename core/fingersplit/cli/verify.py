"""The command ``fingersplit verify``: stored grasps are simulated again, whoever planned them."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from fingersplit.errors import ExchangeError, SettingsError

__all__ = ["named_values", "verify_stored"]


def verify_stored(
    result: Annotated[
        Path,
        typer.Argument(
            help="Result document (.json), DexGraspBench sample (.npy) or Isaac grasp file (.yaml).",
            exists=True,
            dir_okay=False,
        ),
    ],
    mesh: Annotated[Path, typer.Option("--object", help="The object's mesh file.", exists=True, dir_okay=False)],
    unit: Annotated[str, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = "m",
    hand: Annotated[str, typer.Option(help="Hand of the grasps, where the file does not say.")] = "barrett",
    protocol: Annotated[str, typer.Option(help="What is done with the held object.")] = "lift",
    number: Annotated[
        list[str] | None, typer.Option(help="A number of the protocol as NAME=VALUE, such as height=0.1; repeatable.")
    ] = None,
    controller: Annotated[str, typer.Option(help="virtual_frame, or squeeze for position-controlled hands.")] = (
        "virtual_frame"
    ),
    friction: Annotated[
        float | None, typer.Option(help="Sliding friction in the simulation; default: the planned one.", min=0.0)
    ] = None,
    planned_friction: Annotated[
        float | None, typer.Option(help="What the grip is planned for; default: as the file says, or 0.6.", min=0.01)
    ] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the object [kg]; default: as planned.")] = None,
    rank: Annotated[int | None, typer.Option(help="Only the grasp at this place of the file, from 1.", min=1)] = None,
    initial: Annotated[bool, typer.Option(help="Verify the initial parallel grasps, too.")] = False,
    threads: Annotated[int, typer.Option(help="Directions simulated at a time.", min=1)] = 2,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the reports here; - for standard output.")
    ] = None,
) -> None:
    """Simulate stored grasps in MuJoCo and say which hold, and why others do not."""
    from fingersplit.contacts.friction import planned_friction as decide_friction
    from fingersplit.formats.stored_grasps import HandState, grasp_at, read_stored_grasps
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.verification import verify
    from fingersplit.verification.protocols import load_protocol

    preset = load_protocol(protocol, named_values(number or []))
    stored = read_stored_grasps(result, hand)
    model = load_object(mesh, unit=unit, scale=stored.object_scale)
    if stored.object_id not in (None, model.id):
        raise ExchangeError(
            f"{mesh.name} is not the object of the result: its id is {model.id}, not {stored.object_id}."
        )
    if rank is not None and rank > len(stored.grasps):
        raise SettingsError(f"rank is {rank}; {result.name} has {len(stored.grasps)} grasps.")
    chosen = stored.grasps if rank is None else stored.grasps[rank - 1 : rank]
    pieces = decompose(model.mesh)
    grip_friction = decide_friction(planned_friction, stored.friction)

    def report(state: HandState) -> dict[str, Any]:
        grasp = grasp_at(model, stored.hand, state)
        return verify(
            grasp,
            stored.hand,
            model,
            pieces,
            preset,
            friction=grip_friction if friction is None else friction,
            planned_friction=grip_friction,
            mass=mass,
            controller=controller,
            threads=threads,
        ).to_document()

    rows: list[dict[str, Any]] = [
        {
            "name": grasp.name,
            "verification": report(grasp.final),
            "initial_verification": report(grasp.initial) if initial and grasp.initial else None,
        }
        for grasp in chosen
    ]
    document = {"hand": stored.hand.name, "object": model.to_document(), "grasps": rows}
    to_stdout = json_file is not None and str(json_file) == "-"
    if to_stdout:
        typer.echo(json.dumps(document, indent=2))
    elif json_file is not None:
        json_file.write_text(json.dumps(document, indent=2) + "\n")
    Console(stderr=to_stdout).print(_table(f"{mesh.stem}, {stored.hand.name}, {protocol}", rows))
    if not any(row["verification"]["passed"] for row in rows):
        raise typer.Exit(1)


def named_values(pairs: list[str]) -> dict[str, Any]:
    """Values by name from ``NAME=VALUE`` texts.

    Raises:
        SettingsError: A text of another form.
    """
    values = {}
    for pair in pairs:
        name, separator, text = pair.partition("=")
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            if not separator or not text.isidentifier():
                message = f"Setting {pair!r} is not NAME=VALUE with a number, true, false or a word."
                raise SettingsError(message) from None
            values[name] = text
    return values


def _table(title: str, rows: list[dict[str, Any]]) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD, collapse_padding=True, pad_edge=False)
    for heading in ("grasp", "verdict", "moved mm", "turned deg", "initial grasp", "why"):
        table.add_column(heading, justify="left" if heading in ("grasp", "why") else "right", no_wrap=heading != "why")
    for row in rows:
        report, first = row["verification"], row["initial_verification"]
        phases = [phase for branch in report["branches"] for phase in branch["phases"]]
        table.add_row(
            row["name"],
            "held" if report["passed"] else "failed",
            f"{1e3 * max(phase['displacement'] for phase in phases):.1f}" if phases else "",
            f"{57.2958 * max(phase['rotation'] for phase in phases):.1f}" if phases else "",
            "" if first is None else first["reason"].replace("_", " "),
            report["explanation"],
        )
    return table
