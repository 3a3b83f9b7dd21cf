"""Where the hand models of others are: FINGERSPLIT_HANDS, else beside the repository, else nowhere."""

import os
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


def models_folder() -> Path | None:
    configured = os.environ.get("FINGERSPLIT_HANDS")
    if configured:
        return Path(configured)
    places = [parent / "shared" / "hands" for parent in (REPOSITORY.parent, REPOSITORY.parent.parent)]
    return next((place for place in places if place.is_dir()), None)
