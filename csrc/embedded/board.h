/* What the programs need of the machine they run on: the emulated board (mps2.c) or the build machine (host.c). */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Writes text to whoever started the program. */
void board_say(const char* text);

/* Instructions executed so far, within 5; 0 on the build machine. */
uint64_t board_instructions(void);

/* Calls `task` every `microseconds` from an interrupt, or on the build machine once per board_wait(). */
void board_every(uint32_t microseconds, void (*task)(void));
void board_wait(void);

#ifdef __cplusplus
}
#endif

#endif
