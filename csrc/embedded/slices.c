/* gaident in a drive's program: the control task takes a sample every 444 us in an interrupt, the background task identifies in slices of
 * 5 individuals, and the control task misses nothing. The drive itself is played from the record. C99. */
#include "board.h"
#include "gaident.h"
#include "record.h" /* made by make_tables.cpp */

enum { bytes = 20480, wanted_generations = 40, individuals = 5 };

static uint64_t memory[bytes / 8];
static gaident_search* search;
static volatile uint32_t control_samples; /* since the start */

/* The control task: it would read the encoder and command a torque here. */
static void control(void) {
    const uint32_t k = control_samples % recorded_samples;
    if (control_samples < recorded_samples) gaident_feed(search, recorded_command[k], recorded_velocity[k]);
    ++control_samples;
}

static void say_number(const char* what, uint64_t n) {
    char text[24];
    int k = 23;
    text[k] = '\0';
    do {
        text[--k] = (char)('0' + n % 10);
        n /= 10;
    } while (n > 0);
    board_say(what);
    board_say(text + k);
}

int main(void) {
    const gaident_loop loop = {
        .controller = {.kp = recorded_kp, .ki = recorded_ki},
        .sample_time = recorded_sample_time,
        .peak = 50.0,
    };
    gaident_settings settings = gaident_paper_settings(loop);
    settings.seed = 1;
    search = gaident_configure(memory, sizeof memory, &settings);
    if (search == 0) {
        say_number("gaident_configure needs bytes: ", gaident_bytes());
        board_say("\n");
        return 1;
    }
    board_every(444, control);
    while (!gaident_ready(search)) board_wait();
    board_say("# record full; searching\n");

    uint64_t longest = 0, slices = 0;
    const uint32_t samples_before = control_samples;
    const uint64_t begin = board_instructions();
    uint64_t before = begin;
    while (gaident_work(search, individuals) < wanted_generations) {
        const uint64_t now = board_instructions();
        if (now - before > longest) longest = now - before;
        before = now;
        ++slices;
    }
    const uint64_t took = board_instructions() - begin;
    const uint32_t samples = control_samples - samples_before;

    gaident_model model;
    if (gaident_best(search, &model) == 0) return 1;
    say_number("generations ", (uint64_t)model.generations);
    say_number(" best of generation ", (uint64_t)model.generation);
    say_number(" p ", (uint64_t)model.p);
    say_number(" q ", (uint64_t)model.q);
    say_number(" K ", (uint64_t)model.gain);
    say_number(" fitness ", (uint64_t)model.fitness);
    board_say("\n");
    say_number("# slices ", slices);
    say_number(", longest ", longest);
    say_number(" instructions (interrupts included); control samples meanwhile ", samples);
    say_number(", expected ", took / (444 * 125));
    board_say("\n");
    if (took > 0 && (samples + 1 < took / (444 * 125) || samples > took / (444 * 125) + 1)) {
        board_say("the control task missed samples\n");
        return 1;
    }
    return 0;
}
