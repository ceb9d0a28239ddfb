/* Many steps of a run of which every turn and reading is straight (pass.h), with no slopes: `step` again and again,
 * without a question that the plan of the run has answered.
 *
 * Passes that take nothing from one another are a wave: all inputs, all steps, all outputs, so that the processor works
 * on what one FMU computes while it calls others. What is computed is the same as one by one. So is the failure that is
 * told, that of the first pass: where one fails, only those before it go on. */

/* How many calls are of passes before `place`. */
static integer calls_before(const Call *call, integer calls, integer place)
{
    integer i = 0;
    while (i < calls && call[i].place < place) i++;
    return i;
}

/* Refuse the first value of a wave that is not finite. */
static int refuse_in(Run *r, const Wave *w)
{
    const Pass *p;
    for (p = r->first_pass + w->first;; p++) {
        integer i;
        for (i = 0; i < p->finite; i++)
            if (!isfinite(*p->finite_value[i])) return refuse_values(r, p);
    }
}

/* The status of one call of a wave. */
static int made(Run *r, int phase, const Call *c, double t, double h)
{
    r->calling = c->calling;
    if (phase == SETTING) return c->function.set(c->instance, c->references, (size_t)c->count, c->value);
    if (phase == STEPPING) return c->function.step(c->instance, t, h, 1);
    return c->function.get(c->instance, c->references, (size_t)c->count, c->value);
}

/* The rest of a wave of which call i of a phase has returned a status that is not OK. */
static int careful(Run *r, const Wave *w, double t, double h, int phase, integer i, int status)
{
    const Call *const call[PHASES] = {w->set, w->step, w->get};
    integer calls[PHASES];
    int outcome = LOOK;
    calls[SETTING] = w->sets, calls[STEPPING] = w->steps, calls[GETTING] = w->gets;
    for (; phase < PHASES; phase++, i = 0) {
        for (; i < calls[phase]; i++, status = OK) {
            const Call *c = &call[phase][i];
            int later, fails;
            if (status == OK) status = made(r, phase, c, t, h);
            if (status == OK) continue;
            fails = phase == STEPPING ? not_ok(r, CALLING_COMPONENT(c->calling), status, t, h) : returned_not_ok(r, status);
            if (!fails) continue;
            outcome = FAILED;
            for (later = phase; later < PHASES; later++) calls[later] = calls_before(call[later], calls[later], c->place);
        }
    }
    if (any_not_finite(w)) refuse_in(r, w), outcome = FAILED;
    return outcome;
}

static inline void put_on_all(const Wave *w)
{
    integer i;
    if (w->bare)
        for (i = 0; i < w->wires; i++) w->input[i] = *w->bare[i] + 0.0; /* as put_on: no zero has a sign */
    else
        put_on(w->wire, w->wires, w->input);
}

static inline int go_together(Run *r, const Wave *w, double t, double h)
{
    const Call *c;
    integer i;
    int status;
    put_on_all(w);
    for (c = w->set, i = w->sets; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.set(c->instance, c->references, (size_t)c->count, c->value);
        if (RARELY(status != OK)) return careful(r, w, t, h, SETTING, c - w->set, status);
    }
    for (c = w->step, i = w->steps; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.step(c->instance, t, h, 1);
        if (RARELY(status != OK)) return careful(r, w, t, h, STEPPING, c - w->step, status);
    }
    for (c = w->get, i = w->gets; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.get(c->instance, c->references, (size_t)c->count, c->value);
        if (RARELY(status != OK)) return careful(r, w, t, h, GETTING, c - w->get, status);
    }
    if (RARELY(any_not_finite(w))) return refuse_in(r, w), FAILED;
    return FINE;
}

/* Take steps from r->done, at *t, towards communication point `end`, at least one, to the first point at which something
 * has to be looked at. The first step of a call of the kernel and the last one of the run go by themselves: only behind
 * the first are the inputs those that the reading before has set, only the last may be shorter; and so does each step of
 * a run that a flag may end. */
static int steps_in_waves(Run *r, integer end, double *t)
{
    const Wave *const first = r->wave, *const last = first + r->waves;
    const double denominator = (double)r->denominator;
    const integer size = r->step;
    integer at = r->start + r->done * size;
    double here = *t;
    if (!r->underway || r->done + 1 == r->steps || r->stop_slot >= 0) {
        const double next = point_time(r, r->done + 1);
        if (step(r, r->done, here, next - here)) return 1;
        r->done++;
        *t = next;
        return 0;
    }
    if (end == r->steps) end--;
    if (r->unrolled) return r->unrolled(r, end, t);
    while (r->done < end && !*r->stop_asked) {
        const double next = (double)(at += size) / denominator;
        int outcome = FINE;
        const Wave *w;
        for (w = first; w < last && !(outcome & FAILED); w++) outcome |= go_together(r, w, here, next - here);
        if (RARELY(outcome & FAILED)) return 1;
        show_all(r);
        r->done++;
        *t = here = next;
        if (RARELY(outcome)) return 0;
    }
    return 0;
}
