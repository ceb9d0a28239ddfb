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

#include "structures.h"
#include "texts.h"
#include "points.h"
#include "curves.h"
#include "faults.h"
#include "ends.h"

EXPORT int fmi3_do_step(void *instance, double t, double h, int no_return);

#include "crash.h"
#include "calls.h"
#include "inputs.h"

static const double FLAG = 0.5;   /* columns.FLAG */
static const double QUICK = 1e-4; /* s: of steps that take less the clock is read after twice as many, ... */
enum { BETWEEN_LOOKS = 64 };      /* ... up to so many */

#include "values.h"
#include "pass.h"

/* ---- a step ----------------------------------------------------------------------------------------------------- */

/* A component's step: its period, which is from t to t + h for one that steps in every communication step. */
static inline int take_turn(Run *r, integer place, integer k, double t, double h)
{
    Component *c = &r->component[place];
    double end;
    integer g;
    int status;
    if (c->period != 1) {
        t = point_time(r, period_start(c, k));
        h = point_time(r, period_end(r, c, k)) - t;
    }
    end = t + h;
    if (is_frozen(r, c)) return stay_frozen(r, c, end);
    if (set_inputs(r, place, k, h)) return 1;
    calling(r, place, CALL_STEP, REAL);
    t -= lag(r, c);
    status = c->do_step(c->instance, t, h, !r->stages);
    if (status && not_ok(r, place, status, t, h)) return 1;
    if (r->stages && c->halfway && set_ends(r, place, k, h)) return 1;
    for (g = 0; g < c->output_groups; g++)
        if (get_values(r, place, &c->output_group[g])) return 1;
    if (c->output_derivatives && get_slopes(r, place)) return 1;
    for (g = 0; g < c->output_groups; g++)
        if (refuse_not_finite(r, place, &c->output_group[g])) return 1;
    if (c->differences) take_differences(r, c, h);
    pass_on(r, c, end);
    return 0;
}

/* Show at the communication point what was read again. */
static void show_read(Run *r, const Component *c, const Reading *reading)
{
    const integer first = c->offset + c->outputs;
    integer g, i;
    for (g = 0; g < reading->groups; g++)
        for (i = 0; i < reading->group[g].count; i++)
            r->next[reading->group[g].slots[i]] = r->newest[reading->group[g].slots[i]];
    if (reading->slopes)
        memcpy(r->next + first, r->newest + first, (size_t)c->output_derivatives * sizeof(double));
    for (i = 0; i < c->differences; i++) r->next[c->difference_slope[i]] = r->newest[c->difference_slope[i]];
    show_passed(r, c);
}

/* Read outputs again with the inputs of communication point k + 1, h after the one before. */
static inline int refresh(Run *r, const Reading *reading, integer k, double h)
{
    const integer place = reading->component;
    Component *c = &r->component[place];
    integer g;
    if (is_frozen(r, c)) return 0;
    if (c->period != 1) h = point_time(r, k + 1) - point_time(r, period_start(c, k));
    put_on(reading->wire, c->inputs, c->value);
    if (set_values(r, place, 1)) return 1;
    if (reading->slopes && set_slopes_now(r, place, r->all_step ? r->newest : r->next, h)) return 1;
    for (g = 0; g < reading->groups; g++)
        if (get_values(r, place, &reading->group[g])) return 1;
    if (reading->slopes && get_slopes(r, place)) return 1;
    for (g = 0; g < reading->groups; g++)
        if (refuse_not_finite(r, place, &reading->group[g])) return 1;
    if (c->differences) take_differences(r, c, h);
    if (c->passages) pass_on(r, c, point_time(r, k + 1));
    if (!r->all_step) show_read(r, c, reading);
    return 0;
}

