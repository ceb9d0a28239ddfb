/* Jacobi by hand for any number of FMUs: set inputs, step all, get outputs; rows, where asked for, stay in memory. */
#include <stddef.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef struct {
    void *instance;
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*step)(void *, double, double, int);
    const unsigned *inputs;
    const long *sources;
    const unsigned *outputs;
    long n_inputs, n_outputs, first;
} Unit;

static int get_all(const Unit *units, int count, double *values)
{
    int i, status = 0;
    for (i = 0; i < count; i++) {
        const Unit *u = &units[i];
        if (u->n_outputs) status |= u->get(u->instance, u->outputs, (size_t)u->n_outputs, values + u->first);
    }
    return status;
}

/* The steps from `first` to before `end`. */
EXPORT int fly(const Unit *units, int count, long first, long end, double h, int width, double *values, double *inputs,
               double *rows)
{
    long k, j;
    int i, status = get_all(units, count, values);
    for (k = first; k < end; k++) {
        const double t = (double)k * h;
        for (i = 0; i < count; i++) {
            const Unit *u = &units[i];
            for (j = 0; j < u->n_inputs; j++) inputs[j] = values[u->sources[j]];
            if (u->n_inputs) status |= u->set(u->instance, u->inputs, (size_t)u->n_inputs, inputs);
        }
        for (i = 0; i < count; i++) status |= units[i].step(units[i].instance, t, h, 1);
        status |= get_all(units, count, values);
        if (rows) {
            double *row = rows + (size_t)k * ((size_t)width + 1);
            row[0] = t + h;
            memcpy(row + 1, values, (size_t)width * sizeof *values);
        }
        if (status > 1) return status;
    }
    return 0;
}
