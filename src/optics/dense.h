/* dense.h - the few things the transport models do with small square matrices.
 *
 * n rows of n, one after the other; n is a multiple of 4 and some tens at most. */
#ifndef SKINSPEC_OPTICS_DENSE_H
#define SKINSPEC_OPTICS_DENSE_H

#include <stddef.h>

/* C = A B.  C is neither A nor B. */
void dense_multiply(ptrdiff_t n, const double *A, const double *B, double *C);

/* C = A^T A, both halves. */
void dense_gram(ptrdiff_t n, const double *A, double *C);

/* U with U^T U = A for a positive symmetric A of which the upper half is read; U takes its place,
 * with zeros below.  Exact A would have no pivot below `least`; where rounding makes one, it is put
 * right. */
void dense_factor(ptrdiff_t n, double least, double *A);

/* x = (U^T U)^-1 x. */
void dense_solve(ptrdiff_t n, const double *U, double *x);

/* X = (U^T U)^-1, both halves.  X is not U. */
void dense_inverse(ptrdiff_t n, const double *U, double *X);

/* y = A x and y = A^T x.  y is not x. */
void dense_apply(ptrdiff_t n, const double *A, const double *x, double *y);
void dense_apply_transposed(ptrdiff_t n, const double *A, const double *x, double *y);

#endif
