"""Whether a grasp holds, against linear programs written straight from the definition and solved by SciPy."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from fingersplit.contacts.cone_kernel import FACETS
from fingersplit.contacts.holding import GRAVITY, Contacts, assess_holding
from fingersplit.contacts.holding_kernel import FOOTPRINT, GRIP_SHARE, MAX_FORCE, footprint_friction
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object

seeds = st.integers(0, 2**32 - 1)
fingers = st.sampled_from([3, 4, 5])
RADIUS = 0.035  # of the parametric sphere
DOWNS = np.vstack([np.eye(3), -np.eye(3)])
UNLIMITED = 1e3
"""Torque [N m] that the largest force cannot ask of a finger."""


def contacts_at(normals, torque_limit: float = UNLIMITED, rng: np.random.Generator | None = None) -> Contacts:
    """One grasp of the sphere; Jacobians of pads at the end of random levers of about a finger's length."""
    normals = np.asarray(normals, dtype=float)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True))[None]
    rng = rng or np.random.default_rng(0)
    fingers = normals.shape[1]
    jacobians, limits = np.zeros((1, fingers, 3, 3 * fingers + 1)), np.full(3 * fingers + 1, torque_limit)
    for finger in range(fingers):  # three drivers a finger; the first of all moves every finger; the last is unlimited
        jacobians[0, finger, :, 3 * finger : 3 * finger + 3] = rng.normal(scale=0.06, size=(3, 3))
        jacobians[0, finger, :, [0, -1]] = rng.normal(scale=0.06, size=(2, 3))
    limits[-1] = np.inf
    return Contacts(RADIUS * normals, normals, jacobians, np.stack([limits, 0.6 * limits]))


def around(rng: np.random.Generator, count: int = 3) -> np.ndarray:
    """Normals of contacts about an equator that nearly balance."""
    angles = 2 * np.pi * np.arange(count) / count + rng.uniform(-0.25, 0.25, count)
    return np.column_stack([np.cos(angles), np.sin(angles), rng.uniform(-0.2, 0.2, count)])


def anywhere(rng: np.random.Generator, count: int = 3) -> np.ndarray:
    return rng.normal(size=(count, 3))


def tangents(inward: np.ndarray) -> np.ndarray:
    """The directions that the facets of the planner's pyramids look along, (FACETS, 3)."""
    helper = np.array([1.0, 0, 0] if abs(inward[0]) < 0.7 else [0, 1.0, 0])
    first = np.cross(inward, helper) / np.linalg.norm(np.cross(inward, helper))
    angles = 2 * np.pi * np.arange(FACETS) / FACETS
    return np.outer(np.cos(angles), first) + np.outer(np.sin(angles), np.cross(inward, first))


def cone_rows(contacts: Contacts, frictions: np.ndarray, slack: float, facets: int | None = None):
    """Rows (A, b) on (f, s): pyramids inscribed in the cones, or with ``facets`` circumscribed, forces, torques."""
    count = len(frictions)
    A, b = [], []
    for f, friction in enumerate(frictions):
        inward = -contacts.normals[0, f]
        around = tangents(inward)
        flatter = math.cos(math.pi / FACETS)
        if facets:
            angles = 2 * np.pi * np.arange(facets) / facets
            around = np.outer(np.cos(angles), around[0]) + np.outer(np.sin(angles), np.cross(inward, around[0]))
            flatter = 1.0
        for tangent in around:
            A.append(row(count, f, tangent - flatter * friction * inward, slack))
            b.append(0.0)
        A.append(row(count, f, inward, 0.0))
        b.append(MAX_FORCE)
    for driver, both in enumerate(contacts.torque_limits.T):
        for sign, limit in zip((1, -1), both, strict=True):
            if math.isfinite(limit):
                A.append(sum(row(count, f, sign * contacts.jacobians[0, f, :, driver], 0.0) for f in range(count)))
                b.append(limit)
    return np.array(A), np.array(b)


def row(count: int, finger: int, direction: np.ndarray, last: float) -> np.ndarray:
    values = np.zeros(3 * count + 1)
    values[3 * finger : 3 * finger + 3], values[-1] = direction, last
    return values


