"""Errors over HTTP: problem documents of RFC 9457."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["InvalidField", "Problem"]


class InvalidField(BaseModel):
    """One field of a request and what is wrong with it."""

    field: str = Field(description="Where it stands: JSON pointer in the body, or name of the parameter.")
    detail: str = Field(description="What is wrong with it and what would be right.")


class Problem(BaseModel):
    """What is wrong with a request, as ``application/problem+json``; new members may appear."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="Stable URI of this kind of problem.")
    title: str = Field(description="The kind of problem in a few words.")
    status: int = Field(description="HTTP status code.")
    detail: str = Field(description="What is wrong here and what would be right.")
    code: str | None = Field(default=None, description="Short name of the fault in a mesh file, such as `truncated`.")
    errors: list[InvalidField] = Field(default=[], description="The offending fields.")
    valid: list[Any] = Field(default=[], description="What would be valid, where that is a short list.")
    limit: int | None = Field(default=None, description="The limit that was exceeded, in the unit that detail names.")
