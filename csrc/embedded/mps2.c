/* QEMU's mps2-an386 (Cortex-M4F) and mps2-an500 (Cortex-M7): start, semihosting, clock. With `-icount shift=3` an instruction takes 8 ns of
 * the emulated time, as on a 125 MHz processor that executes one per cycle, and the 25 MHz timers count 5 instructions per tick. */
#include "board.h"

#include <stddef.h>

#define REGISTER(address) (*(volatile uint32_t*)(address))

/* ---------------------------------------------------------------------------------------- semihosting (Arm IHI 0048) */

static int semihosting(int operation, const void* argument) {
    register int r0 __asm__("r0") = operation;
    register const void* r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void board_say(const char* text) { semihosting(0x04, text); } /* SYS_WRITE0 */

static void leave(int code) {
    const uint32_t block[2] = {0x20026, (uint32_t)code}; /* ADP_Stopped_ApplicationExit */
    semihosting(0x20, block);                            /* SYS_EXIT_EXTENDED */
    for (;;) {
    }
}

/* -------------------------------------------------------------------------------------------------------------- clock */

enum { timer0 = 0x40000000, systick = 0xE000E010, ticks_per_microsecond = 25, instructions_per_tick = 5 };

uint64_t board_instructions(void) {
    static uint32_t last;
    static uint64_t ticks;
    const uint32_t now = 0xFFFFFFFFU - REGISTER(timer0 + 4); /* counts down */
    ticks += (uint32_t)(now - last);
    last = now;
    return ticks * instructions_per_tick;
}

static void (*task_)(void);

void board_every(uint32_t microseconds, void (*task)(void)) {
    task_ = task;
    REGISTER(systick + 4) = microseconds * ticks_per_microsecond - 1;
    REGISTER(systick + 8) = 0;
    REGISTER(systick) = 7; /* processor clock, interrupt, on */
}

void board_wait(void) { __asm__ volatile("wfi"); }

/* -------------------------------------------------------------------------------------------------------------- start */

extern uint32_t stack_top, data_begin, data_end, data_in_flash, bss_begin, bss_end;
int main(void);

/* The compiler may call these. */
void* memcpy(void* restrict to, const void* restrict from, size_t n) {
    unsigned char* t = to;
    const unsigned char* f = from;
    while (n-- > 0) *t++ = *f++;
    return to;
}
void* memset(void* to, int value, size_t n) {
    unsigned char* t = to;
    while (n-- > 0) *t++ = (unsigned char)value;
    return to;
}

void reset(void) {
    REGISTER(0xE000ED88) |= 0xFU << 20; /* CPACR: the floating-point unit on */
    __asm__ volatile("dsb\n\tisb");
    for (uint32_t *to = &data_begin, *from = &data_in_flash; to < &data_end;) *to++ = *from++;
    for (uint32_t* to = &bss_begin; to < &bss_end;) *to++ = 0;
    REGISTER(timer0 + 8) = 0xFFFFFFFFU; /* reload */
    REGISTER(timer0 + 4) = 0xFFFFFFFFU;
    REGISTER(timer0) = 1; /* on */
    leave(main());
}

static void stop(void) {
    board_say("fault\n");
    leave(1);
}

static void on_systick(void) { task_(); }

__attribute__((section(".vectors"), used)) static const struct {
    void* stack;
    void (*handlers[15])(void);
} vectors = {&stack_top, {reset, stop, stop, stop, stop, stop, 0, 0, 0, 0, stop, stop, 0, stop, on_systick}};
