"""What is drawn in which colour, the same in pictures and in recordings."""

__all__ = [
    "COLLISION",
    "CONE",
    "FINGERS",
    "FORBIDDEN",
    "FORCE",
    "OBJECT",
    "OBSTACLE",
    "PARALLEL",
    "PHASES",
    "REFERENCE",
    "STEP",
    "SUPPORT",
    "WAY",
    "fractions",
    "rgba",
]

FINGERS = ("#d1495b", "#2a9d4e", "#e08e1b", "#7b4fb5", "#1f8a9e")
PHASES = {"map": "#9aa5b1", "cpo": "#f2c230", "ppo": "#4f8fd0", "settle": "#7ab8a0"}
"""CPO yellow and PPO blue, as in the quality profile of [Fan2018]."""
OBJECT = (92, 140, 199, 110)
PARALLEL = (150, 110, 220, 255)
CONE = (240, 190, 70, 70)
STEP = (242, 194, 48, 255)
REFERENCE = (255, 255, 255, 255)
COLLISION = (230, 40, 40, 255)
FORCE = (60, 190, 110, 255)
SUPPORT = (176, 140, 104, 120)
OBSTACLE = (214, 116, 62, 150)
FORBIDDEN = (214, 48, 49, 200)
WAY = (150, 110, 220, 255)


def rgba(color: str) -> tuple[int, int, int, int]:
    """A colour ``#rrggbb`` as red, green, blue and full opacity, 0 to 255."""
    red, green, blue = bytes.fromhex(color[1:])
    return red, green, blue, 255


def fractions(color: tuple[int, int, int, int]) -> tuple[float, float, float, float]:
    """A colour of 0 to 255 as fractions of full red, green, blue and opacity."""
    red, green, blue, opacity = color
    return red / 255, green / 255, blue / 255, opacity / 255
