/* The explicit loop over the FMUs' own functions: cosim/masters/stepping.py in C, with the same arithmetic in the same
 * order, for many steps between two events.
 *
 * The data is the caller's (structures.py, whose ctypes structures are compared with the ones here when the kernel is
 * loaded); the kernel allocates nothing but the texts of Strings, and returns at the step that it was asked for, when
 * the block of rows is full, when time is up, when it is told to stop, where the flag is up, or at the first call that
 * does not succeed. Build with -ffp-contract=off. */
#if !defined(_WIN32)
#define _XOPEN_SOURCE 700 /* clock_gettime, sigaltstack */
#endif
#include <math.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#include "structures.h"
#include "texts.h"
#include "points.h"
#include "curves.h"
#include "ends.h"

EXPORT int fmi3_do_step(void *instance, double t, double h, int no_return);

#include "crash.h"

static const double FLAG = 0.5;   /* columns.FLAG */
static const double QUICK = 1e-4; /* s: of steps that take less the clock is read after twice as many, ... */
enum { BETWEEN_LOOKS = 16 };      /* ... up to so many */

/* ---- calls ------------------------------------------------------------------------------------------------------ */

static int failed(Run *r, integer component, int call, int status, integer slot, integer kind)
{
    r->failed_component = component;
    r->failed_call = call;
    r->failed_status = status;
    r->failed_slot = slot;
    r->failed_kind = kind;
    return 1;
}

/* Note the call that is made next, for whoever looks after a crash in it. */
static void calling(Run *r, integer component, integer call, integer kind)
{
    r->calling = CALLING(component, call, kind);
}

static int returned_not_ok(Run *r, int status)
{
    const Component *c = &r->component[CALLING_COMPONENT(r->calling)];
    const integer call = CALLING_CALL(r->calling), kind = CALLING_KIND(r->calling);
    Warned *warned = &c->warned[call * KINDS + kind];
    if (status != WARNING) return failed(r, CALLING_COMPONENT(r->calling), (int)call, status, 0, kind);
    if (!warned->count++) warned->first = r->done;
    return 0;
}

/* Whether the call that was made ends the run. */
static int returned(Run *r, int status) { return status == OK ? 0 : returned_not_ok(r, status); }

#include "pending.h"

/* Set the inputs of a component to c->value, at the start of its step or `at_end`. */
static int set_values(Run *r, integer place, int at_end)
{
    const Component *c = &r->component[place];
    const double *value = c->value;
    integer g, i;
    if (c->only_real) {
        calling(r, place, CALL_SET, REAL);
        return returned(r, c->set_real(c->instance, c->input_group->references, (size_t)c->inputs, value));
    }
    for (i = 0; i < c->restricted; i++) {
        const Allowed *a = &c->allowed[i];
        integer j = 0;
        while (j < a->count && (double)a->values[j] != c->value[a->position]) j++;
        if (j == a->count) return failed(r, place, CALL_REFUSED, OK, a->position, at_end);
    }
    for (g = 0; g < c->input_groups; g++) {
        const Group *group = &c->input_group[g];
        const unsigned *references = group->references;
        const size_t n = (size_t)group->count;
        int status;
        calling(r, place, CALL_SET, group->kind);
        if (group->kind == REAL) {
            status = c->set_real(c->instance, references, n, value);
        } else if (group->kind == STRING) {
            for (i = 0; i < group->count; i++) group->text[i] = r->texts->text[(integer)value[i]];
            status = c->set_string(c->instance, references, n, group->text);
        } else {
            for (i = 0; i < group->count; i++) group->number[i] = (int)value[i];
            status = (group->kind == INTEGER ? c->set_integer : c->set_boolean)(c->instance, references, n, group->number);
        }
        if (returned(r, status)) return 1;
        value += n;
    }
    return 0;
}

