"""Data sets: many grasps of many objects, filled by the workers."""

from typing import Annotated, Any

from fastapi import APIRouter, Path, Response
from fastapi.responses import FileResponse

from fingersplit_client.schemas import Dataset, DatasetCreate, DatasetPage
from fingersplit_service.dependencies import Datasets
from fingersplit_service.endpoints.documents import ID_PATTERN, Cursor, Limit, next_cursor, place
from fingersplit_service.jobs.dataset_service import document_of, summary_of
from fingersplit_service.problems import ProblemKind, problem_answers
from fingersplit_service.security.access import Planner, Reader

__all__ = ["PATH", "router"]

PATH = "/v1/datasets"
_ONE = PATH + "/{dataset_id}"
_NOT_THERE = problem_answers(ProblemKind.NOT_FOUND, ProblemKind.INVALID_REQUEST)
_Index = Annotated[int, Path(description="Place of the object in the order.", ge=0, le=100_000)]
_Round = Annotated[int, Path(description="Number of the round.", ge=0, le=100_000)]
DatasetId = Annotated[str, Path(description="Id of a data set.", max_length=64, pattern=ID_PATTERN)]
router = APIRouter(tags=["datasets"])


class _ShardResponse(FileResponse):
    """An HDF5 file."""

    media_type = "application/x-hdf5"


@router.post(
    PATH,
    status_code=202,
    summary="Ask for a data set",
    responses=problem_answers(ProblemKind.INVALID_REQUEST, ProblemKind.NOT_READY),
)
async def create_dataset(datasets: Datasets, principal: Planner, asked: DatasetCreate, response: Response) -> Dataset:
    """Have rounds planned until every object has as many grasps as wanted, or is given up.

    Rounds are jobs: they wait their turn, count against limits, and go on after a restart where they were.
    """
    found = await datasets.create(principal.owner, asked)
    response.headers["Location"] = f"{PATH}/{found.row.id}"
    return document_of(found)


@router.get(PATH, summary="List data sets", responses=problem_answers(ProblemKind.INVALID_REQUEST))
async def list_datasets(
    datasets: Datasets, principal: Reader, limit: Limit = 100, cursor: Cursor = None
) -> DatasetPage:
    """Data sets and how far they are, newest first."""
    found = await datasets.page(principal.owner, place(cursor), limit)
    numbers = [one.row.number for one in found]
    return DatasetPage(items=[summary_of(one) for one in found], next_cursor=next_cursor(numbers, limit))


@router.get(_ONE, summary="Get a data set", responses=_NOT_THERE)
async def get_dataset(datasets: Datasets, principal: Reader, dataset_id: DatasetId) -> Dataset:
    """How far a data set is: its objects, their shards, and why objects were given up."""
    return document_of(await datasets.get(principal.owner, dataset_id))


@router.post(_ONE + "/cancel", summary="Cancel a data set", responses=_NOT_THERE)
async def cancel_dataset(datasets: Datasets, principal: Planner, dataset_id: DatasetId) -> Dataset:
    """Begin no more rounds and end those that run; shards that are there stay."""
    return document_of(await datasets.cancel(principal.owner, dataset_id))


@router.delete(_ONE, status_code=204, summary="Delete a data set", responses=_NOT_THERE)
async def delete_dataset(datasets: Datasets, principal: Planner, dataset_id: DatasetId) -> None:
    """Delete a data set with the jobs of its rounds; one that is being filled is cancelled first."""
    await datasets.delete(principal.owner, dataset_id)


@router.get(
    _ONE + "/manifest", response_model=dict[str, Any], summary="Get a data set's manifest", responses=_NOT_THERE
)
async def get_manifest(datasets: Datasets, principal: Reader, dataset_id: DatasetId) -> dict[str, Any]:
    """The `dataset.json` that makes a folder of downloaded shards a data set."""
    return await datasets.manifest(principal.owner, dataset_id)


@router.get(
    _ONE + "/shards/{index}/{number}",
    response_class=_ShardResponse,
    summary="Get a shard",
    responses=_NOT_THERE | problem_answers(ProblemKind.GONE, ProblemKind.WORKER_FAILED),
)
async def get_shard(
    datasets: Datasets, principal: Reader, dataset_id: DatasetId, index: _Index, number: _Round
) -> _ShardResponse:
    """One round of one object as HDF5, also while others are planned."""
    path, name = await datasets.shard(principal.owner, dataset_id, index, number)
    headers = {"Cache-Control": "private, max-age=86400"}
    return _ShardResponse(path, headers=headers, filename=name.rpartition("/")[2])
