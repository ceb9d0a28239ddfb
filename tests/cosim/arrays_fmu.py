"""A small FMU of FMI 3.0, made here in C: variables of every type, arrays, a size that follows a structural parameter.

Feedthrough: y = G u (2 x 3), f = 2 f_in (Float32), w = w_in + 1 for every integer type w, b = not b_in (2 of them),
e = e_in, s = "<" + s_in. State: x' = u (3 of them), x(0) = x0; count counts steps, offset (structural, no size) is added.
Code may be put into fmi3DoStep: `early`, `end`, `last` are what it returns, `t` and `h` its arguments.
"""
# ruff: noqa: E501 (XML and C)

import zipfile
from pathlib import Path

import fmpy

from fmus import toolchain

WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")

C = r"""
#include <stdlib.h>
#include <string.h>
#include <stdio.h>
#include "fmi3Functions.h"
typedef struct {
    fmi3Float64 time, u[3], G[6], y[2], x[3], x0[3]; fmi3Float32 f_in, f; fmi3Boolean b_in[2], b[2];
    fmi3Int64 e_in, e; char s_in[64], s[66]; fmi3UInt64 size, offset, count, configuring;
    WHOLE_FIELDS
    fmi3LogMessageCallback log; fmi3InstanceEnvironment environment;
} M;
static const char token[] = "{arrays}";
static void start(M *m) {
    fmi3LogMessageCallback log = m->log; fmi3InstanceEnvironment environment = m->environment;
    memset(m, 0, sizeof *m); m->log = log; m->environment = environment;
    m->size = 3; m->e_in = 1; m->G[0] = 1; m->G[4] = 1; m->x0[0] = m->x[0] = 5; }
static void outputs(M *m) {
    size_t i, j;
    for (i = 0; i < 2; i++) { m->y[i] = 0; for (j = 0; j < 3; j++) m->y[i] += m->G[3 * i + j] * m->u[j]; m->b[i] = !m->b_in[i]; }
    m->f = 2 * m->f_in; m->e = m->e_in; snprintf(m->s, sizeof m->s, "<%s", m->s_in);
    WHOLE_OUTPUTS }
static void *place(M *m, fmi3ValueReference r, size_t *n) {
    *n = 1;
    switch (r) {
        case 0: return &m->time; case 1: *n = 3; return m->u; case 2: *n = 6; return m->G; case 3: *n = 2; return m->y;
        case 4: *n = 3; return m->x; case 5: *n = 3; return m->x0; case 6: return &m->f_in; case 7: return &m->f;
        case 8: *n = 2; return m->b_in; case 9: *n = 2; return m->b; case 10: return &m->e_in; case 11: return &m->e;
        case 14: return &m->size; case 15: return &m->offset; case 16: return &m->count;
        WHOLE_PLACES
    }
    return 0; }
const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean b, size_t n, const fmi3String s[]) { return fmi3OK; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String given, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean may_return, const fmi3ValueReference r[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    if (strcmp(given, token)) { log(environment, fmi3Error, "error", "the token is not that of the binary"); return 0; }
    if (events || may_return) return 0;
    M *m = calloc(1, sizeof *m); m->log = log; m->environment = environment; start(m); return m; }
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, double b, double t, fmi3Boolean d, double e) {
    M *m = c; m->time = t; return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { M *m = c; memcpy(m->x, m->x0, sizeof m->x); return fmi3OK; }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { ((M *)c)->configuring = 1; return fmi3OK; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { ((M *)c)->configuring = 0; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { start(c); return fmi3OK; }
#define MOVE(TYPE, FROM, TO) \
    M *m = c; outputs(m); for (size_t i = 0, k = 0; i < n; i++) { size_t size; TYPE *p = place(m, r[i], &size); \
        if (!p || k + size > count) return fmi3Error; \
        if ((r[i] == 14 || r[i] == 15) && SETS && !m->configuring) return fmi3Error; \
        for (size_t j = 0; j < size; j++, k++) TO = FROM; } return fmi3OK;
#define ACCESS(NAME) \
    fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3##NAME v[], size_t count) { \
        enum { SETS = 0 }; MOVE(fmi3##NAME, p[j], v[k]) } \
    fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3##NAME v[], size_t count) { \
        enum { SETS = 1 }; MOVE(fmi3##NAME, v[k], p[j]) }
ACCESS(Float64) ACCESS(Float32) ACCESS(Boolean) WHOLE_ACCESS
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3String v[], size_t count) {
    M *m = c; outputs(m); for (size_t i = 0; i < n; i++) v[i] = r[i] == 12 ? m->s_in : m->s; return fmi3OK; }
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3String v[], size_t count) {
    M *m = c; for (size_t i = 0; i < n; i++) snprintf(m->s_in, sizeof m->s_in, "%s", v[i]); return fmi3OK; }
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *s) {
    if (!*s) *s = malloc(sizeof(M)); memcpy(*s, c, sizeof(M)); return fmi3OK; }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState s) { memcpy(c, s, sizeof(M)); return fmi3OK; }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) { free(*s); *s = 0; return fmi3OK; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState s, size_t *n) { *n = sizeof(M); return fmi3OK; }
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState s, fmi3Byte b[], size_t n) { memcpy(b, s, n); return fmi3OK; }
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte b[], size_t n, fmi3FMUState *s) {
    if (!*s) *s = malloc(n); memcpy(*s, b, n); return fmi3OK; }
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference a[], size_t na,
    const fmi3ValueReference b[], size_t nb, const double seed[], size_t ns, double out[], size_t no) {
    M *m = c; if (na != 1 || nb != 1 || a[0] != 3 || b[0] != 1 || ns != 3 || no != 2) return fmi3Error;
    for (size_t i = 0; i < 2; i++) { out[i] = 0; for (size_t j = 0; j < 3; j++) out[i] += m->G[3 * i + j] * seed[j]; }
    return fmi3OK; }
fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Int32 o[],
    double v[], size_t count) {
    M *m = c; size_t k = 0;
    for (size_t i = 0; i < n; i++) for (size_t j = 0; r[i] == 4 && j < 3; j++) v[k++] = o[i] == 1 ? m->u[j] : 0;
    return k == count ? fmi3OK : fmi3Error; }
fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *end,
    fmi3Boolean *early, double *last) {
    M *m = c; *event = *end = *early = false; *last = t + h; m->count++; m->time = t + h;
    for (size_t i = 0; i < 3; i++) m->x[i] += h * m->u[i];
    STEP
    return fmi3OK; }
"""

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Arrays" instantiationToken="{token}" generationTool="by hand">
<CoSimulation modelIdentifier="Arrays" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"
 canSerializeFMUState="true" maxOutputDerivativeOrder="1" providesDirectionalDerivatives="true"/>
