"""What a caller knows of an object or wants of its preparation, beside its shape."""

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any, Self

from fingersplit.errors import SettingsError
from fingersplit.ranges import check_known, check_settings, setting

__all__ = ["ObjectOptions"]


@dataclass(frozen=True)
class ObjectOptions:
    """Options of one object; None means not known.

    Raises:
        SettingsError: A value outside its range, which stands in the field's metadata, or both density and mass.
    """

    density: float | None = setting(None, "kg/m^3", "Density, even over the object.", 1.0, 25_000.0)
    mass: float | None = setting(None, "kg", "Mass, instead of a density.", 1e-6, 100.0)
    friction: float | None = setting(None, "1", "Coulomb friction between its surface and pads.", 0.01, 5.0)
    fairing: float = setting(0.0, "m", "Wavelength attenuated by half, by implicit fairing.", 0.0, 0.05)

    def __post_init__(self) -> None:
        check_settings(self, "Object option {}")
        if self.density is not None and self.mass is not None:
            raise SettingsError("Both density and mass are given; the volume is known, so give one of them.")

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """Options from plain JSON data; what is left out keeps its default.

        Raises:
            SettingsError: An unknown name, or a value that is not allowed.
        """
        check_known(document, cls, "Unknown object option {}")
        return cls(**document)

    def to_document(self) -> dict[str, Any]:
        """All values as plain JSON data."""
        return asdict(self)

    @property
    def content_hash(self) -> str:
        """Hash of all values (16 hex digits)."""
        return hashlib.sha256(json.dumps(self.to_document(), sort_keys=True).encode()).hexdigest()[:16]
