"""FMUs of FMI 3.0 in packages of SSP 2.0: arrays as whole connectors, connections, parameters, of every type."""

import re
import zipfile

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import Connection, Experiment, Library, System, load, simulate
from cosim.cli.packing import export
from cosim.ssp.errors import SspError

from .. import arrays_fmu, tiny_fmu
from .packages import (
    SSP_UNITS,
    bindings,
    connection,
    edited,
    inline,
    line,
    package,
    parameter_set,
    refused,
    same,
    structure,
    system,
)

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="this FMU is compiled for Linux")

STEPS = Experiment(stop_time=1.0, communication_step_size=0.25)
WHOLE = {f"a.{kind}_out": f"b.{kind}_in" for kind in arrays_fmu.WHOLE}


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    return arrays_fmu.build(tmp_path_factory.mktemp("arrays"))


def declared(arrays, **more):
    """Two of them, with arrays and scalars of every type connected."""
    ends = {"a.x": "b.u", "a.f": "b.f_in", "a.b": "b.b_in", "a.e": "b.e_in", "a.s": "b.s_in", **WHOLE}
    return System(
        name="arrays",
        components={"a": str(arrays), "b": str(arrays)},
        connections=[Connection(source, target) for source, target in ends.items()],
        parameters={"a.G": [[1, 2, 3], [4, 5, 6]], "b.x0[2]": 8.0},
        held={"a.u": [1.0, 2.0, 3.0], "a.b_in": [True, False], "a.e_in": 4, "a.s_in": "hello", "a.UInt8_in": 254},
        hold_unconnected=True,
        **more,
    )


@pytest.fixture
def exported(arrays, tmp_path):
    def call(what, ssp="2.0"):
        path = tmp_path / "a.ssp"
        export(path, what, STEPS, Library(), ssp=ssp)
        return path

    return call


def test_what_was_declared_comes_back_and_flies_to_the_same_bits(arrays, exported):
    whole = declared(arrays)
    found, flown = load(exported(whole))
    assert same(whole, found) and flown == STEPS
    rows = [simulate(s, STEPS).table for s in (whole, found)]
    assert rows[0].equals(rows[1], check_metadata=False)
    result = simulate(found, flown)
    assert_array_equal(result["a.x"][-1], [6.0, 2.0, 3.0])  # 5 + 1, 2, 3: four steps of 1/4, exact in doubles
    assert result["b.UInt8_in"][-1] == 255 and result["b.s"][-1] == "<<hello"


def test_whole_arrays_are_written_by_the_types_of_fmi_3(arrays, exported):
    with zipfile.ZipFile(exported(declared(arrays))) as archive:
        ssd, values = (archive.read(n).decode() for n in ("SystemStructure.ssd", "resources/a.ssv"))
    connectors = dict(re.findall(r'<ssd:Connector name="([^"]+)"[^>]*>(.*?)</ssd:Connector>', ssd, re.DOTALL))
    assert re.sub(r"\s+", "", connectors["u"]) == '<ssc:Float64unit="rad"/><ssc:Dimensionsize="3"/>'
    assert "<ssc:UInt8/>" in connectors["UInt8_in"] and "<ssc:Float32/>" in connectors["f"]
    assert not any("[" in name for name in connectors)
    assert '<ssd:Connection startElement="a" startConnector="x" endElement="b" endConnector="u"/>' in ssd
    assert ssd.count("<ssd:Connection ") == 5 + len(WHOLE)
    given = re.sub(r"\s+", " ", values)
    gain = '<ssv:Float64 value="1.0 2.0 3.0 4.0 5.0 6.0"/> <ssc:Dimension size="2"/> <ssc:Dimension size="3"/>'
    assert f'<ssv:Parameter name="G"> {gain}' in given
    assert '<ssv:Parameter name="b_in"> <ssv:Boolean value="true false"/> <ssc:Dimension size="2"/>' in given


def test_a_value_that_another_tool_has_changed(arrays, exported):
    path = edited(exported(declared(arrays)), "5.0 8.0 0.0", "5.0 9.0 1.0", "resources/b.ssv")
    found, _ = load(path)
    assert (found.parameters["b.x0[2]"], found.parameters["b.x0[3]"]) == (9.0, 1.0)
    assert "b.x0[1]" not in found.parameters


