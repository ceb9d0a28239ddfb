"""FMUs of FMI 1.0: co-simulation flies, model exchange is refused."""
# ruff: noqa: E501 (XML and C)

import zipfile
from pathlib import Path

import fmpy
import pytest

from cosim import Connection, Experiment, System, prepare, simulate
from cosim.errors import FmuError, StepFailed
from fmus import toolchain
from fmus.description.read import read_description

STEPS = Experiment(stop_time=1.0, communication_step_size=0.25)

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="Old" modelIdentifier="Old" guid="{old}" generationTool="by hand"
 numberOfContinuousStates="1" numberOfEventIndicators="0">
<DefaultExperiment startTime="0" stopTime="1"/>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input"><Real start="2"/></ScalarVariable>
<ScalarVariable name="y" valueReference="1" causality="output"><Real/><DirectDependency/></ScalarVariable>
<ScalarVariable name="d" valueReference="2" causality="output"><Real/><DirectDependency><Name>u</Name></DirectDependency>
</ScalarVariable>
<ScalarVariable name="k" valueReference="3" variability="parameter"><Real start="1"/></ScalarVariable>
<ScalarVariable name="n" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="on" valueReference="0" causality="input" variability="discrete"><Boolean start="true"/></ScalarVariable>
</ModelVariables>
IMPLEMENTATION
</fmiModelDescription>
"""
SLAVE = "<Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize='true'/></CoSimulation_StandAlone></Implementation>"

C = r"""
#include <stdlib.h>
#include <string.h>
#include "fmi1Functions.h"
#define E __attribute__((visibility("default")))
typedef struct { double r[4]; int n; char on; int ready; fmi1CallbackFunctions f; } M;
E const char *Old_fmiGetVersion(void) { return "1.0"; }
E const char *Old_fmiGetTypesPlatform(void) { return "standard32"; }
E fmi1Component Old_fmiInstantiateSlave(fmi1String name, fmi1String guid, fmi1String place, fmi1String mime, double timeout,
  char visible, char interactive, fmi1CallbackFunctions f, char logging) {
  M *m = calloc(1, sizeof *m); m->f = f; m->r[0] = 2; m->r[3] = 1; m->on = 1; return m; }
E int Old_fmiInitializeSlave(fmi1Component c, double t, char defined, double stop) { M *m = c; if (m->ready) return 3;
  m->ready = 1; return 0; }
E int Old_fmiTerminateSlave(fmi1Component c) { return 0; }
E int Old_fmiResetSlave(fmi1Component c) { M *m = c; memset(m->r, 0, sizeof m->r); m->r[0] = 2; m->r[3] = 1; m->n = m->ready = 0;
  m->on = 1; return 0; }
E void Old_fmiFreeSlaveInstance(fmi1Component c) { free(c); }
E int Old_fmiSetReal(fmi1Component c, const unsigned v[], size_t n, const double x[]) {
  for (size_t i = 0; i < n; i++) ((M *)c)->r[v[i]] = x[i]; return 0; }
E int Old_fmiGetReal(fmi1Component c, const unsigned v[], size_t n, double x[]) { M *m = c; if (!m->ready) return 3;
  m->r[2] = m->r[0] + m->r[1]; for (size_t i = 0; i < n; i++) x[i] = m->r[v[i]]; return 0; }
E int Old_fmiGetInteger(fmi1Component c, const unsigned v[], size_t n, int x[]) { x[0] = ((M *)c)->n; return 0; }
E int Old_fmiSetBoolean(fmi1Component c, const unsigned v[], size_t n, const char x[]) { ((M *)c)->on = x[0]; return 0; }
E int Old_fmiDoStep(fmi1Component c, double t, double h, char new_step) { M *m = c;
  if (m->r[0] > 100) { m->f.logger(c, "old", 3, "x", "u is %g", m->r[0]); return 3; }
  if (m->on) m->r[1] += m->r[3] * h * m->r[0];
  m->n++; return 0; }
"""


def build(folder, implementation=SLAVE):
    made = folder / "old-source"
    made.mkdir()
    (made / "old.c").write_text(C)
    library = made / f"Old{fmpy.sharedLibraryExtension}"
    toolchain.compile_library(made, "old.c", library, include=(Path(fmpy.__file__).parent / "c-code",))
    path = folder / "Old.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", XML.replace("IMPLEMENTATION", implementation))
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path


@pytest.fixture
def old(tmp_path):
    return build(tmp_path)


def test_what_its_description_says(old):
    d = read_description(old)
    assert (d.fmi_version, d.model_exchange, d.can_handle_variable_step) == ("1.0", False, True)
    assert (d.feedthrough("y"), d.feedthrough("d")) == ((), ("u",))
    assert d.variables["k"].causality == "parameter"
    assert not d.declares("n")


def test_it_flies_with_others_and_again(old):
    system = System(
        name="s",
        components={"a": str(old), "b": str(old)},
        connections=[Connection("a.d", "b.u")],
        held={"a.u": 3.0, "b.on": False},
        parameters={"a.k": 2.0},
        hold_unconnected=True,
    )
    with prepare(system) as prepared:
        first, second = prepared.fly(STEPS), prepared.fly(STEPS)
    assert first.table.equals(second.table)
    assert first["a.y"].tolist() == [0.0, 1.5, 3.0, 4.5, 6.0]
    assert first["b.u"].tolist() == [3.0, 4.5, 6.0, 7.5, 9.0]
    assert first["b.y"].tolist() == [0.0] * 5  # it is switched off
    assert first["a.n"].tolist() == [0, 1, 2, 3, 4]


def test_a_step_that_fails_is_told(old):
    with pytest.raises(StepFailed, match="a returned fmiError at communication point 0 s") as caught:
        simulate(System(name="s", components={"a": str(old)}, held={"a.u": 101.0}, hold_unconnected=True), STEPS)
    assert "u is 101" in str(caught.value)


def test_model_exchange_is_refused_with_a_sentence(tmp_path):
    path = build(tmp_path, "")
    with pytest.raises(
        FmuError, match=r"it is of FMI 1\.0 for model exchange: of FMI 1\.0 only co-simulation is flown"
    ):
        simulate(System(name="s", components={"a": str(path)}, hold_unconnected=True), STEPS)