/* Read a group of outputs into its slots of r->newest. */
static int get_values(Run *r, integer place, const Group *group)
{
    const Component *c = &r->component[place];
    const size_t n = (size_t)group->count;
    double *value = group->first >= 0 ? r->newest + group->first : group->value;
    integer i;
    calling(r, place, CALL_GET, group->kind);
    if (group->kind == REAL) {
        if (returned(r, c->get_real(c->instance, group->references, n, value))) return 1;
    } else if (group->kind == STRING) {
        if (returned(r, c->get_string(c->instance, group->references, n, group->text))) return 1;
        for (i = 0; i < group->count; i++) {
            const integer number = kernel_text_number(r->texts, group->text[i]);
            if (number < 0) return failed(r, place, CALL_MEMORY, OK, 0, STRING);
            value[i] = (double)number;
        }
    } else {
        const GetInteger get = group->kind == INTEGER ? c->get_integer : c->get_boolean;
        if (returned(r, get(c->instance, group->references, n, group->number))) return 1;
        for (i = 0; i < group->count; i++)
            value[i] = group->kind == INTEGER ? (double)group->number[i] : (double)(group->number[i] != 0);
    }
    if (group->first < 0)
        for (i = 0; i < group->count; i++) r->newest[group->slots[i]] = value[i];
    return 0;
}

static int refuse_not_finite(Run *r, integer place, const Group *group)
{
    const integer n = group->finite, *slots = group->finite_slot;
    const double *newest = r->newest;
    integer i;
    for (i = 0; i < n; i++)
        if (!isfinite(newest[slots[i]])) return failed(r, place, CALL_NOT_FINITE, OK, slots[i], REAL);
    return 0;
}

/* ---- inputs ----------------------------------------------------------------------------------------------------- */

static int set_inputs(Run *r, integer place, integer k, double h)
{
    const Component *c = &r->component[place];
    Ends e = {0, 0, 0, 0};
    integer i;
    if (!c->inputs) return 0;
    for (i = 0; i < c->inputs && c->plain; i++) {
        const double a = r->point[c->source[i]], b = r->newest[c->source[i]];
        const integer timing = c->timing[i];
        double value = a;
        if (timing == AFTER_STEP || timing == STEP_MEAN) value = b;
        else if (timing == MIDPOINT) value = 0.5 * (a + b);
        c->value[i] = c->factor[i] * value + c->addend[i];
    }
    for (i = 0; i < c->inputs && !c->plain; i++) {
        double value;
        e = ends_of(r, c, i, k, h);
        value = e.a;
        switch (c->timing[i]) {
        case AFTER_STEP:
        case STEP_MEAN: value = e.b; break;
        case MIDPOINT: value = 0.5 * (e.a + e.b); break;
        case MEAN: value = curve_mean(e, h); break;
        case SIGNAL:
        case SIGNAL_MEAN: value = r->newest[c->signal_slot[i]]; break;
        case EXTRAPOLATED_MEAN: value += 0.5 * h * slope_or_none(r->point[c->slope_slot[i]]); break;
        default: break;
        }
        c->value[i] = c->factor[i] * value + c->addend[i];
    }
    if (set_values(r, place, 0)) return 1;
    if (!c->input_derivatives) return 0;
    for (i = 0; i < c->input_derivatives; i++) {
        const integer at = c->position[i];
        double slope;
        if (c->form[i] == SLOT) {
            slope = slope_or_none(r->point[c->slot[i]]);
        } else if (c->form[i] == SIGNAL_SLOT) {
            slope = r->newest[c->slot[i]];
        } else {
            if (!i || c->position[i - 1] != at) e = ends_of(r, c, at, k, h); /* the orders of an input are neighbours */
            if (c->form[i] == LINE) slope = (e.b - e.a) / h;
            else if (c->derivative_orders[i] == 1) slope = e.da;
            else slope = c->derivative_orders[i] == 2 ? curve_second(e, h) : curve_third(e, h);
        }
        c->slope[i] = c->factor[at] * slope;
    }
    calling(r, place, CALL_SET_DERIVATIVES, REAL);
    return returned(r, c->set_derivatives(c->instance, c->derivative_references, (size_t)c->input_derivatives,
                                          c->derivative_orders, c->slope));
}

