"""FMU files through fmpy: a small FMU of another tool, and files that are none."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim.errors import CallFailed
from cosim.masters.calls import assign, assignments
from cosim.slaves.fmi2 import FmuSlave
from fmus.description.read import parse_description, read_description

from .. import tiny_fmu


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return tiny_fmu.build(tmp_path_factory.mktemp("tiny"))


@pytest.fixture
def slave(tiny):
    slave = FmuSlave("tiny", tiny)
    slave.instantiate()
    yield slave
    slave.free()


def references(slave, *names):
    return tuple(slave.description.variables[n].value_reference for n in names)


def initialized(slave):
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave


class TestInterface:
    def test_variables_of_all_types(self, tiny):
        description = read_description(tiny)
        kinds = {v.name: (v.type, v.start) for v in description.variables.values()}
        assert kinds["n"] == ("Integer", 3)
        assert kinds["on"] == ("Boolean", True)
        assert kinds["label"] == ("String", "a")
        assert kinds["k"] == ("Real", 1.0)
        assert [v.name for v in description.real_outputs] != [v.name for v in description.outputs]

    def test_missing_dependencies_mean_all_inputs(self, tiny):
        assert read_description(tiny).feedthrough("y") == ("u",)

    def test_vendor_annotations(self):
        description = parse_description(tiny_fmu.XML.encode(), "here")
        assert description.refresh
        assert set(description.step_means) == {"mean"}
        assert description.feedthrough("mean") == ()
        foreign = tiny_fmu.XML.replace('name="adcs-cosim"', 'name="else"')
        assert not parse_description(foreign.encode(), "here").refresh

    def test_units_arrays_and_dependencies(self):
        xml = tiny_fmu.XML.replace(
            "  <VendorAnnotations>",
            '<UnitDefinitions><Unit name="rad/s"><BaseUnit rad="1" s="-1"/><DisplayUnit name="deg/s" factor="57.3"/>'
            '</Unit><Unit name="odd"/></UnitDefinitions>  <VendorAnnotations>',
        )
        xml = xml.replace(
            'name="u" valueReference="0" causality="input"><Real',
            'name="u[1]" valueReference="0" causality="input"><Real unit="rad/s"',
        )
        xml = xml.replace('<Unknown index="2"/>', '<Unknown index="2" dependencies="1"/>').replace(
            '<Unknown index="3"/>', '<Unknown index="3" dependencies=""/>'
        )
        description = parse_description(xml.encode(), "here")
        assert description.units["rad/s"].base.exponents == (0, 0, -1, 0, 0, 0, 0, 1)
        assert description.units["odd"].base is None
        assert description.groups["u"].shape == (1,)
        assert description.variables["u[1]"].unit == "rad/s"
        assert description.feedthrough("y") == ("u[1]",)
        assert description.feedthrough("y_direct") == ()


class TestCalls:
    def test_all_types_can_be_set(self, slave):
        variables = slave.description.variables
        assign(slave, assignments([(variables["k"], 2.5), (variables["n"], 7), (variables["on"], False)]))
        assign(slave, assignments([(variables["label"], "b")]))
        assert slave.get_real(references(slave, "k")) == [2.5]

    def test_step(self, slave):
        initialized(slave)
        slave.set_real(references(slave, "u"), np.array([3.0]))
        slave.do_step(0.0, 0.5)
        assert_array_equal(slave.get_real(references(slave, "y_direct", "y")), [4.5, 1.5])

    def test_answers_do_not_change_afterwards(self, slave):
        initialized(slave)
        before = slave.get_real(references(slave, "y"))
        slave.set_real(references(slave, "u"), np.array([3.0]))
        slave.do_step(0.0, 0.5)
        slave.get_real(references(slave, "y"))
        assert before == [0.0]

    def test_state_can_be_taken_back_and_moved(self, slave):
        initialized(slave)
        u, y = references(slave, "u"), references(slave, "y")
        slave.set_real(u, np.array([3.0]))
        state = slave.get_state()
        slave.do_step(0.0, 0.5)
        after = slave.get_real(y)
        slave.set_state(state)
        assert slave.get_real(y) == [0.0]
        slave.set_state(slave.deserialize_state(slave.serialize_state(state)))
        slave.do_step(0.0, 0.5)
        assert slave.get_real(y) == after
        slave.free_state(state)

    def test_derivatives_of_inputs_and_outputs(self, slave):
        initialized(slave)
        if not tiny_fmu.COMPILED:  # pythonfmu offers none, and says so
            with pytest.raises(CallFailed, match="fmi2SetRealInputDerivatives"):
                slave.set_input_derivatives(references(slave, "u"), (1,), np.array([2.0]))
            return
        slave.set_real(references(slave, "u"), np.array([0.0]))
        slave.set_input_derivatives(references(slave, "u"), (1,), np.array([2.0]))
        slave.do_step(0.0, 3.0)
        assert slave.get_real(references(slave, "y")) == [9.0]
        assert slave.get_output_derivatives(references(slave, "y"), (1,)) == [7.0]

    def test_error_carries_the_log(self, slave):
        initialized(slave)
        slave.set_real(references(slave, "u"), np.array([101.0]))
        with pytest.raises(CallFailed, match="u is 101, more than 100") as caught:
            slave.do_step(0.0, 0.1)
        assert caught.value.function == "fmi2DoStep"
        assert caught.value.status in ("fmi2Error", "fmi2Fatal")

    def test_discard(self, slave):
        initialized(slave)
        slave.set_real(references(slave, "u"), np.array([50.0]))
        with pytest.raises(CallFailed) as caught:
            slave.do_step(1.0, 0.1)
        assert caught.value.status == "fmi2Discard"
        if tiny_fmu.COMPILED:
            assert caught.value.last_successful_time == 1.05

    def test_two_instances_log_apart(self, tiny):
        a, b = FmuSlave("a", tiny), FmuSlave("b", tiny)
        for slave in (a, b):
            slave.instantiate()
            initialized(slave)
        a.set_real(references(a, "u"), np.array([101.0]))
        with pytest.raises(CallFailed):
            a.do_step(0.0, 0.1)
        b.do_step(0.0, 0.1)
        assert any("more than 100" in m for m in a.messages)
        assert not b.messages
        a.free()
        b.free()
        b.free()
