/* Plant and controller, Jacobi, by hand: what a C programmer writes for these two FMUs and this wiring.
 *
 * loop_same makes the calls that the kernel makes, in the same order: at every communication point the controller, whose
 * output answers its inputs, is evaluated with what the plant shows there. loop_lean leaves out what this wiring does not
 * need: the controller's inputs are set once a point, its output is read once. Both give the same numbers: time is
 * counted, `rate` steps a second. */
#include <stddef.h>

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
    unsigned in[2], out[2];
} Fmu;

EXPORT int loop_same(const Fmu *plant, const Fmu *pd, long steps, double rate, double *y, double *u)
{
    long k;
    for (k = 0; k < steps; k++) {
        double t = (double)k / rate, h = (double)(k + 1) / rate - t, y_next[2], u_next;
        if (plant->set(plant->instance, plant->in, 1, u) > 1) return 1;
        if (plant->step(plant->instance, t, h, 1) > 1) return 1;
        if (plant->get(plant->instance, plant->out, 2, y_next) > 1) return 1;
        if (pd->set(pd->instance, pd->in, 2, y) > 1) return 1;
        if (pd->step(pd->instance, t, h, 1) > 1) return 1;
        if (pd->get(pd->instance, pd->out, 1, &u_next) > 1) return 1;
        y[0] = y_next[0], y[1] = y_next[1];
        if (pd->set(pd->instance, pd->in, 2, y) > 1) return 1;
        if (pd->get(pd->instance, pd->out, 1, u) > 1) return 1;
    }
    return 0;
}

EXPORT int loop_lean(const Fmu *plant, const Fmu *pd, long steps, double rate, double *y, double *u)
{
    long k;
    for (k = 0; k < steps; k++) {
        double t = (double)k / rate, h = (double)(k + 1) / rate - t;
        if (plant->set(plant->instance, plant->in, 1, u) > 1) return 1;
        if (plant->step(plant->instance, t, h, 1) > 1) return 1;
        if (plant->get(plant->instance, plant->out, 2, y) > 1) return 1;
        if (pd->step(pd->instance, t, h, 1) > 1) return 1;
        if (pd->set(pd->instance, pd->in, 2, y) > 1) return 1;
        if (pd->get(pd->instance, pd->out, 1, u) > 1) return 1;
    }
    return 0;
}
