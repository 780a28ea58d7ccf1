/* dense.c - products, Cholesky's factors and what they solve. */
#include "optics/dense.h"

#include <math.h>
#include <string.h>

/* y += f x */
static void add_row(int n, double f, const double *restrict x, double *restrict y)
{
    for (int j = 0; j < n; j++)
        y[j] += f * x[j];
}

static void clear(int n, double *x)
{
    memset(x, 0, (size_t)n * sizeof *x);
}

void dense_multiply(int n, const double *A, const double *B, double *C)
{
    for (int i = 0; i < n; i++) {
        clear(n, C + i * n);
        for (int k = 0; k < n; k++)
            add_row(n, A[i * n + k], B + k * n, C + i * n);
    }
}

void dense_gram(int n, const double *A, double *C)
{
    clear(n * n, C);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++)
            add_row(n - i, A[k * n + i], A + k * n + i, C + i * n + i);
    for (int i = 1; i < n; i++)
        for (int j = 0; j < i; j++)
            C[i * n + j] = C[j * n + i];
}

void dense_cholesky(int n, double least, double *A)
{
    for (int k = 0; k < n; k++) {
        double *row = A + k * n;
        double root = sqrt(fmax(row[k], least));
        /* A pivot of 0 belongs to a row of zeros. */
        double over = root > 0.0 ? 1.0 / root : 0.0;
        clear(k, row);
        row[k] = root;
        for (int j = k + 1; j < n; j++)
            row[j] *= over;
        for (int i = k + 1; i < n; i++)
            add_row(n - i, -row[i], row + i, A + i * n + i);
    }
}

void dense_solve(int n, const double *U, double *x)
{
    for (int k = 0; k < n; k++) {
        x[k] /= U[k * n + k];
        for (int j = k + 1; j < n; j++)
            x[j] -= x[k] * U[k * n + j];
    }
    for (int k = n - 1; k >= 0; k--) {
        double sum = x[k];
        for (int j = k + 1; j < n; j++)
            sum -= U[k * n + j] * x[j];
        x[k] = sum / U[k * n + k];
    }
}

void dense_inverse(int n, const double *U, double *X)
{
    clear(n * n, X);
    for (int k = 0; k < n; k++) { /* U^T Y = 1: row k of Y ends at the diagonal */
        X[k * n + k] = 1.0;
        for (int i = 0; i < k; i++)
            add_row(i + 1, -U[i * n + k], X + i * n, X + k * n);
        double over = 1.0 / U[k * n + k];
        for (int j = 0; j <= k; j++)
            X[k * n + j] *= over;
    }
    for (int k = n - 1; k >= 0; k--) { /* U X = Y */
        for (int i = k + 1; i < n; i++)
            add_row(n, -U[k * n + i], X + i * n, X + k * n);
        double over = 1.0 / U[k * n + k];
        for (int j = 0; j < n; j++)
            X[k * n + j] *= over;
    }
}

void dense_apply(int n, const double *A, const double *x, double *y)
{
    for (int i = 0; i < n; i++) {
        double sum = 0.0;
        for (int j = 0; j < n; j++)
            sum += A[i * n + j] * x[j];
        y[i] = sum;
    }
}

void dense_apply_transposed(int n, const double *A, const double *x, double *y)
{
    clear(n, y);
    for (int i = 0; i < n; i++)
        add_row(n, x[i], A + i * n, y);
}
