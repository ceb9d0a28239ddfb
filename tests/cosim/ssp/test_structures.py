"""Packages of other tools: systems within systems, connectors, units, transformations, against arithmetic by hand."""

import logging
from math import radians

import pytest
from numpy.testing import assert_allclose

from cosim import load, simulate
from cosim.cli import library

from ..tiny_fmu import changed
from .packages import (
    CONNECTORS,
    SSP_UNITS,
    component,
    connection,
    package,
    refused,
    start,
    structure,
    system,
    values,
)

LINEAR = '<ssc:LinearTransformation factor="{}" offset="{}"/>'


class TestFlat:
    def test_a_chain_with_values(self, fmus, tmp_path):
        parts = component("a", inside=values(u=2, k=3)) + component("b", inside=values(c=0.5))
        path = package(tmp_path / "a.ssp", structure(system("s", parts, connection("a.y", "b.u"))), fmus)
        assert start(path, "a.y", "b.u", "b.y") == [6.0, 6.0, 6.5]
        found, experiment = load(path)
        assert found.name == "made"
        assert found.held == {"a.u": 2.0} and found.parameters == {"a.k": 3.0, "b.c": 0.5}
        assert not found.hold_unconnected
        assert (experiment.stop_time, experiment.start_time) == (1.0, 0.0)

    def test_start_and_end_do_not_say_where_values_go(self, fmus, tmp_path):
        parts = component("a", inside=values(u=2, k=3)) + component("b")
        path = package(tmp_path / "a.ssp", structure(system("s", parts, connection("b.u", "a.y"))), fmus)
        assert start(path, "b.u") == 6.0

    def test_an_input_without_a_connection_keeps_its_start_value(self, fmus, tmp_path):
        path = package(tmp_path / "a.ssp", structure(system("s", component("a", inside=values(c=4)))), fmus)
        assert load(path)[0].hold_unconnected
        assert start(path, "a.u", "a.y") == [0.0, 4.0]

    def test_a_start_value_of_a_connected_input_is_what_its_source_says(self, fmus, tmp_path):
        parts = component("a", inside=values(c=2)) + component("b", inside=values(u=77))
        path = package(tmp_path / "a.ssp", structure(system("s", parts, connection("a.y", "b.u"))), fmus)
        assert start(path, "b.u") == 2.0

    def test_names_that_no_instance_may_have(self, fmus, tmp_path):
        parts = component("my part.1", inside=values(c=2)) + component("b")
        path = package(tmp_path / "a.ssp", structure(system("s", parts, connection("my part.1.y", "b.u"))), fmus)
        assert list(load(path)[0].components) == ["my_part_1", "b"]
        assert start(path, "b.u") == 2.0

    def test_the_whole_flight(self, fmus, tmp_path):
        """x' = c, so that x(1) = c, and Euler's step makes no error of it; each step adds h c, rounded once."""
        path = package(tmp_path / "a.ssp", structure(system("s", component("a", inside=values(c=3)))), fmus)
        result = simulate(*load(path))
        assert result.time[-1] == 1.0 and len(result) == 1001
        assert_allclose(result["a.x"][-1], 3.0, rtol=1000 * 2**-53)


