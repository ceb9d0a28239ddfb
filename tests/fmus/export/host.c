/* A host that is no Python process: host LIBRARY GUID RESOURCES steps h n_in n_out reference...
 *
 * Gives input i the value 0.1 (i + 1) in initialization mode, takes steps, and prints the outputs after each. What the
 * FMU logs goes to standard error. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#define MOST 64
#define LOAD(name, type)                                                                                               \
    type *name = (type *)dlsym(library, #name);                                                                        \
    if (!name) return fprintf(stderr, "no " #name "\n"), 2
#define OK(call)                                                                                                       \
    if ((call) != fmi2OK) return fprintf(stderr, "failed: " #call "\n"), 3

static void hear(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

int main(int argc, char **argv)
{
    const fmi2CallbackFunctions callbacks = {hear, calloc, free, NULL, NULL};
    fmi2ValueReference in[MOST], out[MOST];
    fmi2Real values[MOST];
    const int steps = argc > 7 ? atoi(argv[4]) : 0, n_in = argc > 7 ? atoi(argv[6]) : 0, n_out = argc > 7 ? atoi(argv[7]) : 0;
    const double h = argc > 7 ? atof(argv[5]) : 0;
    int i, k;
    fmi2Component c;
    void *library = argc == 8 + n_in + n_out ? dlopen(argv[1], RTLD_NOW) : NULL;
    if (!library) return fprintf(stderr, "%s\n", argc > 7 ? dlerror() : "arguments?"), 2;
    LOAD(fmi2Instantiate, fmi2InstantiateTYPE);
    LOAD(fmi2SetupExperiment, fmi2SetupExperimentTYPE);
    LOAD(fmi2EnterInitializationMode, fmi2EnterInitializationModeTYPE);
    LOAD(fmi2ExitInitializationMode, fmi2ExitInitializationModeTYPE);
    LOAD(fmi2SetReal, fmi2SetRealTYPE);
    LOAD(fmi2GetReal, fmi2GetRealTYPE);
    LOAD(fmi2DoStep, fmi2DoStepTYPE);
    LOAD(fmi2Terminate, fmi2TerminateTYPE);
    LOAD(fmi2FreeInstance, fmi2FreeInstanceTYPE);
    for (i = 0; i < n_in; i++) in[i] = (fmi2ValueReference)atoi(argv[8 + i]), values[i] = 0.1 * (i + 1);
    for (i = 0; i < n_out; i++) out[i] = (fmi2ValueReference)atoi(argv[8 + n_in + i]);
    c = fmi2Instantiate("unit", fmi2CoSimulation, argv[2], argv[3], &callbacks, fmi2False, fmi2True);
    if (!c) return fprintf(stderr, "no instance\n"), 3;
    OK(fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0));
    OK(fmi2EnterInitializationMode(c));
    OK(fmi2SetReal(c, in, (size_t)n_in, values));
    OK(fmi2ExitInitializationMode(c));
    for (k = 0; k < steps; k++) {
        OK(fmi2DoStep(c, k * h, h, fmi2True));
        OK(fmi2GetReal(c, out, (size_t)n_out, values));
        for (i = 0; i < n_out; i++) printf("%.17g ", values[i]);
        putchar('\n');
        fflush(stdout);
    }
    OK(fmi2Terminate(c));
    fmi2FreeInstance(c);
    return 0;
}
