from typing import Any

class Parameter:
    def __init__(self, name: str, *, value: Any) -> None: ...
