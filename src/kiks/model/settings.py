"""The settings of a run as files give them: the seed, thinking time, speed and end."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from kiks.model.atomic_files import check_relative
from kiks.model.checks import SECONDS_MAX
from kiks.model.data_file import Number, Text, Whole
from kiks.model.radio_link import parse_link
from kiks.model.thinking_policy import split_thinking


def _check_thinking(thinking: str) -> str:
    if isinstance(file := split_thinking(thinking)[1], str):
        check_relative(file, "thinking's replay file")
    return thinking


def _check_link(link: str) -> str:
    parse_link(link)
    return link


Seed = Annotated[Whole, Field(ge=0, le=2**63 - 1)]
ThinkingPolicy = Annotated[Text, AfterValidator(_check_thinking)]
LinkName = Annotated[Text, AfterValidator(_check_link)]
Speed = Annotated[Number, Field(ge=1e-3, le=1e3, description="1 is real time.")]
Seconds = Annotated[Number, Field(gt=0, le=SECONDS_MAX)]
