"""What the twin of a native FMU's error is."""


class RuntimeFailure(Exception):
    """What an FMU reports as an error: the text names function, variable and time."""
