"""Render the animation of the README: a mug on a table, its fingers split, and the lift in simulation.

Run with ``make pictures``; it writes ``docs/splitting.webp``.
"""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

import fingersplit as fs
from fingersplit.recording.pictures import GraspView, grasp_layers
from fingersplit.recording.raycast import Camera, Layer, render
from fingersplit.recording.replay import ReplayedGrasp, replay
from fingersplit.scene import Approach, ApproachCone, Constraints, Pose, Scene, SupportSurface
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, transform_points
from fingersplit.verification import SimulationFrames, simulate

ROOT = Path(__file__).resolve().parents[1]
OUTPUT = ROOT / "docs" / "splitting.webp"
SIZE = (640, 420)
"""[pixels]"""
SPLITTING_FRAMES, LIFTING_FRAMES = 18, 26
FRAME_TIME, PAUSE = 90, 1200
"""[ms]"""
TABLE_COLOR = (0.80, 0.77, 0.72, 1.0)
TABLE_EDGE, TABLE_HEIGHT = 0.34, 0.012
"""[m]"""
LIFT_SHOWN = 0.12
"""How much of the lift is shown [m]."""


def main() -> None:
    """Plan, replay, simulate and render."""
    mug = fs.load_object(ROOT / "examples" / "objects" / "mug.ply", unit="m")
    hand = fs.load_hand("barrett")
    constraints = Constraints(
        scene=Scene(
            object_pose=Pose(position=(0.0, 0.0, -mug.mesh.vertices[:, 2].min())), support_surfaces=(SupportSurface(),)
        ),
        approach=Approach(directions=(ApproachCone.parse("down:75"),)),
    )
    result = fs.plan(mug, hand, starts=128, seed=1, constraints=constraints)
    lifted = simulate(result.grasp(1).for_hand(hand), hand, mug, fs.decompose(mug.mesh), "lift_full")
    if lifted.frames is None or not lifted.report.passed or result.scene is None:
        raise SystemExit(f"The first grasp was not held: {lifted.report.explanation}")
    rest = result.scene.object_pose
    world_from_object = pose_matrix(rotation_from_wxyz(rest.wxyz), rest.position)
    views = _splitting(replay(result, 1, mug, hand)) + _lifting(lifted.frames)
    scenes = [
        [_table(), *(_moved(layer, world_from_object @ place) for layer in grasp_layers(mug.mesh, hand, view))]
        for place, view in views
    ]
    points = np.vstack([layer.vertices for layers in (scenes[0], scenes[-1]) for layer in layers])
    camera = Camera.framing(points, np.array([-0.55, -0.85, 0.4]), np.array([0.0, 0.0, 1.0]), size=SIZE, margin=0.02)
    images = [_image(layers, camera) for layers in scenes]
    times = [FRAME_TIME] * len(images)
    times[0] = times[SPLITTING_FRAMES - 1] = times[-1] = PAUSE
    images[0].save(OUTPUT, quality=80, method=6, save_all=True, append_images=images[1:], duration=times, loop=0)
    print(f"{OUTPUT.relative_to(ROOT)}: {len(images)} frames, {OUTPUT.stat().st_size / 1e3:.0f} kB")


Placed = tuple[NDArray[np.float64], GraspView]
"""Where the object has gone from where it was planned (4, 4), and the grasp on it."""


def _splitting(replayed: ReplayedGrasp) -> list[Placed]:
    trace = replayed.trace
    rows = np.linspace(0, len(trace) - 1, SPLITTING_FRAMES).round().astype(int)
    return [
        (np.eye(4), GraspView(trace.object_from_palm(row), trace.joints[row], trace.contacts[row], trace.normals[row]))
        for row in rows
    ]


def _lifting(frames: SimulationFrames) -> list[Placed]:
    """The simulation from the squeeze on, until it is as high as is shown."""
    heights = frames.object_positions[:, 2] - frames.object_positions[0, 2]
    end = int(np.argmax(heights > LIFT_SHOWN)) or len(heights) - 1
    begin = max(int(np.argmax(heights > 1e-3)) - 5, 0)
    placed = []
    for row in np.linspace(begin, end, LIFTING_FRAMES).round().astype(int):
        start_from_object = pose_matrix(rotation_from_wxyz(frames.object_wxyz[row]), frames.object_positions[row])
        start_from_palm = pose_matrix(rotation_from_wxyz(frames.palm_wxyz[row]), frames.palm_positions[row])
        object_from_start = np.linalg.inv(start_from_object)
        contacts = transform_points(object_from_start, frames.contact_positions[row])
        forces = frames.contact_forces[row]
        sizes = np.linalg.norm(forces, axis=1, keepdims=True)
        outward = -(forces / np.where(sizes > 0, sizes, 1.0)) @ object_from_start[:3, :3].T
        pressing = sizes[:, 0] > 0
        view = GraspView(object_from_start @ start_from_palm, frames.joints[row], contacts[pressing], outward[pressing])
        placed.append((start_from_object, view))
    return placed


def _table() -> Layer:
    box = trimesh.creation.box((TABLE_EDGE, TABLE_EDGE, TABLE_HEIGHT))
    return Layer(box.vertices - [0.0, 0.0, TABLE_HEIGHT / 2], box.faces, TABLE_COLOR)


def _moved(layer: Layer, pose: NDArray[np.float64]) -> Layer:
    return Layer(transform_points(pose, layer.vertices), layer.faces, layer.rgba)


def _image(layers: list[Layer], camera: Camera) -> Image.Image:
    drawn = Image.fromarray((255 * render(layers, camera)).round().astype(np.uint8), "RGBA")
    ground = Image.new("RGBA", drawn.size, "white")
    return Image.alpha_composite(ground, drawn).convert("RGB")


if __name__ == "__main__":
    main()
