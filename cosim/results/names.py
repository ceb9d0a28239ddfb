"""The files of a result folder."""

FORMATS = ("parquet", "csv", "mat")
STREAM = "result.arrows"
"""The rows while a run goes on, readable whatever ends it."""

INFO = "run.json"
CHECKPOINT = "checkpoint.bin"
"""What a run goes on from (checkpoint.py)."""

FILES = (*(f"result.{kind}" for kind in FORMATS), STREAM, CHECKPOINT, INFO)
"""What a result folder can hold."""

PARTS = tuple(f".{name}" for name in FILES)
"""The same while they are written, and after the process that wrote them has died."""
