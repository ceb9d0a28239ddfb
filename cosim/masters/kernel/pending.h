/* A step that goes on after fmi2DoStep has returned fmi2Pending: asked for until it is done, its time is up, or the run is
 * to stop. slaves/pending.py in C. */

enum { PENDING = 5, DO_STEP_STATUS = 0 };                 /* FMI: the status, and what fmi2GetStatus is asked for */
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
