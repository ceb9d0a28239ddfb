"""Native FMUs: FMU state, reset, instances that do not disturb each other."""

import math
import threading

import pytest

from .parts import every
from .slaves import Slave, names_of, refused

PARTS = every()
all_parts = pytest.mark.parametrize("name", PARTS)


def disturb(slave: Slave, inputs: list[str], k: int) -> None:
    """Set inputs, sometimes their derivatives too, in a way that depends on k."""
    slave.set({n: 0.01 * math.sin(k + i) for i, n in enumerate(inputs)})
    if inputs and k % 2:
        slave.setRealInputDerivatives(slave.vr(*inputs), [1] * len(inputs), [0.01 * k] * len(inputs))


@all_parts
def test_saved_state_gives_the_same_bits(open_slave, name):
    slave, other = open_slave(name), open_slave(name, "other")
    inputs, h = names_of(PARTS[name], name, "u"), 1e-3 if name == "Blowup" else 0.07
    slave.start()
    disturb(slave, inputs, 1)
    slave.doStep(0.0, h)
    disturb(slave, inputs, 3)
    state = slave.getFMUstate()
    data = slave.serializeFMUstate(state)

    def onwards(one: Slave) -> list[list[float]]:
        rows = []
        for k in range(1, 6):
            one.doStep(k * h, h)
            rows.append(one.everything())
            disturb(one, inputs, k)
        return rows

    first = onwards(slave)
    slave.setFMUstate(state)
    assert slave.serializeFMUstate(slave.getFMUstate()) == data
    assert onwards(slave) == first
    other.setFMUstate(other.deSerializeFMUstate(data))  # an instance that was never initialised
    assert onwards(other) == first
    slave.freeFMUstate(state)
    assert state.value is None


@pytest.mark.parametrize("name", ["Sum", "Swing"])
def test_a_flipped_bit_anywhere_is_refused(open_slave, name):
    slave = open_slave(name).start()
    slave.doStep(0.0, 0.15)
    data = slave.serializeFMUstate(slave.getFMUstate())
    for i in range(len(data)):
        flipped = bytes([data[i] ^ (1 << i % 8)])
        refused(slave.deSerializeFMUstate, data[:i] + flipped + data[i + 1 :])
        assert slave.messages.pop().startswith("fmi2DeSerializeFMUstate: ")
    flipped = bytes([data[-9] ^ 1])  # in the state itself: all that tells it is the checksum
    refused(slave.deSerializeFMUstate, data[:-9] + flipped + data[-8:])
    assert slave.messages == ["fmi2DeSerializeFMUstate: the bytes are damaged: their checksum is another."]
    slave.setFMUstate(slave.deSerializeFMUstate(data))
    slave.doStep(0.15, 0.1)


def test_state_holds_the_mode(open_slave):
    slave = open_slave("Swing").begin()
    state = slave.getFMUstate()
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)
    slave.setFMUstate(state)
    slave.set({"drive": 0.5})
    slave.exitInitializationMode()
    slave.doStep(0.0, 0.1)


def test_failed_step_can_be_taken_back(open_slave):
    slave = open_slave("Blowup").start()
    slave.doStep(0.0, 0.05)
    state, before = slave.getFMUstate(), slave.get("x[2]")
    refused(slave.doStep, 0.05, 0.5)
    slave.setFMUstate(state)
    slave.doStep(0.05, 0.01)
    assert slave.get("x[2]") > before


@all_parts
def test_reset_restores_everything(open_slave, name):
    slave, fresh = open_slave(name), open_slave(name, "fresh").start()
    inputs = names_of(PARTS[name], name, "u")
    blank = slave.serializeFMUstate(slave.getFMUstate())
    slave.start(start=3.0, stop=9.0)
    disturb(slave, inputs, 1)
    slave.doStep(3.0, 1e-3)
    slave.reset()
    assert slave.serializeFMUstate(slave.getFMUstate()) == blank
    slave.start()
    for one in (slave, fresh):
        one.doStep(0.0, 1e-3)
    assert slave.everything() == fresh.everything()


@all_parts
def test_instances_do_not_disturb_each_other(open_slave, name):
    """Two instances in two threads give what each gives alone."""
    inputs, h = names_of(PARTS[name], name, "u"), 1e-4 if name == "Blowup" else 0.03

    def run(slave: Slave, seed: int, rows: list) -> None:
        slave.start()
        for k in range(200):
            disturb(slave, inputs, k + seed)
            slave.doStep(k * h, h)
            rows.append(slave.everything())

    alone: list[list] = [[], []]
    for i in (0, 1):
        run(open_slave(name), i, alone[i])
    together: list[list] = [[], []]
    slaves = [open_slave(name, str(i)) for i in (0, 1)]
    threads = [threading.Thread(target=run, args=(slaves[i], i, together[i])) for i in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert together == alone
