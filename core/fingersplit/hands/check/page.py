"""The report as a page: what to change, drawings of the hand at its preshapes and at half closure, and tables."""

import html
import re
from collections.abc import Iterable, Sequence
from typing import Any

from fingersplit.hands.check.checking import torque_text
from fingersplit.hands.check.drawings import draw_posture
from fingersplit.hands.hand import Hand

__all__ = ["report_page"]

_STYLE = """
:root{color-scheme:light dark;--ink:#1d2129;--soft:#5b6370;--line:#d9dde3;--paper:#fff;--figure:#f4f5f7}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ec;--soft:#a3abb8;--line:#3a404a;--paper:#16181d;--figure:#d5d8de}}
body{font:15px/1.5 system-ui,sans-serif;margin:0 auto;padding:1.5em;max-width:72em}
body{color:var(--ink);background:var(--paper)}
h1{font-size:1.6em;margin-bottom:0}h2{font-size:1.2em;margin-top:2em}h3{font-size:1em;margin:1.5em 0 .3em}
.hint,figcaption{color:var(--soft)}.figures{display:flex;flex-wrap:wrap;gap:1em}figure{margin:0;flex:0 1 25em}
figure div{display:flex;gap:.4em}svg{flex:1;min-width:0;background:var(--figure);border-radius:6px}
.wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{text-align:left;vertical-align:top;padding:.25em 1.2em .25em 0;border-bottom:1px solid var(--line)}
th,td{min-width:5.5em}td:nth-child(4){min-width:20em}
th{color:var(--soft);font-weight:500;white-space:nowrap}code{overflow-wrap:anywhere}
"""


def report_page(hand: Hand, report: dict[str, Any]) -> str:
    """HTML that stands alone: no scripts, nothing loaded."""
    coupling = hand.model.coupling
    half = hand.model.joints_from_drivers((coupling.lower + coupling.upper) / 2)
    many = len(hand.grips) > 1
    drawings = [draw_posture("all drivers half-way", hand, half)]
    for number, grip in enumerate(hand.grips, 1):
        where = f"grip {number}, " if many else ""
        drawings += [draw_posture(f"{where}preshape {k}", grip, q) for k, q in enumerate(grip.gripper.preshapes, 1)]
    title = html.escape(report["title"])
    facts = (
        f"{len(report['joints'])} joints, {len(report['drivers'])} drivers, {len(report['shapes'])} collision shapes"
    )
    sections = [
        _list("What to change", report["advice"] or ["Nothing to change."]),
        "<h2>Postures</h2><p class='hint'>Left along the approach, right along the lateral axis. Circles are pads, "
        f"their lines the normals; light grey fingers are parked.</p><div class='figures'>{''.join(drawings)}</div>",
        _drivers(report),
        *(_grip(number, grip, report.get("trial", []), many) for number, grip in enumerate(report["grips"], 1)),
        _shapes(report),
        _list("Notes", report["notes"]) if report["notes"] else "",
    ]
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width,initial-scale=1'>"
        f"<title>{title}</title><style>{_STYLE}</style><h1>{title}</h1>"
        f"<p class='hint'>{html.escape(report['name'])}, {report['sha256'][:12]}: {facts}</p>{''.join(sections)}</html>"
    )


def _drivers(report: dict[str, Any]) -> str:
    rows = [(d["name"], f"{d['lower']:.3f} to {d['upper']:.3f}", torque_text(d)) for d in report["drivers"]]
    found = "<h2>Drivers</h2>" + _table(("driver", "range [rad]", "torque [N m]"), rows)
    coupled = [
        (
            c["joint"],
            " ".join(f"{ratio:+.4g} {name}" for name, ratio in c["ratios"].items()) + f" {c['offset']:+.4g}",
            f"{c['half_way']:.3f}",
        )
        for c in report["couplings"]
    ]
    headings = ("joint", "follows", "drivers half-way [rad]")
    return found + ("<h2>Couplings</h2>" + _table(headings, coupled) if coupled else "")


def _grip(number: int, grip: dict[str, Any], trials: Sequence[dict[str, Any]], many: bool) -> str:
    opposition = grip["opposition"]
    openings = opposition["openings"]
    span = f", {1e3 * openings[0]:.0f} to {1e3 * openings[1]:.0f} mm apart" if openings else ""
    nearest = min(grip["self_collision"], key=lambda pair: float(pair["distance"]), default=None)
    met = f"{' and '.join(nearest['shapes'])}: {1e3 * nearest['distance']:.1f} mm" if nearest else "none that may meet"
    rows = [
        ("jaws", " | ".join(", ".join(jaw) for jaw in grip["jaws"])),
        ("jaws face each other", f"in {1e6 * opposition['volume']:.0f} cm³{span}"),
        *(
            (f"reach of {r['finger']}", f"{1e3 * r['nearest']:.0f} to {1e3 * r['farthest']:.0f} mm from the palm")
            for r in grip["reach"]
        ),
        ("nearest at the preshapes", met),
        ("pads against MuJoCo", f"{grip['kinematics_error']:.1e} m, Jacobians {grip['jacobian_error']:.1e} m/rad"),
    ]
    found = f"<h2>Grip{f' {number}' if many else ''}</h2>" + _table((), rows)
    own = [trial for trial in trials if trial["jaws"] == grip["jaws"]]
    if own:
        found += "<h3>Tried on simple objects</h3>" + _table(("object", "feasible", "ends", "advice"), map(_tried, own))
    return found


def _tried(trial: dict[str, Any]) -> tuple[str, ...]:
    ends = ", ".join(f"{name} {count}" for name, count in trial["terminations"].items())
    return trial["object"], f"{trial['feasible']} of {trial['starts']}", ends, " ".join(trial["advice"])


def _shapes(report: dict[str, Any]) -> str:
    rows = [(s["link"], s["name"], f"{1e3 * s['overhang']:.1f}") for s in report["shapes"]]
    return "<h2>Collision shapes</h2>" + _table(("link", "shape", "beyond its solids [mm]"), rows)


def _list(title: str, texts: Iterable[str]) -> str:
    items = (re.sub("`([^`]*)`", r"<code>\1</code>", html.escape(text)) for text in texts)
    return f"<h2>{title}</h2><ul>{''.join(f'<li>{item}</li>' for item in items)}</ul>"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; without headings the first column takes their place."""
    lines = [_cells("th", headings)] if headings else []
    lines += [_cells("td", row) if headings else _cells("th", row[:1]) + _cells("td", row[1:]) for row in rows]
    return f"<div class='wide'><table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table></div>"


def _cells(tag: str, texts: Iterable[str]) -> str:
    return "".join(f"<{tag}>{html.escape(text)}</{tag}>" for text in texts)
