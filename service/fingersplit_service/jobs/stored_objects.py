"""Objects as workers load them."""

from functools import lru_cache
from typing import TYPE_CHECKING

from fingersplit_service.storage import Storage

if TYPE_CHECKING:
    from fingersplit.objects.mesh import Mesh
    from fingersplit.objects.model import ObjectModel

__all__ = ["prepared_object", "stored_mesh"]

_PREPARED_OBJECTS = 8  # kept ready by each worker


def stored_mesh(storage: Storage, object_id: str) -> "Mesh":
    """The checked mesh of an object."""
    import numpy as np

    from fingersplit.objects.mesh import Mesh

    with np.load(storage.mesh(object_id)) as arrays:
        return Mesh(arrays["vertices"], arrays["faces"])


@lru_cache(maxsize=_PREPARED_OBJECTS)
def prepared_object(storage: Storage, object_id: str, object_name: str) -> "ObjectModel":
    """An object ready to be planned for."""
    from fingersplit.objects.model import prepare_object

    return prepare_object(stored_mesh(storage, object_id), object_name)
