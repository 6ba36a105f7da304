"""The model of ``index.json``, which describes a capsule. It may come from anybody: all has bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, model_validator
from pydantic.json_schema import GenerateJsonSchema

from swarmctl.field_types import Model
from swarmctl.remote.answer_check import printable

INDEX = "index.json"
SIGNATURE = f"{INDEX}.sig"
LONGEST = 4096  # characters of a text
_LONGEST_COMPLAINT = 300  # characters
_MOST_NUMBER = 1e300


class CapsuleError(Exception):
    """A folder is not a capsule, or cannot be made one; ``help`` is the advice."""

    def __init__(self, message: str, help: str) -> None:  # noqa: A002
        super().__init__(message)
        self.help = help


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("a control character or an invisible one")
    return text


def _inside(path: str) -> str:
    if any(part in ("", ".", "..") for part in path.split("/")):
        raise ValueError("a path that is not inside the folder")
    if path in (INDEX, SIGNATURE):
        raise ValueError("the index does not describe itself")
    return path


def plain(value: Any, levels: int = 4) -> Any:
    """Returns the value of a parameter: numbers and texts, and lists and mappings of these.

    Raises ``ValueError`` for another.
    """
    if isinstance(value, (list, tuple, dict)) and levels:
        for one in (*value, *value.values()) if isinstance(value, dict) else value:
            plain(one, levels - 1)
    elif isinstance(value, str):
        _printable(value)
    elif not isinstance(value, (bool, int, float)) or not abs(value) < _MOST_NUMBER:
        raise ValueError("no number, text or list of these")
    return value


Text = Annotated[str, Field(max_length=LONGEST), AfterValidator(_printable)]
Word = Annotated[Text, Field(min_length=1, max_length=255)]
InnerPath = Annotated[Text, AfterValidator(_inside)]
Moment = Annotated[float, Field(ge=0, le=1e11, description="Seconds since 1970.")]
Seconds = Annotated[float, Field(ge=0, le=1e9)]
Amount = Annotated[float, Field(ge=0, le=1e12)]


class Git(Model):
    """The commit of the folder of the spec, and whether something there differs from it."""

    commit: str = Field(pattern=r"^[0-9a-f]{40,64}$")
    changed: bool


class Clock(Model):
    """By how much a host's clock was ahead of the operator's, in s, and how wrong that may be."""

    ahead: float = Field(ge=-1e11, le=1e11)
    error: Seconds


class UsbDevice(Model):
    """A USB device. ``vendor`` and ``product``: its ids, in hexadecimal; ``serial``: its serial number.

    With ``--hash-serials`` that is ``sha256:`` and the first 16 digits of its SHA-256.
    """

    vendor: Text
    product: Text
    name: Text
    serial: Text
    ports: list[Text] = Field(max_length=1000)


class Host(Model):
    """A host of the trial; ``began``: when it started the programs, by its ``clock``.

    ``platform``: Linux distribution, machine and ROS, such as ``debian-12-x86_64-ros-1.15.15``; ``python``:
    its version; ``kernel``: release and version; ``model``: of the board or computer; ``packages``: the
    versions of what its drivers and programs need. All are empty if the host did not answer after the trial.
    """

    address: Text = ""
    release: Text
    began: Moment | None
    clock: Clock | None = None
    platform: Text = ""
    python: Text = ""
    kernel: Text = ""
    model: Text = ""
    devices: list[UsbDevice] = Field([], max_length=1000, description="At its USB, without hubs.")
    packages: Mapping[Word, Text] = Field({}, max_length=10_000)


class Robot(Model):
    """A robot, and the proof of its stop at the end; ``seconds``: how long it took to stand.

    ``port``: the device that its driver has, such as ``/dev/ttyUSB0``; ``firmware``: the version that it has
    sent to its driver.
    """

    host: Word
    type: Word
    state: Text
    proof: Text
    seconds: Seconds | None
    port: Text = ""
    firmware: Text = ""


class Judged(Model):
    """A condition of `success`, and what the bags show.

    ``wanted`` and ``found`` are, for ``reached``, m from the goal: its radius, and the least distance; for
    ``distance``, m; for ``count``, messages. ``found`` is None if the bags have none of it.
    """

    topic: Word
    condition: Literal["reached", "distance", "count"]
    wanted: Amount
    found: Amount | None
    met: bool


class File(Model):
    """What a file has to contain, and whether it may be executed, which a copy can lose; None: unknown."""

    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    bytes: int = Field(ge=0, lt=1 << 63)
    executable: bool | None = None


class Index(Model):
    """The whole file. ``began`` and ``ended`` are of the operator's clock; ``seconds`` were wanted.

    ``skew``: from the first host's start to the last one's.
    """

    v: Literal[1]
    swarm: Word
    experiment: Word
    trial: int = Field(ge=0, lt=1 << 31)
    began: Moment
    ended: Moment
    seconds: Seconds
    outcome: Literal["completed", "interrupted", "failed"]
    cause: Text
    parameters: Mapping[Word, Mapping[Text, Annotated[Any, AfterValidator(plain)]]] = Field(
        {}, max_length=1000, description="Of programs: those that differ from the spec's own."
    )
    success: bool | None = Field(None, description="Whether it was completed and all of `judged` is met.")
    judged: list[Judged] = Field([], max_length=1000)
    operator: Text
    swarmctl: Text = Field(description="The version.")
    spec: list[InnerPath] = Field(min_length=1, max_length=1000, description="The spec, then its overlays.")
    git: Git | None
    skew: Seconds | None
    hosts: Mapping[Word, Host] = Field(max_length=100_000)
    robots: Mapping[Word, Robot] = Field(max_length=100_000)
    files: Mapping[InnerPath, File] = Field(
        max_length=100_000, description="All others of the folder, by path."
    )

    def start(self, host: str) -> float:
        """Returns when the trial began by the clock of a host, or else of the operator: s since 1970."""
        here = self.hosts.get(host)
        return self.began if here is None or here.began is None else here.began

    @model_validator(mode="after")
    def _has_its_spec(self) -> Index:
        if missing := [path for path in self.spec if path not in self.files]:
            raise ValueError(f"{missing[0]} of `spec` is not one of `files`")
        return self


def index_schema() -> dict[str, Any]:
    """Returns the JSON Schema of an index, in draft 2020-12."""
    return {"$schema": GenerateJsonSchema.schema_dialect, **Index.model_json_schema()}


def problem_of(error: ValidationError) -> str:
    """Returns the first of the problems, harmless on a terminal."""
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(str(one)[:80] for one in first["loc"])
    text = f"{place}: {first['msg']}" if place else first["msg"]
    return printable(text.encode(errors="replace"))[:_LONGEST_COMPLAINT]
