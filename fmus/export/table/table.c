/* FMI 2.0 co-simulation slave whose outputs follow tables over time, the same for every table. Beside it, generated:
 *   table.h   name and GUID, and for each output a Channel
 *
 * A value reference is the number of an output. With knots t_i, an output at t with t_i <= t < t_i+1 is, by its degree,
 *   0   y_i
 *   1   y_i + (y_i+1 - y_i) / (t_i+1 - t_i) s                        with s = t - t_i
 *   3   c_i0 + s (c_i1 + s (c_i2 + s c_i3))
 * and before the first and after the last knot what it is there. The state is the time alone. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { REAL, INTEGER, BOOLEAN };

typedef struct {
    int kind, degree;
    size_t knots;
    const double *t, *y; /* y: a value for each knot; of degree 3 four coefficients for each piece */
} Channel;

#include "table.h"

static const double HAIR = 1e-9; /* s: a knot that is so near is reached, for times are sums of steps */

typedef struct {
    double t;
    const fmi2CallbackFunctions *callbacks;
    char *name;
} Instance;

static fmi2Status failed(Instance *m, const char *text, ...)
{
    char line[200];
    va_list arguments;
    va_start(arguments, text);
    vsnprintf(line, sizeof line, text, arguments);
    va_end(arguments);
    if (m->callbacks->logger)
        m->callbacks->logger(m->callbacks->componentEnvironment, m->name, fmi2Error, "logStatusError", "%s", line);
    return fmi2Error;
}

/* The value of an output at t, and its slope. */
static double value_at(const Channel *c, double t, double *slope)
{
    const size_t last = c->knots - 1;
    size_t i = 0, beyond = c->knots;
    double s;
    *slope = 0;
    while (beyond - i > 1) { /* t_i is reached, t_beyond is not */
        const size_t middle = i + (beyond - i) / 2;
        if (t >= c->t[middle] - HAIR) i = middle;
        else beyond = middle;
    }
    if (c->degree == 0) return c->y[i];
    if (t < c->t[0]) return c->y[0]; /* of degree 3: c_00, the value there */
    if (i == last) {
        i = last - 1;
        if (t > c->t[last]) t = c->t[last];
    }
    s = t - c->t[i];
    if (c->degree == 1) {
        *slope = (c->y[i + 1] - c->y[i]) / (c->t[i + 1] - c->t[i]);
        return c->y[i] + s * *slope;
    } else {
        const double *p = c->y + 4 * i;
        *slope = p[1] + s * (2 * p[2] + s * (3 * p[3]));
        return p[0] + s * (p[1] + s * (p[2] + s * p[3]));
    }
}

/* The output of a value reference, NULL where there is none of that kind. */
static const Channel *output(Instance *m, fmi2ValueReference reference, int kind, const char *function)
{
    static const char *const kinds[] = {"Real", "Integer or Enumeration", "Boolean"};
    if (reference < N_CHANNELS && channels[reference].kind == kind) return &channels[reference];
    failed(m, "%s: value reference %u is no %s. Outputs: 0 to %d.", function, reference, kinds[kind], N_CHANNELS - 1);
    return NULL;
}

static fmi2Status settable(Instance *m, size_t n, const char *function)
{
    return n ? failed(m, "%s: nothing can be set, all variables are outputs that follow the time.", function) : fmi2OK;
}

