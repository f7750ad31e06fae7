/* gaident.h from C99, on the build machine: identifies the record on standard input, refuses what it must, and spoils on demand. Run by
 * test_drive_arithmetic.py, which knows the host's run.
 *
 *     in     kp ki sample_time peak, then command and velocity of every sample, as hexadecimal floats
 *     out    p q K fitness generation, as hexadecimal floats; exit code: the line where a check failed */
#include "gaident.h"

#include <math.h>
#include <stdio.h>

enum { samples = 250, generations = 30 };

static uint64_t memory[20480 / 8];
static double command[samples], velocity[samples];

#define CHECK(condition)                                            \
    do {                                                            \
        if (!(condition)) {                                         \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
            return 1;                                               \
        }                                                           \
    } while (0)

/* A search of the record, with `bad` in place of one sample; NULL where the settings are refused. */
static gaident_search* fed(const gaident_settings* settings, double bad) {
    gaident_search* g = gaident_configure(memory, sizeof memory, settings);
    for (int i = 0; g != NULL && i < samples; ++i) gaident_feed(g, command[i], i == 100 && bad != 0.0 ? bad : velocity[i]);
    return g;
}

#define REFUSED(field, value)                                              \
    do {                                                                   \
        gaident_settings changed = settings;                               \
        changed.field = (value);                                           \
        CHECK(gaident_configure(memory, sizeof memory, &changed) == NULL); \
    } while (0)

int main(void) {
    gaident_loop loop;
    CHECK(scanf("%lf %lf %lf %lf", &loop.controller.kp, &loop.controller.ki, &loop.sample_time, &loop.peak) == 4);
    for (int i = 0; i < samples; ++i) CHECK(scanf("%lf %lf", &command[i], &velocity[i]) == 2);
    gaident_settings settings = gaident_paper_settings(loop);
    settings.seed = 1;
    gaident_model model;

    CHECK(gaident_version() == GAIDENT_H_VERSION);
    CHECK(gaident_bytes() <= sizeof memory);
    CHECK(gaident_configure(NULL, sizeof memory, &settings) == NULL);
    CHECK(gaident_configure(memory, sizeof memory, NULL) == NULL);
    CHECK(gaident_configure(memory, gaident_bytes() - 1, &settings) == NULL);
    CHECK(gaident_configure((char*)memory + 4, sizeof memory - 4, &settings) == NULL);
    const double none[] = {NAN, INFINITY, -1.0, 1e-40};
    for (int i = 0; i < 4; ++i) {
        REFUSED(loop.controller.kp, none[i]);
        REFUSED(loop.controller.ki, none[i]);
        REFUSED(loop.sample_time, none[i]);
        REFUSED(loop.peak, none[i]);
        REFUSED(crossover, i < 3 ? none[i] : 1.1);
        REFUSED(mutation, none[i]);
        REFUSED(error_weight, i < 3 ? none[i] : 1e20);
        REFUSED(order_weight, i < 3 ? none[i] : 1e40);
    }
    REFUSED(tournament, 0);
    REFUSED(tournament, 51);

    /* A sample that is none, or far beyond the peak, is told, and no model comes of it. */
    const double bad[] = {NAN, INFINITY, -2.1 * loop.peak, 1e300};
    for (int i = 0; i < 4; ++i) {
        gaident_search* g = fed(&settings, bad[i]);
        CHECK(g != NULL && gaident_ready(g) == -1);
        CHECK(gaident_run(g, 1) == 1 && gaident_best(g, &model) == 0);
    }

    gaident_search* g = gaident_configure(memory, sizeof memory, &settings);
    CHECK(g != NULL && gaident_ready(g) == 0 && gaident_run(g, 2) == 0 && gaident_work(g, 2) == 0 &&
          gaident_best(g, &model) == 0);
    for (int i = 0; i < samples; ++i) CHECK(gaident_feed(g, command[i], velocity[i]) == 1);
    CHECK(gaident_feed(g, NAN, NAN) == 0 && gaident_ready(g) == 1 && gaident_best(g, &model) == 0);
    while (gaident_work(g, 7) < generations - 1) {
    }
    CHECK(gaident_run(g, 1) == generations && gaident_run(g, 0) == generations && gaident_work(g, 0) == generations);
    CHECK(gaident_best(g, &model) == 1 && model.generations == generations);
    printf("%d %d %a %a %d\n", model.p, model.q, model.gain, model.fitness, model.generation);
    return 0;
}
