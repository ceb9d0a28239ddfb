"""FMUs of FMI 1.0, for co-simulation and for model exchange."""
# ruff: noqa: E501 (XML and C)

import zipfile
from pathlib import Path

import fmpy
import pytest
from numpy.testing import assert_allclose

from cosim import Connection, Experiment, System, prepare, simulate
from cosim.errors import InitializationFailed, StepFailed
from fmus import toolchain
from fmus.description.read import parse_description, read_description

from .. import c_fmu, tiny_fmu

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
<Implementation><CoSimulation_StandAlone><Capabilities canHandleVariableCommunicationStepSize="true"/>
</CoSimulation_StandAlone></Implementation>
</fmiModelDescription>
"""

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


def build(folder, name="Old", code=C, xml=XML):
    made = folder / f"{name}-source"
    made.mkdir()
    (made / "fmu.c").write_text(code)
    library = made / f"{name}{fmpy.sharedLibraryExtension}"
    toolchain.compile_library(made, "fmu.c", library, include=(Path(fmpy.__file__).parent / "c-code",))
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
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


def test_comments_are_no_variables(old):
    """Some tools number their variables in comments."""
    text = XML.replace("<Scalar", "<!-- number n --><Scalar").replace("<Real", "<?pi?><!-- a real --><Real")
    assert parse_description(text.encode(), old) == read_description(old)


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


MODEL = """
<fmiModelDescription fmiVersion="1.0" modelName="Saw" modelIdentifier="Saw" guid="{saw}" numberOfContinuousStates="1"
 numberOfEventIndicators="1"><ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input"><Real start="1.8"/></ScalarVariable>
<ScalarVariable name="x" valueReference="1" causality="output"><Real start="0.25" fixed="true"/></ScalarVariable>
<ScalarVariable name="end" valueReference="2" variability="parameter"><Real start="9"/></ScalarVariable>
<ScalarVariable name="wraps" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="ticks" valueReference="1" causality="output" variability="discrete"><Integer/></ScalarVariable>
</ModelVariables></fmiModelDescription>
"""
MODEL_C = r"""
#include <stdlib.h>
#include <string.h>
#include "fmi1Functions.h"
#define E __attribute__((visibility("default")))
typedef struct { double r[3], t; int n[2], ready; } M;
static int update(M *m, fmi1EventInfo *e) { memset(e, 0, sizeof *e);
  if (m->r[1] >= 1) { m->r[1] -= 1; m->n[0]++; e->stateValuesChanged = 1; }
  if (m->t > 0.35 * (m->n[1] + 1) - 1e-9) m->n[1]++;
  e->iterationConverged = m->r[1] < 1; e->upcomingTimeEvent = 1; e->nextEventTime = 0.35 * (m->n[1] + 1);
  e->terminateSimulation = m->t >= m->r[2]; return 0; }
E const char *Saw_fmiGetVersion(void) { return "1.0"; }
E const char *Saw_fmiGetModelTypesPlatform(void) { return "standard32"; }
E fmi1Component Saw_fmiInstantiateModel(fmi1String name, fmi1String guid, fmi1CallbackFunctions f, char logging) {
  M *m = calloc(1, sizeof *m); m->r[0] = 1.8; m->r[1] = 0.25; m->r[2] = 9; return strcmp(guid, "{saw}") ? 0 : m; }
E void Saw_fmiFreeModelInstance(fmi1Component c) { free(c); }
E int Saw_fmiTerminate(fmi1Component c) { return 0; }
E int Saw_fmiInitialize(fmi1Component c, char controlled, double tolerance, fmi1EventInfo *e) { M *m = c;
  if (m->ready) return 3; m->ready = 1; return update(m, e); }
