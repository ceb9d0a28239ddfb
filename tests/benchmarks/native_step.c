/* The component's CasADi functions in loops of their own, compiled with the FMU's flags: `advance` from x to x, step by
 * step (direct), beside fmi2DoStep and the calls around it, called by pointers (step, exchange). */
#include <stddef.h>

#define CASADI_SYMBOL_EXPORT static
#include "whole.c"
#undef EXPORT

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
} Fmu;

/* x holds nx numbers; the other vectors are those of the FMU. */
EXPORT void direct(long from, long steps, double h, long nx, double *x, const double *u, const double *zero,
                   const double *p, const double *c)
{
    double next[512], w[advance_SZ_W + 1], t, since = 0;
    int iw[advance_SZ_IW + 1];
    const double *arguments[advance_SZ_ARG];
    double *results[advance_SZ_RES];
    long k, i;
    for (k = from; k < from + steps; k++) {
        t = (double)k * h;
        arguments[0] = &t, arguments[1] = x, arguments[2] = u, arguments[3] = zero, arguments[4] = zero;
        arguments[5] = zero, arguments[6] = p, arguments[7] = c, arguments[8] = &since, arguments[9] = &h;
        results[0] = next;
        advance(arguments, results, iw, w, 0);
        for (i = 0; i < nx; i++) x[i] = next[i];
    }
}

EXPORT int step(const Fmu *f, long from, long steps, double h)
{
    long k;
    for (k = from; k < from + steps; k++)
        if (f->step(f->instance, (double)k * h, h, 1) > 1) return 1;
    return 0;
}

EXPORT int exchange(const Fmu *f, long from, long steps, double h, size_t nu, const unsigned *in, const double *u,
                    size_t ny, const unsigned *out, double *y)
{
    long k;
    for (k = from; k < from + steps; k++) {
        if (f->set(f->instance, in, nu, u) > 1) return 1;
        if (f->step(f->instance, (double)k * h, h, 1) > 1) return 1;
        if (f->get(f->instance, out, ny, y) > 1) return 1;
    }
    return 0;
}
