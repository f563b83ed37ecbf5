/* Sonarfix as portable C, for processors and ABIs without a compiled library. Made from the Rust source: do not edit.
 *
 * It computes the same bits as the compiled library, if the compiler rounds each operation by itself: GCC needs
 * -ffp-contract=off, which this file sets for itself. Every handle's initialization checks it. */
#include <stddef.h>
#include <stdint.h>

#include "sonarfix.h"

#if defined(__AVR__)
#error "Sonarfix needs a processor of 32 bits: an AVR has not enough memory"
#elif UINTPTR_MAX != 0xffffffffu
#error "the portable source is for pointers of 32 bits: link the compiled library"
#elif defined(__FAST_MATH__)
#error "-ffast-math changes the results"
#elif defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "the portable source is for little-endian processors"
#elif defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "float must be computed as float: on x86 compile with -msse2 -mfpmath=sse"
#endif

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

typedef uint8_t u8;
typedef uint16_t u16;
typedef uint32_t u32;
typedef int8_t s8;
typedef int16_t s16;
typedef int32_t s32;
typedef uint64_t u64;
typedef int64_t s64;
typedef float f32;
typedef double f64;

#define ADDRESS(pointer) ((u32)(uintptr_t)(pointer))
#define CONSTANT(at) ((u32)(uintptr_t)((const u8 *)constants + (at)))
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define LIKELY(x) __builtin_expect(!!(x), 1)
#define UNLIKELY(x) __builtin_expect(!!(x), 0)

/* Loads and stores. A word is aligned to four bytes, a half word to two; numbers of 64 bits are two words. */
#define DEFINE_ALIASED(name, type, bytes) \
    typedef type __attribute__((may_alias, aligned(bytes))) name
DEFINE_ALIASED(u8_at, u8, 1);
DEFINE_ALIASED(s8_at, s8, 1);
DEFINE_ALIASED(u16_at, u16, 2);
DEFINE_ALIASED(s16_at, s16, 2);
DEFINE_ALIASED(u32_at, u32, 4);
DEFINE_ALIASED(s32_at, s32, 4);
DEFINE_ALIASED(u64_at, u64, 4);
DEFINE_ALIASED(f32_at, f32, 4);
DEFINE_ALIASED(f64_at, f64, 4);

#define DEFINE_LOAD(name, memory, sign, result)                                              \
    static inline result name(u32 address) {                                                 \
        return (result)(sign)*(const memory##_at *)(uintptr_t)address;                       \
    }                                                                                        \
    static inline result name##_unaligned(u32 address) {                                     \
        memory value;                                                                        \
        __builtin_memcpy(&value, (const u8 *)(uintptr_t)address, sizeof value);                        \
        return (result)(sign)value;                                                          \
    }
#define DEFINE_STORE(name, memory, type)                                                     \
    static inline void name(u32 address, type value) {                                       \
        *(memory##_at *)(uintptr_t)address = (memory)value;                                  \
    }                                                                                        \
    static inline void name##_unaligned(u32 address, type value) {                           \
        memory narrow = (memory)value;                                                       \
        __builtin_memcpy((u8 *)(uintptr_t)address, &narrow, sizeof narrow);                            \
    }
DEFINE_LOAD(i32_load, u32, u32, u32)
DEFINE_LOAD(i64_load, u64, u64, u64)
DEFINE_LOAD(f32_load, f32, f32, f32)
DEFINE_LOAD(f64_load, f64, f64, f64)
DEFINE_LOAD(i32_load8_s, s8, s32, u32)
DEFINE_LOAD(i64_load8_s, s8, s64, u64)
DEFINE_LOAD(i32_load8_u, u8, u32, u32)
DEFINE_LOAD(i64_load8_u, u8, u64, u64)
DEFINE_LOAD(i32_load16_s, s16, s32, u32)
DEFINE_LOAD(i64_load16_s, s16, s64, u64)
DEFINE_LOAD(i32_load16_u, u16, u32, u32)
DEFINE_LOAD(i64_load16_u, u16, u64, u64)
DEFINE_LOAD(i64_load32_s, s32, s64, u64)
DEFINE_LOAD(i64_load32_u, u32, u64, u64)
DEFINE_STORE(i32_store, u32, u32)
DEFINE_STORE(i64_store, u64, u64)
DEFINE_STORE(f32_store, f32, f32)
DEFINE_STORE(f64_store, f64, f64)
DEFINE_STORE(i32_store8, u8, u32)
DEFINE_STORE(i32_store16, u16, u32)
DEFINE_STORE(i64_store8, u8, u64)
DEFINE_STORE(i64_store16, u16, u64)
DEFINE_STORE(i64_store32, u32, u64)

static inline void memory_copy(u32 to, u32 from, u32 count) {
    __builtin_memmove((void *)(uintptr_t)to, (const void *)(uintptr_t)from, count);
}
static inline void memory_fill(u32 to, u32 value, u32 count) {
    __builtin_memset((void *)(uintptr_t)to, (int)value, count);
}

