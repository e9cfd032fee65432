/* Eigenvalues, left and right eigenvectors of many small real matrices, LANES of them side by side.

   Scaling by powers of two, balancing (Parlett & Reinsch 1969, Numer. Math. 13, 293-304), Householder reduction to
   Hessenberg form, eigenvalues by Francis QR (EISPACK hqr; Golub & Van Loan, Matrix Computations, 7.5), vectors by two
   steps of inverse iteration on the Hessenberg matrix (Peters & Wilkinson 1979, SIAM Review 21, 339-360).

   A value of type vec holds one entry of LANES matrices. Every lane does what it would do alone: where another lane is
   not ready its reflection is zero, which changes no digit. What does not converge, is not finite or has vectors that
   cannot be told apart is marked by NaN as its first eigenvalue: the caller leaves it to LAPACK. */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030b0000
#include <Python.h>
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define MOST 128 /* columns of a matrix */
#define LIMIT 30 /* sweeps of QR a root */
#define GAP 1e-9 /* of the norm: vectors of roots nearer than this are left to LAPACK */
#define GROWTH 1e11 /* an inverse iteration that grows by less, per norm, has found no eigenvector */
#define TINY 1e-290
#define ILL 1e-8 /* left times right unit vector: below this the root is nearly defective */

#if defined(__x86_64__) && defined(__GNUC__) /* the width of AVX2, chosen at run time; of NEON and others */
#define LANES 4
#define CHOICE 1
#else
#define LANES 2
#endif

typedef Py_ssize_t Index; /* as wide as a pointer: rows are found without a conversion */
typedef double vec __attribute__((vector_size(LANES * 8)));
typedef int64_t mask __attribute__((vector_size(LANES * 8)));

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wpsabi"
#endif
#define INLINE static inline __attribute__((always_inline))

INLINE vec pick(mask m, vec a, vec b) { return (vec)(((mask)a & m) | ((mask)b & ~m)); }
INLINE vec size(vec a) { return (vec)((mask)a & INT64_MAX); }
INLINE vec with_sign(vec a, vec b) { return (vec)(((mask)a & INT64_MAX) | ((mask)b & INT64_MIN)); }
INLINE vec all(double x) { return x - (vec){0}; }
INLINE vec larger(vec a, vec b) { return pick(a > b, a, b); }
INLINE vec root(vec a) {
    for (int l = 0; l < LANES; l++) a[l] = sqrt(a[l]);
    return a;
}
INLINE int any(mask m) {
    int64_t found = 0;
    for (int l = 0; l < LANES; l++) found |= m[l];
    return found != 0;
}

typedef struct { /* work of one group of matrices, order n */
    Index n, ld; /* rows of h and t have ld = n + 1 entries; row n is zero */
    vec *h, *t, *v, *d, *beta; /* Hessenberg form, its copy, Householder vectors, balancing, factors of reflections */
    vec *change; /* dA */
    vec *re, *im; /* eigenvalues of the scaled matrix */
    vec *ur, *ui, *pr, *pi, *mr, *mi, *swap, *x, *u; /* factors of H - lambda, reciprocal pivots, multipliers; vectors re, im */
    vec norm, scale, bad;
} Work;

/* h = D^-1 h D with powers of two that make rows and columns alike */
INLINE void balance(Work *w) {
    Index n = w->n, ld = w->ld;
    vec *h = w->h, zero = {0};
    for (Index i = 0; i < n; i++) w->d[i] = all(1.0);
    for (int turn = 0, busy = 1; busy && turn < 20; turn++) {
        busy = 0;
        for (Index i = 0; i < n; i++) {
            vec c = zero, r = zero;
            for (Index j = 0; j < n; j++)
                if (j != i) c += size(h[j * ld + i]), r += size(h[i * ld + j]);
            vec own = size(h[i * ld + i]);
            mask row = (c == 0) & (r > own) & (own > TINY), column = (r == 0) & (c > own) & (own > TINY);
            c = pick(row, own * own / pick(row, r, all(1.0)), c); /* what stands alone becomes no larger than its root */
            r = pick(column, own * own / pick(column, c, all(1.0)), r);
            mask far = (((mask)r >> 52) - ((mask)c >> 52) + 1) >> 1; /* half of log2(r / c) */
            vec f = (vec)((1023 + far) << 52), g = (vec)((1023 - far) << 52);
            mask good = (c > TINY) & (r > TINY) & (c * f + r * g < 0.95 * (c + r));
            if (!any(good)) continue;
            busy = 1;
            f = pick(good, f, all(1.0)), g = pick(good, g, all(1.0));
            w->d[i] *= f;
            for (Index j = 0; j < n; j++) h[j * ld + i] *= f;
            for (Index j = 0; j < n; j++) h[i * ld + j] *= g;
        }
    }
}

