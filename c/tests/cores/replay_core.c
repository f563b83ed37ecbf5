/* Replays the linked golden trace on an emulated core. */
#include "../replay.h"
#include "core.h"

int run(void) { return replay(); }
