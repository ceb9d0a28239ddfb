"""The files of a result folder."""

FORMATS = ("parquet", "csv", "mat")
STREAM = "result.arrows"
"""The rows while a run goes on, readable whatever ends it."""

INFO = "run.json"
FILES = (*(f"result.{kind}" for kind in FORMATS), STREAM, INFO)
"""What a result folder can hold."""

PARTS = tuple(f".{name}" for name in FILES)
"""The same while they are written, and after the process that wrote them has died."""
