"""FMUs of FMI 3.0: every type, arrays, units, states, structural parameters, ends of steps, what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import Connection, Experiment, System, simulate
from cosim.errors import CallFailed, FmuError, InitializationFailed, StepFailed, WiringErrors
from cosim.masters.iterated import Iterated
from cosim.slaves.opening import open_fmu
from cosim.system import At
from fmus.description.read import parse_description, read_description

from .. import arrays_fmu, c_fmu
from ..arrays_fmu import WHOLE

STEPS = Experiment(stop_time=1.0, communication_step_size=0.25)


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    return arrays_fmu.build(tmp_path_factory.mktemp("arrays"))


def alone(path, **more):
    return System(name="s", components={"a": str(path)}, hold_unconnected=True, **more)


def flown(path, experiment=STEPS, **more):
    return simulate(alone(path, **more), experiment)


def mistakes(system):
    with pytest.raises(WiringErrors) as caught:
        simulate(system, STEPS)
    return [str(m) for m in caught.value.mistakes]


def minus(folder):
    """y = -u, which follows the ramp of its input."""
    variables = [c_fmu.real("u", "input"), c_fmu.real("y", depends="u")]
    return c_fmu.build(folder, "Minus", variables, outputs="y = -u;", step="u += h * m->slope[0];")


def without_feedthrough(xml):
    for name, reference in (("y", 3), ("f", 7)):
        head = f'name="{name}" valueReference="{reference}" causality='
        xml = xml.replace(f'{head}"output"', f'{head}"local"')
    return re.sub(r'<(Output|InitialUnknown) valueReference="[37]"[^>]*/>', "", xml)


class TestDescription:
    def test_arrays_are_named_element_by_element(self, arrays):
        groups = read_description(arrays).groups
        assert groups["G"].shape == (2, 3)
        assert groups["G"].elements[3] == "G[2,1]"
        assert groups["time"].shape == ()

    def test_types_ranges_items_starts(self, arrays):
        v = read_description(arrays).variables
        assert {v[f"{w}_in"].type for w in WHOLE} == {"Integer"}
        assert (v["f"].type, v["b[1]"].type, v["s"].type) == ("Real", "Boolean", "String")
        assert dict(v["e"].items) == {"off": 1, "on": 4}
        assert (v["G[2,2]"].start, v["u[1]"].start, v["s_in"].start, v["y[1]"].start) == (1.0, 0.0, "", None)
        assert v["size"].minimum == 1

    def test_aliases_are_variables(self, arrays):
        v = read_description(arrays).variables
        assert v["attitude[2]"].element == v["x[2]"].element
        assert v["attitude[2]"].description == "the same as x"

    def test_dependencies_element_by_element(self, arrays):
        d = read_description(arrays)
        assert d.feedthrough("y[1]") == ("u[1]", "u[2]", "u[3]")
        assert d.feedthrough("x[1]") == ()
        assert not d.declares("f")
        assert set(d.feedthrough("f")) == {v.name for v in d.inputs}

    def test_one_start_value_is_that_of_all_elements(self):
        text = arrays_fmu.XML.replace('start="0 0 0"', 'start="7"').format(token="t", whole="", outputs="")
        v = parse_description(text.encode(), "here").variables
        assert [v[f"u[{i}]"].start for i in (1, 2, 3)] == [7.0] * 3

    def test_what_tools_note_for_themselves_may_break_the_schema(self):
        """Dymola numbers its annotations; what else breaks the schema is refused, on its own line."""
        note = '<Annotations>\n<Annotation type="a" order="1"/>\n</Annotations><ModelVariables>'
        text = arrays_fmu.XML.format(token="t", whole="", outputs="")
        noted = text.replace("<ModelVariables>", note)
        plain, read = (parse_description(t.encode(), "here") for t in (text, noted))
        assert read == plain
        broken = noted.replace('<Float64 name="u"', '<Float64 order="1" name="u"')
        line = 1 + broken[: broken.index('<Float64 order="1"')].count("\n")
        with pytest.raises(FmuError, match=rf"damaged: ERROR \(line {line}, .*attribute 'order'"):
            parse_description(broken.encode(), "here")

    def test_comments_are_no_variables_and_no_dimensions(self):
        text = arrays_fmu.XML.format(token="t", whole="", outputs="")
        noted = text.replace("<Float64", "<!-- a float --><Float64").replace("<Dimension", "<!-- a size --><Dimension")
        plain, read = (
            parse_description(t.encode(), "here") for t in (text, noted.replace("<Output", "<!-- --><Output"))
        )
        assert read == plain

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ('start="0 0 0"', 'start="0 0"', "u has 2 start values for 3 elements"),
            ('name="x0"', 'name="u"', "two variables have one name, 'u"),
            (
                '<Dimension start="2"/><',
                '<Dimension start="9999999"/><',
                "elements, at most 1000000",
            ),
            ('valueReference="90"', 'valueReference="4294967296"', "4294967296"),
            ('valueReference="6" causality', 'valueReference="-1" causality', "-1"),
        ],
    )
    def test_what_does_not_fit_is_refused(self, old, new, words):
        text = arrays_fmu.XML.replace(old, new).format(token="t", whole="", outputs="")
        with pytest.raises(FmuError, match=r"here: its modelDescription.xml is damaged: .") as caught:
            parse_description(text.encode(), "here")
        assert words in str(caught.value)

    def test_scheduled_execution_only(self):
        text = arrays_fmu.XML.replace("<CoSimulation ", "<ScheduledExecution ")
        with pytest.raises(FmuError, match="it is for scheduled execution only, needed is co-simulation or model"):
            parse_description(text.encode(), "here")


class TestFlight:
    def test_every_type_comes_through(self, arrays):
        held = {f"a.{w}_in": 100 for w in WHOLE} | {
            "a.u": [1.0, 2.0, 3.0],
            "a.f_in": 0.1,
            "a.b_in": [True, False],
            "a.e_in": "on",
            "a.s_in": "µ",
        }
        result = flown(arrays, held=held, parameters={"a.G": [[1, 2, 3], [0, 0, -1]]})
        assert_array_equal(result["a.y"], np.tile([14.0, -3.0], (5, 1)))
        assert_array_equal(result["a.x"], np.array([5.0, 0.0, 0.0]) + np.outer(result.time, [1, 2, 3]))
        assert_array_equal(result["a.f"], 2 * float(np.float32(0.1)))  # exact: doubling changes the exponent alone
        assert_array_equal(result["a.b"], np.tile([False, True], (5, 1)))
        assert [set(result[f"a.{w}_out"].tolist()) for w in WHOLE] == [{101}] * len(WHOLE)
        assert result["a.e"].tolist() == ["on"] * 5 or set(result["a.e"].tolist()) == {4}
        assert result["a.s"].tolist() == ["<µ"] * 5
        assert result["a.count"].tolist() == [0, 1, 2, 3, 4]
        assert (result.info["loop"]["name"], "a has no interface in C") == ("python", result.info["loop"]["reason"])

    def test_parts_of_an_array_may_be_connected(self, arrays):
        """u[2] of b follows a, the rest of u is held; an element that is not set stays as it was."""
        system = System(
            name="s",
            components={"a": str(arrays), "b": str(arrays)},
            connections=[Connection("a.x[1]", "b.u[2]", "after_step")],
            held={"b.u[1]": -1.0, "b.u[3]": 4.0, "a.u": [2.0, 0.0, 0.0]},
            hold_unconnected=True,
        )
        result = simulate(system, STEPS)
        a = 5 + 2 * result.time
        assert_array_equal(result["b.u"], np.column_stack([0 * a - 1, a, 0 * a + 4]))
        assert_array_equal(result["b.x"][:, 1], np.concatenate([[0], np.cumsum(0.25 * a[1:])]))

    def test_with_an_fmu_of_fmi2_and_conversion_of_units(self, arrays, tmp_path):
        unit = '<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>'
        degrees = c_fmu.build(
            tmp_path, "Degrees", [c_fmu.real("d", unit="deg")], outputs="d = 180.0;", units=unit, refresh=False
        )
        system = System(
            name="s",
            components={"d": str(degrees), "a": str(arrays)},
            connections=[Connection("d.d", "a.u[1]")],
            hold_unconnected=True,
        )
        assert_allclose(simulate(system, STEPS)["a.y"][:, 0], np.pi, rtol=4e-16)  # two roundings

    def test_whole_numbers_to_the_ends_of_their_types(self, arrays):
        ends = {w: (0 if w[0] == "U" else -(2 ** (int(w.lstrip("UInt")) - 1))) for w in WHOLE}
        exact = ends | {"Int64": -(2**53)}
        result = flown(arrays, held={f"a.{w}_in": end for w, end in exact.items()})
        assert {w: result[f"a.{w}_out"][0] for w in exact} == {w: end + 1 for w, end in exact.items()}

    def test_beyond_2_to_the_53_is_refused_by_name(self, arrays):
        assert flown(arrays, held={"a.Int64_in": 2**53 - 1})["a.Int64_out"][0] == 2**53
        with pytest.raises(InitializationFailed) as caught:
            flown(arrays, held={"a.Int64_in": 2**53})
        (told,) = mistakes(alone(arrays, held={"a.UInt64_in": 2**53 + 1}))
        assert "a.UInt64_in: the value 9007199254740993 is beyond 2^53" in told
        assert "Int64_out is 9007199254740993: beyond 2^53 whole numbers are not carried exactly" in str(caught.value)

    def test_iterated_with_states_that_are_saved(self, tmp_path):
        """x_a' = x_b, x_b' = -x_a by the implicit midpoint rule: the norm is kept, the arc of a step is 2 atan(h/2)."""
        path = str(arrays_fmu.build(tmp_path, xml=without_feedthrough))
        system = System(
            name="s",
            components={"a": path, "b": path, "minus": str(minus(tmp_path))},
            connections=[
                Connection("b.x[1]", "a.u[1]", "ramp"),
                Connection("a.x[1]", "minus.u", "ramp"),
                Connection("minus.y", "b.u[1]", "ramp"),
            ],
            hold_unconnected=True,
            parameters={"b.x0": [0, 0, 0]},
        )
        result = simulate(system, replace(STEPS, master=Iterated(inputs="ramp")))
        norm = np.hypot(result["a.x"][:, 0], result["b.x"][:, 0])
        assert_allclose(norm, 5, rtol=4 * 1e-6)  # four steps, each to the master's tolerance
        arc = 2 * np.arctan(0.25 / 2) * np.arange(5)
        assert_allclose(result["a.x"][:, 0], 5 * np.cos(arc), atol=5 * 4 * 1e-6)
        assert result["a.count"][-1] == 4

    def test_flown_again(self, arrays):
        """A prepared system resets its instances: the second flight is the first."""
        from cosim import prepare

        with prepare(alone(arrays, held={"a.u": [1.0, 0.0, 2.0]})) as prepared:
            first, second = prepared.fly(STEPS), prepared.fly(STEPS)
        assert first.table.equals(second.table)


class TestParameters:
    def test_a_structural_parameter_without_arrays_is_set_in_configuration_mode(self, arrays):
        assert flown(arrays, parameters={"a.offset": 10})["a.Int8_out"][0] == 11

    def test_sizes_stay(self, arrays):
        assert flown(arrays, parameters={"a.size": 3})["a.x"].shape == (5, 3)
        (told,) = mistakes(alone(arrays, parameters={"a.size": 4}))
        assert told == (
            "parameter a.size: u, G take their size from it, which is that of its start value 3: it cannot be 4 here"
        )

    @pytest.mark.parametrize(
        ("name", "value", "words"),
        [
            (
                "size",
                4,
                "parameter a.size: u, G take their size from it, which is that of its start value 3: it cannot be",
            ),
            ("offset", 2, "a.offset is a structural parameter, which cannot change after the start. Tunable in a: G."),
        ],
    )
    def test_what_is_structural_does_not_change_in_flight(self, arrays, name, value, words):
        with pytest.raises(WiringErrors) as caught:
            flown(arrays, replace(STEPS, events=[At(0.5, {f"a.{name}": value})]))
        (told,) = caught.value.mistakes
        assert str(told).startswith(f"event at 0.5 s: {words}")

    @pytest.mark.parametrize(
        ("name", "value", "words"),
        [
            ("offset", -1, "the value -1 is beyond an UInt64, 0 to 18446744073709551615"),
            ("Int8_in", 5, "it is an input"),
        ],
    )
    def test_ranges(self, arrays, name, value, words):
        assert words in mistakes(alone(arrays, parameters={f"a.{name}": value}))[0]

    def test_a_value_that_an_input_cannot_hold_names_it(self, arrays):
        system = System(
            name="s",
            components={"a": str(arrays), "b": str(arrays)},
            connections=[Connection("a.Int16_out", "b.Int8_in")],
            held={"a.Int16_in": 200},
            hold_unconnected=True,
        )
        with pytest.raises(InitializationFailed, match="Int8_in is Int8, which cannot be 201"):
            simulate(system, STEPS)

    def test_clocks_and_binaries_are_refused_where_they_are_connected(self, arrays):
        system = System(
            name="s",
            components={"a": str(arrays), "b": str(arrays)},
            connections=[Connection("a.blob", "b.tick")],
            hold_unconnected=True,
        )
        assert mistakes(system) == [
            "a.blob is Binary: values of this type are not exchanged. Leave it unconnected.",
            "b.tick is Clock: values of this type are not exchanged. Leave it unconnected.",
        ]


class TestCalls:
    @pytest.fixture
    def slave(self, arrays):
        slave = open_fmu("a", arrays)
        slave.instantiate()
        slave.setup_experiment(0.0)
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
        yield slave
        slave.free()
        slave.free()

    def refer(self, slave, *names):
        return tuple(slave.description.variables[n].value_reference for n in names)

    def test_order_of_a_request_is_kept_over_types_and_arrays(self, slave):
        mixed = self.refer(slave, "f_in", "u[3]", "G[1,1]", "u[1]")
        slave.set_real(mixed, np.array([0.5, 3.0, 7.0, 1.0]))
        assert slave.get_real(self.refer(slave, "u[1]", "G[1,1]", "u[3]", "f_in", "u[2]")).tolist() == [1, 7, 3, 0.5, 0]

    def test_state_is_taken_back_and_moved(self, slave):
        u, x = self.refer(slave, "u[1]"), self.refer(slave, "x[1]")
        slave.set_real(u, np.array([3.0]))
        state = slave.get_state()
        slave.do_step(0.0, 0.5)
        assert slave.get_real(x) == [6.5]
        slave.set_state(slave.deserialize_state(slave.serialize_state(state)))
        assert slave.get_real(x) == [5.0]
        slave.free_state(state)

    def test_derivatives(self, slave):
        slave.set_real(self.refer(slave, "u[1]", "u[3]"), np.array([3.0, 4.0]))
        found = slave.get_output_derivatives(self.refer(slave, "x[3]", "x[1]"), (1, 1))
        assert found.tolist() == [4.0, 3.0]
        unknowns, knowns = self.refer(slave, "y[2]"), self.refer(slave, "u[2]")
        assert slave.directional_derivative(unknowns, knowns, np.array([2.0])).tolist() == [2.0]

    def test_derivatives_of_inputs_are_none(self, slave):
        with pytest.raises(CallFailed, match=r"FMI 3.0 has no function for it"):
            slave.set_input_derivatives(self.refer(slave, "u[1]"), (1,), np.array([0.0]))


class TestEnds:
    def ended(self, tmp_path, step, **more):
        return flown(arrays_fmu.build(tmp_path, step), **more)

    def test_one_that_asks_for_the_end_has_taken_its_step(self, tmp_path):
        result = self.ended(tmp_path, "if (t >= 0.5) *end = true;")
        assert result.time.tolist() == [0.0, 0.25, 0.5, 0.75]
        assert (result.info["status"], result.info["event"]["variable"]) == ("finished", "a")

    def test_an_end_within_a_step_ends_at_the_point_before(self, tmp_path):
        result = self.ended(tmp_path, "if (t >= 0.5) { *end = *early = true; *last = 0.6; }")
        assert result.time.tolist() == [0.0, 0.25, 0.5]

    def test_an_early_return_has_not_been_allowed(self, tmp_path):
        with pytest.raises(StepFailed) as caught:
            self.ended(tmp_path, "if (t >= 0.5) { *early = true; *last = 0.6; }")
        assert str(caught.value).startswith(
            "a returned fmi3OK, but early, which was not allowed at communication point 0.5 s, step 0.25 s "
            "(last successful time 0.6 s)"
        )

    @pytest.mark.parametrize("status", ["Error", "Fatal", "Discard"])
    def test_statuses_and_the_words_of_the_fmu(self, tmp_path, status):
        say = 'm->log(m->environment, fmi3Error, "x", "it hurts");'
        with pytest.raises(StepFailed, match=rf"a returned fmi3{status} at communication point 0.25 s") as caught:
            self.ended(tmp_path, f"if (t >= 0.25) {{ {say} return fmi3{status}; }}")
        assert "it hurts" in str(caught.value)
        assert caught.value.result.time[-1] == 0.25

    def test_warnings_are_counted(self, tmp_path):
        result = self.ended(tmp_path, "return fmi3Warning;")
        assert result.info["fmi2Warning"]["a"]["fmi3DoStep"]["count"] == 4


class TestBinaries:
    def test_another_token_than_the_binarys(self, tmp_path):
        path = arrays_fmu.build(tmp_path, xml=lambda text: text.replace("{arrays}", "{other}"))
        with pytest.raises(InitializationFailed) as caught:
            flown(path)
        assert "fmi3InstantiateCoSimulation returned no instance" in str(caught.value)
        assert "the token is not that of the binary" in str(caught.value)

    def test_a_function_that_nobody_needs_may_be_missing(self, tmp_path):
        assert flown(arrays_fmu.build(tmp_path, without="fmi3Reset")).info["status"] == "finished"

    def test_one_that_everybody_needs_is_named(self, tmp_path):
        with pytest.raises(FmuError, match="its binary cannot be loaded: it has no function fmi3DoStep"):
            flown(arrays_fmu.build(tmp_path, without="fmi3DoStep"))
