"""`python -m cosim` is `adcs`."""

from cosim.cli import app

app()
