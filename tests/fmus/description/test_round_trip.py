"""The writer and the reader of modelDescription.xml agree: what is written is read as the same data."""

from dataclasses import replace
from pathlib import Path

import pytest

from components.catalog import CATALOG
from components.framework import Component, Input, Output, State
from fmus.description.annotations import COMMIT_SHOWN, SAMPLE_TIME, SOLVER_STEP
from fmus.description.description import DefaultExperiment, ModelDescription, ScalarVariable
from fmus.description.read import parse_description
from fmus.description.units import BaseUnit, Conversion, Unit
from fmus.description.write import write
from fmus.export.native.native_fmu import describe_native
from fmus.export.python.python_fmu import describe_python


def read(xml: bytes) -> ModelDescription:
    return parse_description(xml, Path("written here"))


@pytest.mark.parametrize("describe", [describe_native, describe_python], ids=["native", "python"])
@pytest.mark.parametrize("name", CATALOG)
def test_every_component_of_the_catalog(name, describe):
    said = replace(describe(CATALOG[name](), name), guid="{of no matter}")
    again = read(write(said))
    assert again == said
    assert list(again.variables) == list(said.variables)


LEVELS = {"off": 0, "low": 1, "high": 7}


def everything() -> ModelDescription:
    """An FMU of all types, that says all that the data class can say."""
    variables = [
        ScalarVariable(
            "torque", 0, causality="input", variability="continuous", initial="exact", unit="N.cm", start=1.5
        ),
        ScalarVariable("mode", 0, "Enumeration", "input", "discrete", "exact", start=7, items=LEVELS),
        ScalarVariable("level", 1, "Enumeration", "output", "discrete", "calculated", items=LEVELS),
        ScalarVariable("gear", 2, "Enumeration", "parameter", "fixed", "exact", start=-1, items={"reverse": -1}),
        ScalarVariable("count", 5, "Integer", "parameter", "tunable", "exact", start=-3, minimum=-4, maximum=9),
        ScalarVariable("on", 5, "Boolean", "parameter", "fixed", "exact", start=True),
        ScalarVariable("off", 6, "Boolean", "input", "discrete", "exact", start=False),
        ScalarVariable("label", 5, "String", "parameter", "fixed", "exact", start='a "b" <c>', description="Ω & co"),
        ScalarVariable(
            "angle[1]",
            7,
            causality="output",
            initial="exact",
            unit="rad",
            display_unit="deg",
            start=1e-3,
            nominal=0.1,
            minimum=-3.5,
            maximum=3.5,
        ),
        ScalarVariable("der(angle[1])", 8, initial="calculated", derivative="angle[1]"),
        ScalarVariable("unknown", 9, causality="output", initial="calculated"),
    ]
    newton_metre = (1, 2, -2, 0, 0, 0, 0, 0)
    return ModelDescription(
        model_name="Everything",
        guid="{1}",
        variables={v.name: v for v in variables},
        dependencies={"level": ("mode", "off"), "angle[1]": (), "unknown": None},
        derivatives={"der(angle[1])": ("torque", "angle[1]")},
        initial_unknowns={"level": ("mode", "count"), "unknown": None},
        units={
            "N.cm": Unit("N.cm", BaseUnit(newton_metre, Conversion(0.01)), {"kN.m": Conversion(1e-5)}),
            "degC": Unit("degC", BaseUnit((0, 0, 0, 0, 1, 0, 0, 0), Conversion(1.0, 273.15)), {}),
            "rad": Unit("rad", BaseUnit((0,) * 7 + (1,)), {"deg": Conversion(57.3, -0.5)}),
            "kg^(1/2)": Unit("kg^(1/2)"),
        },
        default_experiment=DefaultExperiment(start=-1.0, stop=2.0, tolerance=1e-6, step_size=0.25),
        can_handle_variable_step=False,
        can_interpolate_inputs=True,
        max_input_derivative_order=3,
        max_output_derivative_order=2,
        can_get_and_set_state=True,
        can_serialize_state=True,
        provides_directional_derivative=True,
        only_once_per_process=True,
        needs_execution_tool=True,
        refresh=True,
        sampled=True,
        step_means={"angle[1]": "angle[2]"},
        role="plant",
        shared=frozenset({"count"}),
        rates_act=frozenset({"torque"}),
        model_identifier="everything_",
        source_files=("a.c", "b.c"),
        log_categories=("logAll",),
        generation_tool="a test",
        generation_date="2026-11-26T10:20:30Z",
        description="says everything",
        author="A & B",
        version="1.2",
        license="MIT",
        copyright="(c) 2026 A",
    )


def test_whatever_can_be_said():
    assert read(write(everything())) == everything()


def test_a_foreign_fmu_that_says_nothing_has_no_mark_of_ours():
    bare = ModelDescription("Bare", "{1}", {}, model_identifier="Bare")
    assert b"VendorAnnotations" not in write(bare)
    said = ScalarVariable("x", 0, causality="output", initial="exact", start=0.0)
    assert read(write(replace(bare, variables={"x": said}))).default_experiment == DefaultExperiment()


def test_feedthrough_is_of_inputs_of_every_type():
    said = everything()
    assert said.feedthrough("level") == ("mode", "off")
    assert said.feedthrough("unknown") == ("torque", "mode", "off")
    assert said.initial_feedthrough("level") == ("mode",)
    assert [v.name for v in said.real_outputs] == ["angle[1]", "unknown"]


TYPES = """<TypeDefinitions>
  <SimpleType name="Angle"><Real unit="rad" displayUnit="deg" min="-3" max="3" nominal="0.5"/></SimpleType>
  <SimpleType name="Level">
    <Enumeration><Item name="off" value="0"/><Item name="on" value="4"/></Enumeration></SimpleType>
</TypeDefinitions>"""


def test_what_a_declared_type_says_holds_for_the_variable_unless_it_says_otherwise():
    xml = f"""<fmiModelDescription fmiVersion="2.0" modelName="Typed" guid="1">
<CoSimulation modelIdentifier="Typed"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
{TYPES}
<ModelVariables>
  <ScalarVariable name="a" valueReference="0" causality="input"><Real declaredType="Angle" start="0"/></ScalarVariable>
  <ScalarVariable name="b" valueReference="1" causality="input">
    <Real declaredType="Angle" start="0" max="1"/></ScalarVariable>
  <ScalarVariable name="c" valueReference="2" causality="input" variability="discrete">
    <Enumeration declaredType="Level" start="4" max="4"/></ScalarVariable>
</ModelVariables>
<ModelStructure/></fmiModelDescription>"""
    a, b, c = read(xml.encode()).variables.values()
    assert (a.unit, a.display_unit, a.minimum, a.maximum, a.nominal, a.items) == ("rad", "deg", -3.0, 3.0, 0.5, None)
    assert (b.minimum, b.maximum) == (-3.0, 1.0)
    assert (c.items, c.start, c.minimum, c.maximum) == ({"off": 0, "on": 4}, 4, None, 4.0)


class Moving(Component):
    u = Input(unit="m/s", doc="rate")
    x = State(unit="m", output=True, doc="way")

    def derivatives(self, t, x, u, p):
        return {"x": u.u}


class Sampled(Component):
    sample_time = 0.1
    y = Output(unit="s", doc="time")

    def outputs(self, t, x, u, p):
        return {"y": t}


def test_the_framework_declares_the_parameters_that_annotations_names():
    """Neither package may import the other."""
    assert [p.name for p in Moving().parameters] == [SOLVER_STEP]
    assert [p.name for p in Sampled().parameters] == [SAMPLE_TIME, COMMIT_SHOWN]
