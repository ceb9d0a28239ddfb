"""Small FMUs of a few lines of C, written where a test needs them: variables of every type, and what a step does.

    build(folder, "Adder", [real("u", "input"), real("y", depends="u")], outputs="y = u + 1;")

In the pieces of code each variable goes by its name. `m->state` are 8 doubles, `m->whole` 8 whole numbers, `m->now` is
the time. A String is an array of `TEXT` bytes. Of Real variables by their numbers: `m->slope`, `m->second`, `m->third`
are derivatives of inputs until they are set again, `m->slopes_out` those of outputs, the second ones from SIZE on.
"""

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import fmpy

from fmus import toolchain


@dataclass(frozen=True)
class Variable:
    """One scalar variable; `depends`: the inputs that an output follows directly, in words separated by blanks.

    `causality`: "tunable" is a parameter that is.
    """

    name: str
    type: str
    causality: str = "output"
    start: object = None
    depends: str = ""
    items: Mapping[str, int] = field(default_factory=dict)
    unit: str = ""


def _maker(kind: str, zero: object):
    def make(name: str, causality: str = "output", depends: str = "", start: object = None, **more) -> Variable:
        given = zero if start is None and causality != "output" else start
        return Variable(name, kind, causality, given, depends, **more)

    return make


real, integer, boolean = _maker("Real", 0.0), _maker("Integer", 0), _maker("Boolean", False)
enumeration, string = _maker("Enumeration", 1), _maker("String", "")

ARRAYS = {"Real": "real", "Integer": "number", "Enumeration": "number", "Boolean": "flag", "String": "text"}

C = r"""
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include <time.h>
#include "fmi2Functions.h"
enum { SIZE = 32, TEXT = 128 };
typedef struct {
    double real[SIZE], slope[SIZE], second[SIZE], third[SIZE], slopes_out[2 * SIZE], state[8], now, last;
    int number[SIZE], flag[SIZE];
    long long whole[8];
    char text[SIZE][TEXT];
} Memory;
typedef struct { Memory all; const fmi2CallbackFunctions *f; } Instance;
static void start(Memory *m);
static void outputs(Memory *m);
static int initialized(Memory *m);
static int step(Memory *m, double t, double h);
static int reset(Memory *m);
static int set(Memory *m);
static int get(Memory *m);
static int set_slopes(Memory *m);
static int get_slopes(Memory *m);
#define MEMORY Memory *m = &((Instance *)c)->all; size_t i
#define GET(type, array, done) \
    MEMORY; outputs(m); for (i = 0; i < n; i++) value[i] = (type)m->array[v[i]]; return done(m);
#define SET(array, done) MEMORY; for (i = 0; i < n; i++) m->array[v[i]] = value[i]; return done(m);
#define VR const fmi2ValueReference v[], size_t n
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean b, size_t n, const fmi2String s[]) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String a, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f,
                              fmi2Boolean v, fmi2Boolean l) {
    Instance *c = calloc(1, sizeof *c); c->f = f; start(&c->all); return c; }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, double b, double t, fmi2Boolean d, double e) {
    MEMORY; (void)i; m->now = t; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { MEMORY; (void)i; return initialized(m); }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { MEMORY; (void)i; return reset(m); }
fmi2Status fmi2GetReal(fmi2Component c, VR, double value[]) { GET(double, real, get) }
fmi2Status fmi2GetInteger(fmi2Component c, VR, int value[]) { GET(int, number, get) }
fmi2Status fmi2GetBoolean(fmi2Component c, VR, int value[]) { GET(int, flag, get) }
fmi2Status fmi2GetString(fmi2Component c, VR, fmi2String value[]) { GET(fmi2String, text, get) }
fmi2Status fmi2SetReal(fmi2Component c, VR, const double value[]) {
    MEMORY;
    for (i = 0; i < n; i++) {
        m->real[v[i]] = value[i]; m->slope[v[i]] = m->second[v[i]] = m->third[v[i]] = 0; }
    return set(m); }
fmi2Status fmi2SetInteger(fmi2Component c, VR, const int value[]) { SET(number, set) }
fmi2Status fmi2SetBoolean(fmi2Component c, VR, const int value[]) { SET(flag, set) }
fmi2Status fmi2SetString(fmi2Component c, VR, const fmi2String value[]) {
    MEMORY; for (i = 0; i < n; i++) snprintf(m->text[v[i]], TEXT, "%s", value[i]); return set(m); }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, VR, const int o[], const double value[]) {
    MEMORY; for (i = 0; i < n; i++) (o[i] == 1 ? m->slope : o[i] == 2 ? m->second : m->third)[v[i]] = value[i];
    return set_slopes(m); }
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, VR, const int o[], double value[]) {
    MEMORY; outputs(m); for (i = 0; i < n; i++) value[i] = m->slopes_out[v[i] + (size_t)(o[i] - 1) * SIZE];
    return get_slopes(m); }
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    MEMORY; (void)i; if (!*s) *s = malloc(sizeof *m); memcpy(*s, m, sizeof *m); return fmi2OK; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    MEMORY; (void)i; memcpy(m, s, sizeof *m); return fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { free(*s); *s = 0; return fmi2OK; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) {
    *n = sizeof(Memory); return fmi2OK; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) {
    memcpy(b, s, n); return fmi2OK; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) {
    if (!*s) *s = malloc(n); memcpy(*s, b, n); return fmi2OK; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference a[], size_t n,
    const fmi2ValueReference b[], size_t k, const double x[], double y[]) { return fmi2Error; }
fmi2Status fmi2DoStep(fmi2Component c, double t, double h, fmi2Boolean b) {
    MEMORY; int status = step(m, t, h); (void)i; m->now = t + h; return status; }
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *s) { return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, double *x) {
    MEMORY; (void)i; *x = m->last; return fmi2OK; }
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, int *x) { return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *x) { return fmi2Discard; }
"""