/* ---- life --------------------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    Instance *m;
    (void)resources;
    (void)visible;
    (void)logging;
    if (!callbacks || !name) return NULL;
    m = calloc(1, sizeof *m);
    if (!m) return NULL;
    m->callbacks = callbacks;
    m->name = malloc(strlen(name) + 1);
    if (m->name) strcpy(m->name, name);
    if (!m->name || type != fmi2CoSimulation || !guid || strcmp(guid, TABLE_GUID)) {
        if (m->name)
            failed(m, type != fmi2CoSimulation ? "fmi2Instantiate: this FMU is for co-simulation."
                                               : "fmi2Instantiate: the GUID is not that of this binary, " TABLE_GUID ".");
        fmi2FreeInstance(m);
        return NULL;
    }
    return m;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *m = c;
    if (!m) return;
    free(m->name);
    free(m);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c;
    (void)on;
    (void)n;
    (void)categories;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_said, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_said, fmi2Real stop)
{
    (void)tolerance_said;
    (void)tolerance;
    (void)stop_said;
    (void)stop;
    ((Instance *)c)->t = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2Terminate(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2Reset(fmi2Component c)
{
    ((Instance *)c)->t = 0;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return)
{
    (void)no_return;
    ((Instance *)c)->t = t + h;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return failed(c, "fmi2CancelStep: no step is pending."); }

/* ---- values ------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Real values[])
{
    size_t i;
    double slope;
    for (i = 0; i < n; i++) {
        const Channel *channel = output(c, references[i], REAL, "fmi2GetReal");
        if (!channel) return fmi2Error;
        values[i] = value_at(channel, ((Instance *)c)->t, &slope);
    }
    return fmi2OK;
}

static fmi2Status whole(Instance *m, const fmi2ValueReference references[], size_t n, int values[], int kind)
{
    size_t i;
    double slope;
    for (i = 0; i < n; i++) {
        const Channel *channel = output(m, references[i], kind, kind == INTEGER ? "fmi2GetInteger" : "fmi2GetBoolean");
        if (!channel) return fmi2Error;
        values[i] = (int)value_at(channel, m->t, &slope);
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Integer values[])
{
    return whole(c, references, n, values, INTEGER);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Boolean values[])
{
    return whole(c, references, n, values, BOOLEAN);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2String values[])
{
    (void)references;
    (void)values;
    return n ? failed(c, "fmi2GetString: no output is a String.") : fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                        const fmi2Integer orders[], fmi2Real values[])
{
    size_t i;
    for (i = 0; i < n; i++) {
        const Channel *channel = output(c, references[i], REAL, "fmi2GetRealOutputDerivatives");
        if (!channel) return fmi2Error;
        if (orders[i] != 1) return failed(c, "fmi2GetRealOutputDerivatives: order %d, known is order 1.", orders[i]);
        value_at(channel, ((Instance *)c)->t, &values[i]);
    }
    return fmi2OK;
}

#define REFUSED(name, type)                                                                                            \
    fmi2Status name(fmi2Component c, const fmi2ValueReference references[], size_t n, const type values[])             \
    {                                                                                                                  \
        (void)references;                                                                                              \
        (void)values;                                                                                                  \
        return settable(c, n, #name);                                                                                  \
    }
REFUSED(fmi2SetReal, fmi2Real)
REFUSED(fmi2SetInteger, fmi2Integer)
REFUSED(fmi2SetBoolean, fmi2Boolean)
REFUSED(fmi2SetString, fmi2String)

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                       const fmi2Integer orders[], const fmi2Real values[])
{
    (void)references;
    (void)orders;
    (void)values;
    return settable(c, n, "fmi2SetRealInputDerivatives");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknown,
                                        const fmi2ValueReference knowns[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real values[])
{
    (void)unknowns;
    (void)n_unknown;
    (void)knowns;
    (void)n_known;
    (void)seed;
    (void)values;
    return failed(c, "fmi2GetDirectionalDerivative: there is no input to derive by.");
}

/* ---- state -------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(double));
    if (!*state) return failed(c, "fmi2GetFMUstate: no memory.");
    memcpy(*state, &((Instance *)c)->t, sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    if (!state) return failed(c, "fmi2SetFMUstate: there is no state.");
    memcpy(&((Instance *)c)->t, state, sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c;
    (void)state;
    *size = sizeof(double);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    if (!state || size < sizeof(double)) return failed(c, "fmi2SerializeFMUstate: no state, or no room for it.");
    memcpy(bytes, state, sizeof(double));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    if (size != sizeof(double)) return failed(c, "fmi2DeSerializeFMUstate: a state of this FMU has %d bytes.", (int)sizeof(double));
    *state = malloc(sizeof(double));
    if (!*state) return failed(c, "fmi2DeSerializeFMUstate: no memory.");
    memcpy(*state, bytes, sizeof(double));
    return fmi2OK;
}

/* ---- status ------------------------------------------------------------------------------------------------------- */

#define DISCARDED(name, type)                                                                                          \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value)                                           \
    {                                                                                                                  \
        (void)c;                                                                                                       \
        (void)kind;                                                                                                    \
        (void)value;                                                                                                   \
        return fmi2Discard; /* no step is ever pending or discarded */                                                 \
    }
DISCARDED(fmi2GetStatus, fmi2Status)
DISCARDED(fmi2GetRealStatus, fmi2Real)
DISCARDED(fmi2GetIntegerStatus, fmi2Integer)
DISCARDED(fmi2GetBooleanStatus, fmi2Boolean)
DISCARDED(fmi2GetStringStatus, fmi2String)
