from collections.abc import Sequence

from rospy import Message, Time

class Header:
    seq: int
    stamp: Time
    frame_id: str

class MultiArrayDimension(Message):
    label: str
    size: int
    stride: int
    def __init__(self, *, label: str = ..., size: int = ..., stride: int = ...) -> None: ...

class MultiArrayLayout(Message):
    dim: Sequence[MultiArrayDimension]
    data_offset: int

class Bool(Message):
    data: bool

class String(Message):
    data: str
    def __init__(self, *, data: str = ...) -> None: ...

class UInt8(Message):
    data: int

class UInt8MultiArray(Message):
    layout: MultiArrayLayout
    data: bytes

class UInt16MultiArray(Message):
    layout: MultiArrayLayout
    data: Sequence[int]
    def __init__(self, *, data: Sequence[int] = ...) -> None: ...

class Float32MultiArray(Message):
    layout: MultiArrayLayout
    data: Sequence[float]
    def __init__(self, *, data: Sequence[float] = ...) -> None: ...
