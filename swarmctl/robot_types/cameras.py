"""The camera of a robot: its settings, and the requests of its protocol that follow from them."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import Field

from swarmctl.field_types import Model
from swarmctl.robot_types.protocols import BinaryProtocol
from swarmctl.robot_types.sensors import Encoding, Image, ImageSide, Sensor, Zoom


class CameraSettings(Model):
    """Size and encoding of one robot's images. What is left out comes from its type."""

    width: ImageSide | None = Field(None, description="Columns of an image.")
    height: ImageSide | None = Field(None, description="Rows of an image.")
    zoom: Zoom | None = Field(
        None, description="Pixels of the chip, across and down, that make one of the image."
    )
    encoding: Encoding | None = Field(
        None, description="`mono8`: grey; `rgb565`: colour, in twice as many bytes."
    )


NO_CAMERA_SETTINGS = CameraSettings()  # shared by all robots that set nothing


def camera_of(sensors: Mapping[str, Sensor]) -> tuple[str, Image] | None:
    """The camera among the sensors of a type, and its name."""
    return next(((name, one) for name, one in sensors.items() if isinstance(one, Image)), None)


def tuned(image: Image, camera: CameraSettings) -> Image:
    """Returns the camera with the settings; ``complaints`` checks whether the robot supports them."""
    return image.model_copy(update=camera.model_dump(exclude_none=True))


def with_image_query(protocol: BinaryProtocol, query: str, image: Image, *, on: bool) -> BinaryProtocol:
    """Returns the protocol with the query for such images and, if the camera is on, its setup request."""
    queries = {**protocol.queries, query: protocol.queries[query].of_camera(image.camera_values, image.count)}
    setup = (
        *protocol.setup,
        *([image.prepare.filled(image.camera_values, protocol.byte_order)] if on else []),
    )
    return protocol.model_copy(update={"queries": queries, "setup": setup})