/* Set the inputs to their sources' values at the end of the step. */
static int set_ends(Run *r, integer place, integer k, double h)
{
    const Component *c = &r->component[place];
    integer i;
    for (i = 0; i < c->inputs; i++) c->value[i] = c->factor[i] * ends_of(r, c, i, k, h).b + c->addend[i];
    return set_values(r, place, 1);
}

/* Set the slopes that moving inputs have at the communication point: the sources', or those of the lines to it. */
static int set_slopes_now(Run *r, integer place, double h)
{
    const Component *c = &r->component[place];
    integer i;
    if (!c->moving) return 0;
    for (i = 0; i < c->moving; i++) {
        const integer at = c->moving_position[i], source = c->source[at];
        const double slope = c->timing[at] == RAMP ? (r->next[source] - r->point[source]) / h
                                                   : slope_or_none(r->next[c->slope_slot[at]]);
        c->moving_slope[i] = c->factor[at] * slope;
    }
    calling(r, place, CALL_SET_DERIVATIVES, REAL);
    return returned(r, c->set_derivatives(c->instance, c->moving_references, (size_t)c->moving, c->moving_orders,
                                          c->moving_slope));
}

/* Read the output derivatives of a component into their slots of r->newest. */
static int get_slopes(Run *r, integer place)
{
    const Component *c = &r->component[place];
    double *slope = r->newest + c->offset + c->outputs;
    if (!c->output_derivatives) return 0;
    calling(r, place, CALL_GET_DERIVATIVES, REAL);
    return returned(r, c->get_derivatives(c->instance, c->output_derivative_references, (size_t)c->output_derivatives,
                                          c->output_derivative_orders, slope));
}

/* ---- a step ----------------------------------------------------------------------------------------------------- */

/* A component's step: its period, which is from t to t + h for one that steps in every communication step. */
static int take_turn(Run *r, integer place, integer k, double t, double h)
{
    Component *c = &r->component[place];
    integer g;
    int status;
    if (c->period != 1) {
        t = point_time(r, period_start(c, k));
        h = point_time(r, period_end(r, c, k)) - t;
    }
    if (set_inputs(r, place, k, h)) return 1;
    calling(r, place, CALL_STEP, REAL);
    status = c->do_step(c->instance, t, h, !r->stages);
    if (status && not_ok(r, place, status, t, h)) return 1;
    if (r->stages && c->halfway && set_ends(r, place, k, h)) return 1;
    for (g = 0; g < c->output_groups; g++)
        if (get_values(r, place, &c->output_group[g])) return 1;
    if (c->output_derivatives && get_slopes(r, place)) return 1;
    for (g = 0; g < c->output_groups; g++)
        if (refuse_not_finite(r, place, &c->output_group[g])) return 1;
    if (c->differences) take_differences(r, c, h);
    return 0;
}

/* Read outputs again with the inputs of communication point k + 1, h after the one before. */
static int refresh(Run *r, const Reading *reading, integer k, double h)
{
    Component *c = &r->component[reading->component];
    integer g, i;
    if (c->period != 1) h = point_time(r, k + 1) - point_time(r, period_start(c, k));
    for (i = 0; i < c->inputs; i++) {
        double value = (c->timing[i] == STEP_MEAN ? r->newest : r->next)[c->source[i]];
        c->value[i] = c->factor[i] * value + c->addend[i];
    }
    if (set_values(r, reading->component, 1)) return 1;
    if (reading->slopes && set_slopes_now(r, reading->component, h)) return 1;
    for (g = 0; g < reading->groups; g++)
        if (get_values(r, reading->component, &reading->group[g])) return 1;
    if (reading->slopes) {
        const integer first = c->offset + c->outputs;
        if (get_slopes(r, reading->component)) return 1;
        memcpy(r->next + first, r->newest + first, (size_t)c->output_derivatives * sizeof(double));
    }
    for (g = 0; g < reading->groups; g++)
        if (refuse_not_finite(r, reading->component, &reading->group[g])) return 1;
    for (g = 0; g < reading->groups; g++)
        for (i = 0; i < reading->group[g].count; i++)
            r->next[reading->group[g].slots[i]] = r->newest[reading->group[g].slots[i]];
    take_differences(r, c, h);
    for (i = 0; i < c->differences; i++) r->next[c->difference_slope[i]] = r->newest[c->difference_slope[i]];
    return 0;
}

