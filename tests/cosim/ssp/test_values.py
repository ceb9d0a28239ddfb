"""Parameter sets and mappings: where they come from, which of them wins, what becomes of a value on its way."""

import logging
from math import radians

import pytest
from numpy.testing import assert_allclose

from cosim import load
from cosim.errors import WiringErrors

from ..tiny_fmu import changed
from .packages import (
    CONNECTORS,
    HEAD,
    NAMESPACES,
    SSP_UNITS,
    bindings,
    component,
    connection,
    inline,
    package,
    parameter,
    parameter_set,
    refused,
    start,
    structure,
    system,
    values,
)


def given(name, value, kind="Real", more=""):
    return inline(parameter_set(parameter(name, value, kind, more)))


def mapping(*entries, version="1.0", namespaces=""):
    return f'<ssm:ParameterMapping version="{version}" {namespaces}>{"".join(entries)}</ssm:ParameterMapping>'


def entry(source, target, inside="", more=""):
    return f'<ssm:MappingEntry source="{source}" target="{target}" {more}>{inside}</ssm:MappingEntry>'


def alone(fmus, tmp_path, *each, fmu="Line", files=None, version="1.0", connectors=CONNECTORS):
    """A package of one component with bindings."""
    part = component("a", fmu, inside=bindings(*each), connectors=connectors)
    top = structure(system("s", part), version=version)
    return package(tmp_path / "a.ssp", top, fmus, files)


class TestSources:
    def test_types(self, fmus, tmp_path):
        sets = parameter_set(
            parameter("c", 2.5),
            parameter("n", -4, "Integer"),
            parameter("on", "true", "Boolean"),
            parameter("mode", "fast", "Enumeration"),
            parameter("label", "a &amp; b", "String"),
        )
        path = alone(fmus, tmp_path, inline(sets))
        assert start(path, "a.y", "a.n_out", "a.on_out", "a.mode_out", "a.label_out") == [2.5, -4, True, 5, "a & b"]

    def test_a_file(self, fmus, tmp_path):
        ssv = HEAD + parameter_set(parameter("c", 2), namespaces=NAMESPACES)
        binding = '<ssd:ParameterBinding source="resources/a%20set.ssv"/>'
        assert start(alone(fmus, tmp_path, binding, files={"resources/a set.ssv": ssv}), "a.y") == 2.0

    def test_a_file_within_the_fmu(self, fmus, tmp_path):
        ssv = HEAD + parameter_set(parameter("c", 2), namespaces=NAMESPACES)
        own = changed(fmus["Line"], tmp_path / "Own.fmu")
        import zipfile

        with zipfile.ZipFile(own, "a") as archive:
            archive.writestr("resources/set.ssv", ssv)
        binding = '<ssd:ParameterBinding source="resources/set.ssv" sourceBase="component"/>'
        assert start(alone({**fmus, "Own": own}, tmp_path, binding, fmu="Own"), "a.y") == 2.0

    def test_what_no_variable_has_is_passed_over_and_told(self, fmus, tmp_path, caplog):
        """As the standard says: such values are ignored."""
        with caplog.at_level(logging.WARNING):
            assert start(alone(fmus, tmp_path, given("c", 2), given("missing", 3)), "a.y") == 2.0
        assert "its parameter sets name what no FMU of it has, passed over: a.missing" in caplog.text

    def test_an_array_of_ssp_2(self, fmus, tmp_path):
        value = '<ssv:Parameter name="c"><ssv:Float64 value="2.5"/><ssc:Dimension size="1"/></ssv:Parameter>'
        binding = inline(parameter_set(value, version="2.0"))
        assert start(alone(fmus, tmp_path, binding, version="2.0"), "a.y") == 2.5
        wrong = binding.replace("2.5", "2.5 3").replace('size="1"', 'size="2"')
        assert "the parameter a.c has 2 values, not 1" in refused(alone(fmus, tmp_path, wrong, version="2.0"))

    @pytest.mark.parametrize(
        ("name", "value", "kind", "said"),
        [
            ("on", 2.5, "Real", "it is Boolean, the value 2.5"),
            ("mode", "quick", "Enumeration", "it has no item 'quick'"),
            ("y", 1, "Real", "it cannot be set"),
        ],
    )
    def test_what_a_variable_cannot_take(self, fmus, tmp_path, name, value, kind, said):
        with pytest.raises(WiringErrors, match=said):
            start(alone(fmus, tmp_path, given(name, value, kind)), "a.y")


