"""`python -m cosim` is `adcs`."""

from cosim.cli.commands import app

app()