class TestNested:
    def deep(self, name, inner, gain):
        """A system whose input goes through a component with a gain, and further in."""
        connectors = '<ssd:Connector name="in" kind="input"/><ssd:Connector name="out" kind="output"/>'
        parts = component("part", inside=values(k=gain)) + inner
        last = "inner.out" if inner else "part.y"
        wires = connection("in", "part.u") + connection(last, "out")
        wires += connection("part.y", "inner.in") if inner else ""
        return system(name, parts, wires, connectors=connectors)

    def test_three_levels(self, fmus, tmp_path):
        nested = self.deep("outer", self.deep("inner", self.deep("inner", "", 5), 3), 2)
        wires = connection("first.y", "outer.in") + connection("outer.out", "last.u")
        top = system("s", component("first", inside=values(c=1)) + nested + component("last"), wires)
        path = package(tmp_path / "a.ssp", structure(top), fmus)
        found, _ = load(path)
        assert list(found.components) == [
            "first", "outer/part", "outer/inner/part", "outer/inner/inner/part", "last",
        ]  # fmt: skip
        assert start(path, "last.u", "outer/inner/part.y") == [30.0, 6.0]

    def test_from_connector_to_connector_of_one_system(self, fmus, tmp_path):
        connectors = '<ssd:Connector name="in" kind="input"/><ssd:Connector name="out" kind="output"/>'
        through = system("through", component("idle"), connection("in", "out"), connectors=connectors)
        wires = connection("a.y", "through.in") + connection("through.out", "b.u")
        parts = component("a", inside=values(c=7)) + through + component("b")
        path = package(tmp_path / "a.ssp", structure(system("s", parts, wires)), fmus)
        assert start(path, "b.u") == 7.0

    def test_one_connector_into_two_components(self, fmus, tmp_path):
        connectors = '<ssd:Connector name="in" kind="input"/>'
        wires = connection("in", "p.u") + connection("in", "q.u", LINEAR.format(-1, 0))
        fork = system("fork", component("p") + component("q"), wires, connectors=connectors)
        parts = component("a", inside=values(c=7)) + fork
        path = package(tmp_path / "a.ssp", structure(system("s", parts, connection("a.y", "fork.in"))), fmus)
        assert start(path, "fork/p.u", "fork/q.u") == [7.0, -7.0]

    def test_one_definition_flown_twice(self, fmus, tmp_path):
        """By its id, in the same file; the bindings of each use win."""
        parts = self.deep("part", "", 2).replace("<ssd:System", '<ssd:System id="it"', 1)
        again = (
            '<ssd:Component name="again" type="application/x-ssp-definition" source="#it">'
            + values(**{"part.k": 10})
            + "</ssd:Component>"
        )
        wires = connection("a.y", "part.in") + connection("part.out", "again.in")
        top = system("s", component("a", inside=values(c=1)) + parts + again, wires)
        path = package(tmp_path / "a.ssp", structure(top), fmus)
        assert start(path, "part/part.y", "again/part.y") == [2.0, 20.0]

    def test_definitions_in_files_of_their_own(self, fmus, tmp_path):
        """Another .ssd, and another package in this one: relative to their own folders."""
        inner = structure(self.deep("x", "", 2)).replace("resources/", "")
        whole = package(tmp_path / "inner.ssp", structure(self.deep("x", "", 3)), fmus)
        uses = [("p", "x-ssp-definition", "resources/part.ssd"), ("q", "x-ssp-package", "resources/inner.ssp")]
        parts = "".join(f'<ssd:Component name="{n}" type="application/{t}" source="{s}"/>' for n, t, s in uses)
        wires = connection("a.y", "p.in") + connection("p.out", "q.in")
        top = structure(system("s", component("a", inside=values(c=1)) + parts, wires))
        more = {"resources/part.ssd": inner, "resources/inner.ssp": whole.read_bytes()}
        path = package(tmp_path / "a.ssp", top, fmus, more)
        assert load(path)[0].components["q/part"] == f"{path}#resources/inner.ssp#resources/Line.fmu"
        assert start(path, "p/part.y", "q/part.y") == [2.0, 6.0]

    def test_a_definition_within_itself(self, fmus, tmp_path):
        loop = system(
            "s", '<ssd:Component name="me" type="application/x-ssp-definition" source="#top"/>', more='id="top"'
        )
        assert "lies within itself" in refused(package(tmp_path / "a.ssp", structure(loop), fmus))

    def test_definitions_that_multiply(self, fmus, tmp_path):
        """Ten uses a level make 10^n components."""
        parts = system("l0", component("leaf"), more='id="l0"')
        for n in range(1, 9):
            uses = "".join(
                f'<ssd:Component name="u{i}" type="application/x-ssp-definition" source="#l{n - 1}"/>'
                for i in range(10)
            )
            parts += system(f"l{n}", uses, more=f'id="l{n}"')
        assert "more than 100000 elements" in refused(package(tmp_path / "a.ssp", structure(system("s", parts)), fmus))


