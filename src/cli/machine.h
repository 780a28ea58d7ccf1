/* machine.h - what figures of speed were measured on. */
#ifndef SKINSPEC_CLI_MACHINE_H
#define SKINSPEC_CLI_MACHINE_H

enum { MACHINE_TEXT_SIZE = 160 };

/* "Intel Xeon (family 6, model 207), 2 cores, AVX-512; gcc 12.2.0; load 0.4; 2026-01-31": the
 * processor as /proc/cpuinfo has it without marks and clock rate, load of the last minute. */
const char *machine_text(char text[MACHINE_TEXT_SIZE]);

#endif
