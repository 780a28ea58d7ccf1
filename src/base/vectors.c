/* vectors.c - what the processor has. */
#include "base/vectors.h"

#if defined(__x86_64__) && defined(__GNUC__)
bool vectors_has(enum vectors v)
{
    return v == VECTORS_PLAIN ||
           (v == VECTORS_WITH_AVX2 && __builtin_cpu_supports("avx2") &&
            __builtin_cpu_supports("fma")) ||
           (v == VECTORS_WITH_AVX512 && __builtin_cpu_supports("avx512f") &&
            __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"));
}
#else
bool vectors_has(enum vectors v)
{
    return v == VECTORS_PLAIN;
}
#endif

enum vectors vectors_best(void)
{
    return vectors_has(VECTORS_WITH_AVX512) ? VECTORS_WITH_AVX512
           : vectors_has(VECTORS_WITH_AVX2) ? VECTORS_WITH_AVX2
                                            : VECTORS_PLAIN;
}
