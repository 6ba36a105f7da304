"""The camera of a robot: what may be tuned of it, and how a protocol asks for images that are so."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import Field

from swarmctl.spec.protocols import BinaryProtocol
from swarmctl.spec.sensors import Encoding, Image, ImageSide, Sensor, Zoom
from swarmctl.spec.words import Model


class CameraSettings(Model):
    """How the images of one robot are to be. What is left out is as its type has it."""

    width: ImageSide | None = Field(None, description="Columns of an image.")
    height: ImageSide | None = Field(None, description="Rows of an image.")
    zoom: Zoom | None = Field(
        None, description="Pixels of the chip, across and down, that make one of the image."
    )
    encoding: Encoding | None = Field(
        None, description="`mono8`: grey; `rgb565`: colour, in twice as many bytes."
    )


AS_BUILT = CameraSettings()  # most robots tune nothing, and share this


def camera_of(sensors: Mapping[str, Sensor]) -> tuple[str, Image] | None:
    """The camera among the sensors of a type, and its name."""
    return next(((name, one) for name, one in sensors.items() if isinstance(one, Image)), None)


def tuned(image: Image, camera: CameraSettings) -> Image:
    """With what is said of it; whether the robot can do that is for ``complaints`` to say."""
    return image.model_copy(update=camera.model_dump(exclude_none=True))


def asking(protocol: BinaryProtocol, query: str, image: Image, *, on: bool) -> BinaryProtocol:
    """The protocol with the question for such images and, if the camera is on, the request that sets it."""
    queries = {**protocol.queries, query: protocol.queries[query].of_camera(image.said, image.count)}
    setup = (*protocol.setup, *([image.prepare.filled(image.said, protocol.byte_order)] if on else []))
    return protocol.model_copy(update={"queries": queries, "setup": setup})
