/* An FMI 3.0 instance behind the functions of FMI 2.0 that the kernel calls: cosim/slaves/fmi3.py in C.
 *
 * A value reference is the place of a scalar among all of the FMU. FMI 3.0 takes whole arrays: what an array was set to
 * stands in `known`, which is Python's memory too, and a set that touches some of it sends all. What is returned early or
 * asks for the end of the run is discarded, and the status functions tell the rest; `function` is what is called now. */
enum { ERROR_OF_CALL = 3 }; /* fmi3Error */
enum { FLOAT64, FLOAT32, INT8, UINT8, INT16, UINT16, INT32, INT64, BOOLEAN3, STRING3 }; /* fmi3_kernel.TYPES */

static const char *const set_names[] = {"fmi3SetFloat64", "fmi3SetFloat32", "fmi3SetInt8", "fmi3SetUInt8", "fmi3SetInt16",
                                        "fmi3SetUInt16", "fmi3SetInt32", "fmi3SetInt64", "fmi3SetBoolean", "fmi3SetString"};
static const char *const get_names[] = {"fmi3GetFloat64", "fmi3GetFloat32", "fmi3GetInt8", "fmi3GetUInt8", "fmi3GetInt16",
                                        "fmi3GetUInt16", "fmi3GetInt32", "fmi3GetInt64", "fmi3GetBoolean", "fmi3GetString"};

/* What a scalar's type makes of a number. */
static void put3(void *values, integer type, integer i, double v)
{
    switch (type) {
    case FLOAT64: ((double *)values)[i] = v; break;
    case FLOAT32: ((float *)values)[i] = (float)v; break;
    case INT8: ((signed char *)values)[i] = (signed char)v; break;
    case UINT8: ((unsigned char *)values)[i] = (unsigned char)v; break;
    case INT16: ((short *)values)[i] = (short)v; break;
    case UINT16: ((unsigned short *)values)[i] = (unsigned short)v; break;
    case INT32: ((int *)values)[i] = (int)v; break;
    case INT64: ((long long *)values)[i] = (long long)v; break;
    default: ((unsigned char *)values)[i] = v != 0; break;
    }
}

static double number3(const void *values, integer type, integer i)
{
    switch (type) {
    case FLOAT64: return ((const double *)values)[i];
    case FLOAT32: return (double)((const float *)values)[i];
    case INT8: return ((const signed char *)values)[i];
    case UINT8: return ((const unsigned char *)values)[i];
    case INT16: return ((const short *)values)[i];
    case UINT16: return ((const unsigned short *)values)[i];
    case INT32: return ((const int *)values)[i];
    case INT64: return (double)((const long long *)values)[i];
    default: return ((const unsigned char *)values)[i];
    }
}

/* Whether the type of a scalar cannot hold a whole number. */
static int beyond3(integer type, int v)
{
    switch (type) {
    case INT8: return v < -128 || v > 127;
    case UINT8: return v < 0 || v > 255;
    case INT16: return v < -32768 || v > 32767;
    case UINT16: return v < 0 || v > 65535;
    default: return 0;
    }
}

/* Whether the next scalar of a request is of the same array. */
static int goes_on(const Fmi3 *f, const unsigned *references, size_t i, size_t n)
{
    return i + 1 < n && f->scalar[references[i + 1]].array == f->scalar[references[i]].array;
}

/* The worse of two statuses, of which one may be OK or WARNING. */
static int worse3(int a, int b) { return a > b ? a : b; }

/* ---- values ------------------------------------------------------------------------------------------------------- */

/* Set scalars to numbers, of which one of `real` and `whole` is given. */
static int set3(Fmi3 *f, const unsigned *references, size_t n, const double *real, const int *whole)
{
    int status = OK;
    size_t i;
    for (i = 0; i < n && whole; i++) {
        const Scalar3 *s = &f->scalar[references[i]];
        if (!beyond3(s->type, whole[i])) continue;
        f->refused = references[i];
        f->refused_value = whole[i];
        f->function = set_names[s->type];
        return ERROR_OF_CALL;
    }
    for (i = 0; i < n; i++) {
        const Scalar3 *s = &f->scalar[references[i]];
        put3(s->known, s->type, s->index, real ? real[i] : (double)whole[i]);
        if (goes_on(f, references, i, n)) continue;
        f->function = set_names[s->type];
        status = worse3(status, f->set[s->type](f->instance, &s->array, 1, s->known, (size_t)s->size));
        if (status > WARNING) return status;
    }
    return status;
}

