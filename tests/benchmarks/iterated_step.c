/* Calls of FMUs as they were recorded, made again from C with the same arguments. */
#include <stddef.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { SET, SET_DERIVATIVES, STEP, GET, GET_DERIVATIVES, GET_STATE, SET_STATE };

typedef struct {
    void *instance;
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*set_derivatives)(void *, const unsigned *, size_t, const int *, const double *);
    int (*step)(void *, double, double, int);
    int (*get)(void *, const unsigned *, size_t, double *);
    int (*get_derivatives)(void *, const unsigned *, size_t, const int *, double *);
    int (*get_state)(void *, void **);
    int (*set_state)(void *, void *);
    void *state;
} Fmu;

typedef struct {
    long kind, fmu, count;
    const unsigned *references;
    const int *orders;
    double *values;
    double t, h;
} Call;

EXPORT long replay(Fmu *fmus, const Call *call, long calls)
{
    long i, failed = 0;
    for (i = 0; i < calls; i++, call++) {
        Fmu *f = &fmus[call->fmu];
        const size_t n = (size_t)call->count;
        switch (call->kind) {
        case SET: failed += f->set(f->instance, call->references, n, call->values); break;
        case SET_DERIVATIVES:
            failed += f->set_derivatives(f->instance, call->references, n, call->orders, call->values);
            break;
        case STEP: failed += f->step(f->instance, call->t, call->h, 0); break;
        case GET: failed += f->get(f->instance, call->references, n, call->values); break;
        case GET_DERIVATIVES:
            failed += f->get_derivatives(f->instance, call->references, n, call->orders, call->values);
            break;
        case GET_STATE: failed += f->get_state(f->instance, &f->state); break;
        default: failed += f->set_state(f->instance, f->state);
        }
    }
    return failed;
}