def balance(contacts: Contacts, center: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """G f = -w with torques over the sphere's radius, an empty column for the last variable."""
    arms = (contacts.points[0] - center) / RADIUS
    G = np.hstack([np.vstack([np.eye(3), np.cross(arm, np.eye(3)).T]) for arm in arms])
    return np.hstack([G, np.zeros((6, 1))]), np.concatenate([-weight, np.zeros(3)])


def reference_margin(contacts, frictions, mass, center, direction, facets: int | None = None) -> float:
    """The linear program of the module's description for one direction of gravity."""
    A, b = cone_rows(contacts, frictions, 1.0, facets)
    G, w = balance(contacts, center, mass * GRAVITY * direction)
    largest = linprog(-np.eye(A.shape[1])[-1], A, b, G, w, bounds=(None, None), method="highs")
    return -largest.fun if largest.status == 0 else -math.inf


def least_normal_force(contacts, frictions, mass, center, direction, share: float) -> float:
    """Least largest normal force with which the weight is carried inside cones of ``share`` of the friction."""
    A, b = cone_rows(contacts, share * frictions, 0.0)
    pressing = [row(len(frictions), f, -normal, -1.0) for f, normal in enumerate(contacts.normals[0])]
    A, b = np.vstack([A, pressing]), np.concatenate([b, np.zeros(len(pressing))])
    G, w = balance(contacts, center, mass * GRAVITY * direction)
    least = linprog(np.eye(A.shape[1])[-1], A, b, G, w, bounds=(None, None), method="highs")
    return least.fun if least.status == 0 else math.inf


@pytest.fixture(scope="module")
def hold(prepared):
    """How contacts hold a sphere."""

    def assess(contacts, friction=0.6, mass=0.3, center=(0, 0, 0)):
        (holding,) = assess_holding(contacts, prepared("sphere").surface, friction, mass, np.array(center, dtype=float))
        return holding

    return assess


@given(
    seed=seeds,
    count=fingers,
    torque=st.sampled_from([UNLIMITED, 0.6, 0.2]),
    arrange=st.sampled_from([around, anywhere]),
)
def test_margin_is_that_of_the_definition(hold, seed, count, torque, arrange):
    rng = np.random.default_rng(seed)
    contacts, center = contacts_at(arrange(rng, count), torque, rng), rng.uniform(-0.005, 0.005, 3)
    holding = hold(contacts, center=center)
    margins = [reference_margin(contacts, holding.frictions, 0.3, center, down) for down in DOWNS]
    worst = min(margins)
    assert holding.margin == pytest.approx(worst, abs=1e-5)
    if math.isfinite(worst):
        there = [margin for margin, down in zip(margins, DOWNS, strict=True) if (down == holding.gravity).all()]
        assert there == [pytest.approx(worst, abs=2e-5)]
    assert (holding.forces is None) == (holding.margin <= 0)


@settings(max_examples=12)
@given(seed=seeds, count=fingers)
def test_margin_lies_between_those_of_a_narrower_and_the_round_cone(hold, seed, count):
    """A cone of 256 facets stands for the round one; eight inscribed facets hold a cone of cos(pi / 8) its friction."""
    contacts = contacts_at(around(np.random.default_rng(seed), count))
    holding = hold(contacts)
    narrower = math.cos(math.pi / FACETS) * holding.frictions
    low, high = (
        min(reference_margin(contacts, frictions, 0.3, np.zeros(3), down, facets=256) for down in DOWNS)
        for frictions in (narrower, holding.frictions)
    )
    assert low - 1e-3 <= holding.margin <= high + 1e-5


@given(seed=seeds, count=fingers, torque=st.sampled_from([UNLIMITED, 0.8]))
def test_forces_carry_the_weight_within_every_limit(hold, seed, count, torque):
    rng = np.random.default_rng(seed)
    contacts, center = contacts_at(around(rng, count), torque, rng), rng.uniform(-0.005, 0.005, 3)
    holding = hold(contacts, center=center)
    assume(holding.forces is not None)
    forces, normals = holding.forces, contacts.normals[0]
    np.testing.assert_allclose(forces.sum(axis=0), -0.3 * GRAVITY * holding.gravity, atol=1e-6)
    np.testing.assert_allclose(np.cross(contacts.points[0] - center, forces).sum(axis=0), 0, atol=1e-6)
    pressed = -(forces * normals).sum(axis=1)
    sideways = np.linalg.norm(forces + pressed[:, None] * normals, axis=1)
    assert (sideways <= holding.frictions * pressed + 1e-6).all()
    assert (pressed <= MAX_FORCE + 1e-5).all()
    torques = np.einsum("fca,fc->a", contacts.jacobians[0], forces)
    assert (torques <= contacts.torque_limits[0] * (1 + 1e-5)).all()
    assert (-torques <= contacts.torque_limits[1] * (1 + 1e-5)).all()


@given(seed=seeds, count=fingers, torque=st.sampled_from([UNLIMITED, 0.8]))
def test_forces_are_the_smallest_that_leave_friction_to_spare(hold, seed, count, torque):
    rng = np.random.default_rng(seed)
    contacts = contacts_at(around(rng, count), torque, rng)
    holding = hold(contacts)
    assume(holding.forces is not None)
    arguments = contacts, holding.frictions, 0.3, np.zeros(3), holding.gravity
    careful, least = least_normal_force(*arguments, GRIP_SHARE), least_normal_force(*arguments, 1.0)
    pressed = (-(holding.forces * contacts.normals[0]).sum(axis=1)).max()
    assert pressed == pytest.approx(careful if math.isfinite(careful) else least, abs=1e-4)


def test_cases_that_hold_and_that_do_not_are_both_met(hold):
    found = [hold(contacts_at(anywhere(np.random.default_rng(seed)))).margin for seed in range(40)]
    assert sum(margin > 0 for margin in found) > 3
    assert sum(margin < 0 for margin in found) > 10


@given(seed=seeds)
def test_heavier_object_has_less_margin(hold, seed):
    contacts = contacts_at(around(np.random.default_rng(seed)))
    margins = [hold(contacts, mass=mass).margin for mass in (0.05, 0.2, 0.8, 2.0)]
    assert (np.diff(margins) < 0).all()


@given(seed=seeds)
def test_more_friction_and_more_torque_leave_more_margin(hold, seed):
    contacts = contacts_at(around(np.random.default_rng(seed)), 0.5)
    margins = [hold(contacts, friction=friction).margin for friction in (0.2, 0.4, 0.8)]
    assert (np.diff(margins) > 0).all()
    stronger = contacts._replace(torque_limits=2 * contacts.torque_limits)
    assert hold(stronger).margin >= hold(contacts).margin - 1e-6


def test_three_even_contacts_share_the_weight(hold):
    """Gravity across their plane: each carries a third by friction, so mu f_max - w / 3 is left."""
    angles = 2 * np.pi * np.arange(3) / 3
    contacts = contacts_at(np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]))
    holding, weight = hold(contacts), 0.3 * GRAVITY
    assert holding.margin <= (holding.frictions * MAX_FORCE - weight / 3).max() + 1e-6
    assert holding.margin >= (holding.frictions * math.cos(math.pi / 8) * MAX_FORCE - weight).min() - 1e-6


