"""A small third-party FMU, made here: in C where there is a compiler, by pythonfmu where there is none.

x' = k u, y = x; y_direct = u + x. A step with u > 100 is an error, one with u = 50 is discarded after half of it,
k < 0 refuses initialization. Integer, Boolean and String variables besides, no units, no dependencies.
"""
# ruff: noqa: E501 (XML and C)

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Tiny" guid="{tiny}" generationTool="by hand">
  <CoSimulation modelIdentifier="Tiny" canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true"
    canGetAndSetFMUstate="true" canSerializeFMUstate="true" canBeInstantiatedOnlyOncePerProcess="false"/>
  <VendorAnnotations>
    <Tool name="other"><Thing/></Tool>
    <Tool name="adcs-cosim"><Slave refresh="true"><StepMean variable="mean"/></Slave></Tool>
  </VendorAnnotations>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="y_direct" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="mean" valueReference="3" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="k" valueReference="4" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="0" causality="parameter" variability="fixed"><Integer start="3"/></ScalarVariable>
    <ScalarVariable name="on" valueReference="0" causality="parameter" variability="fixed"><Boolean start="true"/></ScalarVariable>
    <ScalarVariable name="label" valueReference="0" causality="parameter" variability="fixed"><String start="a"/></ScalarVariable>
    <ScalarVariable name="count" valueReference="1" causality="output" variability="discrete"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2"/><Unknown index="3"/><Unknown index="4"/><Unknown index="9"/></Outputs>
    <InitialUnknowns><Unknown index="2"/><Unknown index="3"/><Unknown index="4"/><Unknown index="9"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

C = r"""
#include <stdlib.h>
#include <string.h>
#include "fmi2Functions.h"
typedef struct { double r[5], slope; double last; int n, count; int on; char label[64]; const fmi2CallbackFunctions *f; } M;
#define LOG(m, s, ...) m->f->logger(m->f->componentEnvironment, "tiny", s, "logStatusError", __VA_ARGS__)
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean b, size_t n, const fmi2String s[]) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f,
                              fmi2Boolean v, fmi2Boolean l) {
  M *m = calloc(1, sizeof(M)); m->f = f; m->r[4] = 1; m->n = 3; m->on = 1; strcpy(m->label, "a"); return m; }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, double b, double t, fmi2Boolean d, double e) { return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { M *m = c;
  if (m->r[4] < 0) { LOG(m, fmi2Error, "k is %g, but must not be negative (n %d, label %s)", m->r[4], m->n, m->label); return fmi2Error; }
  return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { M *m = c; const fmi2CallbackFunctions *f = m->f; memset(m, 0, sizeof(M));
  m->f = f; m->r[4] = 1; m->n = 3; m->on = 1; strcpy(m->label, "a"); return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, double x[]) { M *m = c;
  m->r[2] = m->r[0] + m->r[1]; for (size_t i = 0; i < n; i++) x[i] = m->r[v[i]]; return fmi2OK; }
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, int x[]) { x[0] = v[0] ? ((M *)c)->count : ((M *)c)->n; return fmi2OK; }
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t n, int x[]) { x[0] = ((M *)c)->on; return fmi2OK; }
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String x[]) { x[0] = ((M *)c)->label; return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference v[], size_t n, const double x[]) { M *m = c;
  for (size_t i = 0; i < n; i++) m->r[v[i]] = x[i]; m->slope = 0; return fmi2OK; }
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference v[], size_t n, const int x[]) { ((M *)c)->n = x[0]; return fmi2OK; }
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference v[], size_t n, const int x[]) { ((M *)c)->on = x[0]; return fmi2OK; }
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String x[]) { strncpy(((M *)c)->label, x[0], 63); return fmi2OK; }
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { if (!*s) *s = malloc(sizeof(M)); memcpy(*s, c, sizeof(M)); return fmi2OK; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { memcpy(c, s, sizeof(M)); return fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { free(*s); *s = 0; return fmi2OK; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { *n = sizeof(M); return fmi2OK; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) { memcpy(b, s, n); return fmi2OK; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) { if (!*s) *s = malloc(n); memcpy(*s, b, n); return fmi2OK; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference a[], size_t n, const fmi2ValueReference b[], size_t k, const double x[], double y[]) { return fmi2Error; }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const int o[], const double x[]) { ((M *)c)->slope = x[0]; return fmi2OK; }
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n, const int o[], double x[]) { for (size_t i = 0; i < n; i++) x[i] = 7; return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, double t, double h, fmi2Boolean b) { M *m = c; double u = m->r[0];
  if (u > 100) { LOG(m, fmi2Error, "u is %g, more than 100", u); return fmi2Error; }
  if (u == 50) { m->last = t + h / 2; return fmi2Discard; }
  double step = m->r[4] * (u * h + m->slope * h * h / 2); m->r[1] += step; m->r[3] = step / h; m->count++; return fmi2OK; }
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *s) { return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, double *x) { *x = ((M *)c)->last; return fmi2OK; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, int *x) { return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *x) { return fmi2Discard; }
"""

PYTHON = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String

class Tiny(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y, self.y_direct, self.mean, self.k = 0.0, 0.0, 0.0, 0.0, 1.0
        self.n, self.on, self.label, self.count = 3, True, "a", 0
        for name, causality in dict(u="input", y="output", mean="output", k="parameter").items():
            fixed = dict(variability=Fmi2Variability.fixed) if causality == "parameter" else {}
            self.register_variable(Real(name, causality=Fmi2Causality[causality], **fixed))
        self.register_variable(Real("y_direct", causality=Fmi2Causality.output, getter=lambda: self.u + self.y))
        for kind, name in ((Integer, "n"), (Boolean, "on"), (String, "label")):
            self.register_variable(kind(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Integer("count", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete))

    def exit_initialization_mode(self):
        if self.k < 0:
            raise ValueError(f"k is {self.k:g}, but must not be negative (n {self.n}, label {self.label})")

    def do_step(self, t, h):
        if self.u > 100:
            raise ValueError(f"u is {self.u:g}, more than 100")
        if self.u == 50:
            return False
        self.y += self.k * self.u * h
        self.mean, self.count = self.k * self.u, self.count + 1
        return True
"""

COMPILED = shutil.which("cc") is not None and sys.platform == "linux"


def build(folder: Path) -> Path:
    """Write Tiny.fmu into a folder."""
    path = folder / "Tiny.fmu"
    if not COMPILED:
        from pythonfmu.builder import FmuBuilder

        (folder / "tiny.py").write_text(PYTHON)
        FmuBuilder.build_FMU(folder / "tiny.py", dest=folder)
        return path
    source, library = folder / "tiny.c", folder / "Tiny.so"
    source.write_text(C)
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-w", f"-I{headers}", "-o", library, source], check=True, capture_output=True
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", XML)
        archive.write(library, f"binaries/{fmpy.platform}/Tiny.so")
    return path


def changed(
    path: Path, target: Path, *, xml=lambda text: text, keep=lambda name: True, rename=lambda name: name
) -> Path:
    """Copy an FMU with another modelDescription.xml, or with other files."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            if keep(name):
                data = old.read(name)
                new.writestr(rename(name), xml(data.decode()) if name == "modelDescription.xml" else data)
    return target
