import socket
from collections.abc import Callable

class TCPServer:
    is_shutdown: bool
    server_sock: socket.socket
    inbound_handler: Callable[[socket.socket, tuple[str, int]], None]
    def run(self) -> None: ...
