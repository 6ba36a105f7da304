from collections.abc import Sequence
from typing import Any

from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

class Context: ...

def init(
    *,
    args: Sequence[str] = ...,
    context: Context = ...,
    domain_id: int = ...,
    signal_handler_options: SignalHandlerOptions = ...,
) -> None: ...
def try_shutdown() -> None: ...
def create_node(
    name: str,
    *,
    namespace: str,
    context: Context = ...,
    parameter_overrides: Sequence[Parameter] = ...,
    start_parameter_services: bool = ...,
    enable_rosout: bool = ...,
) -> Any: ...
