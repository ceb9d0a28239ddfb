/* A host that calls everything that a native FMU offers, rightly and wrongly: flown under sanitizers.
 *
 * One translation unit with the FMU, so that its sizes and tables are at hand. Returns 0; a call that answers otherwise
 * than expected prints its line and returns 1. */
#include "fmi2.c"

#define EXPECT(call, status)                                                                                           \
    do {                                                                                                               \
        if ((call) != (status)) {                                                                                      \
            printf("line %d: %s\n", __LINE__, #call);                                                                  \
            return 1;                                                                                                  \
        }                                                                                                              \
    } while (0)
#define OK(call) EXPECT(call, fmi2OK)
#define REFUSED(call) EXPECT(call, fmi2Error)

static void hear(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)environment, (void)instance, (void)status, (void)category, (void)message;
}

static double numbers[NV + 1], derivatives[NV + 1];
static fmi2ValueReference every[NV + 1], shown[NV + 1], driven[NV + 1];
static fmi2Integer first_order[NV + 1];

/* Nothing of what is refused here may be touched. */
static int misuse(fmi2Component c, fmi2FMUstate state)
{
    double foreign[8] = {0};
    fmi2FMUstate other = foreign, none = NULL;
    fmi2Byte bytes[4] = "adc";
    size_t size;
    REFUSED(fmi2GetReal(NULL, every, 1, numbers));
    REFUSED(fmi2GetReal(c, NULL, 1, numbers));
    REFUSED(fmi2GetReal(c, every, 1, NULL));
    REFUSED(fmi2SetReal(c, NULL, 1, numbers));
    REFUSED(fmi2SetReal(c, every, 1, NULL));
    REFUSED(fmi2SetRealInputDerivatives(c, driven, 1, NULL, numbers));
    REFUSED(fmi2GetRealOutputDerivatives(c, shown, 1, NULL, numbers));
    REFUSED(fmi2GetDirectionalDerivative(c, NULL, 1, driven, 1, numbers, derivatives));
    REFUSED(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, NULL));
    REFUSED(fmi2GetFMUstate(c, NULL));
    REFUSED(fmi2GetFMUstate(c, &other));
    REFUSED(fmi2SetFMUstate(c, other));
    REFUSED(fmi2FreeFMUstate(c, &other));
    REFUSED(fmi2FreeFMUstate(NULL, &state));
    REFUSED(fmi2SerializedFMUstateSize(c, other, &size));
    REFUSED(fmi2SerializeFMUstate(c, other, bytes, sizeof bytes));
    REFUSED(fmi2SerializeFMUstate(c, state, bytes, sizeof bytes));
    REFUSED(fmi2DeSerializeFMUstate(c, bytes, sizeof bytes, &none));
    REFUSED(fmi2DeSerializeFMUstate(c, NULL, sizeof bytes, &none));
    OK(fmi2GetReal(c, NULL, 0, NULL));
    OK(fmi2FreeFMUstate(c, &none));
    return 0;
}

static int fly(fmi2Component c, double h)
{
    fmi2FMUstate state = NULL, again = NULL;
    size_t size = 0, n_in = 0, n_out = 0, i;
    fmi2Byte *bytes;
    int k;
    for (i = 0; i < NV; i++) {
        every[i] = (fmi2ValueReference)i;
        first_order[i] = 1;
        if (variables[i].flags & OUTPUT) shown[n_out++] = every[i];
        if (i >= U0 && i < X0) driven[n_in++] = every[i];
    }
    OK(fmi2SetupExperiment(c, fmi2False, 0, 1.5, fmi2False, 0));
    OK(fmi2EnterInitializationMode(c));
    OK(fmi2GetReal(c, every, NV, numbers));
    OK(fmi2SetReal(c, driven, n_in, numbers + U0));
    OK(fmi2GetDirectionalDerivative(c, shown + n_out, 0, driven, n_in, numbers, derivatives));
    OK(fmi2ExitInitializationMode(c));
    for (k = 0; k < 60; k++) {
        const double t = 1.5 + k * h;
        if (k == 20) OK(fmi2GetFMUstate(c, &state));
        if (k == 40) {
            OK(fmi2SerializedFMUstateSize(c, state, &size));
            bytes = malloc(size);
            OK(fmi2SerializeFMUstate(c, state, bytes, size));
            OK(fmi2DeSerializeFMUstate(c, bytes, size, &again));
            free(bytes);
            OK(fmi2SetFMUstate(c, again));
            OK(fmi2DoStep(c, 1.5 + 20 * h, h, fmi2False));
            OK(fmi2GetFMUstate(c, &again));
            if (misuse(c, state)) return 1;
            OK(fmi2SetFMUstate(c, state));
            OK(fmi2DoStep(c, 1.5 + 20 * h, 20 * h, fmi2False));
        }
        for (i = 0; i < n_in; i++) numbers[i] = 1e-3 * sin(0.1 * k + (double)i);
        OK(fmi2SetReal(c, driven, n_in, numbers));
        if (k % 2) OK(fmi2SetRealInputDerivatives(c, driven, n_in, first_order, numbers));
        OK(fmi2DoStep(c, t, h, fmi2True));
        OK(fmi2GetReal(c, every, NV, numbers));
        OK(fmi2GetDirectionalDerivative(c, shown, n_out, driven, n_in, numbers, derivatives));
        EXPECT(fmi2GetRealOutputDerivatives(c, shown, n_out, first_order, numbers),
               SAMPLED && n_out ? fmi2Error : fmi2OK);
    }
    OK(fmi2FreeFMUstate(c, &state));
    OK(fmi2FreeFMUstate(c, &again));
    OK(fmi2Terminate(c));
    OK(fmi2Reset(c));
    return 0;
}

int main(void)
{
    const fmi2CallbackFunctions callbacks = {hear, calloc, free, NULL, NULL};
    fmi2Component c = fmi2Instantiate("flown", fmi2CoSimulation, MODEL_GUID, NULL, &callbacks, fmi2False, fmi2False);
    int wrong;
    if (!c || fmi2Instantiate("flown", fmi2CoSimulation, NULL, NULL, &callbacks, fmi2False, fmi2False)) return 1;
    wrong = fly(c, 1e-3);
    wrong = wrong || fly(c, 0.04);
    fmi2FreeInstance(c);
    fmi2FreeInstance(NULL);
    return wrong;
}
