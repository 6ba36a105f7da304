from socketserver import ThreadingMixIn
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

class SilenceableXMLRPCRequestHandler(SimpleXMLRPCRequestHandler): ...

class ThreadingXMLRPCServer(ThreadingMixIn, SimpleXMLRPCServer):
    def __init__(self, addr: tuple[str, int], log_requests: int = 1) -> None: ...