@given(seed=seeds)
def test_frictionless_contacts_cannot_hold(hold, seed):
    """On a sphere their forces meet in the centre and cannot carry gravity from all sides."""
    holding = hold(contacts_at(around(np.random.default_rng(seed))), friction=0.0)
    np.testing.assert_array_equal(holding.frictions, 0)
    assert holding.margin < 0
    assert holding.forces is None


@pytest.mark.parametrize(
    "normals", [[(1, 0.3, 0), (1, -0.3, 0.2), (1, 0, -0.3)], [(1, 0.1, 0), (1, 0, 0.1), (1, 0, 0)]]
)
def test_contacts_on_one_side_cannot_hold(hold, normals):
    holding = hold(contacts_at(normals))
    assert holding.margin < 0
    assert holding.forces is None


@pytest.mark.parametrize("normals", [[(1, 0, 0), (-1, 0, 0), (1, 0, 0)], [(0, 1, 1), (0, -1, -1), (0, -1, -1)]])
def test_contacts_on_a_line_have_no_margin_at_all(hold, normals):
    holding = hold(contacts_at(normals))
    assert holding.margin == -math.inf
    assert holding.forces is None


def test_weight_that_joints_cannot_carry_has_no_margin_at_all(hold):
    contacts = contacts_at(around(np.random.default_rng(1)), 1e-3)
    assert (
        hold(contacts._replace(torque_limits=np.full_like(contacts.torque_limits, 1e-3)), mass=5.0).margin == -math.inf
    )


