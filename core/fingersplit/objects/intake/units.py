"""Length units of files, and the sizes that a hand may meet."""

from fingersplit.errors import MeshError

__all__ = ["MAX_EXTENT", "MIN_EXTENT", "UNITS", "check_extent", "meters_per"]

UNITS: dict[str, float] = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
"""Length units that a file may be in [m]."""
MAX_EXTENT = 2.0
"""Most that the longest edge of an object's bounding box may be [m]."""
MIN_EXTENT = 0.002
"""Least that it may be [m]."""


def meters_per(unit: str) -> float:
    """Length of a unit [m].

    Raises:
        MeshError: The unit is not in `UNITS`.
    """
    if unit not in UNITS:
        raise MeshError("unknown_unit", f"Unknown length unit {unit!r}; known units: {', '.join(UNITS)}.")
    return UNITS[unit]


def check_extent(extent: float, unit: str) -> None:
    """Refuse an object whose bounding box has a longest edge [m] that no hand would meet.

    Raises:
        MeshError: It is too large or too small; the text says which units would make it plausible.
    """
    if extent == 0.0:
        raise MeshError("no_area", "All vertices lie at one point; an object needs a surface with an area.")
    if MIN_EXTENT <= extent <= MAX_EXTENT:
        return
    plausible = [
        f"{name!r} ({extent / UNITS[unit] * scale:.3g} m)"
        for name, scale in UNITS.items()
        if MIN_EXTENT <= extent / UNITS[unit] * scale <= MAX_EXTENT
    ]
    advice = f"the unit may be {' or '.join(plausible)}" if plausible else "no known unit makes it plausible"
    size = "too_large" if extent > MAX_EXTENT else "too_small"
    raise MeshError(
        size,
        f"The object is {extent:.3g} m in its largest extent with unit {unit!r}; it must be between "
        f"{MIN_EXTENT:g} m and {MAX_EXTENT:g} m: {advice}.",
    )
