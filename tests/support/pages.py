"""What the browser tests look at: a mesh to plan for, and the sizes of the window."""

from pathlib import Path

from playwright.sync_api import ViewportSize

MUG = Path(__file__).parents[2] / "examples" / "objects" / "mug.ply"
LAPTOP, PHONE = ViewportSize(width=1280, height=800), ViewportSize(width=390, height=844)
