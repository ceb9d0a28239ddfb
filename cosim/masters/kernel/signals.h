/* Signals as an instance: cosim/slaves/tabulated.py in C, operation by operation, behind the functions of FMI 2.0. */
#include <stdlib.h>

enum { CHANNEL_SLOTS = 5 }; /* feeds.SLOTS */

/* The piece in which a time lies, the last or the first beyond the ends. */
static integer signal_find(Channel *c, double t)
{
    integer i = c->piece;
    while (i > 0 && t < c->knots[i]) i--;
    while (i < c->pieces - 1 && t >= c->knots[i + 1]) i++;
    return c->piece = i;
}

/* u, u', u'', u''' of piece i at t. */
static void signal_at(const Channel *c, integer i, double t, double *d)
{
    const double *p = c->coefficients + 4 * i, s = t - c->knots[i];
    d[0] = p[0] + s * (p[1] + s * (p[2] + s * p[3]));
    d[1] = p[1] + s * (2 * p[2] + s * (3 * p[3]));
    d[2] = 2 * p[2] + s * (6 * p[3]);
    d[3] = 6 * p[3];
}

static int signal_fits(const Channel *c, integer i)
{
    const double *p = c->coefficients + 4 * i;
    return c->degree == 3 || (p[2] == 0 && p[3] == 0 && (c->degree == 1 || p[1] == 0));
}

/* feeds.py (1) */
static void signal_moments(const Channel *c, integer i, double t, double end, double *first, double *second)
{
    double begin = t;
    *first = *second = 0;
    for (;;) {
        const int inner = i < c->pieces - 1 && c->knots[i + 1] < end;
        const double to = inner ? c->knots[i + 1] : end, w = to - begin;
        double d[4], part, own;
        signal_at(c, i, begin, d);
        part = w * (d[0] + w * (d[1] / 2 + w * (d[2] / 6 + w * (d[3] / 24))));
        own = w * w * (d[0] / 2 + w * (d[1] / 3 + w * (d[2] / 8 + w * (d[3] / 30))));
        *first = *first + part;
        *second = *second + ((begin - t) * part + own);
        if (!inner) return;
        begin = to;
        i++;
    }
}

static void signal_step(Channel *c, double t, double h)
{
    const double end = t + h;
    const integer i = signal_find(c, t);
    const int whole = i == c->pieces - 1 || end <= c->knots[i + 1];
    double start[4], last[4], first, second, mean;
    signal_at(c, i, t, start);
    signal_at(c, signal_find(c, end), end, last);
    c->value = last[0];
    c->slope = last[1];
    if (whole && signal_fits(c, i)) {
        c->v0 = start[0], c->v1 = start[1], c->v2 = start[2], c->v3 = start[3];
        return;
    }
    signal_moments(c, i, t, end, &first, &second);
    mean = first / h;
    c->v0 = mean, c->v1 = c->v2 = c->v3 = 0;
    if (c->degree == 1) {
        c->v1 = 12 * (second - 0.5 * h * first) / (h * h * h);
        c->v0 = mean - 0.5 * h * c->v1;
    } else if (c->degree == 3) {
        const double a = start[0], b = c->value, e = 6 * (mean - 0.5 * (a + b));
        const double d = 30 * ((2 * (second / h) - first) / h) - 5 * (b - a);
        c->v0 = a;
        c->v1 = (b - a + e - d) / h;
        c->v2 = 2 * (3 * d - e) / (h * h);
        c->v3 = -12 * d / (h * h * h);
    }
}

EXPORT int signal_do_step(void *instance, double t, double h, int unused)
{
    const Feed *feed = instance;
    integer i;
    (void)unused;
    for (i = 0; i < feed->channels; i++) signal_step(&feed->channel[i], t, h);
    return OK;
}

EXPORT int signal_get_real(void *instance, const unsigned *references, size_t n, double *values)
{
    const Feed *feed = instance;
    size_t i;
    for (i = 0; i < n; i++) {
        const Channel *c = &feed->channel[references[i] / CHANNEL_SLOTS];
        switch (references[i] % CHANNEL_SLOTS) {
        case 0: values[i] = c->value; break;
        case 1: values[i] = c->v0; break;
        case 2: values[i] = c->v1; break;
        case 3: values[i] = c->v2; break;
        default: values[i] = c->v3; break;
        }
    }
    return OK;
}

EXPORT int signal_get_derivatives(void *instance, const unsigned *references, size_t n, const int *orders, double *values)
{
    const Feed *feed = instance;
    size_t i;
    (void)orders;
    for (i = 0; i < n; i++) values[i] = feed->channel[references[i] / CHANNEL_SLOTS].slope;
    return OK;
}

EXPORT int signal_get_state(void *instance, void **state)
{
    const Feed *feed = instance;
    const size_t size = (size_t)feed->channels * sizeof(Channel);
    if (!*state) *state = malloc(size);
    if (!*state) return FATAL;
    memcpy(*state, feed->channel, size);
    return OK;
}

EXPORT int signal_set_state(void *instance, void *state)
{
    const Feed *feed = instance;
    memcpy(feed->channel, state, (size_t)feed->channels * sizeof(Channel));
    return OK;
}

EXPORT int signal_free_state(void *instance, void **state)
{
    (void)instance;
    free(*state);
    *state = NULL;
    return OK;
}
