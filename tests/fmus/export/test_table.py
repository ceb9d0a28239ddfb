"""Time series as an FMU, flown by fmpy: its outputs against scipy and numpy at times of the test's own."""

import ctypes
import subprocess
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.logging import addLoggerProxy
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline, interp1d

from fmus.description.description import ScalarVariable
from fmus.description.read import read_description
from fmus.description.units import BaseUnit, Conversion, Unit
from fmus.errors import BuildError
from fmus.export.table import table_fmu
from fmus.export.table.table_fmu import Output, build_table
from fmus.toolchain import FLAGS, find_compiler

from .compiling import WARNINGS

TIME = np.array([0.0, 0.3, 1.1, 2.0, 2.5])
Y = np.array([1.0, -2.0, 0.5, 7.25, 3.0])
WHOLE = np.array([3.0, -7.0, 2.0, 5.0, 1.0])
ITEMS = {"off": 1, "slow": 2, "fast": 5}
NEWTON_METRE = Unit("N.m", BaseUnit((1, 2, -2, 0, 0, 0, 0, 0), Conversion(1.0, 0.0)))
SPLINE = CubicSpline(TIME, Y)


def outputs():
    cubic = np.ascontiguousarray(SPLINE.c[::-1].T)
    return [
        Output(ScalarVariable("tau[1]", 0, unit="N.m"), 1, TIME, Y),
        Output(ScalarVariable("tau[2]", 0, unit="N.m"), 0, TIME, Y),
        Output(ScalarVariable("tau[3]", 0, unit="N.m"), 3, TIME, cubic),
        Output(ScalarVariable("n", 0, "Integer"), 0, TIME, WHOLE),
        Output(ScalarVariable("on", 0, "Boolean"), 0, TIME, np.array([0.0, 1.0, 0.0, 1.0, 0.0])),
        Output(ScalarVariable("mode", 0, "Enumeration", items=ITEMS), 0, TIME, np.array([1.0, 5.0, 2.0, 1.0, 5.0])),
    ]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return build_table(tmp_path_factory.mktemp("table") / "Table.fmu", outputs(), {"N.m": NEWTON_METRE})


SAID: list[str] = []
LOGGER = fmi2CallbackLoggerTYPE(lambda _e, _i, _status, _category, text: SAID.append(text.decode()))


def heard():
    """Callbacks whose messages go into SAID; fmpy's proxy, which formats them, knows the last logger alone."""
    SAID.clear()
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = LOGGER
    addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


@pytest.fixture
def slave(fmu, tmp_path):
    said = fmpy.read_model_description(fmu)
    made = FMU2Slave(
        guid=said.guid,
        unzipDirectory=fmpy.extract(fmu, str(tmp_path / "unpacked")),
        modelIdentifier=said.coSimulation.modelIdentifier,
        instanceName="table",
    )
    made.instantiate(callbacks=heard())
    yield made
    made.freeInstance()


def begun(slave, t=0.0):
    slave.setupExperiment(startTime=t)
    slave.enterInitializationMode()
    slave.exitInitializationMode()


def at(slave, t):
    """All outputs at t, by one step to it from anywhere."""
    slave.doStep(currentCommunicationPoint=t - 0.25, communicationStepSize=0.25)
    return slave.getReal([0, 1, 2]), slave.getInteger([3, 5]), slave.getBoolean([4])


def test_it_keeps_to_the_rules_of_fmi(fmu):
    assert validate_fmu(str(fmu)) == []
    said = read_description(fmu)
    assert [v.variability for v in said.variables.values()] == ["continuous", "discrete", "continuous"] + [
        "discrete"
    ] * 3
    assert said.units["N.m"] == NEWTON_METRE and said.variables["mode"].items == ITEMS
    assert all(not said.feedthrough(name) and said.declares(name) for name in said.variables)


def test_values_between_samples(slave):
    """Linear and previous are exact but for a rounding of y, the spline to some of its coefficients' terms."""
    begun(slave)
    previous = interp1d(TIME, Y, kind="previous")
    for t in np.linspace(0.0, 2.5, 101):
        real, _, _ = at(slave, t)
        assert_allclose(real[0], np.interp(t, TIME, Y), rtol=0, atol=8e-15)
        assert_allclose(real[2], SPLINE(t), rtol=0, atol=8e-14)
        if abs(TIME - t).min() > 1e-9:
            assert real[1] == previous(t)


def test_at_a_sample_and_a_hair_before_it_the_new_value_counts(slave):
    """0.1 + 0.2 is past 0.3, 3 * 0.1 too, 1.1 - 1e-10 is short of 1.1: all mean the sample."""
    begun(slave)
    for t, value in ((0.1 + 0.2, -2.0), (0.3, -2.0), (1.1 - 1e-10, 0.5), (1.1 - 1e-6, -2.0), (2.5, 3.0)):
        real, whole, on = at(slave, t)
        assert real[1] == value
        i = list(Y).index(value)
        assert whole == [WHOLE[i], [1, 5, 2, 1, 5][i]] and on == [i % 2]


