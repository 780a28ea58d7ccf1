/* dense.c - products, Cholesky's factors and what they solve.
 *
 * Inner loops run along rows, where nothing is summed up; products, which take most of the time,
 * keep their sums in registers two at a time.  No sum is reordered: the same bits everywhere. */
#include "optics/dense.h"

#include <math.h>
#include <string.h>

/* Two numbers worked on as one, which every x86-64 and ARM64 can; gcc and clang do it by hand
 * elsewhere. */
typedef double pair __attribute__((vector_size(16)));

/* y += f x */
static void add_row(ptrdiff_t n, double f, const double *restrict x, double *restrict y)
{
    for (ptrdiff_t j = 0; j < n; j++)
        y[j] += f * x[j];
}

static void clear(ptrdiff_t n, double *x)
{
    memset(x, 0, (size_t)n * sizeof *x);
}

/* Two rows and four columns of a product, C[r][c] = sum over k of f[k step + r row] x[k n + c], in
 * registers. */
static void sum_block(ptrdiff_t n, const double *f, ptrdiff_t row, ptrdiff_t step, const double *x,
                      double *C)
{
    pair a0 = { 0.0 }, a1 = { 0.0 }, b0 = { 0.0 }, b1 = { 0.0 };
    for (ptrdiff_t k = 0; k < n; k++) {
        pair x0, x1;
        memcpy(&x0, x + k * n, sizeof x0);
        memcpy(&x1, x + k * n + 2, sizeof x1);
        double a = f[k * step], b = f[k * step + row];
        a0 += a * x0;
        a1 += a * x1;
        b0 += b * x0;
        b1 += b * x1;
    }
    memcpy(C, &a0, sizeof a0);
    memcpy(C + 2, &a1, sizeof a1);
    memcpy(C + n, &b0, sizeof b0);
    memcpy(C + n + 2, &b1, sizeof b1);
}

void dense_multiply(ptrdiff_t n, const double *A, const double *B, double *C)
{
    for (ptrdiff_t i = 0; i < n; i += 2)
        for (ptrdiff_t j = 0; j < n; j += 4)
            sum_block(n, A + i * n, n, 1, B + j, C + i * n + j);
}

void dense_gram(ptrdiff_t n, const double *A, double *C)
{
    for (ptrdiff_t i = 0; i < n; i += 2)
        for (ptrdiff_t j = i & ~3; j < n; j += 4)
            sum_block(n, A + i, 1, n, A + j, C + i * n + j);
    for (ptrdiff_t i = 1; i < n; i++)
        for (ptrdiff_t j = 0; j < i; j++)
            C[i * n + j] = C[j * n + i];
}

void dense_factor(ptrdiff_t n, double least, double *A)
{
    for (ptrdiff_t k = 0; k < n; k++) {
        double *row = A + k * n;
        double root = sqrt(fmax(row[k], least)), over = 1.0 / root;
        clear(k, row);
        row[k] = root;
        for (ptrdiff_t j = k + 1; j < n; j++)
            row[j] *= over;
        for (ptrdiff_t i = k + 1; i < n; i++)
            add_row(n - i, -row[i], row + i, A + i * n + i);
    }
}

void dense_solve(ptrdiff_t n, const double *U, double *x)
{
    for (ptrdiff_t k = 0; k < n; k++) {
        x[k] /= U[k * n + k];
        for (ptrdiff_t j = k + 1; j < n; j++)
            x[j] -= x[k] * U[k * n + j];
    }
    for (ptrdiff_t k = n - 1; k >= 0; k--) {
        double sum = x[k];
        for (ptrdiff_t j = k + 1; j < n; j++)
            sum -= U[k * n + j] * x[j];
        x[k] = sum / U[k * n + k];
    }
}

void dense_inverse(ptrdiff_t n, const double *U, double *X)
{
    clear(n * n, X);
    for (ptrdiff_t k = 0; k < n; k++) { /* U^T Y = 1: row k of Y ends at the diagonal */
        X[k * n + k] = 1.0;
        for (ptrdiff_t i = 0; i < k; i++)
            add_row(i + 1, -U[i * n + k], X + i * n, X + k * n);
        double over = 1.0 / U[k * n + k];
        for (ptrdiff_t j = 0; j <= k; j++)
            X[k * n + j] *= over;
    }
    for (ptrdiff_t k = n - 1; k >= 0; k--) { /* U X = Y */
        for (ptrdiff_t i = k + 1; i < n; i++)
            add_row(n, -U[k * n + i], X + i * n, X + k * n);
        double over = 1.0 / U[k * n + k];
        for (ptrdiff_t j = 0; j < n; j++)
            X[k * n + j] *= over;
    }
}

void dense_apply(ptrdiff_t n, const double *A, const double *x, double *y)
{
    for (ptrdiff_t i = 0; i < n; i++) {
        double sum = 0.0;
        for (ptrdiff_t j = 0; j < n; j++)
            sum += A[i * n + j] * x[j];
        y[i] = sum;
    }
}

void dense_apply_transposed(ptrdiff_t n, const double *A, const double *x, double *y)
{
    clear(n, y);
    for (ptrdiff_t i = 0; i < n; i++)
        add_row(n, x[i], A + i * n, y);
}
