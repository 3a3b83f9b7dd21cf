"""Scenes built with the client's helpers are what core reads."""

import io
import math
from typing import Any

import numpy as np
import pytest

from client_calls import done
from fingersplit.objects.parametric import box
from fingersplit.scene import ApproachCone, Constraints
from fingersplit_bench.depth_views import Camera, look_at, render_view
from fingersplit_client import InvalidRequestError, scenes


def test_helpers_build_what_core_reads():
    parts = {
        "scene": scenes.scene(
            scenes.box("wall", (0.4, 0.02, 0.15), (0, 0.2, 0.075)),
            scenes.sphere("ball", 0.03, (0.1, 0, 0.03)),
            scenes.cylinder("can", 0.1, 0.03, (0.2, 0, 0.05)),
            scenes.capsule("pen", 0.1, 0.01, (0.2, 0.1, 0.01), (0.7071068, 0.7071068, 0, 0)),
            scenes.cloud("seen", [(0, 0.3, 0.1), (0, 0.3, 0.2)], 0.004),
            scenes.mesh("other", "abc", (0.3, 0, 0)),
            supports=[scenes.table(0.02, extents=(1.2, 0.8))],
            object_pose=scenes.pose((0, 0, 0.1)),
            workspace=((-1, -1, 0), (1, 1, 1)),
        ),
        "approach": scenes.approach(scenes.cone("down", 30), scenes.cone((1, 0, 0)), retreat="back"),
    }
    read = Constraints.from_document(parts)

    assert [one.id for one in read.scene.obstacles] == ["wall", "ball", "can", "pen", "seen", "other"]
    assert read.scene.support_surfaces[0].offset == 0.02
    assert read.scene.object_pose.position == (0, 0, 0.1)
    assert read.approach.directions == (
        ApproachCone((0, 0, -1), math.radians(30)),
        ApproachCone((1, 0, 0), math.radians(35)),
    )
    assert read.approach.retreat.frame == "palm"


@pytest.mark.parametrize("name", ["down", "up", "+x", "-x", "+y", "-y"])
def test_directions_are_those_of_the_command_line(name):
    built = Constraints.from_document({"approach": scenes.approach(scenes.cone(name, 20))}).approach.directions[0]
    assert built.axis == ApproachCone.parse(f"{name}:20").axis


@pytest.mark.anyio
async def test_a_depth_image_becomes_an_object_and_a_scene(client: Any) -> None:
    camera, camera_pose, object_pose = (
        Camera(160, 120, 150.0),
        look_at(np.array([0.4, -0.1, 0.4]), np.zeros(3)),
        np.eye(4),
    )
    object_pose[2, 3] = 0.06
    view = render_view(box((0.06, 0.05, 0.12)), object_pose, camera_pose, camera)
    file = io.BytesIO()
    np.savez(file, points=view.points, mask=view.mask)
    with pytest.raises(InvalidRequestError, match="camera_pose"):
        await done(client.scenes.from_depth(file.getvalue()))

    viewed = await done(client.scenes.from_depth(file.getvalue(), frame="camera", support=True, name="carton"))

    assert viewed.object.name == "carton"
    assert viewed.scene["frame"] == "camera"
    normal = camera_pose[:3, :3] @ viewed.scene["support_surfaces"][0]["normal"]
    assert normal[2] > 0.999
    assert viewed.warnings
