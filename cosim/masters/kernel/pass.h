/* The straight case of a turn or of a reading, with every address at hand: all inputs and outputs are Reals, inputs are
 * what slots show, outputs stand side by side. The same calls as take_turn's and refresh's in the same order. */

static int refuse_values(Run *r, const Pass *p)
{
    integer i;
    for (i = 0; isfinite(*p->finite_value[i]);) i++;
    return failed(r, p->component, CALL_NOT_FINITE, OK, (integer)(p->finite_value[i] - r->newest), REAL);
}

static int set_moves(Run *r, const Pass *p, integer k, double h)
{
    return p->step ? set_input_derivatives(r, p->component, k, h) : set_slopes_now(r, p->component, r->newest, h);
}

/* Set the inputs, step from t to t + h where it is a turn, read the outputs. */
static inline int pass(Run *r, const Pass *p, integer k, double t, double h)
{
    integer i;
    if (p->inputs && !(p->kept && r->underway)) {
        put_on(p->wire, p->inputs, p->input);
        calling(r, p->component, CALL_SET, REAL);
        if (returned(r, p->set(p->instance, p->input_references, (size_t)p->inputs, p->input))) return 1;
    }
    if (p->slopes && set_moves(r, p, k, h)) return 1;
    if (p->step) {
        int status;
        calling(r, p->component, CALL_STEP, REAL);
        status = p->step(p->instance, t, h, 1);
        if (status != OK && not_ok(r, p->component, status, t, h)) return 1;
    }
    if (p->outputs) {
        calling(r, p->component, CALL_GET, REAL);
        if (returned(r, p->get(p->instance, p->output_references, (size_t)p->outputs, p->output))) return 1;
    }
    if (p->slopes && get_slopes(r, p->component)) return 1;
    for (i = 0; i < p->finite; i++)
        if (RARELY((BITS(*p->finite_value[i]) & EXPONENT) == EXPONENT)) return refuse_values(r, p);
    if (p->slopes) take_differences(r, &r->component[p->component], h);
    return 0;
}
