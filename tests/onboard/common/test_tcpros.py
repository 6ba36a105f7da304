"""Connection headers of TCPROS: what is packed is read, and bytes that are none are an error in words."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.common.tcpros import counted, packed, read_header
from swarm_onboard.common.xmlrpc import PeerError


def read(data: bytes, largest: int = 4096) -> dict[str, str]:
    async def fed() -> dict[str, str]:
        reader = asyncio.StreamReader()
        reader.feed_data(data)
        reader.feed_eof()
        return await read_header(reader, largest)

    return asyncio.run(fed())


@given(
    st.dictionaries(st.sampled_from(["callerid", "topic", "md5sum", "type", "error"]), st.text(max_size=40))
)
def test_what_is_packed_is_read(fields: dict[str, str]) -> None:
    assert read(packed(fields)) == fields


def test_the_bytes_are_those_of_the_page() -> None:
    assert (
        packed({"topic": "/a", "md5sum": "*"})
        == b"\x18\0\0\0" + b"\x08\0\0\0topic=/a" + b"\x08\0\0\0md5sum=*"
    )


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"HTTP/1.0 400\r\n\r\n", "does not speak TCPROS"),
        (counted(b"x" * 4097), "does not speak TCPROS"),
        (counted(b"\xff\xff\0\0type"), "cut short"),
        (counted(counted(b"topic=/a") + b"\1\0"), "cut short"),
    ],
)
def test_what_is_no_header_is_an_error_in_words(data: bytes, complaint: str) -> None:
    with pytest.raises(PeerError, match=complaint):
        read(data)
