"""Which links are tested against each other: by their solids, where the shapes fitted to these reach beyond."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from fingersplit.hands import Hand, load_hand
from fingersplit.hands.self_collision import neutral_joints, self_collision_pairs, shape_distances
from own_hand import description, write_hand
from posed_solids import PosedSolids

PLACES = {"first": (1, 1, 90), "second": (-1, 1, 90), "thumb": (0, -1, -90)}
FINGER = (
    '<body name="{name}_near" pos="{x} {y} 0.03" axisangle="0 0 1 {turn}">'
    '<joint name="{name}_0" axis="0 -1 0" range="-30 60"/><geom name="{name}_near" {near}/>'
    '<body name="{name}_middle" pos="0.03 0 0"><joint name="{name}_1" axis="0 -1 0" range="-10 90"/>'
    '<body name="{name}_far" pos="0.012 0 0"><joint name="{name}_2" axis="0 -1 0" range="-10 90"/>'
    '<geom name="{name}_far" type="capsule" fromto="0.006 0 0 0.03 0 0" size="0.006"/>'
    '<site name="{name}_pad" pos="0.03 0 0" size="0.006" zaxis="0.3 0 1"/></body></body></body>'
)
PRISM = "0 -0.016 -0.006  0.041 -0.016 -0.006  0 -0.016 0.025  0 0.016 -0.006  0.041 0.016 -0.006  0 0.016 0.025"
"""Its box is full to the middle joint all the way up, where the outer link may be."""
CAPSULE = 'type="capsule" fromto="0 0 0 0.03 0 0" size="0.006"'


def hand_of(tmp_path: Path, near: str, aside: float = 0.025, across: float = 0.05) -> Hand:
    """Two fingers against one whose outer links curl back onto the inner ones; middle links have no solids."""
    fingers = "".join(
        FINGER.format(name=name, x=x * aside, y=y * across, turn=turn, near=near)
        for name, (x, y, turn) in PLACES.items()
    )
    mjcf = (
        f'<mujoco><compiler angle="degree" autolimits="true"/><asset><mesh name="prism" vertex="{PRISM}"/></asset>'
        f'<worldbody><body name="palm"><geom name="plate" type="box" size="0.03 0.04 0.01"/>{fingers}</body>'
        "</worldbody></mujoco>"
    )
    drivers = [f"{name}_{j}" for name in PLACES for j in range(3)]
    described = description(drivers=drivers) | {
        "fingers": [{"name": name, "pads": [{"site": f"{name}_pad"}]} for name in PLACES],
        "shapes": {"budget": 7},
    }
    described["grips"][0] |= {"jaws": [["first", "second"], ["thumb"]]}
    return load_hand(write_hand(tmp_path / "curling", mjcf, described))


def least_clearance(hand: Hand, joints: ArrayLike) -> float:
    """Of the pairs of shapes that are tested [m]."""
    return float(shape_distances(hand.model, joints, self_collision_pairs(hand.model)).min())


def test_links_whose_boxes_would_overlap_are_tested_as_what_they_are(tmp_path):
    hand = hand_of(tmp_path, 'type="mesh" mesh="prism"')
    model, solids = hand.model, PosedSolids(hand)
    names = [hand.shape_names[k] for k in self_collision_pairs(model).ravel()]
    assert {"first_near", "first_far"} <= set(names)
    assert least_clearance(hand, neutral_joints(model)) > 2e-3
    rng = np.random.default_rng(3)
    met = apart = 0
    for _ in range(500):
        joints = rng.uniform(hand.lower, hand.upper)
        solids.move(joints)
        depth, links = solids.depth_in_itself()
        clearance = least_clearance(hand, joints)
        if clearance >= -1e-3:
            assert depth < 1.2e-3, links
        if clearance < -0.1e-3:
            assert depth > 0
        met, apart = met + (depth > 1e-3), apart + (depth == 0)
    assert met > 30
    assert apart > 100


def test_links_of_two_fingers_that_cross_when_nothing_is_closed_are_no_neighbours(tmp_path):
    """Ends of fingers that stand in each other at zero are so only there."""
    hand = hand_of(tmp_path, CAPSULE, aside=0.01, across=-0.02)
    pairs = {frozenset(hand.shape_names[k] for k in pair) for pair in self_collision_pairs(hand.model)}
    at_zero = shape_distances(hand.model, neutral_joints(hand.model), self_collision_pairs(hand.model))
    assert at_zero.min() < -1e-3
    assert {frozenset(("first_far", "thumb_far")), frozenset(("first_near", "first_far"))} <= pairs
