/* products.h - sums of products of rows, for normal equations: all pairs in one go, by whatever
 * vectors the processor has, to the same bits with any of them. */
#ifndef SKINSPEC_MATCH_PRODUCTS_H
#define SKINSPEC_MATCH_PRODUCTS_H

#include <stddef.h>

/* Rows are so many doubles long, filled up with zeros. */
enum { PRODUCTS_LANES = 8, PRODUCTS_ROWS = 8 };

/* sum[i (i+1)/2 + j] = sum over k of row[i][k] row[j][k], j <= i < rows <= PRODUCTS_ROWS;
 * length is a multiple of PRODUCTS_LANES. */
void products(const double *const *row, size_t rows, size_t length, double *sum);

#endif