/* h = Q' h Q in Hessenberg form; Q = P_1 P_2 .., P_m = I - beta v v', v in column m of w->v */
INLINE void reduce(Work *w) {
    Index n = w->n, ld = w->ld;
    vec *h = w->h, zero = {0};
    for (Index m = 1; m < n - 1; m++) {
        vec scale = zero, tail = zero, *v = w->v + m * n, sum = zero;
        for (Index i = m + 1; i < n; i++) tail += size(h[i * ld + m - 1]);
        scale = tail + size(h[m * ld + m - 1]);
        mask there = tail > 0;
        vec one = 1.0 / pick(there, scale, all(1.0));
        for (Index i = m; i < n; i++) v[i] = h[i * ld + m - 1] * one, sum += v[i] * v[i];
        vec g = -with_sign(root(sum), v[m]);
        vec beta = 1.0 / pick(there, sum - v[m] * g, all(1.0));
        w->beta[m] = beta = pick(there, beta, zero);
        v[m] -= g;
        for (Index j = m; j < n; j++) {
            vec f = zero;
            for (Index i = m; i < n; i++) f += v[i] * h[i * ld + j];
            f *= beta;
            for (Index i = m; i < n; i++) h[i * ld + j] -= f * v[i];
        }
        for (Index i = 0; i < n; i++) {
            vec f = zero;
            for (Index j = m; j < n; j++) f += v[j] * h[i * ld + j];
            f *= beta;
            for (Index j = m; j < n; j++) h[i * ld + j] -= f * v[j];
        }
        h[m * ld + m - 1] = pick(there, scale * g, h[m * ld + m - 1]);
        for (Index i = m + 1; i < n; i++) h[i * ld + m - 1] = zero;
    }
}

/* roots of [y, b; c, x] with w = b c into places k - 1, k of lane l */
static void two_roots(Work *w, int l, int k, double x, double y, double bc) {
    double p = (y - x) / 2, q = p * p + bc, z = sqrt(fabs(q));
    w->im[k - 1][l] = q < 0 ? z : 0.0;
    w->im[k][l] = q < 0 ? -z : 0.0;
    w->re[k - 1][l] = w->re[k][l] = x + p;
    if (q >= 0) {
        z = p + copysign(z, p);
        w->re[k - 1][l] = x + z;
        w->re[k][l] = z != 0 ? x - bc / z : x + z;
    }
}

