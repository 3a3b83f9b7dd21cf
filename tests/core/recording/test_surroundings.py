"""What pictures, recordings and pages draw around an object."""

import numpy as np
import pytest

from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.pictures import draw_picture, surrounding_layers, way_layers
from fingersplit.recording.replay import replay
from fingersplit.recording.surroundings import find_surroundings, path_of
from fingersplit.scene import Constraints, ContactRegions, Obstacle, Pose, Primitive, Region, Scene, SupportSurface
from fingersplit.scene.preparing import prepare_scene
from fingersplit.transforms import transform_points

OBJECT_POSE = Pose((0.3, 0.1, 0.06), (0.9238795, 0, 0, 0.3826834))
PRIMITIVES = {
    "box": Primitive.box(0.02, 0.03, 0.1),
    "sphere": Primitive.sphere(0.03),
    "cylinder": Primitive.cylinder(0.1, 0.03),
    "capsule": Primitive.capsule(0.06, 0.02),
}


@pytest.fixture(scope="module")
def model():
    return prepare_object(box((0.06, 0.05, 0.12)), "carton")


@pytest.fixture(scope="module")
def constraints():
    obstacles = tuple(
        Obstacle(name, Pose((0.3 + 0.3 * k, 0.6, 0.05)), primitive)
        for k, (name, primitive) in enumerate(PRIMITIVES.items())
    )
    cloud = Obstacle("seen", points=np.random.default_rng(0).uniform(0.5, 0.6, (9000, 3)))
    return Constraints(
        scene=Scene(object_pose=OBJECT_POSE, support_surfaces=(SupportSurface(),), obstacles=(*obstacles, cloud)),
        contact_regions=ContactRegions(forbidden=(Region("half_space", normal=(0, 0, 1), offset=-0.055),)),
    )


def test_everything_is_drawn_where_it_stands(model, constraints):
    scene = prepare_scene(constraints, model, load_hand("barrett"))
    found = {one.name: one for one in find_surroundings(scene, model, {"table": 3})}

    assert list(found) == ["table", *PRIMITIVES, "seen", "contact regions"]
    in_world = {name: transform_points(OBJECT_POSE.matrix, one.vertices) for name, one in found.items()}
    assert in_world["table"][:, 2].max() == pytest.approx(0.0, abs=1e-9)
    assert found["table"].label == "table: 3 rejected"
    for k, name in enumerate(PRIMITIVES):
        low, high = in_world[name].min(axis=0), in_world[name].max(axis=0)
        assert (low + high) / 2 == pytest.approx((0.3 + 0.3 * k, 0.6, 0.05), abs=1e-3)
        assert 2 * PRIMITIVES[name].half_sizes.max() <= (high - low).max() + 1e-3
    assert len(found["seen"].vertices) == 4000
    assert not len(found["seen"].faces)
    forbidden = found["contact regions"]
    assert len(forbidden.faces)
    assert forbidden.vertices[forbidden.faces][..., 2].max() < -0.05


def test_a_picture_shows_the_way_and_the_surroundings(model, constraints, tmp_path):
    hand = load_hand("barrett")
    result = plan(model, hand, starts=16, seed=1, constraints=constraints)
    replayed = replay(result, 1, model, hand)

    path = path_of(replayed.grasp)
    way_in, way_out = replayed.grasp.approach_path, replayed.grasp.retreat_path
    assert path[1] - path[0] == pytest.approx(way_in.distance * np.array(way_in.direction), abs=1e-9)
    assert path[2] - path[1] == pytest.approx(way_out.distance * np.array(way_out.direction), abs=1e-9)
    assert len(way_layers(replayed)) == 2
    assert len(surrounding_layers(replayed, model)) == len(PRIMITIVES) + 3
    assert replayed.rejected_by == result.scene.rejected_by
    draw_picture(tmp_path / "picture.png", replayed, model, hand)
    assert (tmp_path / "picture.png").stat().st_size > 10_000
