/* What inputs are over a step and at its end: steps.py in C. */

/* What an input is over a step, where that is more than what a slot shows. */
static double mixed(const Run *r, const Component *c, integer i, integer k, double h)
{
    const Ends e = ends_seen(r, c, i, k, h);
    switch (c->timing[i]) {
    case AFTER_STEP:
    case STEP_MEAN: return e.b;
    case MIDPOINT: return 0.5 * (e.a + e.b);
    case MEAN: return curve_mean(e, h);
    case EXTRAPOLATED_MEAN: return e.a + 0.5 * h * slope_or_none(r->point[c->slope_slot[i]]);
    default: return e.a;
    }
}

static void put_on(const Wire *wire, integer count, double *value)
{
    integer i;
    for (i = 0; i < count; i++) value[i] = wire[i].factor * *wire[i].from + wire[i].addend;
}

static int set_input_derivatives(Run *r, integer place, integer k, double h)
{
    const Component *c = &r->component[place];
    Ends e = {0, 0, 0, 0};
    integer i;
    if (!c->input_derivatives) return 0;
    for (i = 0; i < c->input_derivatives; i++) {
        const integer at = c->position[i];
        double slope;
        if (c->form[i] == SLOT) {
            slope = slope_or_none(r->point[c->slot[i]]);
        } else if (c->form[i] == SIGNAL_SLOT) {
            slope = r->newest[c->slot[i]];
        } else {
            if (!i || c->position[i - 1] != at) e = ends_seen(r, c, at, k, h); /* the orders of an input are neighbours */
            if (c->form[i] == LINE) slope = (e.b - e.a) / h;
            else if (c->derivative_orders[i] == 1) slope = e.da;
            else slope = c->derivative_orders[i] == 2 ? curve_second(e, h) : curve_third(e, h);
        }
        c->slope[i] = c->wire[at].factor * slope;
    }
    calling(r, place, CALL_SET_DERIVATIVES, REAL);
    return returned(r, c->set_derivatives(c->instance, c->derivative_references, (size_t)c->input_derivatives,
                                          c->derivative_orders, c->slope));
}

static inline int set_inputs(Run *r, integer place, integer k, double h)
{
    const Component *c = &r->component[place];
    integer i;
    if (!c->inputs) return 0;
    put_on(c->wire, c->inputs, c->value);
    for (i = 0; i < c->mixed; i++) {
        const integer at = c->mixed_position[i];
        c->value[at] = c->wire[at].factor * mixed(r, c, at, k, h) + c->wire[at].addend;
    }
    if (set_values(r, place, 0)) return 1;
    return set_input_derivatives(r, place, k, h);
}

/* Set the inputs to their sources' values at the end of the step. */
static int set_ends(Run *r, integer place, integer k, double h)
{
    const Component *c = &r->component[place];
    integer i;
    for (i = 0; i < c->inputs; i++) c->value[i] = c->wire[i].factor * ends_of(r, c, i, k, h).b + c->wire[i].addend;
    return set_values(r, place, 1);
}

/* Set the slopes that moving inputs have at the communication point: the sources', or those of the lines to it. `values`
 * are those of the point. */
static int set_slopes_now(Run *r, integer place, const double *values, double h)
{
    const Component *c = &r->component[place];
    integer i;
    if (!c->moving) return 0;
    for (i = 0; i < c->moving; i++) {
        const integer at = c->moving_position[i], source = c->source[at];
        const double slope =
            moves_in_steps(r, c, at) ? 0.0 : c->timing[at] == RAMP ? (values[source] - r->point[source]) / h : slope_or_none(values[c->slope_slot[at]]);
        c->moving_slope[i] = c->wire[at].factor * slope;
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
