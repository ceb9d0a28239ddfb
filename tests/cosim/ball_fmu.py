"""A ball that bounces, as an FMU of FMI 2.0 for model exchange alone, made here in C.

    height' = speed, speed' = -9.81 + push, speed -> -0.7 speed where height falls through 0                  (an event)

`ticks` counts multiples of 0.35 s (events in time), `seen` is the discrete input `shown` as event mode has seen it, `pushed`
the continuous input. `end`: the time at which it asks for the end. `refuses`: derivatives fail from this time on.
`halts`: the time from which it asks for the end after a step of the integrator.
"""
# ruff: noqa: E501 (XML and C)

import zipfile
from pathlib import Path

import fmpy

from fmus import toolchain

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Ball" guid="{ball}" numberOfEventIndicators="1" generationTool="by hand">
<ModelExchange modelIdentifier="Ball"><SourceFiles><File name="ball.c"/></SourceFiles></ModelExchange>
<DefaultExperiment startTime="0" stopTime="2" tolerance="1e-9"/>
<ModelVariables>
<ScalarVariable name="height" valueReference="0" causality="output" initial="exact"><Real start="1"/></ScalarVariable>
<ScalarVariable name="speed" valueReference="1" causality="output" initial="exact"><Real start="0" nominal="2"/></ScalarVariable>
<ScalarVariable name="der(height)" valueReference="2"><Real derivative="1"/></ScalarVariable>
<ScalarVariable name="der(speed)" valueReference="3"><Real derivative="2"/></ScalarVariable>
<ScalarVariable name="push" valueReference="4" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="end" valueReference="5" causality="parameter" variability="fixed"><Real start="1e9"/></ScalarVariable>
<ScalarVariable name="refuses" valueReference="6" causality="parameter" variability="fixed"><Real start="1e9"/></ScalarVariable>
<ScalarVariable name="halts" valueReference="7" causality="parameter" variability="fixed"><Real start="1e9"/></ScalarVariable>
<ScalarVariable name="ticks" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="shown" valueReference="1" causality="input" variability="discrete"><Integer start="0"/></ScalarVariable>
<ScalarVariable name="seen" valueReference="2" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="bounces" valueReference="3" causality="output" variability="discrete"><Integer/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="1" dependencies=""/><Unknown index="2" dependencies=""/><Unknown index="9" dependencies=""/>
<Unknown index="11" dependencies=""/><Unknown index="12" dependencies=""/></Outputs>
<Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives></ModelStructure>
</fmiModelDescription>
"""

C = r"""
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
typedef struct { double r[8], time; int n[4], running, events; const fmi2CallbackFunctions *f; } M;
static void start(M *m) { const fmi2CallbackFunctions *f = m->f; memset(m, 0, sizeof *m); m->f = f; m->r[0] = 1; m->r[5] = m->r[6] = m->r[7] = 1e9; }
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f,
                              fmi2Boolean v, fmi2Boolean l) {
  if (t != fmi2ModelExchange) return 0;
  M *m = calloc(1, sizeof *m); m->f = f; start(m); return m; }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, double b, double t, fmi2Boolean d, double e) { ((M *)c)->time = t; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { M *m = c; m->running = m->events = 1; return fmi2OK; }
fmi2Status fmi2EnterEventMode(fmi2Component c) { M *m = c; if (m->events) return fmi2Error; m->events = 1; return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { M *m = c; if (!m->events) return fmi2Error; m->events = 0; return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) { M *m = c;
  memset(info, 0, sizeof *info);
  if (!m->events) return fmi2Error;
  if (m->r[0] <= 0 && m->r[1] < 0) { m->r[0] = 0; m->r[1] *= -0.7; m->n[3]++; info->valuesOfContinuousStatesChanged = 1; info->newDiscreteStatesNeeded = 1; }
  while (m->time > 0.35 * (m->n[0] + 1) - 1e-9) m->n[0]++;
  m->n[2] = m->n[1];
  info->nextEventTimeDefined = 1; info->nextEventTime = 0.35 * (m->n[0] + 1);
  info->terminateSimulation = m->time >= m->r[5]; return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean b, fmi2Boolean *e, fmi2Boolean *t) { *e = 0; *t = ((M *)c)->time >= ((M *)c)->r[7]; return ((M *)c)->events ? fmi2Error : fmi2OK; }
fmi2Status fmi2SetTime(fmi2Component c, double t) { ((M *)c)->time = t; return fmi2OK; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const double x[], size_t n) { M *m = c; if (m->events) return fmi2Error; memcpy(m->r, x, 2 * sizeof *x); return fmi2OK; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, double x[], size_t n) { memcpy(x, ((M *)c)->r, 2 * sizeof *x); return fmi2OK; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, double x[], size_t n) { x[0] = 1; x[1] = 2; return fmi2OK; }
fmi2Status fmi2GetDerivatives(fmi2Component c, double x[], size_t n) { M *m = c;
  if (m->time > m->r[6]) { m->f->logger(m->f->componentEnvironment, "ball", fmi2Error, "x", "no derivative after %g s", m->r[6]); return fmi2Error; }
  x[0] = m->r[1]; x[1] = -9.81 + m->r[4]; return fmi2OK; }
fmi2Status fmi2GetEventIndicators(fmi2Component c, double x[], size_t n) { M *m = c; x[0] = m->r[0] == 0 && m->r[1] > 0 ? 1e-30 : m->r[0]; return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { start(c); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, double x[]) { M *m = c;
  for (size_t i = 0; i < n; i++) x[i] = v[i] == 2 ? m->r[1] : v[i] == 3 ? -9.81 + m->r[4] : m->r[v[i]]; return fmi2OK; }
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, int x[]) { for (size_t i = 0; i < n; i++) x[i] = ((M *)c)->n[v[i]]; return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const double x[]) { for (size_t i = 0; i < n; i++) ((M *)c)->r[v[i]] = x[i]; return fmi2OK; }
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, const int x[]) { M *m = c;
  if (m->running && !m->events) return fmi2Error;
  for (size_t i = 0; i < n; i++) m->n[v[i]] = x[i]; return fmi2OK; }
"""


def build(folder: Path, xml: str = XML, name: str = "Ball", *, binary: bool = True) -> Path:
    """Write the FMU into a folder; without `binary` it has its source alone."""
    made = folder / f"{name}-source"
    made.mkdir()
    (made / "ball.c").write_text(C)
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
        archive.writestr("sources/ball.c", C)
        if binary:
            library = made / f"Ball{fmpy.sharedLibraryExtension}"
            toolchain.compile_library(made, "ball.c", library, include=(Path(fmpy.__file__).parent / "c-code",))
            archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path
