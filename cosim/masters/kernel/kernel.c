/* The explicit loop over the FMUs' own functions: cosim/masters/loop.py in C, with the same arithmetic in the same order.
 *
 * All data is allocated by the caller (cosim/kernel/kernel.py, whose ctypes structures mirror the ones here); the kernel
 * allocates nothing, keeps nothing, and returns after a number of steps, when the block of rows is full, or at the first
 * call that does not succeed. Build with -ffp-contract=off. */
#include <math.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef long long integer;
typedef int (*SetReal)(void *, const unsigned *, size_t, const double *);
typedef int (*GetReal)(void *, const unsigned *, size_t, double *);
typedef int (*SetDerivatives)(void *, const unsigned *, size_t, const int *, const double *);
typedef int (*GetDerivatives)(void *, const unsigned *, size_t, const int *, double *);
typedef int (*DoStep)(void *, double, double, int);

enum { AT_POINT, AFTER_STEP, MIDPOINT, RAMP, STEP_MEAN, CENTRED };
static const double FLAG = 0.5; /* plan.FLAG */
enum { WARNING = 1 }; /* the highest FMI status that is a success */
enum { CALL_NONE, CALL_SET, CALL_SET_DERIVATIVES, CALL_STEP, CALL_GET, CALL_GET_DERIVATIVES, CALL_NOT_FINITE };

typedef struct {
    void *instance;
    SetReal set_real;
    GetReal get_real;
    SetDerivatives set_derivatives;
    GetDerivatives get_derivatives;
    DoStep do_step;
    integer period, at_end;
    /* inputs: input = factor * value + addend, see plan.Inputs */
    integer inputs;
    const unsigned *input_references;
    const integer *source, *timing, *ahead, *source_component;
    const double *factor, *addend;
    double *begin_values, *value; /* work: the sources' values at the start of the period; what is set */
    /* centred inputs: set to b between the step and the reading of the outputs */
    integer centred;
    const unsigned *centred_references;
    const integer *centred_position;
    double *centred_value; /* work */
    /* input derivatives, see plan.InputDerivatives */
    integer input_derivatives;
    const unsigned *derivative_references;
    const int *derivative_orders;
    const integer *position, *slot;
    double *slope; /* work */
    /* outputs: `outputs` slots from `offset` on, then `output_derivatives` slots */
    integer outputs, offset, output_derivatives;
    const unsigned *output_references, *output_derivative_references;
    const int *output_derivative_orders;
} Component;

typedef struct {
    integer component, count;
    const unsigned *references;
    const integer *slots;
    double *value; /* work */
} Reading;

typedef struct {
    integer start, stop, step, every, steps; /* ns, ns, ns, rows, communication steps */
    integer components;
    Component *component;
    integer refreshes;
    const Reading *refresh;
    integer size;
    double *point, *newest, *next; /* slots: as seen at the communication point; as read last; work */
    integer columns;
    const integer *column_source;
    const double *column_factor, *column_addend;
    integer stop_slot; /* the flag that ends the run where it is above FLAG, -1: none */
    /* where the run stands */
    integer done, last_row;
    /* what ended it, if anything did */
    integer failed_call, failed_component, failed_status, failed_slot;
} Run;

static integer point_ns(const Run *r, integer k)
{
    integer at = r->start + k * r->step;
    return at < r->stop ? at : r->stop;
}

static integer period_start(const Component *c, integer k) { return k - k % c->period; }

static integer period_end(const Run *r, const Component *c, integer k)
{
    integer end = period_start(c, k) + c->period;
    return end < r->steps ? end : r->steps;
}

static int is_due(const Run *r, const Component *c, integer k)
{
    return c->at_end ? k + 1 == period_end(r, c, k) : k == period_start(c, k);
}

static int failed(Run *r, integer component, int call, int status, integer slot)
{
    r->failed_component = component;
    r->failed_call = call;
    r->failed_status = status;
    r->failed_slot = slot;
    return 1;
}