def test_many_grasps_at_once_are_those_one_by_one(prepared):
    rng = np.random.default_rng(3)
    one_by_one = [contacts_at(arrange(rng), 0.5, rng) for arrange in (around, anywhere) for _ in range(10)]
    together = Contacts(
        *(np.concatenate([getattr(c, name) for c in one_by_one]) for name in ("points", "normals", "jacobians")),
        one_by_one[0].torque_limits,
    )
    surface = prepared("sphere").surface
    for contacts, found in zip(one_by_one, assess_holding(together, surface, 0.6, 0.3, np.zeros(3)), strict=True):
        (alone,) = assess_holding(contacts, surface, 0.6, 0.3, np.zeros(3))
        assert found.margin == pytest.approx(alone.margin, abs=1e-5)
        np.testing.assert_array_equal(found.frictions, alone.frictions)
        assert (found.forces is None) == (alone.forces is None)


@pytest.mark.parametrize("friction", [0.1, 0.6, 1.5])
def test_all_friction_counts_on_a_plane(prepared, friction):
    for point, normal in (((0.025, 0.01, 0.02), (1.0, 0, 0)), ((0, 0, -0.06), (0, 0, -1.0))):
        found = footprint_friction(prepared("box").surface, tuple(map(float, point)), normal, friction)
        assert found == pytest.approx(friction, rel=1e-9)


def test_friction_falls_towards_an_edge(prepared):
    surface, normal = prepared("box").surface, (1.0, 0.0, 0.0)
    beside = [footprint_friction(surface, (0.025, 0.035 - d, 0.0), normal, 0.6) for d in (5e-3, 3.6e-3, 3e-3, 0.0)]
    assert beside[0] == pytest.approx(0.6)
    assert (np.diff(beside) < 0).all()
    # Half of the footprint looks across, so half of 45 degrees is lost.
    assert beside[-1] == pytest.approx(np.tan(np.arctan(0.6) - np.radians(22.5)), abs=0.03)


def test_friction_on_a_sphere_is_that_of_its_curvature(prepared):
    """The mean angle of a cap of chord c on a sphere of radius R is about 2 c / 3 R."""
    friction = footprint_friction(prepared("sphere").surface, (0.0, 0.0, RADIUS), (0.0, 0.0, 1.0), 0.6)
    assert friction == pytest.approx(math.tan(math.atan(0.6) - FOOTPRINT / (3 * RADIUS)), rel=0.03)


def test_far_side_of_a_thin_plate_does_not_count():
    surface = prepare_object(box((0.05, 0.05, 0.002)), "plate").surface
    assert footprint_friction(surface, (0.0, 0.0, 0.001), (0.0, 0.0, 1.0), 0.6) == pytest.approx(0.6)


def test_friction_is_never_negative(prepared):
    corner = footprint_friction(prepared("box").surface, (0.025, 0.035, 0.06), (1.0, 0.0, 0.0), 0.1)
    assert corner == 0  # at a corner more than twice the friction angle is lost


def test_loads_are_balanced_one_by_one(prepared):
    """The margin under several loads is the least of those under each, and the weight's six directions are loads."""
    rng = np.random.default_rng(5)
    surface, mass = prepared("sphere").surface, 0.3
    contacts = contacts_at(around(rng))
    weights = np.hstack([mass * 9.81 * np.vstack([np.eye(3), -np.eye(3)]), np.zeros((6, 3))])
    loads = np.vstack([weights, np.hstack([rng.normal(0, 3, (5, 3)), rng.normal(0, 0.03, (5, 3))])])

    (usual,) = assess_holding(contacts, surface, 0.6, mass, np.zeros(3))
    (same,) = assess_holding(contacts, surface, 0.6, mass, np.zeros(3), loads=weights)
    (together,) = assess_holding(contacts, surface, 0.6, mass, np.zeros(3), loads=loads)
    each = [assess_holding(contacts, surface, 0.6, mass, np.zeros(3), loads=load[None])[0].margin for load in loads]

    assert same.margin == pytest.approx(usual.margin)
    assert together.margin == pytest.approx(min(each))
    assert together.load == int(np.argmin(each))
    assert together.margin < usual.margin
    assert together.forces is None or together.forces.sum(axis=0) == pytest.approx(-loads[together.load, :3], abs=1e-6)
