"""FMUs that every package here is made of."""

from .packages import fmus as fmus
