"""`python -m cosim` is `adcs`."""

from adcs_cosim import main

main()
