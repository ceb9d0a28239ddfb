"""Which calls FMI 2.0 allows when: the state machine of native/fmi2.c, in the same words."""

from fmus.export.python.failure import RuntimeFailure

INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED, FAILED = 1, 2, 4, 8, 16
ANY = 31
SETTABLE = INSTANTIATED | INITIALIZATION | STEPPING
GETTABLE = INITIALIZATION | STEPPING | TERMINATED | FAILED

_IN_WORDS = {
    INSTANTIATED: "before initialization mode",
    INITIALIZATION: "in initialization mode",
    STEPPING: "after initialization",
    TERMINATED: "after fmi2Terminate",
    FAILED: "after an error",
}


def admit(mode: int, function: str, modes: int) -> None:
    """Raise RuntimeFailure where an FMI function may not be called in a mode."""
    if not mode & modes:
        raise RuntimeFailure(f"{function}: not allowed {_IN_WORDS[mode]}.")