/* Read scalars into one of `real` and `whole`. */
static int get3(Fmi3 *f, const unsigned *references, size_t n, double *real, int *whole)
{
    int status = OK, read = 0;
    size_t i;
    for (i = 0; i < n; i++) {
        const Scalar3 *s = &f->scalar[references[i]];
        if (!read) {
            f->function = get_names[s->type];
            status = worse3(status, f->get[s->type](f->instance, &s->array, 1, f->work, (size_t)s->size));
            if (status > WARNING) return status;
        }
        if (real) real[i] = number3(f->work, s->type, s->index);
        else whole[i] = (int)number3(f->work, s->type, s->index);
        read = goes_on(f, references, i, n);
    }
    return status;
}

EXPORT int fmi3_set_real(void *f, const unsigned *references, size_t n, const double *values)
{
    return set3(f, references, n, values, NULL);
}

EXPORT int fmi3_get_real(void *f, const unsigned *references, size_t n, double *values)
{
    return get3(f, references, n, values, NULL);
}

EXPORT int fmi3_set_integer(void *f, const unsigned *references, size_t n, const int *values)
{
    return set3(f, references, n, NULL, values);
}

EXPORT int fmi3_get_integer(void *f, const unsigned *references, size_t n, int *values)
{
    return get3(f, references, n, NULL, values);
}

EXPORT int fmi3_set_string(void *instance, const unsigned *references, size_t n, const char *const *values)
{
    Fmi3 *f = instance;
    int status = OK;
    size_t i;
    f->function = set_names[STRING3];
    for (i = 0; i < n && status <= WARNING; i++)
        status = worse3(status, f->set[STRING3](f->instance, &f->scalar[references[i]].array, 1, (void *)&values[i], 1));
    return status;
}

EXPORT int fmi3_get_string(void *instance, const unsigned *references, size_t n, const char **values)
{
    static const char nothing[] = "";
    Fmi3 *f = instance;
    int status = OK;
    size_t i;
    f->function = get_names[STRING3];
    for (i = 0; i < n && status <= WARNING; i++) {
        status = worse3(status, f->get[STRING3](f->instance, &f->scalar[references[i]].array, 1, &values[i], 1));
        if (!values[i]) values[i] = nothing;
    }
    return status;
}

EXPORT int fmi3_get_derivatives(void *instance, const unsigned *references, size_t n, const int *orders, double *values)
{
    Fmi3 *f = instance;
    double *slopes = f->work;
    int status = OK;
    size_t i;
    f->function = "fmi3GetOutputDerivatives";
    for (i = 0; i < n; i++) {
        const Scalar3 *s = &f->scalar[references[i]];
        if (!i || !goes_on(f, references, i - 1, n) || orders[i] != orders[i - 1])
            status = worse3(status, f->get_derivatives(f->instance, &s->array, 1, &orders[i], slopes, (size_t)s->size));
        if (status > WARNING) return status;
        values[i] = slopes[s->index];
    }
    return status;
}

/* ---- steps and states --------------------------------------------------------------------------------------------- */

EXPORT int fmi3_do_step(void *instance, double t, double h, int no_return)
{
    Fmi3 *f = instance;
    unsigned char event = 0, terminate = 0, early = 0;
    int status;
    (void)no_return;
    f->last = t + h;
    f->function = "fmi3DoStep";
    status = f->do_step(f->instance, t, h, 1, &event, &terminate, &early, &f->last);
    f->terminated = terminate;
    f->early = early;
    return status <= WARNING && (terminate || early) ? DISCARD : status;
}

EXPORT int fmi3_get_boolean_status(void *instance, int kind, int *value)
{
    const Fmi3 *f = instance;
    (void)kind;
    *value = (int)(f->terminated && !f->early);
    return OK;
}

EXPORT int fmi3_get_real_status(void *instance, int kind, double *value)
{
    (void)kind;
    *value = ((const Fmi3 *)instance)->last;
    return OK;
}

EXPORT int fmi3_get_state(void *instance, void **state)
{
    Fmi3 *f = instance;
    f->function = "fmi3GetFMUState";
    return f->get_state(f->instance, state);
}

EXPORT int fmi3_set_state(void *instance, void *state)
{
    Fmi3 *f = instance;
    f->function = "fmi3SetFMUState";
    return f->set_state(f->instance, state);
}

EXPORT int fmi3_free_state(void *instance, void **state)
{
    Fmi3 *f = instance;
    return f->free_state(f->instance, state);
}
