"""Data sets in the layouts of others; one module a layout, and nothing else lists them."""

from functools import cache

from fingersplit.dataset.layouts.layout import Layout
from fingersplit.registry import find_by_name

__all__ = ["available_layouts"]


@cache
def available_layouts() -> dict[str, Layout]:
    """Every layout by name."""
    return find_by_name("fingersplit.dataset.layouts", Layout)