/* eigenvalues of t, upper Hessenberg, which is spoilt */
INLINE void francis(Work *w) {
    Index n = w->n, ld = w->ld;
    int turns[LANES] = {0};
    vec *t = w->t, zero = {0}, norm = w->norm;
    mask end = (mask){0} + (n - 1); /* last row of the active window of each lane, -1: done */
    for (Index last = n - 1;;) {
        mask low = {0};
        for (int deflated = 1; deflated;) { /* windows from low to end */
            deflated = 0;
            low = (mask){0};
            for (Index i = 1; i <= last; i++) {
                vec s = size(t[(i - 1) * ld + i - 1]) + size(t[i * ld + i]);
                mask small = size(t[i * ld + i - 1]) <= DBL_EPSILON * pick(s == 0, norm, s);
                t[i * ld + i - 1] = pick(small, zero, t[i * ld + i - 1]);
                mask here = small & ((mask){0} + i <= end);
                low = (here & i) | (~here & low);
            }
            for (int l = 0; l < LANES; l++) {
                int k = (int)end[l], width = k - (int)low[l];
                if (k < 0 || width > 1) continue;
                double x = t[k * ld + k][l];
                if (width == 0) w->re[k][l] = x, w->im[k][l] = 0.0;
                else two_roots(w, l, k, x, t[(k - 1) * ld + k - 1][l], t[k * ld + k - 1][l] * t[(k - 1) * ld + k][l]);
                end[l] -= width + 1;
                turns[l] = 0;
                deflated |= end[l] >= 0;
            }
        }
        Index first = n, lowest = n;
        last = -1;
        vec x = zero, y = zero, bc = zero, p0 = zero, q0 = zero, r0 = zero;
        for (int l = 0; l < LANES; l++) {
            int k = (int)end[l];
            if (k < 0) continue;
            if (turns[l]++ == LIMIT) { /* it does not converge */
                w->bad[l] = 1.0, end[l] = -1;
                continue;
            }
            if (k > last) last = k;
            if (low[l] < lowest) lowest = low[l];
            x[l] = t[k * ld + k][l];
            y[l] = t[(k - 1) * ld + k - 1][l];
            bc[l] = t[k * ld + k - 1][l] * t[(k - 1) * ld + k][l];
            if (turns[l] % 10 == 0) { /* an exceptional shift */
                double s = fabs(t[k * ld + k - 1][l]) + fabs(t[(k - 1) * ld + k - 2][l]);
                x[l] += 0.75 * s, y[l] = x[l], bc[l] = -0.4375 * s * s;
            }
        }
        if (last < 0) return;
        mask start = low, open = end >= 0; /* two small entries below the diagonal in a row: start behind them */
        for (Index m = last - 2; m >= lowest; m--) {
            mask here = open & ((mask){0} + m >= low) & ((mask){0} + m + 2 <= end);
            vec z = t[m * ld + m], below = t[(m + 1) * ld + m], a = x - z, b = y - z;
            vec pm = a * b - bc + t[m * ld + m + 1] * below; /* the first column of (H - x)(H - y), times below */
            vec qm = (t[(m + 1) * ld + m + 1] - z - a - b) * below, rm = t[(m + 2) * ld + m + 1] * below;
            mask stop = (mask){0} + m == low;
            if (m) {
                vec around = size(t[(m - 1) * ld + m - 1]) + size(z) + size(t[(m + 1) * ld + m + 1]);
                stop |= size(t[m * ld + m - 1]) * (size(qm) + size(rm)) <= DBL_EPSILON * size(pm) * around;
            }
            p0 = pick(here, pm, p0), q0 = pick(here, qm, q0), r0 = pick(here, rm, r0);
            start = (here & m) | (~here & start);
            open &= ~(here & stop);
            if (!any(open)) break;
        }
        vec sum = size(p0) + size(q0) + size(r0), shrink = 1.0 / larger(sum, all(TINY));
        p0 *= shrink, q0 *= shrink, r0 *= shrink;
        for (int l = 0; l < LANES; l++)
            if (end[l] >= 0 && start[l] < first) first = start[l];
        for (Index k = first; k < last; k++) {
            mask kk = (mask){0} + k, active = (start <= kk) & (kk < end), begins = kk == start, more = kk + 1 < end;
            vec p = p0, q = q0, r = r0;
            if (k > first) {
                p = pick(begins, p0, t[k * ld + k - 1]), q = pick(begins, q0, t[(k + 1) * ld + k - 1]);
                r = pick(begins, r0, t[(k + 2) * ld + k - 1]);
            }
            r = pick(more, r, zero);
            vec square = p * p + q * q + r * r;
            mask later = active & ~begins;
            active &= square > TINY; /* what is smaller counts as zero beside entries of at most 1 */
            vec g = with_sign(root(square), p);
            if (k > 0) {
                vec *edge = t + k * ld + k - 1;
                *edge = pick(active & later, -g, pick(active & begins & (low != start), -*edge, *edge));
                for (Index i = 1; i < 3; i++) edge[i * ld] = pick(later, zero, edge[i * ld]);
            }
            p += g;
            vec one = pick(active, 1.0 / g, zero), other = pick(active, 1.0 / p, zero);
            vec f0 = p * one, f1 = q * one, f2 = r * one, g1 = q * other, g2 = r * other;
            vec *t0 = t + k * ld, *t1 = t0 + ld, *t2 = t1 + ld;
            for (Index j = k; j <= last; j++) {
                vec f = t0[j] + g1 * t1[j] + g2 * t2[j];
                t0[j] -= f * f0, t1[j] -= f * f1, t2[j] -= f * f2;
            }
            for (Index i = k + 3 < last ? k + 3 : last; i >= lowest; i--) { /* what the next step reads comes first */
                vec *row = t + i * ld + k, f = f0 * row[0] + f1 * row[1] + f2 * row[2];
                row[0] -= f, row[1] -= f * g1, row[2] -= f * g2;
            }
        }
    }
}

#define TIMES_RE(ar, ai, br, bi) ((ar) * (br) - (ai) * (bi))
#define TIMES_IM(ar, ai, br, bi) ((ar) * (bi) + (ai) * (br))

/* H - lambda = L U with row exchanges; w->mr, w->mi the multipliers, w->pr, w->pi the reciprocals of the pivots */
INLINE void factor(Work *w, vec lr, vec li) {
    Index n = w->n, ld = w->ld;
    vec zero = {0}, least = DBL_EPSILON * w->norm;
    for (Index j = 0; j < n; j++) w->ur[j] = w->h[j] - (j ? zero : lr), w->ui[j] = j ? zero : -li;
    for (Index i = 0; i < n; i++) {
        vec *ar = w->ur + i * n, *ai = w->ui + i * n, *br = ar + n, *bi = ai + n;
        int more = i + 1 < n;
        vec sub = more ? w->h[(i + 1) * ld + i] : zero, cr = ar[i], ci = ai[i];
        mask swap = size(sub) > size(cr) + size(ci);
        vec qr = pick(swap, sub, cr), qi = pick(swap, zero, ci);
        mask none = size(qr) + size(qi) < least;
        qr = pick(none, least, qr), qi = pick(none, zero, qi);
        vec one = 1.0 / (qr * qr + qi * qi);
        vec pr = w->pr[i] = qr * one, pi = w->pi[i] = -qi * one;
        if (!more) return;
        vec or_ = pick(swap, cr, sub), oi = pick(swap, ci, zero);
        vec mr = w->mr[i] = TIMES_RE(or_, oi, pr, pi), mi = w->mi[i] = TIMES_IM(or_, oi, pr, pi);
        w->swap[i] = (vec)swap;
        for (Index j = i + 1; j < n; j++) {
            vec nr = w->h[(i + 1) * ld + j] - (j == i + 1 ? lr : zero), ni = j == i + 1 ? -li : zero;
            vec tr = pick(swap, nr, ar[j]), ti = pick(swap, ni, ai[j]);
            vec sr = pick(swap, ar[j], nr), si = pick(swap, ai[j], ni);
            ar[j] = tr, ai[j] = ti;
            br[j] = sr - TIMES_RE(mr, mi, tr, ti), bi[j] = si - TIMES_IM(mr, mi, tr, ti);
        }
    }
}

