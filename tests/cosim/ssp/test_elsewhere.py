"""Exported systems in other masters, which pass outputs on at communication points: the numbers of the plain exchange.

The reference is a loop on fmpy that has no line of this project (by_hand.py). The plain exchange gives its bits, in the
kernel and in Python: both take the times t_k = k p / q, rounded once, and initialize until nothing changes. Other tools
make their times in other ways (t + h, or whole nanoseconds) and leave out the exchange in initialization mode.

Tools marked `peers` run in the interpreter that ADCS_PEERS_PYTHON names, else in that of the tests.
"""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np
import pytest

from cosim import Experiment, Explicit, Library, Result, System, load, simulate
from cosim.cli.packing import export

from ..by_hand import SSD, Package

STEPS = {"zhang2018-ppatc": 400, "xiao2011-pid": 200, "geng2012-compensated": 200}
PEERS = Path(__file__).parent / "peers"
PYTHON = os.environ.get("ADCS_PEERS_PYTHON", sys.executable)

CLOSE = 1e-9
"""Of a variable's largest value. A step of h = 1 ms adds h x' to a state, with roundings of eps = 1.1e-16 of the state,
of x' and of h, for tools differ in the last bit of t and h; n = 400 steps make 3 n eps = 1.3e-13, and the fastest mode
of these loops (570 1/s) decays. A value that is one step late in one exchange and not in the other is off by h x'/x,
1e-5 and more."""


@dataclass(frozen=True)
class Flight:
    """A package flown by hand: rows of outputs, and the outputs that follow no input at once."""

    path: Path
    package: Package
    system: System
    experiment: Experiment
    times: list[float]
    rows: dict[str, np.ndarray]
    units: dict

    @property
    def states(self) -> list[tuple[str, str]]:
        """Outputs that are the same whether a tool reads them before or after the inputs are set anew."""
        return [(name, output) for name, unit in self.units.items() for output in unit.of_states()]

    def column(self, name: str, output: str) -> np.ndarray:
        return self.rows[name][:, self.units[name].outputs.index(output)]

    def here(self, kernel: Literal["auto", "always", "never"] = "auto") -> Result:
        setup = Experiment(
            stop_time=self.times[-1],
            communication_step_size=self.times[1],
            master=Explicit("plain", kernel=kernel),
        )
        return simulate(self.system, setup, locate=Library())


@pytest.fixture(scope="module", params=STEPS)
def flight(request, tmp_path_factory):
    """A package of each system, exported once."""
    folder = tmp_path_factory.mktemp("flight")
    system, experiment = load(request.param)
    path = folder / f"{request.param}.ssp"
    export(path, system, experiment, Library())
    package, per_second = Package(path, folder), round(1 / float(experiment.communication_step_size))
    times = [k / per_second for k in range(STEPS[request.param] + 1)]
    return Flight(path, package, system, experiment, times, *package.fly(times))


@pytest.mark.parametrize("kernel", ["always", "never"])
def test_the_plain_exchange_is_a_loop_on_fmpy_bit_for_bit(flight, kernel):
    result = flight.here(kernel=kernel)
    assert result.info["loop"]["name"] == {"always": "kernel", "never": "python"}[kernel]
    compared = [(name, output) for name, unit in flight.units.items() for output in unit.outputs]
    assert {port for port in compared if (flight.column(*port) != result[".".join(port)]).any()} == set()
    assert result.time.tolist() == flight.times


def test_fmus_start_right_without_an_exchange_in_initialization_mode(flight):
    """Their inputs have as start values what is connected to them, and what holds them."""
    rows, units = flight.package.fly(flight.times[:3], sweeps=0)
    for name in units:
        assert rows[name].tolist() == flight.rows[name][:3].tolist()


def test_the_stop_time_is_that_of_the_experiment(flight):
    default = ElementTree.parse(flight.package.folder / "package" / "SystemStructure.ssd").find(
        f"{SSD}DefaultExperiment"
    )
    told = {float(unit.description.defaultExperiment.stopTime) for unit in flight.units.values()}
    assert told == {float(default.get("stopTime"))} == {float(flight.experiment.stop_time)}


# ---- other tools ---------------------------------------------------------------------------------------------------


def flown_in(tool, flight, inputs=None):
    """Run the script of a tool; return how it ended, and the final values of `flight.states` for each flight."""
    if subprocess.run([PYTHON, "-c", f"import {tool}"], capture_output=True).returncode != 0:
        pytest.skip(f"{tool}, or a library that it needs, is not installed")
    files = flight.package.files
    told = {
        "ssp": str(flight.path),
        "fmus": {name: str(file) for name, file in files.items()},
        "links": flight.package.links,
        "names": flight.states,
        "inputs": starts(flight) if inputs is None else inputs,
        "step": flight.times[1],
        "steps": len(flight.times) - 1,
    }
    described = flight.package.folder / f"{tool}.flight.json"
    described.write_text(json.dumps(told))
    script = str(PEERS / f"in_{tool}.py")
    done = subprocess.run([PYTHON, script, str(described)], capture_output=True, text=True)
    return done, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("[")]


def starts(flight):
    """Start values of all inputs."""
    return {
        name: {v.name: float(v.start) for v in unit.description.modelVariables if v.causality == "input"}
        for name, unit in flight.units.items()
    }


def compare(flight, found):
    result = flight.here()
    for port, value in zip(flight.states, found, strict=True):
        own = result[".".join(port)]
        assert abs(value - own[-1]) <= CLOSE * np.abs(own).max(), port


@pytest.mark.peers
@pytest.mark.parametrize(("tool", "flights"), [("ecospy", 2), ("libcosimpy", 2), ("cofmupy", 1)])
def test_another_master(flight, tool, flights):
    """ecos and libcosim: the package as it is, and its FMUs wired by their own means."""
    done, found = flown_in(tool, flight)
    assert done.returncode == 0 and len(found) == flights, done.stdout + done.stderr
    for end in found:
        compare(flight, end)


@pytest.mark.peers
def test_cofmupy_without_start_values_is_refused_at_the_first_step(flight):
    """It sets inputs to 0 for good then: zeros for a quaternion are refused, in words, not flown."""
    done, found = flown_in("cofmupy", flight, inputs={name: {} for name in flight.units})
    assert done.returncode != 0 and not found
    assert "fmi2DoStep" in done.stderr, done.stderr
