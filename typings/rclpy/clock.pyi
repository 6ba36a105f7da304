from typing import Any

class Clock:
    def now(self) -> Any: ...