/* Numbers, as WebAssembly defines them. */
static inline u32 i32_reinterpret_f32(f32 x) { u32 y; __builtin_memcpy(&y, &x, sizeof y); return y; }
static inline f32 f32_reinterpret_i32(u32 x) { f32 y; __builtin_memcpy(&y, &x, sizeof y); return y; }
static inline u64 i64_reinterpret_f64(f64 x) { u64 y; __builtin_memcpy(&y, &x, sizeof y); return y; }
static inline f64 f64_reinterpret_i64(u64 x) { f64 y; __builtin_memcpy(&y, &x, sizeof y); return y; }
static inline f32 wasm_fabsf(f32 x) { return f32_reinterpret_i32(i32_reinterpret_f32(x) & 0x7fffffffu); }
static inline f32 wasm_quietf(f32 x) { return x; }
static inline f64 wasm_quiet(f64 x) { return x; }
#define copysignf __builtin_copysignf
static inline f32 wasm_sqrtf(f32 x) { return __builtin_sqrtf(x); }
static inline f32 wasm_floorf(f32 x) { return __builtin_floorf(x); }
static inline f32 wasm_ceilf(f32 x) { return __builtin_ceilf(x); }
static inline f32 wasm_truncf(f32 x) { return __builtin_truncf(x); }
static inline f64 wasm_sqrt(f64 x) { return __builtin_sqrt(x); }

#define TRAP(reason) (__builtin_trap(), 0u)
#define UNREACHABLE __builtin_trap()
#define I32_CLZ(x) ((x) ? (u32)__builtin_clzl(x) : 32u)
#define I64_CLZ(x) ((x) ? (u64)__builtin_clzll(x) : 64u)
#define I32_CTZ(x) ((x) ? (u32)__builtin_ctzl(x) : 32u)
#define I64_CTZ(x) ((x) ? (u64)__builtin_ctzll(x) : 64u)
#define I32_POPCNT(x) ((u32)__builtin_popcountl(x))
#define I64_POPCNT(x) ((u64)__builtin_popcountll(x))
#define DIV_U(x, y) (UNLIKELY((y) == 0) ? TRAP(DIV_BY_ZERO) : (x) / (y))
#define REM_U(x, y) (UNLIKELY((y) == 0) ? TRAP(DIV_BY_ZERO) : (x) % (y))
#define I32_DIV_S(x, y) ((u32)((s32)(x) / (s32)(y)))
#define I32_REM_S(x, y) ((u32)((s32)(x) % (s32)(y)))
#define I64_DIV_S(x, y) ((u64)((s64)(x) / (s64)(y)))
#define I64_REM_S(x, y) ((u64)((s64)(x) % (s64)(y)))
#define ROTL(x, y, mask) (((x) << ((y) & (mask))) | ((x) >> (((mask) - (y) + 1) & (mask))))
#define I32_ROTL(x, y) ROTL(x, y, 31)
#define I64_ROTL(x, y) ROTL(x, y, 63)
#define ROTR(x, y, mask) (((x) >> ((y) & (mask))) | ((x) << (((mask) - (y) + 1) & (mask))))
#define I32_ROTR(x, y) ROTR(x, y, 31)
#define I64_ROTR(x, y) ROTR(x, y, 63)

/* A number out of the range of the result gives its nearest value, NaN gives zero. */
#define SATURATE(result, type, least, beyond, greatest, x)                                   \
    ((x) != (x) ? (result)0                                                                  \
     : !((x) >= (least)) ? (result)(type)(least)                                             \
     : !((x) < (beyond)) ? (result)(greatest)                                                \
                         : (result)(type)(x))
#define I32_TRUNC_SAT_S_F32(x) SATURATE(u32, s32, -2147483648.f, 2147483648.f, INT32_MAX, x)
#define I32_TRUNC_SAT_U_F32(x) SATURATE(u32, u32, 0.f, 4294967296.f, UINT32_MAX, x)
#define I64_TRUNC_SAT_S_F32(x) SATURATE(u64, s64, -9223372036854775808.f, 9223372036854775808.f, INT64_MAX, x)
#define I64_TRUNC_SAT_U_F32(x) SATURATE(u64, u64, 0.f, 18446744073709551616.f, UINT64_MAX, x)
#define I32_TRUNC_SAT_S_F64(x) SATURATE(u32, s32, -2147483648., 2147483648., INT32_MAX, x)
#define I32_TRUNC_SAT_U_F64(x) SATURATE(u32, u32, 0., 4294967296., UINT32_MAX, x)
#define I64_TRUNC_SAT_S_F64(x) SATURATE(u64, s64, -9223372036854775808., 9223372036854775808., INT64_MAX, x)
#define I64_TRUNC_SAT_U_F64(x) SATURATE(u64, u64, 0., 18446744073709551616., UINT64_MAX, x)

