/* What a compiler without a C library calls; the compiled library brings its own. */
#include <stddef.h>

void *memcpy(void *to, const void *from, size_t count);
void *memmove(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);

void *memcpy(void *to, const void *from, size_t count) {
  unsigned char *target = to;
  const unsigned char *source = from;
  for (size_t k = 0; k < count; k++) {
    target[k] = source[k];
    __asm volatile(""); /* Not turned into a call of itself. */
  }
  return to;
}

void *memmove(void *to, const void *from, size_t count) {
  unsigned char *target = to;
  const unsigned char *source = from;
  if (target <= source) return memcpy(to, from, count);
  for (size_t k = count; k > 0; k--) {
    target[k - 1] = source[k - 1];
    __asm volatile("");
  }
  return to;
}

void *memset(void *to, int value, size_t count) {
  unsigned char *target = to;
  for (size_t k = 0; k < count; k++) {
    target[k] = (unsigned char)value;
    __asm volatile("");
  }
  return to;
}
