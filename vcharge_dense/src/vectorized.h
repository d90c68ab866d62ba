#pragma once

/// Marks a free function whose loops the compiler vectorizes: on x86-64 with GCC it is compiled for several
/// instruction sets, and the loader picks the best one that the machine has. Only plain pointers and numbers
/// cross its interface.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define VCHARGE_VECTORIZED __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VCHARGE_VECTORIZED
#endif