class TestAStrangersFile:
    """Written by hand: connectors with dimensions, through a system, with values for whole arrays."""

    ARRAY = '<ssd:Connector name="{0}" kind="{1}"><ssc:Float64 {3}/><ssc:Dimension {2}/></ssd:Connector>'
    UX = ARRAY.format("u", "input", 'size="3"', "") + ARRAY.format("x", "output", 'size="3"', "")

    def part(self, name, connectors=UX, inside=""):
        return (
            f'<ssd:Component name="{name}" source="resources/Arrays.fmu"><ssd:Connectors>{connectors}</ssd:Connectors>'
            f"{inside}</ssd:Component>"
        )

    def set(self, *given):
        each = [
            f'<ssv:Parameter name="{name}"><ssv:Float64 value="{values}" {unit}/>{dimension}</ssv:Parameter>'
            for name, values, unit, dimension in given
        ]
        return bindings(inline(parameter_set(*each, version="2.0")))

    def made(self, arrays, tmp_path, elements, connections="", **more):
        top = structure(system("s", elements, connections, **more), version="2.0", units=SSP_UNITS)
        return package(tmp_path / "a.ssp", top, {"Arrays": arrays})

    def test_through_a_system_in_other_units_with_a_factor(self, arrays, tmp_path):
        """u of a is (1, 2, 3) rad held, its x goes out in degrees and comes in times 2 plus 1 rad."""
        three = '<ssc:Dimension size="3"/>'
        start = self.set(("u", "1 2 3", "", three), ("x0", "0 0 0", "", three))
        zero = self.set(("x0", "0 0 0", "", three))
        out = self.ARRAY.format("out", "output", 'size="3"', 'unit="deg"')
        inner = system("inner", self.part("a", inside=start), connection("a.x", "out"), connectors=out)
        factor = '<ssc:LinearTransformation factor="2" offset="1"/>'
        path = self.made(arrays, tmp_path, inner + self.part("b", inside=zero), connection("inner.out", "b.u", factor))
        found, flown = load(path)
        assert found.components.keys() == {"inner/a", "b"}
        result = simulate(found, flown)
        assert_array_equal(result["inner/a.x"][-1], [1.0, 2.0, 3.0])
        assert_allclose(result["b.u"][-1], [3.0, 5.0, 7.0], rtol=4e-16)

    def test_a_matrix(self, arrays, tmp_path):
        gain = self.set(
            ("G", "1 0 0 0 2 0", "", '<ssc:Dimension size="2"/><ssc:Dimension size="3"/>'),
            ("u", "1 2 3", "", '<ssc:Dimension size="3"/>'),
        )
        y = self.ARRAY.format("y", "output", 'size="2"', "")
        system, flown = load(self.made(arrays, tmp_path, self.part("a", self.UX + y, gain)))
        assert_array_equal(simulate(system, flown)["a.y"][0], [1.0, 4.0])

    @pytest.mark.parametrize("size", ["", 'sizeConnector="size"'])
    def test_a_size_that_is_said_elsewhere(self, arrays, tmp_path, size):
        u = self.ARRAY.format("u", "input", size, "")
        assert list(load(self.made(arrays, tmp_path, self.part("a", u)))[0].components) == ["a"]

    def test_another_size_than_that_of_the_variable(self, arrays, tmp_path):
        u = self.ARRAY.format("u", "input", 'size="4"', "")
        said = refused(self.made(arrays, tmp_path, self.part("a", u)))
        assert "the connector a.u has 4 elements, but its variable 3" in said
        twice = u.replace("<ssc:Dimension", '<ssc:Dimension size="2"/><ssc:Dimension', 1)
        said = refused(self.made(arrays, tmp_path, self.part("a", twice)))
        assert "the connector a.u has 2 x 4 elements, but its variable 3" in said

    def test_arrays_of_two_sizes(self, arrays, tmp_path):
        y = self.ARRAY.format("y", "output", 'size="2"', "")
        path = self.made(arrays, tmp_path, self.part("a", y) + self.part("b"), connection("a.y", "b.u"))
        assert "the connection a.y -> b.u joins 2 elements with 3" in refused(path)

    def test_too_few_values(self, arrays, tmp_path):
        given = self.set(("u", "1 2", "", '<ssc:Dimension size="2"/>'))
        assert "the parameter a.u has 2 values, not 3" in refused(
            self.made(arrays, tmp_path, self.part("a", inside=given))
        )
        given = self.set(("u", "1 2 3", "", '<ssc:Dimension size="2"/>'))
        assert "the parameter 'u' has 3 values, its dimensions say 2" in refused(
            self.made(arrays, tmp_path, self.part("a", inside=given))
        )

    def test_single_elements(self, arrays, tmp_path):
        one = connection("a.x", "b.u", more='startIndices="1" endIndices="2"')
        said = refused(self.made(arrays, tmp_path, self.part("a") + self.part("b"), one))
        assert (
            "the connection a.x -> b.u is of single elements of arrays (startIndices, endIndices), which is not" in said
        )


class TestWhatCannotBeWritten:
    def test_arrays_in_ssp_1(self, arrays, exported):
        said = r"a is an FMU of FMI 3\.0 with arrays \(G, attitude, b, \.\.\.\), which SSP 1\.0 has not: write SSP 2\.0"
        with pytest.raises(SspError, match=said):
            exported(declared(arrays), "1.0")

    def test_an_element_of_an_array(self, arrays, exported, tmp_path):
        other = line(tmp_path)
        parts = {"a": str(other), "b": str(arrays)}
        one = System(name="one", components=parts, connections=[Connection("a.y", "b.u[2]")], hold_unconnected=True)
        with pytest.raises(
            SspError, match=r"a\.y -> b\.u\[2\] connects an element of an array of FMI 3\.0: SSP carries"
        ):
            exported(one)

    def test_arrays_whose_elements_are_crossed(self, arrays, exported):
        crossed = {"a.x[1]": "b.u[2]", "a.x[2]": "b.u[1]", "a.x[3]": "b.u[3]"}
        whole = System(
            name="crossed",
            components={"a": str(arrays), "b": str(arrays)},
            connections=[Connection(*ends) for ends in crossed.items()],
            hold_unconnected=True,
        )
        with pytest.raises(SspError, match=r"a\.x\[1\] -> b\.u\[2\] connects an element of an array"):
            exported(whole)
