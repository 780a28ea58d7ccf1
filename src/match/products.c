/* products.c - eight partial sums a pair, added up in one order: halves, quarters, two. */
#include "match/products.h"

#include <string.h>

/* Understood by gcc and clang alike; as many registers as it takes. */
typedef double lanes __attribute__((vector_size(PRODUCTS_LANES * sizeof(double))));
typedef double half __attribute__((vector_size(PRODUCTS_LANES / 2 * sizeof(double))));
typedef double quarter __attribute__((vector_size(PRODUCTS_LANES / 4 * sizeof(double))));

/* Into each of the targets below, so that it is compiled for its vectors. */
#define INLINE static inline __attribute__((always_inline))

INLINE void pairs(const double *const *row, size_t rows, size_t length, double *sum)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t j = 0; j <= i; j++) {
            lanes part = { 0 }, a, b;
            half h[2];
            quarter q[2];
            for (size_t k = 0; k < length; k += PRODUCTS_LANES) {
                memcpy(&a, row[i] + k, sizeof a);
                memcpy(&b, row[j] + k, sizeof b);
                part += a * b;
            }
            memcpy(h, &part, sizeof h);
            h[0] += h[1];
            memcpy(q, h, sizeof q);
            q[0] += q[1];
            *sum++ = q[0][0] + q[0][1];
        }
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