INLINE vec unit(vec *xr, vec *xi, int n) {
    vec sum = {0};
    for (Index i = 0; i < n; i++) sum += xr[i] * xr[i] + xi[i] * xi[i];
    vec length = root(sum), one = 1.0 / length;
    for (Index i = 0; i < n; i++) xr[i] *= one, xi[i] *= one;
    return length;
}

/* (H - lambda) x = x in place, from the factors; the first step begins behind the exchanges */
INLINE void solve_right(Work *w, vec *xr, vec *xi, int begin) {
    Index n = w->n;
    for (Index i = 0; !begin && i < n - 1; i++) {
        mask swap = (mask)w->swap[i];
        vec ar = pick(swap, xr[i + 1], xr[i]), ai = pick(swap, xi[i + 1], xi[i]);
        vec br = pick(swap, xr[i], xr[i + 1]), bi = pick(swap, xi[i], xi[i + 1]);
        xr[i] = ar, xi[i] = ai;
        xr[i + 1] = br - TIMES_RE(w->mr[i], w->mi[i], ar, ai), xi[i + 1] = bi - TIMES_IM(w->mr[i], w->mi[i], ar, ai);
    }
    for (Index i = n - 1; i >= 0; i--) {
        vec sr = xr[i], si = xi[i], *ur = w->ur + i * n, *ui = w->ui + i * n;
        for (Index j = n - 1; j > i; j--) /* what was found last comes last: the sums before it need not wait for it */
            sr -= TIMES_RE(ur[j], ui[j], xr[j], xi[j]), si -= TIMES_IM(ur[j], ui[j], xr[j], xi[j]);
        xr[i] = TIMES_RE(sr, si, w->pr[i], w->pi[i]), xi[i] = TIMES_IM(sr, si, w->pr[i], w->pi[i]);
    }
}

/* (H - lambda)' x = x in place */
INLINE void solve_left(Work *w, vec *xr, vec *xi) {
    Index n = w->n;
    for (Index i = 0; i < n; i++) {
        vec zr = TIMES_RE(xr[i], xi[i], w->pr[i], w->pi[i]), zi = TIMES_IM(xr[i], xi[i], w->pr[i], w->pi[i]);
        vec *ur = w->ur + i * n, *ui = w->ui + i * n;
        xr[i] = zr, xi[i] = zi;
        for (Index j = i + 1; j < n; j++)
            xr[j] -= TIMES_RE(ur[j], ui[j], zr, zi), xi[j] -= TIMES_IM(ur[j], ui[j], zr, zi);
    }
    for (Index i = n - 2; i >= 0; i--) {
        mask swap = (mask)w->swap[i];
        vec ar = xr[i] - TIMES_RE(w->mr[i], w->mi[i], xr[i + 1], xi[i + 1]);
        vec ai = xi[i] - TIMES_IM(w->mr[i], w->mi[i], xr[i + 1], xi[i + 1]);
        xr[i] = pick(swap, xr[i + 1], ar), xi[i] = pick(swap, xi[i + 1], ai);
        xr[i + 1] = pick(swap, ar, xr[i + 1]), xi[i + 1] = pick(swap, ai, xi[i + 1]);
    }
}

/* x = Q x, of the Hessenberg form to that of the balanced matrix */
INLINE void turn_back(Work *w, vec *x) {
    Index n = w->n;
    for (Index m = n - 2; m > 0; m--) {
        vec f = {0}, *v = w->v + m * n;
        for (Index i = m; i < n; i++) f += v[i] * x[i];
        f *= w->beta[m];
        for (Index i = m; i < n; i++) x[i] -= f * v[i];
    }
}

/* vectors of the eigenvalue lambda of each lane: x right, u left, x of length 1 and u x = 1 */
INLINE void vectors(Work *w, vec lr, vec li) {
    Index n = w->n;
    vec *xr = w->x, *xi = xr + n, *ur = w->u, *ui = ur + n, zero = {0};
    factor(w, lr, li);
    for (Index i = 0; i < n; i++) xr[i] = ur[i] = all(1.0), xi[i] = ui[i] = zero;
    solve_right(w, xr, xi, 1), unit(xr, xi, n);
    solve_right(w, xr, xi, 0);
    vec growth = unit(xr, xi, n);
    solve_left(w, ur, ui), unit(ur, ui, n);
    solve_left(w, ur, ui), unit(ur, ui, n);
    vec *parts[4] = {xr, xi, ur, ui};
    for (Index k = 0; k < 4; k++) turn_back(w, parts[k]);
    vec dr = zero, di = zero;
    for (Index i = 0; i < n; i++) dr += TIMES_RE(xr[i], xi[i], ur[i], ui[i]), di += TIMES_IM(xr[i], xi[i], ur[i], ui[i]);
    vec square = dr * dr + di * di;
    mask good = (square > ILL * ILL) & (growth * w->norm > GROWTH);
    w->bad = pick(good, w->bad, all(1.0));
    for (Index i = 0; i < n; i++) xr[i] *= w->d[i], xi[i] *= w->d[i], ur[i] /= w->d[i], ui[i] /= w->d[i];
    vec length = unit(xr, xi, n), one = length / square;
    dr *= one, di *= one; /* u / (u x) = u conj(u x) / |u x|^2 */
    for (Index i = 0; i < n; i++) {
        vec a = TIMES_RE(ur[i], ui[i], dr, -di), b = TIMES_IM(ur[i], ui[i], dr, -di);
        ur[i] = a, ui[i] = b;
    }
}

