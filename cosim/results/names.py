"""The files of a result folder."""

FORMATS = ("parquet", "csv", "mat")
STREAM = "result.arrows"
"""The rows while a run goes on, readable whatever ends it."""

INFO = "run.json"
FILES = (*(f"result.{kind}" for kind in FORMATS), STREAM, INFO)
"""What a result folder can hold."""
