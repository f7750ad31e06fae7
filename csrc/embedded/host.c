/* The build machine as a board: no clock, and time passes only while waiting. */
#include "board.h"

#include <stdio.h>
#include <string.h>

static void (*task_)(void);

void board_say(const char* text) { fwrite(text, 1, strlen(text), stdout); }
uint64_t board_instructions(void) { return 0; }
void board_every(uint32_t microseconds, void (*task)(void)) {
    (void)microseconds;
    task_ = task;
}
void board_wait(void) { task_(); }
