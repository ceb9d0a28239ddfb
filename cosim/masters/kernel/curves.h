/* The curve of an input over a step, and slopes by differences: cosim/masters/curves.py and slopes.py in C. */

typedef struct {
    double a, b, da, db; /* values and slopes at both ends */
} Ends;

/* The same with the line in place of slopes that are not known. */
static Ends known(Ends e, double h)
{
    if (isnan(e.da) || isnan(e.db)) e.da = e.db = (e.b - e.a) / h;
    return e;
}

static double curve_second(Ends e, double h) { return (6 * (e.b - e.a) / h - 4 * e.da - 2 * e.db) / h; }

static double curve_third(Ends e, double h) { return (12 * (e.a - e.b) / h + 6 * (e.da + e.db)) / (h * h); }

static double curve_mean(Ends e, double h) { return 0.5 * (e.a + e.b) + h * (e.da - e.db) / 12; }

static double curve_value(Ends e, double h, double s)
{
    return e.a + s * (e.da + s * (curve_second(e, h) + s * curve_third(e, h) / 3) / 2);
}

static double curve_slope(Ends e, double h, double s)
{
    return e.da + s * (curve_second(e, h) + s * curve_third(e, h) / 2);
}

static double slope_or_none(double slope) { return isnan(slope) ? 0.0 : slope; }

/* Slopes by differences at the end of a step of length h, which began at r->point. */
static void take_differences(Run *r, const Component *c, double h)
{
    integer i;
    if (!c->differences) return;
    for (i = 0; i < c->differences; i++) {
        const double a = r->point[c->difference_value[i]], before = r->point[c->step_slot];
        const double d = (r->newest[c->difference_value[i]] - a) / h;
        const double e = (a - r->point[c->difference_before[i]]) / before;
        const double slope = d + (d - e) * h / (h + before);
        r->newest[c->difference_slope[i]] = isnan(slope) ? d : slope;
        r->newest[c->difference_before[i]] = a;
    }
    r->newest[c->step_slot] = h;
}
