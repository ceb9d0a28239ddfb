/* Many steps of a run of which every turn and reading is straight (pass.h), with no slopes: `step` again and again,
 * without a question that the plan of the run has answered.
 *
 * Passes that take nothing from one another are a wave: all inputs, all steps, all outputs, so that the processor works
 * on what one FMU computes while it calls others. What is computed is the same as one by one. So is the failure that is
 * told, that of the first pass: where one fails, only those before it go on. */

#if defined(__GNUC__)
#define RARELY(condition) __builtin_expect(!!(condition), 0)
#else
#define RARELY(condition) (condition)
#endif

enum { FINE = 0, LOOK = 1, FAILED = 2 }; /* how a wave went; LOOK: something is to be looked at after the step */
enum { FEW = 16 };           /* so few values are taken one by one: wider loads would wait for what has just been written */

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

/* Whether there is a value that must be finite and is not: all bits of its exponent are set, one more carries over. */
static inline int any_not_finite(const Wave *w)
{
    const integer *mask = w->finite, *value = (const integer *)w->value;
    unsigned long long carried = 0;
    integer i;
    if (w->slots < FEW)
        for (i = 0; i < w->slots; i++)
            carried |= (unsigned long long)(((const volatile integer *)value)[i] & mask[i]) + (1ull << 52);
    else
        for (i = 0; i < w->slots; i++) carried |= (unsigned long long)(value[i] & mask[i]) + (1ull << 52);
    return (int)(carried >> 63);
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
    integer steps = w->steps, gets = w->gets, i;
    int outcome = FINE, status;
    const Call *c;
    put_on_all(w);
    for (c = w->set, i = w->sets; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.set(c->instance, c->references, (size_t)c->count, c->value);
        if (RARELY(status != OK) && returned_not_ok(r, status)) {
            outcome = FAILED;
            steps = calls_before(w->step, steps, c->place);
            gets = calls_before(w->get, gets, c->place);
            break;
        }
    }
    for (c = w->step, i = steps; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.step(c->instance, t, h, 1);
        if (RARELY(status != OK)) {
            if (outcome == FINE) outcome = LOOK;
            if (not_ok(r, CALLING_COMPONENT(c->calling), status, t, h)) {
                outcome = FAILED;
                gets = calls_before(w->get, gets, c->place);
                break;
            }
        }
    }
    for (c = w->get, i = gets; i; c++, i--) {
        r->calling = c->calling;
        status = c->function.get(c->instance, c->references, (size_t)c->count, c->value);
        if (RARELY(status != OK) && returned_not_ok(r, status)) {
            outcome = FAILED;
            break;
        }
    }
    if (RARELY(any_not_finite(w))) refuse_in(r, w), outcome = FAILED;
    return outcome;
}

static inline void show_all(Run *r)
{
    const double *newest = r->newest;
    double *point = r->point;
    integer i;
    if (r->owned < FEW)
        for (i = 0; i < r->owned; i++) ((volatile double *)point)[i] = newest[i];
    else
        memcpy(point, newest, (size_t)r->owned * sizeof *point);
}

/* Take steps from r->done, at *t, towards communication point `end`, at least one, to the first point at which something
 * has to be looked at. The first step of a call of the kernel and the last one of the run go by themselves: only behind
 * the first are the inputs those that the reading before has set, only the last may be shorter. */
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
