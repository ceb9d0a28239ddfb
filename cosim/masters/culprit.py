"""Who made a value grow until it was not finite: often another unit than the one that met it."""

from collections.abc import Iterable, Mapping

from cosim.errors import StepFailed
from cosim.slaves.slave import Slave
from fmus.description.annotations import GROWS


def blame(failure: StepFailed, slaves: Mapping[str, Slave]) -> None:
    """Add to a failure the units that have warned, at their first step, that what decays grows in them."""
    if failure.grown:
        others = [(name, _warning(slave.messages)) for name, slave in slaves.items() if name != failure.component]
        failure.culprits = tuple(f"{name} is to blame: {warning}" for name, warning in others if warning)


def _warning(messages: Iterable[str]) -> str:
    return next((message for message in messages if GROWS in message), "")
