/* Faults on connections, and frozen components: cosim/masters/faults.py and noise.py in C, operation by operation. */

enum { SCALE, BIAS, SIGMA, SEED, QUANTUM, STEPS, HOLD, HELD, SENT, COUNT, PASSAGE_SIZE }; /* faults.SCALE and so on */
enum { FROZEN, LAG };

typedef unsigned long long word; /* 64 bits */

static const double LN2 = 0.6931471805599453, SQRT_HALF = 0.7071067811865476;

static int is_frozen(const Run *r, const Component *c) { return c->freeze >= 0 && r->newest[c->freeze + FROZEN] != 0; }

static double lag(const Run *r, const Component *c) { return c->freeze >= 0 ? r->newest[c->freeze + LAG] : 0.0; }

/* Whether a fault makes what input i is given move in steps. */
static int moves_in_steps(const Run *r, const Component *c, integer i)
{
    return c->held && c->held[i] >= 0 && r->newest[c->held[i]] != 0;
}

/* ---- noise.py --------------------------------------------------------------------------------------------------- */

/* The product of two words: its upper word, the lower one in *low. */
static word multiply(word a, word b, word *low)
{
    const word half = 0xFFFFFFFFull, a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
    const word p = a0 * b0, q = a1 * b0 + (p >> 32), s = a0 * b1 + (q & half);
    *low = a * b;
    return a1 * b1 + (q >> 32) + (s >> 32);
}

static void philox(word *c, word k, word m)
{
    int i;
    for (i = 0; i < 10; i++) {
        word p, q;
        const word ph = multiply(0xD2E7470EE14C6C93ull, c[0], &p), qh = multiply(0xCA5A826395121157ull, c[2], &q);
        c[0] = qh ^ c[1] ^ k;
        c[1] = q;
        c[2] = ph ^ c[3] ^ m;
        c[3] = p;
        k += 0x9E3779B97F4A7C15ull;
        m += 0xBB67AE8584CAA73Bull;
    }
}

static double natural_log(double x)
{
    int e, i;
    double m = frexp(x, &e), w, total = 0;
    if (m < SQRT_HALF) m = 2 * m, e--;
    w = (m - 1) / (m + 1);
    for (i = 11; i >= 0; i--) total = total * (w * w) + 1 / (double)(2 * i + 1);
    return 2 * w * total + (double)e * LN2; /* noise.py (2) */
}

static double normal(word seed, word key, double t)
{
    const word time = (word)(long long)rint(t * 1e9);
    word attempt;
    for (attempt = 0;; attempt++) {
        word c[4] = {0, 0, 0, 0};
        double u, v, s;
        c[0] = time;
        c[1] = attempt;
        philox(c, seed, key);
        u = 2 * ((double)(c[0] >> 11) * 0x1p-53) - 1;
        v = 2 * ((double)(c[1] >> 11) * 0x1p-53) - 1;
        s = u * u + v * v;
        if (0 < s && s < 1) return u * sqrt(-2 * natural_log(s) / s); /* noise.py (1) */
    }
}

/* ---- faults.py -------------------------------------------------------------------------------------------------- */

/* Passage.take */
static void take_passage(const Run *r, const Passage *p, double t)
{
    double *x = r->newest, *u = x + p->first, *in = u + 1 + p->slopes, *line = in + PASSAGE_SIZE;
    const double *begun = r->point + p->first, *was = begun + 1 + p->slopes;
    const integer n = (integer)in[STEPS];
    double v = in[SCALE] * (p->factor * x[p->source] + p->addend) + in[BIAS]; /* (1) */
    integer i;
    if (in[SIGMA] != 0) v = v + in[SIGMA] * normal((word)in[SEED], p->key, t);
    if (in[QUANTUM] != 0) v = in[QUANTUM] * rint(v / in[QUANTUM]);
    *u = v;
    if (n) { /* (2) */
        integer count = (integer)was[COUNT];
        line[count] = was[SENT];
        count = (count + 1) % n;
        *u = line[count];
        in[COUNT] = (double)count;
    }
    in[SENT] = v;
    if (in[HOLD] != 0) *u = *begun;
    for (i = 0; i < p->slopes; i++) u[1 + i] = in[HELD] != 0 ? 0.0 : in[SCALE] * (p->factor * x[p->slope[i]]);
}

/* Let faults act on what a component has at t, the end of its step, which began at r->point. Outputs.pass_on */
static void pass_on(const Run *r, const Component *c, double t)
{
    integer i;
    for (i = 0; i < c->passages; i++) take_passage(r, &c->passage[i], t);
}

/* Leave what a frozen component has as it was; what passes from there goes on. */
static int stay_frozen(const Run *r, const Component *c, double end)
{
    memcpy(r->newest + c->offset, r->point + c->offset, (size_t)c->owned * sizeof(double));
    pass_on(r, c, end);
    return 0;
}

/* Show at the communication point what has passed; passages and freezing are the last slots of a component. */
static void show_passed(const Run *r, const Component *c)
{
    if (c->passages) {
        const integer first = c->passage->first;
        memcpy(r->next + first, r->newest + first, (size_t)(c->offset + c->owned - first) * sizeof(double));
    }
}