/* Communication step k of components that step at several rates: some may be ahead of the point that is reached. */
static int step_at_rates(Run *r, integer k, double t, double h)
{
    integer i, j;
    for (i = 0; i < r->components; i++) {
        const Component *c = &r->component[i];
        if (c->at_end && k == period_start(c, k))
            for (j = 0; j < c->inputs; j++) c->begun[j] = source_at_start(r, c, j, k, &c->begun_slope[j]);
    }
    for (i = 0; i < r->components; i++)
        if (is_due(r, &r->component[i], k) && take_turn(r, i, k, t, h)) return 1;
    memcpy(r->next, r->point, (size_t)r->size * sizeof(double));
    for (i = 0; i < r->components; i++) {
        const Component *c = &r->component[i];
        if (period_end(r, c, k) == k + 1)
            memcpy(r->next + c->offset, r->newest + c->offset, (size_t)c->owned * sizeof(double));
    }
    for (i = 0; i < r->refreshes; i++)
        if (period_end(r, &r->component[r->refresh[i].component], k) == k + 1 && refresh(r, &r->refresh[i], k, h)) return 1;
    memcpy(r->point, r->next, (size_t)r->owned * sizeof(double));
    return 0;
}

/* Communication step k, from point k at t to point k + 1 at t + h. `point` changes only when all has succeeded. */
static int step(Run *r, integer k, double t, double h)
{
    integer i;
    if (!r->all_step) return step_at_rates(r, k, t, h);
    for (i = 0; i < r->passes; i++) {
        const Pass *p = &r->first_pass[i];
        if (p->straight) {
            if (pass(r, p, k, t, h)) return 1;
        } else if (p->step ? take_turn(r, p->component, k, t, h) : refresh(r, &r->refresh[i - r->components], k, h)) {
            return 1;
        }
    }
    for (i = 0; i < r->owned; i++) ((volatile double *)r->point)[i] = r->newest[i];
    r->underway = 1;
    return 0;
}

#include "waves.h"
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

/* The next point that is recorded after one that is, with no division where the grid of rows is even. */
static integer following_row(const Run *r)
{
    if (r->divisions || r->events) return next_recorded(r, r->done);
    return r->every < r->steps - r->done ? r->done + r->every : r->steps;
}

/* Write the row of point k, at t, the values of which are `stride` apart. */
static void write_row(Run *r, double t, double *row, integer stride)
{
    const double *point = r->point;
    const integer *slot = r->column_slot, columns = r->columns;
    integer i;
    show_inputs(r);
    *row = t;
    for (i = 0; i < columns; i++) *(row += stride) = point[slot[i]];
}

static integer least(integer a, integer b, integer c)
{
    const integer ab = a < b ? a : b;
    return ab < c ? ab : c;
}

/* Take steps to communication point `until`, for about `seconds`. Rows go to `rows` (`capacity` of them, time
 * and columns `stride` apart) from row `*count` on, which counts complete rows at any time. Returns 0, or -1 for a run that cannot be; r->done and
 * r->failed_call say how it went. */
EXPORT int kernel_run(Run *r, integer until, double seconds, double *rows, integer capacity, integer stride,
                      volatile integer *count)
{
    const double begun = now();
    double last = begun;
    double t = point_time(r, r->done), next;
    integer i, look = 1, next_look = r->done + 1, next_row;
    if (r->every < 1 || r->denominator < 1 || r->step < 1 || until > r->steps) return -1;
    for (i = 0; i < r->components; i++)
        if (r->component[i].period < 1) return -1;
    next_row = next_recorded(r, r->done);
    r->underway = 0;
    r->careful = careful;
    while (r->done < until && *count < capacity && !*r->stop_asked) {
        if (r->stop_slot >= 0 && r->point[r->stop_slot] > FLAG) break;
        if (has_ended(r)) break;
        if (r->waves) {
            if (steps_in_waves(r, least(until, next_row, next_look), &t)) break;
        } else {
            next = point_time(r, r->done + 1);
            if (r->stages ? iterated_step(r, r->done, t, next - t) : step(r, r->done, t, next - t)) break;
            r->done++;
            t = next;
        }
        if (r->done == next_row) {
            next_row = following_row(r);
            write_row(r, t, rows + *count, stride);
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