/* matrices of one group into lanes, scaled to entries of at most 1 */
INLINE void load(Work *w, const double *from, int count) {
    Index n = w->n, ld = w->ld;
    memset(w->h, 0, sizeof(vec) * (size_t)(ld * ld));
    const double *a[LANES];
    for (int l = 0; l < LANES; l++) a[l] = from + (size_t)(l < count ? l : 0) * n * n;
    vec most = {0}, shrink;
    mask finite = most == 0;
    for (Index i = 0; i < n; i++) {
        vec of_row = {0};
        for (Index j = 0; j < n; j++) {
            vec entry;
            for (int l = 0; l < LANES; l++) entry[l] = a[l][i * n + j];
            w->h[i * ld + j] = entry;
            finite &= size(entry) <= DBL_MAX;
            of_row = larger(size(entry), of_row);
        }
        most = larger(of_row, most);
    }
    w->bad = pick(finite, all(0.0), all(1.0));
    for (int l = 0; l < LANES; l++) {
        int power = 0;
        if (finite[l] && most[l] > 0) frexp(most[l], &power);
        power = power > 1000 ? 1000 : power < -1000 ? -1000 : power;
        w->scale[l] = ldexp(1.0, power), shrink[l] = ldexp(1.0, -power);
    }
    for (Index i = 0; i < n * ld; i++) w->h[i] = pick(finite, w->h[i] * shrink, all(0.0));
}

typedef struct { /* what is asked of m matrices of order n; complex numbers are two doubles */
    const double *matrices, *changes; /* changes: dA, or NULL */
    double *values, *slopes, *right, *left; /* NULL where not asked for */
    const double *weights, *ratio; /* (modes, n) and (3, n), or NULL */
    double *share, *steering; /* (m, modes, n), (m, n) */
    Py_ssize_t m;
    int n, modes;
} Job;

INLINE int before(const double *a, const double *b) { return a[0] < b[0] || (a[0] == b[0] && a[1] < b[1]); }

INLINE void store_values(Work *w, const Job *job, Py_ssize_t at, int l) {
    int n = w->n, sorted = !job->right && !job->share && !job->slopes;
    double *z = job->values + at * 2 * n;
    for (Index i = 0; i < n; i++) {
        double one[2] = {w->re[i][l] * w->scale[l], w->im[i][l] * w->scale[l]};
        int k = i; /* sorted where nothing stands beside them */
        for (; sorted && k > 0 && before(one, z + 2 * k - 2); k--) memcpy(z + 2 * k, z + 2 * k - 2, sizeof one);
        memcpy(z + 2 * k, one, sizeof one);
    }
}

/* vectors into column (right) and row (left) k of matrix at, and of the other half of a pair */
INLINE void store_vectors(Work *w, const Job *job, Py_ssize_t at, int l, int k, int pair) {
    Index n = w->n;
    double *right = job->right + at * 2 * n * n + 2 * k, *left = job->left + (at * n + k) * 2 * n;
    for (Index i = 0; i < n; i++) {
        double *r = right + i * 2 * n, *u = left + 2 * i;
        r[0] = w->x[i][l], r[1] = w->x[i + n][l], u[0] = w->u[i][l], u[1] = w->u[i + n][l];
        if (pair) r[2] = r[0], r[3] = -r[1], u[2 * n] = u[0], u[2 * n + 1] = -u[1];
    }
}

/* u dA x */
INLINE void store_slopes(Work *w, const Job *job, Py_ssize_t at, const int *place) {
    Index n = w->n;
    vec *xr = w->x, *xi = xr + n, *ur = w->u, *ui = ur + n, sr = {0}, si = {0}, zero = {0};
    for (Index i = 0; i < n; i++) {
        vec a = zero, b = zero, *row = w->change + i * n;
        for (Index j = 0; j < n; j++) a += row[j] * xr[j], b += row[j] * xi[j];
        sr += TIMES_RE(ur[i], ui[i], a, b), si += TIMES_IM(ur[i], ui[i], a, b);
    }
    for (int l = 0; l < LANES; l++) {
        int k = place[l];
        if (k < 0) continue;
        double *slope = job->slopes + ((at + l) * n + k) * 2;
        slope[0] = sr[l], slope[1] = si[l];
        if (w->im[k][l] > 0) slope[2] = sr[l], slope[3] = -si[l];
    }
}