E int Saw_fmiEventUpdate(fmi1Component c, char intermediate, fmi1EventInfo *e) { return update(c, e); }
E int Saw_fmiCompletedIntegratorStep(fmi1Component c, char *event) { *event = 0; return 0; }
E int Saw_fmiSetTime(fmi1Component c, double t) { ((M *)c)->t = t; return 0; }
E int Saw_fmiSetContinuousStates(fmi1Component c, const double x[], size_t n) { ((M *)c)->r[1] = x[0]; return 0; }
E int Saw_fmiGetContinuousStates(fmi1Component c, double x[], size_t n) { x[0] = ((M *)c)->r[1]; return 0; }
E int Saw_fmiGetNominalContinuousStates(fmi1Component c, double x[], size_t n) { x[0] = 1; return 0; }
E int Saw_fmiGetDerivatives(fmi1Component c, double x[], size_t n) { x[0] = ((M *)c)->r[0]; return 0; }
E int Saw_fmiGetEventIndicators(fmi1Component c, double z[], size_t n) { z[0] = 1 - ((M *)c)->r[1]; return 0; }
E int Saw_fmiSetReal(fmi1Component c, const unsigned v[], size_t n, const double x[]) {
  for (size_t i = 0; i < n; i++) ((M *)c)->r[v[i]] = x[i]; return 0; }
E int Saw_fmiGetReal(fmi1Component c, const unsigned v[], size_t n, double x[]) {
  for (size_t i = 0; i < n; i++) x[i] = ((M *)c)->r[v[i]]; return 0; }
E int Saw_fmiGetInteger(fmi1Component c, const unsigned v[], size_t n, int x[]) {
  for (size_t i = 0; i < n; i++) x[i] = ((M *)c)->n[v[i]]; return 0; }
"""


class TestModelExchange:
    """x' = u, from 0.25 on; where x reaches 1 it falls by 1 (`wraps`); `ticks` counts multiples of 0.35 s."""

    @pytest.fixture
    def saw(self, tmp_path):
        return build(tmp_path, "Saw", MODEL_C, MODEL)

    def system(self, saw, **more):
        return System(name="s", components={"a": str(saw)}, hold_unconnected=True, **more)

    def test_states_and_both_kinds_of_events_again_too(self, saw):
        steps = Experiment(stop_time=2.0, communication_step_size=0.1)
        with prepare(self.system(saw)) as prepared:
            first, second = prepared.fly(steps), prepared.fly(steps)
        assert first.table.equals(second.table)
        way = 0.25 + 1.8 * first.time
        # x is straight between events: what is left are the times of up to 3 events, which CVode finds to 1e-12 or so
        assert_allclose(first["a.x"], way % 1, atol=1e-8)
        assert first["a.wraps"].tolist() == (way // 1).tolist()
        assert first["a.ticks"].tolist() == ((first.time + 1e-9) // 0.35).tolist()

    def test_an_input_that_changes(self, saw, tmp_path):
        push = c_fmu.build(tmp_path, "Push", [c_fmu.real("y")], outputs="y = m->whole[0] % 2;", step="m->whole[0]++;")
        system = System(
            name="s",
            components={"p": str(push), "a": str(saw)},
            connections=[Connection("p.y", "a.u")],
            hold_unconnected=True,
        )
        # u is 0, 1, 0, 1 over the four steps of 0.25 s
        assert_allclose(simulate(system, STEPS)["a.x"], [0.25, 0.25, 0.5, 0.5, 0.75], atol=1e-8)

    def test_it_may_ask_for_the_end(self, saw):
        result = simulate(self.system(saw, parameters={"a.end": 0.6}), STEPS)
        assert (result.info["status"], result.info["event"]["variable"]) == ("finished", "a")
        assert result.time[-1] == 0.5  # the first event after 0.6 s is the tick at 0.7 s

    def test_another_guid(self, saw, tmp_path):
        other = tiny_fmu.changed(saw, tmp_path / "o.fmu", xml=lambda text: text.replace('guid="{saw}"', 'guid="{x}"'))
        with pytest.raises(InitializationFailed, match="a cannot be initialized: fmiInstantiateModel returned no inst"):
            simulate(self.system(other), STEPS)