/* Communication step k, from point k at t to point k + 1 at t + h. `point` is replaced only when all has succeeded. */
static int step(Run *r, integer k, double t, double h)
{
    integer i, j;
    double *swap;
    for (i = 0; i < r->components && !r->all_step; i++) {
        const Component *c = &r->component[i];
        if (c->at_end && k == period_start(c, k))
            for (j = 0; j < c->inputs; j++) c->begun[j] = source_at_start(r, c, j, k, &c->begun_slope[j]);
    }
    for (i = 0; i < r->components; i++)
        if (is_due(r, &r->component[i], k) && take_turn(r, i, k, t, h)) return 1;
    memcpy(r->next, r->all_step ? r->newest : r->point, (size_t)r->size * sizeof(double));
    for (i = 0; i < r->components && !r->all_step; i++) {
        const Component *c = &r->component[i];
        if (period_end(r, c, k) == k + 1)
            memcpy(r->next + c->offset, r->newest + c->offset, (size_t)c->owned * sizeof(double));
    }
    for (i = 0; i < r->refreshes; i++) {
        const Component *c = &r->component[r->refresh[i].component];
        if ((r->all_step || period_end(r, c, k) == k + 1) && refresh(r, &r->refresh[i], k, h)) return 1;
    }
    swap = r->point;
    r->point = r->next;
    r->next = swap;
    return 0;
}

#include "iterated.h"
#include "signals.h"
#include "fmi3.h"

/* Put into the own slot of every connected input what its source gives it at the communication point. */
static void show_inputs(Run *r)
{
    integer i;
    for (i = 0; i < r->inputs; i++)
        r->point[r->input_slot[i]] = r->input_factor[i] * r->point[r->input_source[i]] + r->input_addend[i];
}

static void write_row(Run *r, integer k, double *row)
{
    integer i;
    show_inputs(r);
    row[0] = point_time(r, k);
    for (i = 0; i < r->columns; i++) row[1 + i] = r->point[r->column_slot[i]];
}

/* Take steps to communication point `until`, for about `seconds`. Rows go to `rows` (`capacity` rows of 1 + columns)
 * from row `*count` on, which counts complete rows at any time. Returns 0, or -1 for a run that cannot be; r->done and
 * r->failed_call say how it went. */
EXPORT int kernel_run(Run *r, integer until, double seconds, double *rows, integer capacity, volatile integer *count)
{
    const double begun = now();
    double last = begun;
    double t = point_time(r, r->done), next;
    integer i, look = 1, next_look = r->done + 1, next_row;
    if (r->every < 1 || r->denominator < 1 || r->step < 1 || until > r->steps) return -1;
    for (i = 0; i < r->components; i++)
        if (r->component[i].period < 1) return -1;
    next_row = next_recorded(r, r->done);
    while (r->done < until && *count < capacity && !*r->stop_asked) {
        if (r->stop_slot >= 0 && r->point[r->stop_slot] > FLAG) break;
        if (has_ended(r)) break;
        next = point_time(r, r->done + 1);
        if (r->stages ? iterated_step(r, r->done, t, next - t) : step(r, r->done, t, next - t)) break;
        r->done++;
        t = next;
        if (r->done == next_row) {
            next_row = next_recorded(r, r->done);
            write_row(r, r->done, rows + *count * (1 + r->columns));
            r->last_row = r->done;
            ++*count;
        }
        if (r->done >= next_look) {
            const double clock = now();
            if (clock - begun > seconds) break;
            if (clock - last > QUICK) look = 1;
            else if (look < BETWEEN_LOOKS) look *= 2;
            last = clock;
            next_look = r->done + look;
        }
    }
    if (r->stages) free_states(r);
    r->calling = 0;
    show_inputs(r);
    return 0;
}
