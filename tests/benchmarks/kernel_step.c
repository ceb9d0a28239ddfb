/* Plants and controllers in pairs by hand: what a C programmer writes for these FMUs and this wiring.
 *
 * loop_same makes the calls that the Python loop makes, in the same order: at every communication point the controller,
 * whose output answers its inputs, is evaluated with what the plant shows there. loop_lean leaves out what this wiring
 * does not need: the controller's inputs are set once a point, its output is read once. Both give the same numbers: time
 * is counted, `rate` steps a second. loop_slopes is the exchange with slopes: the plant's input follows its slope from
 * the communication point, the controller's inputs a cubic through values and slopes at both ends. */
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
    int (*set_slopes)(void *, const unsigned *, size_t, const int *, const double *);
    int (*get_slopes)(void *, const unsigned *, size_t, const int *, double *);
    unsigned in[2], out[2];
} Fmu;

typedef struct {
    Fmu plant, pd;
    double y[2], u, dy[2], du; /* outputs and their slopes at the communication point */
    double next[2];
} Pair;

static int step_same(Pair *pairs, int n, long k, double rate)
{
    const double t = (double)k / rate, h = (double)(k + 1) / rate - t;
    double u_next;
    int i;
    for (i = 0; i < n; i++) {
        Pair *p = &pairs[i];
        if (p->plant.set(p->plant.instance, p->plant.in, 1, &p->u) > 1) return 1;
        if (p->plant.step(p->plant.instance, t, h, 1) > 1) return 1;
        if (p->plant.get(p->plant.instance, p->plant.out, 2, p->next) > 1) return 1;
        if (p->pd.set(p->pd.instance, p->pd.in, 2, p->y) > 1) return 1;
        if (p->pd.step(p->pd.instance, t, h, 1) > 1) return 1;
        if (p->pd.get(p->pd.instance, p->pd.out, 1, &u_next) > 1) return 1;
    }
    for (i = 0; i < n; i++) {
        Pair *p = &pairs[i];
        p->y[0] = p->next[0], p->y[1] = p->next[1];
        if (p->pd.set(p->pd.instance, p->pd.in, 2, p->y) > 1) return 1;
        if (p->pd.get(p->pd.instance, p->pd.out, 1, &p->u) > 1) return 1;
    }
    return 0;
}

EXPORT int loop_same(Pair *pairs, int n, long steps, double rate)
{
    long k;
    for (k = 0; k < steps; k++)
        if (step_same(pairs, n, k, rate)) return 1;
    return 0;
}

EXPORT int loop_lean(Pair *pairs, int n, long steps, double rate)
{
    long k;
    int i;
    for (k = 0; k < steps; k++) {
        double t = (double)k / rate, h = (double)(k + 1) / rate - t;
        for (i = 0; i < n; i++) {
            Pair *p = &pairs[i];
            if (p->plant.set(p->plant.instance, p->plant.in, 1, &p->u) > 1) return 1;
            if (p->plant.step(p->plant.instance, t, h, 1) > 1) return 1;
            if (p->plant.get(p->plant.instance, p->plant.out, 2, p->y) > 1) return 1;
            if (p->pd.step(p->pd.instance, t, h, 1) > 1) return 1;
            if (p->pd.set(p->pd.instance, p->pd.in, 2, p->y) > 1) return 1;
            if (p->pd.get(p->pd.instance, p->pd.out, 1, &p->u) > 1) return 1;
        }
    }
    return 0;
}

/* The first three derivatives at s = 0 of the cubic from a to b over h. */
static void cubic(double a, double b, double da, double db, double h, double *d)
{
    d[0] = da;
    d[1] = (6 * (b - a) / h - 4 * da - 2 * db) / h;
    d[2] = (12 * (a - b) / h + 6 * (da + db)) / (h * h);
}

EXPORT int loop_slopes(Pair *pairs, int n, long steps, double rate)
{
    static const int first[] = {1, 1}, three[] = {1, 2, 3, 1, 2, 3};
    long k;
    int i, j;
    for (k = 0; k < steps; k++) {
        double t = (double)k / rate, h = (double)(k + 1) / rate - t, slopes[2], moves[6];
        for (i = 0; i < n; i++) {
            Pair *p = &pairs[i];
            const Fmu *a = &p->plant, *b = &p->pd;
            const unsigned moving[] = {b->in[0], b->in[0], b->in[0], b->in[1], b->in[1], b->in[1]};
            if (a->set(a->instance, a->in, 1, &p->u) > 1) return 1;
            if (a->set_slopes(a->instance, a->in, 1, first, &p->du) > 1) return 1;
            if (a->step(a->instance, t, h, 1) > 1) return 1;
            if (a->get(a->instance, a->out, 2, p->next) > 1) return 1;
            if (a->get_slopes(a->instance, a->out, 2, first, slopes) > 1) return 1;
            for (j = 0; j < 2; j++) cubic(p->y[j], p->next[j], p->dy[j], slopes[j], h, moves + 3 * j);
            if (b->set(b->instance, b->in, 2, p->y) > 1) return 1;
            if (b->set_slopes(b->instance, moving, 6, three, moves) > 1) return 1;
            if (b->step(b->instance, t, h, 1) > 1) return 1;
            if (b->get(b->instance, b->out, 1, &p->u) > 1) return 1;
            if (b->get_slopes(b->instance, b->out, 1, first, &p->du) > 1) return 1;
            for (j = 0; j < 2; j++) p->y[j] = p->next[j], p->dy[j] = slopes[j];
        }
    }
    return 0;
}

/* loop_same of one pair that keeps time, the inputs and outputs of both of every communication point in `rows`. */
EXPORT int loop_rows(Pair *p, long steps, double rate, double *rows)
{
    long k;
    for (k = 0; k < steps; k++, rows += 7) {
        if (step_same(p, 1, k, rate)) return 1;
        rows[0] = (double)(k + 1) / rate;
        rows[1] = p->u, rows[2] = p->y[0], rows[3] = p->y[1];
        rows[4] = p->y[0], rows[5] = p->y[1], rows[6] = p->u;
    }
    return 0;
}