class TestUnitsAndTransformations:
    """1 rad of an FMU in rad into one in deg: 180/pi; factor and offset come after that."""

    def one(self, fmus, tmp_path, inside="", more=""):
        parts = component("a", "Angle", inside=values(c=radians(90))) + component("b", "Degrees")
        top = system("s", parts, connection("a.y", "b.u", inside, more))
        return package(tmp_path / "a.ssp", structure(top), fmus)

    def test_units_of_the_fmus(self, fmus, tmp_path):
        assert_allclose(start(self.one(fmus, tmp_path), "b.u"), 90.0, rtol=4e-16)
        (found,) = load(tmp_path / "a.ssp")[0].connections
        assert found.transformation is None

    def test_a_transformation_after_the_conversion(self, fmus, tmp_path):
        assert_allclose(start(self.one(fmus, tmp_path, LINEAR.format(2, 1)), "b.u"), 181.0, rtol=4e-16)

    def test_a_transformation_instead_of_the_conversion(self, fmus, tmp_path):
        path = self.one(fmus, tmp_path, LINEAR.format(100, 0), 'suppressUnitConversion="true"')
        assert start(path, "b.u") == 100 * radians(90)

    def test_no_conversion_at_all(self, fmus, tmp_path):
        assert start(self.one(fmus, tmp_path, more='suppressUnitConversion="true"'), "b.u") == radians(90)

    def test_a_connector_has_the_unit_that_an_fmu_does_not_say(self, fmus, tmp_path):
        degrees = CONNECTORS.replace('kind="output"/>', 'kind="output"><ssc:Real unit="deg"/></ssd:Connector>')
        parts = component("a", inside=values(c=180), connectors=degrees) + component("b", "Angle")
        top = structure(
            system("s", parts, connection("a.y", "b.u")),
            units=SSP_UNITS,
        )
        assert_allclose(start(package(tmp_path / "a.ssp", top, fmus), "b.u"), radians(180), rtol=4e-16)

    def test_through_connectors_of_systems(self, fmus, tmp_path):
        """rad -> deg, times 2, plus 3 -> in deg on: 2 * 90 + 3; then -> rad, times -1."""
        connectors = '<ssd:Connector name="in" kind="input"><ssc:Real unit="deg"/></ssd:Connector>'
        inner = system(
            "inner", component("b", "Angle"), connection("in", "b.u", LINEAR.format(-1, 0)), connectors=connectors
        )
        parts = component("a", "Angle", inside=values(c=radians(90))) + inner
        top = system("s", parts, connection("a.y", "inner.in", LINEAR.format(2, 3)))
        path = package(tmp_path / "a.ssp", structure(top, units=SSP_UNITS), fmus)
        assert_allclose(start(path, "inner/b.u"), -radians(183), rtol=1e-15)

    def test_units_that_do_not_fit(self, fmus, tmp_path):
        seconds = CONNECTORS.replace('kind="output"/>', 'kind="output"><ssc:Real unit="s"/></ssd:Connector>')
        parts = component("a", connectors=seconds) + component("b", "Angle")
        top = structure(system("s", parts, connection("a.y", "b.u")), units=SSP_UNITS)
        said = refused(package(tmp_path / "a.ssp", top, fmus))
        assert "the connection a.y -> b.u: the units s and rad cannot be converted" in said


class TestExperiment:
    def test_the_step_is_the_shortest_that_an_fmu_proposes(self, fmus, tmp_path):
        proposed = "<DefaultExperiment stepSize='0.25'/><VendorAnnotations>"
        own = changed(
            fmus["Line"], tmp_path / "Own.fmu", xml=lambda text: text.replace("<VendorAnnotations>", proposed)
        )
        top = structure(system("s", component("a") + component("b", "Own")))
        path = package(tmp_path / "a.ssp", top, {**fmus, "Own": own})
        assert load(path)[1].communication_step_size == 0.25
        assert load(path, step=0.1)[1].communication_step_size == 0.1

    def test_else_a_thousandth_of_the_flight_and_that_is_told(self, fmus, tmp_path, caplog):
        top = structure(system("s", component("a")), experiment='<ssd:DefaultExperiment startTime="1" stopTime="5"/>')
        with caplog.at_level(logging.WARNING):
            _, experiment = load(package(tmp_path / "a.ssp", top, fmus))
        assert (float(experiment.communication_step_size), experiment.start_time) == (0.004, 1.0)
        assert "SSP has no step size: a thousandth of the flight is taken. --step 1ms sets one" in caplog.text

    @pytest.mark.parametrize(
        "experiment", ["", '<ssd:DefaultExperiment startTime="3"/>', '<ssd:DefaultExperiment stopTime="0"/>']
    )
    def test_without_a_stop_time_it_asks_for_one(self, fmus, tmp_path, experiment):
        path = package(tmp_path / "a.ssp", structure(system("s", component("a")), experiment=experiment), fmus)
        assert "in its DefaultExperiment. Give it one: --stop 10" in refused(path)
        assert load(path, stop=10.0)[1].stop_time == 10.0

    def test_a_name_that_cannot_be_a_folders(self, fmus, tmp_path):
        ssd = structure(system("s", component("a"))).replace('name="made"', 'name="../../made"')
        assert load(package(tmp_path / "mine.ssp", ssd, fmus))[0].name == "mine"


def test_fmus_are_extracted_once_and_again_where_the_file_has_changed(fmus, tmp_path):
    path = package(tmp_path / "a.ssp", structure(system("s", component("a"))), fmus)
    locate, reference = library.Library(), f"{path}#resources/Line.fmu"
    first = locate(reference)
    assert first.read_bytes() == fmus["Line"].read_bytes() and locate(reference) == first
    package(path, structure(system("s", component("a"))), {**fmus, "Line": fmus["Angle"]}, {"more.txt": "more"})
    assert locate(reference).read_bytes() == fmus["Angle"].read_bytes()
