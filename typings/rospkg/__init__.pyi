class ResourceNotFound(Exception): ...

class Manifest:
    version: str

class RosPack:
    def get_manifest(self, name: str) -> Manifest: ...