/* sums of |u_i x_i| by weights, as shares of all; a|x| / (b|x| + c|x| / |lambda|) with the rows a, b, c of ratio */
INLINE void store_shares(Work *w, const Job *job, Py_ssize_t at, const int *place, vec lr, vec li) {
    Index n = w->n;
    vec *xr = w->x, *xi = xr + n, *ur = w->u, *ui = ur + n, total = {0}, part[3] = {{0}}, zero = {0};
    for (Index i = 0; i < n; i++) {
        vec x = root(xr[i] * xr[i] + xi[i] * xi[i]), both = x * root(ur[i] * ur[i] + ui[i] * ui[i]);
        for (Index k = 0; k < 3; k++) part[k] += job->ratio[k * n + i] * x;
        w->mr[i] = both, total += both;
    }
    vec one = 1.0 / total, angles = part[1] + part[2] / larger(root(lr * lr + li * li), all(DBL_MIN));
    vec steering = part[0] / larger(angles, all(DBL_MIN));
    for (Index mode = -1; mode < job->modes; mode++) {
        vec share = zero;
        for (Index i = 0; mode >= 0 && i < n; i++) share += job->weights[mode * n + i] * w->mr[i];
        share = mode < 0 ? steering : share * one;
        for (int l = 0; l < LANES; l++) {
            int k = place[l];
            if (k < 0) continue;
            double *to = mode < 0 ? job->steering + (at + l) * n : job->share + ((at + l) * job->modes + mode) * n;
            to[k] = share[l];
            if (w->im[k][l] > 0) to[k + 1] = share[l];
        }
    }
}

INLINE void eigenvectors(Work *w, const Job *job, Py_ssize_t at, int count) {
    int n = w->n, place[LANES], next[LANES] = {0};
    for (int l = 0; job->slopes && l < LANES; l++)
        for (Index i = 0; i < n * n; i++) w->change[i][l] = job->changes[(at + (l < count ? l : 0)) * n * n + i];
    for (Index i = 0; i < n; i++)
        for (Index j = 0; j < i; j++) {
            vec gap = size(w->re[i] - w->re[j]) + size(w->im[i] - w->im[j]);
            w->bad = pick(gap > GAP * w->norm, w->bad, all(1.0));
        }
    for (Index e = 0; e < n; e++) {
        vec lr, li, keep = w->bad;
        int busy = 0;
        for (int l = 0; l < LANES; l++) {
            while (next[l] < n && w->im[next[l]][l] < 0) next[l]++;
            place[l] = next[l] < n && l < count ? next[l]++ : -1;
            busy |= place[l] >= 0;
            int k = place[l] < 0 ? 0 : place[l];
            lr[l] = w->re[k][l], li[l] = w->im[k][l];
        }
        if (!busy) return;
        vectors(w, lr, li);
        if (job->share) store_shares(w, job, at, place, lr * w->scale, li * w->scale);
        if (job->slopes) store_slopes(w, job, at, place);
        for (int l = 0; l < LANES; l++) {
            int k = place[l];
            if (k < 0) w->bad[l] = keep[l]; /* no vector was asked of this lane */
            if (k < 0) continue;
            if (job->right) store_vectors(w, job, at + l, l, k, w->im[k][l] > 0);
        }
    }
}

INLINE Py_ssize_t run(Work *w, const Job *job) {
    Py_ssize_t failed = 0;
    Index n = w->n, ld = w->ld;
    for (Py_ssize_t at = 0; at < job->m; at += LANES) {
        int count = job->m - at < LANES ? (int)(job->m - at) : LANES;
        load(w, job->matrices + at * n * n, count);
        balance(w);
        reduce(w);
        memcpy(w->t, w->h, sizeof(vec) * (size_t)(ld * ld));
        vec norm = {0};
        for (Index i = 0; i < n; i++)
            for (Index j = 0; j < n; j++) norm = larger(norm, size(w->h[i * ld + j]));
        w->norm = pick(norm == 0, all(1.0), norm);
        francis(w);
        if (job->right || job->share || job->slopes) eigenvectors(w, job, at, count);
        for (int l = 0; l < count; l++) {
            store_values(w, job, at + l, l);
            if (w->bad[l] != 0) job->values[(at + l) * 2 * n] = NAN, failed++;
        }
    }
    return failed;
}

#define NAMES 6
#define PAIRS 16

typedef struct { /* score (j, m, p) of p pairs by j names at m points; best and other (m, p), where j is no name */
    const double *score;
    int64_t *best, *other;
    Py_ssize_t m;
    int p, j;
    double doubt;
} Naming;

/* Best joint naming of the pairs of each point, by the best sums of the earlier and later pairs over the sets of names
   that they take; other: the next best name of a pair where it lacks less than doubt. */
