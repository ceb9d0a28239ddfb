/* How long an internal step may be for the dynamics at the start; the twin of fmus/export/python/internal_step.py.
 *
 * x' = lambda x goes exactly as exp(z) in a step h, z = lambda h, and by RK4 as
 *     R(z) = 1 + z + z^2/2 + z^3/6 + z^4/24                                                             (1)
 * A step is too long for an eigenvalue lambda of df/dx
 *   - that decays, where RK4 does not: Re z < 0, |R(z)| >= 1, from z = -2.79 on;
 *   - that turns or swings, |Im z| > |Re z|, where RK4 is off by more than LOSS of its amplitude, in REVOLUTIONS of them
 *     or while it decays:
 *         | ln|R(z)| - Re z | min(2 pi REVOLUTIONS / |Im z|, 1 / (e |Re z|)) > LOSS                     (2)
 *     For |z| <= ALWAYS_FITS it never is, whatever is rounded: ln|R(z)| - Re z is at most |z|^5/120, (2) below LOSS.
 *     Without damping ln|R(i z)| = -z^6/144, so that this is z > (144 LOSS / (2 pi REVOLUTIONS))^(1/5) = 0.187.
 *
 * Where solver.step is 0, the longest step for the fastest eigenvalue is
 *     h = AUTOMATIC / |lambda|, rounded down to DIGITS digits                                           (3)
 * of which RK4 is off by |z|^4/120, 8e-7 of what moves at that rate, in the time 1/|lambda|. The communication step is
 * divided into as many equal ones as that needs; it is taken whole where nothing moves by itself. OTHERWISE, in s, where
 * df/dx cannot be had. Limits: the rate at the start, or when a parameter was last set; what gets faster in flight, or
 * moves with time faster than the communication step shows, needs solver.step.
 *
 * Eigenvalues: Hessenberg form by elimination, then QR steps with Wilkinson's shift (Golub and Van Loan, Matrix
 * Computations, 7.4 and 7.5), in complex numbers. Above LARGEST_MATRIX states only the largest modulus is sought, by the
 * growth of J^k v, and taken for an eigenvalue that decays: of a big component only instability is found.
 */

#define LARGEST_MATRIX 100
enum { GROWTH_STEPS = 200, SWEEPS = 60 };

static const double AUTOMATIC = 0.1, OTHERWISE = 1e-3, LONGEST = 1e9;
static const int DIGITS = 2;
static const double LOSS = 1e-3, REVOLUTIONS = 100, ALWAYS_FITS = 0.1, PI = 3.14159265358979323846;

typedef struct {
    double re, im;
} Complex;

typedef struct {      /* what is told where an internal step is too long */
    double longest;   /* s, the longest that is not; 0: nothing to tell */
    double advice;    /* s, one that would do */
    double rate;      /* 1/s, |lambda| of the eigenvalue that is to blame */
    int unstable;
} InternalStep;

static Complex add(Complex a, Complex b)
{
    a.re += b.re, a.im += b.im;
    return a;
}

static Complex times(Complex a, Complex b)
{
    const Complex c = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return c;
}

static Complex scaled(double s, Complex a)
{
    a.re *= s, a.im *= s;
    return a;
}

static double modulus(Complex a) { return hypot(a.re, a.im); }

#if NX <= LARGEST_MATRIX
static Complex conjugate(Complex a)
{
    a.im = -a.im;
    return a;
}

static Complex square_root(Complex a)
{
    const double r = modulus(a);
    const Complex c = {sqrt(0.5 * (r + a.re)), copysign(sqrt(0.5 * fabs(r - a.re)), a.im)};
    return c;
}

#define H(i, j) h[(i) * n + (j)]

/* Reduce to Hessenberg form: zero below the first subdiagonal. */
static void hessenberg(Complex *h, int n)
{
    int i, j, m;
    for (m = 1; m < n - 1; m++) {
        int pivot = m;
        for (i = m + 1; i < n; i++)
            if (modulus(H(i, m - 1)) > modulus(H(pivot, m - 1))) pivot = i;
        if (modulus(H(pivot, m - 1)) == 0) continue;
        for (j = 0; j < n && pivot != m; j++) {
            const Complex swapped = H(pivot, j);
            H(pivot, j) = H(m, j), H(m, j) = swapped;
        }
        for (j = 0; j < n && pivot != m; j++) {
            const Complex swapped = H(j, pivot);
            H(j, pivot) = H(j, m), H(j, m) = swapped;
        }
        for (i = m + 1; i < n; i++) { /* the matrix is real until here */
            const double factor = H(i, m - 1).re / H(m, m - 1).re;
            if (factor == 0) continue;
            for (j = 0; j < n; j++) H(i, j) = add(H(i, j), scaled(-factor, H(m, j)));
            for (j = 0; j < n; j++) H(j, m) = add(H(j, m), scaled(factor, H(j, i)));
        }
    }
}

/* The eigenvalue of the last two rows up to `last` that is nearer to the last element. */
static Complex wilkinson(const Complex *h, int n, int last)
{
    const Complex a = H(last - 1, last - 1), d = H(last, last), half = scaled(0.5, add(a, scaled(-1, d)));
    const Complex root = square_root(add(times(half, half), times(H(last - 1, last), H(last, last - 1))));
    const Complex one = add(half, root), other = add(half, scaled(-1, root));
    return add(d, modulus(one) < modulus(other) ? one : other);
}

