#pragma once

/// Compiles a function also for AVX2, chosen at run time: for plain loops over pixels, whose vectors are
/// wider then. Without fused multiply-add, so that both versions compute the same. Sanitizers do not support
/// it.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define VCHARGE_WIDE_LOOPS __attribute__((target_clones("avx2", "default")))
#else
#define VCHARGE_WIDE_LOOPS
#endif