class TestPrecedence:
    """Later over earlier on one level, a higher level over a lower one, wherever in the file it stands."""

    def test_later_bindings_win(self, fmus, tmp_path):
        assert start(alone(fmus, tmp_path, given("c", 1), given("c", 2), given("k", 3)), "a.y") == 2.0

    def test_the_system_wins_over_its_component_and_the_top_over_all(self, fmus, tmp_path):
        inner = system("inner", component("a", inside=values(c=1, n=1)), bindings=bindings(given("a.c", 2)))
        top = system("s", inner, bindings=bindings(given("inner.a.c", 3)))
        assert start(package(tmp_path / "top.ssp", structure(top), fmus), "inner/a.y") == 3.0
        top = system("s", inner)
        assert start(package(tmp_path / "inner.ssp", structure(top), fmus), "inner/a.y") == 2.0

    def test_a_prefix_takes_a_set_to_one_element(self, fmus, tmp_path):
        """And not to one whose name only begins so."""
        parts = component("rw1") + component("rw10")
        top = system("s", parts, bindings=bindings(inline(parameter_set(parameter("c", 2)), more='prefix="rw1."')))
        assert start(package(tmp_path / "a.ssp", structure(top), fmus), "rw1.y", "rw10.y") == [2.0, 0.0]

    def test_two_with_one_hierarchical_name_both_take_it(self, fmus, tmp_path):
        """The component B.C, and C in the system B: the standard calls it punning."""
        parts = component("B.C") + system("B", component("C"))
        top = system("s", parts, bindings=bindings(given("B.C.c", 2)))
        assert start(package(tmp_path / "a.ssp", structure(top), fmus), "B_C.y", "B/C.y") == [2.0, 2.0]

    def test_a_connector_of_a_system_hands_on_what_it_is_given(self, fmus, tmp_path):
        """An input that stays unconnected, and a parameter, with their transformations and units."""
        connectors = (
            '<ssd:Connector name="in" kind="input"><ssc:Real unit="deg"/></ssd:Connector>'
            '<ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector>'
        )
        own = CONNECTORS + '<ssd:Connector name="k" kind="parameter"/>'
        twice = '<ssc:LinearTransformation factor="2"/>'
        wires = connection("in", "a.u") + connection("gain", "a.k", twice)
        inner = system("inner", component("a", "Angle", connectors=own), wires, connectors=connectors)
        top = system("s", inner, bindings=bindings(given("inner.in", 90), given("inner.gain", 5)))
        path = package(tmp_path / "a.ssp", structure(top, units=SSP_UNITS), fmus)
        assert_allclose(start(path, "inner/a.u", "inner/a.y"), [radians(90), 10 * radians(90)], rtol=4e-16)


