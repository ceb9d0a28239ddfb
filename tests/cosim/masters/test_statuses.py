"""Every status but OK and Warning ends a run, a negative or unknown one too: the same words in both loops."""

import pytest

from cosim import flights
from cosim.errors import InitializationFailed, StepFailed

from .. import both
from ..c_fmu import boolean, build, integer, real, string

STATUSES = {2: "fmi2Discard", 3: "fmi2Error", 4: "fmi2Fatal", 5: "fmi2Pending"}
ILLEGAL = (-1, -2147483647, 6, 77)


def name_of(status: int) -> str:
    return STATUSES.get(status, f"the illegal status {status}")


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """Returns `status` after two steps, or `early`, from fmi2DoStep, a setter, a getter (`where` 0, 1, 2); 3: at the
    end of initialization mode."""
    variables = [
        real("u", "input"),
        integer("n_in", "input"),
        boolean("on_in", "input"),
        string("word_in", "input"),
        real("y"),
        integer("n"),
        boolean("on"),
        string("word"),
        integer("status", "parameter"),
        integer("where", "parameter"),
        integer("early", "parameter"),
    ]
    due = "(m->whole[0] >= 2 || early)"
    return build(
        tmp_path_factory.mktemp("odd"),
        "Odd",
        variables,
        step=f"if (where == 0 && {due}) {{ m->last = t + 0.25 * h; return status; }} m->whole[0]++; y = t + h;",
        on_set=f"if (where == 1 && {due}) return status;",
        on_get=f"if (where == 2 && {due}) return status;",
        initialized="if (where == 3) return status;",
        refresh=False,
    )


HELD = {"n_in": 1, "on_in": True, "word_in": "w"}


def system(odd, status, where, **more):
    """A clock, which never fails, into the FMU that does."""
    held = {f"{name}.{key}": value for name in "oc" for key, value in HELD.items()} | {"c.u": 0.0}
    return both.of(
        {"o": odd, "c": odd}, [("c.y", "o.u")], held=held, parameters={"o.status": status, "o.where": where, **more}
    )


@pytest.mark.parametrize("status", [*STATUSES, *ILLEGAL])
def test_a_step(odd, status):
    error = both.failure(StepFailed, system(odd, status, 0))
    reached = " (last successful time 0.225 s)" if status == 2 else ""
    assert str(error) == f"o returned {name_of(status)} at communication point 0.2 s, step 0.1 s{reached}"
    assert (error.component, error.status) == ("o", name_of(status))
    assert error.result.time.tolist() == [0.0, 0.1, 0.2]
    assert error.result.info["failure"]["status"] == name_of(status)


@pytest.mark.parametrize("status", [0, 1])
def test_ok_and_warning_go_on(odd, status):
    for where in (0, 1, 2, 3):
        assert len(both.fly(system(odd, status, where))) == 11


@pytest.mark.parametrize("status", [3, 5, -1, 77])
@pytest.mark.parametrize(("where", "function"), [(1, "fmi2SetReal"), (2, "fmi2GetReal")])
def test_setting_and_getting(odd, status, where, function):
    error = both.failure(StepFailed, system(odd, status, where))
    point = {1: 0.2, 2: 0.1}[where]  # the second step counts, and the look at its outputs fails
    assert str(error) == f"o returned {name_of(status)} from {function} at communication point {point} s, step 0.1 s"


@pytest.mark.parametrize(
    ("make", "value"), [(integer, 0), (boolean, False), (string, "")], ids=["Integer", "Boolean", "String"]
)
@pytest.mark.parametrize("verb", ["Set", "Get"])
def test_every_kind_of_call_by_its_name(tmp_path, make, value, verb):
    """An FMU whose only input and output are of that kind; it fails after two of its steps."""
    variables = [make("u", "input"), make("y")]
    code = {"on_set" if verb == "Set" else "on_get": "if (m->whole[0] >= 2) return -3;"}
    path = build(tmp_path, "Kind", variables, step="m->whole[0]++;", refresh=False, **code)
    system = both.of({"a": path, "b": path}, [("a.y", "b.u")], held={"a.u": value})
    who, point = {"Set": ("b", 0.2), "Get": ("a", 0.1)}[verb]
    function = f"fmi2{verb}{variables[0].type}"
    words = f"{who} returned the illegal status -3 from {function} at communication point {point} s, step 0.1 s"
    assert str(both.failure(StepFailed, system)) == words


@pytest.mark.parametrize("status", [3, -1, 77])
@pytest.mark.parametrize(
    ("where", "function"), [(1, "fmi2SetInteger"), (2, "fmi2GetReal"), (3, "fmi2ExitInitializationMode")]
)
def test_initialization(odd, status, where, function):
    """Parameters are set first, and those of Integers last."""
    with pytest.raises(InitializationFailed) as caught:
        flights.simulate(system(odd, status, where, **{"o.early": 1}), both.experiment())
    words = f"o cannot be initialized: {function} returned {name_of(status)}"
    assert str(caught.value) == words


@pytest.mark.parametrize("status", [3, 5, -1])
@pytest.mark.parametrize("slopes", ["of an input", "of an output"])
def test_derivatives(tmp_path, status, slopes):
    """A ramp sets slopes of inputs, extrapolation reads slopes of outputs."""
    of_input = slopes == "of an input"
    code = {"on_set_slopes" if of_input else "on_get_slopes": f"if (m->whole[0] == 2) return {status};"}
    variables = [real("u", "input"), real("y")]
    step = "m->whole[0]++; y = t + h;"
    path = build(tmp_path, "Slope", variables, step=step, maxOutputDerivativeOrder=1, **code)
    timing = "ramp" if of_input else "at_point"
    system = both.of({"a": path, "b": path}, [("a.y", "b.u", timing)], held={"a.u": 0.0})
    error = both.failure(StepFailed, system, extrapolation=1)
    words = (
        f"b returned {name_of(status)} from fmi2SetRealInputDerivatives at communication point 0.2 s, step 0.1 s"
        if of_input
        else f"a returned {name_of(status)} from fmi2GetRealOutputDerivatives at communication point 0.1 s, step 0.1 s"
    )
    assert str(error) == words
