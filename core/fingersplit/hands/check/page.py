"""The report as a page: tables, and drawings of the hand at its preshapes and at half closure."""

import html
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from fingersplit.hands.check.checking import report_lines
from fingersplit.hands.fitting import primitive_points
from fingersplit.hands.forward import link_poses
from fingersplit.hands.hand import Hand
from fingersplit.hands.model import HandModel
from fingersplit.transforms import transform_points

__all__ = ["report_page"]

Array = NDArray[np.float64]

SIZE = 260
"""Edge of a drawing [px]."""
COLORS = ("#e07a3f", "#3f7ae0", "#3fa860", "#a04fc0", "#c0a030")
PALM_COLOR, PARKED_COLOR = "#8a8f98", "#c9ccd2"


def report_page(hand: Hand, report: dict[str, Any]) -> str:
    """HTML that stands alone: no scripts, nothing loaded."""
    coupling = hand.model.coupling
    half = hand.model.joints_from_drivers((coupling.lower + coupling.upper) / 2)
    figures = [("all drivers half-way", hand, half)]
    for number, grip in enumerate(hand.grips):
        figures += [(f"grip {number}, preshape {k}", grip, joints) for k, joints in enumerate(grip.gripper.preshapes)]
    drawings = "".join(_figure(title, grip, joints) for title, grip, joints in figures)
    lines = "\n".join(html.escape(line) for line in report_lines(report))
    advice = "".join(f"<li>{html.escape(text)}</li>" for text in report["advice"]) or "<li>Nothing to change.</li>"
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{html.escape(hand.title)}</title>"
        "<style>body{font:15px system-ui;margin:2em;max-width:70em}figure{display:inline-block;margin:.5em}"
        "figcaption{text-align:center;color:#555}svg{background:#f6f7f9;border-radius:6px}pre{line-height:1.4}</style>"
        f"<h1>{html.escape(hand.title)}</h1><h2>What to change</h2><ul>{advice}</ul>"
        f"<h2>Postures</h2><p>Seen along the approach and along the lateral axis; pads are circles.</p>{drawings}"
        f"<h2>Numbers</h2><pre>{lines}</pre></html>"
    )


def _figure(title: str, hand: Hand, joints: Array) -> str:
    views = [hand.gripper.palm_from_gripper[:, [0, 1]], hand.gripper.palm_from_gripper[:, [1, 2]]]
    return "".join(
        f"<figure>{_drawing(hand, joints, axes)}<figcaption>{html.escape(title)}</figcaption></figure>"
        for axes in views
    )


def _drawing(hand: Hand, joints: Array, axes: Array) -> str:
    """Outlines of collision shapes projected along one direction, the farthest first, as SVG."""
    model = hand.model
    poses = link_poses(model, joints)
    depth = np.cross(axes[:, 0], axes[:, 1])
    outlines = []
    for shape in model.shapes:
        points = transform_points(poses[shape.link] @ shape.pose, primitive_points(shape.kind, shape.size))
        outlines.append((float((points @ depth).mean()), _outline(points @ axes), _color(hand, model, shape.link)))
    everything = np.vstack([outline for _, outline, _ in outlines])
    low, span = everything.min(axis=0), float(np.ptp(everything, axis=0).max())
    scale = (SIZE - 20) / span

    def place(points: Array) -> Array:
        return np.column_stack([10 + (points[:, 0] - low[0]) * scale, SIZE - 10 - (points[:, 1] - low[1]) * scale])

    parts = []
    for _, outline, color in sorted(outlines, key=lambda each: each[0]):
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in place(outline))
        parts.append(f"<polygon points='{corners}' fill='{color}' fill-opacity='.75' stroke='#333' stroke-width='.6'/>")
    for pad in hand.pads:
        center = poses[pad.link, :3, :3] @ pad.center + poses[pad.link, :3, 3]
        tip = center + (pad.radius + 0.012) * (poses[pad.link, :3, :3] @ pad.normal)
        (x, y), (u, v) = place(np.stack([center @ axes, tip @ axes]))
        parts.append(f"<circle cx='{x:.1f}' cy='{y:.1f}' r='{pad.radius * scale:.1f}' fill='none' stroke='#111'/>")
        parts.append(f"<line x1='{x:.1f}' y1='{y:.1f}' x2='{u:.1f}' y2='{v:.1f}' stroke='#111'/>")
    return f"<svg width='{SIZE}' height='{SIZE}' role='img'>{''.join(parts)}</svg>"


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
