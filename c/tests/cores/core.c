/* Start-up and semihosting of a C program on an emulated core. */
#include "core.h"

#include <stddef.h>
#include <stdint.h>

extern uint32_t _bss, _bss_end, _stack_top;

enum { WRITE = 0x04, EXIT = 0x18, EXITED = 0x20026, FAILED = 0x20023 };

#if defined(__arm__)
extern uint32_t _data, _data_end, _data_image;

void reset(void);

static void fault(void) { finish(0); }

/* The initial stack pointer, reset, and the faults. */
__attribute__((section(".vectors"), used)) static const struct {
  const void *stack;
  void (*handlers[15])(void);
} vectors = {&_stack_top, {reset, fault, fault, fault, fault, fault}};

static void semihosting(uint32_t operation, const void *argument) {
  register uint32_t r0 __asm("r0") = operation;
  register const void *r1 __asm("r1") = argument;
  __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

static void prepare(void) {
  const uint32_t *from = &_data_image;
  for (uint32_t *to = &_data; to < &_data_end; to++) *to = *from++;
#if defined(__ARM_FP)
  /* The FPU: full access to coprocessors 10 and 11. */
  *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
  __asm volatile("dsb\nisb");
#endif
}
#else
__asm(".section .reset\n.global reset\nreset:\nla sp, _stack_top\nj start\n.text\n");

static void semihosting(uint32_t operation, const void *argument) {
  register uint32_t a0 __asm("a0") = operation;
  register const void *a1 __asm("a1") = argument;
  __asm volatile(".balign 16\n.option push\n.option norvc\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                 : "+r"(a0)
                 : "r"(a1)
                 : "memory");
}

static void prepare(void) {}
#endif

/* Not inlined into a function that uses floating point before the FPU is enabled. */
__attribute__((noinline, used)) void start(void) {
  prepare();
  for (uint32_t *word = &_bss; word < &_bss_end; word++) *word = 0;
  finish(run());
}

#if defined(__arm__)
void reset(void) { start(); }
#endif

void print(const char *text) { semihosting(WRITE, text); }

void finish(int is_success) {
  print(is_success ? "equal\n" : "different\n");
  semihosting(EXIT, (const void *)(uintptr_t)(is_success ? EXITED : FAILED));
  for (;;) {
  }
}
