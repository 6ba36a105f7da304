"""What was recorded on a host, and where its bags are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from swarmctl.capsule.bag_files import repair
from swarmctl.remote.host_recordings import Fetched
from swarmctl.views.escape import printable

_ENDINGS = {
    "": "",
    "stopped": "",
    "time": "for the whole time",
    "disk": "until its disk was nearly full",
    "failed": "until the recorder failed",
    "lost": "until the recorder was gone, as after a power cut",
}


def size(count: int) -> str:
    """Returns a number of bytes in MB."""
    return f"{count / 1e6:.1f} MB"


def lines(found: Fetched) -> Iterator[str]:
    """Yields a line for the host, and one for each of its bags."""
    recording = found.recording
    if recording is None or not found.bags:
        yield f"{found.host}  no bags"
    else:
        ended = _ENDINGS[recording.ended]
        yield f"{found.host}  {len(recording.topics)} topics {ended}".rstrip()
        if recording.output and recording.ended != "failed":
            yield f"    {printable(recording.output)}"
    for place, count in found.bags.items():
        yield f"    {place}  {size(count)}"
        if place.suffix == ".active":
            yield f"        it was not closed; `{repair(Path(place.name))}` repairs it"
