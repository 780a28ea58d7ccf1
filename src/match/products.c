/* products.c - eight partial sums a pair, added up in one order: halves, quarters, two. */
#include "match/products.h"

#include <string.h>

/* Understood by gcc and clang alike; as many registers as it takes. */
typedef double lanes __attribute__((vector_size(PRODUCTS_LANES * sizeof(double))));
typedef double half __attribute__((vector_size(PRODUCTS_LANES / 2 * sizeof(double))));
typedef double quarter __attribute__((vector_size(PRODUCTS_LANES / 4 * sizeof(double))));

/* Into each of the targets below, so that it is compiled for its vectors. */
#define INLINE static inline __attribute__((always_inline))
#define UNROLLED _Pragma("GCC unroll 64")

INLINE double add_up(const lanes *part)
{
    half h[2];
    quarter q[2];
    memcpy(h, part, sizeof h);
    h[0] += h[1];
    memcpy(q, h, sizeof q);
    q[0] += q[1];
    return q[0][0] + q[0][1];
}

/* For a constant number of rows: the sums of all pairs stay in registers. */
INLINE void pairs_at_once(const double *const *row, size_t rows, size_t length, double *sum)
{
    lanes part[PRODUCTS_ROWS * (PRODUCTS_ROWS + 1) / 2], at[PRODUCTS_ROWS];
    UNROLLED
    for (size_t p = 0; p < rows * (rows + 1) / 2; p++)
        part[p] = (lanes){ 0 };
    for (size_t k = 0; k < length; k += PRODUCTS_LANES)
        UNROLLED
    for (size_t i = 0; i < rows; i++) {
        memcpy(&at[i], row[i] + k, sizeof at[i]);
        UNROLLED
        for (size_t j = 0; j <= i; j++)
            part[i * (i + 1) / 2 + j] += at[i] * at[j];
    }
    UNROLLED
    for (size_t p = 0; p < rows * (rows + 1) / 2; p++)
        sum[p] = add_up(&part[p]);
}

INLINE void pairs_one_by_one(const double *const *row, size_t rows, size_t length, double *sum)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j <= i; j++) {
            lanes part = { 0 }, a, b;
            for (size_t k = 0; k < length; k += PRODUCTS_LANES) {
                memcpy(&a, row[i] + k, sizeof a);
                memcpy(&b, row[j] + k, sizeof b);
                part += a * b;
            }
            *sum++ = add_up(&part);
        }
}

/* What is left, with the derivatives of three and of five parameters: the usual fits. */
INLINE void pairs(const double *const *row, size_t rows, size_t length, double *sum)
{
    if (rows == 4)
        pairs_at_once(row, 4, length, sum);
    else if (rows == 6)
        pairs_at_once(row, 6, length, sum);
    else
        pairs_one_by_one(row, rows, length, sum);
}

static void pairs_plain(const double *const *row, size_t rows, size_t length, double *sum)
{
    pairs(row, rows, length, sum);
}

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2"))) static void pairs_avx2(const double *const *row, size_t rows,
                                                       size_t length, double *sum)
{
    pairs(row, rows, length, sum);
}

__attribute__((target("avx512f"))) static void pairs_avx512(const double *const *row, size_t rows,
                                                            size_t length, double *sum)
{
    pairs(row, rows, length, sum);
}

void products(const double *const *row, size_t rows, size_t length, double *sum)
{
    if (__builtin_cpu_supports("avx512f"))
        pairs_avx512(row, rows, length, sum);
    else if (__builtin_cpu_supports("avx2"))
        pairs_avx2(row, rows, length, sum);
    else
        pairs_plain(row, rows, length, sum);
}
#else
void products(const double *const *row, size_t rows, size_t length, double *sum)
{
    pairs_plain(row, rows, length, sum);
}
#endif