class TestMapping:
    def mapped(self, fmus, tmp_path, sets, *entries, fmu="Line"):
        return alone(fmus, tmp_path, inline(sets, mapping(*entries)), fmu=fmu)

    def test_only_what_is_mapped_and_under_its_new_name_alone(self, fmus, tmp_path):
        sets = parameter_set(parameter("k", 7), parameter("offset", 2))
        path = self.mapped(fmus, tmp_path, sets, entry("offset", "c"))
        assert load(path)[0].parameters == {"a.c": 2.0}

    def test_one_to_several(self, fmus, tmp_path):
        sets = parameter_set(parameter("p", 2))
        path = self.mapped(fmus, tmp_path, sets, entry("p", "c"), entry("p", "k"))
        assert load(path)[0].parameters == {"a.k": 2.0, "a.c": 2.0}

    def test_a_linear_transformation(self, fmus, tmp_path):
        linear = '<ssc:LinearTransformation factor="-3" offset="1"/>'
        path = self.mapped(fmus, tmp_path, parameter_set(parameter("p", 2)), entry("p", "c", linear))
        assert start(path, "a.y") == -5.0

    def test_units_then_the_transformation(self, fmus, tmp_path):
        sets = parameter_set(parameter("p", 90, more='unit="deg"'), more=f"<ssv:Units>{SSP_UNITS}</ssv:Units>")
        linear = '<ssc:LinearTransformation factor="2" offset="1"/>'
        path = self.mapped(fmus, tmp_path, sets, entry("p", "c", linear), fmu="Angle")
        assert_allclose(start(path, "a.y"), 2 * radians(90) + 1, rtol=4e-16)
        path = self.mapped(fmus, tmp_path, sets, entry("p", "c", linear, 'suppressUnitConversion="true"'), fmu="Angle")
        assert start(path, "a.y") == 181.0

    @pytest.mark.parametrize(
        ("kind", "value", "target", "table", "expected"),
        [
            ("Boolean", "true", "on", [("true", "false"), ("false", "true")], False),
            ("Integer", "2", "n", [("1", "10"), ("2", "20")], 20),
            ("Enumeration", "B", "mode", [("A", "off"), ("B", "slow")], 2),
        ],
    )
    def test_tables(self, fmus, tmp_path, kind, value, target, table, expected):
        entries = "".join(f'<ssc:MapEntry source="{a}" target="{b}"/>' for a, b in table)
        transformation = f"<ssc:{kind}MappingTransformation>{entries}</ssc:{kind}MappingTransformation>"
        sets = parameter_set(parameter("p", value, kind))
        path = self.mapped(fmus, tmp_path, sets, entry("p", target, transformation))
        assert start(path, f"a.{target}_out") == expected
        sets = parameter_set(parameter("p", {"Boolean": "1", "Integer": "3", "Enumeration": "C"}[kind], kind))
        if kind != "Boolean":
            said = refused(self.mapped(fmus, tmp_path, sets, entry("p", target, transformation)))
            assert f"the parameter a.{target} is " in said and "its mapping knows" in said

    def test_a_file(self, fmus, tmp_path):
        ssm = HEAD + mapping(entry("p", "c"), namespaces=NAMESPACES)
        binding = inline(parameter_set(parameter("p", 2))).replace(
            "</ssd:ParameterBinding>", '<ssd:ParameterMapping source="map.ssm"/></ssd:ParameterBinding>'
        )
        assert start(alone(fmus, tmp_path, binding, files={"map.ssm": ssm}), "a.y") == 2.0

    @pytest.mark.parametrize(
        ("entries", "said"),
        [
            ([entry("q", "c")], "it maps 'q', which the parameter set has not: it has p"),
            ([entry("p", "c"), entry("p", "c")], "it maps two parameters to 'c'"),
        ],
    )
    def test_what_cannot_be_mapped(self, fmus, tmp_path, entries, said):
        assert said in refused(self.mapped(fmus, tmp_path, parameter_set(parameter("p", 2)), *entries))


class TestUnits:
    def in_degrees(self, units):
        return inline(parameter_set(parameter("c", 90, more='unit="deg"'), more=f"<ssv:Units>{units}</ssv:Units>"))

    def test_a_value_comes_into_the_unit_of_the_variable(self, fmus, tmp_path):
        path = alone(fmus, tmp_path, self.in_degrees(SSP_UNITS), fmu="Angle")
        assert_allclose(start(path, "a.y"), radians(90), rtol=2.3e-16)

    def test_one_of_another_dimension(self, fmus, tmp_path):
        binding = self.in_degrees(SSP_UNITS).replace('unit="deg"', 'unit="s"')
        said = refused(alone(fmus, tmp_path, binding, fmu="Angle"))
        assert "the parameter a.c: the units s and rad cannot be converted" in said

    def test_one_that_nothing_defines(self, fmus, tmp_path):
        binding = inline(parameter_set(parameter("c", 90, more='unit="grad"')))
        said = refused(alone(fmus, tmp_path, binding, fmu="Angle"))
        assert "the units grad and rad cannot be converted" in said
