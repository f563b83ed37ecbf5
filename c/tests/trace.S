/* The trace: -DTRACE="file". */
    .section .rodata
    .global trace
    .balign 8
trace:
    .incbin TRACE
#if defined(__linux__) && defined(__ELF__)
    .section .note.GNU-stack, "", %progbits
#endif
