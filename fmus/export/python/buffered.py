"""CasADi functions as an FMU calls them: bound to its arrays once, then run again and again."""

from typing import Any

import numpy as np


class Buffered:
    """A CasADi function bound to arrays: a call allocates nothing and converts nothing."""

    def __init__(self, function: Any, arguments: list[np.ndarray], results: list[np.ndarray]):
        self._keep = (function, arguments, results)
        buffer, self.run = function.buffer()
        for i, array in enumerate(arguments):
            buffer.set_arg(i, array.data)
        for i, array in enumerate(results):
            buffer.set_res(i, array.data)
        self._buffer = buffer
