from collections.abc import Sequence
from typing import ClassVar

from rospy import Message
from std_msgs.msg import Header

class KeyValue(Message):
    key: str
    value: str
    def __init__(self, key: str = ..., value: str = ...) -> None: ...

class DiagnosticStatus(Message):
    OK: ClassVar[int | bytes]
    WARN: ClassVar[int | bytes]
    ERROR: ClassVar[int | bytes]
    level: int | bytes
    name: str
    message: str
    hardware_id: str
    values: Sequence[KeyValue]
    def __init__(
        self,
        *,
        level: int | bytes = ...,
        name: str = ...,
        message: str = ...,
        hardware_id: str = ...,
        values: Sequence[KeyValue] = ...,
    ) -> None: ...

class DiagnosticArray(Message):
    header: Header
    status: Sequence[DiagnosticStatus]
    def __init__(self, *, status: Sequence[DiagnosticStatus] = ...) -> None: ...
