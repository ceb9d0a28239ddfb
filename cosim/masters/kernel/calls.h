/* Calls of FMUs: what is passed on and read back, and what ends a run. calls.py in C. */

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

/* Set inputs of several kinds, or of which some do not take every value, to c->value. */
static int set_other_values(Run *r, integer place, int at_end)
{
    const Component *c = &r->component[place];
    const double *value = c->value;
    integer g, i;
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

/* Set the inputs of a component to c->value, at the start of its step or `at_end`. */
static inline int set_values(Run *r, integer place, int at_end)
{
    const Component *c = &r->component[place];
    if (!c->only_real) return set_other_values(r, place, at_end);
    calling(r, place, CALL_SET, REAL);
    return returned(r, c->set_real(c->instance, c->input_references, (size_t)c->inputs, c->value));
}

/* Read outputs that are no Reals, or not side by side, into their slots of r->newest. */
static int get_other_values(Run *r, integer place, const Group *group)
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

/* Read a group of outputs into its slots of r->newest. */
static inline int get_values(Run *r, integer place, const Group *group)
{
    const Component *c = &r->component[place];
    if (group->kind != REAL || group->first < 0) return get_other_values(r, place, group);
    calling(r, place, CALL_GET, REAL);
    return returned(r, c->get_real(c->instance, group->references, (size_t)group->count, r->newest + group->first));
}

static inline int refuse_not_finite(Run *r, integer place, const Group *group)
{
    const integer n = group->finite, *slots = group->finite_slot;
    const double *newest = r->newest;
    integer i;
    for (i = 0; i < n; i++)
        if (!isfinite(newest[slots[i]])) return failed(r, place, CALL_NOT_FINITE, OK, slots[i], REAL);
    return 0;
}