/* A slow source's value at communication point `at`, on the line over its own step. */
static double between(const Run *r, integer slot, integer place, integer k, integer at)
{
    const Component *s = &r->component[place];
    integer begin = point_ns(r, period_start(s, k)), end = point_ns(r, period_end(r, s, k));
    double fraction = (double)(point_ns(r, at) - begin) / (double)(end - begin);
    return r->point[slot] + (r->newest[slot] - r->point[slot]) * fraction;
}

/* a: source i's value where the target's period begins. */
static double source_at_start(const Run *r, const Component *c, integer i, integer k)
{
    if (c->ahead[i] && (c->timing[i] == MIDPOINT || c->timing[i] == RAMP))
        return between(r, c->source[i], c->source_component[i], k, period_start(c, k));
    return r->point[c->source[i]];
}

/* b: source i's value where the target's period ends. */
static double source_at_end(const Run *r, const Component *c, integer i, integer k)
{
    if (c->ahead[i] && c->timing[i] != STEP_MEAN) {
        const Component *s = &r->component[c->source_component[i]];
        integer end = period_end(r, c, k);
        if (period_end(r, s, k) > end) {
            if (c->timing[i] == AT_POINT || c->timing[i] == AFTER_STEP || c->timing[i] == CENTRED)
                return r->point[c->source[i]];
            return between(r, c->source[i], c->source_component[i], k, end);
        }
    }
    return r->newest[c->source[i]];
}

static int set_inputs(Run *r, integer place, integer k, double h)
{
    Component *c = &r->component[place];
    integer i;
    int status;
    if (!c->inputs) return 0;
    if (!c->at_end)
        for (i = 0; i < c->inputs; i++) c->begin_values[i] = source_at_start(r, c, i, k);
    for (i = 0; i < c->inputs; i++) {
        double value = c->begin_values[i];
        if (c->timing[i] == AFTER_STEP || c->timing[i] == STEP_MEAN) value = source_at_end(r, c, i, k);
        if (c->timing[i] == MIDPOINT || c->timing[i] == CENTRED) value = 0.5 * (value + source_at_end(r, c, i, k));
        c->value[i] = c->factor[i] * value + c->addend[i];
    }
    status = c->set_real(c->instance, c->input_references, (size_t)c->inputs, c->value);
    if (status > WARNING) return failed(r, place, CALL_SET, status, 0);
    if (!c->input_derivatives) return 0;
    for (i = 0; i < c->input_derivatives; i++) {
        integer at = c->position[i];
        double slope = c->slot[i] < 0 ? (source_at_end(r, c, at, k) - c->begin_values[at]) / h : r->point[c->slot[i]];
        c->slope[i] = c->factor[at] * slope;
    }
    status = c->set_derivatives(c->instance, c->derivative_references, (size_t)c->input_derivatives,
                                c->derivative_orders, c->slope);
    return status > WARNING ? failed(r, place, CALL_SET_DERIVATIVES, status, 0) : 0;
}

static int set_centred(Run *r, integer place, integer k)
{
    Component *c = &r->component[place];
    integer i;
    int status;
    for (i = 0; i < c->centred; i++) {
        integer at = c->centred_position[i];
        c->centred_value[i] = c->factor[at] * source_at_end(r, c, at, k) + c->addend[at];
    }
    if (!c->centred) return 0;
    status = c->set_real(c->instance, c->centred_references, (size_t)c->centred, c->centred_value);
    return status > WARNING ? failed(r, place, CALL_SET, status, 0) : 0;
}