/* One QR step of rows and columns first to last with a shift; cosines and sines have place for n. */
static void qr_step(Complex *h, int n, int first, int last, Complex shift, Complex *cosines, Complex *sines)
{
    int i, k;
    for (k = first; k <= last; k++) H(k, k) = add(H(k, k), scaled(-1, shift));
    for (k = first; k < last; k++) {
        const double r = hypot(modulus(H(k, k)), modulus(H(k + 1, k)));
        cosines[k] = r > 0 ? scaled(1 / r, conjugate(H(k, k))) : (Complex){1, 0};
        sines[k] = r > 0 ? scaled(1 / r, conjugate(H(k + 1, k))) : (Complex){0, 0};
        for (i = k; i <= last; i++) {
            const Complex a = H(k, i), b = H(k + 1, i);
            H(k, i) = add(times(cosines[k], a), times(sines[k], b));
            H(k + 1, i) = add(times(conjugate(cosines[k]), b), scaled(-1, times(conjugate(sines[k]), a)));
        }
    }
    for (k = first; k < last; k++)
        for (i = first; i <= (k + 1 < last ? k + 1 : last); i++) {
            const Complex a = H(i, k), b = H(i, k + 1);
            H(i, k) = add(times(a, conjugate(cosines[k])), times(b, conjugate(sines[k])));
            H(i, k + 1) = add(times(b, cosines[k]), scaled(-1, times(a, sines[k])));
        }
    for (k = first; k <= last; k++) H(k, k) = add(H(k, k), shift);
}

/* Put the eigenvalues of an n x n matrix, real and row by row in h, into `values`; 0 where that does not converge.
 * h is used up; room has place for 2 n. */
static int eigenvalues(Complex *h, int n, Complex *values, Complex *room)
{
    int last = n - 1, sweeps = 0, i;
    double scale = 0;
    hessenberg(h, n);
    for (i = 0; i < n * n; i++) scale = fmax(scale, modulus(h[i]));
    while (last >= 0) {
        int first = last;
        for (; first > 0; first--) {
            double near = modulus(H(first, first)) + modulus(H(first - 1, first - 1));
            if (near == 0) near = scale;
            if (modulus(H(first, first - 1)) <= DBL_EPSILON * near) break;
        }
        if (first == last) {
            values[last] = H(last, last);
            last--, sweeps = 0;
            continue;
        }
        if (++sweeps > SWEEPS) return 0;
        /* now and then a shift that is none of theirs, for what goes in circles */
        qr_step(h, n, first, last,
                sweeps % 10 ? wilkinson(h, n, last) : add(H(last, last), scaled(0.75, H(last, last - 1))), room,
                room + n);
    }
    return 1;
}

#undef H
#endif

/* Is a step too long for an eigenvalue, z = lambda h: 0 no, 1 it is off (2), 2 it is unstable. */
static int too_long(Complex z)
{
    const Complex one = {1, 0};
    double size, steps;
    Complex r = add(one, scaled(0.25, z)); /* (1), Horner */
    if (modulus(z) <= ALWAYS_FITS) return 0;
    r = add(one, scaled(1.0 / 3, times(z, r)));
    r = add(one, scaled(0.5, times(z, r)));
    r = add(one, times(z, r));
    size = modulus(r);
    if (z.re < 0 && size >= 1) return 2;
    if (!(fabs(z.im) > fabs(z.re))) return 0;
    steps = 2 * PI * REVOLUTIONS / fabs(z.im);
    if (z.re < 0) steps = fmin(steps, 1 / (exp(1) * -z.re));
    return fabs(log(size) - z.re) * steps > LOSS;
}

/* Return for which of n eigenvalues a step h is too long, -1 if for none: the fastest of the worst kind. */
static int worst(const Complex *lambda, int n, double h)
{
    int i, found = -1, kind = 0;
    for (i = 0; i < n; i++) {
        const int this = too_long(scaled(h, lambda[i]));
        if (this == 0 || this < kind) continue;
        if (this == kind && modulus(lambda[i]) <= modulus(lambda[found])) continue;
        found = i, kind = this;
    }
    return found;
}

/* Return what is to be told of internal steps up to h, for n eigenvalues. */
static InternalStep judged(const Complex *lambda, int n, double h)
{
    InternalStep result = {0, 0, 0, 0};
    const int which = worst(lambda, n, h);
    double low = 0, high = h, digit;
    int i;
    if (which < 0) return result;
    for (i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        if (worst(lambda, n, middle) < 0) low = middle;
        else high = middle;
    }
    result.rate = modulus(lambda[which]);
    result.unstable = too_long(scaled(h, lambda[which])) == 2;
    result.longest = low;
    result.advice = result.unstable ? 0.5 * low : low; /* where it is just stable, what decays hardly does */
    digit = pow(10, floor(log10(result.advice)));
    result.advice = floor(result.advice / digit) * digit;
    return result;
}

/* The longest step of itself (3) for n eigenvalues, 0 where they cannot be had; a last digit that rounding has taken is
 * given back. */
static double automatic(const Complex *lambda, int n)
{
    double fastest = 0, step, digit;
    int i;
    if (n == 0) return OTHERWISE;
    for (i = 0; i < n; i++) fastest = fmax(fastest, modulus(lambda[i]));
    if (fastest * LONGEST <= AUTOMATIC) return HUGE_VAL;
    step = AUTOMATIC / fastest;
    digit = pow(10, floor(log10(step)) - DIGITS + 1);
    return floor(step / digit * (1 + 1e-6)) * digit;
}
