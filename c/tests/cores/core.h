/* A C program on an emulated core: `run` is its own; the rest is in core.c. */
#ifndef CORE_H
#define CORE_H

/* The program; returns 1 for success. */
int run(void);
/* Prints a text on the computer. */
void print(const char *text);
/* Ends the program, and says so. */
_Noreturn void finish(int is_success);

#endif
