"""The command ``fingersplit plan``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fingersplit.cli.output import JsonOutput, check_writable, new_table, progress_bar, verdict_cells
from fingersplit.cli.values import named_values
from fingersplit.result.plan import PlanResult

__all__ = ["plan", "result_table"]

NO_FEASIBLE_GRASP = 1
"""Exit code."""


def plan(
    file: Annotated[
        Path,
        typer.Argument(
            help="Mesh (STL, OBJ, PLY, OFF, GLB) or point cloud (PLY, PCD, NPZ).", exists=True, dir_okay=False
        ),
    ],
    hand: Annotated[
        str, typer.Option(help="Hand to plan for: a name of `fingersplit hands`, a folder or a zip.")
    ] = "barrett",
    starts: Annotated[int, typer.Option(help="Most runs of the finger splitting.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Seed of every random choice.", min=0)] = 0,
    unit: Annotated[str, typer.Option(help="Unit of the file: m, mm, cm or in.")] = "m",
    scale: Annotated[float, typer.Option(help="Multiplies the file's numbers, beside the unit.")] = 1.0,
    density: Annotated[float | None, typer.Option(help="Density of the object [kg/m^3].")] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the object [kg], instead of a density.")] = None,
    friction: Annotated[float | None, typer.Option(help="Coulomb friction between the object and the pads.")] = None,
    fairing: Annotated[
        float, typer.Option(help="Smooth a noisy mesh: wavelength that is attenuated by half [m].")
    ] = 0.0,
    viewpoint: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the camera stood that saw the point cloud, in the file's frame and unit."),
    ] = None,
    support: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option(
            help="Plane that the object of a point cloud stands on, in the file's frame and unit: normal on its side "
            "and offset along it. The side that one view did not see is then assumed."
        ),
    ] = None,
    complete: Annotated[
        bool,
        typer.Option(
            help="Assume the side of an object that one view did not see, where the scene has its pose and what it "
            "stands on; contacts may lie there."
        ),
    ] = True,
    top_k: Annotated[int, typer.Option(help="Most grasps to return.", min=1)] = 10,
    parallel_grasps: Annotated[
        Path | None,
        typer.Option(
            help="Start from the parallel grasps of this file instead; see `fingersplit formats`.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    grasp_format: Annotated[
        str | None, typer.Option("--format", help="Format of that file; by its content when left out.")
    ] = None,
    gripper: Annotated[
        str | None,
        typer.Option(help="Gripper that the grasps of that file are for, such as panda; as it says by default."),
    ] = None,
    grasp_scale: Annotated[float, typer.Option(help="Factor from the lengths of that file to metres.")] = 1.0,
    source: Annotated[
        str, typer.Option(help="Where parallel grasps are found; see `fingersplit sources`.")
    ] = "antipodal",
    scene: Annotated[
        Path | None,
        typer.Option(
            help="JSON file with scene, approach, contact_regions, task and end_effector; an obstacle's object_id is "
            "the path of a mesh or cloud in metres, relative to this file.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    table: Annotated[
        bool, typer.Option("--table", help="The object rests on a table, as the scene has it or most stably.")
    ] = False,
    approach: Annotated[
        list[str] | None,
        typer.Option(help="Direction of travel with an angle in degrees, such as down:35 or +x:20; repeatable."),
    ] = None,
    rank_by: Annotated[
        str,
        typer.Option(help="Order of the grasps: p_hold, the probability of holding when executed, or holding_margin."),
    ] = "p_hold",
    simulation_budget: Annotated[
        float, typer.Option(help="Time to simulate the best grasps for their p_hold [ms]; 0 only estimates it.", min=0)
    ] = 0.0,
    refine: Annotated[bool, typer.Option(help="Improve the best grasps for holding by small moves.")] = False,
    position_noise: Annotated[
        float | None,
        typer.Option(help="How far the object is from where it is thought to be, rms [m]; default 0.005."),
    ] = None,
    rotation_noise: Annotated[
        float | None, typer.Option(help="How far it is turned, rms [rad]; default 0.087.")
    ] = None,
    setting: Annotated[
        list[str] | None, typer.Option(help="Planner setting as NAME=VALUE, such as pad_angle_limit=0.5; repeatable.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the result here; - for standard output.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Write a PNG of the best grasp here.")] = None,
    recording: Annotated[
        Path | None, typer.Option(help="Record how the best grasp was found here, .rrd; see `fingersplit review`.")
    ] = None,
    verified: Annotated[int, typer.Option(help="Verify ranked grasps in MuJoCo until so many hold.", min=0)] = 0,
    protocol: Annotated[
        str, typer.Option(help="What is done with the held object; see `fingersplit verify`.")
    ] = "lift",
    controller: Annotated[
        str,
        typer.Option(
            help="position_servo or joint_torque, which execute the published grip, or virtual_frame with its own."
        ),
    ] = "position_servo",
    simulated_friction: Annotated[
        float | None,
        typer.Option(
            help="Friction in the simulation, default: the planned one. Grip forces use the planned friction.", min=0
        ),
    ] = None,
    initial: Annotated[bool, typer.Option(help="Verify the initial parallel grasps, too.")] = False,
) -> None:
    """Plan grasps for a mesh or a point cloud and print them, best first."""
    from fingersplit.cli.objects import known_obstacles
    from fingersplit.cli.scenes import read_constraints, support_in_file
    from fingersplit.contacts.friction import without_friction
    from fingersplit.formats.importing import import_parallel_grasps
    from fingersplit.formats.registry import formats_that, known_format
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.source import ObjectSource
    from fingersplit.parallel_grasps.sources import load_source
    from fingersplit.planning.planning import plan as plan_grasps
    from fingersplit.robustness.noise import NoiseModel
    from fingersplit.robustness.ranking_order import RankingOrder
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification import verify_ranked
    from fingersplit.verification.controllers import load_controller
    from fingersplit.verification.protocols import load_protocol

    output = JsonOutput(json_file)
    check_writable(picture, recording)
    load_source(source)
    if grasp_format is not None:
        known_format(grasp_format, formats_that("read_parallel"))
    options = ObjectOptions(density=density, mass=mass, friction=friction, fairing=fairing)
    named, requested_friction = without_friction(named_values(setting))
    settings, planned_hand = PlannerSettings.from_document(named), load_hand(hand)
    constraints = read_constraints(scene, table, approach or [])
    ranking = RankingOrder(rank_by, NoiseModel.of(position_noise, rotation_noise), simulation_budget / 1e3)
    chosen_protocol, chosen_controller = load_protocol(protocol), load_controller(controller)
    with progress_bar() as report:
        report("preparing the object", 0.0)
        source_of_file = ObjectSource(unit, scale, viewpoint, support)
        if not complete:
            support = None
        elif support is None:
            support = support_in_file(constraints.scene, source_of_file, file)
        model = load_object(file, unit=unit, scale=scale, viewpoint=viewpoint, support=support, options=options)
        imported = None
        if parallel_grasps is not None:
            imported = import_parallel_grasps(parallel_grasps, model, grasp_format, gripper=gripper, scale=grasp_scale)
        result = plan_grasps(
            model,
            planned_hand,
            None if imported is None else imported.grasps,
            source=source,
            starts=starts,
            seed=seed,
            top_k=top_k,
            settings=settings,
            friction=requested_friction,
            constraints=constraints,
            ranking=ranking,
            refine=refine,
            threads=1 if not simulation_budget else 2,
            progress=report,
        )
        if verified:
            report("convex pieces", 0.0)
            pieces = decompose(model.mesh)
            report("verifying", 0.0)
            result = verify_ranked(
                result,
                model,
                planned_hand,
                pieces,
                verified=verified,
                protocol=chosen_protocol,
                controller=chosen_controller,
                friction=simulated_friction,
                threads=2,
                initial=initial,
                obstacle=known_obstacles(constraints),
            )
        if result.grasps and (picture is not None or recording is not None):
            from fingersplit.recording.replay import replay

            report("drawing", 0.0)
            around = known_obstacles(constraints)
            replayed = replay(result, 1, model, planned_hand, lambda: decompose(model.mesh), around)
            if picture is not None:
                from fingersplit.recording.pictures import draw_picture

                draw_picture(picture, replayed, model, planned_hand)
            if recording is not None:
                from fingersplit.recording.run_recording import write_recording

                write_recording(recording, replayed, model, planned_hand)
    console = output.console
    if imported is not None:
        console.print(imported.message, highlight=False)
    for remark in model.remarks:
        console.print(f"{file.name}: {remark}", highlight=False, markup=False)
    console.print(result_table(result))
    for line in _legend(result):
        console.print(line, highlight=False, markup=False, style="dim")
    for line in (*_scene_lines(result), *_assumed_lines(result)):
        console.print(line, highlight=False, soft_wrap=True)
    output.write(result.to_dict(), "the result")
    for path, title in ((picture, "a picture of rank 1"), (recording, "the recording of rank 1")):
        if path is not None:
            written = f"Wrote {title} to {path}." if result.grasps else f"{path} was not written: there is no grasp."
            console.print(written, highlight=False, soft_wrap=True)
    if not result.feasible:
        raise typer.Exit(NO_FEASIBLE_GRASP)


def _legend(result: PlanResult) -> list[str]:
    """What the columns of the table say, with their units."""
    from fingersplit.contacts.metrics import available_metrics

    lines = ["feasible: every constraint holds."]
    for metric in available_metrics().values():
        if metric.in_tables:
            better = "higher" if metric.higher_is_better else "lower"
            lines.append(
                f"{metric.title}{f' [{metric.unit}]' if metric.unit else ''}: {metric.meaning} ({better} is better)."
            )
    if result.summary.verification is None:
        return [*lines, "pad [rad]: largest angle between a pad and the surface. ended: how the search ended."]
    return [
        *lines,
        "held: simulation; firmly where slip is below 5 mm and turn below 5 degrees.",
        "slip [mm], turn [degrees]: how far the object moved and turned in the hand.",
    ]


def _scene_lines(result: PlanResult) -> list[str]:
    """What is told of a scene below the table: how the object rests, warnings, what was rejected."""
    scene = result.scene
    if scene is None:
        return []
    lines = list(scene.warnings)
    if scene.stable_pose_share is not None:
        position, wxyz = (
            ", ".join(f"{x:.4f}" for x in part) for part in (scene.object_pose.position, scene.object_pose.wxyz)
        )
        lines.append(
            f"The object rests in its likeliest stable pose ({100 * scene.stable_pose_share:.0f} % of drops): position "
            f"[{position}], wxyz [{wxyz}]."
        )
    if scene.rejected_by:
        lines.append("Grasps rejected by " + ", ".join(f"{name}: {n}" for name, n in scene.rejected_by.items()) + ".")
    return lines + [relaxation.message for relaxation in scene.relaxations]


def _assumed_lines(result: PlanResult) -> list[str]:
    """Which contacts lie on a side that was not seen but assumed."""
    touched = [
        f"rank {grasp.rank}: {', '.join(grasp.assumed_fingers)}" for grasp in result.grasps if grasp.assumed_fingers
    ]
    if not touched:
        return []
    return [f"Contacts on a side that was not seen but assumed, which may be elsewhere: {'; '.join(touched)}."]


def result_table(result: PlanResult) -> Table:
    """The ranked grasps, a column for every metric that is shown in tables."""
    from fingersplit.contacts.metrics import available_metrics

    metrics = [metric for metric in available_metrics().values() if metric.in_tables]
    verification = result.summary.verification
    caption = result.message if verification is None else f"{result.message} {verification.message}"
    verified = verification is not None  # 80 columns hold the verdicts or how the searches ended
    verdicts = ("held", "slip mm", "turn deg") if verified else ("pad rad",)
    columns = dict.fromkeys(("rank", "feasible", "p hold", *(metric.heading for metric in metrics), *verdicts), "right")
    table = new_table(
        f"{result.object.name}, {result.hand}", columns | ({} if verified else {"ended": "left"}), caption
    )
    for grasp in result.grasps:
        pad_angle = max(contact.pad_angle for contact in grasp.contacts)
        search = (f"{pad_angle:.2f}", grasp.termination.label.replace("_", " "))
        table.add_row(
            str(grasp.rank),
            "yes" if grasp.feasible else "no",
            "" if grasp.p_hold is None else f"{grasp.p_hold.value:.2f}",
            *(_rounded(grasp.metrics[metric.name]) for metric in metrics),
            *(verdict_cells(grasp.verification) if verified else search),
        )
    return table


def _rounded(value: float | None) -> str:
    """Three digits behind the point, two where there is more before it."""
    if value is None:
        return "none"
    return f"{value:.3f}" if abs(value) < 1.0 else f"{value:.2f}"