static int advance(Run *r, integer place, integer k)
{
    Component *c = &r->component[place];
    integer begin = point_ns(r, period_start(c, k)), end = point_ns(r, period_end(r, c, k)), i;
    double t = (double)begin / 1e9, h = (double)(end - begin) / 1e9, *out = r->newest + c->offset;
    int status;
    if (set_inputs(r, place, k, h)) return 1;
    status = c->do_step(c->instance, t, h, 1);
    if (status > WARNING) return failed(r, place, CALL_STEP, status, 0);
    if (set_centred(r, place, k)) return 1;
    status = c->get_real(c->instance, c->output_references, (size_t)c->outputs, out);
    if (status > WARNING) return failed(r, place, CALL_GET, status, 0);
    if (c->output_derivatives) {
        status = c->get_derivatives(c->instance, c->output_derivative_references, (size_t)c->output_derivatives,
                                    c->output_derivative_orders, out + c->outputs);
        if (status > WARNING) return failed(r, place, CALL_GET_DERIVATIVES, status, 0);
    }
    for (i = 0; i < c->outputs; i++)
        if (!isfinite(out[i])) return failed(r, place, CALL_NOT_FINITE, 0, c->offset + i);
    return 0;
}

static int refresh(Run *r, const Reading *reading)
{
    Component *c = &r->component[reading->component];
    integer i;
    int status;
    for (i = 0; i < c->inputs; i++) {
        double value = (c->timing[i] == STEP_MEAN ? r->newest : r->next)[c->source[i]];
        c->value[i] = c->factor[i] * value + c->addend[i];
    }
    status = c->set_real(c->instance, c->input_references, (size_t)c->inputs, c->value);
    if (status > WARNING) return failed(r, reading->component, CALL_SET, status, 0);
    status = c->get_real(c->instance, reading->references, (size_t)reading->count, reading->value);
    if (status > WARNING) return failed(r, reading->component, CALL_GET, status, 0);
    for (i = 0; i < reading->count; i++) {
        if (!isfinite(reading->value[i])) {
            r->newest[reading->slots[i]] = reading->value[i];
            return failed(r, reading->component, CALL_NOT_FINITE, 0, reading->slots[i]);
        }
    }
    for (i = 0; i < reading->count; i++) r->newest[reading->slots[i]] = r->next[reading->slots[i]] = reading->value[i];
    return 0;
}

/* Communication step k, from point k to point k + 1. `point` is replaced only when all has succeeded. */
static int step(Run *r, integer k)
{
    integer i, j;
    double *swap;
    for (i = 0; i < r->components; i++) {
        Component *c = &r->component[i];
        if (c->at_end && k == period_start(c, k))
            for (j = 0; j < c->inputs; j++) c->begin_values[j] = source_at_start(r, c, j, k);
    }
    for (i = 0; i < r->components; i++)
        if (is_due(r, &r->component[i], k) && advance(r, i, k)) return 1;
    memcpy(r->next, r->point, (size_t)r->size * sizeof(double));
    for (i = 0; i < r->components; i++) {
        const Component *c = &r->component[i];
        if (period_end(r, c, k) == k + 1)
            memcpy(r->next + c->offset, r->newest + c->offset,
                   (size_t)(c->outputs + c->output_derivatives) * sizeof(double));
    }
    for (i = 0; i < r->refreshes; i++)
        if (period_end(r, &r->component[r->refresh[i].component], k) == k + 1 && refresh(r, &r->refresh[i])) return 1;
    swap = r->point;
    r->point = r->next;
    r->next = swap;
    return 0;
}

static void write_row(const Run *r, integer k, double *row)
{
    integer i;
    row[0] = (double)point_ns(r, k) / 1e9;
    for (i = 0; i < r->columns; i++)
        row[1 + i] = r->column_factor[i] * r->point[r->column_source[i]] + r->column_addend[i];
}

/* Take up to `most` steps; rows go to `rows` (`capacity` rows of 1 + columns) from row `count` on. Returns the new count;
 * r->done and r->failed_call say how it went. */
EXPORT integer kernel_run(Run *r, integer most, double *rows, integer capacity, integer count)
{
    integer until = r->done + most;
    if (until > r->steps) until = r->steps;
    while (r->done < until && count < capacity) {
        if (r->stop_slot >= 0 && r->point[r->stop_slot] > FLAG) break;
        if (step(r, r->done)) break;
        r->done++;
        if (r->done % r->every == 0 || r->done == r->steps) {
            write_row(r, r->done, rows + count * (1 + r->columns));
            r->last_row = r->done;
            count++;
        }
    }
    return count;
}
