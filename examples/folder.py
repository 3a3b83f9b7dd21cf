"""Plan for a folder of meshes; run again it goes on where it was: python folder.py meshes results."""

import sys
from pathlib import Path

from fingersplit_client import Client

with Client() as client:
    for planned in client.plan_many(sorted(Path(sys.argv[1]).glob("*.ply")), folder=sys.argv[2], starts=16):
        print(planned.path.name, "(there already)" if planned.resumed else "", planned.result or planned.error)