INLINE void name_pairs(const Naming *job) {
    int p = job->p, j = job->j, sets = 1 << j, every = sets - 1;
    vec before[PAIRS + 1][1 << NAMES], after[PAIRS + 1][1 << NAMES], score[PAIRS][NAMES], none = all(-INFINITY);
    for (Py_ssize_t at = 0; at < job->m; at += LANES) {
        int count = job->m - at < LANES ? (int)(job->m - at) : LANES;
        for (int l = 0; l < LANES; l++)
            for (int a = 0; a < j; a++)
                for (int k = 0; k < p; k++)
                    score[k][a][l] = job->score[(a * job->m + at + (l < count ? l : 0)) * p + k];
        for (int s = 0; s < sets; s++) before[0][s] = s ? none : all(0.0), after[p][s] = all(0.0);
        for (int turn = 0; turn < 2; turn++)
            for (int step = 0; step < p; step++) {
                int k = turn ? p - 1 - step : step;
                vec *from = turn ? after[k + 1] : before[k], *to = turn ? after[k] : before[k + 1];
                for (int s = 0; s < sets; s++) {
                    to[s] = from[s];
                    for (int a = 0; a < j; a++)
                        if (s >> a & 1) to[s] = larger(to[s], from[s & ~(1 << a)] + score[k][a]);
                }
            }
        for (int k = 0; k < p; k++) {
            vec total[NAMES + 1], top = none, next = none;
            mask first = {0}, second = {0};
            for (int a = 0; a <= j; a++) {
                int own = a < j ? 1 << a : 0;
                total[a] = none;
                for (int s = 0; s < sets; s++)
                    if (!(s & own)) total[a] = larger(total[a], before[k][s] + after[k + 1][every & ~s & ~own]);
                if (own) total[a] += score[k][a];
                mask more = total[a] > top;
                first = (more & a) | (~more & first);
                top = larger(total[a], top);
            }
            for (int a = 0; a < j; a++) {
                mask more = (total[a] > next) & (first != a);
                second = (more & a) | (~more & second);
                next = pick(more, total[a], next);
            }
            mask close = (first < j) & (next > top - job->doubt);
            second = (close & second) | (~close & j);
            for (int l = 0; l < count; l++)
                job->best[(at + l) * p + k] = first[l], job->other[(at + l) * p + k] = second[l];
        }
    }
}

/* the same for processors of every width */
static Py_ssize_t run_plain(Work *w, const Job *job) { return run(w, job); }
static void name_plain(const Naming *job) { name_pairs(job); }
#ifdef CHOICE
#define AVX2 __attribute__((target("avx2,fma")))
AVX2 static Py_ssize_t run_avx2(Work *w, const Job *job) { return run(w, job); }
AVX2 static void name_avx2(const Naming *job) { name_pairs(job); }
#endif

static Py_ssize_t (*run_chosen)(Work *, const Job *) = run_plain;
static void (*name_chosen)(const Naming *) = name_plain;
static const char *width = "plain";

static void choose(void) {
    const char *asked = getenv("VELOTYRE_KERNEL");
    if (asked && !strcmp(asked, "plain")) return;
#ifdef CHOICE
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        run_chosen = run_avx2, name_chosen = name_avx2, width = "AVX2";
#endif
}

static Py_ssize_t work_through(const Job *job) {
    int n = job->n, ld = n + 1;
    size_t square = (size_t)(ld * ld), total = 2 * square + (size_t)(4 * n * n + 14 * n + 8);
    char *memory = calloc(total + 1, sizeof(vec));
    if (!memory) return -1;
    vec *next = (vec *)(((uintptr_t)memory + sizeof(vec) - 1) / sizeof(vec) * sizeof(vec));
    Work w = {.n = n, .ld = ld};
    struct { vec **part; size_t length; } parts[] = {
        {&w.h, square}, {&w.t, square}, {&w.v, (size_t)(n * n)}, {&w.change, (size_t)(n * n)},
        {&w.ur, (size_t)(n * n)}, {&w.ui, (size_t)(n * n)},
        {&w.d, n}, {&w.beta, n}, {&w.re, n}, {&w.im, n}, {&w.pr, n}, {&w.pi, n}, {&w.mr, n}, {&w.mi, n},
        {&w.x, 2 * n}, {&w.u, 2 * n}, {&w.swap, n},
    };
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) *parts[k].part = next, next += parts[k].length;
    Py_ssize_t failed = run_chosen(&w, job);
    free(memory);
    return failed;
}

enum { MATRICES, VALUES, CHANGES, SLOPES, RIGHT, LEFT, WEIGHTS, SHARE, RATIO, STEERING, ARRAYS };

