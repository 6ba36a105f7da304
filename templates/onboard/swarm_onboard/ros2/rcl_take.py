"""A subscription with the GID of each message's publisher, for rclpy before Kilted, which leaves it out.

It calls rcl directly. The layouts are those of Humble, Iron and Jazzy, which do not change any more.
"""

from __future__ import annotations

import ctypes
from typing import Any, Callable

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from rclpy.waitable import NumberOfEntities, Waitable


class _Allocator(ctypes.Structure):
    _fields_ = [(name, ctypes.c_void_p) for name in ("allocate", "free", "reallocate", "zero", "state")]


class _Bytes(ctypes.Structure):
    """rcutils_uint8_array_t."""

    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]


class _Info(ctypes.Structure):
    """rmw_message_info_t; longer than that of any distribution, whose GIDs have 16 or 24 bytes."""

    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_number", ctypes.c_uint64),
        ("reception_number", ctypes.c_uint64),
        ("implementation", ctypes.c_char_p),
        ("gid", ctypes.c_uint8 * 16),
        ("rest", ctypes.c_uint8 * 64),
    ]


class RclSubscription(Waitable):
    """Passes each message, with GID and times in ns, to ``take``."""

    def __init__(
        self,
        node: Any,
        message: Any,
        topic: str,
        take: Callable[[Any, bytes, int, int], None],
        profile: Any,
        *,
        raw: bool,
    ) -> None:
        super().__init__(node.default_callback_group)
        self._node, self._message, self._take, self._raw = node, message, take, raw
        if message.__class__._TYPE_SUPPORT is None:
            message.__class__.__import_type_support__()
        with node.handle:
            self._handle = rclpy_implementation.Subscription(
                node.handle, message, topic, profile.get_c_qos_profile()
            )
        self._index = 0
        self._rcl, utils = ctypes.CDLL("librcl.so"), ctypes.CDLL("librcutils.so")
        utils.rcutils_get_default_allocator.restype = _Allocator
        self._allocator = utils.rcutils_get_default_allocator()
        self._utils = utils

    def __enter__(self) -> None:
        self._handle.__enter__()

    def __exit__(self, *error: Any) -> None:
        self._handle.__exit__(*error)

    def get_num_entities(self) -> NumberOfEntities:
        return NumberOfEntities(num_subs=1)

    def add_to_wait_set(self, wait_set: Any) -> None:
        self._index = wait_set.add_subscription(self._handle)

    def is_ready(self, wait_set: Any) -> bool:
        return bool(wait_set.is_ready("subscription", self._index))

    def take_data(self) -> tuple[bytes, bytes, int, int] | None:
        """Returns the serialised message, the GID and both times; None if another thread took it."""
        data, info = _Bytes(), _Info()
        if self._utils.rcutils_uint8_array_init(ctypes.byref(data), 0, ctypes.byref(self._allocator)):
            return None
        try:
            subscription = ctypes.c_void_p(self._handle.pointer)
            taken = self._rcl.rcl_take_serialized_message(
                subscription, ctypes.byref(data), ctypes.byref(info), None
            )
            if taken:
                return None
            return (
                ctypes.string_at(data.buffer, data.length),
                bytes(info.gid),
                info.source_timestamp,
                info.received_timestamp,
            )
        finally:
            self._utils.rcutils_uint8_array_fini(ctypes.byref(data))

    async def execute(self, taken: tuple[bytes, bytes, int, int] | None) -> None:
        """Passes on what was taken."""
        if taken is not None:
            message, gid, sent, arrived = taken
            whole = message if self._raw else deserialize_message(message, self._message)
            self._take(whole, gid, sent, arrived)

    def end(self) -> None:
        """Ends the subscription."""
        self._node.remove_waitable(self)
        self._handle.destroy_when_not_in_use()
