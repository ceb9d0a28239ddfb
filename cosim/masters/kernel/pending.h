/* Steps that return more than OK. One that goes on after fmi2DoStep has returned fmi2Pending: asked for until it is done,
 * its time is up, or the run is to stop; slaves/pending.py in C. One that is discarded at its very end, because the FMU
 * wants no other: it counts, and the run ends after it; Fmi2Slave.do_step in C. */

enum { DISCARD = 2, PENDING = 5 };                                          /* FMI: the status, ... */
enum { DO_STEP_STATUS = 0, LAST_SUCCESSFUL_TIME = 2, TERMINATED = 3 };      /* ... and what is asked of it */
enum { NO_ANSWER = 1, TIME_IS_UP = 2, STOP_IS_ASKED = 3 }; /* r->failed_slot of a step that stays pending */
static const double POLL = 2e-4;                          /* s, between two questions */

static void nap(void)
{
#if defined(_WIN32)
    Sleep(1);
#else
    struct timespec t = {0, (long)(POLL * 1e9)};
    nanosleep(&t, NULL);
#endif
}

/* Whether a step that returned fmi2Pending ends the run. */
static int wait_for_step(Run *r, integer place)
{
    const Component *c = &r->component[place];
    const double begun = now();
    for (;;) {
        int status = PENDING;
        integer why = 0;
        if (c->get_status(c->instance, DO_STEP_STATUS, &status) != OK) why = NO_ANSWER;
        else if (status != PENDING) return returned(r, status);
        else if (*r->stop_asked) why = STOP_IS_ASKED;
        else if (now() - begun >= r->pending_timeout) why = TIME_IS_UP;
        if (why) return failed(r, place, CALL_STEP, PENDING, why, REAL);
        nap();
    }
}

/* Whether a component has taken its whole step from t to t + h and asks for the end of the run. */
static int took_its_last(const Component *c, double t, double h)
{
    int terminated = 0;
    double last = t;
    if (c->get_boolean_status(c->instance, TERMINATED, &terminated) != OK || !terminated) return 0;
    if (c->get_real_status(c->instance, LAST_SUCCESSFUL_TIME, &last) != OK) return 0;
    return last >= t + h - 1e-12 * (fabs(t) > h ? fabs(t) : h);
}

/* Whether a step that did not return OK ends the run now. */
static int not_ok(Run *r, integer place, int status, double t, double h)
{
    if (status == PENDING) return wait_for_step(r, place);
    if (status != DISCARD || !took_its_last(&r->component[place], t, h)) return returned(r, status);
    r->ended = 1 + place;
    return 0;
}

/* Whether the run has ended with the step before. */
static int has_ended(Run *r) { return r->ended && failed(r, r->ended - 1, CALL_STEP, DISCARD, 0, REAL); }
