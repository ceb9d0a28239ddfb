"""Unit vectors as people type them: divided by their length and said; kept within rounding; refused further off."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from numpy.testing import assert_allclose, assert_array_equal

from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim import Experiment, System, simulate
from cosim.errors import InitializationFailed
from cosim.flights import find
from fmus.export.build import build

from .slaves import Slave, unpack
from .unit_parts import PlainPointing, Pointing

EPS = np.finfo(float).eps
BACKENDS = ["native", "python"]
TYPED = {  # variable -> what was typed, what is said
    "q": ([0.966, 0.0, 0.259, 0.0], "q has norm"),
    "mounting": ([0.9999, 0.0087, 0.0087, -0.0035], "mounting has norm"),
    "line": ([0.7071, 0.0, -0.7071], "line has length"),
}


def elements(name, values):
    array = np.asarray(values, dtype=float)
    index = (",".join(str(i + 1) for i in place) for place in np.ndindex(array.shape))
    return {f"{name}[{i}]": float(v) for i, v in zip(index, array.ravel(), strict=True)}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    place = tmp_path_factory.mktemp("units")
    return {b: unpack(build(Pointing(), place / b / "Pointing.fmu", b)) for b in BACKENDS}


@pytest.fixture
def pointing(folders):
    """A function: back end -> an instance, freed at the end."""
    opened = []

    def slave(backend):
        opened.append(Slave(folders[backend], logging=True))
        return opened[-1]

    yield slave
    for one in opened:
        one.fmi2FreeInstance(one.component)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", TYPED)
def test_what_was_typed_is_divided_by_its_length_and_said(pointing, backend, name):
    typed, said = TYPED[name]
    slave, given = pointing(backend), elements(name, typed)
    slave.set(given)
    slave.start()
    size = np.sqrt(sum(v * v for v in typed))
    assert_allclose(slave.get(*given), np.divide(typed, size), rtol=4 * EPS)
    assert slave.messages == [f"Pointing: {said} {size:.12g}. It was divided by that."]


@pytest.mark.parametrize("backend", BACKENDS)
def test_of_a_matrix_each_column_by_itself(pointing, backend):
    """The second is one already, to the last bit and the sign of its zero."""
    slave = pointing(backend)
    given = elements("axes", [[0.7071, 0.0], [0.0, -0.0], [0.7071, 1.0]])
    slave.set(given)
    slave.start()
    found = np.reshape(slave.get(*given), (3, 2))
    assert_allclose(found[:, 0], [np.sqrt(0.5), 0, np.sqrt(0.5)], rtol=4 * EPS)
    assert found[:, 1].tobytes() == np.array([0.0, -0.0, 1.0]).tobytes()
    assert_allclose(slave.get("sizes[1]", "sizes[2]"), 1.0, rtol=4 * EPS)
    (told,) = slave.messages
    assert told.startswith("Pointing: axis 1 of axes has length 0.99999")


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_a_unit_vector_but_for_rounding_keeps_its_bits_and_nothing_is_said(pointing, backend):
    rng = np.random.default_rng(1)
    for _ in range(20):
        slave = pointing(backend)
        v = rng.normal(size=4)
        near = v / np.linalg.norm(v) * (1 + rng.uniform(-5e-13, 5e-13))  # off by less than 1e-12
        given = elements("q", near) | elements("mounting", -near)
        slave.set(given)
        slave.start()
        assert_array_equal(slave.get(*given), [*near, *-near])
        assert slave.messages == []


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_shown_in_initialization_mode_is_a_unit_vector_already(pointing, backend):
    """A controller that is connected reads it there."""
    slave = pointing(backend)
    given = elements("q", TYPED["q"][0])
    slave.set(given)
    slave.begin()
    assert_allclose(np.linalg.norm(slave.get(*given)), 1.0, rtol=4 * EPS)
    slave.set(given)  # and once more, as a master may
    slave.exitInitializationMode()
    assert_allclose(np.linalg.norm(slave.get(*given)), 1.0, rtol=4 * EPS)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("far", [0.9989, 1.0011, 0.0, 2.0])
def test_what_is_further_off_is_refused_as_it_is(pointing, backend, far):
    """Each by its name, nothing divided."""
    slave = pointing(backend)
    slave.set(elements("q", [far, 0, 0, 0]) | elements("axes", [[0, 0], [far, far], [0, 0]]))
    slave.begin()
    with pytest.raises(FMICallException):
        slave.exitInitializationMode()
    told = " ".join(slave.messages)
    assert (
        f"q has norm {far:g} at the start, a unit quaternion (within 0.001) is needed. Divide it by its norm." in told
    )
    for i in (1, 2):
        text = f"axis {i} of axes has length {far:g}, a unit vector (within 0.001) is needed. Divide it by its length."
        assert text in told
    assert "was divided" not in told


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_tunable_axis_is_taken_so_in_flight_too_and_a_state_is_left_alone(pointing, backend):
    slave = pointing(backend)
    slave.start()
    for k in range(3):
        slave.doStep(0.5 * k, 0.5)
    q = slave.get(*elements("q", np.zeros(4)))
    given = elements("line", [0.577, 0.577, 0.578])
    slave.set(given)
    assert_allclose(np.linalg.norm(slave.get(*given)), 1.0, rtol=4 * EPS)
    assert_allclose(np.linalg.norm(slave.get("seen[1]", "seen[2]", "seen[3]")), 1.0, rtol=8 * EPS)
    assert slave.get(*elements("q", np.zeros(4))) == q
    assert [m.partition(" 0.99997")[0] for m in slave.messages] == ["Pointing: line has length"]


def test_both_back_ends_make_the_same_bits_and_words(pointing):
    shown = []
    for backend in BACKENDS:
        rng, slave, values = np.random.default_rng(4), pointing(backend), []
        vectors = {n: rng.normal(size=len(v)) for n, (v, _) in TYPED.items()}
        for name, v in vectors.items():
            slave.set(elements(name, np.round(v / np.linalg.norm(v), 4)))
        slave.start()
        values.append(slave.everything())
        slave.doStep(0.0, 0.1)
        shown.append((values, [m for m in slave.messages]))
    assert shown[0][1] == shown[1][1] and len(shown[0][1]) == 3
    n = len(shown[1][0][0])  # the native one shows rates of states behind
    assert shown[0][0][0][:n] == shown[1][0][0]


def test_of_a_component_in_plain_python(tmp_path):
    folder = unpack(build(PlainPointing(), tmp_path / "Plain.fmu", "python"))
    slave = Slave(folder, logging=True)
    slave.set(elements("line", [0.0, 0.6, 0.7999]))
    slave.start()
    assert_allclose(slave.get("length"), [1.0], rtol=4 * EPS)
    (told,) = slave.messages
    assert told.startswith("Plain: line has length 0.99992")
    slave.reset()
    slave.set(elements("line", [0.0, 0.6, 0.7]))
    slave.begin()
    with pytest.raises(FMICallException):
        slave.exitInitializationMode()
    assert "line has length 0.921954, a unit vector (within 0.001) is needed." in " ".join(slave.messages)
    slave.fmi2FreeInstance(slave.component)


@pytest.mark.parametrize("backend", BACKENDS)
def test_it_flies_and_stands_in_the_result(tmp_path, backend):
    fmu = build(FlexibleSpacecraft(modes=0), tmp_path / "Hub.fmu", backend)
    experiment = Experiment(stop_time=0.2, communication_step_size=0.1)

    def fly(q):
        system = System(name="s", components={"plant": fmu}, parameters={"plant.q_BN": q}, hold_unconnected=True)
        return simulate(system, experiment, locate=find)

    result = fly([0.9999, 0.0087, 0.0087, -0.0035])
    assert_allclose(np.linalg.norm(result["plant.q_BN"], axis=1), 1.0, rtol=8 * EPS)
    text = "Hub: q_BN has norm 0.999981819835. It was divided by that."
    assert result.info["messages"]["plant"] == {text: 1}
    with pytest.raises(InitializationFailed, match=r"q_BN has norm 0\.995\d* at the start, a unit quaternion"):
        fly([0.995, 0.0, 0.0, 0.0])
