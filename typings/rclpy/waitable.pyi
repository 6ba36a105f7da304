from typing import Any

class NumberOfEntities:
    def __init__(self, *, num_subs: int = ...) -> None: ...

class Waitable:
    def __init__(self, callback_group: Any) -> None: ...
