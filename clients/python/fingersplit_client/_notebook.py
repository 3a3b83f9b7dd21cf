"""Results in notebooks."""

import base64
import html
from typing import Any

__all__ = ["result_html"]

_COLUMNS = ("rank", "feasible", "holding margin [N]", "in simulation", "Ferrari-Canny [N]", "palm [mm]")
_MAX_ROWS = 10


def result_html(result: Any, picture: bytes | None) -> str:
    """A table of a ``PlanResult``'s grasps, with the picture of the best where there is one (PNG)."""
    heading = f"{html.escape(result.hand)} on {html.escape(result.object.name)}"
    rows = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in _rows(result))
    names = "".join(f"<th>{name}</th>" for name in _COLUMNS)
    image = ""
    if picture is not None:
        image = f'<img alt="grasp" src="data:image/png;base64,{base64.b64encode(picture).decode()}">'
    return (
        f"<div><b>{heading}</b>: {html.escape(result.summary.message)}"
        f"<table><thead><tr>{names}</tr></thead><tbody>{rows}</tbody></table>{image}</div>"
    )


def _rows(result: Any) -> list[tuple[str, ...]]:
    verdicts = {None: "", True: "held", False: "did not hold"}
    return [
        (
            str(grasp.rank),
            "yes" if grasp.feasible else "no",
            "" if grasp.metrics.holding_margin is None else f"{grasp.metrics.holding_margin:.2f}",
            verdicts[grasp.held],
            f"{grasp.metrics.ferrari_canny:.3f}",
            " ".join(f"{1e3 * x:.0f}" for x in grasp.palm.position),
        )
        for grasp in result.grasps[:_MAX_ROWS]
    ]