def build(
    folder: Path,
    name: str,
    variables: Sequence[Variable],
    *,
    outputs: str = "",
    step: str = "",
    initialized: str = "",
    reset: str = "memset(m, 0, sizeof *m); start(m);",
    on_set: str = "",
    on_get: str = "",
    on_set_slopes: str = "",
    on_get_slopes: str = "",
    units: str = "",
    refresh: bool = True,
    input_derivatives: int = 0,
    template: str = C,
    **capabilities: object,
) -> Path:
    """Write NAME.fmu into a folder.

    outputs: code before every get. step: code of fmi2DoStep, with `t` and `h`; it may return a status. initialized,
    reset, on_set, on_get and those of slopes, of inputs and outputs: code that may return a status too.
    input_derivatives: up to which order it says to take them. capabilities: attributes of CoSimulation.
    """
    references = _references(variables)
    names = "\n".join(f"#define {v.name} (m->{ARRAYS[v.type]}[{references[v.name]}])" for v in variables)
    starts = "\n".join(_start(v) for v in variables if v.start is not None)
    pieces = [
        template,
        names,
        f"static void start(Memory *m) {{ {starts} }}",
        f"static void outputs(Memory *m) {{ {outputs} }}",
        *(
            f"static int {piece}(Memory *m{more}) {{ {code} return fmi2OK; }}"
            for piece, more, code in (
                ("initialized", "", initialized),
                ("step", ", double t, double h", step),
                ("reset", "", reset),
                ("set", "", on_set),
                ("get", "", on_get),
                ("set_slopes", "", on_set_slopes),
                ("get_slopes", "", on_get_slopes),
            )
        ),
    ]
    made = folder / f"{name}-source"
    made.mkdir()
    (made / "fmu.c").write_text("\n".join(pieces), encoding="utf-8")
    library = made / f"{name}{fmpy.sharedLibraryExtension}"
    headers = Path(fmpy.__file__).parent / "c-code"
    toolchain.compile_library(made, "fmu.c", library, include=(headers,))
    path = folder / f"{name}.fmu"
    marks = {"refresh": "true" if refresh else "", "inputDerivatives": input_derivatives or ""}
    mark = " ".join(f'{key}="{value}"' for key, value in marks.items() if value)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", _xml(name, variables, references, units, mark, capabilities))
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path


def _references(variables: Sequence[Variable]) -> dict[str, int]:
    count = dict.fromkeys(ARRAYS.values(), 0)
    found: dict[str, int] = {}
    for v in variables:
        found[v.name] = count[ARRAYS[v.type]]
        count[ARRAYS[v.type]] += 1
    return found


def _start(v: Variable) -> str:
    if v.type == "String":
        return f'strcpy({v.name}, "{v.start}");'
    return f"{v.name} = {int(v.start) if isinstance(v.start, bool) else v.start};"


def _xml(name, variables, references, units, mark, capabilities) -> str:
    place = {v.name: i for i, v in enumerate(variables, 1)}
    said = {
        "canHandleVariableCommunicationStepSize": True,
        "canInterpolateInputs": True,
        "canGetAndSetFMUstate": True,
        "canSerializeFMUstate": True,
    } | capabilities
    attributes = " ".join(f'{key}="{_word(value)}"' for key, value in said.items())
    types, lines = "", ""
    for v in variables:
        if v.items:
            items = "".join(f'<Item name="{k}" value="{n}"/>' for k, n in v.items.items())
            types += f'<SimpleType name="{v.name}_type"><Enumeration>{items}</Enumeration></SimpleType>'
        kind = {
            "input": "",
            "output": ' initial="calculated"',
            "parameter": ' variability="fixed" initial="exact"',
            "tunable": ' variability="tunable" initial="exact"',
        }[v.causality]
        causality = "parameter" if v.causality == "tunable" else v.causality
        if v.type != "Real" and causality != "parameter":
            kind += ' variability="discrete"'
        inner = f' declaredType="{v.name}_type"' if v.items else ""
        inner += f' unit="{v.unit}"' if v.unit else ""
        inner += f' start="{_word(v.start)}"' if v.start is not None and v.causality != "output" else ""
        lines += (
            f'<ScalarVariable name="{v.name}" valueReference="{references[v.name]}" causality="{causality}"{kind}>'
            f"<{v.type}{inner}/></ScalarVariable>\n"
        )
    unknowns = "".join(
        f'<Unknown index="{place[v.name]}" dependencies="{" ".join(str(place[d]) for d in v.depends.split())}"/>'
        for v in variables
        if v.causality == "output"
    )
    listed = f"<Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns>"
    marked = f'<VendorAnnotations><Tool name="adcs-cosim"><Slave {mark}/></Tool></VendorAnnotations>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{{{name}}}" generationTool="by hand">\n'
        f'<CoSimulation modelIdentifier="{name}" {attributes}/>\n'
        + (f"<UnitDefinitions>{units}</UnitDefinitions>\n" if units else "")
        + (f"<TypeDefinitions>{types}</TypeDefinitions>\n" if types else "")
        + (marked if mark else "")
        + f"<ModelVariables>\n{lines}</ModelVariables>\n"
        f"<ModelStructure>{unknowns and listed}</ModelStructure>\n"
        "</fmiModelDescription>\n"
    )


def _word(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
