/* Replays the linked golden trace on this computer. */
#include <stdio.h>

#include "replay.h"

int main(void) {
  int is_equal = replay();
  puts(is_equal ? "equal" : "different");
  return !is_equal;
}
