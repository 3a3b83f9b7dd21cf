"""The command ``fingersplit from-depth``: a depth image becomes a target and a scene, for `plan`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.output import check_writable
from fingersplit.errors import SettingsError
from fingersplit.numerals import read_floats

__all__ = ["from_depth"]


def from_depth(
    file: Annotated[
        Path,
        typer.Argument(
            help="Depth image, .png of 16 bits, or .npz with depth and intrinsics or an organised cloud, points.",
            exists=True,
            dir_okay=False,
        ),
    ],
    target: Annotated[Path, typer.Option(help="Cloud of the object to write, .npz.")],
    scene: Annotated[Path, typer.Option(help="Scene to write, JSON.")],
    mask: Annotated[
        Path | None, typer.Option(help="Pixels of the object, .png; or mask in the archive.", exists=True)
    ] = None,
    intrinsics: Annotated[str | None, typer.Option(help="fx,fy,cx,cy in pixels.")] = None,
    depth_scale: Annotated[
        float | None, typer.Option(help="Metres of one unit of depth; 0.001 for whole numbers.")
    ] = None,
    camera_pose: Annotated[
        str | None, typer.Option(help="world_from_camera as x,y,z,qw,qx,qy,qz; metres, optical frame.")
    ] = None,
    frame: Annotated[str, typer.Option(help="Frame of the scene and its answers: world or camera.")] = "world",
    support: Annotated[bool, typer.Option("--support", help="Find the plane that the object stands on.")] = False,
    clearance: Annotated[float, typer.Option(help="Of the hand from obstacles and support [m].")] = 0.002,
    complete: Annotated[
        bool, typer.Option(help="Assume the unseen side where the support is known; contacts may lie on it.")
    ] = True,
) -> None:
    """Cut a depth image into the object's cloud and the scene around it; plan with `plan TARGET --scene SCENE`."""
    import numpy as np

    from fingersplit.scene.from_view import scene_from_view
    from fingersplit.scene.shapes import Pose
    from fingersplit.scene.view_files import read_view

    check_writable(target, scene)
    pose = None if camera_pose is None else _numbers("camera-pose", camera_pose, 7)
    view = read_view(
        file,
        mask,
        intrinsics=None if intrinsics is None else _numbers("intrinsics", intrinsics, 4),
        depth_scale=depth_scale,
        world_from_camera=None if pose is None else Pose.from_numbers(pose).matrix,
    )
    found = scene_from_view(view, frame=frame, support=support, clearance=clearance, complete=complete)
    with target.open("wb") as written:
        np.savez(written, **found.target.to_arrays(), complete=np.array(complete))
    scene.write_text(json.dumps({"scene": found.scene.to_document()}))
    for line in found.warnings:
        typer.echo(line)
    told = f"Wrote {target}: {len(found.target.points):,} points; {scene}: {found.obstacle_points:,} obstacle points"
    if support:
        surface = found.scene.support_surfaces[0]
        normal = ", ".join(f"{x:.4f}" for x in surface.normal)
        told += f", support surface with normal ({normal}) at {surface.offset:.4f} m in {found.support_points:,} points"
    typer.echo(f"{told}.")


def _numbers(name: str, text: str, count: int) -> list[float]:
    try:
        numbers = read_floats(text.encode().split(b","))
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise SettingsError(f"--{name} is {text!r}; it must be {count} numbers with commas between them.")
    return numbers
