/* vectors.h - loops that the compiler makes vectors of, for the widest that the processor has.
 *
 * A function that loops over lanes is written once, inlined into one function for each kind of
 * vectors (VECTORS_INLINE, VECTORS_AVX2, VECTORS_AVX512), and called by what vectors_best()
 * says.  `fused`, a constant where it is passed, is set for both: the processor then multiplies
 * and adds with one rounding, in either the same (docs/decisions/0012). */
#ifndef SKINSPEC_BASE_VECTORS_H
#define SKINSPEC_BASE_VECTORS_H

#include <math.h>
#include <stdbool.h>

enum vectors { VECTORS_PLAIN, VECTORS_WITH_AVX2, VECTORS_WITH_AVX512, VECTORS_KINDS };

bool vectors_has(enum vectors v);
enum vectors vectors_best(void);

/* Doubles of the widest: rows are padded to it and looped over by it. */
enum { VECTORS_LANES = 8 };

#define VECTORS_INLINE static inline __attribute__((always_inline))

/* Before a loop whose rows do not overlap, which the compiler would else ask. */
#if defined(__clang__)
#define VECTORS_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define VECTORS_WIDE "fma,avx512f,avx512dq,avx512vl"
#else
#define VECTORS_LOOP _Pragma("GCC ivdep")
#define VECTORS_WIDE "fma,avx512f,avx512dq,avx512vl,prefer-vector-width=512"
#endif

#if defined(__x86_64__) && defined(__GNUC__)
#define VECTORS_AVX2 __attribute__((target("avx2,fma")))
#define VECTORS_AVX512 __attribute__((target(VECTORS_WIDE)))
#else
#define VECTORS_AVX2
#define VECTORS_AVX512
#endif

/* a b + c */
VECTORS_INLINE double vectors_sum(bool fused, double a, double b, double c)
{
    return fused ? fma(a, b, c) : a * b + c;
}

#endif
