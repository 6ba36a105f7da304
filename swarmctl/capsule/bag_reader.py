"""Opens bags of ROS 1 and ROS 2 with rosbags, whatever is wrong with them, and reads poses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

from swarmctl.capsule.bag_files import repair


class DamagedBag(Exception):  # noqa: N818
    """Why a bag cannot be read, and what repairs it."""


@contextmanager
def opened(bag: Path) -> Iterator[AnyReader]:
    """Yields a reader of a bag. Raises ``DamagedBag``, also of what fails in the body of ``with``."""
    try:
        if not bag.is_file() and not bag.is_dir():  # such as a pipe, which would wait for a writer
            raise ValueError("neither file nor folder")
        with AnyReader([bag], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield reader
    except Exception as error:  # of a damaged bag, rosbags raises anything
        raise DamagedBag(_trouble(bag, error)) from error


def _trouble(bag: Path, error: Exception) -> str:
    if bag.suffix == ".active":
        renaming = f", then name it {bag.stem}" if bag.stem.endswith(".bag") else ""
        return f"it was not closed. `{repair(bag)}`{renaming}"
    if bag.suffix == ".bag" and isinstance(error, AnyReaderError) and "index" in str(error):
        return f"its index is missing or damaged. `rosbag reindex {bag}`"
    return "it is damaged, or no bag"