def test_before_the_first_and_after_the_last_sample_it_stays(slave):
    begun(slave, -1.0)
    assert slave.getReal([0, 1, 2]) == [1.0, 1.0, 1.0]  # in initialization the start time counts
    assert_allclose(at(slave, -0.5)[0], 1.0, rtol=0, atol=0)
    real, whole, on = at(slave, 77.0)
    assert_allclose(real, 3.0, rtol=0, atol=8e-14)
    assert whole == [1, 5] and on == [0]
    assert slave.getRealOutputDerivatives([0, 1, 2], [1, 1, 1])[1] == 0.0


def test_slopes(slave):
    begun(slave)
    at(slave, 0.7)
    found = slave.getRealOutputDerivatives([0, 1, 2], [1, 1, 1])
    assert_allclose(found, [(0.5 + 2.0) / 0.8, 0.0, SPLINE(0.7, 1)], rtol=1e-13, atol=0)


def test_a_step_can_be_taken_back(slave):
    begun(slave)
    here = at(slave, 0.7)
    state = slave.getFMUstate()
    kept = slave.serializeFMUstate(state)
    assert at(slave, 1.9) != here
    slave.setFMUstate(state)
    assert slave.getReal([0, 1, 2]) == here[0]
    slave.doStep(0.7, 0.5)
    slave.setFMUstate(slave.deSerializeFMUstate(kept))
    assert slave.getReal([0, 1, 2]) == here[0]
    slave.reset()
    begun(slave, 1.1)
    assert slave.getReal([1]) == [0.5]


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: s.setReal([0], [1.0]), "fmi2SetReal: nothing can be set, all variables are outputs"),
        (lambda s: s.getReal([3]), "fmi2GetReal: value reference 3 is no Real. Outputs: 0 to 5."),
        (lambda s: s.getInteger([6]), "fmi2GetInteger: value reference 6 is no Integer or Enumeration."),
        (lambda s: s.getBoolean([0]), "fmi2GetBoolean: value reference 0 is no Boolean."),
        (lambda s: s.getString([0]), "fmi2GetString: no output is a String."),
        (lambda s: s.getRealOutputDerivatives([0], [2]), "fmi2GetRealOutputDerivatives: order 2, known is order 1."),
        (lambda s: s.deSerializeFMUstate(b"abc"), "fmi2DeSerializeFMUstate: a state of this FMU has 8 bytes."),
        (lambda s: s.getDirectionalDerivative([0], [0], [1.0]), "there is no input to derive by."),
    ],
)
def test_what_is_refused(slave, call, said):
    begun(slave)
    with pytest.raises(FMICallException):
        call(slave)
    assert len(SAID) == 1 and said in SAID[0]


def test_another_description_than_that_of_the_binary(fmu, tmp_path):
    made = FMU2Slave(
        guid="{0}", unzipDirectory=fmpy.extract(fmu, str(tmp_path)), modelIdentifier="Table", instanceName="table"
    )
    with pytest.raises(Exception, match="Failed to instantiate model"):
        made.instantiate(callbacks=heard())
    assert SAID[0].startswith("fmi2Instantiate: the GUID is not that of this binary")


def test_the_same_bytes_of_the_same_samples_and_an_array_once(fmu, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    files = [build_table(tmp_path / n / "Table.fmu", outputs(), {"N.m": NEWTON_METRE}) for n in "ab"]
    assert files[0].read_bytes() == files[1].read_bytes()
    header = zipfile.ZipFile(fmu).read("sources/table.h").decode()
    assert header.count("D a") == 6  # the times, y, the spline, and three of whole numbers
    other = outputs()
    other[0] = Output(other[0].variable, 1, TIME, Y + 1)
    changed = build_table(tmp_path / "c" / "Table.fmu", other, {"N.m": NEWTON_METRE})
    assert read_description(changed).guid != read_description(fmu).guid


def test_the_compiler_has_nothing_to_say(fmu, tmp_path):
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    command = [*find_compiler(), *FLAGS, *WARNINGS, "table.c", "-o", "table.so"]
    done = subprocess.run(command, cwd=tmp_path / "sources", capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_it_is_compiled_again_from_its_sources(fmu, tmp_path):
    """As a tool on another platform does."""
    from fmpy.build import build_platform_binary

    fmpy.extract(fmu, str(tmp_path))
    for binary in (tmp_path / "binaries").glob("*/*"):
        binary.unlink()
    build_platform_binary(str(tmp_path), None)
    result = fmpy.simulate_fmu(str(tmp_path), stop_time=2.0, output_interval=0.5, output=["tau[1]"])
    assert_allclose(result["tau[1]"], np.interp(result["time"], TIME, Y), rtol=0, atol=8e-15)


def test_more_than_is_compiled(tmp_path, monkeypatch):
    monkeypatch.setattr(table_fmu, "LARGEST", 20)
    with pytest.raises(
        BuildError, match=r"its time series have \d+ numbers, at most 20 are compiled into an FMU\. Give"
    ):
        build_table(tmp_path / "Table.fmu", outputs(), {})
    assert not list(tmp_path.iterdir())