/* What the arrays must hold is checked here; those of each line below belong together. */
static PyObject *solve(PyObject *module, PyObject *args) {
    PyObject *given[ARRAYS], *result = NULL;
    Py_buffer b[ARRAYS];
    int held = 0, n;
    (void)module;
    memset(b, 0, sizeof b);
    for (int k = 0; k < ARRAYS; k++) given[k] = Py_None;
    if (!PyArg_ParseTuple(args, "iOO|OOOOOOOO", &n, given, given + 1, given + 2, given + 3, given + 4, given + 5,
                          given + 6, given + 7, given + 8, given + 9))
        return NULL;
    if (n < 1 || n > MOST) return PyErr_Format(PyExc_ValueError, "order %d; give 1 to %d", n, MOST);
    Py_ssize_t m = 0, modes = 0, row = 8 * n;
    for (; held < ARRAYS; held++) {
        int output = held == VALUES || held == SLOPES || held == RIGHT || held == LEFT || held == SHARE || held == STEERING;
        if (given[held] == Py_None) continue;
        if (PyObject_GetBuffer(given[held], b + held, PyBUF_C_CONTIGUOUS | (output ? PyBUF_WRITABLE : 0))) goto done;
        if (held == MATRICES) m = b[held].len / (row * n);
        if (held == WEIGHTS) modes = b[held].len / row;
        Py_ssize_t wanted[ARRAYS] = {m * n * row, 2 * m * row, m * n * row, 2 * m * row, 2 * m * n * row,
                                     2 * m * n * row, modes * row, m * modes * row, 3 * row, m * row};
        if (b[held].len != wanted[held]) {
            PyErr_Format(PyExc_ValueError, "array %d has %zd bytes, not %zd", held, b[held].len, wanted[held]);
            held++;
            goto done;
        }
    }
    int there[ARRAYS];
    for (int k = 0; k < ARRAYS; k++) there[k] = given[k] != Py_None;
    if (!there[MATRICES] || !there[VALUES] || there[RIGHT] != there[LEFT] ||
        there[SLOPES] != there[CHANGES] || there[SHARE] != there[WEIGHTS] || there[SHARE] != there[RATIO] ||
        there[SHARE] != there[STEERING]) {
        PyErr_SetString(PyExc_ValueError, "some arrays are missing that belong to others");
        goto done;
    }
    Job job = {
        .matrices = b[MATRICES].buf, .values = b[VALUES].buf, .changes = b[CHANGES].buf, .slopes = b[SLOPES].buf,
        .right = b[RIGHT].buf, .left = b[LEFT].buf, .weights = b[WEIGHTS].buf, .share = b[SHARE].buf,
        .ratio = b[RATIO].buf, .steering = b[STEERING].buf, .m = m, .n = n, .modes = (int)modes,
    };
    Py_ssize_t failed;
    Py_BEGIN_ALLOW_THREADS
    failed = work_through(&job);
    Py_END_ALLOW_THREADS
    result = failed < 0 ? PyErr_NoMemory() : PyLong_FromSsize_t(failed);
done:
    for (int k = 0; k < held; k++)
        if (b[k].obj) PyBuffer_Release(b + k);
    return result;
}

static PyObject *assign(PyObject *module, PyObject *args) {
    PyObject *given[3], *result = NULL;
    Py_buffer b[3];
    int held = 0, p, j;
    double doubt;
    (void)module;
    if (!PyArg_ParseTuple(args, "iidOOO", &p, &j, &doubt, given, given + 1, given + 2)) return NULL;
    if (p < 1 || p > PAIRS || j < 1 || j > NAMES) return PyErr_Format(PyExc_ValueError, "%d pairs, %d names", p, j);
    for (; held < 3; held++)
        if (PyObject_GetBuffer(given[held], b + held, PyBUF_C_CONTIGUOUS | (held ? PyBUF_WRITABLE : 0))) goto done;
    Py_ssize_t m = b[1].len / (8 * p);
    if (b[0].len != 8 * m * p * j || b[1].len != 8 * m * p || b[2].len != b[1].len) {
        PyErr_SetString(PyExc_ValueError, "score has shape (names, points, pairs), best and other (points, pairs)");
        goto done;
    }
    Naming job = {b[0].buf, b[1].buf, b[2].buf, m, p, j, doubt};
    Py_BEGIN_ALLOW_THREADS
    name_chosen(&job);
    Py_END_ALLOW_THREADS
    Py_INCREF(Py_None);
    result = Py_None;
done:
    for (int k = 0; k < held; k++) PyBuffer_Release(b + k);
    return result;
}

static PyMethodDef methods[] = {
    {"solve", solve, METH_VARARGS,
     "solve(n, matrices, values, changes, slopes, right, left, weights, share, ratio, steering): how many matrices failed"},
    {"assign", assign, METH_VARARGS, "assign(pairs, names, doubt, score, best, other): fill in the best joint names."},
    {NULL, NULL, 0, NULL},
};
static struct PyModuleDef definition = {PyModuleDef_HEAD_INIT, "_kernel", NULL, -1, methods, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__kernel(void) {
    PyObject *module = PyModule_Create(&definition);
    choose();
    if (module && PyModule_AddStringConstant(module, "width", width)) Py_DECREF(module), module = NULL;
    if (module && PyModule_AddIntConstant(module, "most", MOST)) Py_DECREF(module), module = NULL;
    return module;
}
