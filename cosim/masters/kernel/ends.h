/* Both ends of an input over a step, at all rates: Stepping._sources_at_start, ._sources_at_end in C. */

static int is_between(integer timing)
{
    return timing == MIDPOINT || timing == RAMP || timing == SMOOTH || timing == MEAN;
}

static int is_curved(integer timing) { return timing == SMOOTH || timing == MEAN; }

/* A slow source's value at communication point `at`, on the line or curve over its own step; its slope in *slope. */
static double between(const Run *r, const Component *c, integer i, integer k, integer at, double *slope)
{
    const Component *s = &r->component[c->source_component[i]];
    const integer begin = point_count(r, period_start(s, k)), end = point_count(r, period_end(r, s, k));
    const integer since = point_count(r, at) - begin, whole = end - begin, source = c->source[i];
    const double a = r->point[source], b = r->newest[source];
    *slope = 0;
    if (moves_in_steps(r, c, i)) return a;
    if (!is_curved(c->timing[i])) return a + (b - a) * ((double)since / (double)whole);
    {
        const double h = (double)whole / (double)r->denominator, t = (double)since / (double)r->denominator;
        const Ends e = {a, b, r->point[c->slope_slot[i]], r->newest[c->slope_slot[i]]};
        *slope = curve_slope(known(e, h), h, t);
        return curve_value(known(e, h), h, t);
    }
}

/* a: source i's value where the target's period begins; a' in *slope, where the input follows a curve. */
static double source_at_start(const Run *r, const Component *c, integer i, integer k, double *slope)
{
    if (c->ahead[i] && is_between(c->timing[i])) return between(r, c, i, k, period_start(c, k), slope);
    *slope = is_curved(c->timing[i]) ? r->point[c->slope_slot[i]] : 0;
    return r->point[c->source[i]];
}

/* b, b': the same where the target's period ends. */
static double source_at_end(const Run *r, const Component *c, integer i, integer k, double *slope)
{
    *slope = is_curved(c->timing[i]) ? r->newest[c->slope_slot[i]] : 0;
    if (c->ahead[i] && c->timing[i] != STEP_MEAN) {
        const integer end = period_end(r, c, k);
        if (period_end(r, &r->component[c->source_component[i]], k) > end) {
            if (is_between(c->timing[i])) return between(r, c, i, k, end, slope);
            return r->point[c->source[i]];
        }
    }
    return r->newest[c->source[i]];
}

/* Both ends of input i over a component's step of length h. */
static Ends ends_of(const Run *r, const Component *c, integer i, integer k, double h)
{
    Ends e;
    if (c->in_step) {
        e.a = r->point[c->source[i]];
        e.b = r->newest[c->source[i]];
        if (!is_curved(c->timing[i])) return e.da = e.db = 0, e;
        e.da = r->point[c->slope_slot[i]];
        e.db = r->newest[c->slope_slot[i]];
        return known(e, h);
    }
    if (c->at_end) {
        e.a = c->begun[i];
        e.da = c->begun_slope[i];
    } else {
        e.a = source_at_start(r, c, i, k, &e.da);
    }
    e.b = source_at_end(r, c, i, k, &e.db);
    return is_curved(c->timing[i]) ? known(e, h) : e;
}

/* The same as the input sees them: what a fault makes move in steps stays at its start. */
static Ends ends_seen(const Run *r, const Component *c, integer i, integer k, double h)
{
    Ends e = ends_of(r, c, i, k, h);
    if (moves_in_steps(r, c, i) && is_between(c->timing[i])) e.b = e.a, e.da = e.db = 0;
    return e;
}
