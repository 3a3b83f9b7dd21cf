"""Twenty robots plan at once; jobs of those that run out of time are cancelled: python fleet.py mug.ply 60."""

import asyncio
import sys

from fingersplit_client import AsyncClient


async def robot(number: int) -> object:
    """One robot with a client of its own."""
    async with AsyncClient() as client, asyncio.timeout(float(sys.argv[2])):
        return await client.plan(sys.argv[1], seed=number, starts=8)


async def main() -> None:
    """All robots side by side."""
    for outcome in await asyncio.gather(*map(robot, range(20)), return_exceptions=True):
        print(repr(outcome))


asyncio.run(main())
