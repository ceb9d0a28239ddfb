"""A fake vehicle, or several, wired in one call; and the mistakes of it."""

import pytest

from cosim.errors import WiringErrors
from cosim.system import Connection, System
from cosim.system.expand import wire

from .fakes import Vehicle

HELD = {"plant.tau_B": [0.0, 0.0, 0.0], "plant.angle": 0.0}


def wired(connections=(), slaves=None, **system):
    slaves = slaves or [Vehicle()]
    system = {"held": HELD} | system
    made = System(
        name="test",
        components=dict.fromkeys((s.name for s in slaves), ""),
        connections=[Connection(*c) for c in connections],
        **system,
    )
    return wire(made, {s.name: s.description for s in slaves})


def mistakes(connections=(), slaves=None, **system) -> list[str]:
    with pytest.raises(WiringErrors) as caught:
        wired(connections, slaves, **system)
    return [str(m) for m in caught.value.mistakes]


def only(*arguments, **keywords) -> str:
    (mistake,) = mistakes(*arguments, **keywords)
    return mistake


def zero(*names):
    held = {}
    for name in names:
        if "." in name:
            held[name] = [0, 0, 0] if "tau_B" in name else 0
        else:
            held |= {f"{name}.tau_B": [0, 0, 0], f"{name}.angle": 0}
    return held
