"""Mass, centre of mass and inertia against closed forms; options that make no sense."""

import numpy as np
import pytest
import trimesh

from fingersplit.errors import SettingsError
from fingersplit.objects.mass import mass_properties
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import box, l_bracket

EXTENTS = np.array([0.04, 0.06, 0.1])


def box_inertia(mass: float, extents: np.ndarray) -> np.ndarray:
    return mass / 12 * np.diag((extents**2).sum() - extents**2)


def cup(wall: float) -> Mesh:
    """A closed cup of 80 x 100 mm with walls [m]."""
    outline = [(0, 0), (0.04, 0), (0.04, 0.1), (0.04 - wall, 0.1), (0.04 - wall, wall), (0, wall)]
    solid = trimesh.creation.revolve(np.array(outline), sections=64)
    return Mesh(solid.vertices, solid.faces)


def half_of(mesh: Mesh) -> np.ndarray:
    """The faces of a cup's outside: one surface, open above."""
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    outside = mesh.trimesh.face_normals
    return mesh.faces[((outside[:, :2] * middles[:, :2]).sum(axis=1) > 1e-6) | (middles[:, 2] < 1e-6)]


def moved(mesh: Mesh, offset: tuple[float, float, float]) -> Mesh:
    return Mesh(mesh.vertices + np.array(offset), mesh.faces)


@pytest.mark.parametrize("offset", [(0, 0, 0), (0.3, -0.7, 1.1)])
def test_box_has_the_mass_properties_of_the_textbook(offset):
    found = mass_properties(moved(box(tuple(EXTENTS)), offset), ObjectOptions(density=800))
    mass = 800 * EXTENTS.prod()
    assert found.mass == pytest.approx(mass)
    assert found.volume == pytest.approx(EXTENTS.prod())
    np.testing.assert_allclose(found.center_of_mass, offset, atol=1e-12)
    np.testing.assert_allclose(found.inertia, box_inertia(mass, EXTENTS), rtol=1e-9, atol=1e-15)


def test_given_mass_scales_the_inertia_of_any_shape():
    bracket = l_bracket()
    found = mass_properties(bracket, ObjectOptions(mass=0.7))
    expected = trimesh.triangles.mass_properties(bracket.vertices[bracket.faces], density=0.7 / bracket.volume)
    assert found.mass == 0.7
    np.testing.assert_allclose(found.center_of_mass, expected["center_mass"], atol=1e-9)
    np.testing.assert_allclose(found.inertia, expected["inertia"], rtol=1e-6, atol=1e-12)


def test_box_without_its_lid_counts_as_full():
    solid = box(tuple(EXTENTS))
    top = (np.abs(solid.vertices[solid.faces][:, :, 2] - EXTENTS[2] / 2) < 1e-9).all(axis=1)
    found = mass_properties(Mesh(solid.vertices, solid.faces[~top]), ObjectOptions(mass=1.0))
    assert found.volume == pytest.approx(EXTENTS.prod())
    np.testing.assert_allclose(found.inertia, box_inertia(1.0, EXTENTS), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "options", "mass", "basis"),
    [
        (lambda: box(tuple(EXTENTS)), {}, 500 * EXTENTS.prod(), "assumed_density"),
        (lambda: box((0.2, 0.2, 0.2)), {}, 0.5, "assumed_density"),
        (lambda: box(tuple(EXTENTS)), {"mass": 0.3}, 0.3, "given"),
        (lambda: box(tuple(EXTENTS)), {"density": 900.0}, 900 * EXTENTS.prod(), "given_density"),
        (lambda: cup(3e-3), {}, 1200 * cup(3e-3).volume, "assumed_wall"),
        (lambda: cup(0.5e-3), {}, 1200 * 2e-3 * cup(0.5e-3).area / 2, "assumed_wall"),
        (lambda: Mesh(cup(0.5e-3).vertices, half_of(cup(0.5e-3))), {}, None, "assumed_wall"),
    ],
)
def test_mass_is_said_to_be_given_or_assumed(make, options, mass, basis):
    mesh = make()
    found = mass_properties(mesh, ObjectOptions(**options))
    assert found.basis == basis
    assert found.mass == pytest.approx(1200 * 2e-3 * mesh.area if mass is None else mass)


def test_area_and_volume_are_those_of_trimesh():
    bracket = l_bracket()
    assert bracket.area == pytest.approx(bracket.trimesh.area)
    assert bracket.volume == pytest.approx(bracket.trimesh.volume)


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"density": 0.0}, "'density' is 0.0; allowed: 1 to 25000 kg/m"),
        ({"mass": -1}, "'mass' is -1"),
        ({"mass": "heavy"}, "'mass' must be a number, got 'heavy'"),
        ({"mass": True}, "'mass' must be a number, got True"),
        ({"friction": float("nan")}, "'friction' is nan"),
        ({"fairing": None}, "'fairing' must be a number, got None"),
        ({"fairing": 1.0}, "'fairing' is 1.0"),
        ({"mass": 1.0, "density": 500}, "Both density and mass"),
        ({"weight": 1.0}, "Unknown object option 'weight'; known: density, mass, friction, fairing"),
    ],
)
def test_options_that_make_no_sense_are_refused(document, words):
    with pytest.raises(SettingsError, match=words):
        ObjectOptions.from_document(document)


def test_options_have_a_hash_that_tells_them_apart():
    options = [ObjectOptions(), ObjectOptions(mass=1), ObjectOptions(friction=1), ObjectOptions(fairing=0.001)]
    assert len({each.content_hash for each in options}) == 4
    assert all(ObjectOptions.from_document(each.to_document()) == each for each in options)
    assert ObjectOptions(mass=1).content_hash == ObjectOptions(mass=1.0).content_hash
