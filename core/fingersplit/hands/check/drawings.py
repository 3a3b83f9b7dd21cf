"""Drawings of a hand in a posture: outlines of its collision shapes, as SVG."""

import html

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.hands.fitting import primitive_points
from fingersplit.hands.forward import link_poses
from fingersplit.hands.hand import Hand
from fingersplit.hands.model import HandModel
from fingersplit.transforms import transform_points

__all__ = ["draw_posture"]

Array = NDArray[np.float64]

SIZE = 260
"""Edge of a drawing [px]."""
COLORS = ("#e07a3f", "#3f7ae0", "#3fa860", "#a04fc0", "#c0a030")
PALM_COLOR, PARKED_COLOR = "#8a8f98", "#c9ccd2"


def draw_posture(title: str, hand: Hand, joints: Array) -> str:
    """A figure of the hand at joint angles (N,) [rad], along its approach and its lateral axis; pads are circles."""
    approach, lateral = hand.gripper.palm_from_gripper[:, [0, 1]], hand.gripper.palm_from_gripper[:, [1, 2]]
    drawings = "".join(
        _drawing(hand, joints, axes, f"{title}, seen along the {name} axis")
        for name, axes in (("approach", approach), ("lateral", lateral))
    )
    return f"<figure><div>{drawings}</div><figcaption>{html.escape(title)}</figcaption></figure>"


def _drawing(hand: Hand, joints: Array, axes: Array, title: str) -> str:
    """Outlines of collision shapes projected along one direction, the farthest first, as SVG."""
    model = hand.model
    poses = link_poses(model, joints)
    depth = np.cross(axes[:, 0], axes[:, 1])
    outlines = []
    for shape in model.shapes:
        points = transform_points(poses[shape.link] @ shape.pose, primitive_points(shape.kind, shape.size))
        outlines.append((float((points @ depth).mean()), _outline(points @ axes), _color(hand, model, shape.link)))
    pads = [
        (
            poses[pad.link, :3, :3] @ pad.center + poses[pad.link, :3, 3],
            poses[pad.link, :3, :3] @ pad.normal,
            pad.radius,
        )
        for pad in hand.pads
    ]
    around = [center @ axes + radius * side for center, _, radius in pads for side in (-1.0, 1.0)]
    everything = np.vstack([*(outline for _, outline, _ in outlines), around])
    low, span = everything.min(axis=0), float(np.ptp(everything, axis=0).max())
    scale = (SIZE - 20) / span
    middle = low + np.ptp(everything, axis=0) / 2

    def place(points: Array) -> Array:
        return np.asarray(SIZE / 2 + (points - middle) * (scale, -scale))

    parts = []
    for _, outline, color in sorted(outlines, key=lambda each: each[0]):
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in place(outline))
        parts.append(f"<polygon points='{corners}' fill='{color}' fill-opacity='.75' stroke='#333' stroke-width='.6'/>")
    for center, normal, radius in pads:
        (x, y), (u, v) = place(np.stack([center @ axes, (center + (radius + 0.012) * normal) @ axes]))
        parts.append(f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{radius * scale:.1f}' fill='none' stroke='#111'/>")
        parts.append(f"<line x1='{x:.1f}' y1='{y:.1f}' x2='{u:.1f}' y2='{v:.1f}' stroke='#111'/>")
    label = html.escape(title, quote=True)
    return f"<svg viewBox='0 0 {SIZE} {SIZE}' role='img' aria-label='{label}'>{''.join(parts)}</svg>"


def _outline(points: Array) -> Array:
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return points


def _color(hand: Hand, model: HandModel, link: int) -> str:
    joints = {j for each in model.path(link) for j in model.links[each].joints}
    if not joints:
        return PALM_COLOR
    for number, finger in enumerate(hand.fingers):
        if joints <= {hand.joint_names.index(name) for name in finger.joint_names}:
            return COLORS[number % len(COLORS)]
    return PARKED_COLOR