<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/></Unit>
<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit></UnitDefinitions>
<TypeDefinitions><EnumerationType name="Mode"><Item name="off" value="1"/><Item name="on" value="4"/></EnumerationType>
</TypeDefinitions>
<DefaultExperiment startTime="0" stopTime="1" stepSize="0.25"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="u" valueReference="1" causality="input" start="0 0 0" unit="rad"><Dimension valueReference="14"/></Float64>
<Float64 name="G" valueReference="2" causality="parameter" variability="tunable" start="1 0 0 0 1 0" description="gain">
 <Dimension start="2"/><Dimension valueReference="14"/></Float64>
<Float64 name="y" valueReference="3" causality="output" unit="rad"><Dimension start="2"/></Float64>
<Float64 name="x" valueReference="4" causality="output" unit="rad"><Dimension start="3"/>
 <Alias name="attitude" description="the same as x"/></Float64>
<Float64 name="x0" valueReference="5" causality="parameter" variability="fixed" start="5 0 0"><Dimension start="3"/></Float64>
<Float32 name="f_in" valueReference="6" causality="input" start="0"/>
<Float32 name="f" valueReference="7" causality="output"/>
<Boolean name="b_in" valueReference="8" causality="input" start="false"><Dimension start="2"/></Boolean>
<Boolean name="b" valueReference="9" causality="output"><Dimension start="2"/></Boolean>
<Enumeration name="e_in" valueReference="10" causality="input" declaredType="Mode" start="1"/>
<Enumeration name="e" valueReference="11" causality="output" declaredType="Mode"/>
<String name="s_in" valueReference="12" causality="input"><Start value=""/></String>
<String name="s" valueReference="13" causality="output"/>
<UInt64 name="size" valueReference="14" causality="structuralParameter" start="3" min="1"/>
<UInt64 name="offset" valueReference="15" causality="structuralParameter" start="0"/>
<UInt64 name="count" valueReference="16" causality="output"/>
{whole}
<Binary name="blob" valueReference="90" causality="output"/>
<Clock name="tick" valueReference="91" causality="input" intervalVariability="triggered"/>
</ModelVariables>
<ModelStructure>
<Output valueReference="3" dependencies="1"/><Output valueReference="4" dependencies=""/><Output valueReference="7"/>
<Output valueReference="9" dependencies="8"/><Output valueReference="11" dependencies="10"/>
<Output valueReference="13" dependencies="12"/><Output valueReference="16" dependencies=""/>
{outputs}
<InitialUnknown valueReference="3" dependencies="1"/><InitialUnknown valueReference="4" dependencies="5"/>
</ModelStructure>
</fmiModelDescription>
"""


def build(folder: Path, step: str = "", xml=lambda text: text, without: str = "") -> Path:
    """Write Arrays.fmu into a folder; `xml` changes its description, `without`: a function that the binary lacks."""
    references = {w: 20 + 2 * i for i, w in enumerate(WHOLE)}
    pieces = {
        "WHOLE_FIELDS": " ".join(f"fmi3{w} in_{w}, out_{w};" for w in WHOLE),
        "WHOLE_OUTPUTS": " ".join(f"m->out_{w} = (fmi3{w})(m->in_{w} + m->offset + 1);" for w in WHOLE),
        "WHOLE_PLACES": " ".join(f"case {r}: return &m->in_{w}; case {r + 1}: return &m->out_{w};" for w, r in references.items()),
        "WHOLE_ACCESS": " ".join(f"ACCESS({w})" for w in WHOLE),
        "STEP": step,
    }  # fmt: skip
    source = C
    for name, text in pieces.items():
        source = source.replace(name, text)
    if without:
        source = source.replace(f" {without}(", f" not_{without}(")
    whole = "".join(
        f'<{w} name="{w}_in" valueReference="{r}" causality="input" start="0"/>'
        f'<{w} name="{w}_out" valueReference="{r + 1}" causality="output"/>\n'
        for w, r in references.items()
    )
    outputs = "".join(f'<Output valueReference="{r + 1}" dependencies="{r} 15"/>' for r in references.values())
    made = folder / "arrays-source"
    made.mkdir()
    (made / "fmu.c").write_text(source, encoding="utf-8")
    library = made / f"Arrays{fmpy.sharedLibraryExtension}"
    toolchain.compile_library(made, "fmu.c", library, include=(Path(fmpy.__file__).parent / "c-code",))
    path = folder / "Arrays.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        text = XML.replace("{token}", "{arrays}").replace("{whole}", whole).replace("{outputs}", outputs)
        archive.writestr("modelDescription.xml", xml(text))
        archive.write(library, f"binaries/{fmpy.platform_tuple}/{library.name}")
    return path
