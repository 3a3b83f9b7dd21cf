"""Our own objects: closed, outward, and of the size they say."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fingersplit.objects import parametric
from fingersplit.objects.parametric import PARAMETRIC_OBJECTS

MUG_FILE = Path(__file__).parents[3] / "examples" / "objects" / "mug.ply"


@pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
def test_every_object_is_one_closed_outward_surface(name):
    mesh = PARAMETRIC_OBJECTS[name]()
    assert mesh.trimesh.is_watertight
    assert mesh.trimesh.is_winding_consistent
    assert mesh.trimesh.volume > 0
    assert mesh.trimesh.body_count == 1
    assert mesh.trimesh.area_faces.min() > 1e-9


@pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
def test_the_same_object_every_time(name):
    assert PARAMETRIC_OBJECTS[name]().content_hash == PARAMETRIC_OBJECTS[name]().content_hash


@pytest.mark.parametrize(
    ("mesh", "volume", "extents"),
    [
        (parametric.box((0.04, 0.05, 0.06)), 0.04 * 0.05 * 0.06, (0.04, 0.05, 0.06)),
        (parametric.sphere(0.03), 4 / 3 * math.pi * 0.03**3, (0.06, 0.06, 0.06)),
        (parametric.ellipsoid((0.05, 0.03, 0.02)), 4 / 3 * math.pi * 0.05 * 0.03 * 0.02, (0.1, 0.06, 0.04)),
        (parametric.cylinder(0.03, 0.1), math.pi * 0.03**2 * 0.1, (0.06, 0.06, 0.1)),
        (
            parametric.capsule(0.02, 0.05),
            math.pi * 0.02**2 * 0.05 + 4 / 3 * math.pi * 0.02**3,
            (0.04, 0.04, 0.09),
        ),
        (parametric.wedge(0.08, 0.05, 0.04), 0.5 * 0.08 * 0.05 * 0.04, (0.08, 0.05, 0.04)),
        (parametric.l_bracket(0.08, 0.02, 0.03), (0.08 * 0.02 + 0.06 * 0.02) * 0.03, (0.08, 0.08, 0.03)),
    ],
)
def test_volume_and_extents_are_those_of_the_formula(mesh, volume, extents):
    assert mesh.volume == pytest.approx(volume, rel=0.01)
    np.testing.assert_allclose(mesh.extents, extents, rtol=0.01)


def test_the_mug_has_one_handle_and_a_cavity():
    mesh = parametric.mug()
    assert mesh.trimesh.euler_number == 0  # a torus: one handle
    assert mesh.volume < 0.4 * math.pi * 0.04**2 * 0.095


def test_the_mugs_wall_has_its_thickness():
    mesh = parametric.mug(wall=0.005)
    origin, direction = np.array([[0.0, 0.1, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    _, _, points = mesh.trimesh.ray.intersects_id(origin, direction, multiple_hits=True, return_locations=True)
    depths = np.sort(0.1 - points[:, 1])
    assert len(depths) == 4
    assert depths[1] - depths[0] == pytest.approx(0.005, abs=2e-4)


def test_the_example_file_is_the_default_mug():
    mesh = parametric.mug()
    written = trimesh.exchange.ply.export_ply(mesh.trimesh, vertex_normal=False)
    assert MUG_FILE.read_bytes() == written
